// The desk: puts text, form, drawing and design together.

const examples = JSON.parse(embedded('examples'));
const DEGREES = 180 / Math.PI;
const LEAST_MS = 16;
const KEPT = 'upright rig'; // name in the tab's store
const NEEDS_TABLE = ['save-table', 'save-header', 'save-csv', 'balance', 'connect', 'verify'];

const desk = { sketch: null, design: null, poles: null, began: 0, at: 0, error: null };
let checker = null;
let designer = null;
let twin = null;
let trust = null;

const editor = new Editor(() => changed());
const set = (key, value) => {
  checker.ask('set', { ask: 'set', toml: editor.value, key, value }, (answer) => {
    if (answer.failed !== undefined) return editor.mark(answer.failed);
    editor.set(answer.toml);
    return changed();
  });
};
const form = new Form(set);
const weights = new Weights(set);

function tell(text, isBad = false) {
  byId('told').textContent = text;
  byId('told').classList.toggle('bad', isBad);
}

function changed() {
  trust.forget();
  checker.ask('check', { ask: 'check', toml: editor.value }, checked);
}

function checked(answer) {
  editor.mark(answer.failed);
  for (const id of NEEDS_TABLE) byId(id).disabled = true;
  if (answer.failed !== undefined) return;
  desk.sketch = answer;
  byId('unusual').replaceChildren(...answer.unusual.map((text) => element('li', { textContent: text })));
  form.show(answer.fields);
  weights.show(answer.weights);
  draw();
  redesign();
}

// How the closed loop is disturbed in the run that is shown.
const disturbed = () => ({ lean_rad: Number(byId('lean').value) / DEGREES, step_m: Number(byId('step').value) });

function redesign() {
  for (const id of ['plots', 'gains', 'poles']) byId(id).classList.add('old');
  const toml = editor.value;
  tell('designing …');
  designer.ask('design', { ask: 'design', toml, ...disturbed() }, (answer, ms) => {
    if (answer.failed !== undefined) return tell(answer.failed.why, true);
    designed(answer, ms);
    return designer.ask('poles', { ask: 'poles', toml }, (poles) => {
      if (poles.failed !== undefined) return;
      desk.poles = poles;
      showDesign();
    });
  });
}

function designed(answer, ms) {
  desk.design = answer;
  const law = byId('law');
  const names = answer.laws.map(({ law: name }) => name);
  if ([...law.options].map(({ value }) => value).join() !== names.join()) {
    law.replaceChildren(...answer.laws.map(({ law: value, title }) => element('option', { value, textContent: title })));
  }
  const table = answer.crc === null ? `no table: ${answer.no_table}` : `table ${answer.crc}`;
  tell(`${answer.states} states; every gain equal at ${answer.bits[0]} and ${answer.bits[1]} bits; ${table}; designed and run in ${(ms / 1e3).toFixed(2)} s`);
  for (const id of NEEDS_TABLE) byId(id).disabled = answer.crc === null;
  showLoop();
  showDesign();
}

const chosen = () => desk.design?.laws.find(({ law }) => law === byId('law').value) ?? desk.design?.laws[0];

function showLoop() {
  const law = chosen();
  const verdict = byId('verdict');
  const run = law?.run ?? null;
  const said = law === undefined ? 'the rig file asks for no control law: add [lqr] or [pole_placement]' : run?.summary ?? '';
  const [first, ...figures] = said.split('\n').map((line) => line.trim());
  verdict.textContent = first;
  byId('figures').textContent = figures.join('; ');
  verdict.className = run === null ? '' : run.fell ? 'bad' : 'good';
  byId('plots').classList.remove('old');
  byId('play').disabled = run === null;
  if (run === null) return byId('plots').replaceChildren();
  const links = desk.sketch.lengths_m.length;
  const state = (index, factor = 1) => (row) => factor * row[3][index];
  const plots = [
    ['position (m)', [{ name: 'cart', value: state(0), colour: curveColour(0) }, { name: 'set-point', value: (row) => row[1], colour: 'var(--limit)' }]],
    ['angles (°)', desk.sketch.lengths_m.map((_, link) => ({ name: `link ${link + 1}`, value: state(2 + 2 * link, DEGREES), colour: curveColour(link) }))],
    [desk.sketch.input, [{ name: 'applied', value: (row) => row[2], colour: curveColour(1) }]],
  ].filter(([, curves]) => links > 0 || curves[0]?.name === 'applied');
  byId('plots').replaceChildren(...plots.map(([title, curves]) => {
    const caption = element('figcaption', { textContent: title });
    for (const { name, colour } of curves) {
      const sample = element('i', {});
      sample.style.background = colour;
      caption.append(element('span', {}, sample, name));
    }
    const place = svg('svg', { class: 'plot', role: 'img', 'aria-label': title });
    return element('figure', {}, caption, place);
  }));
  plots.forEach(([, curves], index) => drawCurves(byId('plots').querySelectorAll('svg')[index], curves, run.rows));
  desk.at = 0;
  draw();
  if (!matchMedia('(prefers-reduced-motion: reduce)').matches) play();
  return undefined;
}

