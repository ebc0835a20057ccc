//! The C header gives the bits of the firmware, whatever the compiler is told.
//!
//! Without gcc, g++, clang or the tools for AVR and ARM, the tests that need them say so and pass. If the environment
//! variable `UPRIGHT_REQUIRE_GCC` is set, they fail.

mod arm;
mod avr;
mod interrupts;
mod program;
mod readings;
mod recorded;
mod steps;

pub(crate) use arm::can_run as can_run_on_cortex_m;
use program::{Dialect, Program, is_there, replayed};
use recorded::{BALANCING, ControllerTick, Defect, FAULT, FirmwareRun, recorded, scenario};

use crate::published::{rig, rig_and_table, table};
use upright::supervision::fault::Fault;
use upright::table::Law;
use upright_design::export::{NoHeader, c_header};
use upright_design::rig::{Integral, KnownFriction, PerJoint, Rig};
use upright_design::table::TableValues;

const TICKS: u32 = 10_000;
const STRICT: Dialect<'_> = Dialect {
    compiler: "gcc",
    flags: &["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wdouble-promotion", "-Werror", "-O2"],
};
/// Flags with which gcc fuses products into sums and changes the order of sums, where the header does not forbid it.
const HOSTILE: Dialect<'_> = Dialect {
    compiler: "gcc",
    flags: &[
        "-O3",
        "-march=native",
        "-ffp-contract=fast",
        "-fassociative-math",
        "-freciprocal-math",
        "-fno-signed-zeros",
        "-fno-trapping-math",
        "-flto",
        "-w",
    ],
};
/// As the Arduino IDE compiles, with fused products allowed.
const ARDUINO: Dialect<'_> = Dialect {
    compiler: "g++",
    flags: &[
        "-std=gnu++11",
        "-x",
        "c++",
        "-Os",
        "-march=native",
        "-ffp-contract=fast",
        "-Wall",
        "-Wextra",
        "-Werror",
    ],
};
const RIGS: [&str; 5] = [
    "single-quanser-ip02",
    "double-quanser-dbpen",
    "triple-glueck-eder-kugi",
    "quadruple-paper",
    "quadruple-robust",
];

/// Number of ticks in which the answers differ, from the first tick of balancing on. A run in C that begins to balance
/// in another tick differs, too.
fn differing(run: &FirmwareRun, answers: &[ControllerTick]) -> usize {
    let early = answers[..run.first].iter().filter(|tick| tick.state == BALANCING).count();
    early
        + run.wanted.iter().zip(&answers[run.first..]).filter(|(wanted, found)| !agree(wanted, found)).count()
}

fn agree(wanted: &ControllerTick, found: &ControllerTick) -> bool {
    let is_off = wanted.state != BALANCING;
    // With the motor off, the firmware reports no force.
    (wanted.state, wanted.fault, wanted.duty, wanted.is_on)
        == (found.state, found.fault, found.duty, found.is_on)
        && (is_off || wanted.values == found.values)
}

/// The first tick of balancing in which they differ, wanted and found.
fn first_difference(run: &FirmwareRun, answers: &[ControllerTick]) -> String {
    let pairs = run.wanted.iter().zip(&answers[run.first..]);
    let first = pairs.enumerate().find(|(_, (wanted, found))| !agree(wanted, found));
    format!("{first:#x?}")
}

