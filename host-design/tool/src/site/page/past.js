// What the rig file was before: one undo for typing, fields, sliders, examples, files, links and exercises.

const MOST_STEPS = 60;
const ONE_STEP_MS = 800; // changes of the same kind within this time are one step

class Past {
  constructor() { Object.assign(this, { before: [], after: [], kind: null, at: -Infinity }); }

  // There was `state` before a change of this kind.
  note(state, kind) {
    const now = performance.now();
    const goesOn = kind === this.kind && now - this.at < ONE_STEP_MS && this.before.length > 0;
    Object.assign(this, { kind, at: now, after: [] });
    if (goesOn) return;
    this.before.push(state);
    if (this.before.length > MOST_STEPS) this.before.shift();
  }

  // What was one step before `state`, or is one step after it again; null where there is none.
  step(state, isBack) {
    const [from, to] = isBack ? [this.before, this.after] : [this.after, this.before];
    if (from.length === 0) return null;
    to.push(state);
    this.kind = null;
    return from.pop();
  }
}
