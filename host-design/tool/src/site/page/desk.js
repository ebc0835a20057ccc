// The desk: puts text, form, drawing and design together.

const examples = JSON.parse(embedded('examples'));
const DEGREES = 180 / Math.PI;
const LEAST_MS = 16;
const FIRST = 'single-quanser-ip02'; // where a person begins who has no rig
const KEPT = 'upright rig'; // name in the tab's store
const LARGEST_FILE = 1e6; // bytes
const NEEDS_TABLE = ['save-table', 'save-header', 'save-csv', 'balance', 'connect', 'verify'];
const SHOWN = ['drawing', 'plots', 'figures', 'gains', 'poles'];

// `linked` is the rig file that the address holds.
const desk = { sketch: null, design: null, poles: null, began: 0, at: 0, linked: null };
let checker = null;
let designer = null;
let twin = null;
let trust = null;

const editor = new Editor(() => changed());
const set = (key, value, refuse) => {
  checker?.ask('set', { ask: 'set', toml: editor.value, key, value }, (answer) => {
    if (answer.failed === undefined) {
      editor.set(answer.toml, key);
      return changed();
    }
    return refuse === undefined ? wrong(answer.failed) : refuse(answer.failed.why);
  });
};
const form = new Form(set, (why) => outdate(why));
const weights = new Weights(set);

function tell(text, isBad = false) {
  byId('told').textContent = text;
  byId('told').classList.toggle('bad', isBad);
}

// Says something that stays until the rig is changed; with `undoes`, beside a button that takes the last change back.
function notice(text, { isBad = false, undoes = false } = {}) {
  byId('notice').hidden = text === '';
  byId('notice').classList.toggle('bad', isBad);
  const undo = element('button', { type: 'button', textContent: 'undo' });
  undo.addEventListener('click', (event) => editor.step(event, true));
  byId('notice').replaceChildren(text, ...(undoes ? [undo] : []));
}

// What is shown is not of the rig that is wanted; `why` says what is wrong with that one.
function outdate(why) {
  for (const id of SHOWN) byId(id).classList.add('old');
  for (const id of NEEDS_TABLE) byId(id).disabled = true;
  byId('verdict').className = 'bad';
  byId('verdict').replaceChildren(...inPieces(why));
  byId('figures').textContent = 'What is drawn is the rig before.';
  byId('figures').classList.remove('old');
  byId('unusual').replaceChildren();
  tell('');
}

// The rig file cannot be designed.
function wrong(failed) {
  editor.mark(failed);
  outdate(`${placeOf(failed)}${failed.why}`);
}

function changed() {
  notice('');
  if (checker === null) return;
  // An address that holds another rig would win over this one when the page is loaded again.
  if (desk.linked !== null && editor.value !== desk.linked) {
    desk.linked = null;
    history.replaceState(null, '', withoutRig());
  }
  trust.forget();
  checker.ask('check', { ask: 'check', toml: editor.value }, checked);
}

function checked(answer) {
  if (answer.failed !== undefined) return wrong(answer.failed);
  editor.mark(undefined);
  for (const id of NEEDS_TABLE) byId(id).disabled = true;
  desk.sketch = answer;
  form.show(answer.fields);
  weights.show(answer.weights);
  draw();
  return redesign();
}

// How the closed loop is disturbed in the run that is shown.
const disturbed = () => ({ lean_rad: Number(byId('lean').value) / DEGREES, step_m: Number(byId('step').value) });

