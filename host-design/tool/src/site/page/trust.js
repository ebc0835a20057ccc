// The trust report in short form: a step at a time, in a thread of its own.

class Trust {
  constructor(module) {
    Object.assign(this, { module, thread: null, toml: null, laws: [] });
    byId('verify').addEventListener('click', () => this.begin());
  }

  async begin() {
    this.thread ??= new Thread(this.module);
    const toml = editor.value;
    this.toml = toml;
    byId('verify').disabled = true;
    this.progress(0, 1, 'margins, noise');
    for (let [step, steps] = [0, 1]; step < steps; step += 1) {
      const answer = await this.thread.answerTo({ ask: 'verify', toml, step });
      if (this.toml !== toml) return undefined;
      if (answer.failed !== undefined) return this.end(answer.failed.why);
      ({ steps, laws: this.laws } = answer);
      this.progress(step + 1, steps, answer.next ?? '');
      this.show();
    }
    return this.end('');
  }

  progress(value, max, next) {
    Object.assign(byId('verify-progress'), { value, max, hidden: false });
    byId('verify-next').textContent = `${value} of ${max}: ${next} …`;
  }

  end(said) {
    byId('verify').disabled = false;
    byId('verify-progress').hidden = true;
    byId('verify-next').textContent = said;
  }

  // Another rig: what was found is no longer true.
  forget() {
    [this.toml, this.laws] = [null, []];
    this.end('');
    this.show();
  }

  // The rows of the law that is chosen.
  show() {
    const rows = this.laws.find(({ law }) => law === byId('law').value)?.rows ?? [];
    byId('trust-rows').replaceChildren(...rows.map(([name, value, meaning]) => element('tr', { title: meaning },
      element('th', { textContent: name, scope: 'row' }), element('td', { textContent: value }))));
  }
}
