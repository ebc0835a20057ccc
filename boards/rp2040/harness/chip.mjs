// A Raspberry Pi Pico in the emulator rp2040js, with the wires of docs/pico.md.
//
// Some things of the emulator are replaced here, because they do not follow the processor's clock, or take too long:
// - State machines run by the processor's cycles, not by a timer of the host. For speed, they stand still while nothing
//   reaches them; the dead man's switch then counts the time that has passed.
// - The state machine of step pulses has its own, divided clock (`steps.mjs`).
// - There is no boot ROM: the program starts at its vector table, with the flash readable.
// - An interrupt that is pending already when `wfi` begins ends it, as on the chip.
// - The watchdog only reports: `watchdog` is called, and the caller ends the run.

import { RP2040, USBCDC } from 'rp2040js';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { RegisterSensor } from './sensors.mjs';
import { StepOutput } from './steps.mjs';

const entry = dirname(fileURLToPath(import.meta.resolve('rp2040js')));
const { SimulationClock } = await import(join(entry, 'clock/simulation-clock.js'));

const CYCLE_NS = 8;
const SYSTICK = 15;
/** Cycles for which the state machines run after something has reached them. */
const SETTLING = 200;
/** Cycles from one edge of an encoder to the next: the state machines need ten. */
const EDGE = 12;
/** Where a function returns to that the harness calls. */
const RETURN = 0x20000000;
/** Levels of phases A and B, in the order in which they follow each other while the count grows. */
const PHASES = [[0, 0], [1, 0], [1, 1], [0, 1]];
/** Clock of absolute sensors. */
const ANGLE_CLOCK = 17;
const PINS = { limitLow: 13, limitHigh: 14, stop: 15, fault: 16, direction: 11, enable: 12, led: 25 };
/** The state machine of the dead man's switch: block, number, cycles of a round, its last round's first instruction. */
const GUARD = { block: 1, machine: 3, round: 6, first: 24, last: 29 };

/** Writes the blocks of a UF2 file into the flash. */
function flash(chip, path) {
  const file = readFileSync(path);
  for (let at = 0; at < file.length; at += 512) {
    if (file.readUInt32LE(at) !== 0x0a324655 || file.readUInt32LE(at + 28) !== 0xe48bff56) throw new Error('not a UF2 file');
    const bytes = file.subarray(at + 32, at + 32 + file.readUInt32LE(at + 16));
    chip.flash.set(bytes, file.readUInt32LE(at + 12) - 0x10000000);
  }
}

export class Pico {
  constructor(path, encoders) {
    this.clock = new SimulationClock();
    this.chip = new RP2040(this.clock);
    this.chip.logger = { debug() {}, info() {}, warn() {}, error: (from, text) => { throw new Error(`${from}: ${text}`); } };
    this.chip.onBreak = (code) => { throw new Error(`breakpoint ${code}`); };
    flash(this.chip, path);
    this.core = this.chip.core;
    this.core.VTOR = 0x10000100;
    this.core.SP = this.chip.flashView.getUint32(0x100, true);
    this.core.PC = this.chip.flashView.getUint32(0x104, true) & ~1;
    /** The least stack pointer so far. */
    this.lowest = this.core.SP;
    this.settling = 0;
    this.skipped = 0;
    for (const block of this.chip.pio) this.#followTheProcessor(block);
    this.steps = new StepOutput(this.chip.pio[0]);
    this.counts = Array(encoders).fill(0);
    this.targets = Array(encoders).fill(0);
    this.sinceEdge = 0;
    this.stands = false;
    this.watchdog = () => { throw new Error('the watchdog has ended the run'); };
    this.chip.peripherals[0x40058].onWatchdogTrigger = () => this.watchdog();
    this.#connectUsb();
    /** Sensors on two wires in the place of encoders. */
    this.sensors = [];
    for (let encoder = 0; encoder < encoders; encoder++) this.#setPhases(encoder);
    this.contacts({});
  }

