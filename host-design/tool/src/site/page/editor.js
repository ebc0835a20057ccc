// The rig as text and as a form.

const { inPieces, plain } = modules['words.js'];

const byId = (id) => document.getElementById(id);

function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

// Line numbers beside the text; the line of an error stands out. Whatever changes the text, undo takes it back.
// `origin` is what the person began with: its name and text.
class Editor {
  constructor(change) {
    Object.assign(this, { change, text: byId('toml'), lines: byId('lines'), wrong: null, past: new Past(), origin: { name: '', text: '' } });
    this.last = this.state;
    this.text.addEventListener('input', () => { this.note('typing'); change(); });
    this.text.addEventListener('scroll', () => { this.lines.scrollTop = this.text.scrollTop; });
    // The browser's own undo knows nothing of texts that were not typed.
    this.text.addEventListener('beforeinput', (event) => {
      const isBack = { historyUndo: true, historyRedo: false }[event.inputType];
      if (isBack !== undefined) this.step(event, isBack);
    });
    this.text.addEventListener('keydown', (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
      const key = event.key.toLowerCase();
      if (key === 'z' || key === 'y') this.step(event, key === 'z' && !event.shiftKey);
    });
    byId('undo').addEventListener('click', (event) => this.step(event, true));
    byId('redo').addEventListener('click', (event) => this.step(event, false));
  }

  get value() { return this.text.value; }

  get state() { return { text: this.text.value, origin: this.origin }; }

  // Whether a person has worked on it.
  get isOwn() { return this.value.trim() !== '' && this.value !== this.origin.text; }

  // Another text; `kind` is what changes it, null what cannot be taken back.
  set(text, kind, origin = this.origin) {
    this.origin = origin;
    if (this.text.value === text) return;
    const [top, at] = [this.text.scrollTop, this.text.selectionStart];
    this.text.value = text;
    this.text.setSelectionRange(at, at);
    this.text.scrollTop = top;
    if (kind === null) this.last = this.state;
    this.note(kind);
  }

  // The text has changed.
  note(kind) {
    if (this.text.value !== this.last.text) this.past.note(this.last, kind);
    this.last = this.state;
    this.number();
    this.offer();
  }

  step(event, isBack) {
    event.preventDefault();
    const to = this.past.step(this.state, isBack);
    if (to === null) return;
    this.set(to.text, null, to.origin);
    this.change();
  }

  offer() {
    byId('undo').disabled = this.past.before.length === 0;
    byId('redo').disabled = this.past.after.length === 0;
  }

  // The text and what it was before, as text, from which a page that is loaded again goes on.
  kept() { return JSON.stringify({ ...this.state, before: this.past.before, after: this.past.after }); }

  // Goes on from what was kept; returns whether there was something.
  goOn(kept) {
    try {
      const { text, origin, before, after } = JSON.parse(kept);
      if (typeof text !== 'string') return false;
      this.set(text, null, origin);
      Object.assign(this.past, { before, after });
      this.offer();
      return true;
    } catch { return false; }
  }

  number() {
    const count = this.text.value.split('\n').length;
    const parts = [];
    for (let line = 1; line <= count; line += 1) {
      parts.push(line === this.wrong ? element('b', { textContent: line }) : document.createTextNode(`${line}\n`));
    }
    this.lines.replaceChildren(...parts);
    this.lines.scrollTop = this.text.scrollTop;
  }

  // Shows what is wrong, or nothing.
  mark(failed) {
    this.wrong = failed?.line ?? null;
    this.number();
    const problem = byId('problem');
    problem.hidden = failed === undefined;
    if (failed !== undefined) problem.replaceChildren(element('b', { textContent: placeOf(failed) }), ...inPieces(failed.why));
  }
}

// Where an error is.
const placeOf = ({ line }) => (line === null ? 'this file: ' : `line ${line}: `);

// Numbers of the rig as fields; `set(values, kind, refuse)` changes them, or says why not.
class Form {
  constructor(set, refused) {
    Object.assign(this, { set, refused, keys: '' });
  }

  show(fields) {
    const keys = fields.map(({ key }) => key).join();
    if (keys !== this.keys) {
      this.keys = keys;
      byId('form').replaceChildren(...fields.map((field) => this.field(field)));
    }
    for (const { key, value } of fields) {
      const input = byId(`field-${key}`);
      this.say(input, '');
      if (document.activeElement !== input) input.value = value;
    }
  }

  field({ key, label, unit }) {
    const input = element('input', { id: `field-${key}`, type: 'text', inputMode: 'decimal', title: key });
    const refuse = (said) => {
      const why = said.replace(`${key}: `, '');
      this.say(input, why);
      this.refused(`${label} (${unit}): ${why}`);
    };
    input.addEventListener('change', () => {
      const { value, why } = numberOf(input.value);
      if (why === undefined) this.set([[key, String(value)]], key, refuse);
      else refuse(why);
    });
    return element('label', {}, `${label} (${unit})`, input, element('small', {}));
  }

  // Says beside a field what is wrong with it, or nothing.
  say(input, why) {
    input.setAttribute('aria-invalid', why !== '');
    input.nextElementSibling.replaceChildren(...inPieces(why));
  }
}

// Sliders for the weights of the LQR, from a hundredth to a hundred times their value when they appeared.
class Weights {
  constructor(set) {
    this.set = set;
    this.shown = null;
  }

  show(weights, { noun }) {
    const place = byId('weights');
    if (weights === null) {
      this.shown = null;
      place.replaceChildren();
      return;
    }
    const all = [...weights.states.map((value, state) => ({ key: `lqr.state_weights[${state + 1}]`, value, label: stateName(state, noun) })),
      { key: 'lqr.force_weight', value: weights.force, label: 'weight of the input' }];
    const shown = `${all.length} ${noun}`;
    if (shown !== this.shown) {
      this.shown = shown;
      place.replaceChildren(element('h3', { textContent: 'Weights of the LQR' }), ...all.map((weight) => this.slider(weight)));
    }
    for (const { key, value } of all) {
      const input = byId(`weight-${key}`);
      if (document.activeElement !== input || input.dataset.value !== String(value)) {
        if (value > 0) input.value = Math.log10(value);
        input.dataset.value = value;
      }
      this.say(key, value);
    }
  }

  // What the slider has is the logarithm: a screen reader is told the value.
  say(key, value) {
    byId(`value-${key}`).textContent = value;
    byId(`weight-${key}`).setAttribute('aria-valuetext', value);
  }

  slider({ key, value, label }) {
    const middle = Math.round(Math.log10(value > 0 ? value : 1));
    const input = element('input', { id: `weight-${key}`, type: 'range', min: middle - 3, max: middle + 3, step: 0.05, title: key });
    input.addEventListener('input', () => {
      const chosen = Number((10 ** Number(input.value)).toPrecision(2));
      input.dataset.value = chosen;
      this.say(key, chosen);
      this.set([[key, String(chosen)]], key);
    });
    return element('div', { className: 'slider' }, element('label', { htmlFor: input.id, textContent: label }), element('output', { id: `value-${key}` }), input);
  }
}

// Name of a state of a chain.
function stateName(state, noun) {
  const link = Math.floor(state / 2);
  if (link === 0) return [`position of the ${noun}`, `speed of the ${noun}`][state];
  return state % 2 === 0 ? `angle of link ${link}` : `rate of link ${link}`;
}
