// Scopes: curves over the last seconds, with zoom, a cursor and a picture.

import { colour, dash } from './colours.js';
import { isEstimated, isHomed, isOn } from './guide.js';
import { CAPACITY, ESTIMATED, History, UNKNOWN } from './history.js';
import { context } from './rig.js';
import { niceStep, roundValues, turnsOf, within } from './scale.js';
import { capital } from './words.js';

const LONGEST_S = 60;
const SHORTEST_S = 0.2;
const DEGREES = 180 / Math.PI;
const MARGIN = { left: 52, right: 6, top: 6, bottom: 6 };
const NARROW = matchMedia('(max-width: 50rem)');
const AXIS_PX = 18;

// The scopes: curves, each with its name, its value in a telemetry message, and its limit, beside the smallest range
// that is shown and what is said where there is no value.
function panels(hello) {
  const { noun, position: [name, unit], force: [, force] } = hello.base;
  const [input, inputUnit] = hello.input;
  const joints = hello.sensors.map((name, sensor) => ({ name, sensor })).slice(1);
  const each = (value) => joints.map(({ name, sensor }) => ({ name, value: (t) => value(t, sensor), ink: `--c${(sensor - 1) % 6}` }));
  const estimate = (index, factor = 1) => (t) => (isEstimated(t) ? t.estimate[index] * factor : NaN);
  const motor = (name) => (t) => (isOn(t) ? t[name] : NaN);
  return [
    { title: 'Angle', unit: '°', least: 0.5, turn: 360, without: 'no estimate', limits: [1, -1].map((side) => side * hello.angle_limit_rad * DEGREES),
      curves: joints.map(({ name, sensor }) => ({ name, value: estimate(2 * sensor, DEGREES), seen: (state) => state[2 * sensor] * DEGREES, ink: `--c${(sensor - 1) % 6}` })) },
    { title: capital(name), unit, least: 0.01, without: 'no estimate', limits: hello.soft_m, curves: [
      { name: noun, value: estimate(0), seen: (state) => state[0], ink: '--ink' }, { name: 'set-point', value: (t) => t.setpoint_m, ink: '--link' }] },
    // A force says little while nothing happens.
    { title: capital(input), unit: inputUnit, isLate: inputUnit === force, least: Math.min(0.2, 0.1 * hello.force_limit_n), without: 'motor off', limits: [hello.force_limit_n, -hello.force_limit_n], curves: [
      { name: 'requested', value: motor('requested_n'), ink: '--c1' }, { name: 'applied', value: motor('applied_n'), ink: '--ink' }] },
    { title: 'Rate', unit: '°/s', least: 10, without: 'no estimate', curves: each((t, sensor) => estimate(2 * sensor + 1, DEGREES)(t)) },
    { title: 'Surprise', unit: [...new Set([`m${unit}`, 'mrad'])].join(', '), least: 0.1, without: 'no prediction', curves: hello.sensors.map((name, sensor) => (
      { name, value: (t) => (isEstimated(t) ? t.innovation[sensor] * 1e3 : NaN), ink: sensor === 0 ? '--ink' : `--c${(sensor - 1) % 6}` })) },
    { title: 'Tick', unit: 'processor cycles', least: 10, curves: [
      { name: 'cycles', value: (t) => t.cycles, ink: '--ink' }, { name: 'worst', value: (t) => t.worst_cycles, ink: '--c1' }] },
  ].filter((panel) => panel.curves.length > 0);
}

export class Scopes {
  constructor(place, axis, hello) {
    this.hello = hello;
    this.axis = axis;
    this.events = [];
    this.before = { state: null, pull: null };
    this.span = 10;
    this.isHeld = false;
    this.end = 0;
    this.back = 0;
    this.cursor = null;
    this.drawn = 0;
    place.replaceChildren();
    this.panels = panels(hello).map((panel) => this.add(place, panel));
    this.history = new History(this.panels.flatMap((panel) => panel.curves));
    let offset = 0;
    for (const panel of this.panels) {
      panel.offset = offset;
      offset += panel.curves.length;
    }
  }

