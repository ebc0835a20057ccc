//! From a wired rig to a balancing one: simulated machines with planted defects, and the step that stops each.

use std::path::Path;

use upright_closed_loop::harness::with_firmware;
use upright_design::rig::{LinkEncoder, PlantDescription, Rig};
use upright_design::table::TableValues;
use upright_tool::commission::{
    CommissionPlan, CommissionRecord, CommissionStep, Commissioning, Journal, MachineAtHand, PersonTask,
    Planted, Simulated, Stop, measured_zeros,
};

use crate::command::{SINGLE, path_of, status, stderr, stdout, upright};
use crate::published::rig_and_table;

const DOUBLE: &str = "double-quanser-dbpen";

fn plan<'a>(rig: &'a Rig, table: &'a TableValues, text: &'a str) -> CommissionPlan<'a> {
    CommissionPlan { rig, table, file: Path::new("rig.toml"), text, seconds: 8.0, seed: 1 }
}

/// The steps that find every error in the wiring, before anything is measured.
fn early() -> &'static [CommissionStep] {
    let before = |&step: &CommissionStep| step == CommissionStep::Excitation;
    &CommissionStep::FIRST[..CommissionStep::FIRST.iter().position(before).unwrap()]
}

/// Does these steps with the simulated machine of a rig, whose firmware has `table`; returns the step that was not
/// passed, and why.
fn stopped(
    name: &'static str,
    table: &TableValues,
    planted: Option<Planted>,
    steps: &[CommissionStep],
) -> Option<(CommissionStep, String)> {
    let (rig, own) = rig_and_table(name);
    let text = std::fs::read_to_string(path_of(name)).unwrap();
    let mut journal = Journal::new(CommissionRecord::new(rig, "this computer"), None, Box::new(|_| ()));
    let result = with_firmware(table, |target| {
        let mut machine = Simulated::new(rig, table, planted, target, 1).unwrap();
        Commissioning::new(plan(rig, own, &text)).run(&mut machine, &mut journal, steps)
    });
    match result.unwrap() {
        Ok(()) => None,
        Err(Stop::Machine(words)) => {
            let last = journal.record.steps.last().unwrap();
            assert!(!last.passed && last.stopped.as_ref() == Some(&words), "{last:?}");
            Some((last.step, words))
        }
        Err(error) => panic!("{error}: {:?}", journal.record.steps.last()),
    }
}

#[test]
fn a_sound_machine_passes_every_early_step() {
    for name in [SINGLE, DOUBLE] {
        let (_, table) = rig_and_table(name);
        assert_eq!(stopped(name, table, None, early()), None);
    }
}

#[test]
fn a_machine_on_a_stepper_is_commissioned_and_its_defects_stop_it() {
    let (_, table) = rig_and_table("double-stepper");
    let until_identified = &CommissionStep::FIRST[..8];
    assert_eq!(stopped("double-stepper", table, None, until_identified), None);
    let cases = [
        ("limit-switch-missing", CommissionStep::Contacts, "the limit switch at the high end does not open"),
        ("motor-reversed", CommissionStep::Homing, "along +x for positive pulses"),
        ("cart-stuck", CommissionStep::Homing, "does the drive move the cart"),
        ("encoder-reversed", CommissionStep::Signs, "counts the wrong way"),
        ("encoders-swapped", CommissionStep::Signs, "swap their plugs"),
        ("counts-wrong", CommissionStep::Turns, "correct encoder_counts_per_rev"),
    ];
    for (name, wanted, remedy) in cases {
        let planted = name.parse().unwrap();
        let (step, words) =
            stopped("double-stepper", table, Some(planted), &CommissionStep::FIRST).expect("it is found");
        assert!(step == wanted && words.contains(remedy), "{name}: {step:?}: {words}");
    }
}

#[test]
fn a_machine_with_absolute_sensors_passes_unless_the_zero_of_one_is_another() {
    const NAME: &str = "double-absolute";
    let (_, table) = rig_and_table(NAME);
    assert_eq!(stopped(NAME, table, None, early()), None);
    let mut other = table.clone();
    other.sensors[2].kind.reading_mut().unwrap().zero_counts += 400;
    let (step, words) = stopped(NAME, &other, None, early()).expect("it is found");
    assert!(step == CommissionStep::Homing && words.contains("--zeros"), "{step:?}: {words}");
}

/// The file of the double with absolute sensors, with these zeros.
fn with_zeros(zeros: [u32; 2]) -> String {
    let text = std::fs::read_to_string(path_of("double-absolute")).unwrap();
    let [first, second] = zeros.map(|zero| format!("sensor_zero_counts = {zero}\n"));
    text.replace("sensor_zero_counts = 9021\n", &first).replace("sensor_zero_counts = 12\n", &second)
}

