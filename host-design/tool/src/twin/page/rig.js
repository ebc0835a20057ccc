// The rig to scale: draws it, and turns pointer and keys into pulls. An arm is seen from outside, its end as a cart, and
// from above beside that.

import { drawAbove, placeAbove } from './above.js';
import { colour } from './colours.js';
import { newtons } from './guide.js';
import { roundValues } from './scale.js';

const NEAR_PX = 28; // how near the pointer has to be to a body
const BELOW_PX = 64; // of the rail's numbers and the set-point, below the cart
const CART = { width: 0.14, height: 0.07 }; // in lengths of the chain
const KEY_PULL = 0.35; // pull by an arrow key, in lengths of the chain
// Part of the way to where the camera is aimed that it moves in a frame; with reduced motion, it cuts.
const GLIDE = matchMedia('(prefers-reduced-motion: reduce)').matches ? 1 : 0.12;
const TRAIL_S = GLIDE === 1 ? 0.7 : 1.5;
const TO_SHRINK = 0.55; // smallest scale at which the whole rail is shown, as a part of the usual one

// Joints of the chain: its foot, then the end of each link (m); `arc` is the way of the foot per unit of its position.
export function joints(lengths, state, arc) {
  const points = [[arc * state[0], 0]];
  let angle = 0;
  lengths.forEach((length, link) => {
    angle += state[2 + 2 * link];
    const [x, y] = points[link];
    points.push([x - length * Math.sin(angle), y + length * Math.cos(angle)]);
  });
  return points;
}

// Sizes the canvas as it is shown, in device pixels; returns its context, scaled to CSS pixels.
export function context(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const draw = canvas.getContext('2d');
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, width, height);
  return { draw, width, height };
}

export class RigView {
  // `pull(body, along, x, y)`, `letGo()` and `moveTo(setpoint)` carry out what the person does.
  constructor(canvas, rail, hello, act) {
    Object.assign(this, { canvas, rail, act, camera: null, grip: null, keys: new Set() });
    this.takes(hello);
    this.listen();
  }

  // Another rig comes to the same place.
  takes(hello) {
    Object.assign(this, { hello, state: null, trail: [], body: hello.lengths_m.length });
    this.reach = hello.lengths_m.reduce((sum, length) => sum + length, 0);
    // From here on, the foot is where it is in the links' plane (m).
    const { noun, arc_m: arc, turns } = hello.base;
    const farthest = turns ? Math.PI : 1;
    this.arc = arc;
    this.travel = hello.travel_m.map((end, side) => arc * (end ?? [-farthest, farthest][side]));
    this.soft = hello.soft_m.map((x) => arc * x);
    this.canvas.setAttribute('aria-label', `The rig. Digits choose a body (0 is the ${noun}), arrow keys pull it.`);
  }

  joints(state) { return joints(this.hello.lengths_m, state, this.arc); }

