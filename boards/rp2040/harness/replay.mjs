// replay.mjs IMAGE.uf2 ENCODERS < TICKS > ANSWERS: runs the image with the inputs of each tick.
//
// Each line of TICKS is a JSON object: `counts`, the contacts as `Pico.contacts` takes them, `supply` (steps of the
// converter), `received` (bytes in hexadecimal). Or it is {"stopTicks": CYCLES}: ticks stop, and the answer says when the
// power stage was disabled, and when the watchdog would have reset the chip. Or {"openStop": CYCLES}: the emergency stop
// opens between two ticks, and the answer says when the power stage was disabled. Each answer is a JSON object, too.

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
  // The chip counts from 0.
  first ??= tick.counts;
  pico.targets = tick.counts.map((count, encoder) => count - first[encoder]);
  pico.contacts(tick);
  pico.supply(tick.supply);
  const cycles = pico.tick();
  // Bytes that arrive during a tick are read after it.
  pico.receive(Buffer.from(tick.received, 'hex'));
  console.log(JSON.stringify({ cycles, ...pico.outputs(), sent: Buffer.from(pico.takeSent()).toString('hex') }));
}
process.exit(0);
