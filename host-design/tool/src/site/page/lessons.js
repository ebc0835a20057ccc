// The exercises: what to do, and whether the library finds an answer right.

class Lessons {
  // `begin(rig)` puts the rig of this name on the desk; `ask` asks the module.
  constructor(begin, ask) {
    Object.assign(this, { begin, ask, lesson: null });
    const lessons = JSON.parse(embedded('lesson-data'));
    byId('lessons').hidden = lessons.length === 0;
    byId('lesson-list').replaceChildren(...lessons.map((lesson, number) => {
      const button = element('button', { type: 'button', textContent: `${number + 1}. ${lesson.title}` });
      button.addEventListener('click', () => this.open(lesson, button));
      return button;
    }));
    byId('mark').addEventListener('click', () => this.mark());
    byId('answer').addEventListener('keydown', ({ key }) => { if (key === 'Enter') this.mark(); });
  }

  open(lesson, button) {
    this.lesson = lesson;
    this.button = button;
    for (const other of byId('lesson-list').children) other.setAttribute('aria-pressed', other === button);
    byId('lesson').hidden = false;
    byId('lesson-text').textContent = lesson.text;
    byId('answer-unit').textContent = lesson.exercise.unit ?? '';
    byId('answer').value = '';
    this.say('', '');
    this.begin(lesson.rig);
    byId('answer').focus();
  }

  async mark() {
    const { lesson, button } = this;
    const answer = byId('answer').value.replaceAll('−', '-').split(/[\s;]+/).filter((word) => word !== '').map(Number);
    if (answer.some(Number.isNaN)) return this.say('give numbers, with a point before decimals', 'bad');
    this.say('computing …', '');
    const { toml } = examples.find(({ name }) => name === lesson.rig);
    const marked = await this.ask({ ask: 'mark', toml, exercise: lesson.exercise, answer });
    if (this.lesson !== lesson) return undefined;
    if (marked.failed !== undefined) return this.say(marked.failed.why, 'bad');
    if (!marked.right) return this.say(`Not yet: ${marked.why}.`, 'bad');
    if (!button.textContent.startsWith('✓')) button.textContent = `✓ ${button.textContent}`;
    return this.say(`Right: ${marked.why}. ${lesson.see}`, 'good');
  }

  say(text, kind) {
    byId('marked').textContent = text;
    byId('marked').className = kind;
  }
}
