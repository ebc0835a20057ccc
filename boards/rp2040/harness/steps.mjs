// The step output of the image (boards/rp2040/src/board/steps.rs): its state machine, by its own divided clock, and every
// pulse that it gives.

const STEP = 1 << 10;
const DIRECTION = 1 << 11;
/** Instructions that count Y down to 0. */
const LOOPS = [29, 31];

export class StepOutput {
  /** The number of the tick, for the words that it writes. */
  tick = 0;

  constructor(block) {
    this.block = block;
    this.machine = block.machines[0];
    this.now = 0;
    /** Cycles that the state machine has not had yet. */
    this.credit = 0;
    this.level = this.direction = 0;
    this.turned = 0;
    this.rose = -1;
    this.ticks = [];
    this.trains = [];
    this.train = null;
    const { machine } = this;
    const write = machine.writeFIFO.bind(machine);
    machine.writeFIFO = (word) => { this.ticks.push(this.tick); write(word); };
    const pull = machine.txFIFO.pull.bind(machine.txFIFO);
    machine.txFIFO.pull = () => { this.#begin(); return pull(); };
  }

  /** Whether the image gives pulses: no other program sets a pin beside its instructions. */
  get isUsed() {
    return this.machine.enabled && this.machine.sidesetCount === 1;
  }

  /** The pulses of a tick: their sum by direction; cycles to the first one, of the shortest and the longest interval, of
   * the shortest pulse, and since the direction changed, at least. */
  #begin() {
    this.train = { tick: this.ticks.shift(), pulses: 0, begin: this.now, first: 0, shortest: 1e9, longest: 0, width: 1e9, setup: 1e9 };
    this.trains.push(this.train);
  }

  /** Time passes. */
  pass(cycles) {
    const { machine } = this;
    const end = this.now + cycles;
    if (machine.waiting && machine.txFIFO.empty && this.block.pinValues === this.pins) { this.now = end; return; }
    this.#watch();
    this.credit += cycles;
    const divider = machine.clockDivInt;
    while (this.credit >= divider) {
      if (machine.waiting && machine.txFIFO.empty) { this.credit %= divider; break; }
      const left = LOOPS.includes(machine.pc) ? Math.min(machine.y, Math.floor(this.credit / divider)) : 0;
      machine.y -= left;
      this.credit -= left * divider;
      if (this.credit < divider) break;
      this.credit -= divider;
      this.now = end - this.credit;
      machine.step();
      this.#watch();
    }
    this.now = end;
  }

  #watch() {
    const { now, train } = this;
    const level = this.block.pinValues & STEP;
    const direction = this.block.pinValues & DIRECTION;
    if (direction !== this.direction) this.turned = now;
    if (level && !this.level) {
      train.pulses += direction ? 1 : -1;
      train.setup = Math.min(train.setup, now - this.turned);
      const interval = now - this.rose;
      if (train.first === 0) train.first = now - train.begin;
      else Object.assign(train, { shortest: Math.min(train.shortest, interval), longest: Math.max(train.longest, interval) });
      this.rose = now;
    }
    if (!level && this.level) train.width = Math.min(train.width, now - this.rose);
    this.level = level;
    this.direction = direction;
    this.pins = this.block.pinValues;
  }

  /** The pulses of the ticks that are over. */
  takeEnded() {
    const idle = this.machine.waiting && this.machine.txFIFO.empty;
    return this.trains.splice(0, this.trains.length - (idle ? 0 : 1));
  }
}
