// The machine in pictures: links, drive, sensors.

const MOST_LINKS = 6;
const MOTOR_KEYS = ['torque_constant_n_m_per_a', 'back_emf_constant_v_s_per_rad', 'efficiency', 'resistance_ohm', 'gear_ratio', 'pulley_radius_m',
  'supply_v', 'bridge_drop_v', 'dead_zone_v', 'slew_v_per_s'];
const STEPPER_KEYS = ['acceleration_limit_m_per_s2', 'step_m', 'speed_limit_m_per_s', 'step_rate_limit_hz', 'bandwidth_hz'];
const SENSOR_KEYS = ['encoder_step_rad', 'encoder_counts_per_rev', 'sensor_bits', 'sensor_travel_rad', 'sensor_zero_counts', 'sensor_noise_rad'];
// What a drive begins with where the file says nothing, on each base: a force limit, an encoder, the base's mass, a
// stepper's limits and travel per pulse, and the motor's pulley, which an arm does not have.
const BEGIN = {
  cart: { force_n: 20, encoder_m: 2.5e-5, mass_kg: 1, force_weight: 0.1, acceleration_weight: 1, force_noise: 2e-4, acceleration_noise: 5e-4,
    acceleration: 20, step: 5e-5, speed: 1.5, pulley: { pulley_radius_m: 0.01 } },
  arm: { force_n: 0.5, encoder_m: 1.5e-3, mass_kg: 2e-3, force_weight: 50, acceleration_weight: 0.02, force_noise: 1e-6, acceleration_noise: 0.01,
    acceleration: 150, step: 1.9635e-3, speed: 15, pulley: {} },
};
// A motor that reaches twice the force limit with 24 V when it stands.
const MOTOR = { torque_constant_n_m_per_a: 0.03, supply_v: 24 };

const without = (section, names) => names.map((name) => [`${section}.${name}`, null]);

// The values of keys with which the rig gets another drive; `is` says what its file has. Keys are those of a cart: an arm's
// file is written with its own.
function driveOf(kind, is) {
  const begin = BEGIN[is.base.noun];
  const field = (key, otherwise) => is.fields.find((one) => one.on_cart === key)?.value ?? otherwise;
  const force = field('actuator.force_limit_n', begin.force_n);
  const isStepper = kind === 'stepper';
  const values = [...without('actuator', ['kind', ...MOTOR_KEYS, ...STEPPER_KEYS])];
  if (isStepper) {
    values.push(...without('actuator', ['force_limit_n', 'driver_lag_s']), ['cart.encoder_step_m', null], ['cart.encoder_counts_per_rev', null], ['tick.delay_ticks', null], ['limits.jog_force_n', null],
      ['actuator.kind', '"acceleration"'], ['actuator.acceleration_limit_m_per_s2', String(begin.acceleration)],
      ['actuator.step_m', String(begin.step)], ['actuator.speed_limit_m_per_s', String(begin.speed)]);
  } else {
    values.push(['actuator.force_limit_n', String(force)], ['cart.mass_kg', String(field('cart.mass_kg', begin.mass_kg))]);
    if (field('cart.encoder_counts_per_rev', null) === null) values.push(['cart.encoder_step_m', String(field('cart.encoder_step_m', begin.encoder_m))]);
  }
  if (kind === 'motor') {
    const ohm = (MOTOR.torque_constant_n_m_per_a * MOTOR.supply_v) / (2 * force * (begin.pulley.pulley_radius_m ?? 1));
    values.push(...Object.entries({ ...MOTOR, ...begin.pulley, resistance_ohm: Number(ohm.toPrecision(3)) }).map(([name, value]) => [`actuator.${name}`, String(value)]));
  }
  // Weight and noise are those of the input.
  const [from, to] = isStepper ? ['force', 'acceleration'] : ['acceleration', 'force'];
  if (isStepper !== (is.drive === 'stepper')) {
    if (is.weights !== null) values.push([`lqr.${from}_weight`, null], [`lqr.${to}_weight`, String(begin[`${to}_weight`])]);
    if (is.has_observer) {
      const unit = { force: 'n2_s', acceleration: 'm2_per_s3' };
      values.push([`kalman.${from}_noise_${unit[from]}`, null], [`kalman.${to}_noise_${unit[to]}`, String(begin[`${to}_noise`])]);
    }
  }
  return values;
}

