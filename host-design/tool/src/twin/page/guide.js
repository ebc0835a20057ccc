// What the rig waits for, in one line, and the one act that goes on from there.

import { capital, plain } from './words.js';

export const STEPS = ['Home', 'Check signs', 'Jog', 'Raise', 'Balance'];

const AGAIN_MS = 400;
const LAPSES_MS = 60e3;
// A pull this long before a fault is named as its cause (s).
const RECENT_S = 1.5;

const say = (line) => ({ ask: 'say', line });
const machine = (what) => ({ ask: 'machine', what });
const hand = (how) => machine({ do: 'hold', how });
const begins = (list, text) => list.some((entry) => entry.startsWith(text));
const reason = (text) => plain(capital(text.replace(/^a link is not upright: /, '')));

// Whether the firmware estimates the state, whether the motor may push, and whether it knows the positions.
export const isEstimated = ({ state }) => ['Raising', 'Balancing', 'Holding', 'Lowering'].includes(state);
export const isOn = (told) => isEstimated(told) || ['Jogging', 'Identifying', 'Stilling'].includes(told.state);
export const isHomed = ({ state, against_arming: against }) => (
  state !== 'Disarmed' && state !== 'Homing' && !begins(against, 'positions are not known'));

// What a person has asked for that is not possible yet: it is carried out as soon as it is, Stop cancels it, and after a
// time it lapses, because a motor does not begin to move long after it was asked to.
export class Wish {
  constructor(ask) {
    Object.assign(this, { ask, name: null, lapsed: null, isSimulated: false, since: 0, asked: -Infinity });
  }

  set(name, isSimulated) {
    Object.assign(this, { name, isSimulated, lapsed: null, since: performance.now(), asked: -Infinity });
    if (isSimulated) this.ask(hand(name === 'up' ? 'free' : 'upright'));
  }

  cancel() { Object.assign(this, { name: null, lapsed: null }); }

  // For the guide: what is wished for, how long it still stands (s), and what has lapsed.
  told() {
    return { name: this.name, left_s: Math.ceil((LAPSES_MS - performance.now() + this.since) / 1e3), lapsed: this.lapsed };
  }

  take(latest) {
    const now = performance.now();
    if (latest.state === 'Fault' || isEstimated(latest)) this.lapsed = null;
    if (this.name === null || now - this.asked < AGAIN_MS) return;
    if (latest.state === 'Balancing' && this.name === 'arm') this.ask(hand('free'));
    if (latest.state === 'Fault' || isEstimated(latest)) return this.cancel();
    if (now - this.since > LAPSES_MS) return Object.assign(this, { name: null, lapsed: this.name });
    const against = this.name === 'up' ? latest.against_swing_up : latest.against_arming;
    if (latest.state !== 'Calibrated' || against.length > 0) return;
    this.asked = now;
    // The hand may have held it still meanwhile.
    if (this.isSimulated && this.name === 'up') this.ask(hand('free'));
    this.ask(say(this.name));
  }
}

// Remembers the strongest pull of the last moments, and at a fault keeps what there was.
export class Witness {
  constructor() {
    Object.assign(this, { pulls: [], fall: null });
  }

  see(picture, latest) {
    const { machine: told } = picture;
    const isLost = latest.state === 'Fault' || (latest.state === 'Stilling' && picture.fault !== null);
    if (!isLost) this.fall = null;
    else if (this.fall === null) {
      const strongest = this.pulls.reduce((best, pull) => (pull.n > (best?.n ?? 0.02) ? pull : best), null);
      this.fall = { pull: strongest, defect: told?.defect ?? null, state: told?.state ?? latest.estimate };
    }
    if (told?.t_s === undefined || isLost) return;
    const isNew = this.pulls.length > 0 && told.t_s < this.pulls.at(-1).t;
    this.pulls = isNew ? [] : this.pulls.filter(({ t }) => t > told.t_s - RECENT_S);
    if (told.pull !== null) this.pulls.push({ t: told.t_s, n: Math.hypot(...told.pull.force_n), body: told.pull.body });
  }
}

export const newtons = (n) => `${n.toFixed(n < 1 ? 2 : 1)} N`;
export const bodyName = (body, { base }) => (body === 0 ? `the ${base.noun}` : `link ${body}`);

