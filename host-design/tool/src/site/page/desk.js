// The desk: puts text, form, drawing and design together.

const examples = JSON.parse(embedded('examples'));
const DEGREES = 180 / Math.PI;
const LEAST_MS = 16;
const KEPT = 'upright rig'; // name in the tab's store
const LARGEST_FILE = 1e6; // bytes
const NEEDS_TABLE = ['save-table', 'save-header', 'save-csv', 'balance', 'connect', 'verify'];
// What would be of the designed gains, and not of a person's own.
const OF_DESIGN = ['save-table', 'save-header', 'verify', 'connect'];
const SHOWN = ['stage', 'plots', 'figures', 'gains', 'poles', 'changes'];

// `linked` is the rig file that the address holds, `own` are a person's own gains; what is shown `isOld` after a wrong
// input.
const desk = { sketch: null, design: null, poles: null, survival: null, linked: null, isOld: false, own: null };
let [checker, designer, surveyor, twin, trust, live, imperfections, labs] = new Array(8).fill(null);

const editor = new Editor(() => changed());
const comparison = new Comparison();
// Gives keys of the rig file other values, or none, and its chain a number of links; `kind` names the change for undo.
const set = (values, kind, refuse, links = null) => {
  checker?.ask('set', { ask: 'set', toml: editor.value, values, links }, (answer) => {
    if (answer.failed === undefined) {
      editor.set(answer.toml, kind);
      return changed();
    }
    outdate(answer.failed.why);
    return refuse?.(answer.failed.why);
  });
};
const form = new Form(set, (why) => outdate(why));
const weights = new Weights(set);
const dials = new Dials(set);
const machine = new MachinePictures(set);
const panels = new Panels((name) => { if (['law', 'run'].includes(name)) drawFigures(); });
const differences = new Differences((key, value) => set([[key, value]], key), () => panels.open('file'));
const snapshots = new Snapshots(() => showLoop());

function tell(text, isBad = false) {
  byId('told').textContent = text;
  byId('told').classList.toggle('bad', isBad);
}

// Says something that stays until the rig is changed, beside buttons: for each its text, and what it does.
function notice(text, choices = {}, isBad = false) {
  byId('notice').hidden = text === '';
  byId('notice').classList.toggle('bad', isBad);
  byId('notice').replaceChildren(text, ...Object.entries(choices).map(([said, act]) => {
    const button = element('button', { type: 'button', textContent: said });
    button.addEventListener('click', act);
    return button;
  }));
}

// What is shown is not of the rig that is wanted; `why` says what is wrong with that one.
function outdate(why) {
  desk.isOld = true;
  for (const id of SHOWN) byId(id).classList.add('old');
  for (const id of NEEDS_TABLE) byId(id).disabled = true;
  byId('verdict').className = 'bad';
  byId('verdict').replaceChildren(...inPieces(why));
  byId('figures').textContent = '';
  byId('unusual').replaceChildren(element('li', { textContent: 'What moves and is drawn is the rig before.' }));
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
    history.replaceState(null, '', withoutHash());
  }
  trust.forget();
  comparison.changes();
  checker.ask('check', { ask: 'check', toml: editor.value }, checked);
}

function checked(answer) {
  if (answer.failed !== undefined) return wrong(answer.failed);
  editor.mark(undefined);
  for (const id of NEEDS_TABLE) byId(id).disabled = true;
  sketched(answer);
  return redesign();
}

// What can be shown of a rig before it is designed.
function sketched(answer) {
  desk.sketch = answer;
  if (examples.some(({ name }) => name === answer.rig)) byId('example').value = answer.rig;
  form.show(answer.fields);
  weights.show(answer.weights, answer.base);
  dials.show(answer.dials, answer.rig, answer.lengths_m.length);
  machine.show(answer);
  live.rest(answer);
  const { name, text } = editor.origin;
  checker.ask('differences', { ask: 'differences', toml: editor.value, from: text }, (found) => {
    differences.show(name, found.differences ?? []);
  });
}

// How the closed loop is disturbed in the run that is shown.
const disturbed = () => ({ lean_rad: Number(byId('lean').value) / DEGREES, step_m: Number(byId('step').value) });

function redesign() {
  for (const id of ['plots', 'gains', 'poles', 'figures', 'changes']) byId(id).classList.add('old');
  byId('verdict').className = 'waits';
  const toml = editor.value;
  tell('designing …');
  designer.ask('design', { ask: 'design', toml, own: desk.own, ...disturbed() }, (answer, ms) => {
    if (answer.failed !== undefined) return toml === editor.value ? undesigned(answer.failed) : undefined;
    designed(answer, ms, toml);
    return designer.ask('poles', { ask: 'poles', toml }, (poles) => {
      if (poles.failed !== undefined) return;
      desk.poles = poles;
      showDesign();
    });
  });
}

// Own gains may be too many or too few for the rig.
function undesigned(failed) {
  if (desk.own === null) return wrong(failed);
  byId('own-said').textContent = plain(failed.why);
  return outdate(failed.why);
}

