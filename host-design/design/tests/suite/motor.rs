//! The motor in the simulated machine, against closed forms, and against itself in more integration steps.

use upright::control::actuator::Drive;
use upright::table::Law;
use upright_design::plant::{MotorPlant, chain_plant};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario, Sensing, simulate};

use crate::published::{first_hour, rig, table};

/// Gear ratios from a usual one to one that nobody should build.
const GEARS: [f64; 6] = [6.3, 40.0, 52.0, 60.0, 150.0, 630.0];

/// The rig of docs/first-hour.md with this gear ratio and without anything but motor and cart: the link is a mote.
fn cart_alone(gear_ratio: f64) -> Rig {
    let mut rig = first_hour(gear_ratio);
    let chain = rig.chain_mut().unwrap();
    chain.links[0].mass_kg = 1e-12;
    chain.cart.travel_m = [-1e3, 1e3];
    rig
}

/// Duties of some ticks; none: the motor is off.
const COMMANDS: [Option<f32>; 9] =
    [Some(0.5), Some(1.0), Some(-0.7), Some(0.0), Some(0.3), None, None, Some(0.02), Some(-1.0)];

/// Position and speed of the cart after each of `COMMANDS`, each given for `ticks`.
fn simulated(rig: &Rig, ticks: usize) -> Vec<[f64; 2]> {
    let mut bench = Bench::new(rig, &Scenario::at_rest(rig, Law::Lqr)).unwrap();
    let after = |command: &Option<f32>| {
        for _ in 0..ticks {
            bench.tick(command.map_or(Drive::OFF, Drive::Duty));
        }
        [bench.state()[0], bench.state()[1]]
    };
    COMMANDS.iter().map(after).collect()
}

/// The closed form: `m v̇ = F - (d + c) v` with the force F of the voltage at standstill, the friction d of the cart
/// and the back-EMF c as damping, which is 0 while the motor is off. With the time constant `lag_s`, the duty follows
/// late.
fn exact(rig: &Rig, ticks: usize, lag_s: f64) -> Vec<[f64; 2]> {
    let chain = rig.chain().unwrap();
    let motor = rig.actuator.motor().unwrap();
    let (mass, friction) = (chain.cart.mass_kg.unwrap(), chain.cart.friction_n_s_per_m);
    let length_s = ticks as f64 * rig.tick.period_s;
    let ([mut x, mut v], mut late) = ([0.0; 2], 0.0);
    let after = |command: &Option<f32>| {
        let duty = command.map_or(0.0, f64::from);
        let braking = if command.is_some() { motor.braking_n_s_per_m() } else { 0.0 };
        let rate = (friction + braking) / mass;
        let volts = duty * motor.supply_v;
        let beyond = (volts.abs() - motor.dead_zone_v).max(0.0).copysign(volts);
        let end = motor.newtons_per_volt() * beyond / mass / rate;
        // v = end + A e^(-rate t) + B e^(-t / lag), where the motor is on and linear.
        let faded = |time_s: f64| if lag_s > 0.0 { (-time_s / lag_s).exp() } else { 0.0 };
        let per_duty = motor.newtons_per_volt() * motor.supply_v / mass;
        let b = if lag_s > 0.0 && command.is_some() {
            per_duty * (late - duty) / (rate - 1.0 / lag_s)
        } else {
            0.0
        };
        let a = v - end - b;
        x += end * length_s - a * (-rate * length_s).exp_m1() / rate + b * lag_s * (1.0 - faded(length_s));
        v = end + a * (-rate * length_s).exp() + b * faded(length_s);
        late = duty + (late - duty) * faded(length_s);
        if command.is_none() {
            late = 0.0;
        }
        [x, v]
    };
    COMMANDS.iter().map(after).collect()
}

/// Largest deviation, as a share of the largest position and of the largest speed.
fn apart(found: &[[f64; 2]], wanted: &[[f64; 2]]) -> f64 {
    let largest = |of: usize| wanted.iter().map(|state| state[of].abs()).fold(0.0, f64::max);
    let off = |of: usize| {
        let pairs = found.iter().zip(wanted);
        // NaN is infinitely far away.
        pairs
            .map(|(a, b)| if a[of].is_nan() { f64::INFINITY } else { (a[of] - b[of]).abs() })
            .fold(0.0, f64::max)
    };
    (off(0) / largest(0)).max(off(1) / largest(1))
}