const raise = { text: 'Raise', key: 'w', wish: 'up' };
const stillAndRaise = { ...raise, text: 'Still and raise', asks: [say('still')] };
const lift = (hello) => (hello.is_simulated ? { text: 'Lift by hand', key: 'u', wish: 'arm' }
  : { text: 'Arm', key: 'a', asks: [say('arm')] });

function calibrated({ hello, latest, machine: told, wish }) {
  const { against_arming: against, against_swing_up: swing, now } = latest;
  if (begins(against, "the encoders' signs")) {
    if (now === null) {
      return { step: 1, line: 'Homed: hanging is now 180°', below: 'Next, see that each encoder counts the right way.',
        act: { text: 'Check signs', key: 'g', asks: [say('check-signs'), ...(hello.is_simulated ? [hand('guided')] : [])] } };
    }
    if (!hello.is_simulated) return { step: 1, line: capital(now), below: 'With your hand; the motor is off.' };
    return { step: 1, line: capital(now), below: 'The simulated hand does it.',
      act: told?.holding === 'guided' ? undefined : { text: 'Let the hand do it', key: 'k', asks: [hand('guided')] } };
  }
  if (begins(against, "the motor's sign")) {
    return { step: 2, line: 'The encoders count the right way', act: { text: 'Hold to jog', key: 'm', held: 'jog +x' },
      below: now === null ? `Hands off: while you hold the button, the motor pushes the ${hello.base.noun} a little, to learn its own sense.` : capital(now) };
  }
  const still = hello.is_simulated && told?.holding !== 'hanging' ? { text: 'Hold it still', key: 'j', asks: [hand('hanging')] } : undefined;
  if (wish.name === 'up') {
    return { step: 3, line: 'Will be raised as soon as it can be', act: swing.length === 0 ? undefined : still,
      below: `${reason(swing[0] ?? 'now')}. It waits ${wish.left_s} s more; Stop cancels it.` };
  }
  if (wish.name === 'arm') return { step: 3, line: 'The hand lifts it', below: `${reason(against[0] ?? 'now')}.` };
  if (!hello.has_swing_up) {
    return { step: 3, line: 'Ready', act: lift(hello),
      below: hello.is_simulated ? 'The simulated hand lifts it, and lets go when it balances.' : reason(against[0] ?? 'hold it upright, and arm') };
  }
  if (swing.length === 0) return { step: 3, line: 'Ready', below: 'Hands off: the motor swings it up.', act: raise };
  const hangs = !begins(swing, 'the links do not hang');
  const isSwinging = !hangs || begins(swing, 'something moves');
  const line = hangs ? 'Hanging, motor off' : 'Motor off, not hanging yet';
  if (wish.lapsed === 'up' && isSwinging) {
    const remedy = hello.is_simulated ? 'Let the hand hold it still, then raise it' : 'Hold it still with your hand, then raise it';
    return { step: 3, line, below: `Not raised: after ${LAPSES_MS / 1e3} s it still swings. ${remedy}.`, act: still ?? (hello.has_stilling ? stillAndRaise : { ...raise, text: 'Raise when still' }) };
  }
  return { step: 3, line, below: isSwinging ? 'It still swings: links of little friction do so for minutes.' : `${reason(swing[0])}.`,
    act: isSwinging && hello.has_stilling ? stillAndRaise : { ...raise, text: isSwinging ? 'Raise when still' : 'Raise when possible' } };
}

function balancing({ hello, machine: told }) {
  if (told?.pull) {
    return { step: 4, line: `You pull ${bodyName(told.pull.body, hello)} with ${newtons(Math.hypot(...told.pull.force_n))}`,
      below: hello.falls_when_held && told.pull.body > 0 ? 'Let go at once: a pull that is held fells it.' : 'Let go, and watch it come back.' };
  }
  if (told?.holding === 'upright') return { step: 4, line: 'Balancing, and the hand still holds it', below: '', act: { text: 'Let go', key: 'f', asks: [hand('free')] } };
  return { step: 4, line: 'Balancing', isDone: true,
    below: !hello.is_simulated ? 'Move the set-point, or push it gently.'
      : hello.falls_when_held ? `Pull the ${hello.base.noun}, drag the ◆, or break something. A link stands a short tug only: a pull that is held fells it, however weak.`
        : 'Pull it, drag the ◆, or break something.',
    act: hello.has_swing_up ? { text: 'Lower', key: 's', asks: [say('down')] } : undefined };
}

