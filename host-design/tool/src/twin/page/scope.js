// Scopes: curves over the last seconds, with zoom, a cursor and a picture.

import { colour, dash } from './colours.js';
import { context } from './rig.js';

const CAPACITY = 1 << 14; // telemetry messages that are kept
const LONGEST_S = 60;
const SHORTEST_S = 0.2;
const DEGREES = 180 / Math.PI;
const MARGIN = { left: 58, right: 6, top: 6, bottom: 18 };

// The scopes: curves, each with its name and its value in a telemetry message, and the smallest range that is shown.
function panels(hello) {
  const joints = hello.sensors.map((name, sensor) => ({ name, sensor })).slice(1);
  const each = (value) => joints.map(({ name, sensor }) => ({ name, value: (t) => value(t, sensor) }));
  return [
    { title: 'position (m)', least: 0.01, curves: [
      { name: 'cart', value: (t) => t.estimate[0] }, { name: 'set-point', value: (t) => t.setpoint_m }] },
    { title: 'angles (°)', least: 0.5, curves: each((t, sensor) => t.estimate[2 * sensor] * DEGREES) },
    { title: 'rates (°/s)', least: 10, curves: each((t, sensor) => t.estimate[2 * sensor + 1] * DEGREES) },
    { title: 'force (N)', least: 0.2, curves: [
      { name: 'requested', value: (t) => t.requested_n }, { name: 'applied', value: (t) => t.applied_n }] },
    { title: 'innovation (mm, mrad)', least: 0.1, curves: hello.sensors.map((name, sensor) => (
      { name, value: (t) => t.innovation[sensor] * 1e3 })) },
    { title: 'tick (processor cycles)', least: 10, curves: [
      { name: 'cycles', value: (t) => t.cycles }, { name: 'worst', value: (t) => t.worst_cycles }] },
  ].filter((panel) => panel.curves.length > 0);
}

// Telemetry in rings of a fixed size.
class History {
  constructor(curves) {
    this.times = new Float64Array(CAPACITY);
    this.values = curves.map(() => new Float32Array(CAPACITY));
    this.curves = curves;
    this.length = 0;
  }

  push(t, telemetry) {
    const slot = this.length % CAPACITY;
    this.times[slot] = t;
    this.curves.forEach((curve, i) => { this.values[i][slot] = curve.value(telemetry) ?? NaN; });
    this.length += 1;
  }

  get first() { return Math.max(0, this.length - CAPACITY); }

  time(index) { return this.times[index % CAPACITY]; }

  get last() { return this.length > 0 ? this.time(this.length - 1) : 0; }

  // Index of the first telemetry message at or after a time.
  after(t) {
    let [low, high] = [this.first, this.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < t) low = middle + 1; else high = middle;
    }
    return low;
  }
}

