
// Talks to a board over `line`, which carries the bytes of its serial port; returns why it cannot, if it cannot.
function talk(rig, theme, port, line) {
  const told = answered('twin', { twin: 'connect', toml: rig.toml, motions: rig.motions });
  if (told.failed !== undefined) return told;
  port.postMessage({ you: told.you, hello: { ...told.hello, theme } });
  let [asked, received, closed, heard, ends] = [[], [], null, performance.now(), false];
  const step = () => {
    const since1970Ms = performance.timeOrigin + performance.now();
    const question = { twin: 'exchange', asked, received, closed, since_1970_s: since1970Ms / 1e3, is_silent: performance.now() - heard > SILENCE_MS };
    [asked, received] = [[], []];
    const answer = answered('twin', question);
    if (answer.send.length > 0) line.postMessage(Uint8Array.from(answer.send));
    port.postMessage(answer);
    if (ends && answer.is_off) line.postMessage({ ended: true });
  };
  port.onmessage = ({ data }) => {
    asked.push(data);
    heard = performance.now();
    // What a person says is sent at once.
    if (data.ask === 'say') step();
  };
  line.onmessage = ({ data }) => {
    if (data.bytes !== undefined) for (const byte of data.bytes) received.push(byte);
    if (data.closed !== undefined) closed ??= data.closed;
    if (data.ends) {
      ends = true;
      asked.push({ ask: 'say', line: 'disarm' });
      step();
    }
  };
  setInterval(step, PICTURE_MS);
  return {};
}