fn assert_equal(rig: &Rig, table: &TableValues, dialects: &[Dialect<'_>]) {
    let header = c_header(rig, table).unwrap();
    let programs = dialects.iter().map(|&dialect| (dialect, Program::that_replays(&header, dialect)));
    let programs: Vec<_> = programs.collect();
    for (law, _) in table.laws.present() {
        let run = recorded(rig, table, &scenario(rig, law, TICKS), None);
        assert_eq!(run.fault, None, "{} {law}", rig.name);
        assert!(run.wanted.len() >= TICKS as usize, "{} {law}: {}", rig.name, run.wanted.len());
        for (dialect, program) in &programs {
            let answers = program.replayed(&run.input);
            let first = first_difference(&run, &answers);
            assert_eq!(differing(&run, &answers), 0, "{} {law} {dialect:?} {first}", rig.name);
        }
    }
}

#[test]
fn the_header_has_the_bits_of_the_firmware_with_every_rig_and_law_however_it_is_compiled() {
    if !is_there("gcc") || !is_there("g++") {
        return;
    }
    for name in RIGS {
        let (rig, table) = rig_and_table(name);
        assert_equal(rig, table, &[STRICT, HOSTILE, ARDUINO]);
    }
}

/// Rigs with what none of the published ones has: delay, lag, integral, known friction, old readings.
fn variants() -> [(&'static str, Rig); 7] {
    let single = rig("single-quanser-ip02");
    let mut delayed = single.clone();
    delayed.tick.delay_ticks = 1;
    let integral = Some(Integral { position_weight: 100.0, setpoint_weight: 1.0 });
    let friction = Some(KnownFriction {
        joint_n_m: PerJoint::all(1e-3),
        cart_n: 0.2,
        joint_rate_rad_per_s: 0.07,
        cart_speed_m_per_s: 0.01,
        fed_forward_percent: 30.0,
    });
    let mut late = single.clone();
    late.actuator.force_mut().unwrap().lag_s = Some(0.004);
    let mut late_and_delayed = late.clone();
    late_and_delayed.tick.delay_ticks = 1;
    let late_and_integral = Rig { integral: integral.clone(), ..late.clone() };
    let mut old = rig("double-quanser-dbpen");
    old.chain_mut().unwrap().links[1].sensor_delay_s = 0.002;
    let both = Rig { integral: integral.clone(), ..delayed.clone() };
    [
        ("delay", delayed),
        ("delay and integral", both),
        ("old readings", old),
        ("lag", late),
        ("lag and delay", late_and_delayed),
        ("lag and integral", late_and_integral),
        ("integral and friction", Rig { integral, friction, ..single }),
    ]
}

#[test]
fn delay_lag_old_readings_integral_and_known_friction_have_the_bits_of_the_firmware() {
    if !is_there("gcc") {
        return;
    }
    for (what, rig) in variants() {
        println!("{what}");
        assert_equal(&rig, &table(&rig), &[STRICT, HOSTILE]);
    }
}

#[test]
fn faults_turn_the_motor_off_in_the_tick_of_the_firmware() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let header = c_header(rig, table).unwrap();
    let defects: [(Defect, &[Fault]); 4] = [
        (|pins, _| pins.raw_counts[1] = 5, &[Fault::Frozen, Fault::Encoder]),
        (|pins, _| pins.raw_counts[1] = pins.raw_counts[1].wrapping_add(300), &[Fault::Encoder]),
        (|pins, _| pins.raw_counts[0] = pins.raw_counts[0].wrapping_neg(), &[Fault::Encoder, Fault::Motor]),
        (|_, output| *output = upright::board::Output::OFF, &[Fault::Motor]),
    ];
    for (number, (defect, expected)) in defects.into_iter().enumerate() {
        let run = recorded(rig, table, &scenario(rig, Law::Lqr, 3000), Some((1000, defect)));
        assert!(run.fault.is_some_and(|fault| expected.contains(&fault)), "{number}: {:?}", run.fault);
        assert_eq!(run.wanted.last().map(|tick| tick.state), Some(FAULT));
        let answers = replayed(&header, STRICT, &run.input);
        assert_eq!(differing(&run, &answers), 0, "{number} {}", first_difference(&run, &answers));
    }
    // A push that is too much for the rig.
    for force_offset_n in [-8.0, 8.0] {
        let pushed = upright_design::simulate::Scenario { force_offset_n, ..scenario(rig, Law::Lqr, 3000) };
        let run = recorded(rig, table, &pushed, None);
        assert!(run.fault.is_some());
        assert_eq!(
            differing(&run, &replayed(&header, STRICT, &run.input)),
            0,
            "{force_offset_n} {:?}",
            run.fault
        );
    }
}

/// State of the header after it was asked, while balancing, for a set-point (m).
fn asked_for(program: &Program, run: &FirmwareRun, setpoint_m: f32) -> u32 {
    let mut input = run.input[..run.first + 20].to_vec();
    let last = input.last_mut().unwrap();
    (last[0], last[1]) = (8, setpoint_m.to_bits());
    program.replayed(&input).last().unwrap().state
}

#[test]
fn a_set_point_is_accepted_up_to_where_the_firmware_accepts_it() {
    if !is_there("gcc") {
        return;
    }
    const REFUSED: u32 = 99;
    for name in ["single-quanser-ip02", "quadruple-paper", "single-stepper"] {
        let (rig, table) = rig_and_table(name);
        let still = scenario(rig, Law::Lqr, 1000);
        let run = match rig.actuator.pulses() {
            Some(_) => steps::recorded_steps(rig, table, &still, steps::nothing),
            None => recorded(rig, table, &still, None),
        };
        assert_eq!(run.fault, None, "{name}");
        let program = Program::that_replays(&c_header(rig, table).unwrap(), STRICT);
        let asked = |setpoint_m: f32| asked_for(&program, &run, setpoint_m);
        let [low, high] = table.limits.setpoints_m();
        assert_eq!([low, 0.0, high].map(asked), [BALANCING; 3], "{name}");
        let beyond =
            [low.next_down(), high.next_up(), table.limits.rail_m[0], table.limits.rail_m[1], f32::NAN];
        assert_eq!(beyond.map(asked), [REFUSED; 5], "{name}");
    }
}

/// A gain of the table, changed by one unit in the last place.
fn with_another_gain(table: &TableValues) -> TableValues {
    let mut other = table.clone();
    let gain = &mut other.laws.lqr.as_mut().unwrap().k[2];
    *gain = f32::from_bits(gain.to_bits() ^ 1);
    other
}

#[test]
fn a_gain_that_differs_by_one_bit_and_a_damaged_table_are_noticed() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let run = recorded(rig, table, &scenario(rig, Law::Lqr, 1000), None);
    let other = c_header(rig, &with_another_gain(table)).unwrap();
    assert!(differing(&run, &replayed(&other, STRICT, &run.input)) > 500);
    // The same gain changed in the text of the header: its own checksum refuses it.
    let header = c_header(rig, table).unwrap();
    let [right, wrong] =
        [table, &with_another_gain(table)].map(|table| format!("{:?}f", table.laws.lqr.unwrap().k[2]));
    let damaged = header.replacen(&right, &wrong, 1);
    assert_ne!(damaged, header);
    let first = replayed(&damaged, STRICT, &run.input).swap_remove(0);
    assert_eq!((first.state, first.fault), (99, Fault::Table.code().into()));
}

