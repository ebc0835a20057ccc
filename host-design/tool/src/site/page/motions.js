// Stored motions out of the page: src/site/motions.rs has the way in.

const BYTES = 9;
const AS_IT_IS = 128;

// The text of the file of stored motions of an example, or null.
function motionsOf({ motions }) {
  if (motions === null) return null;
  const stored = JSON.parse(motions.text);
  const bytes = bytesOf('motions').subarray(motions.from);
  let from = 0;
  for (const name of ['raise', 'lower']) {
    const [rows, width] = stored[name].knots;
    const columns = unpacked(bytes.subarray(from, from + BYTES * rows * width), rows, width);
    stored[name].knots = Array.from({ length: rows }, (_, row) => columns.map((column) => column[row]));
    from += BYTES * rows * width;
  }
  return JSON.stringify(stored);
}

function unpacked(bytes, rows, width) {
  const all = rows * width;
  const byteOf = (number, byte) => bytes[byte * all + number];
  return Array.from({ length: width }, (_, place) => {
    const column = [];
    for (let row = 0; row < rows; row += 1) {
      const number = place * rows + row;
      let folded = 0;
      for (let byte = BYTES - 1; byte > 0; byte -= 1) folded = 256 * folded + byteOf(number, byte);
      let units = Math.floor(folded / 2) * (folded % 2 === 0 ? 1 : -1);
      const decimals = byteOf(number, 0) % AS_IT_IS;
      if (byteOf(number, 0) < AS_IT_IS) {
        const before = (back) => column[row - back] ?? 0;
        const expected = 3 * before(1) - 3 * before(2) + before(3);
        units += Math.floor(expected * Number(`1e${decimals}`) + 0.5);
      }
      column.push(Number(`${units}e-${decimals}`));
    }
    return column;
  });
}
