//! The header on an Arduino's processor, in simavr, and the sketch for an Arduino Uno.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;

use super::program::{Dialect, Program, is_there};
use super::recorded::{FirmwareRun, recorded, scenario};
use super::steps::{nothing, recorded_steps};
use crate::published::rig_and_table;
use upright::table::Law;
use upright_design::export::c_header;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::limits::output;
use upright_test_support::repository;

const UNO: Dialect<'_> =
    Dialect { compiler: "avr-gcc", flags: &["-mmcu=atmega328p", "-O2", "-Wall", "-Wextra", "-Werror"] };

/// What the AVR has sent: hash, number of ticks of balancing, cycles of a tick, mean and largest.
fn in_simavr(header: &str, recording: &str) -> [u32; 4] {
    sent_by(&Program::new(header, include_str!("avr.c")), recording)
}

/// The four numbers that this program has sent.
pub(super) fn sent_by(program: &Program, recording: &str) -> [u32; 4] {
    program.add("recording.h", recording);
    let compiled = program.compiled(UNO);
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let run = ["-m", "atmega328p", "-f", "16000000"];
    let mut simavr = Command::new("simavr");
    let output = output(simavr.current_dir(program.path().parent().unwrap()).args(run).arg(program.path()));
    let said =
        String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    // Numbers among the simulator's own words and colours.
    let numbers = |line: &str| {
        let words = line
            .split(|c: char| !c.is_ascii_digit() && c != ' ')
            .find(|part| part.matches(' ').count() >= 3)?;
        words.split_whitespace().map(|word| word.parse().ok()).collect::<Option<Vec<u32>>>()?.try_into().ok()
    };
    said.lines().find_map(numbers).unwrap_or_else(|| panic!("{said}"))
}

/// The recorded run as C constants, from the tick in which the controller is armed.
fn recording(run: &FirmwareRun, scenario: &Scenario, table: &TableValues) -> String {
    let counters = |tick: usize| &run.input[tick][2..];
    let armed = run.first + 1 - table.limits.arm_ticks as usize;
    let ticks = armed..run.first + run.wanted.len();
    let step = |at_s: f64| (at_s / f64::from(table.tick_s)).round() as usize + run.first - armed;
    let list = |values: &[u32]| values.iter().map(|value| format!("{value}ul, ")).collect::<String>();
    let mut text = String::from("#include <avr/pgmspace.h>\n");
    writeln!(text, "#define TICKS {}u", ticks.len()).unwrap();
    writeln!(text, "#define STEP_M {:?}f", scenario.step_m as f32).unwrap();
    writeln!(text, "#define STEP_AT {}u", step(scenario.step_at_s)).unwrap();
    writeln!(text, "#define STEP_UNTIL {}u", step(scenario.step_until_s)).unwrap();
    writeln!(text, "static const uint32_t at_rest[] = {{{}}};", list(counters(0))).unwrap();
    writeln!(text, "static const uint32_t before_arming[] = {{{}}};", list(counters(armed - 1))).unwrap();
    text += "static const int8_t moved[][UPRIGHT_SENSORS] PROGMEM = {\n";
    for tick in ticks {
        let moved = counters(tick).iter().zip(counters(tick - 1)).map(|(now, before)| {
            // The low byte is enough, as long as a counter moves by less than 128.
            let moved = i32::from(now.wrapping_sub(*before) as i16);
            i8::try_from(moved).unwrap().to_string()
        });
        writeln!(text, "{{{}}},", moved.collect::<Vec<_>>().join(", ")).unwrap();
    }
    text + "};\n"
}

/// The hash that the AVR computes if its bits are those of the firmware.
fn hash(run: &FirmwareRun) -> u32 {
    let words =
        run.wanted.iter().flat_map(|tick| [tick.fault, tick.duty].into_iter().chain(tick.values.clone()));
    words.fold(2_166_136_261, |hash: u32, word| (hash ^ word).wrapping_mul(16_777_619))
}

/// Checks a run of `ticks` ticks on the AVR; returns the mean and the largest number of cycles.
fn on_the_uno(name: &'static str, ticks: u32) -> [u32; 2] {
    let (rig, table) = rig_and_table(name);
    let scenario = scenario(rig, Law::Lqr, ticks);
    let run = recorded(rig, table, &scenario, None);
    let header = c_header(rig, table).unwrap();
    let recording = recording(&run, &scenario, table);
    let [found, balanced, mean, worst] = in_simavr(&header, &recording);
    println!("{name}: {mean} cycles, at most {worst}");
    assert_eq!((found, balanced as usize), (hash(&run), run.wanted.len()), "{name}");
    // Negative control: another gain gives another hash.
    let other = c_header(rig, &super::with_another_gain(table)).unwrap();
    if ticks < 2000 {
        assert_ne!(in_simavr(&other, &recording)[0], hash(&run), "{name}");
    }
    [mean, worst]
}

