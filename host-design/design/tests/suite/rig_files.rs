//! Good rig files: the ones in `rigs/`, the defaults, the hash and the description.

use std::path::{Path, PathBuf};

use upright_design::plant::MotorPlant;
use upright_design::rig::{
    Absent, Actuator, Base, Cart, CartInput, Chain, Limits, Link, LinkEncoder, PlantDescription,
    PolePlacement, Rig, SECTIONS, TOP, Tick, TurnErrors, defaults, key_table, unit_in_names,
};

const MINIMAL: &str = r#"
name = "minimal"
[cart]
mass_kg = 1
[[link]]
mass_kg = 0.5
length_m = 0.4
"#;

fn parse(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("test.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn rig_files() -> Vec<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
    let mut files: Vec<_> = std::fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    files
}

#[test]
fn every_rig_file_is_good_and_named_after_its_rig() {
    let files = rig_files();
    assert!(files.len() >= 4, "{files:?}");
    for file in files {
        let rig = Rig::from_path(&file).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.file_stem().unwrap().to_str().unwrap(), rig.name);
        assert!(rig.lqr.is_some());
        assert!(rig.pole_placement.is_some() || rig.actuator.held().is_motion());
        assert!(rig.kalman.is_some() || matches!(rig.plant, PlantDescription::Model(_)));
    }
}

#[test]
fn the_paper_rig_has_the_papers_values() {
    let rig = Rig::from_path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/quadruple-paper.toml"))
        .unwrap();
    let chain = rig.chain().unwrap();
    assert_eq!(chain.cart.mass_kg, Some(0.1));
    assert_eq!(chain.links.iter().map(|link| link.length_m).collect::<Vec<_>>(), [0.03, 0.04, 0.07, 0.10]);
    assert!(chain.links.iter().all(|link| link.mass_kg == 0.1 && link.inertia_kg_m2.is_none()));
    assert_eq!(rig.states(), 10);
    assert_eq!(
        rig.pole_placement,
        Some(PolePlacement::Response {
            overshoot_percent: 1.0,
            settling_time_s: 6.0,
            far_poles: vec![-40.0, -41.0, -42.0, -43.0, -44.0, -45.0, -46.0, -47.0],
        })
    );
}

#[test]
fn what_is_left_out_gets_its_documented_default() {
    let link = Link {
        sensor_delay_s: 0.0,
        radius_m: 0.0,
        axial_inertia_kg_m2: 0.0,
        part: None,
        errors: TurnErrors::default(),
        mass_kg: 0.5,
        length_m: 0.4,
        centre_of_mass_m: None,
        inertia_kg_m2: None,
        friction_n_m_s_per_rad: 0.0,
        encoder: None,
    };
    let cart = Cart {
        mass_kg: Some(1.0),
        friction_n_s_per_m: 0.0,
        travel_m: [-2.0, 2.0],
        encoder_step_m: None,
        sensor_bits: None,
        sensor_noise_m: 0.0,
    };
    let expected = Rig {
        verify: Default::default(),
        must_survive: Vec::new(),
        reality: Default::default(),
        robust: None,
        swing_up: None,
        name: "minimal".to_owned(),
        plant: PlantDescription::Chain(Chain {
            cart,
            base: Base::Cart,
            links: vec![link],
            gravity_m_per_s2: 9.81,
            input: CartInput::Force,
        }),
        actuator: Actuator::default(),
        tick: Tick { period_s: 0.001, delay_ticks: 0 },
        lqr: None,
        pole_placement: None,
        kalman: None,
        integral: None,
        friction: None,
        limits: Limits::default(),
    };
    assert_eq!(parse(MINIMAL), expected);
}

#[test]
fn defaults_of_the_motor() {
    let motor = "[actuator]\ntorque_constant_n_m_per_a = 0.01\nresistance_ohm = 1\npulley_radius_m = 0.01\nsupply_v = 12\n";
    let motor = parse(&format!("{MINIMAL}{motor}")).actuator.motor().unwrap().clone();
    assert_eq!((motor.gear_ratio, motor.dead_zone_v, motor.slew_v_per_s), (1.0, 0.0, None));
}

