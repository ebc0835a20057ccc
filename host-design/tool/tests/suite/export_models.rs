//! `upright export --mjcf` and `--urdf`: MuJoCo computes the same accelerations, and `import` reads the machine.

use std::path::{Path, PathBuf};
use std::process::Command;

use upright_design::plant::{ChainPlant, MotorPlant, WideChainState, WithLinks, with_links};
use upright_design::reality::real_chain;
use upright_design::rig::{Actuator, Chain, Link, PerJoint, Rig};
use upright_test_support::limits::output;
use upright_tool::import::rig_file;
use upright_tool::simulator_model::{NoModel, mjcf, urdf};

/// Dry friction in the joints, a motor, a cart whose acceleration is imposed, and a motor with three links.
const RECORDED: [&str; 4] =
    ["double-multiarm", "single-quanser-ip02", "single-stepper", "triple-glueck-eder-kugi"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mujoco")
}

fn rig(name: &str) -> Rig {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    Rig::from_path(&root.join(format!("rigs/{name}.toml"))).unwrap()
}

/// The rig of a recording: the stepper's has a joint with dry friction, too.
fn recorded_rig(name: &str) -> Rig {
    let mut rig = rig(name);
    if name == "single-stepper" {
        rig.reality.friction.joint_friction_n_m = PerJoint::all(1e-3);
    }
    rig
}

/// What MuJoCo computed: control, positions, speeds and accelerations of the joints.
struct Recorded {
    name: String,
    control: f64,
    joints: [Vec<f64>; 3],
}

fn recorded(text: &str) -> Vec<Recorded> {
    let line = |line: &str| {
        let (name, numbers) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        let joints: Vec<&[f64]> = numbers[1..].chunks((numbers.len() - 1) / 3).collect();
        let joints = [0, 1, 2].map(|part| joints[part].to_vec());
        Recorded { name: name.to_owned(), control: numbers[0], joints }
    };
    text.lines().map(line).collect()
}

/// The plant's accelerations of cart and joints, in the state of the recording.
struct Accelerations<'a>(&'a Rig, Chain, &'a Recorded);

impl WithLinks for Accelerations<'_> {
    type Output = Vec<f64>;

    fn run<const N: usize>(self) -> Vec<f64> {
        let Self(rig, chain, Recorded { control, joints: [positions, speeds, _], .. }) = self;
        let summed = |joints: &[f64]| {
            let mut sum = 0.0;
            core::array::from_fn::<f64, N, _>(|joint| {
                sum += joints[1 + joint];
                sum
            })
        };
        let state = WideChainState {
            x: positions[0],
            xdot: speeds[0],
            phi: summed(positions),
            phidot: summed(speeds),
        };
        let friction = &rig.reality.friction;
        let input = match &rig.actuator {
            // What is left of a command that is larger by the dead zone.
            Actuator::Motor(motor, _) => {
                let command_v = control + motor.dead_zone_v.copysign(*control);
                MotorPlant::of(motor).force_at_supply(command_v / motor.supply_v, speeds[0], motor.supply_v)
            }
            _ => *control,
        };
        let torques = core::array::from_fn(|joint| {
            -friction.joint_friction_n_m.of_joint(joint) * speeds[1 + joint].signum()
        });
        let rates = ChainPlant::<N>::of(&chain).unwrap().derivative(&state, input, &torques);
        let mut before = 0.0;
        let relative = rates.phidot.iter().map(|&rate| rate - std::mem::replace(&mut before, rate));
        core::iter::once(rates.xdot).chain(relative).collect()
    }
}

/// Largest difference from the recording, as a share of the largest acceleration.
fn difference(rig: &Rig, change: impl Fn(&mut Chain), recorded: &Recorded) -> f64 {
    let mut chain = real_chain(rig.chain().unwrap(), &rig.reality.parameters);
    change(&mut chain);
    let found = with_links(chain.links.len(), Accelerations(rig, chain, recorded)).unwrap();
    let wanted = &recorded.joints[2];
    let largest =
        |numbers: &mut dyn Iterator<Item = f64>| numbers.fold(0.0, |most: f64, x| most.max(x.abs()));
    largest(&mut found.iter().zip(wanted).map(|(found, wanted)| found - wanted))
        / largest(&mut wanted.iter().copied())
}

