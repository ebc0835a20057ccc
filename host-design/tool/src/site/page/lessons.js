// The exercises: what to do, and whether the library finds an answer right.

const SOLVED = 'upright solved'; // name in the browser's store

class Lessons {
  // `begin(rig)` puts the rig of this name on the desk; `ask` asks the module; `falls()` are those seen in the twin.
  constructor(begin, ask, falls) {
    Object.assign(this, { begin, ask, falls, lesson: null, solved: new Set() });
    try { this.solved = new Set(JSON.parse(lastingStore()?.getItem(SOLVED) ?? '[]')); } catch {}
    const lessons = JSON.parse(embedded('lesson-data'));
    document.querySelector('[data-tab="lessons"]').hidden = lessons.length === 0;
    byId('lesson-list').replaceChildren(...lessons.map((lesson, number) => {
      const button = element('button', { type: 'button' });
      button.addEventListener('click', () => this.open(lesson, button));
      lesson.name = () => {
        button.textContent = `${this.solved.has(lesson.title) ? '✓ ' : ''}${number + 1}. ${lesson.title}`;
      };
      lesson.name();
      return button;
    }));
    byId('lesson-balance').addEventListener('click', () => byId('balance').click());
    byId('mark').addEventListener('click', () => this.mark());
    byId('answer').addEventListener('keydown', ({ key }) => { if (key === 'Enter') this.mark(); });
  }

  open(lesson, button) {
    this.lesson = lesson;
    for (const other of byId('lesson-list').children) other.setAttribute('aria-pressed', other === button);
    byId('lesson').hidden = false;
    byId('lesson-title').textContent = lesson.title;
    byId('lesson-text').textContent = lesson.text;
    byId('answer-unit').textContent = lesson.exercise.unit ?? '';
    byId('answer').value = '';
    this.say('', '');
    this.begin(lesson.rig);
    byId('answer').focus();
  }

  // What is still to be seen before an answer is marked; none if a run in the twin has shown it. A guess shows nothing.
  toSee({ exercise }, toml, [answer]) {
    const seen = this.falls().filter((fall) => fall.toml === toml);
    if (exercise.kind === 'property') {
      const [{ property, step, unit }, beyond] = [exercise, answer + exercise.step];
      const isSeen = ({ properties }) => properties?.[property] > answer && properties[property] <= beyond;
      return seen.some(isSeen) ? null : `First show it: balance it, and let it fall with more than ${answer} and at most ${beyond} ${unit}`;
    }
    if (exercise.kind !== 'fault' || seen.some(({ defect }) => defect === exercise.defect)) return null;
    return 'First show it: balance it, and break what the exercise says';
  }

  async mark() {
    const { lesson } = this;
    const words = byId('answer').value.split(/[\s;]+/).filter((word) => word !== '').map(numberOf);
    const wrong = words.find(({ why }) => why !== undefined);
    if (wrong !== undefined) return this.say(wrong.why, 'bad');
    const answer = words.map(({ value }) => value);
    const { toml } = examples.find(({ name }) => name === lesson.rig);
    const toSee = answer.length === 1 ? this.toSee(lesson, toml, answer) : null;
    if (toSee !== null) return this.say(`${toSee}.`, 'bad');
    this.say('computing …', '');
    const marked = await this.ask({ ask: 'mark', toml, exercise: lesson.exercise, answer });
    if (this.lesson !== lesson) return undefined;
    if (marked.failed !== undefined) return this.say(marked.failed.why, 'bad');
    if (!marked.right) return this.say(`Not yet: ${marked.why}.`, 'bad');
    this.solved.add(lesson.title);
    try { lastingStore()?.setItem(SOLVED, JSON.stringify([...this.solved])); } catch {}
    lesson.name();
    return this.say(`Right: ${marked.why}. ${lesson.see}`, 'good');
  }

  say(text, kind) {
    byId('marked').textContent = text;
    byId('marked').className = kind;
  }
}
