// A rig or a lab in an address, behind the mark that is never sent to a server.

// A sum over the letters, by which a link that was cut or changed on its way is known.
function sumOf(code) {
  let sum = 0x811c9dc5;
  for (let at = 0; at < code.length; at += 1) sum = Math.imul(sum ^ code.charCodeAt(at), 0x01000193) >>> 0;
  return sum.toString(36);
}

const withoutHash = () => location.href.split('#')[0];

function linkTo(kind, toml) {
  const code = lettersOf(new TextEncoder().encode(toml)).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
  return `${withoutHash()}#${kind}=${sumOf(code)}.${code}`;
}

// The `toml` of what the address holds, a `rig` or a `lab`; null without one, and `why` it cannot be read. Links of
// older pages have no sum.
function inAddress(kind) {
  if (!location.hash.startsWith(`#${kind}=`)) return null;
  const said = location.hash.slice(kind.length + 2);
  const [code, sum] = said.split('.').reverse();
  try {
    if (sum !== undefined && sum !== sumOf(code)) throw new Error('another sum');
    const bytes = bytesOfLetters(code.replaceAll('-', '+').replaceAll('_', '/'));
    return { toml: new TextDecoder('utf-8', { fatal: true }).decode(bytes) };
  } catch {
    return { why: 'The link is damaged: what is in it cannot be read. Ask for it again, and copy it as a whole.' };
  }
}