/// Whether this processor can fuse a product into a sum.
fn fuses() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

#[test]
fn fused_products_are_noticed_by_the_header_and_by_the_comparison() {
    if !is_there("gcc") || !fuses() {
        return;
    }
    let (rig, table) = rig_and_table("quadruple-paper");
    let run = recorded(rig, table, &scenario(rig, Law::Lqr, 1000), None);
    let undefended = c_header(rig, table).unwrap().replace("#pragma GCC optimize", "//");
    let fast = Dialect { compiler: "gcc", flags: &["-O3", "-march=native", "-ffp-contract=fast"] };
    let first = replayed(&undefended, fast, &run.input).swap_remove(0);
    assert_eq!((first.state, first.fault), (99, 101), "UPRIGHT_ARITHMETIC");
    let unchecked = undefended.replace("!upright_arithmetic_is_exact()", "false");
    let answers = replayed(&unchecked, fast, &run.input);
    assert!(differing(&run, &answers) > 900, "{}", differing(&run, &answers));
}

#[test]
fn clang_gives_the_same_bits_unless_it_is_told_to_ignore_pragmas_which_is_noticed_at_the_start() {
    if !is_there("clang") || !fuses() {
        return;
    }
    let (rig, table) = rig_and_table("quadruple-paper");
    let run = recorded(rig, table, &scenario(rig, Law::Lqr, 1000), None);
    let header = c_header(rig, table).unwrap();
    let usual =
        Dialect { compiler: "clang", flags: &["-O3", "-march=native", "-Wall", "-Wextra", "-Werror"] };
    assert_eq!(differing(&run, &replayed(&header, usual, &run.input)), 0);
    let fast = Dialect { compiler: "clang", flags: &["-O3", "-march=native", "-ffp-contract=fast"] };
    let first = replayed(&header, fast, &run.input).swap_remove(0);
    assert_eq!((first.state, first.fault), (99, 101), "UPRIGHT_ARITHMETIC");
}