  // Where the links' plane is drawn, and the view from above, if there is one.
  parts() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const { above, rest } = this.hello.base.turns ? placeAbove(width, height) : { above: null, rest: [0, 0, width, height] };
    const [left, top, right, bottom] = rest;
    return { above, right, x: (left + right) / 2, y: (top + bottom) / 2, width: right - left, height: bottom - top };
  }

  // CSS pixels per metre.
  get scale() { return this.camera.scale; }

  // Aims the camera: the upright half while it balances, else the full circle; the whole rail, if it fits.
  aim(state, isUp) {
    const { width, height } = this.parts();
    const [low, high] = this.travel;
    const usual = Math.min(height / ((isUp ? 1.6 : 2.5) * this.reach), width / ((isUp ? 1.2 : 2.2) * this.reach));
    const whole = (0.92 * width) / (high - low);
    const fits = whole > TO_SHRINK * usual;
    const scale = fits ? Math.min(usual, whole) : usual;
    const y = isUp ? Math.min(0.45 * this.reach, (height / 2 - BELOW_PX) / scale) : 0;
    const wanted = { scale, x: fits ? (low + high) / 2 : this.arc * state[0], y };
    this.rail.hidden = fits;
    if (this.camera === null) this.camera = wanted;
    // It does not move while the person pulls.
    if (this.grip !== null || this.keys.size > 0) return;
    for (const name of Object.keys(wanted)) this.camera[name] += GLIDE * (wanted[name] - this.camera[name]);
  }

  toScreen([x, y]) {
    const middle = this.parts();
    return [middle.x + (x - this.camera.x) * this.scale, middle.y - (y - this.camera.y) * this.scale];
  }

  toRig(px, py) {
    const middle = this.parts();
    return [this.camera.x + (px - middle.x) / this.scale, this.camera.y + (middle.y - py) / this.scale];
  }

  // Where the foot is meant to be by a pointer that went down in the view from above, or else in the links' plane (m).
  meant(px, py, isAbove) {
    if (!isAbove) return this.toRig(px, py)[0];
    const { above } = this.parts();
    const angle = Math.atan2(px - above.x, py - above.y);
    return this.arc * (angle + 2 * Math.PI * Math.round((this.state[0] - angle) / (2 * Math.PI)));
  }

  // Nearest body to a point of the screen: its number, and where on it.
  nearest(px, py) {
    const { above } = this.parts();
    const [fromAbove, upAbove] = above === null ? [0, 0] : [px - above.x, py - above.y];
    if (above !== null && Math.hypot(fromAbove, upAbove) < above.size) {
      const [sin, cos] = [Math.sin(this.state[0]), Math.cos(this.state[0])];
      const isBeside = Math.abs(fromAbove * cos - upAbove * sin) < NEAR_PX && fromAbove * sin + upAbove * cos > 0.3 * above.radius;
      return isBeside ? { body: 0, along: 0, isAbove: true } : null;
    }
    const points = this.joints(this.state).map((point) => this.toScreen(point));
    const toCart = Math.hypot(px - points[0][0], py - points[0][1]);
    let best = { body: 0, along: 0, distance: toCart - 0.5 * CART.height * this.reach * this.scale };
    for (let link = 1; link < points.length; link += 1) {
      const [[ax, ay], [bx, by]] = [points[link - 1], points[link]];
      const length2 = (bx - ax) ** 2 + (by - ay) ** 2;
      const along = Math.min(1, Math.max(0, ((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / length2));
      const distance = Math.hypot(px - ax - along * (bx - ax), py - ay - along * (by - ay));
      if (along > 0.15 && distance < best.distance) best = { body: link, along, distance };
    }
    return best.distance < NEAR_PX ? best : null;
  }

  listen() {
    const { canvas, rail } = this;
    canvas.addEventListener('pointerdown', (event) => {
      if (this.state === null) return;
      const near = this.nearest(event.offsetX, event.offsetY);
      if (near === null) {
        const [px, py] = [event.offsetX, event.offsetY];
        const { above } = this.parts();
        const isAbove = above !== null && Math.hypot(px - above.x, py - above.y) < above.size;
        if (!isAbove && Math.abs(this.toRig(px, py)[1]) >= 0.2 * this.reach) return;
        canvas.setPointerCapture(event.pointerId);
        this.moves = (x, y) => this.moveTo(this.meant(x, y, isAbove));
        this.moves(px, py);
        return;
      }
      if (!this.hello.is_simulated) return;
      canvas.setPointerCapture(event.pointerId);
      this.grip = { ...near, at: [event.offsetX, event.offsetY] };
      canvas.classList.add('pulling');
    });
    canvas.addEventListener('pointermove', (event) => {
      if (this.grip !== null) this.grip.at = [event.offsetX, event.offsetY];
      else this.moves?.(event.offsetX, event.offsetY);
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
      canvas.addEventListener(end, () => this.release());
    }
    canvas.addEventListener('keydown', (event) => {
      if (/^[0-9]$/.test(event.key) && Number(event.key) <= this.hello.lengths_m.length) this.body = Number(event.key);
      if (event.key.startsWith('Arrow') && this.hello.is_simulated) {
        this.keys.add(event.key);
        event.preventDefault();
      }
    });
    canvas.addEventListener('keyup', (event) => {
      if (this.keys.delete(event.key) && this.keys.size === 0) this.act.letGo();
    });
    canvas.addEventListener('blur', () => {
      if (this.keys.size > 0) this.act.letGo();
      this.keys.clear();
    });
    const moveTo = (event) => {
      const { clientWidth } = rail;
      const [low, high] = this.travel;
      this.moveTo(low + ((high - low) * event.offsetX) / clientWidth);
    };
    rail.addEventListener('pointerdown', (event) => {
      rail.setPointerCapture(event.pointerId);
      moveTo(event);
    });
    rail.addEventListener('pointermove', (event) => {
      if (rail.hasPointerCapture(event.pointerId)) moveTo(event);
    });
  }

  moveTo(x) { this.act.moveTo(x / this.arc); }

  release() {
    this.moves = null;
    if (this.grip === null) return;
    this.grip = null;
    this.canvas.classList.remove('pulling');
    this.act.letGo();
  }

  // Once per frame: sends the current pull.
  pull() {
    if (this.state === null) return;
    if (this.grip !== null) {
      const { body, along, at, isAbove } = this.grip;
      this.act.pull(body, along, this.meant(...at, isAbove), isAbove ? 0 : this.toRig(...at)[1]);
    } else if (this.keys.size > 0) {
      const [x, y] = this.joints(this.state)[this.body];
      const by = (key) => (this.keys.has(key) ? KEY_PULL * this.reach : 0);
      this.act.pull(this.body, 1, x + by('ArrowRight') - by('ArrowLeft'), y + by('ArrowUp') - by('ArrowDown'));
    }
  }

  // Draws a state; `setpoint` and `pull` may be null. `shown` has what the firmware does: `isOn`, `isKnown`, `isUp`,
  // `force_n`, and the state at which a fault turned the motor off, if there was one.
  draw(state, setpoint, pull, shown) {
    this.state = state;
    if (this.hello.lengths_m.length === 0) return;
    this.aim(state, shown.isUp);
    const { draw } = context(this.canvas);
    const line = (points, style, thickness, dash = []) => {
      draw.strokeStyle = style;
      draw.lineWidth = thickness;
      draw.setLineDash(dash);
      draw.lineCap = dash.length > 0 ? 'butt' : 'round';
      draw.beginPath();
      points.forEach((point) => draw.lineTo(...this.toScreen(point)));
      draw.stroke();
      draw.setLineDash([]);
    };
    const { above } = this.parts();
    this.track(draw, line);
    this.ticks(draw);
    if (setpoint !== null) this.aimed(draw, line, setpoint);
    this.follow(draw, state, shown.t_s);
    if (shown.isUp) this.limits(line, this.arc * state[0]);
    if (shown.fallen !== null) this.outline(draw, line, shown.fallen, colour('--bad'), 'the motor went off here');
    if (!shown.isKnown) this.outline(draw, line, [state[0], 0, ...state.slice(2).fill(0)], colour('--muted'), 'where it will stand');
    this.machine(draw, line, state, shown.isOn);
    if (!shown.isKnown) this.label(draw, this.joints(state).at(-1), 'angle ?', colour('--ink'));
    if (shown.isOn) this.push(draw, state, shown.force_n);
    if (pull !== null && pull !== undefined) this.spring(draw, line, state, pull);
    if (above !== null) drawAbove(draw, above, this, state, setpoint, pull, shown);
    if (!this.rail.hidden) this.drawRail(state, setpoint);
  }

  label(draw, at, text, style) {
    const [px, py] = this.toScreen(at);
    draw.fillStyle = style;
    draw.font = '600 14px system-ui, sans-serif';
    draw.textAlign = 'left';
    draw.fillText(text, Math.min(px + 12, this.parts().right - draw.measureText(text).width - 6), Math.max(56, py - 4));
  }

  // The rail with its stops, and the zones in which the motor goes off.
  track(draw, line) {
    const [low, high] = this.travel;
    line([[low, 0], [high, 0]], colour('--rule'), 6);
    const [from, to] = this.soft;
    for (const zone of [[low, Math.max(low, from)], [Math.min(high, to), high]]) line(zone.map((x) => [x, 0]), colour('--bad'), 6, [2, 4]);
    for (const end of [low, high]) line([[end, -0.05 * this.reach], [end, 0.08 * this.reach]], colour('--ink'), 6);
  }

  // The set-point as a ◆ below the rail, with its plumb line.
  aimed(draw, line, setpoint) {
    const x = this.arc * setpoint;
    const style = colour('--link');
    line([[x, 0], [x, 1.1 * this.reach]], style, 1, [6, 6]);
    const [px, py] = this.toScreen([x, 0]);
    const y = py + 50;
    draw.fillStyle = style;
    draw.beginPath();
    for (const [dx, dy] of [[0, -9], [9, 0], [0, 9], [-9, 0]]) draw.lineTo(px + dx, y + dy);
    draw.fill();
    draw.font = '600 13px system-ui, sans-serif';
    // Beside it where there is room, else below.
    const side = px < this.parts().right - 140 ? 1 : px > 140 ? -1 : 0;
    draw.textAlign = ['right', 'center', 'left'][side + 1];
    draw.fillText(`set-point ${setpoint.toFixed(2).replace('-', '−')} ${this.hello.base.position[1]}`, px + 14 * side, y + (side === 0 ? 26 : 5));
  }

  // Where the tip has been.
  follow(draw, state, t) {
    const { trail } = this;
    if (trail.length > 0 && t < trail.at(-1).t) trail.length = 0;
    if (trail.length === 0 || t > trail.at(-1).t) trail.push({ t, at: this.joints(state).at(-1) });
    while (trail.length > 0 && trail[0].t < t - TRAIL_S) trail.shift();
    draw.strokeStyle = colour(`--c${(this.hello.lengths_m.length - 1) % 6}`);
    draw.lineWidth = 2;
    for (let k = 1; k < trail.length; k += 1) {
      draw.globalAlpha = 0.5 * Math.max(0, 1 - (t - trail[k].t) / TRAIL_S);
      draw.beginPath();
      draw.moveTo(...this.toScreen(trail[k - 1].at));
      draw.lineTo(...this.toScreen(trail[k].at));
      draw.stroke();
    }
    draw.globalAlpha = 1;
  }

  // The lean at which the motor goes off.
  limits(line, x) {
    const angle = this.hello.angle_limit_rad;
    if (!(angle < 1.5)) return;
    for (const side of [-1, 1]) {
      const at = (part) => [x + side * part * this.reach * Math.sin(angle), part * this.reach * Math.cos(angle)];
      line([at(0.25), at(1.05)], colour('--limit'), 2, [2, 6]);
    }
  }

  outline(draw, line, state, style, text) {
    const points = this.joints(state);
    line(points, style, 2, [6, 4]);
    this.label(draw, points.at(-1), text, style);
  }

  // The motor's force as an arrow beside the cart.
  push(draw, state, force) {
    if (!(Math.abs(force) > 1e-3)) return;
    const [px, py] = this.toScreen([this.arc * state[0], 0]);
    const side = Math.sign(force);
    const length = 10 + (50 * Math.min(1, Math.abs(force) / this.hello.force_limit_n));
    const from = px + side * (0.5 * CART.width * this.reach * this.scale + 6);
    draw.fillStyle = colour('--ink');
    draw.fillRect(Math.min(from, from + side * length), py - 4, length, 8);
    draw.beginPath();
    for (const [dx, dy] of [[length, -10], [length + 16, 0], [length, 10]]) draw.lineTo(from + side * dx, py + dy);
    draw.fill();
  }

  ticks(draw) {
    const { arc, hello, travel } = this;
    const { x: middle, width } = this.parts();
    const [low, high] = [-0.5, 0.5].map((side, end) => [Math.max, Math.min][end](travel[end], this.toRig(middle + side * width, 0)[0]) / arc);
    const step = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1].find((size) => size * arc * this.scale > 52) ?? 1;
    draw.fillStyle = colour('--muted');
    draw.font = '12px system-ui, sans-serif';
    draw.textAlign = 'center';
    for (const x of roundValues(low, high, step)) {
      const [px, py] = this.toScreen([arc * x, 0]);
      draw.fillText(`${Number(x.toFixed(2))} ${hello.base.position[1]}`.replace('-', '−'), px, py + 32);
    }
  }

  machine(draw, line, state, isOn) {
    const points = this.joints(state);
    const [px, py] = this.toScreen(points[0]);
    const [w, h] = [CART.width, CART.height].map((size) => size * this.reach * this.scale);
    // A cart whose motor is on is filled.
    draw.fillStyle = colour(isOn ? '--live' : '--raised');
    draw.strokeStyle = colour('--ink');
    draw.lineWidth = this.body === 0 ? 4 : 2;
    draw.beginPath();
    draw.roundRect(px - w / 2, py - h / 2, w, h, this.hello.base.turns ? h / 2 : 0);
    draw.fill();
    draw.stroke();
    for (let link = 1; link < points.length; link += 1) {
      line([points[link - 1], points[link]], colour(`--c${(link - 1) % 6}`), this.body === link ? 9 : 7);
    }
    draw.fillStyle = colour('--ink');
    points.forEach((point) => {
      draw.beginPath();
      draw.arc(...this.toScreen(point), 3.5, 0, 2 * Math.PI);
      draw.fill();
    });
  }

  spring(draw, line, state, pull) {
    const points = this.joints(state);
    const [a, b] = [points[Math.max(0, pull.body - 1)], points[pull.body]];
    const from = a.map((value, axis) => value + (pull.body === 0 ? 0 : pull.along) * (b[axis] - value));
    line([from, pull.to], colour('--bad'), 2, [5, 4]);
    draw.fillStyle = colour('--bad');
    draw.font = '600 14px system-ui, sans-serif';
    draw.textAlign = 'left';
    const [px, py] = this.toScreen(pull.to);
    draw.fillText(`${pull.by ?? 'you'}: ${newtons(Math.hypot(...pull.force_n))}`, px + 10, py - 8);
  }

  // The whole rail: click it to move the set-point.
  drawRail(state, setpoint) {
    const { draw, width, height } = context(this.rail);
    const [low, high] = this.travel;
    const at = (x) => 6 + ((width - 12) * (x - low)) / (high - low);
    const bar = (x, top, style, thickness) => {
      draw.fillStyle = style;
      draw.fillRect(at(x) - thickness / 2, top, thickness, height - 2 * top);
    };
    draw.fillStyle = colour('--rule');
    draw.fillRect(at(low), height / 2 - 2, at(high) - at(low), 4);
    [low, high].forEach((x) => bar(x, 6, colour('--ink'), 4));
    this.soft.forEach((x) => bar(x, 12, colour('--limit'), 2));
    if (setpoint !== null) bar(this.arc * setpoint, 4, colour('--link'), 4);
    bar(this.arc * state[0], 10, colour('--c0'), 12);
  }
}
