// Text with keys and names of the rig file between backticks.

// The text in pieces, for `append`: what stands between backticks is code.
export function inPieces(text) {
  return text.split('`').map((piece, k) => (k % 2 === 0 ? piece : Object.assign(document.createElement('code'), { textContent: piece })));
}

// The same as text alone, where nothing else is possible.
export const plain = (text) => text.replaceAll('`', '');

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