/// A published machine: 0.1336 N·m/A and 0.2842 V·s/rad at a pulley of 19.8 mm, 12 V.
#[test]
fn torque_and_back_emf_constants_may_differ() {
    let motor = |more: &str| {
        let data = "torque_constant_n_m_per_a = 0.1336\nresistance_ohm = 10.692\npulley_radius_m = 0.0198\nsupply_v = 12\n";
        parse(&format!("{MINIMAL}[actuator]\n{data}{more}")).actuator.motor().unwrap().clone()
    };
    let close = |x: f64, wanted: f64| assert!((x / wanted - 1.0).abs() < 1e-3, "{x} instead of {wanted}");
    let real = motor("back_emf_constant_v_s_per_rad = 0.2842\n");
    close(real.volts_per_speed(), 14.35);
    close(real.stall_force_n(), 7.573);
    close(real.newtons_per_amp(), 6.747);
    // With one constant for both, as without the key, the back-EMF is half of the real one.
    close(motor("").volts_per_speed(), 6.747);
    // Losses in the gear take force, not back-EMF.
    let lossy = motor("back_emf_constant_v_s_per_rad = 0.2842\nefficiency = 0.8\n");
    close(lossy.stall_force_n(), 0.8 * 7.573);
    close(lossy.braking_n_s_per_m(), 0.8 * 6.747 * 14.35 / 10.692);
    close(lossy.volts_per_speed(), 14.35);
}

/// v' = -a v - c sign(v) + b V with the a, b and c that github.com/zjor/inverted-pendulum found, and 0.5 kg in motion.
#[test]
fn a_motor_that_is_known_by_its_motion_is_described_by_one_newton_per_ampere() {
    let (a, b, c, mass) = (35.98, 2.22, 2.79, 0.5);
    let text = format!(
        "{MINIMAL}[actuator]\nresistance_ohm = {}\npulley_radius_m = 0.01\ntorque_constant_n_m_per_a = 0.01\n\
         back_emf_constant_v_s_per_rad = {}\ndead_zone_v = {}\nsupply_v = 12\n",
        1.0 / (mass * b),
        0.01 * a / b,
        c / b
    );
    let rig = parse(&text);
    assert_eq!(rig.unusual_values(), []);
    let motor = rig.actuator.motor().unwrap();
    assert!((motor.newtons_per_amp() - 1.0).abs() < 1e-12);
    let plant = MotorPlant::of(motor);
    for (duty, speed) in [(1.0, 0.0), (0.5, 0.3), (-0.75, -0.2)] {
        let wanted = mass * (b * duty * 12.0 - a * speed - c * f64::signum(duty));
        assert!((plant.force(duty, speed) - wanted).abs() < 1e-12, "duty {duty} at {speed} m/s");
    }
    let close = |x: f64, wanted: f64| assert!((x / wanted - 1.0).abs() < 5e-5, "{x} instead of {wanted}");
    close(motor.stall_force_n(), 13.32);
    close(plant.force(1.0, 0.0), 11.925);
    close(motor.volts_per_speed(), 16.207);
}

#[test]
fn values_of_another_unit_are_doubted_and_those_of_the_benches_are_not() {
    let sentences = |rig: &Rig| rig.unusual_values().iter().map(ToString::to_string).collect::<Vec<_>>();
    let unusual = |from: &str, to: &str| sentences(&parse(&MINIMAL.replace(from, to)));
    assert_eq!(parse(MINIMAL).unusual_values(), []);
    let length = unusual("length_m = ", "length_m = 100");
    assert!(matches!(&length[..], [doubt] if doubt.starts_with("link[1].length_m = 100")), "{length:?}");
    for rig in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs")).unwrap() {
        let path = rig.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "toml") {
            assert_eq!(Rig::from_path(&path).unwrap().unusual_values(), [], "{}", path.display());
        }
    }
    let pulley = "[actuator]\ntorque_constant_n_m_per_a = 0.01\nresistance_ohm = 1\npulley_radius_m = 6.35\nsupply_v = 12\n";
    let doubts = sentences(&parse(&format!("{MINIMAL}{pulley}")));
    assert!(doubts[0].contains("pulley_radius_m = 6.35 m") && doubts[1].contains("m/s"), "{doubts:?}");
}

/// A motor rig and a stepper's, whose every number has the usual size.
const MOTOR_RIG: &str = "name = \"m\"\n[cart]\nmass_kg = 0.8\nencoder_step_m = 2e-5\ntravel_m = [-0.4, 0.4]\n\
    [[link]]\nmass_kg = 0.15\nlength_m = 0.45\nencoder_step_rad = 0.0015\n[actuator]\nforce_limit_n = 15\n\
    torque_constant_n_m_per_a = 0.01\nresistance_ohm = 2\npulley_radius_m = 0.01\nsupply_v = 12\n\
    [tick]\nperiod_s = 0.001\n[limits]\nspeed_m_per_s = 1.2\n";
