// A rig in an address, behind the mark that is never sent to a server.

// A sum over the letters, by which a link that was cut or changed on its way is known.
function sumOf(code) {
  let sum = 0x811c9dc5;
  for (let at = 0; at < code.length; at += 1) sum = Math.imul(sum ^ code.charCodeAt(at), 0x01000193) >>> 0;
  return sum.toString(36);
}

const withoutRig = () => location.href.split('#')[0];

function linkTo(toml) {
  const code = lettersOf(new TextEncoder().encode(toml)).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  return `${withoutRig()}#rig=${sumOf(code)}.${code}`;
}

// The `toml` of the rig in the address; null without one, and `why` it cannot be read. Links of older pages have no sum.
function rigOfLink() {
  const said = /^#rig=(.*)$/s.exec(location.hash)?.[1];
  if (said === undefined) return null;
  const [code, sum] = said.split('.').reverse();
  try {
    if (sum !== undefined && sum !== sumOf(code)) throw new Error('another sum');
    const bytes = bytesOfLetters(code.replaceAll('-', '+').replaceAll('_', '/'));
    return { toml: new TextDecoder('utf-8', { fatal: true }).decode(bytes) };
  } catch {
    return { why: 'The link is damaged: the rig in it cannot be read. Ask for it again, and copy it as a whole.' };
  }
}
