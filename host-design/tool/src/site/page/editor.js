// The rig as text and as a form.

const byId = (id) => document.getElementById(id);

function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

// Line numbers beside the text; the line of an error stands out.
class Editor {
  constructor(change) {
    this.text = byId('toml');
    this.lines = byId('lines');
    this.wrong = null;
    this.text.addEventListener('input', () => { this.number(); change(); });
    this.text.addEventListener('scroll', () => { this.lines.scrollTop = this.text.scrollTop; });
  }

  get value() { return this.text.value; }

  set(text) {
    if (this.text.value === text) return;
    const [top, at] = [this.text.scrollTop, this.text.selectionStart];
    this.text.value = text;
    this.text.setSelectionRange(at, at);
    this.text.scrollTop = top;
    this.number();
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
    if (failed === undefined) return;
    const where = failed.line === null ? 'this file: ' : `line ${failed.line}: `;
    problem.replaceChildren(element('b', { textContent: where }), failed.why);
  }
}

// Numbers of the rig as fields; `set` is called with the key and the new value.
class Form {
  constructor(set) {
    this.set = set;
    this.keys = '';
  }

  show(fields) {
    const keys = fields.map(({ key }) => key).join();
    if (keys !== this.keys) {
      this.keys = keys;
      byId('form').replaceChildren(...fields.map((field) => this.field(field)));
    }
    for (const { key, value } of fields) {
      const input = byId(`field-${key}`);
      if (document.activeElement !== input) input.value = value;
    }
  }

  field({ key, label, unit }) {
    const input = element('input', { id: `field-${key}`, type: 'text', inputMode: 'decimal', title: key });
    input.addEventListener('change', () => this.set(key, input.value.trim()));
    return element('label', {}, `${label} (${unit})`, input);
  }
}

// Sliders for the weights of the LQR, from a hundredth to a hundred times their value when they appeared.
class Weights {
  constructor(set) {
    this.set = set;
    this.count = null;
  }

  show(weights) {
    const place = byId('weights');
    if (weights === null) {
      this.count = null;
      place.replaceChildren();
      return;
    }
    const all = [...weights.states.map((value, state) => ({ key: `lqr.state_weights[${state + 1}]`, value, label: stateName(state) })),
      { key: 'lqr.force_weight', value: weights.force, label: 'weight of the input' }];
    if (all.length !== this.count) {
      this.count = all.length;
      place.replaceChildren(element('h3', { textContent: 'Weights of the LQR' }), ...all.map((weight) => this.slider(weight)));
    }
    for (const { key, value } of all) {
      const input = byId(`weight-${key}`);
      if (document.activeElement !== input || input.dataset.value !== String(value)) {
        if (value > 0) input.value = Math.log10(value);
        input.dataset.value = value;
      }
      byId(`value-${key}`).textContent = value;
    }
  }

  slider({ key, value, label }) {
    const middle = Math.round(Math.log10(value > 0 ? value : 1));
    const input = element('input', { id: `weight-${key}`, type: 'range', min: middle - 3, max: middle + 3, step: 0.05, title: key });
    input.addEventListener('input', () => {
      const chosen = Number((10 ** Number(input.value)).toPrecision(2));
      input.dataset.value = chosen;
      byId(`value-${key}`).textContent = chosen;
      this.set(key, String(chosen));
    });
    return element('label', {}, element('span', { textContent: label }), element('output', { id: `value-${key}` }), input);
  }
}

// Name of a state of a chain.
function stateName(state) {
  const link = Math.floor(state / 2);
  if (link === 0) return ['position of the cart', 'speed of the cart'][state];
  return state % 2 === 0 ? `angle of link ${link}` : `rate of link ${link}`;
}