const STEPPER_RIG: &str = "name = \"s\"\n[cart]\n[[link]]\nmass_kg = 0.15\nlength_m = 0.45\n[actuator]\n\
    kind = \"acceleration\"\nacceleration_limit_m_per_s2 = 10\nstep_m = 2e-5\nspeed_limit_m_per_s = 1\n";

#[test]
fn a_number_in_a_unit_that_is_wrong_by_a_thousand_is_doubted_with_its_key_and_line() {
    for (text, line, key) in [
        (MOTOR_RIG, "mass_kg = 0.8", "cart.mass_kg"),
        (MOTOR_RIG, "encoder_step_m = 2e-5", "cart.encoder_step_m"),
        (MOTOR_RIG, "mass_kg = 0.15", "link[1].mass_kg"),
        (MOTOR_RIG, "length_m = 0.45", "link[1].length_m"),
        (MOTOR_RIG, "encoder_step_rad = 0.0015", "link[1].encoder_step_rad"),
        (MOTOR_RIG, "force_limit_n = 15", "actuator.force_limit_n"),
        (MOTOR_RIG, "torque_constant_n_m_per_a = 0.01", "actuator.torque_constant_n_m_per_a"),
        (MOTOR_RIG, "resistance_ohm = 2", "actuator.resistance_ohm"),
        (MOTOR_RIG, "pulley_radius_m = 0.01", "actuator.pulley_radius_m"),
        (MOTOR_RIG, "supply_v = 12", "actuator.supply_v"),
        (MOTOR_RIG, "period_s = 0.001", "tick.period_s"),
        (MOTOR_RIG, "speed_m_per_s = 1.2", "limits.speed_m_per_s"),
        (STEPPER_RIG, "acceleration_limit_m_per_s2 = 10", "actuator.acceleration_limit_m_per_s2"),
        (STEPPER_RIG, "step_m = 2e-5", "actuator.step_m"),
        (STEPPER_RIG, "speed_limit_m_per_s = 1", "actuator.speed_limit_m_per_s"),
    ] {
        assert_eq!(parse(text).unusual_values(), []);
        let (name, value) = line.split_once(" = ").unwrap();
        let value: f64 = value.parse().unwrap();
        let doubted = [1e3, 1e-3].map(|factor| {
            let changed = text.replacen(line, &format!("{name} = {:e}", factor * value), 1);
            let found = parse(&changed).unusual_values();
            let found = found.iter().find(|found| found.key == key);
            let wanted = changed
                .lines()
                .position(|found| found.starts_with(&format!("{name} = {:e}", factor * value)));
            found
                .map(|found| assert_eq!(found.line(&changed), wanted.map(|line| line + 1), "{key}"))
                .is_some()
        });
        // A tick of 1 µs is refused, and some are usual in one direction.
        assert!(doubted.contains(&true), "{key}");
    }
    // As given by those who found that nothing was said.
    for (line, wrong) in [
        ("period_s = 0.001", "period_s = 2"),
        ("resistance_ohm = 2", "resistance_ohm = 2200"),
        ("resistance_ohm = 2", "resistance_ohm = 0.0022"),
        ("force_limit_n = 15", "force_limit_n = 10000"),
        ("encoder_step_m = 2e-5", "encoder_step_m = 0.0167"),
        ("speed_m_per_s = 1.2", "speed_m_per_s = 1200"),
        ("mass_kg = 0.15", "mass_kg = 100"),
        ("encoder_step_rad = 0.0015", "encoder_step_rad = 0.15"),
    ] {
        let doubts = parse(&MOTOR_RIG.replacen(line, wrong, 1)).unusual_values();
        assert!(doubts.iter().any(|doubt| doubt.to_string().contains("usual")), "{wrong}");
    }
}

#[test]
fn defaults_of_a_model() {
    let PlantDescription::Model(model) = parse("name = \"m\"\nmodel = { a = [[1]], b = [2] }\n").plant else {
        panic!("not a model")
    };
    assert_eq!((model.a, model.b), (vec![vec![1.0]], vec![2.0]));
    assert_eq!((model.output, model.measured, model.measured_steps), (0, vec![0], vec![]));
    assert_eq!(model.noise_input, None);
}

#[test]
fn encoders_by_step_or_by_counts() {
    let of = |line: &str| match parse(&format!("{MINIMAL}{line}\n")).plant {
        PlantDescription::Chain(chain) => chain.links[0].encoder,
        PlantDescription::Model(_) => None,
    };
    assert_eq!(of("encoder_step_rad = 0.001"), Some(LinkEncoder::StepRad(0.001)));
    assert_eq!(of("encoder_counts_per_rev = 4096"), Some(LinkEncoder::CountsPerRev(4096.0)));
}

