// The drawers: what the controller does not know, and what can be broken.

import { inPieces } from './words.js';

const byId = (id) => document.getElementById(id);

function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

const words = (name) => name.replaceAll('-', ' ');

export class Drawers {
  // `machine` asks the simulated machine for something.
  constructor(machine) {
    this.machine = machine;
    this.sliders = new Map();
    for (const tab of document.querySelectorAll('[data-tab]')) tab.addEventListener('click', () => this.turn(tab.dataset.tab));
    byId('nominal').addEventListener('click', () => {
      for (const [name, { nominal }] of this.sliders) machine({ do: 'set', name, value: nominal });
    });
    byId('mend').addEventListener('click', () => machine({ do: 'defect', name: null, sensor: 0 }));
  }

  // Opens a drawer, or closes it; at most one is open beside the scopes.
  turn(name) {
    const [tab, isNarrow] = [document.querySelector(`[data-tab="${name}"]`), matchMedia('(max-width: 72rem)').matches];
    const opens = tab.getAttribute('aria-expanded') !== 'true';
    const isOpen = (of) => {
      if (of === name) return opens || (isNarrow && name === 'scopes');
      const other = document.querySelector(`[data-tab="${of}"]`).getAttribute('aria-expanded') === 'true';
      if (of === 'scopes') return isNarrow ? !opens : other;
      return other && name === 'scopes' && !isNarrow;
    };
    const open = new Map([...document.querySelectorAll('[data-tab]')].map(({ dataset }) => [dataset.tab, isOpen(dataset.tab)]));
    for (const [of, is] of open) document.querySelector(`[data-tab="${of}"]`).setAttribute('aria-expanded', is);
    byId('scopes').hidden = !open.get('scopes');
    open.delete('scopes');
    const drawer = [...open].find(([, is]) => is)?.[0] ?? '';
    document.body.dataset.drawer = drawer;
    byId('drawer').hidden = drawer === '';
    for (const part of document.querySelectorAll('[data-drawer]')) if (part !== document.body) part.hidden = part.dataset.drawer !== drawer;
  }

  hello(hello) {
    byId('sensor').replaceChildren(...hello.sensors.map((textContent, value) => element('option', { value, textContent })));
    byId('sensor').value = hello.sensors.length - 1;
    const groups = Map.groupBy(hello.defects, ({ group }) => group);
    byId('defects').replaceChildren(...[...groups].flatMap(([textContent, defects]) => (
      [element('h3', { textContent }), ...defects.map((defect) => this.defect(defect))])));
    this.sliders.clear();
    byId('properties').replaceChildren(...hello.properties.map((property) => this.slider(property)));
  }

  defect({ name, meaning, must }) {
    const button = element('button', { type: 'button' }, element('b', { textContent: words(name) }),
      element('small', { textContent: must }), element('span', {}, ...inPieces(meaning)));
    button.dataset.defect = name;
    button.addEventListener('click', () => this.machine({ do: 'defect', name, sensor: Number(byId('sensor').value) }));
    return button;
  }

  slider({ name, label, unit, low, high, step, nominal }) {
    const id = `property-${name}`;
    const [value, input] = [element('output', {}), element('input', { type: 'range', min: low, max: high, step, value: nominal, name, id })];
    input.addEventListener('input', () => this.machine({ do: 'set', name, value: Number(input.value) }));
    const slider = element('div', { className: 'property' }, element('label', { htmlFor: id, textContent: label }), value, input);
    this.sliders.set(name, { slider, value, input, unit, nominal });
    return slider;
  }

  picture(machine) {
    if (machine === null || machine.stopped !== undefined) return;
    const defect = machine.defect === null ? 'nothing is broken' : `broken: ${words(machine.defect)}`;
    if (byId('defect').textContent !== defect) {
      byId('defect').textContent = defect;
      for (const button of document.querySelectorAll('[data-defect]')) button.setAttribute('aria-pressed', button.dataset.defect === machine.defect);
    }
    for (const [name, { slider, value, input, unit, nominal }] of this.sliders) {
      const now = machine.properties[name];
      const text = `${Number(now.toPrecision(4))} ${unit}`;
      if (value.textContent !== text) {
        value.textContent = text;
        input.setAttribute('aria-valuetext', text);
      }
      slider.classList.toggle('changed', now !== nominal);
      if (document.activeElement !== input) input.value = now;
    }
  }
}
