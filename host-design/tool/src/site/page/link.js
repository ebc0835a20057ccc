// The computations: questions out, answers in.

const embedded = (id) => document.getElementById(id).textContent;

// Bytes as base64, and back.
const bytesOfLetters = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

function lettersOf(bytes) {
  let text = '';
  for (let from = 0; from < bytes.length; from += 8192) text += String.fromCharCode(...bytes.subarray(from, from + 8192));
  return btoa(text);
}

// What is embedded as base64 of packed bytes.
const bytesOf = (id) => decoded(bytesOfLetters(embedded(id).trim()));

// Texts that are not needed at once.
const texts = () => JSON.parse(new TextDecoder().decode(bytesOf('texts')));

// The tab's store, from which a page that is loaded again goes on; null where the person forbids it.
function store() {
  try { return sessionStorage; } catch { return null; }
}

// The same for what stays when the tab is closed.
function lastingStore() {
  try { return localStorage; } catch { return null; }
}

// A thread that computes, once the module is compiled. Of several questions that wait, only the last of each kind is
// asked.
class Thread {
  constructor(module) {
    const address = URL.createObjectURL(new Blob([JSON.parse(embedded('worker'))], { type: 'text/javascript' }));
    this.worker = new Worker(address);
    this.waiting = new Map();
    this.asked = null;
    this.worker.onmessage = ({ data }) => {
      if (data.kept !== undefined) return this.keep?.(data.kept);
      if (data.fell !== undefined) return this.fell?.(data.fell);
      const { take } = this.asked;
      this.asked = null;
      try { take(data.answer, data.ms); } finally { this.next(); }
    };
    this.ready = new Promise((take) => { this.asked = { take }; });
    module.then((compiled) => this.worker.postMessage({ id: 0, module: compiled }), () => {});
  }

  get isBusy() { return this.asked !== null || this.waiting.size > 0; }

  // Asks; `take` is called with the answer, unless a later question of the same kind comes before it is asked.
  ask(kind, question, take) {
    this.waiting.delete(kind);
    this.waiting.set(kind, { question, take });
    this.next();
  }

  // Runs a rig, from what was kept of it or null, or talks to the board at a line, for the page at the other end of the
  // port. With `keeps`, it hands out what it would go on from.
  run({ rig, kept, keeps }, theme, port, line, take) {
    this.ready.then(() => {
      this.asked = { take };
      this.worker.postMessage({ id: 'run', rig, theme, kept, keeps }, line === null ? [port] : [port, line]);
    });
  }

  answerTo(question) {
    return new Promise((take) => { this.ask(`${question.ask}-${performance.now()}`, question, take); });
  }

  next() {
    if (this.asked !== null || this.waiting.size === 0) return;
    const [kind, asked] = this.waiting.entries().next().value;
    this.waiting.delete(kind);
    this.asked = asked;
    this.worker.postMessage({ id: kind, question: asked.question });
  }
}