// The same for the sensors of all links.
function sensorsOf(kind, { lengths_m: lengths }) {
  return lengths.flatMap((_, link) => [...without(`link[${link + 1}]`, SENSOR_KEYS),
    ...(kind === 'encoder' ? [[`link[${link + 1}].encoder_counts_per_rev`, '4096']]
      : [[`link[${link + 1}].sensor_bits`, '14'], [`link[${link + 1}].sensor_noise_rad`, '4e-4']])]);
}

function picture(paths, ...more) {
  return svg('svg', { viewBox: '0 0 66 48', 'aria-hidden': 'true' }, svg('path', { d: paths }), ...more);
}

const RAIL = 'M4 42h58M24 42v-7h18v7';
const PICTURES = {
  force: () => picture(`${RAIL}M46 38h12m-5-4 5 4-5 4`),
  motor: () => picture(`${RAIL}M16 38h-6M6 30h8M42 38h16`, svg('circle', { cx: 10, cy: 38, r: 6 })),
  stepper: () => picture(`${RAIL}M46 26h4v-8h4v8h4v-8h4`),
  encoder: () => picture('M33 24h0M33 8v6M33 34v6M17 24h6M43 24h6M22 13l4 4M40 31l4 4M44 13l-4 4M26 31l-4 4', svg('circle', { cx: 33, cy: 24, r: 17 }), svg('circle', { cx: 33, cy: 24, r: 4 })),
  absolute: () => picture('M20 24h26M27 18v12', svg('circle', { cx: 33, cy: 24, r: 17 }), svg('path', { d: 'M20 24a13 13 0 0 1 26 0z', fill: 'currentColor' })),
};

// A chain of so many links on its cart.
function chainPicture(links) {
  const each = 34 / links;
  const points = Array.from({ length: links + 1 }, (_, k) => `${33 + (k % 2) * 4},${36 - k * each}`).join(' ');
  return picture(RAIL, svg('polyline', { points }));
}

class MachinePictures {
  // `set(values, kind, refuse, links)` changes the rig file.
  constructor(set) { this.set = set; }

  show(sketch) {
    if (sketch.lengths_m.length === 0) return byId('pictures').replaceChildren(element('p', { className: 'note', textContent: 'A linear model has no parts to choose.' }));
    const refused = element('small', { role: 'alert' });
    const refuse = (why) => refused.replaceChildren(...inPieces(why));
    const group = (title, choices) => [element('h3', { textContent: title }), element('div', { className: 'choice', role: 'group', ariaLabel: title },
      ...choices.map(({ text, drawn, is, act }) => {
        const button = element('button', { type: 'button' }, drawn, text);
        button.setAttribute('aria-pressed', is);
        button.addEventListener('click', act);
        return button;
      }))];
    const links = Array.from({ length: MOST_LINKS }, (_, k) => ({ text: String(k + 1), drawn: chainPicture(k + 1), is: sketch.lengths_m.length === k + 1,
      act: () => this.set([], `${k + 1} links`, refuse, k + 1) }));
    const drives = [['force', 'a force'], ['motor', 'DC motor'], ['stepper', 'stepper']].map(([kind, text]) => ({ text, drawn: PICTURES[kind](), is: sketch.drive === kind,
      act: () => { if (sketch.drive !== kind) this.set(driveOf(kind, sketch), text, refuse); } }));
    const sensors = [['encoder', 'encoders'], ['absolute', 'magnetic']].map(([kind, text]) => ({ text, drawn: PICTURES[kind](), is: sketch.sensors === kind,
      act: () => { if (sketch.sensors !== kind) this.set(sensorsOf(kind, sketch), text, refuse); } }));
    return byId('pictures').replaceChildren(...group('Links', links), ...group(`Drive of the ${sketch.base.noun}`, drives), ...group('Sensors of the links', sensors), refused);
  }
}