/// As [`simulated`], with the force of the motor held for a quarter of a tick.
fn held(rig: &Rig, ticks: usize) -> Vec<[f64; 2]> {
    let mut plant = chain_plant(rig.chain().unwrap()).unwrap();
    let motor = MotorPlant::of(rig.actuator.motor().unwrap());
    let mut state = vec![0.0; 4];
    plant.set_state(&state);
    let after = |command: &Option<f32>| {
        for _ in 0..4 * ticks {
            let force = command.map_or(0.0, |duty| motor.force(duty.into(), state[1]));
            plant.advance(force, &[0.0], 0.25 * rig.tick.period_s, 1);
            plant.write_state(&mut state);
        }
        [state[0], state[1]]
    };
    COMMANDS.iter().map(after).collect()
}

#[test]
fn motor_and_cart_move_as_their_closed_form_says() {
    for gear_ratio in GEARS {
        let rig = cart_alone(gear_ratio);
        for ticks in [1, 7] {
            let wanted = exact(&rig, ticks, 0.0);
            let found = apart(&simulated(&rig, ticks), &wanted);
            assert!(found < 1e-8, "gear {gear_ratio}, {ticks} ticks: {found:.1e}");
            // Negative control: a voltage whose force is held.
            let held = apart(&held(&rig, ticks), &wanted);
            assert!(held > 1e-3, "gear {gear_ratio}, {ticks} ticks: {held:.1e}");
        }
    }
}

#[test]
fn a_winding_delays_the_force_as_its_closed_form_says() {
    for lag_s in [2e-5, 5e-4, 3e-3, 0.05] {
        let mut rig = cart_alone(6.3);
        rig.actuator.motor_mut().unwrap().dead_zone_v = 0.0;
        rig.reality.driver.driver_lag_s = Some(lag_s);
        let found = apart(&simulated(&rig, 3), &exact(&rig, 3, lag_s));
        assert!(found < 1e-6, "{lag_s} s: {found:.1e}");
        let other = apart(&simulated(&rig, 3), &exact(&rig, 3, 1.01 * lag_s));
        assert!(other > 1e-5, "negative control: {lag_s} s: {other:.1e}");
    }
}

/// Largest change of a state, as a share of its largest value, when a second of balancing is computed in `more`
/// integration steps per tick instead of `steps`.
fn change(rig: &Rig, [steps, more]: [usize; 2], duration_s: f64) -> f64 {
    let table = table(rig);
    let run = |substeps: usize| {
        let mut scenario = Scenario { substeps, duration_s, ..Scenario::acceptance(rig, Law::Lqr, 0.1) };
        // The bits of an encoder turn any difference into one of a count.
        scenario.sensing = Sensing::FullState;
        scenario.step_m *= 0.4;
        // The whole state is measured in f32: of links that hardly move, its rounding would be a larger share.
        scenario.start[2..].iter_mut().step_by(2).for_each(|angle| *angle = 0.002);
        let (trace, summary) = simulate(rig, &table, &scenario).unwrap();
        assert!(summary.survives(), "{}: {summary}", rig.name);
        trace.samples().map(|sample| sample.state.to_vec()).collect::<Vec<_>>()
    };
    let (some, all) = (run(steps), run(more));
    assert_eq!(some.len(), all.len());
    let of_state = |state: usize| {
        let largest = all.iter().map(|at| at[state].abs()).fold(0.0, f64::max);
        let apart = some.iter().zip(&all).map(|(a, b)| (a[state] - b[state]).abs()).fold(0.0, f64::max);
        if apart == 0.0 { 0.0 } else { apart / largest }
    };
    (0..rig.states()).map(of_state).fold(0.0, f64::max)
}

