// replay.mjs IMAGE.uf2 ENCODERS < TICKS > ANSWERS: runs the image with the inputs of each tick.
//
// Each line of TICKS is a JSON object: `counts`, `registers` of sensors on two wires (null for an encoder), the contacts
// as `Pico.contacts` takes them, `supply` (steps of the converter), `received` (bytes in hexadecimal). Or it is {"stopTicks": CYCLES}: ticks stop, and the answer says when the
// power stage was disabled, and when the watchdog would have reset the chip. Or {"openStop": CYCLES}: the emergency stop
// opens between two ticks, and the answer says when the power stage was disabled. Or {"call": ADDRESS, "pairs": WORDS}: a
// function of the image is called with each pair of words (hexadecimal), and the answer has the results and the most
// cycles; {"replace": [ADDRESS, OLD, NEW]} replaces the first such instruction from there on. Each answer is a JSON
// object, too.

import { createInterface } from 'node:readline';
import { Pico } from './chip.mjs';

const [path, encoders] = process.argv.slice(2);
const pico = new Pico(path, Number(encoders));
let first = null;

/** Ticks stop: the cycles until the power stage is off, and until the watchdog resets the chip; null if they do not. */
function stopTicks(limit) {
  const begin = pico.clock.nanos;
  const cycles = () => Math.round((pico.clock.nanos - begin) / 8);
  const stopped = { disabled: null, reset: null };
  const first = pico.steps.now;
  // The emulator's watchdog would report again and again at the same time.
  pico.watchdog = () => { stopped.reset = cycles(); throw stopped; };
  pico.runEveryCycle();
  pico.stopTicks();
  try {
    while (cycles() < limit) {
      pico.step();
      if (!pico.outputs().enabled) stopped.disabled ??= cycles();
    }
  } catch (thrown) {
    if (thrown !== stopped) throw thrown;
  }
  stopped.pulse = Math.round(pico.steps.rose - first);
  return stopped;
}

/** The emergency stop opens: the cycles until the power stage is off; null if it stays on. */
function openStop(limit) {
  const begin = pico.clock.nanos;
  const cycles = () => Math.round((pico.clock.nanos - begin) / 8);
  pico.contacts({ stop: true });
  while (pico.outputs().enabled && cycles() < limit) pico.step();
  return { disabled: pico.outputs().enabled ? null : cycles() };
}

/** Calls a function with each pair of words. */
function call(address, digits) {
  const pairs = Buffer.from(digits, 'hex');
  const results = Buffer.alloc(pairs.length / 2);
  let most = 0;
  for (let at = 0; at < pairs.length; at += 8) {
    const [result, cycles] = pico.call(address, pairs.readUInt32LE(at), pairs.readUInt32LE(at + 4));
    results.writeUInt32LE(result, at / 2);
    most = Math.max(most, cycles);
  }
  return { results: results.toString('hex'), cycles: most };
}

/** Replaces the first such instruction from an address on. */
function replace([address, old, by]) {
  while (pico.chip.readUint16(address) !== old) address += 2;
  pico.chip.writeUint16(address, by);
  return { replaced: address };
}

for await (const line of createInterface({ input: process.stdin })) {
  const tick = JSON.parse(line);
  if (tick.stopTicks) {
    console.log(JSON.stringify(stopTicks(tick.stopTicks)));
    break;
  }
  if (tick.openStop) {
    console.log(JSON.stringify(openStop(tick.openStop)));
    continue;
  }
  if (tick.call || tick.replace) {
    console.log(JSON.stringify(tick.call ? call(tick.call, tick.pairs) : replace(tick.replace)));
    continue;
  }
  // The chip counts from 0.
  first ??= tick.counts;
  pico.targets = tick.counts.map((count, encoder) => count - first[encoder]);
  // The chip counts its own pulses.
  if (pico.steps.isUsed) pico.targets[0] = 0;
  tick.registers?.forEach((sensor, encoder) => { if (sensor) pico.registers(encoder, sensor); });
  pico.contacts(tick);
  pico.supply(tick.supply);
  const cycles = pico.tick();
  pico.steps.tick++;
  // Bytes that arrive during a tick are read after it.
  pico.receive(Buffer.from(tick.received, 'hex'));
  console.log(JSON.stringify({ cycles, ...pico.outputs(), trains: pico.steps.takeEnded(), sent: Buffer.from(pico.takeSent()).toString('hex') }));
}
process.exit(0);