const numbers = (values) => values.map((value) => short(value)).join('  ').replaceAll('-', '−');

function showDesign() {
  const law = chosen();
  byId('gains').classList.remove('old');
  if (law === undefined) return byId('gains').replaceChildren();
  const rows = [];
  const row = (name, value, kind = 'span') => rows.push(element('tr', {}, element('th', { textContent: name }), element('td', {}, element(kind, { textContent: value }))));
  for (const [name, title] of [['continuous', 'in continuous time'], ['sampled', 'at the tick']]) {
    if (law[name] === null) continue;
    row(`K ${title}`, numbers(law[name].k), 'code');
    row(`N ${title}`, law[name].n === null ? 'none' : numbers([law[name].n]), 'code');
  }
  row('spectral radius', `${law.radius.toFixed(6)} at the tick of ${short(desk.design.tick_s * 1e3)} ms, rounded to f32`);
  row('rounding to f32', `changes no gain by more than ${law.rounding.toExponential(1)}, relative`);
  row('certificate', `every gain equal at ${desk.design.bits[0]} and ${desk.design.bits[1]} bits, rounded once`);
  byId('gains').replaceChildren(element('h3', { textContent: law.title }), element('table', {}, element('tbody', {}, ...rows)));
  const poles = desk.poles?.laws.find(({ law: name }) => name === law.law)?.continuous ?? null;
  if (poles === null) return undefined;
  byId('poles').classList.remove('old');
  return drawPoles(byId('poles'), poles);
}

// Draws the rig at the time shown.
function draw() {
  if (desk.sketch === null) return;
  const rows = chosen()?.run?.rows;
  const states = 2 * desk.sketch.lengths_m.length + 2;
  const row = rows?.[Math.min(rows.length - 1, Math.round((desk.at / rows.at(-1)[0]) * (rows.length - 1)))];
  const fits = row !== undefined && row[3].length === states;
  byId('time').textContent = fits ? `${row[0].toFixed(1)} s` : '';
  drawRig(byId('drawing'), desk.sketch, fits ? row[3] : new Array(states).fill(0), fits ? row[1] : null);
}

