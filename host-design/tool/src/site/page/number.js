// Numbers as a person writes them.

// The `value`, or `why` there is none.
function numberOf(text) {
  const written = text.trim().replaceAll('−', '-');
  if (written === '') return { why: 'give a number' };
  const value = Number(written);
  if (Number.isNaN(value)) return { why: `“${text.trim()}” is no number: write one like 0.8, with a point before decimals` };
  if (!Number.isFinite(value)) return { why: `${text.trim()} is larger than any number that can be computed with` };
  return { value };
}
