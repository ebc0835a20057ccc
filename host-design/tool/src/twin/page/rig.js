// The rig to scale: draws it, and turns pointer and keys into pulls.

import { colour } from './colours.js';

const NEAR_PX = 28; // how near the pointer has to be to a body
const CART = { width: 0.14, height: 0.07 }; // in lengths of the chain
const KEY_PULL = 0.35; // pull by an arrow key, in lengths of the chain

// Joints of the chain: its foot, then the end of each link (m).
export function joints(lengths, state) {
  const points = [[state[0], 0]];
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
  // `pull(body, along, x, y)`, `letGo()` and `moveTo(x)` carry out what the person does.
  constructor(canvas, rail, hello, act) {
    Object.assign(this, { canvas, rail, hello, act });
    this.reach = hello.lengths_m.reduce((sum, length) => sum + length, 0);
    this.centre = 0;
    this.state = null;
    this.grip = null;
    this.body = hello.lengths_m.length;
    this.keys = new Set();
    this.listen();
  }

  // CSS pixels per metre.
  get scale() {
    return Math.min(this.canvas.clientHeight / (2.5 * this.reach), this.canvas.clientWidth / (2.2 * this.reach));
  }

  toScreen([x, y]) {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (x - this.centre) * this.scale, clientHeight / 2 - y * this.scale];
  }

  toRig(px, py) {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.centre + (px - clientWidth / 2) / this.scale, (clientHeight / 2 - py) / this.scale];
  }

  // Nearest body to a point of the screen: its number, and where on it.
  nearest(px, py) {
    const points = joints(this.hello.lengths_m, this.state).map((point) => this.toScreen(point));
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
        const [x, y] = this.toRig(event.offsetX, event.offsetY);
        if (Math.abs(y) < 0.15 * this.reach) this.act.moveTo(x);
        return;
      }
      if (!this.hello.is_simulated) return;
      canvas.setPointerCapture(event.pointerId);
      this.grip = { body: near.body, along: near.along, at: [event.offsetX, event.offsetY] };
      canvas.classList.add('pulling');
    });
    canvas.addEventListener('pointermove', (event) => {
      if (this.grip !== null) this.grip.at = [event.offsetX, event.offsetY];
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
      const [low, high] = this.travel();
      this.act.moveTo(low + ((high - low) * event.offsetX) / clientWidth);
    };
    rail.addEventListener('pointerdown', (event) => {
      rail.setPointerCapture(event.pointerId);
      moveTo(event);
    });
    rail.addEventListener('pointermove', (event) => {
      if (rail.hasPointerCapture(event.pointerId)) moveTo(event);
    });
  }

  release() {
    if (this.grip === null) return;
    this.grip = null;
    this.canvas.classList.remove('pulling');
    this.act.letGo();
  }

  travel() {
    const [low, high] = this.hello.travel_m;
    return [low ?? -1, high ?? 1];
  }

  // Once per frame: sends the current pull.
  pull() {
    if (this.state === null) return;
    if (this.grip !== null) {
      const [x, y] = this.toRig(...this.grip.at);
      this.act.pull(this.grip.body, this.grip.along, x, y);
    } else if (this.keys.size > 0) {
      const [x, y] = joints(this.hello.lengths_m, this.state)[this.body];
      const by = (key) => (this.keys.has(key) ? KEY_PULL * this.reach : 0);
      this.act.pull(this.body, 1, x + by('ArrowRight') - by('ArrowLeft'), y + by('ArrowUp') - by('ArrowDown'));
    }
  }

  // Draws a state; `setpoint` (m) and `pull` may be null.
  draw(state, setpoint, pull) {
    this.state = state;
    const { draw, width } = context(this.canvas);
    if (this.hello.lengths_m.length === 0) return;
    // The view follows the cart, but not while the person pulls.
    if (this.grip === null && this.keys.size === 0) this.centre += 0.12 * (state[0] - this.centre);
    const line = (points, style, thickness, dash = []) => {
      draw.strokeStyle = style;
      draw.lineWidth = thickness;
      draw.setLineDash(dash);
      draw.lineCap = 'round';
      draw.beginPath();
      points.forEach((point) => draw.lineTo(...this.toScreen(point)));
      draw.stroke();
      draw.setLineDash([]);
    };
    const [low, high] = this.travel();
    line([[low, 0], [high, 0]], colour('--rule'), 4);
    for (const end of [low, high]) line([[end, -0.06 * this.reach], [end, 0.06 * this.reach]], colour('--ink'), 5);
    for (const end of this.hello.soft_m) line([[end, -0.04 * this.reach], [end, 0.04 * this.reach]], colour('--limit'), 2, [4, 4]);
    this.ticks(draw, width);
    if (setpoint !== null) {
      line([[setpoint, -0.12 * this.reach], [setpoint, -0.05 * this.reach]], colour('--link'), 4);
    }
    this.machine(draw, line, state);
    if (pull !== null && pull !== undefined) this.spring(draw, line, state, pull);
    this.drawRail(state, setpoint);
  }

  ticks(draw, width) {
    const [left] = this.toRig(0, 0);
    const [right] = this.toRig(width, 0);
    const step = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1].find((size) => size * this.scale > 70) ?? 1;
    draw.fillStyle = colour('--muted');
    draw.font = '12px system-ui, sans-serif';
    draw.textAlign = 'center';
    for (let x = Math.ceil(left / step) * step; x <= right; x += step) {
      const [px, py] = this.toScreen([x, 0]);
      draw.fillText(`${Number(x.toFixed(2))} m`, px, py + 0.22 * this.reach * this.scale);
    }
  }

  machine(draw, line, state) {
    const points = joints(this.hello.lengths_m, state);
    const [px, py] = this.toScreen(points[0]);
    const [w, h] = [CART.width, CART.height].map((size) => size * this.reach * this.scale);
    draw.fillStyle = colour('--reference');
    draw.strokeStyle = colour('--ink');
    draw.lineWidth = this.body === 0 ? 3 : 1;
    draw.fillRect(px - w / 2, py - h / 2, w, h);
    draw.strokeRect(px - w / 2, py - h / 2, w, h);
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
    const points = joints(this.hello.lengths_m, state);
    const [a, b] = [points[Math.max(0, pull.body - 1)], points[pull.body]];
    const from = a.map((value, axis) => value + (pull.body === 0 ? 0 : pull.along) * (b[axis] - value));
    line([from, pull.to], colour('--bad'), 2, [5, 4]);
    draw.fillStyle = colour('--bad');
    draw.font = '600 14px system-ui, sans-serif';
    draw.textAlign = 'left';
    const [px, py] = this.toScreen(pull.to);
    draw.fillText(`${Math.hypot(...pull.force_n).toFixed(2)} N`, px + 10, py - 8);
  }

  // The whole rail: click it to move the set-point.
  drawRail(state, setpoint) {
    const { draw, width, height } = context(this.rail);
    const [low, high] = this.travel();
    const at = (x) => 6 + ((width - 12) * (x - low)) / (high - low);
    const bar = (x, top, style, thickness) => {
      draw.fillStyle = style;
      draw.fillRect(at(x) - thickness / 2, top, thickness, height - 2 * top);
    };
    draw.fillStyle = colour('--rule');
    draw.fillRect(at(low), height / 2 - 2, at(high) - at(low), 4);
    [low, high].forEach((x) => bar(x, 6, colour('--ink'), 4));
    this.hello.soft_m.forEach((x) => bar(x, 12, colour('--limit'), 2));
    if (setpoint !== null) bar(setpoint, 4, colour('--link'), 4);
    bar(state[0], 10, colour('--c0'), 12);
  }
}
