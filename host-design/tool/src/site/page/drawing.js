// The rig, the curves and the poles, as SVG.

function svg(name, attributes, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const curveColour = (number) => `var(--c${number % 6})`;

const short = (value) => Number(value.toPrecision(6)).toString();

// Draws the rig in a state (x, ẋ, θ_1, θ̇_1 …), seen at a fixed place with the cart in the middle.
function drawRig(place, { lengths_m: lengths, travel_m: travel }, state, setpoint) {
  const { width, height } = place.getBoundingClientRect();
  if (width === 0) return undefined; // not shown
  place.setAttribute('viewBox', `0 0 ${width} ${height}`);
  if (lengths.length === 0) {
    place.replaceChildren(svg('text', { x: width / 2, y: height / 2, 'text-anchor': 'middle' }, 'a linear model: no links to draw'));
    return;
  }
  const reach = lengths.reduce((sum, length) => sum + length, 0);
  const [x0, y0] = [width / 2, height - 40];
  const scale = (0.88 * y0) / reach;
  const at = ([x, y]) => [x0 + scale * x, y0 - scale * y];
  const parts = [];
  const line = (from, to, stroke, thickness) => {
    const [[x1, y1], [x2, y2]] = [at(from), at(to)];
    parts.push(svg('line', { x1, y1, x2, y2, stroke, 'stroke-width': thickness, 'stroke-linecap': 'round' }));
  };
  const far = width / scale;
  const [low, high] = [travel[0] ?? -far, travel[1] ?? far];
  line([Math.max(low, -far), 0], [Math.min(high, far), 0], 'var(--rule)', 4);
  for (const end of [low, high]) line([end, -0.05 * reach], [end, 0.05 * reach], 'var(--ink)', 5);
  const step = niceStep(90 / scale);
  for (const tick of roundValues(-x0 / scale, x0 / scale, step)) {
    const [x, y] = at([tick, 0]);
    parts.push(svg('text', { x, y: y + 32, 'text-anchor': 'middle' }, `${Number(tick.toFixed(3))} m`));
  }
  if (setpoint !== null) line([setpoint, -0.11 * reach], [setpoint, -0.05 * reach], 'var(--link)', 4);
  let [x, y, phi] = [state[0], 0, 0];
  const [cx, cy] = at([x, y]);
  parts.push(svg('rect', { x: cx - 27, y: cy - 11, width: 54, height: 22, rx: 4, fill: 'var(--reference)', stroke: 'var(--ink)' }));
  const joints = [[x, y]];
  lengths.forEach((length, link) => {
    phi += state[2 + 2 * link];
    const end = [x - length * Math.sin(phi), y + length * Math.cos(phi)];
    line([x, y], end, curveColour(link), 7);
    [x, y] = end;
    joints.push(end);
  });
  for (const joint of joints) {
    const [px, py] = at(joint);
    parts.push(svg('circle', { cx: px, cy: py, r: 3.5, fill: 'var(--ink)' }));
  }
  place.replaceChildren(...parts);
}

// Axes and curves over time; `rows` has the time first.
function drawCurves(place, curves, rows) {
  const { width, height } = place.getBoundingClientRect();
  if (width === 0) return undefined; // not shown
  const [left, right, top, bottom] = [54, 8, 6, 18];
  place.setAttribute('viewBox', `0 0 ${width} ${height}`);
  const end = rows.at(-1)[0] || 1;
  let [low, high] = [Infinity, -Infinity];
  for (const row of rows) {
    for (const { value } of curves) {
      low = Math.min(low, value(row));
      high = Math.max(high, value(row));
    }
  }
  const room = Math.max(0.08 * (high - low), 1e-6);
  [low, high] = [low - room, high + room];
  const x = (t) => left + ((width - left - right) * t) / end;
  const y = (value) => top + ((height - top - bottom) * (high - value)) / (high - low);
  const parts = [];
  const step = niceStep((high - low) / 4);
  for (const value of roundValues(low, high, step)) {
    parts.push(svg('line', { x1: left, x2: width - right, y1: y(value), y2: y(value), stroke: 'var(--rule)' }));
    parts.push(svg('text', { x: left - 6, y: y(value) + 4, 'text-anchor': 'end' }, Number(value.toPrecision(3)).toString()));
  }
  for (const t of roundValues(0, end, niceStep(end / 5))) {
    parts.push(svg('text', { x: Math.min(x(t), width - 18), y: height - 4, 'text-anchor': 'middle' }, `${Number(t.toFixed(2))} s`));
  }
  curves.forEach(({ value, colour }) => {
    const points = rows.map((row) => `${x(row[0]).toFixed(1)},${y(value(row)).toFixed(1)}`).join(' ');
    parts.push(svg('polyline', { points, fill: 'none', stroke: colour, 'stroke-width': 1.8, 'stroke-linejoin': 'round' }));
  });
  place.replaceChildren(...parts);
  return x;
}

// Poles in the complex plane, on a scale that shows near and far ones: the square root of each distance.
function drawPoles(place, poles) {
  const { width, height } = place.getBoundingClientRect();
  if (width === 0) return undefined; // not shown
  place.setAttribute('viewBox', `0 0 ${width} ${height}`);
  const farthest = Math.max(...poles.map(([re, im]) => Math.max(Math.abs(re), Math.abs(im))), 1e-3);
  const near = (value) => Math.sign(value) * Math.sqrt(Math.abs(value) / farthest);
  const [x0, y0] = [0.82 * width, height / 2 - 8];
  const at = ([re, im]) => [x0 + 0.76 * width * near(re), y0 - 0.4 * height * near(im)];
  const parts = [
    svg('line', { x1: 8, x2: width - 8, y1: y0, y2: y0, stroke: 'var(--rule)' }),
    svg('line', { x1: x0, x2: x0, y1: 6, y2: height - 22, stroke: 'var(--ink)' }),
  ];
  let free = -Infinity;
  for (let power = Math.floor(Math.log10(farthest)); 10 ** power > farthest / 3e3; power -= 1) {
    const [x] = at([-(10 ** power), 0]);
    if (x < free) continue;
    free = x + 40;
    parts.push(svg('line', { x1: x, x2: x, y1: y0 - 4, y2: y0 + 4, stroke: 'var(--muted)' }));
    parts.push(svg('text', { x, y: height - 6, 'text-anchor': 'middle' }, `−${Number((10 ** power).toPrecision(3))}`));
  }
  for (const pole of poles) {
    const [x, y] = at(pole);
    const stroke = pole[0] < 0 ? 'var(--c0)' : 'var(--bad)';
    const cross = svg('path', { d: `M${x - 5} ${y - 5}l10 10m0 -10l-10 10`, stroke, 'stroke-width': 2.2, fill: 'none' });
    cross.append(svg('title', {}, `${short(pole[0])}${pole[1] === 0 ? '' : ` ${pole[1] < 0 ? '−' : '+'} ${short(Math.abs(pole[1]))}i`}`));
    parts.push(cross);
  }
  place.replaceChildren(...parts);
  place.setAttribute('aria-label', `${poles.length} poles, the rightmost at ${short(Math.max(...poles.map(([re]) => re)))} per second`);
}