function redesign() {
  for (const id of ['plots', 'gains', 'poles', 'figures']) byId(id).classList.add('old');
  byId('verdict').className = '';
  const toml = editor.value;
  tell('designing …');
  designer.ask('design', { ask: 'design', toml, ...disturbed() }, (answer, ms) => {
    if (answer.failed !== undefined) return toml === editor.value ? wrong(answer.failed) : undefined;
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
  if (answer.crc === null) tell(`no table: ${plain(answer.no_table)}`, true);
  else tell(`designed and run in ${(ms / 1e3).toFixed(2)} s`);
  for (const id of NEEDS_TABLE) byId(id).disabled = answer.crc === null;
  showLoop();
  showDesign();
}

// What the run shows, in plain words.
function inWords({ fell }) {
  const what = desk.sketch.lengths_m.length > 0 ? 'It stays upright' : 'It survives';
  if (fell) return 'It falls.';
  return desk.sketch.unusual.length === 0 ? `${what}.` : `${what}, if its numbers are right:`;
}

const chosen = () => desk.design?.laws.find(({ law }) => law === byId('law').value) ?? desk.design?.laws[0];

function showLoop() {
  const law = chosen();
  const verdict = byId('verdict');
  const run = law?.run ?? null;
  const said = law === undefined ? 'the rig file asks for no control law: add [lqr] or [pole_placement]' : run?.summary ?? '';
  const { unusual } = desk.sketch;
  verdict.textContent = run === null ? said : inWords(run);
  verdict.className = run === null || (unusual.length > 0 && !run.fell) ? '' : run.fell ? 'bad' : 'good';
  byId('unusual').replaceChildren(...unusual.map((text) => element('li', {}, ...inPieces(text))));
  byId('figures').textContent = run === null ? '' : said.split('\n').map((line) => line.trim()).join('; ');
  for (const id of ['drawing', 'plots', 'figures']) byId(id).classList.remove('old');
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
  if (desk.design.crc !== null) row('gain table', `CRC-32 ${desk.design.crc}`, 'code');
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

// Puts another rig file on the desk. The one before can be brought back, which is said if a person has worked on it.
function replace(toml, what) {
  if (toml === editor.value) return changed();
  const isOwn = editor.value.trim() !== '' && !examples.some((example) => example.toml === editor.value);
  editor.set(toml, what);
  changed();
  return isOwn ? notice(`${what} has taken the place of your rig.`, { undoes: true }) : undefined;
}

async function openFile(file) {
  if (file.size > LARGEST_FILE) return notice(`${file.name} is too large for a rig file.`, { isBad: true });
  return replace(await file.text(), file.name);
}

// The rig in the address, if there is one.
function openLink() {
  const link = rigOfLink();
  if (link === null) return false;
  if (link.why !== undefined) {
    notice(link.why, { isBad: true });
    return false;
  }
  desk.linked = link.toml;
  replace(link.toml, 'The rig of the link');
  return true;
}

function listenToFiles() {
  byId('file').addEventListener('change', async ({ target }) => {
    if (target.files.length > 0) await openFile(target.files[0]);
    target.value = '';
  });
  const isOver = (is) => document.body.classList.toggle('dropping', is);
  document.addEventListener('dragover', (event) => {
    if (![...event.dataTransfer.types].includes('Files')) return;
    event.preventDefault();
    isOver(true);
  });
  document.addEventListener('dragleave', () => isOver(false));
  document.addEventListener('drop', (event) => {
    isOver(false);
    const [file] = event.dataTransfer.files;
    if (file === undefined) return;
    event.preventDefault();
    openFile(file);
  });
}

function listen() {
  byId('example').replaceChildren(...examples.map(({ name }) => element('option', { value: name, textContent: name })));
  byId('example').addEventListener('change', ({ target }) => {
    replace(examples.find(({ name }) => name === target.value).toml, target.value);
  });
  listenToFiles();
  for (const [id, unit] of [['lean', '°'], ['step', 'm']]) {
    const show = () => {
      const said = `${byId(id).value} ${unit}`;
      byId(`${id}-value`).textContent = said;
      byId(id).setAttribute('aria-valuetext', said);
    };
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
    desk.linked = editor.value;
    history.replaceState(null, '', linkTo(editor.value));
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    tell('the address of this page now holds the rig, and is in the clipboard where the browser allows it');
  });
  addEventListener('hashchange', openLink);
  let resized = null;
  addEventListener('resize', () => {
    clearTimeout(resized);
    resized = setTimeout(() => { if (desk.design !== null) { showLoop(); showDesign(); } }, 150);
  });
}

// What the page shows first: the rig of its address, what the tab held when it was loaded before, or the first example.
function first() {
  const { name, toml } = examples.find((example) => example.name === FIRST) ?? examples[0];
  byId('example').value = name;
  if (!editor.goOn(store()?.getItem(KEPT))) editor.set(toml, null);
  if (!openLink()) {
    const said = byId('notice').textContent;
    changed();
    if (said !== '') notice(said, { isBad: true });
  }
}

async function begin() {
  const module = bytesOf('module');
  checker = new Thread(module);
  designer = new Thread(module);
  trust = new Trust(module);
  twin = new Twin(module, (why) => tell(why, true));
  listen();
  addEventListener('pagehide', () => {
    // A store that is too small keeps nothing.
    try { store()?.setItem(KEPT, editor.kept()); } catch {}
  });
  const begins = (name) => {
    byId('example').value = name;
    const example = examples.find((one) => one.name === name);
    if (example !== undefined) replace(example.toml, `${name}, the rig of the exercise,`);
  };
  new Lessons(begins, (question) => designer.answerTo(question), () => twin.falls);
  first();
  twin.goOn(editor.value);
}

// For tests, and for the curious.
globalThis.upright = { desk, exported, motions, trusted: () => trust.laws, keptBytes: () => twin.kept?.kept.bytes.length ?? 0, ask: (question) => designer.answerTo(question), isBusy: () => checker === null || checker.isBusy || designer.isBusy };
begin().catch((error) => tell(`this browser cannot compute the design: ${error.message}`, true));
