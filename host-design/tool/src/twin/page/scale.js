// Round values on an axis.

// 1, 2 or 5 times a power of ten, at least `size`.
export function niceStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return [1, 2, 5, 10].map((digit) => digit * power).find((step) => step >= size * 0.999999);
}

// The multiples of a step from `low` to `high`: each is computed by itself, because a sum of steps misses zero.
export function roundValues(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.max(0, Math.floor(high / step + 1e-9) - first + 1);
  return Array.from({ length: count }, (_, k) => Number(((first + k) * step).toPrecision(12)));
}

// Full turns of a value that turns (`turn` is one of them): they are left out where a link is far from hanging (180°) and
// from upright (0°).
const fullTurns = (value, turn) => (turn === undefined ? 0 : Math.floor(value / turn + 0.25));

// The value without its full turns.
export const within = (value, turn) => value - (turn ?? 0) * fullTurns(value, turn);

// The full turns in words.
export function turnsOf(value, turn) {
  const turns = fullTurns(value, turn);
  return turns === 0 ? '' : `, ${turns < 0 ? '−' : '+'}${Math.abs(turns)} turn${Math.abs(turns) === 1 ? '' : 's'}`;
}
