// What a person does with buttons and keys, and what the page says.

import { bodyName, newtons, STEPS } from './guide.js';
import { inPieces, plain } from './words.js';

const byId = (id) => document.getElementById(id);

// Keys of the whole page that send a command to the firmware.
const KEYS = {
  h: 'home', H: 'home-rail', g: 'check-signs', a: 'arm', d: 'disarm', c: 'clear', s: 'down',
};
// Keys that work while they are held.
const HELD = { m: 'jog +x', M: 'jog -x' };
// Time between two commands of a held key (ms): after 100 ms without one, the firmware takes the key as released.
const REPEAT_MS = 25;
const HOLDS = { f: 'free', j: 'hanging', k: 'guided', u: 'upright' };
const KEPT_LINES = 200;

function option(value, text) {
  const element = document.createElement('option');
  element.value = value;
  element.textContent = text;
  return element;
}

// Writes a text, if it is not there already: the browser lays out again what is written.
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Controls {
  constructor(ask, wish) {
    Object.assign(this, { ask, wish, act: null, pressed: null, isSimulated: false });
    this.scopes = null;
    this.say = (line) => ask({ ask: 'say', line });
    this.machine = (what) => ask({ ask: 'machine', what });
    this.isPaused = false;
    this.held = null;
    this.isRecording = false;
    this.listen();
  }

  listen() {
    byId('stop').addEventListener('click', () => this.stop());
    byId('act').addEventListener('pointerdown', () => {
      this.pressed = this.act;
      if (this.act?.held !== undefined) this.hold(this.act.held);
    });
    // What a finger was put on for something else is not done when it is lifted.
    byId('act').addEventListener('click', ({ detail }) => { if (detail === 0 || this.pressed === this.act) this.go(this.act); });
    for (const end of ['pointerup', 'pointerleave', 'pointercancel']) byId('act').addEventListener(end, () => this.letGo());
    for (const element of document.querySelectorAll('[data-wish]')) {
      element.addEventListener('click', () => this.wish.set(element.dataset.wish, this.isSimulated));
    }
    for (const element of document.querySelectorAll('[data-line]')) {
      element.addEventListener('click', () => this.say(element.dataset.line));
    }
    for (const element of document.querySelectorAll('[data-hold]')) {
      element.addEventListener('click', () => this.machine({ do: 'hold', how: element.dataset.hold }));
    }
    for (const element of document.querySelectorAll('[data-step]')) {
      element.addEventListener('click', () => this.machine({ do: 'step', ticks: Number(element.dataset.step) }));
    }
    for (const element of document.querySelectorAll('[data-restart]')) {
      element.addEventListener('click', () => this.machine({ do: 'restart', upright: element.dataset.restart === 'upright' }));
    }
    byId('law').addEventListener('change', (event) => this.say(`law ${event.target.value}`));
    byId('setpoint').addEventListener('input', (event) => this.say(`set-point ${event.target.value}`));
    byId('speed').addEventListener('change', (event) => this.machine({ do: 'speed', factor: Number(event.target.value) }));
    byId('pause').addEventListener('click', () => this.machine({ do: 'pause', on: !this.isPaused }));
    byId('challenge').addEventListener('click', (event) => {
      this.machine({ do: 'challenge', on: event.currentTarget.getAttribute('aria-pressed') !== 'true' });
    });
    byId('record').addEventListener('click', () => this.ask({ ask: 'record', on: !this.isRecording }));
    byId('hold').addEventListener('click', () => this.holdScopes());
    byId('zoom-in').addEventListener('click', () => this.scopes.zoom(0.5));
    byId('zoom-out').addEventListener('click', () => this.scopes.zoom(2));
    byId('scroll').addEventListener('input', (event) => { this.scopes.back = Number(event.target.value); });
    byId('picture').addEventListener('click', () => {
      const link = document.createElement('a');
      link.href = this.scopes.picture();
      link.download = 'scope.png';
      link.click();
    });
    // Before anything else sees the key, whatever has the focus.
    document.addEventListener('keydown', (event) => this.stopKey(event), true);
    document.addEventListener('keydown', (event) => this.key(event));
    document.addEventListener('keyup', () => this.letGo());
    for (const element of document.querySelectorAll('[data-held]')) {
      element.addEventListener('pointerdown', () => this.hold(element.dataset.held));
      for (const end of ['pointerup', 'pointerleave', 'pointercancel']) element.addEventListener(end, () => this.letGo());
    }
    window.addEventListener('blur', () => this.letGo());
  }

  stop() {
    this.wish.cancel();
    this.say('disarm');
  }

  // Does what the page offers.
  go(act) {
    if (act === null || act.held !== undefined) return;
    if (act.wish !== undefined) this.wish.set(act.wish, this.isSimulated);
    for (const request of act.asks ?? []) this.ask(request);
  }

  stopKey(event) {
    const isSpace = event.key === ' ' && !['INPUT', 'SELECT', 'BUTTON', 'A'].includes(document.activeElement?.tagName);
    if (event.key !== 'Escape' && !isSpace) return;
    this.stop();
    event.preventDefault();
    event.stopPropagation();
  }

  hold(line) {
    this.letGo();
    this.say(line);
    this.held = setInterval(() => this.say(line), REPEAT_MS);
  }

  letGo() {
    clearInterval(this.held);
    this.held = null;
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || ['INPUT', 'SELECT'].includes(event.target.tagName)) return;
    if (KEYS[event.key] !== undefined) this.say(KEYS[event.key]);
    else if (event.key === 'w') this.wish.set('up', this.isSimulated);
    else if (event.key === 'b' && this.isSimulated) this.machine({ do: 'restart', upright: true });
    else if (HELD[event.key] !== undefined && !event.repeat) this.hold(HELD[event.key]);
    else if (HOLDS[event.key] !== undefined) this.machine({ do: 'hold', how: HOLDS[event.key] });
    else if (event.key === 'p') this.machine({ do: 'pause', on: !this.isPaused });
    else if (event.key === '.') this.machine({ do: 'step', ticks: 1 });
    else if (event.key === 'r') this.ask({ ask: 'record', on: !this.isRecording });
  }

  holdScopes() {
    const isHeld = !this.scopes.isHeld;
    this.scopes.hold(isHeld);
    byId('hold').setAttribute('aria-pressed', isHeld);
    byId('scroll').hidden = !isHeld;
    byId('scroll').value = 0;
  }

  hello(hello, scopes) {
    this.scopes = scopes;
    this.told = hello;
    const { noun, position: [, unit] } = hello.base;
    for (const element of document.querySelectorAll('[title*="cart"]')) element.title = element.title.replace('cart', noun);
    byId('setpoint').setAttribute('aria-label', `set-point (${unit})`);
    document.title = `${hello.rig}: twin`;
    byId('name').textContent = hello.rig;
    byId('place').textContent = `${hello.is_simulated ? 'simulated rig, real firmware' : 'firmware'}: ${hello.place}`;
    this.isSimulated = hello.is_simulated;
    document.querySelectorAll('.simulated').forEach((element) => { element.hidden = !hello.is_simulated; });
    document.querySelectorAll('.swing-up').forEach((element) => { element.hidden = !hello.has_swing_up; });
    byId('law').replaceChildren(...hello.laws.map(({ name, title }) => option(name, title)));
    this.laws = hello.laws;
    [byId('setpoint').min, byId('setpoint').max] = hello.setpoints_m;
    byId('steps').replaceChildren(...STEPS.map((textContent) => Object.assign(document.createElement('li'), { textContent })));
  }

  picture(picture, latest, isCommander) {
    const { machine } = picture;
    document.body.classList.toggle('looks-only', !isCommander);
    this.isRecording = picture.recording;
    byId('record').setAttribute('aria-pressed', picture.recording);
    if (picture.recording) byId('csv').hidden = false;
    write(byId('span'), `${Number(this.scopes.span.toPrecision(3))} s`);
    write(byId('at'), this.scopes.cursor === null ? 'now' : `at ${this.scopes.cursor.toFixed(3)} s`);
    const log = byId('log');
    for (const line of picture.log) {
      const entry = document.createElement('li');
      entry.append(...inPieces(line));
      log.prepend(entry);
    }
    while (log.childElementCount > KEPT_LINES) log.lastElementChild.remove();
    if (latest !== null) this.telemetry(latest, picture.wanted_m);
    if (machine !== null && machine.stopped === undefined) this.simulation(machine);
  }

  // Shows where the rig is on its way, what it waits for, and the act that goes on; after a fault what happened.
  guided(now, latest, fault, fall) {
    const state = byId('state');
    write(state, now.line);
    if (latest !== null && state.dataset.state !== latest.state) state.dataset.state = latest.state;
    write(byId('below'), now.below ?? '');
    [...byId('steps').children].forEach((element, step) => {
      const mark = step < now.step || (step === now.step && now.isDone) ? '✓' : step === now.step && now.isLost ? '×' : String(step + 1);
      if (element.dataset.mark !== mark) element.dataset.mark = mark;
      if ((element.getAttribute('aria-current') !== null) !== (step === now.step)) element.toggleAttribute('aria-current', step === now.step);
    });
    // While a finger is on the button, it stays what it was.
    if (this.held === null) this.offer(now.act ?? null, now.isDone === true);
    this.fault(fault, fall);
  }

  offer(act, isDone) {
    const element = byId('act');
    const isSame = act?.text === this.act?.text && act?.key === this.act?.key;
    if (isSame && element.hidden === (act === null)) return;
    this.act = act;
    element.hidden = act === null;
    if (act === null) return;
    const key = Object.assign(document.createElement('kbd'), { textContent: act.key ?? '' });
    element.replaceChildren(`${act.text} `, key);
    element.classList.toggle('waits', !isDone);
  }

  telemetry(latest, wanted) {
    write(byId('inputs'), latest.inputs);
    const isOn = ['Jogging', 'Identifying', 'Armed', 'Raising', 'Balancing', 'Lowering', 'Stilling'].includes(latest.state);
    const against = isOn ? [] : latest.against_arming;
    const shown = [...byId('against').children].map((element) => element.textContent);
    if (shown.join() !== against.join()) {
      byId('against').replaceChildren(...against.map((text) => Object.assign(document.createElement('li'), { textContent: text })));
    }
    const law = this.laws.find(({ value }) => value === latest.law);
    if (law !== undefined && document.activeElement !== byId('law')) byId('law').value = law.name;
    const setpoint = wanted ?? latest.setpoint_m;
    write(byId('setpoint-value'), `${setpoint.toFixed(3)} ${this.told.base.position[1]}`);
    if (document.activeElement !== byId('setpoint')) byId('setpoint').value = setpoint;
  }

  fault(fault, fall) {
    const place = byId('fault');
    const at = fault?.at ? ` (${fault.at})` : '';
    const text = fault === null ? '' : `${fault.code} ${fault.name}${at}`;
    place.hidden = fault === null;
    if (place.dataset.text === text) return;
    place.dataset.text = text;
    const said = (title, words) => {
      const paragraph = document.createElement('p');
      paragraph.append(Object.assign(document.createElement('b'), { textContent: title }), ...inPieces(words));
      return paragraph;
    };
    if (fault === null) return place.replaceChildren();
    const why = fall?.defect ? `Broken on purpose: ${fall.defect.replaceAll('-', ' ')}. `
      : fall?.pull ? `You pulled ${bodyName(fall.pull.body, this.told)} with up to ${newtons(fall.pull.n)}. ` : '';
    const since = this.isSimulated ? 'It falls freely. Dashed: where the motor went off. Nothing is estimated any more; dotted curves are the true motion.'
      : 'Nothing is estimated any more; dotted curves are what the encoders say, if they can still be trusted.';
    const code = Object.assign(document.createElement('small'), { textContent: `Fault ${text}` });
    return place.replaceChildren(said('What happened: ', `${why}The firmware saw: ${fault.condition}.`), said('Since then: ', since), said('Remedy: ', fall?.pull ? `pull more gently. At a bench: ${fault.remedy}.` : `${fault.remedy}.`), code);
  }

  simulation(machine) {
    this.isPaused = machine.paused;
    byId('pause').setAttribute('aria-pressed', machine.paused);
    const isBehind = !machine.paused && machine.speed < 0.95 * machine.factor;
    const speed = machine.factor === 1 && !isBehind ? '' : `, ${machine.speed.toFixed(2)} × real time`;
    write(byId('measured-speed'), `${machine.t_s.toFixed(machine.paused ? 3 : 1)} s${machine.paused ? '' : speed}${isBehind ? ': this computer is too slow' : ''}`);
    for (const element of document.querySelectorAll('[data-hold]')) {
      element.setAttribute('aria-pressed', element.dataset.hold === machine.holding);
    }
    const { challenge } = machine;
    byId('challenge').setAttribute('aria-pressed', challenge !== null);
    write(byId('score'), challenge === null ? '' : `upright for ${challenge.upright_s.toFixed(0)} s, hardest push survived ${this.pushed(challenge.survived_n)}${
      challenge.is_over ? '; it fell' : `, push of ${this.pushed(Math.abs(challenge.push_n))}`}`);
  }

  // A push of the challenge, in the unit of what pushes.
  pushed(size) { return `${size.toFixed(size > 0 && size < 1 ? 3 : 1)} ${this.told.push_unit}`; }
}
