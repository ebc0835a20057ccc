// Answers questions with the module: its own thread, so that the page never waits.

let compiled = null;
let exported = null;

async function start() { ({ exports: exported } = await WebAssembly.instantiate(compiled, {})); }

// Asks the module's function `name`.
function answered(name, question) {
  const { memory, buffer } = exported;
  const text = new TextEncoder().encode(JSON.stringify(question));
  // The memory may be another one after each call.
  const at = buffer(text.length);
  new Uint8Array(memory.buffer, at, text.length).set(text);
  const length = exported[name]();
  const from = buffer(length);
  return JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, from, length)));
}

onmessage = async ({ data: { id, question, module, rig, theme, kept, keeps }, ports: [port, line] }) => {
  const begin = performance.now();
  try {
    if (module !== undefined) compiled = module;
    if (exported === null) await start();
    if (rig !== undefined) return postMessage({ id, answer: line === undefined ? run(rig, theme, port, { kept, keeps }) : talk(rig, theme, port, line), ms: performance.now() - begin });
    const answer = question === undefined ? {} : answered('answer', question);
    postMessage({ id, answer, ms: performance.now() - begin });
  } catch (error) {
    // A module that has stopped cannot go on: the next question starts it again.
    exported = null;
    postMessage({ id, answer: { failed: { why: `the computation stopped (${error.message}); change the rig`, line: null } }, ms: 0 });
  }
};
