// The page: puts connection, rig, scopes and controls together.

import { useTheme } from './colours.js';
import { connect } from './link.js';
import { RigView } from './rig.js';
import { Scopes } from './scope.js';
import { Controls } from './controls.js';

const byId = (id) => document.getElementById(id);
let hello = null;

const seen = { you: null, picture: null, telemetry: null, frames: 0, since: performance.now() };
let view = null;
let scopes = null;

const ask = connect({
  hello(told, you) {
    hello = told;
    seen.you = you;
    byId('notice').hidden = true;
    useTheme(hello.theme);
    if (view !== null) return; // connected again
    scopes = new Scopes(byId('panels'), hello);
    view = new RigView(byId('rig'), byId('rail'), hello, {
      pull: (body, along, x, y) => controls.machine({ do: 'pull', body, along, x, y }),
      letGo: () => controls.machine({ do: 'let-go' }),
      moveTo: (x) => controls.say(`set-point ${Math.min(hello.soft_m[1], Math.max(hello.soft_m[0], x)).toFixed(4)}`),
    });
    controls.hello(hello, scopes);
  },
  picture(picture) {
    seen.picture = picture;
    for (const telemetry of picture.telemetry) scopes.push(telemetry);
    seen.telemetry = picture.telemetry.at(-1) ?? seen.telemetry;
    controls.picture(picture, seen.telemetry, picture.commander === seen.you);
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
    byId('state').textContent = 'no connection: the motor is turned off without it';
    delete byId('state').dataset.state;
  },
});
const controls = new Controls(ask);

function frame() {
  requestAnimationFrame(frame);
  if (view === null || seen.picture === null) return;
  const { machine, wanted_m: wanted } = seen.picture;
  const state = machine?.state ?? seen.telemetry?.estimate;
  if (state !== undefined) {
    view.draw(state, wanted ?? seen.telemetry?.setpoint_m ?? null, machine?.pull);
    view.pull();
  }
  scopes.drawNext();
  seen.frames += 1;
}
requestAnimationFrame(frame);

// For tests, and for the curious.
globalThis.upright = { seen, view: () => view, scopes: () => scopes };
