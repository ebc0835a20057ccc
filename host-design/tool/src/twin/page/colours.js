// Colours of the page.

const colours = new Map();
let theme = null;

// The look of curves in the tool's figures.
export function useTheme(told) {
  theme = told;
  colours.clear();
}

// A colour of the style sheet; where it has none, as for curves in the light scheme, that of the tool's figures.
export function colour(name) {
  if (!colours.has(name)) {
    const given = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const curve = /^--c([0-9])$/.exec(name);
    const figure = curve !== null ? theme.colours[curve[1]] : { '--reference': theme.reference, '--limit': theme.limit }[name];
    colours.set(name, given || figure);
  }
  return colours.get(name);
}

export const dash = (number) => theme.dashes[number % theme.dashes.length];

matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => colours.clear());
