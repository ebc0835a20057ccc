// The page: puts connection, rig, scopes and controls together.

import { useTheme } from './colours.js';
import { connect } from './link.js';
import { guide, isEstimated, isHomed, isOn, Wish, Witness } from './guide.js';
import { RigView } from './rig.js';
import { Scopes } from './scope.js';
import { Controls } from './controls.js';
import { Drawers } from './drawers.js';

const byId = (id) => document.getElementById(id);
const MOTOR_MS = 150; // time between two texts of what the motor does
const KEPT = 'upright scopes'; // name in the tab's store

const seen = { you: null, picture: null, telemetry: null, frames: 0, step: 0, since: -MOTOR_MS };
let hello = null;
let view = null;
let scopes = null;

const ask = connect({
  hello(told, you) {
    hello = told;
    seen.you = you;
    byId('notice').hidden = true;
    useTheme(hello.theme);
    if (view !== null) return; // connected again
    scopes = new Scopes(byId('panels'), byId('axis'), hello);
    view = new RigView(byId('rig'), byId('rail'), hello, {
      pull: (body, along, x, y) => controls.machine({ do: 'pull', body, along, x, y }),
      letGo: () => controls.machine({ do: 'let-go' }),
      moveTo: (x) => controls.say(`set-point ${Math.min(hello.setpoints_m[1], Math.max(hello.setpoints_m[0], x)).toFixed(4)}`),
    });
    controls.hello(hello, scopes);
    drawers.hello(hello);
    remember();
  },
  picture(picture) {
    seen.picture = picture;
    for (const telemetry of picture.telemetry) scopes.push(telemetry, picture.machine);
    seen.telemetry = picture.telemetry.at(-1) ?? seen.telemetry;
    const { telemetry: latest } = seen;
    const isCommander = picture.commander === seen.you;
    if (latest !== null) {
      witness.see(picture, latest);
      wish.take(latest);
    }
    controls.picture(picture, latest, isCommander);
    drawers.picture(picture.machine);
    const now = guide({ hello, picture, latest, wish: wish.told(), fall: witness.fall, step: seen.step, isCommander });
    seen.step = now.step;
    controls.guided(now, latest, picture.fault, witness.fall);
  },
  recorded(csv) {
    byId('csv').href = csv;
  },
  notice(text) {
    byId('notice').textContent = text;
    byId('notice').hidden = false;
  },
  lost() {
    seen.picture = null;
    byId('state').textContent = 'No connection: the motor is turned off without it';
    byId('act').hidden = true;
    delete byId('state').dataset.state;
  },
});
const wish = new Wish(ask);
const witness = new Witness();
const controls = new Controls(ask, wish);
const drawers = new Drawers((what) => controls.machine(what));

// A page that is loaded again shows the curves of the page before: the address is that of the same run.
function remember() {
  let store = null;
  try { store = sessionStorage; } catch { return; } // forbidden by the person
  const kept = store.getItem(KEPT);
  store.removeItem(KEPT);
  const [address] = kept?.split(' ', 1) ?? [];
  if (address === location.href) scopes.restore(kept.slice(address.length));
  addEventListener('pagehide', () => {
    // A store that is too small keeps nothing.
    try { store.setItem(KEPT, `${location.href} ${scopes.kept()}`); } catch {}
  });
}

// Frame and tag of the picture: whether the motor is on.
function motor(latest, force) {
  const state = latest.state === 'Fault' ? 'fault' : isOn(latest) ? 'on' : 'off';
  if (byId('stage').dataset.motor !== state) byId('stage').dataset.motor = state;
  else if (performance.now() - seen.since < MOTOR_MS) return;
  seen.since = performance.now();
  byId('motor').textContent = { fault: '✕ Motor off: fault', off: '○ Motor off' }[state]
    ?? `⚡ Motor on ${Math.abs(force).toFixed(hello.force_limit_n < 5 ? 3 : 1)} ${hello.input[1]}`;
}

function frame() {
  requestAnimationFrame(frame);
  const { picture, telemetry: latest } = seen;
  if (view === null || picture === null || latest === null) return;
  const { machine, wanted_m: wanted } = picture;
  const state = machine?.state ?? scopes.measured(latest);
  motor(latest, latest.applied_n);
  view.draw(state, wanted ?? latest.setpoint_m, machine?.pull, {
    isOn: isOn(latest),
    isKnown: isHomed(latest) || latest.state === 'Fault',
    isUp: ['Balancing', 'Armed'].includes(latest.state),
    force_n: latest.applied_n,
    fallen: witness.fall?.state ?? null,
    t_s: machine?.t_s ?? latest.tick * hello.tick_s,
  });
  view.pull();
  scopes.drawNext();
  seen.frames += 1;
}
requestAnimationFrame(frame);

// For tests, and for the curious.
globalThis.upright = { seen, view: () => view, scopes: () => scopes, isEstimated };
