// What the scopes draw: curves over the last seconds.

import { isEstimated } from './guide.js';

export const CAPACITY = 1 << 14; // telemetry messages that are kept
const CHUNK = 1 << 13;

// What is known at a time: the estimate, only the true position, or nothing.
export const ESTIMATED = 0;
const SEEN = 1;
export const UNKNOWN = 2;

// The bytes of numbers as text.
function letters({ buffer }) {
  const bytes = new Uint8Array(buffer);
  let text = '';
  for (let from = 0; from < bytes.length; from += CHUNK) text += String.fromCharCode(...bytes.subarray(from, from + CHUNK));
  return btoa(text);
}

// Telemetry in rings of a fixed size.
export class History {
  constructor(curves) {
    this.times = new Float64Array(CAPACITY);
    this.values = curves.map(() => new Float32Array(CAPACITY));
    this.seen = curves.map((curve) => (curve.seen === undefined ? null : new Float32Array(CAPACITY)));
    this.known = new Uint8Array(CAPACITY);
    this.curves = curves;
    this.length = 0;
    this.oldest = 0;
  }

  // Forgets what was at a time or later.
  cut(t) {
    const { first } = this;
    this.length = this.after(t);
    this.oldest = first;
  }

  // `state` is the true one, or what the encoders say.
  push(t, telemetry, state) {
    const slot = this.length % CAPACITY;
    this.times[slot] = t;
    this.known[slot] = isEstimated(telemetry) ? ESTIMATED : state !== null ? SEEN : UNKNOWN;
    this.curves.forEach((curve, i) => {
      this.values[i][slot] = curve.value(telemetry) ?? NaN;
      if (curve.seen !== undefined) this.seen[i][slot] = this.known[slot] === SEEN ? curve.seen(state) : NaN;
    });
    this.length += 1;
  }

  get rows() { return [this.times, this.known, ...this.values, ...this.seen.filter((row) => row !== null)]; }

  kept() { return { length: this.length, oldest: this.oldest, rows: this.rows.map(letters) }; }

  // What was kept, and after it a gap of unknown length, in which nothing is drawn.
  restore({ length, oldest, rows }) {
    if (length === 0) return;
    this.oldest = oldest;
    this.rows.forEach((row, i) => new Uint8Array(row.buffer).set(Uint8Array.from(atob(rows[i]), (letter) => letter.charCodeAt(0))));
    this.length = length + 1;
    for (const row of this.rows) row[length % CAPACITY] = NaN;
    this.times[length % CAPACITY] = this.time(length - 1);
  }

  get first() { return Math.max(this.oldest, this.length - CAPACITY); }

  time(index) { return this.times[index % CAPACITY]; }

  get last() { return this.length > 0 ? this.time(this.length - 1) : 0; }

  // Index of the first telemetry message at or after a time.
  after(t) {
    let [low, high] = [this.first, this.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < t) low = middle + 1; else high = middle;
    }
    return low;
  }
}