  #followTheProcessor(block) {
    block.run = () => {};
    for (const access of ['readUint32', 'writeUint32']) {
      const plain = block[access].bind(block);
      block[access] = (offset, value) => {
        this.#catchUp();
        this.settling = SETTLING;
        const result = plain(offset, value);
        this.stepper = this.steps?.isUsed ? this.steps.machine : null;
        return result;
      };
    }
  }

  #connectUsb() {
    this.sent = [];
    this.isRead = true;
    this.usb = new USBCDC(this.chip.usbCtrl);
    this.usb.onSerialData = (bytes) => this.sent.push(...bytes);
    this.toChip = [];
    this.pending = null;
    // A read that the chip asks for waits until there are bytes for it.
    const plain = this.chip.usbCtrl.onEndpointRead;
    this.chip.usbCtrl.onEndpointRead = (endpoint, size) => {
      if (endpoint !== 0) { this.pending = { endpoint, size }; this.#feedUsb(); } else plain(endpoint, size);
    };
  }

  #feedUsb() {
    if (!this.pending || this.toChip.length === 0) return;
    const { endpoint, size } = this.pending;
    this.pending = null;
    this.chip.usbCtrl.endpointReadDone(endpoint, Uint8Array.from(this.toChip.splice(0, size)));
  }

  /** Sends bytes to the chip. */
  receive(bytes) {
    this.toChip.push(...bytes);
    this.#feedUsb();
  }

  /** Contacts: true is open, or a reported fault. */
  contacts({ limitLow = false, limitHigh = false, stop = false, fault = false }) {
    const set = (pin, level) => this.chip.gpio[pin].setInputValue(level);
    set(PINS.limitLow, limitLow);
    set(PINS.limitHigh, limitHigh);
    set(PINS.stop, stop);
    set(PINS.fault, !fault);
    this.#catchUp();
    this.settling = SETTLING;
  }

  /** What the converter reads from the divider of the supply. */
  supply(steps) {
    this.chip.adc.channelValues[0] = steps;
  }

  #setPhases(encoder) {
    if (this.sensors[encoder]) return;
    const [a, b] = PHASES[this.counts[encoder] & 3];
    this.chip.gpio[2 * encoder].setInputValue(!!b);
    this.chip.gpio[2 * encoder + 1].setInputValue(!!a);
  }

  /** Sets the registers of the sensor in the place of an encoder, or its defect; connects it, if it is not yet. */
  registers(encoder, sensor) {
    const pin = this.chip.gpio[2 * encoder + 1];
    if (!this.sensors[encoder]) {
      const connected = new RegisterSensor(sensor);
      this.sensors[encoder] = connected;
      const hear = () => {
        connected.hear(this.chip.gpio[ANGLE_CLOCK].outputValue, !(pin.outputEnable && !pin.outputValue), this.clock.nanos);
        pin.setInputValue(connected.level);
      };
      pin.addListener(hear);
      this.chip.gpio[ANGLE_CLOCK].addListener(hear);
      hear();
    }
    this.sensors[encoder].set(sensor);
    pin.setInputValue(this.sensors[encoder].level);
  }

  /** Moves encoders by one count each, if they are not where they should be. */
  #moveEncoders() {
    let moves = false;
    this.targets.forEach((target, encoder) => {
      if (this.counts[encoder] === target) return;
      this.counts[encoder] += Math.sign(target - this.counts[encoder]);
      this.#setPhases(encoder);
      moves = true;
    });
    if (moves) { this.#catchUp(); this.settling = SETTLING; }
    return moves;
  }

  /** The dead man's switch counts the time in which the state machines stood still. */
  #catchUp() {
    const machine = this.chip.pio[GUARD.block].machines[GUARD.machine];
    if (machine.enabled && machine.pc >= GUARD.first && machine.pc <= GUARD.last) {
      const rounds = Math.floor(this.skipped / GUARD.round);
      machine.x = Math.max((machine.x >>> 0) - rounds, 1);
      this.skipped -= rounds * GUARD.round;
    } else {
      this.skipped = 0;
    }
  }

  #stepStateMachines(cycles) {
    const { stepper } = this;
    for (let cycle = 0; cycle < cycles; cycle++) {
      for (const block of this.chip.pio) {
        for (const machine of block.machines) if (machine.enabled && machine !== stepper) machine.step();
        block.checkChangedPins();
      }
    }
  }

  /** Time passes: for the timers, the encoders, and the state machines. */
  #pass(cycles) {
    this.clock.tick(cycles * CYCLE_NS);
    if (this.stepper) this.steps.pass(cycles);
    const running = this.everyCycle ? cycles : Math.min(cycles, this.settling);
    this.#stepStateMachines(running);
    this.settling -= Math.min(running, this.settling);
    this.skipped += cycles - running;
    // Last, so that the state machines have had their cycles since the edge before.
    this.sinceEdge += cycles;
    if (this.sinceEdge >= EDGE) { this.sinceEdge = 0; this.#moveEncoders(); }
  }

  /** Runs one instruction, or waits for the next event. */
  step() {
    if (this.core.waiting && this.core.checkForInterrupts()) this.core.waiting = false;
    if (!this.core.waiting) {
      this.#pass(this.core.executeInstruction());
      if (this.core.SP < this.lowest) this.lowest = this.core.SP;
      return;
    }
    const next = Math.ceil(this.clock.nanosToNextAlarm / CYCLE_NS);
    const moving = this.targets.some((target, encoder) => target !== this.counts[encoder]);
    const most = moving ? EDGE : this.settling > 0 ? this.settling : this.everyCycle ? 100 : 1e5;
    this.#pass(Math.max(1, Math.min(next, most)));
  }

  /** Runs to the end of the next tick; returns its cycles. */
  tick() {
    const limit = this.clock.nanos + 1e9;
    while (this.core.IPSR !== SYSTICK) {
      this.step();
      if (this.clock.nanos > limit) throw new Error('no tick for a second');
    }
    const begin = this.clock.nanos;
    while (this.core.IPSR === SYSTICK) this.step();
    const cycles = Math.round((this.clock.nanos - begin) / CYCLE_NS);
    // The state machines take in what the tick has written.
    this.#stepStateMachines(GUARD.round * 4);
    return cycles;
  }

  /** The outputs. */
  outputs() {
    const { pwm, sio, pio } = this.chip;
    return {
      level: pwm.channels[5].cc & 0xffff,
      positive: !!(sio.gpioValue & (1 << PINS.direction)),
      enabled: !!(pio[GUARD.block].pinValues & pio[GUARD.block].pinDirections & (1 << PINS.enable)),
      led: !!(sio.gpioValue & (1 << PINS.led)),
      stack: this.chip.flashView.getUint32(0x100, true) - this.lowest,
    };
  }

  /** Calls a function of the image with two words; returns its result and its cycles. Nothing else happens meanwhile. */
  call(address, first, second) {
    const { core } = this;
    core.PM = true;
    core.registers[0] = first;
    core.registers[1] = second;
    core.LR = RETURN | 1;
    core.PC = address;
    let cycles = 0;
    while (core.PC !== RETURN) cycles += core.executeInstruction();
    return [core.registers[0] >>> 0, cycles];
  }

  /** From now on, the state machines never stand still. */
  runEveryCycle() {
    this.#catchUp();
    this.everyCycle = true;
  }

  /** Stops the timer of the ticks. */
  stopTicks() {
    this.chip.writeUint32(0xe000e010, 0);
  }

  takeSent() {
    return this.sent.splice(0);
  }
}
