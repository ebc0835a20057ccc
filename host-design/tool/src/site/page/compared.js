// What differs from the rig that a person began with, and two loops side by side.

class Differences {
  // `set(key, value)` gives a key the value it had; `open()` shows the list.
  constructor(set, open) {
    this.set = set;
    byId('changed').addEventListener('click', open);
  }

  show(name, differences) {
    const count = differences.length;
    byId('changed').hidden = count === 0;
    byId('changed').textContent = `${count} ${count === 1 ? 'value differs' : 'values differ'} from ${name}`;
    byId('differences').hidden = count === 0;
    byId('differences').caption.textContent = `Different from ${name}`;
    byId('differences').tBodies[0].replaceChildren(...differences.map(([key, before, now]) => {
      const back = element('button', { type: 'button', textContent: 'back', ariaLabel: `${key} back to ${before ?? 'nothing'}` });
      back.addEventListener('click', () => this.set(key, before));
      return element('tr', {}, element('th', { scope: 'row' }, element('code', { textContent: key })),
        element('td', { textContent: `${before ?? 'not given'} → ${now ?? 'not given'}` }), element('td', {}, back));
    }));
  }
}

class Snapshots {
  // `redraw()` draws the curves again.
  constructor(redraw) {
    Object.assign(this, { redraw, kept: null, now: null, at: 0, began: null });
    byId('forget').addEventListener('click', () => this.keep(null));
    byId('replay').addEventListener('click', () => this.play());
  }

  keep(snapshot) {
    this.kept = snapshot;
    this.redraw();
  }

  // The kept run's curves, for each plot the points of each of its curves; none if the kept loop has other curves.
  curves(plots) {
    const { kept } = this;
    if (kept === null || kept.rows === null || kept.lengths.length === 0) return undefined;
    const isIn = (index) => kept.rows[0][3].length > index;
    return plots.map((curves) => curves.filter(({ state }) => state === undefined || isIn(state))
      .map(({ value }) => kept.rows.map((row) => [row[0], value(row)])));
  }

  show(now) {
    this.now = now;
    const { kept } = this;
    byId('compared').hidden = kept === null;
    if (kept === null) return;
    const names = [...new Set([...kept.abilities, ...now.abilities].map(([name]) => name))];
    const textOf = (of, name) => of.abilities.find(([other]) => other === name)?.[2] ?? '';
    const row = (cell, ...cells) => element('tr', {}, element('th', { textContent: cell, scope: 'row' }), ...cells.map((textContent) => element('td', { textContent })));
    byId('side-by-side').tBodies[0].replaceChildren(row('', `kept (dashed): ${kept.name}`, `now: ${now.name}`),
      ...names.map((name) => row(name, textOf(kept, name), textOf(now, name))));
    this.draw();
  }

  draw() {
    const { kept, now, at } = this;
    if (kept === null || kept.rows === null || now.rows === null || kept.lengths.length === 0 || now.lengths.length === 0) return;
    const state = ({ rows }) => rows[Math.min(rows.length - 1, Math.round((at / rows.at(-1)[0]) * (rows.length - 1)))][3];
    const ends = [0, 1].map((end) => [kept, now].map(({ travel, arc }) => arc * (travel[end] ?? (end === 0 ? -1 : 1))));
    drawTogether(byId('together'), [kept, now].map((one) => ({ points: joints(one.lengths, state(one), one.arc) })), [Math.min(...ends[0]), Math.max(...ends[1])]);
    byId('replay-at').textContent = `${at.toFixed(1)} s`;
  }

  // Both runs from their beginning.
  play() {
    const began = performance.now();
    this.began = began;
    const step = (moment) => {
      const end = this.now.rows?.at(-1)[0] ?? 0;
      if (began !== this.began || this.kept === null) return;
      this.at = Math.max(0, Math.min(end, (moment - began) / 1e3));
      this.draw();
      if (this.at < end) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