#[test]
fn the_zeros_of_absolute_sensors_are_measured_and_nothing_else_of_the_file_changes() {
    let folder = tempfile::tempdir().unwrap();
    let [true_machine, new] = ["true.toml", "new.toml"].map(|file| folder.path().join(file));
    std::fs::write(&true_machine, with_zeros([16_383, 5000])).unwrap();
    let [true_machine, new] = [&true_machine, &new].map(|file| file.to_str().unwrap());
    let rig = path_of("double-absolute");
    let command =
        ["commission", &rig, "--target", "host", "--machine", true_machine, "--zeros", "--write", new];
    let output = upright(&command);
    assert_eq!(status(&output), 0, "{}", stderr(&output));
    let text = std::fs::read_to_string(new).unwrap();
    let found: Vec<u32> = text
        .lines()
        .filter_map(|line| line.strip_prefix("sensor_zero_counts = ").map(|value| value.parse().unwrap()))
        .collect();
    // The mean of a hundred readings or more with 2.7 counts of noise; the first zero is at the wrap.
    assert!((found[0] + 4) % 16_384 < 6 && found[1].abs_diff(5000) <= 2, "{found:?}");
    assert_eq!(text, with_zeros([found[0], found[1]]));
    // A machine with the zeros of the file is homed; negative control: one with the old zeros is not.
    let home = |file: &str| {
        let rig = Rig::from_path(Path::new(true_machine)).unwrap();
        let of_file = Rig::from_path(Path::new(file)).unwrap();
        let table = crate::published::table(&of_file);
        let mut journal = Journal::new(CommissionRecord::new(&rig, "this computer"), None, Box::new(|_| ()));
        let result = with_firmware(&table, |target| {
            let mut machine = Simulated::new(&rig, &table, None, target, 2).unwrap();
            let steps = &early()[..4];
            Commissioning::new(plan(&of_file, &table, "")).run(&mut machine, &mut journal, steps)
        });
        result.unwrap().is_ok()
    };
    assert!(home(new) && !home(&rig));
    let output = upright(&["commission", &path_of(SINGLE), "--target", "host", "--zeros"]);
    assert!(status(&output) == 2 && stderr(&output).contains("no link has an absolute sensor"));
}

/// A potentiometer, which has no reading beyond its ends, of a machine that hangs where `real` is read.
fn measured_potentiometer(real: u32) -> (String, Result<String, String>) {
    let text = std::fs::read_to_string(path_of("single-absolute")).unwrap().replace(
        "sensor_bits = 14\nsensor_zero_counts = 9021",
        "sensor_bits = 12\nsensor_travel_rad = 5.934\nsensor_zero_counts = 3100",
    );
    let mut rig = Rig::from_toml(&text, Path::new("rig.toml")).unwrap();
    let table = crate::published::table(&rig);
    let of_file = rig.clone();
    if let Some(LinkEncoder::Absolute { zero_counts, .. }) = &mut rig.chain_mut().unwrap().links[0].encoder {
        *zero_counts = real;
    }
    let mut journal = Journal::new(CommissionRecord::new(&rig, "this computer"), None, Box::new(|_| ()));
    let result = with_firmware(&table, |target| {
        let mut machine = Simulated::new(&rig, &table, None, target, 2).unwrap();
        measured_zeros(plan(&of_file, &table, &text), &mut machine, &mut journal)
    });
    (text, result.unwrap().map_err(|error| error.to_string()))
}

#[test]
fn the_zero_of_a_potentiometer_is_measured_unless_it_would_not_read_upright() {
    for real in [3100, 2900, 3300] {
        let (text, found) = measured_potentiometer(real);
        let found = found.unwrap();
        let zero = found.lines().find_map(|line| line.strip_prefix("sensor_zero_counts = ")).unwrap();
        assert!(zero.parse::<u32>().unwrap().abs_diff(real) <= 2, "{real}: {zero}");
        assert_eq!(found, text.replace("3100", zero));
    }
    // Negative control: the dead band is where the link is upright.
    let (_, found) = measured_potentiometer(2048);
    println!("{found:?}");
    let refused = found.unwrap_err();
    assert!(refused.contains("turn the potentiometer"), "{refused}");
}

/// A machine whose links never hang still.
struct Restless<'a>(Simulated<'a>);

impl MachineAtHand for Restless<'_> {
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop> {
        self.0.exchange(bytes)
    }
    fn now(&self) -> std::time::Duration {
        self.0.now()
    }
    fn ask(&mut self, _: PersonTask) -> Result<(), Stop> {
        self.0.ask(PersonTask::Move(1))
    }
    fn patience(&self) -> std::time::Duration {
        self.0.patience()
    }
    fn again(&mut self, failed: CommissionStep, back: CommissionStep) -> bool {
        self.0.again(failed, back)
    }
}

