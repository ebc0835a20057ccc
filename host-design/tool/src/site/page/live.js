// The rig that moves on the desk: the firmware balances it in a thread of its own, and the person pulls it.

const { useTheme } = modules['colours.js'];
const { guide, isHomed, isOn, Witness } = modules['guide.js'];
const { RigView, joints } = modules['rig.js'];

const ALIVE_EVERY = 6; // pictures between two keep-alives
const MOTOR_MS = 150; // time between two texts of what the motor does
// A nudge comes this long after the last one, or after the person has let go, and lasts this long.
const NUDGE_AFTER_MS = 4500;
const NUDGE_MS = 180;
const NUDGE_SIZE = [0.3, 0.12]; // in lengths of the chain: of the end of at most two links, or of the cart
const BACK_MS = 4000; // time after a fall until it is put back up
const IDLE_MS = 30; // between two pictures
const AT_REST = { isOn: false, isKnown: true, isUp: true, force_n: 0, fallen: null, t_s: 0 };

class Live {
  // `describe(properties)` is called with what can be imperfect in a rig when it begins to move.
  constructor(module, describe) {
    Object.assign(this, { module, describe, view: null, thread: null, coming: null, wanted: null, isAway: false });
    Object.assign(this, { port: null, hello: null, picture: null, latest: null, witness: new Witness(), values: new Map() });
    Object.assign(this, { isFelled: 0, quietSince: performance.now(), nudge: null, side: 1, toldAt: 0, pictures: 0, nudges: 0, began_ms: null });
    this.theme = JSON.parse(embedded('theme'));
    useTheme(this.theme);
    byId('again').addEventListener('click', () => this.putBack());
    document.addEventListener('visibilitychange', () => this.machine({ do: 'pause', on: document.hidden }));
    let drawn = 0;
    const frame = (now) => {
      requestAnimationFrame(frame);
      // While nobody pulls it, fewer pictures do.
      if (now - drawn < (this.view?.grip ? 0 : IDLE_MS)) return;
      drawn = now;
      this.draw();
    };
    requestAnimationFrame(frame);
  }

  machine(what) { this.port?.postMessage({ ask: 'machine', what }); }

  // Draws a rig at rest that does not move yet.
  rest({ base, lengths_m: lengths, travel_m: travel }) {
    if (lengths.length === 0) {
      this.stop();
      byId('rig').width = 0;
      byId('motor').textContent = '';
      byId('stage').dataset.motor = 'off';
    } else if (this.thread !== null) return;
    this.meet({ base, lengths_m: lengths, travel_m: travel, soft_m: travel, angle_limit_rad: Math.PI, force_limit_n: 1, is_simulated: true, setpoints_m: [0, 0] });
  }

  meet(hello) {
    this.hello = hello;
    const act = { pull: (body, along, x, y) => this.pull(body, along, x, y), letGo: () => this.letGo(), moveTo: (x) => this.moveTo(x) };
    if (this.view === null) this.view = new RigView(byId('rig'), byId('rail'), hello, act);
    else this.view.takes(hello);
    if (hello.lengths_m.length === 0) this.say('A linear model: there are no links to draw, and it does not move here.', false);
  }

  pull(body, along, x, y) {
    this.quietSince = performance.now();
    this.nudge = null;
    this.machine({ do: 'pull', body, along, x, y });
  }

  letGo() {
    this.quietSince = performance.now();
    this.machine({ do: 'let-go' });
  }

  moveTo(x) {
    const [low, high] = this.hello.setpoints_m;
    this.port?.postMessage({ ask: 'say', line: `set-point ${Math.min(high, Math.max(low, x)).toFixed(4)}` });
  }

  putBack() {
    this.isFelled = 0;
    this.machine({ do: 'restart', upright: true });
  }

  // Lets the rig of this file stand in place of the one before, which moves on until then.
  show(rig) {
    this.wanted = rig;
    if (this.isAway) return;
    this.coming?.worker.terminate();
    const thread = new Thread(this.module);
    this.coming = thread;
    const { port1: here, port2: there } = new MessageChannel();
    let hello = null;
    here.onmessage = ({ data }) => {
      hello = data.hello ?? hello;
      if (data.picture !== undefined && this.coming === thread) this.change(thread, here, hello);
      if (this.thread === thread) this.take(data);
    };
    const begun = { ...rig, upright: true, since_1970_s: Date.now() / 1e3 };
    thread.run({ rig: begun, kept: null, keeps: false }, this.theme, there, null, ({ failed }) => {
      if (failed !== undefined && this.coming === thread) this.refuse(failed.why);
    });
  }

  // A rig that cannot stand.
  refuse(why) {
    this.stop();
    byId('stage').dataset.motor = 'off';
    if (this.hello?.lengths_m.length > 0) this.say(plain(why), false);
  }

