// Answers questions with the page's module in Node: node in_node.mjs MODULE QUESTIONS prints the answers, as texts, and to
// stderr the least processor time of an answer.

import { readFileSync } from 'node:fs';

const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {});
const { memory, buffer, answer, twin } = instance.exports;

let leastUs = Infinity;
const answers = JSON.parse(readFileSync(process.argv[3], 'utf8')).map((question) => {
  const bytes = new TextEncoder().encode(JSON.stringify(question));
  // The memory may be another one after each call.
  const at = buffer(bytes.length);
  new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
  const begin = process.cpuUsage();
  const length = question.twin === undefined ? answer() : twin();
  const { user, system } = process.cpuUsage(begin);
  leastUs = Math.min(leastUs, user + system);
  const from = buffer(length);
  return new TextDecoder().decode(new Uint8Array(memory.buffer, from, length));
});
process.stdout.write(JSON.stringify(answers));
process.stderr.write(`${(leastUs / 1e6).toFixed(2)} s`);
