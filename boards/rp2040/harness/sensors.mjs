// Absolute sensors whose registers are read on two wires (UM10204, Fast-mode Plus), each with a data wire of its own.

/** Least times in ns: clock low and high; data before the clock rises; start and stop. */
const LEAST = { low: 500, high: 260, setUp: 50, condition: 260 };

export class RegisterSensor {
  constructor({ address, first }) {
    this.address = address;
    this.first = first;
    this.values = [];
    this.defect = null;
    this.pointer = 0;
    this.doing = 'nothing';
    this.bits = 0;
    this.shift = 0;
    this.acknowledged = false;
    this.pulls = false;
    this.clock = true;
    this.released = true;
    this.edges = { clock: -1e6, data: -1e6 };
  }

  /** New values of the registers; a defect: "open", "grounded", "address", "holds" or null. */
  set({ values, defect }) {
    if (values) this.values = values;
    if (defect === undefined) return;
    this.defect = defect;
    // It has sent two bits of a byte of zeros when a reading was broken off.
    if (defect === 'holds') Object.assign(this, { doing: 'sends', bits: 2, shift: 0, pulls: true });
  }

  get level() {
    if (this.defect === 'open') return true;
    return this.released && this.defect !== 'grounded' && !this.pulls;
  }

  /** Takes the levels of the clock and of what the chip does with the data wire. */
  hear(clock, released, now) {
    const before = { clock: this.clock, data: this.level };
    this.released = released;
    const data = this.level;
    const since = (edge) => now - this.edges[edge];
    if (before.clock !== clock) {
      const soon = clock ? since('clock') < LEAST.low || since('data') < LEAST.setUp
        : since('clock') < LEAST.high || (this.bits === 0 && since('data') < LEAST.condition);
      if (soon) throw new Error(`an edge on two wires too soon: ${JSON.stringify({ clock, bits: this.bits, of: since('clock'), data: since('data') })}`);
      this.clock = clock;
      this.edges.clock = now;
      if (clock) this.#rises(data); else this.#falls();
    } else if (clock && before.data !== data) {
      if (since('clock') < LEAST.condition) throw new Error('a start or a stop too soon');
      Object.assign(this, { doing: data ? 'nothing' : 'takesAddress', bits: 0, shift: 0 });
    }
    if (before.data !== this.level) this.edges.data = now;
  }

  #rises(data) {
    this.bits += 1;
    if (this.bits === 9) this.acknowledged = !data;
    else if (this.doing !== 'nothing' && this.doing !== 'sends') this.shift = ((this.shift << 1) | data) & 0xff;
  }

  #falls() {
    if (this.doing === 'nothing') this.pulls = false;
    else if (this.bits === 8) {
      if (this.doing === 'sends') this.pulls = false; else this.#take();
    } else if (this.bits === 9) {
      this.bits = 0;
      this.#next();
    } else if (this.bits > 0 && this.doing === 'sends') this.pulls = !((this.shift >> (7 - this.bits)) & 1);
  }

  #take() {
    const address = this.defect === 'address' ? this.address ^ 1 : this.address;
    if (this.doing === 'takesAddress' && this.shift >> 1 !== address) this.doing = 'nothing';
    if (this.doing === 'takesRegister') this.pointer = this.shift;
    this.pulls = this.doing !== 'nothing';
  }

  #next() {
    this.pulls = false;
    if (this.doing === 'takesAddress') this.doing = this.shift & 1 ? 'sends' : 'takesRegister';
    else if (this.doing === 'takesRegister') this.doing = 'takesValue';
    else if (this.doing === 'sends' && !this.acknowledged) this.doing = 'nothing';
    this.shift = 0;
    if (this.doing !== 'sends') return;
    this.shift = this.values[this.pointer - this.first] ?? 0;
    this.pointer = (this.pointer + 1) & 0xff;
    this.pulls = !(this.shift & 0x80);
  }
}