/// The bounds are 5 % above the cycles in docs/results/c-header.md.
#[test]
fn an_arduino_uno_has_the_bits_of_the_firmware_in_no_more_cycles_than_documented() {
    if !is_there("avr-gcc") || !is_there("simavr") {
        return;
    }
    let [mean, worst] = on_the_uno("single-quanser-ip02", 10_000);
    assert!(mean <= 18_070 && worst <= 19_140, "{mean} {worst}");
    let [mean, worst] = on_the_uno("quadruple-paper", 500);
    assert!(mean <= 59_070 && worst <= 60_000, "{mean} {worst}");
}

/// A sketch of the examples, or a file beside it.
fn example(path: &str) -> String {
    std::fs::read_to_string(repository().join("examples/arduino").join(path)).unwrap()
}

/// What the pins of `avr_pulses.c` have done, from the simulator's record of them.
struct PinRecord {
    /// Pulses of each tick, those with the direction high subtracted.
    pulses: Vec<i32>,
    /// Shortest time between two pulses, as a share of the time that even ones have in their tick.
    evenness: f64,
}

impl PinRecord {
    fn read(vcd: &str) -> Self {
        let name_of = |what: &str| {
            let line = vcd.lines().find(|line| line.starts_with("$var") && line.contains(what)).unwrap();
            line.split_whitespace().nth(3).unwrap().to_owned()
        };
        let [pulse, direction, tick] = ["pulse", "direction", "tick"].map(name_of);
        let mut record = Self { pulses: Vec::new(), evenness: f64::INFINITY };
        let (mut now, mut begun, mut sense, mut times) = (0.0, 0.0, 1, Vec::<f64>::new());
        // A line is a time, or changes of pins: a level and the pin's name. At the start all are low.
        for word in vcd.lines().skip_while(|line| !line.starts_with('#')).flat_map(str::split_whitespace) {
            if let Some(time) = word.strip_prefix('#') {
                now = time.parse().unwrap();
            } else if word[1..] == direction {
                sense = if word.starts_with('1') { -1 } else { 1 };
            } else if word[1..] == tick && (word.starts_with('1') || !record.pulses.is_empty()) {
                let even = (now - begun) / times.len() as f64;
                let shares = times.windows(2).map(|pair| (pair[1] - pair[0]) / even);
                record.evenness = shares.fold(record.evenness, f64::min);
                record.pulses.push(0);
                times.clear();
                begun = now;
            } else if word[1..] == pulse
                && word.starts_with('1')
                && let Some(pulses) = record.pulses.last_mut()
            {
                *pulses += sense;
                times.push(now);
            }
        }
        record
    }
}

#[test]
fn a_steppers_pulses_come_out_of_the_unos_pin_all_of_them_and_evenly() {
    if !is_there("avr-gcc") || !is_there("simavr") || !has("/usr/include/simavr/avr", "libsimavr-dev") {
        return;
    }
    let (rig, table) = rig_and_table("single-stepper");
    // Its governor is slow: with one of 0.16 m/s, more pulses come in a tick.
    let mut table = table.clone();
    let step_m = 0.16 * rig.tick.period_s as f32;
    table.laws.present_mut().for_each(|law| law.setpoint_step = step_m);
    let run = recorded_steps(rig, &table, &scenario(rig, Law::Lqr, 1000), nothing);
    let wanted: Vec<i32> = run.wanted.iter().map(|tick| tick.duty as i32).collect();
    let mut recording =
        format!("#define TICKS {}u\n#define PERIOD {}u\n", wanted.len(), (rig.tick.period_s * 2e6).round());
    write!(recording, "static const int8_t recorded[] PROGMEM = {{").unwrap();
    wanted.iter().for_each(|pulses| write!(recording, "{pulses}, ").unwrap());
    recording += "};\n";
    let with = |generator: &str| {
        let program = Program::new("", include_str!("avr_pulses.c"));
        program.add("pulses.h", generator);
        let [wrong, ..] = sent_by(&program, &recording);
        let vcd = std::fs::read_to_string(program.path().with_file_name("pulses.vcd")).unwrap();
        (wrong, PinRecord::read(&vcd))
    };
    let generator = example("balance-stepper/pulses.h");
    let (wrong, record) = with(&generator);
    let all = wanted.iter().map(|pulses| pulses.unsigned_abs()).sum::<u32>();
    println!("{all} pulses; evenness {}", record.evenness);
    assert!(wrong == 0 && record.pulses == wanted, "{wrong} {:?}", record.pulses);
    assert!(
        all > 1000 && wanted.iter().any(|&pulses| pulses < -10) && wanted.iter().any(|&pulses| pulses > 10)
    );
    // 1.5 of 10 ms are kept free for the controller.
    assert!(record.evenness > 0.83, "{}", record.evenness);
    // Negative controls: a pulse too few, the wrong direction, and a burst.
    let differs = |old: &str, new: &str| {
        let changed = generator.replace(old, new);
        assert_ne!(changed, generator);
        with(&changed)
    };
    assert!(differs("if (--left == 0)", "if (--left <= 1)").1.pulses != wanted);
    assert!(differs("(pulses < 0 ? _BV(PB0) : 0)", "(pulses > 0 ? _BV(PB0) : 0)").1.pulses != wanted);
    assert!(differs("OCR1A += interval;", "OCR1A += interval / 2;").1.evenness < 0.83);
}