function play() {
  desk.began = performance.now() - 1e3 * desk.at;
  const own = desk.began;
  let last = 0;
  const step = (now) => {
    const end = chosen()?.run?.rows.at(-1)[0] ?? 0;
    if (own !== desk.began || desk.at >= end) return;
    if (now - last >= LEAST_MS) {
      last = now;
      desk.at = Math.min(end, (now - own) / 1e3);
      draw();
    }
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}

function save(name, text, type = 'text/plain') {
  const address = URL.createObjectURL(new Blob([text], { type }));
  element('a', { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10e3);
}

// What `upright design`, `upright export` and `upright simulate --csv` write.
async function exported(kind) {
  const answer = await designer.answerTo({ ask: kind, toml: editor.value, law: byId('law').value, ...disturbed() });
  if (answer.failed !== undefined) tell(answer.failed.why, true);
  return answer.text ?? null;
}

async function saveExported(kind, name, type) {
  const text = await exported(kind);
  if (text !== null) save(name, text, type);
}

// The stored motions of the example that the rig began as; they are used if it has not changed.
function motions() {
  const example = examples.find(({ name }) => name === desk.sketch.rig);
  return example === undefined ? null : motionsOf(example);
}

// The rig in the address, behind the mark that is never sent to a server.
function linkToRig() {
  const code = lettersOf(new TextEncoder().encode(editor.value)).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  return `${location.href.split('#')[0]}#rig=${code}`;
}

function rigOfLink() {
  const code = /^#rig=([A-Za-z0-9_-]+)$/.exec(location.hash)?.[1];
  if (code === undefined) return null;
  return new TextDecoder().decode(bytesOfLetters(code.replaceAll('-', '+').replaceAll('_', '/')));
}

function listen() {
  byId('example').replaceChildren(...examples.map(({ name }) => element('option', { value: name, textContent: name })));
  byId('example').addEventListener('change', ({ target }) => {
    editor.set(examples.find(({ name }) => name === target.value).toml);
    changed();
  });
  byId('file').addEventListener('change', async ({ target }) => {
    if (target.files.length === 0) return;
    editor.set(await target.files[0].text());
    changed();
  });
  for (const [id, unit] of [['lean', '°'], ['step', 'm']]) {
    const show = () => { byId(`${id}-value`).textContent = `${byId(id).value} ${unit}`; };
    show();
    byId(id).addEventListener('input', () => { show(); redesign(); });
  }
  byId('law').addEventListener('change', () => { showLoop(); showDesign(); trust.show(); });
  byId('play').addEventListener('click', () => { desk.at = 0; play(); });
  byId('balance').addEventListener('click', () => {
    twin.open({ toml: editor.value, motions: motions(), upright: byId('raised').checked, since_1970_s: Date.now() / 1e3 });
  });
  byId('connect').hidden = navigator.serial === undefined;
  byId('no-serial').hidden = navigator.serial !== undefined;
  byId('connect').addEventListener('click', async ({ target }) => {
    try {
      twin.open({ toml: editor.value, motions: motions() }, await SerialLine.open(Number(target.dataset.baud)));
    } catch (error) {
      tell(`the board's port cannot be opened: ${error.message}`, true);
    }
  });
  byId('save-rig').addEventListener('click', () => save(`${desk.sketch?.rig ?? 'rig'}.toml`, editor.value));
  byId('save-table').addEventListener('click', () => saveExported('table', 'gains.rs'));
  byId('save-header').addEventListener('click', () => saveExported('header', 'controller.h'));
  byId('save-csv').addEventListener('click', () => saveExported('csv', 'run.csv', 'text/csv'));
  byId('link').addEventListener('click', async () => {
    history.replaceState(null, '', linkToRig());
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    tell('the address of this page now holds the rig, and is in the clipboard where the browser allows it');
  });
  addEventListener('hashchange', () => open(rigOfLink()));
  let resized = null;
  addEventListener('resize', () => {
    clearTimeout(resized);
    resized = setTimeout(() => { if (desk.design !== null) { showLoop(); showDesign(); } }, 150);
  });
}

function open(text) {
  if (text === null) return;
  editor.set(text);
  changed();
}

async function begin() {
  listen();
  const first = examples.find(({ name }) => name === 'quadruple-paper') ?? examples[0];
  byId('example').value = first.name;
  editor.set(rigOfLink() ?? store()?.getItem(KEPT) ?? first.toml);
  addEventListener('pagehide', () => store()?.setItem(KEPT, editor.value));
  const module = bytesOf('module');
  checker = new Thread(module);
  designer = new Thread(module);
  trust = new Trust(module);
  twin = new Twin(module, (why) => tell(why, true));
  const begins = (name) => {
    byId('example').value = name;
    open(examples.find((example) => example.name === name)?.toml ?? null);
  };
  new Lessons(begins, (question) => designer.answerTo(question));
  changed();
  twin.goOn(editor.value);
}

// For tests, and for the curious.
globalThis.upright = { desk, exported, motions, trusted: () => trust.laws, keptBytes: () => twin.kept?.kept.bytes.length ?? 0, ask: (question) => designer.answerTo(question), isBusy: () => checker === null || checker.isBusy || designer.isBusy };
begin().catch((error) => tell(`this browser cannot compute the design: ${error.message}`, true));