#[test]
fn complex_poles_come_in_any_order() {
    let poles = "[pole_placement]\npoles = [[-1, 2], [-3, 0], [-1, 2], [-1, -2]]\n";
    let error = Rig::from_toml(&format!("{MINIMAL}{poles}"), Path::new("x")).unwrap_err();
    assert_eq!(error.key.as_deref(), Some("pole_placement.poles[3]"), "{error}");
    parse(&format!("{MINIMAL}{}", poles.replace("[-3, 0]", "[-1, -2]")));
}

#[test]
fn the_hash_sees_values_only() {
    let hash = parse(MINIMAL).hash();
    for same in [
        "# a comment\nname = 'minimal'\nlink = [{ length_m = 0.4, mass_kg = 5e-1 }]\n\n\n[cart]\nmass_kg = 1.0",
        "cart.mass_kg = 1.00\r\nname = \"minimal\"\r\n[[link]]\r\nlength_m = 0.40 # m\r\nmass_kg = 0.5\r\n",
        &format!("{MINIMAL}[tick]\nperiod_s = 0.001\ndelay_ticks = 0\n"),
        &format!("{MINIMAL}friction_n_m_s_per_rad = -0.0\n"),
    ] {
        assert_eq!(parse(same).hash(), hash, "{same}");
    }
}

/// Changing the last digit of any number in any rig file changes the hash.
#[test]
fn the_hash_sees_every_value() {
    for file in rig_files() {
        let text = std::fs::read_to_string(&file).unwrap();
        let rig = parse(&text);
        if matches!(rig.plant, PlantDescription::Model(_)) {
            continue; // its matrix spans several lines
        }
        let hash = rig.hash();
        let mut changed = 0;
        // What `upright verify` asks for, the machine's imperfections and the limits of plans are not part of the hash.
        let counted =
            ["[verify]", "[reality]", "[swing_up]"].iter().filter_map(|section| text.find(section)).min();
        let counted = &text[..counted.unwrap_or(text.len())];
        for (index, line) in
            counted.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with('#'))
        {
            let Some((key, value)) = line.split('#').next().unwrap_or_default().split_once('=') else {
                continue;
            };
            if key.trim() == "kind" {
                continue; // another kind has other keys
            }
            let value = if key.trim() == "name" {
                value.replacen('"', "\"x", 1)
            } else if key.trim() == "delay_ticks" {
                "1".to_owned()
            } else if key.trim() == "sensor" {
                "\"mt6701\"".to_owned()
            } else if key.trim() == "sensor_bits" || key.trim() == "sensor_zero_counts" {
                "15".to_owned()
            } else {
                let last = value.rfind(|c: char| c.is_ascii_digit()).unwrap();
                let exponent =
                    value[..last].rfind(['e', ' ', '[']).is_some_and(|at| value[at..].starts_with('e'));
                // Adds a digit to the number, not to its exponent.
                let (at, digit) = if exponent { (value.rfind('e').unwrap(), "") } else { (last + 1, "") };
                let point = value[..at].rfind([' ', '[']).is_some_and(|start| value[start..at].contains('.'));
                format!("{}{}{digit}{}", &value[..at], if point { "1" } else { ".01" }, &value[at..])
            };
            let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
            lines[index] = format!("{key}={value}");
            assert_ne!(parse(&lines.join("\n")).hash(), hash, "{}: {}", file.display(), lines[index]);
            changed += 1;
        }
        assert!(changed > 15);
    }
}

/// The hash is stored in gain tables, so it must not change from one build to the next. (It does change, rightly, when
/// the rig gets a new field.)
#[test]
fn the_hash_of_the_minimal_rig_is_fixed() {
    assert_eq!(format!("{:016x}", parse(MINIMAL).hash()), "38c880ab2d7c81d4");
}

#[test]
fn the_description_fits_the_screen_and_marks_defaults() {
    for file in rig_files() {
        let text = Rig::from_path(&file).unwrap().describe();
        for line in text.lines() {
            assert!(line.chars().count() < 80, "{line}");
        }
    }
    let text = parse(MINIMAL).describe();
    let line = |start: &str| text.lines().find(|line| line.trim_start().starts_with(start)).unwrap();
    assert!(
        line("centre of mass").contains("0.2 m") && line("centre of mass").contains("(default)"),
        "{text}"
    );
    assert!(line("inertia").contains("0.00666667 kg·m²") && line("inertia").contains("(default)"), "{text}");
    assert!(line("total mass").contains("1.5 kg") && !line("total mass").contains("default"), "{text}");
}

