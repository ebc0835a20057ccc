// Buttons, sliders and keys.

const byId = (id) => document.getElementById(id);

// Keys of the whole page that send a command to the firmware.
const KEYS = {
  h: 'home', H: 'home-rail', g: 'check-signs', a: 'arm', d: 'disarm', c: 'clear', w: 'up', s: 'down',
};
// Keys that work while they are held.
const HELD = { m: 'jog +x', M: 'jog -x' };
// Time between two commands of a held key (ms): after 100 ms without one, the firmware takes the key as released.
const REPEAT_MS = 25;
const HOLDS = { f: 'free', j: 'hanging', k: 'guided', u: 'upright' };
const KEPT_LINES = 200;

function button(text, title, action) {
  const element = document.createElement('button');
  element.type = 'button';
  element.textContent = text;
  element.title = title;
  element.addEventListener('click', action);
  return element;
}

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
  constructor(ask) {
    this.ask = ask;
    this.scopes = null;
    this.say = (line) => ask({ ask: 'say', line });
    this.machine = (what) => ask({ ask: 'machine', what });
    this.isPaused = false;
    this.held = null;
    this.isRecording = false;
    this.sliders = new Map();
    this.listen();
  }

  listen() {
    byId('stop').addEventListener('click', () => this.say('disarm'));
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
    byId('nominal').addEventListener('click', () => {
      for (const [name, { nominal }] of this.sliders) this.machine({ do: 'set', name, value: nominal });
    });
    byId('mend').addEventListener('click', () => this.machine({ do: 'defect', name: null, sensor: 0 }));
    byId('record').addEventListener('click', () => this.ask({ ask: 'record', on: !this.isRecording }));
    byId('command').addEventListener('click', () => this.ask({ ask: 'command' }));
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

  stopKey(event) {
    const isSpace = event.key === ' ' && !['INPUT', 'SELECT', 'BUTTON', 'A'].includes(document.activeElement?.tagName);
    if (event.key !== 'Escape' && !isSpace) return;
    this.say('disarm');
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
    byId('scroll').disabled = !isHeld;
    byId('scroll').value = 0;
  }

  hello(hello, scopes) {
    this.scopes = scopes;
    document.title = `${hello.rig}: twin`;
    byId('name').textContent = hello.rig;
    byId('place').textContent = `firmware: ${hello.place}`;
    document.querySelectorAll('.simulated').forEach((element) => { element.hidden = !hello.is_simulated; });
    document.querySelectorAll('.swing-up').forEach((element) => { element.hidden = !hello.has_swing_up; });
    byId('law').replaceChildren(...hello.laws.map(({ name, title }) => option(name, title)));
    this.laws = hello.laws;
    [byId('setpoint').min, byId('setpoint').max] = hello.soft_m;
    this.states = new Map(hello.states.map(({ state, text }) => [state, text]));
    byId('sensor').replaceChildren(...hello.sensors.map((name, sensor) => option(sensor, name)));
    byId('defects').replaceChildren(...hello.defects.map(({ name, meaning, has_sensor: hasSensor }) => button(
      name.replaceAll('-', ' '), meaning + (hasSensor ? ', at the chosen sensor' : ''),
      () => this.machine({ do: 'defect', name, sensor: Number(byId('sensor').value) }),
    )));
    this.sliders.clear();
    byId('properties').replaceChildren(...hello.properties.map((property) => this.slider(property)));
  }

  slider({ name, label, unit, low, high, step, nominal }) {
    const element = document.createElement('label');
    element.className = 'property';
    const [value, input] = [document.createElement('output'), document.createElement('input')];
    Object.assign(input, { type: 'range', min: low, max: high, step, value: nominal, name });
    input.addEventListener('input', () => this.machine({ do: 'set', name, value: Number(input.value) }));
    element.append(label, value, input);
    this.sliders.set(name, { element, value, input, unit, nominal });
    return element;
  }

  picture(picture, latest, isCommander) {
    const { machine } = picture;
    byId('command').hidden = isCommander || picture.commander !== null;
    document.body.classList.toggle('looks-only', !isCommander);
    this.isRecording = picture.recording;
    byId('record').setAttribute('aria-pressed', picture.recording);
    if (picture.recording) byId('csv').hidden = false;
    write(byId('span'), `${Number(this.scopes.span.toPrecision(3))} s`);
    const log = byId('log');
    for (const line of picture.log) {
      const entry = document.createElement('li');
      entry.textContent = line;
      log.prepend(entry);
    }
    while (log.childElementCount > KEPT_LINES) log.lastElementChild.remove();
    this.fault(picture.fault);
    if (latest !== null) this.telemetry(latest, picture.wanted_m);
    if (machine?.stopped !== undefined) write(byId('state'), machine.stopped);
    else if (machine !== null) this.simulation(machine);
    if (picture.ended !== null) write(byId('state'), picture.ended);
  }

  telemetry(latest, wanted) {
    const state = byId('state');
    write(state, this.states.get(latest.state) ?? latest.state);
    state.dataset.state = latest.state;
    write(byId('now'), latest.now === null ? '' : `now: ${latest.now}`);
    write(byId('inputs'), latest.inputs);
    const isOn = ['Jogging', 'Identifying', 'Armed', 'Raising', 'Balancing', 'Lowering'].includes(latest.state);
    const against = isOn ? [] : latest.against_arming;
    const shown = [...byId('against').children].map((element) => element.textContent);
    if (shown.join() !== against.join()) {
      byId('against').replaceChildren(...against.map((text) => Object.assign(document.createElement('li'), { textContent: text })));
    }
    const law = this.laws.find(({ value }) => value === latest.law);
    if (law !== undefined && document.activeElement !== byId('law')) byId('law').value = law.name;
    const setpoint = wanted ?? latest.setpoint_m;
    write(byId('setpoint-value'), `${setpoint.toFixed(3)} m`);
    if (document.activeElement !== byId('setpoint')) byId('setpoint').value = setpoint;
  }

  fault(fault) {
    const place = byId('fault');
    const text = fault === null ? '' : `${fault.code} ${fault.name}${fault.at === null ? '' : ` at the ${fault.at}`}: ${fault.condition}. Remedy: ${fault.remedy}`;
    place.hidden = fault === null;
    if (place.textContent === text) return;
    place.replaceChildren();
    if (fault === null) return;
    const name = document.createElement('strong');
    name.textContent = text.slice(0, text.indexOf(':'));
    place.append(name, text.slice(text.indexOf(':')));
  }

  simulation(machine) {
    this.isPaused = machine.paused;
    byId('pause').setAttribute('aria-pressed', machine.paused);
    const isBehind = !machine.paused && machine.speed < 0.95 * machine.factor;
    write(byId('measured-speed'), machine.paused ? `stopped at ${machine.t_s.toFixed(3)} s`
      : `${machine.speed.toFixed(2)} × real time${isBehind ? ': this computer is too slow' : ''}`);
    for (const element of document.querySelectorAll('[data-hold]')) {
      element.setAttribute('aria-pressed', element.dataset.hold === machine.holding);
    }
    write(byId('defect'), machine.defect === null ? '' : machine.defect.replaceAll('-', ' '));
    const { challenge } = machine;
    byId('challenge').setAttribute('aria-pressed', challenge !== null);
    write(byId('score'), challenge === null ? '' : `upright for ${challenge.upright_s.toFixed(0)} s, hardest push survived ${challenge.survived_n.toFixed(1)} N${
      challenge.is_over ? '; it fell' : `, push of ${Math.abs(challenge.push_n).toFixed(1)} N`}`);
    for (const [name, { element, value, input, unit, nominal }] of this.sliders) {
      const now = machine.properties[name];
      write(value, `${Number(now.toPrecision(4))} ${unit}`);
      element.classList.toggle('changed', now !== nominal);
      if (document.activeElement !== input) input.value = now;
    }
  }
}
