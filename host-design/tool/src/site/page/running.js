// The twin: runs the ticks that are due, and shows them to the page at the other end of a port.

const PICTURE_MS = 1e3 / 60;
// Longest real time for simulating between two pictures.
const BUDGET_MS = 14;
// Longest silence of the page while the motor may move.
const SILENCE_MS = 2e3;

// Time between two moments from which a page that is loaded again goes on.
const KEPT_MS = 1e3;
const BLOCK = 1024; // words

// What a run has changed in the memory since the power came on. The same rig switched on again has the same memory, bit
// by bit, and goes on where these changes are put back.
class Changes {
  constructor() {
    this.first = new Uint32Array(exported.memory.buffer.slice(0));
    this.sum = this.first.reduce((sum, word) => Math.imul(sum ^ word, 0x01000193), 0);
  }

  taken() {
    const now = new Uint32Array(exported.memory.buffer);
    const isChanged = (block) => {
      const end = (block + 1) * BLOCK;
      for (let word = block * BLOCK; word < end; word += 1) if (now[word] !== (this.first[word] ?? 0)) return true;
      return false;
    };
    const blocks = Array.from({ length: now.length / BLOCK }, (_, block) => block).filter(isChanged);
    const words = new Uint32Array(blocks.length * BLOCK);
    blocks.forEach((block, k) => words.set(now.subarray(block * BLOCK, (block + 1) * BLOCK), k * BLOCK));
    return { sum: this.sum, size: now.byteLength, blocks, bytes: new Uint8Array(words.buffer) };
  }

  // Another module, or another beginning, is left as it is.
  put({ sum, size, blocks, bytes }) {
    if (sum !== this.sum) return;
    exported.memory.grow((size - exported.memory.buffer.byteLength) / 65536);
    const now = new Uint8Array(exported.memory.buffer);
    blocks.forEach((block, k) => now.set(bytes.subarray(4 * k * BLOCK, 4 * (k + 1) * BLOCK), 4 * block * BLOCK));
  }
}

// Switches a rig on and keeps it running, from what was kept of it, if that is not null, and `keeps` what a page that
// is loaded again needs; returns why it cannot, if it cannot.
function run(rig, theme, port, { kept, keeps }) {
  const told = answered('twin', { twin: 'start', ...rig });
  if (told.failed !== undefined) return told;
  const changes = keeps ? new Changes() : null;
  if (kept !== null) changes.put(kept);
  let keptAt = performance.now();
  port.postMessage({ you: told.you, hello: { ...told.hello, theme } });
  let [asked, last, heard, tickMs, t, isFallen] = [[], performance.now(), performance.now(), 0.02, 0, false];
  port.onmessage = ({ data }) => {
    asked.push(data);
    heard = performance.now();
  };
  const step = () => {
    const begin = performance.now();
    const question = { twin: 'run', asked, passed_s: (begin - last) / 1e3, most_ticks: Math.ceil(BUDGET_MS / tickMs), is_silent: begin - heard > SILENCE_MS };
    [asked, last] = [[], begin];
    try {
      const answer = answered('twin', question);
      if (answer.failed !== undefined) port.postMessage({ notice: answer.failed.why });
      else port.postMessage(answer);
      const ran = ((answer.picture?.machine.t_s ?? t) - t) / told.hello.tick_s;
      if (ran > 0.5) tickMs += 0.05 * ((performance.now() - begin) / ran - tickMs);
      t = answer.picture?.machine.t_s ?? t;
      const { fault = null, machine } = answer.picture ?? {};
      if (fault !== null && !isFallen) postMessage({ fell: { defect: machine.defect, properties: machine.properties } });
      isFallen = fault !== null;
    } catch (error) {
      port.postMessage({ notice: `the computation stopped (${error.message}); go back to the desk and balance it again` });
      return;
    }
    if (keeps && begin - keptAt > KEPT_MS) {
      keptAt = begin;
      const kept = changes.taken();
      postMessage({ kept }, [kept.bytes.buffer]);
    }
    setTimeout(step, Math.max(0, begin + PICTURE_MS - performance.now()));
  };
  step();
  return {};
}