/// The Arduino's own library.
const ARDUINO_AVR: &str = "/usr/share/arduino/hardware/arduino/avr";

/// Whether this folder of a package of Debian is there.
fn has(folder: &str, package: &str) -> bool {
    let is_there = Path::new(folder).exists();
    assert!(is_there || !is_required("UPRIGHT_REQUIRE_GCC"), "install {package}");
    if !is_there {
        not_exercised(&format!("the C header on an Arduino: install {package}"));
    }
    is_there
}

/// Compiles a sketch for the Uno and links it with the Arduino's library. Returns what the compiler has said, and
/// whether it has succeeded.
fn sketch(text: &str, header: &str) -> (String, bool) {
    let program = Program::new(header, "");
    program.add("sketch.cpp", &format!("#include <Arduino.h>\n{text}"));
    let core = format!("{ARDUINO_AVR}/cores/arduino");
    let run = |arguments: &str| {
        let mut gcc = Command::new("avr-gcc");
        gcc.current_dir(program.path().parent().unwrap()).args([
            "-std=gnu++11",
            "-fno-threadsafe-statics",
            "-Os",
        ]);
        gcc.args(["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10807", "-ffunction-sections"]);
        gcc.args([format!("-I{core}"), format!("-I{ARDUINO_AVR}/variants/standard")]);
        let output = output(gcc.args(arguments.split(' ')));
        (String::from_utf8_lossy(&output.stderr).into_owned(), output.status.success())
    };
    let compiled = run("-Wall -Wextra -Werror -c sketch.cpp -o sketch.o");
    let library =
        ["main.cpp", "wiring.c", "wiring_digital.c", "hooks.c"].map(|file| format!("{core}/{file}"));
    let linked = run(&format!("-w -Wl,--gc-sections sketch.o {} -o program", library.join(" ")));
    (compiled.0 + &linked.0, compiled.1 && linked.1)
}

#[test]
fn the_sketch_compiles_for_an_arduino_uno_and_only_for_a_rig_with_one_link() {
    if !is_there("avr-gcc") || !has(ARDUINO_AVR, "arduino-core-avr") {
        return;
    }
    let text = example("balance/balance.ino");
    let header = |name| {
        let (rig, table) = rig_and_table(name);
        c_header(rig, table).unwrap()
    };
    let (said, is_built) = sketch(&text, &header("single-quanser-ip02"));
    assert!(is_built, "{said}");
    let (said, is_built) = sketch(&text, &header("quadruple-paper"));
    assert!(!is_built && said.contains("this sketch has two encoders"), "{said}");
}

#[test]
fn the_sketch_for_a_stepper_compiles_for_an_arduino_uno_and_not_for_a_motor() {
    if !is_there("avr-gcc") || !has(ARDUINO_AVR, "arduino-core-avr") {
        return;
    }
    let text = example("balance-stepper/balance-stepper.ino")
        .replace("#include \"pulses.h\"", &example("balance-stepper/pulses.h"));
    let header = |name| {
        let (rig, table) = rig_and_table(name);
        c_header(rig, table).unwrap()
    };
    let (said, is_built) = sketch(&text, &header("single-stepper"));
    assert!(is_built, "{said}");
    for name in ["single-quanser-ip02", "double-stepper"] {
        let (said, is_built) = sketch(&text, &header(name));
        assert!(!is_built && said.contains("for a stepper and one link"), "{name} {said}");
    }
}