// A person's own gains in place of the designed ones, which null brings back.
function useOwn(gains) {
  desk.own = gains;
  byId('own-said').textContent = '';
  byId('use-designed').hidden = gains === null;
  comparison.changes();
  redesign();
}

function designed(answer, ms, toml) {
  Object.assign(desk, { design: answer, isOld: false });
  const law = byId('law');
  const names = answer.laws.map(({ law: name }) => name);
  if ([...law.options].map(({ value }) => value).join() !== names.join()) {
    law.replaceChildren(...answer.laws.map(({ law: value, title }) => element('option', { value, textContent: title })));
  }
  if (answer.crc === null) tell(`no table: ${plain(answer.no_table)}`, true);
  else tell(`designed in ${(ms / 1e3).toFixed(2)} s`);
  for (const id of NEEDS_TABLE) byId(id).disabled = answer.crc === null || (desk.own !== null && OF_DESIGN.includes(id));
  byId('stage').classList.remove('old');
  if (answer.crc !== null && (toml !== live.wanted?.toml || desk.own !== live.wanted.own)) live.show({ toml, motions: null, own: desk.own });
  showLoop();
  showDesign();
  survey(toml);
}

// How much it stands takes longer than the design.
function survey(toml) {
  desk.survival = null;
  if (chosen()?.run?.fell !== false || desk.sketch.lengths_m.length === 0) return showAbilities();
  surveyor ??= new Thread(live.module);
  return surveyor.ask('survival', { ask: 'survival', toml, own: desk.own, law: byId('law').value }, (answer) => {
    if (toml !== editor.value || answer.failed !== undefined) return;
    desk.survival = answer;
    showAbilities();
  });
}

function showAbilities() {
  if (desk.isOld) return;
  const run = chosen()?.run;
  if (run !== null && run !== undefined) byId('verdict').textContent = inWords(run);
  comparison.take({ survival: desk.survival ?? {}, law: chosen() });
  if (desk.design !== null) snapshots.show(snapshot());
  byId('changes').classList.toggle('old', desk.survival === null && run?.fell === false);
}