#[test]
fn mujoco_computes_the_accelerations_of_the_plant() {
    let recordings = recorded(&std::fs::read_to_string(folder().join("accelerations.csv")).unwrap());
    assert_eq!(recordings.len(), 8 * RECORDED.len());
    for recording in &recordings {
        let rig = recorded_rig(&recording.name);
        let off = difference(&rig, |_| (), recording);
        assert!(off < 1e-9, "{}: {off:e}", recording.name);
        // Negative control: gravity that is a hundred-thousandth larger.
        let off = difference(&rig, |chain| chain.gravity_m_per_s2 *= 1.0 + 1e-5, recording);
        assert!(off > 1e-9, "{}: {off:e}", recording.name);
    }
}

/// The recording was made from these files. Where Python has MuJoCo, it is made again; UPRIGHT_BLESS=1 writes both.
#[test]
fn the_recorded_accelerations_are_those_of_the_exported_models() {
    let is_blessing = std::env::var_os("UPRIGHT_BLESS").is_some();
    let files = RECORDED.map(|name| folder().join(format!("{name}.xml")));
    for (name, file) in RECORDED.iter().zip(&files) {
        let model = mjcf(&recorded_rig(name)).unwrap();
        if is_blessing {
            std::fs::write(file, &model).unwrap();
        }
        assert_eq!(
            model,
            std::fs::read_to_string(file).unwrap(),
            "{name}: bless with Python's package mujoco"
        );
    }
    let python = std::env::var("UPRIGHT_PYTHON").unwrap_or("python3".to_owned());
    if Command::new(&python).arg("--version").output().is_err() {
        eprintln!("skipped: no {python}; the recorded accelerations are not computed again");
        return;
    }
    // MuJoCo writes a log into the folder that it runs in.
    let elsewhere = tempfile::tempdir().unwrap();
    let mut command = Command::new(&python);
    command.current_dir(&elsewhere).arg(folder().join("accelerations.py")).args(&files);
    let computed = output(&mut command);
    let errors = String::from_utf8_lossy(&computed.stderr);
    if errors.contains("No module named 'mujoco'") {
        eprintln!(
            "skipped: {python} has no package mujoco; the recorded accelerations are not computed again"
        );
        return;
    }
    assert!(computed.status.success(), "{errors}");
    let text = String::from_utf8(computed.stdout).unwrap();
    let file = folder().join("accelerations.csv");
    if is_blessing {
        std::fs::write(&file, &text).unwrap();
    }
    for (now, then) in recorded(&text).iter().zip(recorded(&std::fs::read_to_string(file).unwrap())) {
        for (now, then) in now.joints.iter().flatten().zip(then.joints.iter().flatten()) {
            assert!((now - then).abs() < 1e-9 * then.abs().max(1.0), "{now} instead of {then}");
        }
    }
}

fn close(found: f64, wanted: f64, what: &str) {
    assert!((found - wanted).abs() <= 1e-8 * wanted.abs(), "{what}: {found} instead of {wanted}");
}

