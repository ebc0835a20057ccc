// An arm from above, as a person sees it who stands before it: at 0 it points at that person.

import { colour } from './colours.js';

const SHARE = 0.42; // of the longer side
const BESIDE = 1.24; // of the arm's circle, where its numbers stand
const TEXT_PX = 18; // of these numbers

// The circle of the arm's end in a canvas, and what of the canvas is left for the links' plane: left, top, right, bottom.
export function placeAbove(width, height) {
  const isWide = width > height;
  const side = isWide ? Math.min(SHARE * width, height) : Math.min(SHARE * height, width);
  const [x, y] = isWide ? [width - side / 2, height / 2] : [width / 2, side / 2];
  return { above: { x, y, size: side / 2, radius: (side / 2 - TEXT_PX) / BESIDE }, rest: isWide ? [0, 0, width - side, height] : [0, side, width, height] };
}

// Draws what `view` shows: travel, set-point, arm and links, the motor's torque, and a pull at the arm.
export function drawAbove(draw, { x, y, radius }, view, state, setpoint, pull, shown) {
  const { arc, hello, travel, soft, body } = view;
  const [alpha] = state;
  const at = (angle, from = radius, side = 0) => [x + from * Math.sin(angle) + side * Math.cos(angle), y + from * Math.cos(angle) - side * Math.sin(angle)];
  const pen = (style, thickness, dash = []) => {
    draw.strokeStyle = style;
    draw.lineWidth = thickness;
    draw.setLineDash(dash);
    draw.lineCap = dash.length > 0 ? 'butt' : 'round';
    draw.beginPath();
  };
  const stroke = () => {
    draw.stroke();
    draw.setLineDash([]);
  };
  const line = (points, ...style) => {
    pen(...style);
    points.forEach((point) => draw.lineTo(...point));
    stroke();
  };
  const along = (from, to, far, ...style) => {
    pen(...style);
    draw.arc(x, y, far, Math.PI / 2 - from, Math.PI / 2 - to, from < to);
    stroke();
  };
  const [low, high] = travel.map((end) => end / arc);
  const [from, to] = soft.map((end) => end / arc);
  along(low, high, radius, colour('--rule'), 6);
  for (const [begin, end] of [[low, Math.max(low, from)], [Math.min(high, to), high]]) along(begin, end, radius, colour('--bad'), 6, [2, 4]);
  draw.fillStyle = colour('--muted');
  draw.font = '12px system-ui, sans-serif';
  draw.textAlign = 'center';
  for (const end of [low, 0, high]) {
    if (end !== 0) line([at(end, 0.9 * radius), at(end, 1.1 * radius)], colour('--ink'), 4);
    const [px, py] = at(end, BESIDE * radius);
    draw.fillText(`${Number(end.toFixed(2))}`.replace('-', '−'), px, py + 4);
  }
  if (setpoint !== null) {
    line([at(setpoint, 0), at(setpoint, 0.88 * radius)], colour('--link'), 1, [6, 6]);
    draw.fillStyle = colour('--link');
    draw.beginPath();
    for (const [far, side] of [[-8, 0], [0, 8], [8, 0], [0, -8]]) draw.lineTo(...at(setpoint, radius + far, side));
    draw.fill();
  }
  line([at(alpha, 0), at(alpha)], colour(shown.isOn ? '--live' : '--muted'), body === 0 ? 12 : 9);
  line([at(alpha, 0), at(alpha)], colour('--ink'), 2);
  const points = view.joints(state).map(([foot]) => at(alpha, radius, (radius / arc) * (foot - arc * alpha)));
  for (let link = 1; link < points.length; link += 1) line([points[link - 1], points[link]], colour(`--c${(link - 1) % 6}`), body === link ? 8 : 6);
  draw.fillStyle = colour('--ink');
  for (const [px, py] of [[x, y], ...points]) {
    draw.beginPath();
    draw.arc(px, py, 3.5, 0, 2 * Math.PI);
    draw.fill();
  }
  if (shown.isOn && Math.abs(shown.force_n) > 1e-3 * hello.force_limit_n) {
    const far = 0.45 * radius;
    const end = alpha + (Math.sign(shown.force_n) * (0.15 + 1.1 * Math.min(1, Math.abs(shown.force_n) / hello.force_limit_n)));
    along(alpha, end, far, colour('--ink'), 5);
    draw.beginPath();
    for (const [out, ahead] of [[-8, 0], [8, 0], [0, 14]]) draw.lineTo(...at(end, far + out, Math.sign(shown.force_n) * ahead));
    draw.fill();
  }
  if (pull?.body === 0) line([at(alpha), at(pull.to[0] / arc)], colour('--bad'), 2, [5, 4]);
}