const faultName = (fault) => (fault === null ? 'a fault' : fault.name + (fault.at === null ? '' : ` (${fault.at})`));

function fallen({ hello, picture, fall, step }) {
  const { fault } = picture;
  const name = faultName(fault);
  const line = fall?.defect ? `Broken on purpose: the firmware turned the motor off: ${name}`
    : fall?.pull ? `It fell: a pull of ${newtons(fall.pull.n)} was too strong` : `The motor is off: ${name}`;
  const below = hello.is_simulated ? 'One click puts everything back (in a simulation only).' : capital(fault?.remedy ?? '');
  const act = hello.is_simulated ? { text: 'Put it back up', key: 'b', asks: [machine({ do: 'restart', upright: true })] }
    : { text: 'Clear the fault', key: 'c', asks: [say('clear')] };
  return { step, line, below, act, isLost: true };
}

function stilling({ hello, picture, fall, wish }) {
  const fell = fall?.pull ? `It fell: a pull of ${newtons(fall.pull.n)} was too strong` : `It fell: ${faultName(picture.fault)}`;
  return { step: 3, line: picture.fault === null ? 'The motor stills the links' : fell,
    below: `The motor brings the links to rest${wish.name === 'up' ? ', then raises them. Stop cancels it.' : ': hands off.'}`,
    act: hello.has_swing_up && wish.name !== 'up' ? { ...raise, text: 'Then raise' } : undefined };
}

const BY_STATE = {
  Disarmed: ({ hello }) => ({ step: 0, line: 'It does not know its angles yet', below: 'Let it hang still, then home: hanging is then 180°.',
    act: { text: 'Home', key: 'h', asks: [...(hello.is_simulated ? [hand('hanging')] : []), say('home')] } }),
  Homing: ({ latest }) => ({ step: 0, line: 'Homing', below: capital(latest.now ?? '') }),
  Calibrated: calibrated,
  Jogging: ({ hello }) => ({ step: 2, line: `The motor pushes the ${hello.base.noun}`, below: 'Hold the button until it has learnt its sense.', act: { text: 'Hold to jog', key: 'm', held: 'jog +x' } }),
  Identifying: () => ({ step: 2, line: 'The motor shakes the links' }),
  Armed: ({ hello, latest, machine: told, wish }) => ({ step: 3, line: 'Armed: waits until all links are upright and still', below: reason(latest.against_arming[0] ?? ''),
    act: hello.is_simulated && wish.name !== 'arm' && told?.holding !== 'upright' ? lift(hello) : undefined }),
  Raising: () => ({ step: 3, line: 'The motor swings it up', below: 'Hands off until it stands.' }),
  Balancing: balancing,
  Holding: () => ({ step: 4, line: 'Holding where some links hang', act: { ...raise, asks: [say('up')], wish: undefined } }),
  Stilling: stilling,
  Lowering: () => ({ step: 4, line: 'The motor lowers it', below: 'Hands off until it hangs.' }),
  Fault: fallen,
};

// `now`: hello, picture, the latest telemetry, what the wish tells, the fall, the step before, and whether this page
// is in command. The answer: `step`, `line`, `below`, and the `act`, if there is one.
export function guide(now) {
  const { picture, latest } = now;
  const { machine: told } = picture;
  if (picture.ended !== null) return { step: now.step, line: capital(picture.ended), below: '' };
  if (told?.stopped !== undefined) {
    return { step: now.step, line: 'The firmware has stopped', below: told.stopped,
      act: { text: 'Switch off and on', key: 'b', asks: [machine({ do: 'restart', upright: true })] } };
  }
  if (latest === null) return { step: 0, line: 'connecting …', below: '' };
  const shown = BY_STATE[latest.state]({ ...now, machine: told });
  shown.below = plain(shown.below ?? '');
  if (!now.isCommander) {
    return { ...shown, below: picture.commander === null ? 'Nobody is in command.' : 'Another page is in command. Stop works here, too.',
      act: picture.commander === null ? { text: 'Take command', asks: [{ ask: 'command' }] } : undefined };
  }
  if (told?.paused) return { ...shown, below: `Time stands still at ${told.t_s.toFixed(3)} s.`, act: { text: 'Go on', key: 'p', asks: [machine({ do: 'pause', on: false })] } };
  return shown;
}