#[test]
fn no_zero_is_measured_of_a_link_that_moves_or_a_sensor_that_does_not() {
    let (rig, table) = rig_and_table("double-absolute");
    let refused = |machine: &Rig, planted: Option<&str>, is_restless: bool| {
        let planted = planted.map(|name| name.parse().unwrap());
        let mut journal = Journal::new(CommissionRecord::new(rig, "this computer"), None, Box::new(|_| ()));
        let text = with_zeros([9021, 12]);
        let result = with_firmware(table, |target| {
            let mut machine = Simulated::new(machine, table, planted, target, 1).unwrap();
            match is_restless {
                true => measured_zeros(plan(rig, table, &text), &mut Restless(machine), &mut journal),
                false => measured_zeros(plan(rig, table, &text), &mut machine, &mut journal),
            }
        });
        result.unwrap().err().map(|error| error.to_string()).unwrap_or_default()
    };
    let mut dead = rig.clone();
    dead.chain_mut().unwrap().links[1].encoder =
        Some(LinkEncoder::Absolute { bits: 14, travel_rad: None, zero_counts: 0, noise_rad: 0.0 });
    for (machine, planted, is_restless, words) in [
        (rig, None, true, "rad: let it hang still"),
        (rig, Some("encoder-frozen"), false, "the sensor of link 1 does not count"),
        (rig, Some("encoder-reversed"), false, "the sensor of link 1 counts the wrong way"),
        (&dead, None, false, "the sensor of link 2 reads 0 all the time"),
    ] {
        let said = refused(machine, planted, is_restless);
        assert!(said.contains(words), "{said}");
    }
    assert_eq!(refused(rig, None, false), "", "negative control");
}

#[test]
fn every_planted_defect_is_found_in_its_step() {
    for (name, links) in [(SINGLE, 1), (DOUBLE, 2)] {
        let (_, table) = rig_and_table(name);
        for planted in Planted::all() {
            let (step, words) =
                stopped(name, table, Some(planted), &CommissionStep::FIRST).expect("it is found");
            assert_eq!(step, planted.found_in(links), "{planted}: {words}");
        }
    }
}

/// The table with limits that disable the firmware's own check of a step.
fn blind(table: &TableValues, step: CommissionStep) -> TableValues {
    let mut table = table.clone();
    match step {
        CommissionStep::Homing => table.limits.travel_counts[1] = i32::MAX,
        CommissionStep::Signs => table.sensors.iter_mut().for_each(|sensor| sensor.sign_counts = 0),
        CommissionStep::Motor => table.sensors[0].sign_counts = 0,
        _ => {}
    }
    table
}

#[test]
fn without_the_check_of_its_step_no_defect_is_found_there() {
    for (name, links) in [(SINGLE, 1), (DOUBLE, 2)] {
        let (_, table) = rig_and_table(name);
        let is_early = |planted: &Planted| early().contains(&planted.found_in(links));
        for planted in Planted::all().filter(is_early) {
            let step = planted.found_in(links);
            let mut steps = early().to_vec();
            steps.truncate(steps.iter().position(|&one| one == step).unwrap() + 1);
            // These checks are the tool's own.
            if matches!(step, CommissionStep::Contacts | CommissionStep::Turns) {
                steps.pop();
            }
            assert_eq!(stopped(name, &blind(table, step), Some(planted), &steps), None, "{planted}");
        }
    }
}

#[test]
fn the_firmware_of_another_rig_is_refused_at_once() {
    let (rig, table) = rig_and_table(DOUBLE);
    let mut other = table.clone();
    other.rig_hash ^= 1;
    let (step, words) = stopped(DOUBLE, &other, None, early()).unwrap();
    assert!(step == CommissionStep::Connect && words.contains("flash the firmware again"), "{words}");
    assert_eq!(rig.hash(), table.rig_hash);
}

/// The machine differs from the file in masses, lengths, friction, zeros and timing.
const REALITY: &str = "\n[reality]\njoint_friction_n_m = 5e-4\ncart_friction_n = 0.1\nhoming_error_rad = 0.006\n\
    cart_mass_percent = -9\nlink_mass_percent = 10\nlink_length_percent = -8\nlatency_s = 5e-4\n";

