// The curves and the poles, as SVG.

const { niceStep, roundValues } = modules['scale.js'];

function svg(name, attributes, ...children) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const curveColour = (number) => `var(--c${number % 6})`;

const short = (value) => Number(value.toPrecision(6)).toString();

// Axes and curves over time; `rows` has the time first. `kept` has points [t, value] of other curves, if it is given.
function drawCurves(place, curves, rows, kept = []) {
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
  for (const [, value] of kept.flat()) [low, high] = [Math.min(low, value), Math.max(high, value)];
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
  kept.forEach((points) => {
    const path = points.map(([t, value]) => `${x(Math.min(t, end)).toFixed(1)},${y(value).toFixed(1)}`).join(' ');
    parts.push(svg('polyline', { points: path, fill: 'none', stroke: 'var(--muted)', 'stroke-width': 1.4, 'stroke-dasharray': '5 4' }));
  });
  curves.forEach(({ value, colour }) => {
    const points = rows.map((row) => `${x(row[0]).toFixed(1)},${y(value(row)).toFixed(1)}`).join(' ');
    parts.push(svg('polyline', { points, fill: 'none', stroke: colour, 'stroke-width': 1.8, 'stroke-linejoin': 'round' }));
  });
  place.replaceChildren(...parts);
  return x;
}

// Two rigs at the same time of their runs, each with the points of its joints; the first one is only outlined.
function drawTogether(place, rigs, [low, high]) {
  const { width, height } = place.getBoundingClientRect();
  if (width === 0) return undefined; // not shown
  place.setAttribute('viewBox', `0 0 ${width} ${height}`);
  const reach = Math.max(...rigs.map(({ points }) => points.reduce((sum, [x, y], joint) => sum + (joint === 0 ? 0 : Math.hypot(x - points[joint - 1][0], y - points[joint - 1][1])), 0)));
  const [x0, y0] = [width / 2, height - 16];
  const scale = Math.min((0.9 * y0) / reach, (0.46 * width) / Math.max(-low, high));
  const at = (x, y) => [x0 + scale * x, y0 - scale * y].map((value) => value.toFixed(1)).join(',');
  const parts = [svg('line', { x1: x0 + scale * low, x2: x0 + scale * high, y1: y0, y2: y0, stroke: 'var(--rule)', 'stroke-width': 4 })];
  rigs.forEach(({ points: joined }, number) => {
    const style = number === 0 ? { stroke: 'var(--muted)', 'stroke-width': 3, 'stroke-dasharray': '5 4' } : { stroke: 'var(--c0)', 'stroke-width': 5 };
    const points = joined.map((point) => at(...point));
    parts.push(svg('rect', { x: x0 + scale * joined[0][0] - 16, y: y0 - 7, width: 32, height: 14, fill: number === 0 ? 'none' : 'var(--reference)', stroke: style.stroke }));
    parts.push(svg('polyline', { points: points.join(' '), fill: 'none', 'stroke-linejoin': 'round', ...style }));
  });
  place.replaceChildren(...parts);
  return undefined;
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
