// Labs: what to do, step by step, and whether the library finds an answer right when it runs it.

const LABS = 'upright labs'; // name in the browser's store

class Labs {
  // `begin(toml, name)` puts a rig on the desk; `ask` asks the module; `falls()` are those seen in the twin.
  constructor(begin, ask, falls) {
    Object.assign(this, { begin, ask, falls, all: texts().labs, lab: null, number: 0, rig: null });
    this.kept = { name: '', seed: '', labs: {} };
    try { Object.assign(this.kept, JSON.parse(lastingStore()?.getItem(LABS) ?? '{}')); } catch {} // damaged
    byId('student').value = this.kept.name;
    byId('seed').value = this.kept.seed;
    byId('student').addEventListener('change', ({ target }) => this.know({ name: target.value.trim() }));
    byId('seed').addEventListener('change', ({ target }) => {
      this.know({ seed: target.value.trim() });
      if (this.lab !== null) this.open(this.lab);
    });
    byId('lesson-balance').addEventListener('click', () => byId('balance').click());
    byId('mark').addEventListener('click', () => this.mark());
    byId('answer').addEventListener('keydown', ({ key }) => { if (key === 'Enter') this.mark(); });
    byId('hint').addEventListener('click', () => this.hint());
    byId('step-before').addEventListener('click', () => this.turn(this.number - 1));
    byId('step-after').addEventListener('click', () => this.turn(this.number + 1));
    byId('hand-in').addEventListener('click', () => this.handIn());
    byId('lab-link').addEventListener('click', () => copyLink('lab', this.lab.text));
    this.list();
  }

  know(told) {
    Object.assign(this.kept, told);
    try { lastingStore()?.setItem(LABS, JSON.stringify(this.kept)); } catch {} // a store that is too small keeps nothing
  }

  // What is known of a student's work on a lab.
  workOn(lab) {
    this.kept.labs[lab.title] ??= { begun: Date.now(), last: Date.now(), steps: [] };
    return this.kept.labs[lab.title];
  }

  stepOf(lab, number) {
    const work = this.workOn(lab);
    while (work.steps.length <= number) work.steps.push({ answer: [], toml: null, is_right: false, tries: 0, hints: 0 });
    return work.steps[number];
  }

  isSolved(lab) { return lab.step.every((_, number) => this.kept.labs[lab.title]?.steps[number]?.is_right); }

  list() {
    byId('lesson-list').replaceChildren(...this.all.map((lab, number) => {
      const button = element('button', { type: 'button', textContent: `${this.isSolved(lab) ? '✓ ' : ''}${number + 1}. ${lab.title}` });
      button.append(element('span', { className: 'note', textContent: ` ${lab.minutes} min` }));
      button.setAttribute('aria-pressed', lab === this.lab);
      button.addEventListener('click', () => this.open(lab));
      return button;
    }));
  }

  // A lab of a teacher, as text; whether it is one.
  async add(text) {
    const { lab, failed } = await this.ask({ ask: 'lab', toml: text });
    if (failed !== undefined) {
      notice(`This lab cannot be used: ${failed.why}`, {}, true);
      return;
    }
    lab.text = text;
    this.all = [...this.all.filter(({ title }) => title !== lab.title), lab];
    panels.open('lessons');
    await this.open(lab);
  }

  async open(lab) {
    const example = examples.find(({ name }) => name === lab.rig);
    if (example === undefined) return notice(`The lab needs the rig ${lab.rig}, which this page does not have.`, {}, true);
    const { toml, failed } = await this.ask({ ask: 'vary', toml: example.toml, vary: lab.vary, seed: this.kept.seed });
    if (failed !== undefined) return notice(failed.why, {}, true);
    Object.assign(this, { lab, rig: toml });
    const first = lab.step.findIndex((_, number) => !this.stepOf(lab, number).is_right);
    byId('lesson').hidden = false;
    byId('lesson-title').textContent = lab.title;
    byId('goals').textContent = lab.goals;
    byId('lab-link').hidden = lab.text === undefined;
    this.begin(toml, lab.title);
    this.list();
    this.turn(Math.max(first, 0));
    return byId('answer').focus();
  }