// What the run shows, and how much the loop stands, in plain words.
function inWords({ fell }) {
  if (fell) return desk.own === null ? 'falls' : 'your K: falls';
  if (desk.sketch.unusual.length > 0) return 'survives, if its numbers are right:';
  const { tilt_rad: tilt, touch_n: touch } = desk.survival ?? {};
  const parts = [desk.own === null ? 'survives' : 'your K survives', ...(tilt === undefined ? [] : [`tilt up to ${Number((tilt * DEGREES).toPrecision(2))}°`]),
    ...(touch === undefined || touch === null ? [] : [`touch of ${Number(touch.toPrecision(2))} N`])];
  return parts.join(' · ');
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
  for (const id of ['plots', 'figures']) byId(id).classList.remove('old');
  if (run === null) return byId('plots').replaceChildren();
  const { noun, position: [name, unit] } = desk.sketch.base;
  const links = desk.sketch.lengths_m.length;
  const state = (index, factor = 1) => (row) => factor * row[3][index];
  const plots = [
    [`${name} (${unit})`, [{ name: noun, value: state(0), colour: curveColour(0) }, { name: 'set-point', value: (row) => row[1], colour: 'var(--limit)' }]],
    ['angles (°)', desk.sketch.lengths_m.map((_, link) => ({ name: `link ${link + 1}`, value: state(2 + 2 * link, DEGREES), state: 2 + 2 * link, colour: curveColour(link) }))],
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
  const kept = snapshots.curves(plots.map(([, curves]) => curves));
  plots.forEach(([, curves], index) => drawCurves(byId('plots').querySelectorAll('svg')[index], curves, run.rows, kept?.[index]));
  snapshots.show(snapshot());
  return undefined;
}

// What is kept of the loop as it is now, to be compared with another one.
function snapshot() {
  const law = chosen();
  return { name: `${desk.sketch.rig}, ${desk.own === null ? law?.title ?? 'no law' : 'your K'}`, lengths: desk.sketch.lengths_m, arc: desk.sketch.base.arc_m, travel: desk.sketch.travel_m, rows: law?.run?.rows ?? null,
    abilities: abilities({ survival: desk.survival ?? {}, law }) };
}

// Figures have the size of their place, so they are drawn when it is in view.
function drawFigures() {
  if (desk.design === null) return;
  showLoop();
  showDesign();
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

function save(name, text, type = 'text/plain') {
  const address = URL.createObjectURL(new Blob([text], { type }));
  element('a', { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10e3);
}

// What `upright design`, `upright export` and `upright simulate --csv` write.
async function exported(kind) {
  const answer = await designer.answerTo({ ask: kind, toml: editor.value, law: byId('law').value, own: desk.own, ...disturbed() });
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
  const { isOwn, value } = editor;
  editor.set(toml, what, { name: what, text: toml });
  changed();
  return isOwn && value !== toml ? notice(`${what} has taken the place of your rig.`, { undo: (event) => editor.step(event, true) }) : undefined;
}

// Puts a rig or a lab into the address.
async function copyLink(kind, toml) {
  history.replaceState(null, '', linkTo(kind, toml));
  await navigator.clipboard?.writeText(location.href).catch(() => {});
  tell(`the address of this page now holds the ${kind}, and is in the clipboard where the browser allows it`);
}

// The lab in the address, if there is one.
function openLab() {
  const link = inAddress('lab');
  if (link?.why !== undefined) notice(link.why, {}, true);
  else if (link !== null) labs.add(link.toml);
}

async function openFile(file) {
  if (file.size > LARGEST_FILE) return notice(`${file.name} is too large for a rig file.`, {}, true);
  const text = await file.text();
  return /^\[\[step\]\]/m.test(text) ? labs.add(text) : replace(text, file.name);
}

// The rig in the address, if there is one. It takes no work away without a word; nor does a lab.
function openLink() {
  const link = inAddress('rig');
  if (link === null) return false;
  if (link.why !== undefined) {
    notice(link.why, {}, true);
    return false;
  }
  const open = () => {
    desk.linked = link.toml;
    replace(link.toml, 'the rig of the link');
  };
  if (!editor.isOwn || editor.value === link.toml) {
    open();
    return true;
  }
  notice('The link holds another rig than the one that you have changed here.', {
    'open the rig of the link': open,
    'keep mine': () => {
      history.replaceState(null, '', withoutHash());
      notice('');
    },
  });
  return false;
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
  byId('use-own').addEventListener('click', () => {
    const gains = byId('own').value.split(/[\s;]+/).filter((word) => word !== '').map(numberOf);
    const wrong = gains.find(({ why }) => why !== undefined);
    if (wrong === undefined) useOwn(gains.map(({ value }) => value));
    else byId('own-said').textContent = wrong.why;
  });
  byId('use-designed').addEventListener('click', () => useOwn(null));
  byId('keep').addEventListener('click', () => { snapshots.keep(snapshot()); });
  byId('example').replaceChildren(...examples.map(({ name }) => element('option', { value: name, textContent: name })));
  byId('example').addEventListener('change', ({ target }) => {
    replace(examples.find(({ name }) => name === target.value).toml, target.value);
  });
  listenToFiles();
  for (const [id, unit] of [['lean', () => '°'], ['step', () => desk.sketch?.base.position[1] ?? 'm']]) {
    const show = () => {
      const said = `${byId(id).value} ${unit()}`;
      byId(`${id}-value`).textContent = said;
      byId(id).setAttribute('aria-valuetext', said);
    };
    show();
    byId(id).addEventListener('input', () => { show(); redesign(); });
  }
  byId('law').addEventListener('change', () => { drawFigures(); trust.show(); survey(editor.value); });
  byId('balance').addEventListener('click', () => {
    twin.open({ toml: editor.value, motions: desk.own === null ? motions() : null, own: desk.own, upright: byId('raised').checked, since_1970_s: Date.now() / 1e3 });
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
  byId('link').addEventListener('click', () => {
    desk.linked = editor.value;
    copyLink('rig', editor.value);
  });
  addEventListener('hashchange', () => { openLink(); openLab(); });
  let resized = null;
  addEventListener('resize', () => {
    clearTimeout(resized);
    resized = setTimeout(drawFigures, 150);
  });
}

// What the page shows first: the rig of its address, what the tab held when it was loaded before, or the first example.
function first() {
  const { name, sketch } = JSON.parse(embedded('first'));
  const { toml } = examples.find((example) => example.name === name) ?? examples[0];
  byId('example').value = name;
  if (!editor.goOn(store()?.getItem(KEPT))) editor.set(toml, null, { name, text: toml });
  // This one can be shown, and begins to move, before anything else is computed.
  if (editor.value === toml && inAddress('rig') === null) {
    sketched(sketch);
    live.show({ toml, motions: null, own: null });
  }
  if (!openLink()) {
    const said = [...byId('notice').childNodes];
    changed();
    byId('notice').replaceChildren(...said);
    byId('notice').hidden = said.length === 0;
  }
}

function begin() {
  // The module is unpacked and compiled while the page is already shown.
  const module = new Promise((take) => { requestAnimationFrame(() => setTimeout(take)); }).then(() => WebAssembly.compile(bytesOf('module')));
  live = new Live(module, (properties) => imperfections.show(properties));
  imperfections = new Imperfections(live);
  checker = new Thread(module);
  designer = new Thread(module);
  trust = new Trust(module);
  twin = new Twin(module, (why) => tell(why, true), (isAway) => live.away(isAway));
  listen();
  addEventListener('pagehide', () => {
    // A store that is too small keeps nothing.
    try { store()?.setItem(KEPT, editor.kept()); } catch {}
  });
  first();
  labs = new Labs((toml, title) => replace(toml, `The rig of “${title}”`), (question) => designer.answerTo(question), () => twin.falls);
  twin.goOn(editor.value);
  openLab();
  return module;
}

// For tests, and for the curious.
globalThis.upright = { desk, exported, motions, trusted: () => trust.laws, keptBytes: () => twin.kept?.kept.bytes.length ?? 0, live: () => live, ask: (question) => designer.answerTo(question), isBusy: () => checker === null || checker.isBusy || designer.isBusy };
begin().catch((error) => tell(`this browser cannot compute the design: ${error.message}`, true));
