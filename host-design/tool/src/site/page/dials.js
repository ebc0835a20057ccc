// The three sliders that a person finds first, and what the last change changed.

const { newtons } = modules['guide.js'];

const DIALS = {
  length: { label: (links) => (links === 1 ? 'length' : 'length of all links'), text: (value) => `${value.toFixed(2)} m`, octaves: 2 },
  weight: { label: (links) => (links === 1 ? 'weight' : 'weight of all links'), text: (value) => (value < 1 ? `${(1e3 * value).toFixed(0)} g` : `${value.toFixed(2)} kg`), octaves: 3 },
  late: { label: () => 'how late the force is', text: (value) => `${(1e3 * value).toFixed(0)} ms`, most: 0.04, step: 0.001 },
};
const DIGITS = 6;

class Dials {
  // `set(values, kind, refuse)` gives keys of the rig file other values.
  constructor(set) {
    Object.assign(this, { set, keys: '', shown: new Map(), from: null, movedAt: -Infinity });
  }

  show(dials, rig, links) {
    const keys = JSON.stringify([rig, dials.map(({ name, scales }) => [name, scales.map(([key]) => key)])]);
    if (keys !== this.keys) {
      this.keys = keys;
      this.shown = new Map(dials.map((dial) => [dial.name, { base: dial.value }]));
      byId('dials').replaceChildren(...dials.map((dial) => this.slider(dial, links)));
    }
    for (const dial of dials) {
      const shown = this.shown.get(dial.name);
      shown.dial = dial;
      byId(`said-${dial.name}`).textContent = '';
      if (document.activeElement !== byId(`dial-${dial.name}`) || performance.now() - this.movedAt > ONE_STEP_MS) this.place(dial, shown.base);
    }
  }

  place({ name, value }, base) {
    byId(`dial-${name}`).value = DIALS[name].octaves === undefined ? value : Math.log2(value / base);
    this.say(name, value);
  }

  say(name, value) {
    const text = DIALS[name].text(value);
    byId(`value-${name}`).textContent = text;
    byId(`dial-${name}`).setAttribute('aria-valuetext', text);
  }

  slider({ name }, links) {
    const { label, octaves, most, step } = DIALS[name];
    const range = octaves === undefined ? { min: 0, max: most, step } : { min: -octaves, max: octaves, step: 0.02 };
    const input = element('input', { id: `dial-${name}`, type: 'range', ...range });
    input.addEventListener('input', () => this.move(name, Number(input.value)));
    const labelled = element('label', { htmlFor: input.id, textContent: label(links) });
    return element('div', { className: 'dial' }, labelled, element('output', { id: `value-${name}`, htmlFor: input.id }), input, element('small', { id: `said-${name}` }));
  }

  move(name, at) {
    const now = performance.now();
    const { base, dial } = this.shown.get(name);
    // All positions of one movement start from the same file, so that rounding does not add up.
    if (this.from?.name !== name || now - this.movedAt > ONE_STEP_MS) this.from = dial;
    this.movedAt = now;
    const value = Number((DIALS[name].octaves === undefined ? at : base * 2 ** at).toPrecision(3));
    this.say(name, value);
    const scaled = ([key, was, power]) => {
      if (power === null) return [key, value === 0 ? null : String(value)];
      return [key, String(Number((was * (value / this.from.value) ** power).toPrecision(DIGITS)))];
    };
    this.set(this.from.scales.map(scaled), name, (why) => { byId(`said-${name}`).replaceChildren(...inPieces(why)); });
  }
}

// What a loop can do, in numbers that a person compares: name, value, text, and whether more of it is better.
function abilities({ survival, law }) {
  const gains = law?.sampled?.k ?? law?.continuous?.k;
  return [
    survival?.tilt_rad === undefined ? null : ['tilt', survival.tilt_rad, `${(survival.tilt_rad * DEGREES).toFixed(1)}°`, true],
    survival?.touch_n === undefined || survival.touch_n === null ? null : ['touch', survival.touch_n, newtons(survival.touch_n), true],
    gains?.[2] === undefined ? null : ['gain on the angle', gains[2], short(Number(gains[2].toPrecision(3))), null],
    law?.radius === undefined ? null : ['slowest pole, at the tick', law.radius, law.radius.toFixed(5), false],
  ].filter((ability) => ability !== null);
}

// What the loop can do now beside what it could before the last change.
class Comparison {
  constructor() { Object.assign(this, { before: null, now: null, changedAt: -Infinity }); }

  // The rig is about to change: changes that follow at once belong together.
  changes() {
    const at = performance.now();
    const isNew = this.before === null || at - this.changedAt > 2 * ONE_STEP_MS;
    if (isNew && this.now !== null) this.before = this.now;
    this.changedAt = at;
  }

  take(now) {
    this.now = abilities(now);
    const rows = this.now.flatMap(([name, value, text, isGood]) => {
      const was = this.before?.find(([other]) => other === name);
      if (was === undefined || was[2] === text) return [];
      const kind = isGood === null ? '' : (value > was[1]) === isGood ? 'better' : 'worse';
      const mark = kind === '' ? '' : value > was[1] ? ' ▲' : ' ▼';
      return [element('tr', {}, element('th', { textContent: name, scope: 'row' }), element('td', { textContent: was[2] }),
        element('td', { textContent: `→ ${text}${mark}`, className: kind }))];
    });
    byId('changes').tBodies[0].replaceChildren(...rows);
  }
}