  add(place, panel) {
    const { title, unit, curves } = panel;
    const element = document.createElement('div');
    element.className = 'panel';
    const legend = document.createElement('div');
    legend.className = 'legend';
    const name = document.createElement('b');
    name.textContent = `${title} `;
    name.append(Object.assign(document.createElement('small'), { textContent: unit, className: 'note' }));
    legend.append(name);
    const values = curves.map((curve, i) => {
      const entry = document.createElement('span');
      const style = `stroke: ${colour(curve.ink)}; stroke-width: 2; stroke-dasharray: ${dash(i).join(' ') || 'none'}`;
      const sample = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      const stroke = document.createElementNS('http://www.w3.org/2000/svg', 'line');
      for (const [key, value] of Object.entries({ x1: 0, x2: 28, y1: 6, y2: 6 })) stroke.setAttribute(key, value);
      stroke.style.cssText = style;
      sample.append(stroke);
      const value = document.createElement('i');
      entry.append(sample, ` ${curve.name} `, value);
      legend.append(entry);
      return value;
    });
    const canvas = document.createElement('canvas');
    canvas.tabIndex = 0;
    canvas.setAttribute('aria-label', `${title}: arrow keys move the cursor, + and − zoom`);
    const box = document.createElement('div');
    box.className = 'canvas';
    box.append(canvas);
    element.append(legend, box);
    place.append(element);
    const at = (event) => this.end - this.span + (this.span * (event.offsetX - MARGIN.left)) / (canvas.clientWidth - MARGIN.left - MARGIN.right);
    canvas.addEventListener('pointermove', (event) => { this.cursor = at(event); });
    canvas.addEventListener('pointerleave', () => { this.cursor = null; });
    canvas.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8);
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => {
      const step = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
      if (step !== undefined) this.cursor = (this.cursor ?? this.end - this.span / 2) + step * this.span;
      if (event.key === '+') this.zoom(0.8);
      if (event.key === '-') this.zoom(1.25);
    });
    // A scope that has nothing to say is not there; the first two are, to say so.
    element.hidden = panel.limits === undefined || panel.isLate === true;
    return { ...panel, canvas, values, element };
  }

  push(telemetry, machine) {
    const t = telemetry.tick * this.hello.tick_s;
    if (t < this.history.last) { // the firmware has started again, or a run goes on from what was kept of it
      this.history.cut(t);
      this.events = this.events.filter((event) => event.t < t);
    }
    const isKnown = isHomed(telemetry) || telemetry.state === 'Fault';
    const state = isKnown ? machine?.state ?? (isHomed(telemetry) ? this.measured(telemetry) : null) : null;
    this.history.push(t, telemetry, state);
    for (const panel of this.panels) {
      if (panel.element.hidden) panel.element.hidden = !panel.curves.some(({ value }) => Math.abs(value(telemetry)) > 0);
    }
    this.note(t, telemetry, machine?.pull ?? null);
  }

  // Text from which another page of the same rig shows the same curves.
  kept() {
    const { events, span, history, panels: all } = this;
    return JSON.stringify({ events, span, hidden: all.map(({ element }) => element.hidden), history: history.kept() });
  }

  restore(text) {
    const { events, span, hidden, history } = JSON.parse(text);
    Object.assign(this, { events, span });
    this.panels.forEach(({ element }, i) => { element.hidden = hidden[i]; });
    this.history.restore(history);
  }

  // Events on the time axis: pulls with their largest force, and faults.
  note(t, telemetry, pull) {
    const { before, events } = this;
    if (telemetry.state === 'Fault' && before.state !== 'Fault' && before.state !== null) events.push({ t, text: '× off', style: '--bad' });
    if (pull !== null && before.pull === null && telemetry.state !== 'Fault') events.push({ t, text: '', style: '--ink', force_n: 0 });
    if (pull !== null && telemetry.state !== 'Fault') {
      const event = events.findLast(({ force_n: force }) => force !== undefined);
      const force = Math.hypot(...pull.force_n);
      if (event !== undefined && force > event.force_n) Object.assign(event, { force_n: force, text: `▸ ${force.toFixed(2)} N` });
    }
    Object.assign(before, { state: telemetry.state, pull });
    while (events.length > 0 && events[0].t < t - LONGEST_S) events.shift();
  }

  // The state as far as the firmware knows it: its estimate, else the encoders' positions, else hanging.
  measured(telemetry) {
    if (isEstimated(telemetry)) return telemetry.estimate;
    const state = new Array(telemetry.estimate.length).fill(0);
    const { step } = this.hello;
    if (isHomed(telemetry) && step !== null) step.forEach((size, sensor) => { state[2 * sensor] = size * telemetry.counts[sensor]; });
    else if (state.length > 2) state[2] = Math.PI;
    return state;
  }

  zoom(factor) { this.span = Math.min(LONGEST_S, Math.max(SHORTEST_S, this.span * factor)); }

  hold(isHeld) {
    this.isHeld = isHeld;
    this.heldAt = this.history.last;
    this.back = 0;
  }

  // Draws one panel per call, in turn, so that every frame takes equally long; after the last one the time axis.
  drawNext() {
    this.end = (this.isHeld ? this.heldAt : this.history.last) + this.back;
    const shown = this.panels.filter(({ element, canvas }) => !element.hidden && canvas.clientHeight > 0);
    this.drawn = this.drawn < shown.length ? this.drawn + 1 : 0;
    if (this.drawn < shown.length) this.drawPanel(shown[this.drawn]);
    else if (this.axis.clientHeight > 0) this.drawAxis();
  }

  x(width) {
    const begin = this.end - this.span;
    return (t) => MARGIN.left + ((width - MARGIN.left - MARGIN.right) * (t - begin)) / this.span;
  }

  range({ least, turn }, rows, from, to) {
    let [low, high] = [Infinity, -Infinity];
    for (const row of rows) {
      for (let k = from; k < to; k += 1) {
        const value = within(row[k % CAPACITY], turn);
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (low > high) [low, high] = [0, 0];
    const room = Math.max(0.08 * (high - low), 0.5 * (least - (high - low)));
    return [low - room, high + room];
  }

  drawPanel(panel) {
    const { draw, width, height } = context(panel.canvas);
    const { history } = this;
    const [from, to] = [history.after(this.end - this.span), history.after(this.end + 1e-9)];
    const of = (rows) => panel.curves.map((_, i) => rows[panel.offset + i]);
    const [rows, seen] = [of(history.values), of(history.seen)];
    const [low, high] = this.range(panel, [...rows, ...seen.filter((row) => row !== null)], from, to);
    const bottom = MARGIN.bottom + (NARROW.matches ? AXIS_PX : 0);
    const x = this.x(width);
    const y = (value) => MARGIN.top + ((height - MARGIN.top - bottom) * (high - value)) / (high - low);
    this.gone(draw, panel, { x, from, to, height });
    this.levels(draw, panel, { y, low, high, width });
    if (NARROW.matches) this.seconds(draw, x, height - 4);
    const curve = (row, i, thickness, pattern) => {
      draw.strokeStyle = colour(panel.curves[i].ink);
      draw.lineWidth = thickness;
      draw.setLineDash(pattern);
      draw.beginPath();
      let before = NaN;
      for (let k = from; k < to; k += 1) {
        const value = within(row[k % CAPACITY], panel.turn);
        // Where nothing is known, or where a turn is full, the curve begins again.
        const goesOn = Math.abs(value - before) < (panel.turn ?? Infinity) / 2;
        if (goesOn) draw.lineTo(x(history.time(k)), y(value));
        else if (!Number.isNaN(value)) draw.moveTo(x(history.time(k)), y(value));
        before = value;
      }
      draw.stroke();
    };
    seen.forEach((row, i) => { if (row !== null) curve(row, i, 1.6, [2, 3]); });
    rows.forEach((row, i) => curve(row, i, 1.6, dash(i)));
    draw.setLineDash([]);
    this.readout(draw, panel, { x, rows, seen, height });
  }

  // Where there is no estimate, and why.
  gone(draw, { without }, { x, from, to, height }) {
    if (without === undefined) return;
    const { history } = this;
    const isGone = (k) => history.known[k % CAPACITY] !== ESTIMATED;
    for (let k = from; k < to; k += 1) {
      if (!isGone(k)) continue;
      const begin = k;
      while (k + 1 < to && isGone(k + 1)) k += 1;
      const [left, right] = [x(history.time(begin)), x(history.time(k))];
      draw.fillStyle = colour('--rule');
      draw.globalAlpha = 0.35;
      draw.fillRect(left, 0, right - left, height);
      draw.globalAlpha = 1;
      if (right - left < 90) continue;
      draw.fillStyle = colour('--muted');
      draw.font = '12px system-ui, sans-serif';
      draw.textAlign = 'right';
      draw.fillText(history.known[k % CAPACITY] === UNKNOWN ? 'unknown until homed' : without, right - 6, 16);
    }
  }

  readout(draw, panel, { x, rows, seen, height }) {
    const { history } = this;
    const index = this.cursor === null ? history.length - 1 : history.after(this.cursor);
    if (this.cursor !== null) {
      draw.strokeStyle = colour('--cursor');
      draw.beginPath();
      draw.moveTo(x(this.cursor), 0);
      draw.lineTo(x(this.cursor), height);
      draw.stroke();
    }
    const isThere = index >= history.first && index < history.length;
    const read = (row) => (row === null || !isThere ? NaN : row[index % CAPACITY]);
    panel.values.forEach((place, i) => {
      const [value, true_] = [read(rows[i]), read(seen[i])];
      const said = (all) => `${short(within(all, panel.turn))}${turnsOf(all, panel.turn)}`;
      const text = Number.isFinite(value) ? said(value) : Number.isFinite(true_) ? `(${said(true_)})` : '—';
      if (place.textContent !== text) place.textContent = text;
    });
  }

  // Lines at round values, and limits that are within the range.
  levels(draw, { limits = [] }, { y, low, high, width }) {
    const across = (value) => {
      draw.beginPath();
      draw.moveTo(MARGIN.left, y(value));
      draw.lineTo(width - MARGIN.right, y(value));
      draw.stroke();
    };
    draw.strokeStyle = colour('--rule');
    draw.fillStyle = colour('--muted');
    draw.font = '12px system-ui, sans-serif';
    draw.lineWidth = 1;
    draw.textAlign = 'right';
    const step = niceStep((high - low) / 5);
    for (const value of roundValues(low, high, step)) {
      across(value);
      draw.fillText(short(value), MARGIN.left - 6, y(value) + 4);
    }
    draw.strokeStyle = colour('--bad');
    draw.setLineDash([2, 4]);
    for (const limit of limits) if (limit > low && limit < high) across(limit);
    draw.setLineDash([]);
  }

  seconds(draw, x, y) {
    draw.fillStyle = colour('--muted');
    draw.font = '12px system-ui, sans-serif';
    draw.textAlign = 'center';
    const step = niceStep(this.span / 5);
    for (const t of roundValues(Math.max(0, this.end - this.span), this.end, step)) {
      if (x(t) < this.axis.clientWidth - 16 || NARROW.matches) draw.fillText(`${Number(t.toFixed(2))} s`, x(t), y);
    }
  }

  // The time axis of all scopes, with what happened.
  drawAxis() {
    const { draw, width } = context(this.axis);
    const x = this.x(width);
    this.seconds(draw, x, 13);
    draw.font = '600 12px system-ui, sans-serif';
    let free = 0;
    for (const { t, text, style } of this.events) {
      if (t < this.end - this.span || t > this.end || text === '') continue;
      const at = Math.max(free, Math.min(x(t), width - 50));
      draw.fillStyle = colour(style);
      draw.textAlign = 'left';
      draw.fillText(text, at, 32);
      free = at + draw.measureText(text).width + 8;
    }
  }

  // All scopes, one below the other, as the data URL of a PNG.
  picture() {
    const shown = this.panels.filter(({ element }) => !element.hidden);
    const sizes = shown.map(({ canvas }) => [canvas.width, canvas.height]);
    const sheet = document.createElement('canvas');
    const head = 24 * (window.devicePixelRatio || 1);
    sheet.width = Math.max(...sizes.map(([width]) => width));
    sheet.height = sizes.reduce((sum, [, height]) => sum + height + head, 0);
    const draw = sheet.getContext('2d');
    draw.fillStyle = colour('--paper');
    draw.fillRect(0, 0, sheet.width, sheet.height);
    draw.fillStyle = colour('--ink');
    draw.font = `${0.6 * head}px system-ui, sans-serif`;
    let top = 0;
    for (const panel of shown) {
      draw.fillText(`${panel.title} (${panel.unit}): ${panel.curves.map((curve) => curve.name).join(', ')}`, 8, top + 0.75 * head);
      draw.drawImage(panel.canvas, 0, top + head);
      top += head + panel.canvas.height;
    }
    return sheet.toDataURL('image/png');
  }
}

const short = (value) => Number(value.toPrecision(3)).toString().replace('-', '−');