/// The same for a drive that takes pulses, as the sum of what changes in each tick of the same second. The loop does
/// not act on a difference below a pulse: between two runs, even one of rounding would grow as links fall.
fn change_in_all_ticks(rig: &Rig, [steps, more]: [usize; 2]) -> f64 {
    let step_m = rig.actuator.pulses().unwrap().step_m;
    let scenario = Scenario { duration_s: 1.0, ..Scenario::acceptance(rig, Law::Lqr, 0.1) };
    let (trace, summary) = simulate(rig, &table(rig), &scenario).unwrap();
    assert!(summary.survives(), "{}: {summary}", rig.name);
    let path: Vec<_> = trace.samples().map(|sample| sample.state.to_vec()).collect();
    let [mut few, mut many] =
        [steps, more].map(|substeps| Bench::new(rig, &Scenario { substeps, ..scenario.clone() }).unwrap());
    let mut sums = vec![0.0; rig.states()];
    for pair in path.windows(2) {
        let pulses = ((pair[1][0] - pair[0][0]) / step_m).round() as i32;
        for bench in [&mut few, &mut many] {
            bench.hold(&pair[0]);
            bench.tick(Drive::Steps(pulses));
        }
        for (sum, (a, b)) in sums.iter_mut().zip(few.state().iter().zip(many.state())) {
            *sum += (a - b).abs();
        }
    }
    let largest = |state: usize| path.iter().map(|at| at[state].abs()).fold(0.0, f64::max);
    (0..rig.states()).map(|state| sums[state] / largest(state)).fold(0.0, f64::max)
}

#[test]
fn no_number_of_integration_steps_decides_how_a_rig_balances() {
    let rigs = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs")).unwrap();
    let names =
        rigs.filter_map(|file| Some(file.unwrap().file_name().to_str()?.strip_suffix(".toml")?.to_owned()));
    let found = |name: &str, steps| match rig(name) {
        rig if rig.actuator.held().is_motion() => change_in_all_ticks(&rig, steps),
        rig => change(&rig, steps, 1.0),
    };
    let of_all: Vec<_> = names.map(|name| (found(&name, [4, 8]), name)).collect();
    assert_eq!(of_all.len(), 18);
    for (found, name) in of_all {
        println!("{name}: {found:.1e}");
        assert!(found < 1e-6, "{name}: {found:.1e}");
    }
    // Negative controls: dry friction in one step and two, and pulses.
    for name in ["triple-multiarm", "quadruple-stepper"] {
        let found = found(name, [1, 2]);
        assert!(found > 1e-6, "{name}: {found:.1e}");
    }
}

/// More steps than any of these motors needs, so that its own number of steps is tried.
#[test]
fn no_number_of_integration_steps_decides_how_a_geared_motor_balances() {
    for (gear_ratio, more, duration_s) in [
        (6.3, 8, 1.0),
        (40.0, 250, 1.0),
        (52.0, 250, 1.0),
        (60.0, 250, 1.0),
        (150.0, 600, 0.2),
        (630.0, 9300, 0.04),
    ] {
        let found = change(&first_hour(gear_ratio), [4, more], duration_s);
        assert!(found < 1e-6, "gear {gear_ratio}: {found:.1e}");
    }
}

#[test]
fn a_geared_motor_balances_or_is_refused_with_the_physical_reason() {
    for gear_ratio in GEARS {
        let rig = first_hour(gear_ratio);
        let scenario = Scenario::acceptance(&rig, Law::Lqr, 0.5);
        let (_, summary) = simulate(&rig, &table(&rig), &scenario).unwrap();
        if gear_ratio < 100.0 {
            assert!(summary.survives(), "gear {gear_ratio}: {summary}");
            continue;
        }
        let words = summary.fall_in_words().unwrap();
        assert!(words.contains("the motor has no voltage left at 0.0"), "gear {gear_ratio}: {words}");
        assert!(summary.to_string().contains(&words));
    }
    let rig = first_hour(6300.0);
    let error = Bench::new(&rig, &Scenario::at_rest(&rig, Law::Lqr)).err().unwrap().to_string();
    assert!(error.contains("stops the cart within 1.6e-8 s, a tick has 0.002 s"), "{error}");
    assert!(error.contains("at no more than 1.1e-3 m/s"), "{error}");
}
