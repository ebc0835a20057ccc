// What is one step away: a panel beside the picture for each tab.

class Panels {
  // `opened(name)` is called when a panel has come into view.
  constructor(opened) {
    this.tabs = [...document.querySelectorAll('[data-tab]')];
    for (const tab of this.tabs) tab.addEventListener('click', () => { this.open(tab.dataset.tab); opened(tab.dataset.tab); });
  }

  open(name) {
    for (const tab of this.tabs) tab.setAttribute('aria-current', tab.dataset.tab === name);
    for (const panel of document.querySelectorAll('[data-panel]')) panel.hidden = panel.dataset.panel !== name;
    byId('side').scrollTop = 0;
  }
}

// What the machine does that its controller does not know: sliders that act while it moves.
class Imperfections {
  constructor(live) {
    this.live = live;
    byId('nominal').addEventListener('click', () => {
      for (const slider of byId('properties').querySelectorAll('input')) {
        slider.value = slider.dataset.nominal;
        slider.dispatchEvent(new Event('input'));
      }
    });
  }

  show(properties) {
    const names = properties.map(({ name, unit }) => `${name} ${unit}`).join();
    if (names === this.names) return;
    this.names = names;
    this.live.values.clear();
    byId('properties').replaceChildren(...properties.map((property) => this.slider(property)));
  }

  slider({ name, label, unit, low, high, step, nominal }) {
    const input = element('input', { id: `property-${name}`, type: 'range', min: low, max: high, step, value: nominal });
    // As the slider rounds it.
    input.dataset.nominal = input.value;
    const value = element('output', {});
    const place = element('div', { className: 'slider' }, element('label', { htmlFor: input.id, textContent: label }), value, input);
    const say = () => {
      value.textContent = `${input.value} ${unit}`;
      input.setAttribute('aria-valuetext', value.textContent);
      place.classList.toggle('changed', input.value !== input.dataset.nominal);
    };
    say();
    input.addEventListener('input', () => {
      say();
      this.live.set(name, Number(input.value));
    });
    return place;
  }
}