  turn(number) {
    const { lab } = this;
    this.number = number;
    const [step, done] = [lab.step[number], this.stepOf(lab, number)];
    byId('step-number').textContent = `step ${number + 1} of ${lab.step.length}`;
    byId('step-before').disabled = number === 0;
    byId('step-after').disabled = number === lab.step.length - 1;
    byId('lesson-text').replaceChildren(...paragraphs(step.text));
    byId('answer-place').hidden = step.task.kind === 'rig';
    byId('answer-unit').textContent = step.task.unit ?? '';
    byId('answer').value = done.is_right ? done.answer.join(' ') : '';
    byId('hints').replaceChildren(...step.hints.slice(0, done.hints).map((text) => element('li', {}, ...inPieces(text))));
    byId('hint').hidden = done.hints >= step.hints.length;
    this.say(done.is_right ? `✓ ${step.see}` : '', done.is_right ? 'good' : '');
  }

  hint() {
    const done = this.stepOf(this.lab, this.number);
    done.hints += 1;
    this.know({});
    this.turn(this.number);
  }

  // What is still to be seen before an answer is marked; none if a run in the twin has shown it. A guess shows nothing.
  toSee(task, [answer]) {
    const seen = this.falls().filter((fall) => fall.toml === this.rig);
    if (task.kind === 'property') {
      const [{ property, step, unit }, beyond] = [task, answer + task.step];
      const isSeen = ({ properties }) => properties?.[property] > answer && properties[property] <= beyond;
      return seen.some(isSeen) ? null : `First show it: balance it, and let it fall with more than ${answer} and at most ${beyond} ${unit}`;
    }
    if (task.kind !== 'fault' || seen.some(({ defect }) => defect === task.defect)) return null;
    return 'First show it: balance it, and break what the lab says';
  }

  async mark() {
    const { lab, number, rig } = this;
    const { task, see } = lab.step[number];
    const isRig = task.kind === 'rig';
    const words = isRig ? [] : byId('answer').value.split(/[\s;]+/).filter((word) => word !== '').map(numberOf);
    const wrong = words.find(({ why }) => why !== undefined);
    if (wrong !== undefined) return this.say(wrong.why, 'bad');
    const answer = words.map(({ value }) => value);
    const toSee = answer.length === 1 ? this.toSee(task, answer) : null;
    if (toSee !== null) return this.say(`${toSee}.`, 'bad');
    this.say('computing …', '');
    const toml = isRig ? editor.value : rig;
    const marked = await this.ask({ ask: 'mark', toml, rig, task, answer });
    if (marked.failed === undefined) this.remember(lab, number, { answer, toml: isRig ? toml : null, is_right: marked.right });
    if (this.lab !== lab || this.number !== number) return undefined;
    if (marked.failed !== undefined) return this.say(plain(marked.failed.why), 'bad');
    if (!marked.right) return this.say(`Not yet: ${plain(marked.why)}.`, 'bad');
    return this.say(`Right: ${plain(marked.why)}. ${see}`, 'good');
  }

  remember(lab, number, told) {
    const step = this.stepOf(lab, number);
    // What is solved stays solved.
    if (!step.is_right) Object.assign(step, told, { tries: step.tries + 1 });
    this.workOn(lab).last = Date.now();
    this.know({});
    this.list();
  }

  async handIn() {
    const { lab, kept } = this;
    if (kept.name === '') {
      byId('student').focus();
      return this.say('First give your name.', 'bad');
    }
    const { begun, last } = this.workOn(lab);
    const steps = lab.step.map((_, number) => this.stepOf(lab, number));
    const work = { lab: lab.title, lab_sum: lab.sum, name: kept.name, seed: kept.seed, minutes: Math.round((last - begun) / 6e3) / 10, steps };
    const { text, failed } = await this.ask({ ask: 'hand-in', toml: this.rig, work });
    return failed === undefined ? save(`${kept.name.replaceAll(/[^\p{L}\p{N}]+/gu, '-')}.json`, text, 'application/json') : this.say(failed.why, 'bad');
  }

  say(text, kind) {
    byId('marked').textContent = text;
    byId('marked').className = kind;
  }
}

// Text with empty lines between its paragraphs.
const paragraphs = (text) => text.trim().split(/\n\s*\n/).map((paragraph) => element('p', {}, ...inPieces(paragraph)));