/// A motor's braking is not in a URDF, and the numbers have as many digits as `import` writes.
#[test]
fn a_urdf_is_read_back_as_the_same_machine() {
    let names = ["single-quanser-ip02", "double-multiarm", "triple-glueck-eder-kugi", "quadruple-paper"];
    for name in names {
        let rig = rig(name);
        let text = urdf(&rig).unwrap();
        let back = Rig::from_toml(&rig_file(&text, "x.urdf").unwrap(), Path::new("x.toml")).unwrap();
        assert_eq!(back.name, rig.name);
        let (chain, again) = (rig.chain().unwrap(), back.chain().unwrap());
        close(again.cart.mass_kg.unwrap(), chain.cart.mass_kg.unwrap(), name);
        close(again.cart.friction_n_s_per_m, chain.cart.friction_n_s_per_m, name);
        assert_eq!(again.cart.travel_m, chain.cart.travel_m);
        assert_eq!(again.links.len(), chain.links.len());
        for (again, link) in again.links.iter().zip(&chain.links) {
            let numbers = |link: &Link| {
                let uniform = link.mass_kg * link.length_m.powi(2) / 12.0;
                let inertia = link.inertia_kg_m2.unwrap_or(uniform);
                [link.mass_kg, link.length_m, link.centre_m(), inertia, link.friction_n_m_s_per_rad]
            };
            numbers(again).iter().zip(numbers(link)).for_each(|(&again, link)| close(again, link, name));
        }
        let most = |rig: &Rig| rig.actuator.largest_force_n().unwrap_or_default();
        close(most(&back), most(&rig), name);
        assert_eq!(back.limits.speed_m_per_s, rig.limits.speed_m_per_s);
        let dry = |rig: &Rig| [0, 1].map(|joint| rig.reality.friction.joint_friction_n_m.of_joint(joint));
        assert_eq!(dry(&back), dry(&rig));
        // Negative control: without the tip, the last link's length is a guess.
        let untold = rig_file(&text.replace("\"tip\"", "\"flag\""), "x.urdf").unwrap();
        assert_eq!(untold.matches("missing: to the tip").count(), 1, "{untold}");
    }
}

#[test]
fn what_a_file_cannot_hold_is_said_in_it_or_refused() {
    let quanser = rig("single-quanser-ip02");
    for key in ["backlash_m = 1e-4", "latency_s = 1e-5", "eccentricity_rad = 0.01"] {
        let text = format!(
            "name = \"a -- b\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n[reality]\ncart_friction_n = 1\n{key}\n"
        );
        let rig = Rig::from_toml(&text, Path::new("x.toml")).unwrap();
        for model in [mjcf(&rig).unwrap(), urdf(&rig).unwrap()] {
            let left = format!("Not in this file, of [reality]: {}.", key.split_once(' ').unwrap().0);
            assert!(model.contains(&left) && model.contains("a __ b"), "{model}");
            assert!(roxmltree::Document::parse(&model).is_ok(), "{model}");
        }
    }
    // Negative control: nothing is left out of a machine that matches its model.
    assert!(!mjcf(&quanser).unwrap().contains("[reality]"));
    assert_eq!(urdf(&rig("single-stepper")), Err(NoModel::NoCartMass));
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let matrices = Rig::from_path(&root.join("examples/two-wheeler.toml")).unwrap();
    assert_eq!([mjcf(&matrices), urdf(&matrices)], [Err(NoModel::NoBodies), Err(NoModel::NoBodies)]);
}

#[test]
fn the_command_writes_what_it_is_asked_for_and_nothing_without() {
    let folder = tempfile::tempdir().unwrap();
    let [model, robot] = ["x.xml", "x.urdf"].map(|name| folder.path().join(name).display().to_string());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let file = root.join("rigs/single-quanser-ip02.toml").display().to_string();
    let run = |arguments: &[&str]| {
        output(Command::new(env!("CARGO_BIN_EXE_upright")).arg("export").args(arguments))
    };
    assert_eq!(run(&[&file]).status.code(), Some(2));
    let done = run(&[&file, "--mjcf", &model, "--urdf", &robot]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(std::fs::read_to_string(&model).unwrap(), mjcf(&rig("single-quanser-ip02")).unwrap());
    assert_eq!(std::fs::read_to_string(&robot).unwrap(), urdf(&rig("single-quanser-ip02")).unwrap());
    let stepper = root.join("rigs/single-stepper.toml").display().to_string();
    let refused = run(&[&stepper, "--mjcf", &model, "--urdf", &robot]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("mass_kg of [cart]"), "{refused:?}");
}