#[test]
fn the_description_of_a_motor_has_its_largest_force() {
    let rig =
        Rig::from_path(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/single-quanser-ip02.toml"))
            .unwrap();
    let text = rig.describe();
    // 3.71 * 0.00767 N·m/A * 10 V / (2.6 ohm * 0.00635 m)
    assert!(text.contains("17.2354 N"), "{text}");
}

/// The part of `docs/rig-file.md` between the markers.
fn documented_keys(page: &str) -> &str {
    let (_, rest) = page.split_once("<!-- keys -->\n").expect("no marker <!-- keys -->");
    rest.split_once("<!-- /keys -->").expect("no marker <!-- /keys -->").0.trim()
}

#[test]
fn the_documented_keys_are_those_of_the_code() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/rig-file.md");
    let page = std::fs::read_to_string(page).unwrap().replace("\r\n", "\n");
    let remedy = "paste what `upright check --keys` prints between the markers of docs/rig-file.md";
    assert_eq!(documented_keys(&page), key_table().trim(), "{remedy}");
    let changed = page.replacen("| `arm_rate_rad_per_s` |", "| `arm_rate` |", 1);
    assert_ne!(documented_keys(&changed), key_table().trim());
}

/// Units are part of the names: the unit of a row matches the end of its name.
#[test]
fn names_of_keys_end_in_their_unit() {
    let ends_in_unit = |name: &str, unit: &str| name.ends_with(&unit_in_names(unit));
    for key in SECTIONS.iter().flat_map(|section| section.keys()) {
        // Lists of poles and encoder counts give their unit in words.
        if !["1/s", "counts/rev"].contains(&key.unit) {
            assert!(ends_in_unit(key.name, key.unit), "{} is not in {}", key.name, key.unit);
        }
    }
    assert!(ends_in_unit("arm_rate_rad_per_s", "rad/s") && !ends_in_unit("arm_rate_rad_per_s", "m/s"));
    assert!(ends_in_unit("inertia_kg_m2", "kg·m²") && !ends_in_unit("inertia_kg_m2", "kg·m"));
}

/// Every key of a good file is in the table, and an unknown key is refused.
#[test]
fn the_table_has_every_key_of_every_rig_file() {
    for file in rig_files() {
        let text = std::fs::read_to_string(&file).unwrap();
        let base = if text.contains("[arm]") { Base::Arm } else { Base::Cart };
        let mut section = &TOP;
        for line in text.lines().map(str::trim) {
            if line.starts_with('[') && !line.contains(',') {
                let title = line.split('#').next().unwrap_or_default().trim().replace("[arm]", "[cart]");
                section = SECTIONS.iter().find(|section| section.title == title).unwrap();
            } else if let Some((name, _)) = line.split_once(" = ").filter(|_| !line.starts_with('#')) {
                let known = section.keys().any(|key| base.name(section.name, key.name) == name);
                assert!(known, "{}: {name} in {}", file.display(), section.title);
            }
        }
    }
    assert!(TOP.keys().all(|key| key.name != "mass_kg"));
}

/// The shares stated in the table of keys are those with which the gain table is made.
#[test]
fn shares_in_words_are_those_in_use() {
    let limits = SECTIONS.iter().find(|section| section.name == "limits").unwrap();
    let says = |name: &str, share: f64| {
        let key = limits.keys().find(|key| key.name == name).unwrap();
        let Absent::Follows(words) = key.absent else { panic!("{name} has no default in words") };
        words.starts_with(&format!("{} %", 100.0 * share))
    };
    assert!(says("rail_margin_m", defaults::RAIL_MARGIN_SHARE) && !says("rail_margin_m", 0.1));
    assert!(says("travel_tolerance_m", defaults::TRAVEL_TOLERANCE_SHARE));
    assert!(says("supply_min_v", defaults::SUPPLY_SHARE));
    assert!(says("arm_angle_rad", defaults::ARM_ANGLE_SHARE));
}

#[test]
fn rows_of_the_description_have_names_of_their_own() {
    for file in rig_files() {
        let text = Rig::from_path(&file).unwrap().describe();
        for block in text.split("\n\n") {
            // A name takes the first 26 columns; a list continues below an empty one.
            let names: Vec<String> = block
                .lines()
                .map(|line| line.chars().skip(2).take(26).collect::<String>().trim().to_owned())
                .filter(|name| !name.is_empty())
                .collect();
            for (index, name) in names.iter().enumerate() {
                assert!(!names[..index].contains(name), "{}: {name} twice", file.display());
            }
        }
    }
}
