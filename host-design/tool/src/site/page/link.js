// The computations: questions out, answers in.

const embedded = (id) => document.getElementById(id).textContent;

// What is embedded as base64 of packed bytes.
const bytesOf = (id) => decoded(Uint8Array.from(atob(embedded(id).trim()), (letter) => letter.charCodeAt(0)));

// A thread that computes. Of several questions that wait, only the last of each kind is asked.
class Thread {
  constructor(module) {
    const address = URL.createObjectURL(new Blob([JSON.parse(embedded('worker'))], { type: 'text/javascript' }));
    this.worker = new Worker(address);
    this.waiting = new Map();
    this.asked = null;
    this.worker.onmessage = ({ data }) => {
      const { take } = this.asked;
      this.asked = null;
      try { take(data.answer, data.ms); } finally { this.next(); }
    };
    this.ready = new Promise((take) => { this.asked = { take }; });
    this.worker.postMessage({ id: 0, module });
  }

  get isBusy() { return this.asked !== null || this.waiting.size > 0; }

  // Asks; `take` is called with the answer, unless a later question of the same kind comes before it is asked.
  ask(kind, question, take) {
    this.waiting.delete(kind);
    this.waiting.set(kind, { question, take });
    this.next();
  }

  // Runs a rig, or talks to the board at a line, for the page at the other end of the port.
  run(rig, theme, port, line, take) {
    this.ready.then(() => {
      this.asked = { take };
      this.worker.postMessage({ id: 'run', rig, theme }, line === null ? [port] : [port, line]);
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