  change(thread, port, hello) {
    this.thread?.worker.terminate();
    Object.assign(this, { thread, port, coming: null, witness: new Witness(), isFelled: 0, quietSince: performance.now(), nudge: null });
    this.meet(hello);
    this.describe(hello.properties);
    for (const [name, value] of this.values) this.machine({ do: 'set', name, value });
    this.began_ms ??= performance.now();
  }

  stop() {
    for (const thread of [this.thread, this.coming]) thread?.worker.terminate();
    Object.assign(this, { thread: null, coming: null, port: null, picture: null, latest: null });
  }

  // While the person is at the twin, this rig does not run.
  away(isAway) {
    this.isAway = isAway;
    if (isAway) this.stop();
    else if (this.wanted !== null) this.show(this.wanted);
  }

  // Something is true of the machine that its file does not say.
  set(name, value) {
    this.values.set(name, value);
    this.machine({ do: 'set', name, value });
  }

  take(data) {
    if (data.notice !== undefined) return this.refuse(data.notice);
    if (data.picture === undefined) return undefined;
    this.picture = data.picture;
    this.latest = data.picture.telemetry.at(-1) ?? this.latest;
    this.pictures += 1;
    if (this.pictures % ALIVE_EVERY === 0) this.port.postMessage({ ask: 'alive' });
    if (this.latest === null) return undefined;
    this.witness.see(this.picture, this.latest);
    return this.tell();
  }

  tell() {
    const { picture, latest, hello } = this;
    const now = performance.now();
    const isDown = latest.state === 'Fault';
    if (isDown && this.isFelled === 0) this.isFelled = now;
    if (!isDown) this.isFelled = 0;
    if (isDown && now - this.isFelled > BACK_MS) this.putBack();
    this.touch(now);
    if (now - this.toldAt < MOTOR_MS) return;
    this.toldAt = now;
    const state = isDown ? 'fault' : isOn(latest) ? 'on' : 'off';
    byId('stage').dataset.motor = state;
    byId('motor').textContent = { fault: '✕ Motor off', off: '○ Motor off' }[state] ?? `⚡ ${Math.abs(latest.applied_n).toFixed(hello.force_limit_n < 5 ? 3 : 1)} ${hello.input[1]}`;
    const { line, below } = guide({ hello, picture, latest, wish: { name: null, left_s: 0, lapsed: null }, fall: this.witness.fall, step: 4, isCommander: true });
    const isPulled = picture.machine?.pull && this.nudge === null;
    if (isDown) this.say(`${line}.`, true);
    else if (isPulled) this.say(`${line}. ${below}`, false);
    else this.say(hello.falls_when_held ? `Pull the ${hello.base.noun}, or give a link a short tug.` : 'Pull it, with the finger or the mouse.', false);
  }

  // Nudges it now and then, so that one sees what it does; not where the person prefers less motion.
  touch(now) {
    if (this.latest.state !== 'Balancing') return;
    if (this.nudge !== null) {
      if (now - this.nudge > NUDGE_MS) {
        this.nudge = null;
        this.letGo();
      }
      return;
    }
    const isQuiet = this.view.grip === null && this.view.keys.size === 0 && now - this.quietSince > NUDGE_AFTER_MS;
    if (!isQuiet || matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    this.nudge = now;
    this.nudges += 1;
    this.side = -this.side;
    const body = this.hello.falls_when_held ? 0 : this.hello.lengths_m.length;
    const [x, y] = joints(this.hello.lengths_m, this.picture.machine.state, this.hello.base.arc_m)[body];
    this.machine({ do: 'pull', body, along: 1, x: x + this.side * NUDGE_SIZE[body === 0 ? 1 : 0] * this.view.reach, y });
  }

  say(text, isDown) {
    if (byId('saying').textContent !== text) byId('saying').textContent = text;
    byId('again').hidden = !isDown;
  }

  draw() {
    const { view, latest, hello } = this;
    if (view === null || hello.lengths_m.length === 0 || byId('rig').clientWidth === 0) return;
    const machine = this.picture?.machine;
    if (latest === null || machine?.state === undefined) return view.draw(new Array(2 * hello.lengths_m.length + 2).fill(0), null, null, AT_REST);
    const pull = machine.pull && this.nudge !== null ? { ...machine.pull, by: 'a nudge' } : machine.pull;
    view.draw(machine.state, this.picture.wanted_m ?? latest.setpoint_m, pull, {
      isOn: isOn(latest),
      isKnown: isHomed(latest) || latest.state === 'Fault',
      isUp: ['Balancing', 'Armed'].includes(latest.state),
      force_n: latest.applied_n,
      fallen: this.witness.fall?.state ?? null,
      t_s: machine.t_s,
    });
    return view.pull();
  }
}