#[test]
fn a_machine_that_differs_from_its_file_is_commissioned_and_balances() {
    let folder = tempfile::tempdir().unwrap();
    let [machine, new, file] = ["machine.toml", "new.toml", "record.json"]
        .map(|name| folder.path().join(name).display().to_string());
    let rig = path_of(SINGLE);
    std::fs::write(&machine, std::fs::read_to_string(&rig).unwrap() + REALITY).unwrap();
    let arguments =
        ["--target", "host", "--machine", &machine, "--write", &new, "--record", &file, "--seconds", "12"];
    let output = upright(&[&["commission", &rig, "--json"], arguments.as_slice()].concat());
    assert_eq!(status(&output), 0, "{}", stderr(&output));

    let printed: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!((&printed, &printed["outcome"]), (&written, &"done".into()));
    let steps = printed["steps"].as_array().unwrap();
    assert_eq!(steps.len(), CommissionStep::FIRST.len() + 1 + CommissionStep::SECOND.len());
    assert!(steps.iter().all(|step| step["passed"] == true));
    assert!(steps.last().unwrap()["found"][0].as_str().unwrap().starts_with("balanced for 10 s"));
    assert_eq!(steps[7]["data"]["wiring"]["as_in_file"], true);

    let mass = |file: &str| {
        let PlantDescription::Chain(chain) = Rig::from_path(Path::new(file)).unwrap().plant else {
            panic!("a chain")
        };
        chain.cart.mass_kg.unwrap() + chain.links[0].mass_kg
    };
    let true_mass = 1.0731 * 0.91 + 0.230 * 1.1;
    assert!((mass(&new) / true_mass - 1.0).abs() < 0.01, "{} instead of {true_mass}", mass(&new));
    // Negative control: the old file is further off.
    assert!((mass(&rig) / true_mass - 1.0).abs() > 0.03);
}

#[test]
fn a_machine_that_does_not_meet_its_requirements_is_not_balanced() {
    // Without this line, such a machine is commissioned: see above.
    let text = std::fs::read_to_string(path_of(SINGLE)).unwrap() + "\n[verify]\ngain_margin = 30\n";
    let (rig, table) = rig_and_table(SINGLE);
    let mut journal = Journal::new(CommissionRecord::new(rig, "this computer"), None, Box::new(|_| ()));
    let result = with_firmware(table, |target| {
        let mut machine = Simulated::new(rig, table, None, target, 1).unwrap();
        Commissioning::first(plan(rig, table, &text), &mut machine, &mut journal).map(drop)
    });
    assert!(matches!(result.unwrap(), Err(Stop::Machine(words)) if words.contains("gain_margin")));
    assert_eq!(journal.record.steps.last().unwrap().step, CommissionStep::Verification);
}

#[test]
fn the_command_ends_with_status_3_if_the_machine_must_not_be_run() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("record.json");
    let rig = path_of(SINGLE);
    let run = |more: &[&str]| {
        upright(
            &[&["commission", &rig, "--target", "host", "--record", file.to_str().unwrap()], more].concat(),
        )
    };
    let record = || -> serde_json::Value { serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap() };

    let output = run(&["--defect", "motor-reversed"]);
    assert_eq!(status(&output), 3, "{}", stderr(&output));
    assert!(stderr(&output).contains("swap its wires") && stdout(&output).contains("NOT PASSED"));
    let (record, last) = (record(), early().len() - 1);
    assert_eq!((&record["outcome"], &record["steps"][last]["passed"]), (&"stopped".into(), &false.into()));

    let other = path_of(DOUBLE);
    for (more, words) in [
        (["--defect", "gremlins"], "give one of emergency-stop-missing"),
        (["--machine", &other], "another number of links"),
    ] {
        let output = run(&more);
        assert_eq!(status(&output), 2);
        assert!(stderr(&output).contains(words), "{}", stderr(&output));
    }
}

#[test]
fn a_commissioning_that_began_again_says_so_at_its_end() {
    use std::sync::{Arc, Mutex};
    let shown = Arc::new(Mutex::new(Vec::new()));
    let lines = Arc::clone(&shown);
    let rig = Rig::from_path(Path::new(&path_of(SINGLE))).unwrap();
    let show = Box::new(move |line: &str| lines.lock().unwrap().push(line.to_owned()));
    let mut journal = Journal::new(CommissionRecord::new(&rig, "this computer"), None, show);
    for stopped in [Some("fault rail"), None] {
        journal.begin(CommissionStep::Excitation);
        journal.end(stopped.map(str::to_owned)).unwrap();
        if stopped.is_some() {
            journal.again(CommissionStep::Homing);
        }
    }
    let before = shown.lock().unwrap().clone();
    journal.done().unwrap();
    let shown = shown.lock().unwrap();
    assert!(before.contains(&"begins again: homing".to_owned()), "{before:?}");
    assert_eq!(shown[before.len()..], ["excitation had to begin again: fault rail".to_owned()]);
    assert_eq!(journal.record.steps.len(), 2);
}
