// The twin: runs the ticks that are due, and shows them to the page at the other end of a port.

const PICTURE_MS = 1e3 / 60;
// Longest real time for simulating between two pictures.
const BUDGET_MS = 14;
// Longest silence of the page while the motor may move.
const SILENCE_MS = 2e3;

// Switches a rig on and keeps it running; returns why it cannot, if it cannot.
function run(rig, theme, port) {
  const told = answered('twin', { twin: 'start', since_1970_s: Date.now() / 1e3, ...rig });
  if (told.failed !== undefined) return told;
  port.postMessage({ you: told.you, hello: { ...told.hello, theme } });
  let [asked, last, heard, tickMs, t] = [[], performance.now(), performance.now(), 0.02, 0];
  port.onmessage = ({ data }) => {
    asked.push(data);
    heard = performance.now();
  };
  const step = () => {
    const begin = performance.now();
    const question = { twin: 'run', asked, passed_s: (begin - last) / 1e3, most_ticks: Math.ceil(BUDGET_MS / tickMs), is_silent: begin - heard > SILENCE_MS };
    [asked, last] = [[], begin];
    try {
      const answer = answered('twin', question);
      if (answer.failed !== undefined) port.postMessage({ notice: answer.failed.why });
      else port.postMessage(answer);
      const ran = ((answer.picture?.machine.t_s ?? t) - t) / told.hello.tick_s;
      if (ran > 0.5) tickMs += 0.05 * ((performance.now() - begin) / ran - tickMs);
      t = answer.picture?.machine.t_s ?? t;
    } catch (error) {
      port.postMessage({ notice: `the computation stopped (${error.message}); go back to the desk and balance it again` });
      return;
    }
    setTimeout(step, Math.max(0, begin + PICTURE_MS - performance.now()));
  };
  step();
  return {};
}