export class Scopes {
  constructor(place, hello) {
    this.hello = hello;
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

  add(place, { title, least, curves }) {
    const element = document.createElement('div');
    element.className = 'panel';
    const legend = document.createElement('div');
    legend.className = 'legend';
    const name = document.createElement('b');
    name.textContent = title;
    legend.append(name);
    const values = curves.map((curve, i) => {
      const entry = document.createElement('span');
      const style = `stroke: ${this.ink(i)}; stroke-width: 2; stroke-dasharray: ${dash(i).join(' ') || 'none'}`;
      const sample = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
      const stroke = document.createElementNS('http://www.w3.org/2000/svg', 'line');
      for (const [key, value] of Object.entries({ x1: 0, x2: 28, y1: 6, y2: 6 })) stroke.setAttribute(key, value);
      stroke.style.cssText = style;
      sample.append(stroke);
      const value = document.createElement('span');
      entry.append(sample, ` ${curve.name} `, value);
      legend.append(entry);
      return value;
    });
    const canvas = document.createElement('canvas');
    canvas.tabIndex = 0;
    canvas.setAttribute('aria-label', `${title}: arrow keys move the cursor, + and − zoom`);
    element.append(legend, canvas);
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
    return { title, least, curves, canvas, values };
  }

  ink(number) { return colour(`--c${number % 6}`); }

  push(telemetry) {
    const t = telemetry.tick * this.hello.tick_s;
    if (t < this.history.last) this.history.length = 0; // the firmware has started again
    this.history.push(t, telemetry);
  }

  zoom(factor) { this.span = Math.min(LONGEST_S, Math.max(SHORTEST_S, this.span * factor)); }

  hold(isHeld) {
    this.isHeld = isHeld;
    this.heldAt = this.history.last;
    this.back = 0;
  }

  // Draws one panel per call, in turn, so that every frame takes equally long.
  drawNext() {
    this.end = (this.isHeld ? this.heldAt : this.history.last) + this.back;
    this.drawn = (this.drawn + 1) % this.panels.length;
    this.drawPanel(this.panels[this.drawn]);
  }

  drawPanel(panel) {
    const { draw, width, height } = context(panel.canvas);
    const begin = this.end - this.span;
    const [from, to] = [this.history.after(begin), this.history.after(this.end + 1e-9)];
    const rows = panel.curves.map((_, i) => this.history.values[panel.offset + i]);
    let [low, high] = [Infinity, -Infinity];
    for (const row of rows) {
      for (let k = from; k < to; k += 1) {
        const value = row[k % CAPACITY];
        if (value < low) low = value;
        if (value > high) high = value;
      }
    }
    if (low > high) [low, high] = [0, 0];
    const room = Math.max(0.08 * (high - low), 0.5 * (panel.least - (high - low)));
    [low, high] = [low - room, high + room];
    const x = (t) => MARGIN.left + ((width - MARGIN.left - MARGIN.right) * (t - begin)) / this.span;
    const y = (value) => MARGIN.top + ((height - MARGIN.top - MARGIN.bottom) * (high - value)) / (high - low);
    this.axes(draw, { x, y, low, high, begin, width, height });
    rows.forEach((row, i) => {
      draw.strokeStyle = this.ink(i);
      draw.setLineDash(dash(i));
      draw.lineWidth = 1.6;
      draw.beginPath();
      for (let k = from; k < to; k += 1) draw.lineTo(x(this.history.time(k)), y(row[k % CAPACITY]));
      draw.stroke();
    });
    draw.setLineDash([]);
    const index = this.cursor === null ? this.history.length - 1 : this.history.after(this.cursor);
    if (this.cursor !== null) {
      draw.strokeStyle = colour('--cursor');
      draw.beginPath();
      draw.moveTo(x(this.cursor), 0);
      draw.lineTo(x(this.cursor), height);
      draw.stroke();
    }
    const isThere = index >= this.history.first && index < this.history.length;
    panel.values.forEach((place, i) => {
      place.textContent = isThere ? Number(rows[i][index % CAPACITY].toPrecision(4)).toString() : '–';
    });
  }

  axes(draw, { x, y, low, high, begin, width, height }) {
    draw.strokeStyle = colour('--rule');
    draw.fillStyle = colour('--muted');
    draw.font = '12px system-ui, sans-serif';
    draw.lineWidth = 1;
    draw.textAlign = 'right';
    const step = niceStep((high - low) / 4);
    for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
      draw.beginPath();
      draw.moveTo(MARGIN.left, y(value));
      draw.lineTo(width - MARGIN.right, y(value));
      draw.stroke();
      draw.fillText(Number(value.toPrecision(3)).toString(), MARGIN.left - 6, y(value) + 4);
    }
    draw.textAlign = 'center';
    const seconds = niceStep(this.span / 5);
    for (let t = Math.ceil(Math.max(0, begin) / seconds) * seconds; t <= this.end; t += seconds) {
      draw.fillText(`${Number(t.toFixed(2))} s`, Math.min(x(t), width - 24), height - 4);
    }
  }

  // All scopes, one below the other, as the data URL of a PNG.
  picture() {
    const sizes = this.panels.map(({ canvas }) => [canvas.width, canvas.height]);
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
    for (const panel of this.panels) {
      draw.fillText(`${panel.title}: ${panel.curves.map((curve) => curve.name).join(', ')}`, 8, top + 0.75 * head);
      draw.drawImage(panel.canvas, 0, top + head);
      top += head + panel.canvas.height;
    }
    return sheet.toDataURL('image/png');
  }
}

// 1, 2 or 5 times a power of ten, at least `size`.
function niceStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= size);
}