#[test]
fn a_compiler_that_may_change_results_is_refused() {
    if !is_there("gcc") {
        return;
    }
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let program = Program::new(
        &c_header(rig, table).unwrap(),
        "#include \"controller.h\"\nint main(void) { return 0; }\n",
    );
    let compiles = |flags| {
        let output = program.compiled(Dialect { compiler: "gcc", flags });
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() || said.contains("#error \"upright: "), "{said}");
        output.status.success()
    };
    assert!(compiles(&["-O2"]));
    assert!(!compiles(&["-ffast-math"]));
    assert!(!compiles(&["-Ofast"]));
    assert!(!compiles(&["-O2", "-ffinite-math-only"]));
    assert!(!compiles(&["-std=gnu89"]));
    #[cfg(target_arch = "x86_64")]
    assert!(!compiles(&["-mfpmath=387"]));
}

#[test]
fn no_compiler_warns_of_a_conversion() {
    let compilers: [(&str, &[&str]); 6] = [
        ("gcc", &["-std=c99", "-pedantic"]),
        ("g++", &["-x", "c++", "-std=c++11", "-pedantic"]),
        ("g++", &["-x", "c++", "-std=c++20"]),
        ("clang", &["-std=c99", "-pedantic"]),
        ("avr-gcc", &["-mmcu=atmega328p", "-O2"]),
        ("avr-gcc", &["-mmcu=atmega328p", "-Os", "-x", "c++", "-std=gnu++11"]),
    ];
    let warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Werror", "-c"];
    let calls = "#include \"controller.h\"\n\
        int main(void)\n{\n    static upright_controller c;\n    static uint32_t raw[UPRIGHT_SENSORS];\n\
        upright_init(&c);\n    upright_home(&c, raw, upright_table.rest_counts);\n    upright_arm(&c);\n\
        upright_control(&c, raw);\n    upright_predict(&c);\n    upright_trip(&c);\n    return 0;\n}\n";
    for name in
        ["single-quanser-ip02", "single-absolute", "single-stepper", "quadruple-paper", "quadruple-robust"]
    {
        let (rig, table) = rig_and_table(name);
        let program = Program::new(&c_header(rig, table).unwrap(), calls);
        for (compiler, flags) in compilers.into_iter().filter(|(compiler, _)| is_there(compiler)) {
            let output = program.compiled(Dialect { compiler, flags: &[flags, &warnings[..]].concat() });
            assert!(
                output.status.success(),
                "{name} {compiler}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
    }
    if is_there("avr-gcc") {
        let (rig, table) = rig_and_table("single-quanser-ip02");
        let narrow = c_header(rig, table).unwrap().replace("state = (uint8_t)(state + 2)", "state += 2");
        let flags = [&["-mmcu=atmega328p"], &warnings[..]].concat();
        let output = Program::new(&narrow, calls).compiled(Dialect { compiler: "avr-gcc", flags: &flags });
        assert!(!output.status.success(), "negative control");
    }
}

#[test]
fn a_rig_without_an_observer_is_refused() {
    let mut rig = rig("single-quanser-ip02");
    rig.kalman = None;
    assert_eq!(c_header(&rig, &table(&rig)), Err(NoHeader::NoObserver));
}
