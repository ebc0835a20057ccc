//! The firmware shakes the simulated machine, and its log is identified: on the host, and as the image that is flashed.

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Duration;

use upright::board::Output;
use upright::boards::DEFAULT_BOARD;
use upright::control::actuator::Drive;
use upright::protocol::message::Request;
use upright::protocol::tick_log::OFF;
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_board::Image;
use upright_closed_loop::harness::{
    Flow, HarnessError, Participant, Pins, Target, World, until, with_firmware,
};
use upright_design::design::design;
use upright_design::plant::ChainParameters;
use upright_design::reality::real_chain;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_identify::{
    Feed, LineError, Log, OverLine, ParameterKind, Settings, ShakingHost, checked_and_hanging, identify,
    shake_with,
};
use upright_tool::image::conditions;
use upright_tool::in_the_loop::{Compared, RunPlace, VirtualBoard, run_shaken};

use crate::equipment::built_for;
use crate::published::{first_hour, rig, rig_and_table, rig_and_table_with_motions};

const REALITY: &str = "[reality]\njoint_friction_n_m = [1.5e-3, 1e-3]\ncart_friction_n = 0.2\n\
    homing_error_rad = [0.006, -0.004]\nrail_tilt_rad = 0.003\nlatency_s = 4e-4\ncart_mass_percent = 8\n\
    link_mass_percent = [-9, 7]\nlink_length_percent = [5, -8]\nlink_inertia_percent = [10, -10]\n";

fn double() -> &'static (Rig, TableValues) {
    rig_and_table("double-quanser-dbpen")
}

/// The double pendulum as it begins to be shaken with the same forces for 20 s, and the host that does it.
fn shaken(target: &mut dyn Target) -> (World<'_>, ShakingHost) {
    static FEED: OnceLock<Feed> = OnceLock::new();
    let (machine, table) = double();
    let feed = FEED.get_or_init(|| Feed::new(machine, table, 20.0, 1).unwrap());
    begun(feed.clone(), machine, table, target, 1)
}

fn begun<'t>(
    feed: Feed,
    machine: &Rig,
    table: &TableValues,
    target: &'t mut dyn Target,
    seed: u64,
) -> (World<'t>, ShakingHost) {
    let mut world = checked_and_hanging(machine, table, target, seed).unwrap();
    let host = ShakingHost::begin(feed, machine, table, &mut world).unwrap();
    (world, host)
}

#[test]
fn the_log_of_the_firmware_gives_the_parameters_of_the_machine() {
    let path = PathBuf::from("../../rigs/double-quanser-dbpen.toml");
    let text = std::fs::read_to_string(&path).unwrap() + "\n" + REALITY;
    let machine = Rig::from_toml(&text, &path).unwrap();
    let table = TableValues::of(&machine, &design(&machine).unwrap(), Gains::Sampled).unwrap();
    let (file, _) = double();
    let log = run_shaken(&machine, &table, 15.0, 3, RunPlace::Host).unwrap();
    assert_eq!(log.lost(), 0);
    assert!(log.ticks().iter().any(|tick| tick.drive == OFF), "the motor goes off at the end");
    let settings = Settings { trust_wiring: true, ..Settings::default() };
    let found = identify(file, &[(PathBuf::from("run.log"), log)], &settings, &|_| ()).unwrap();
    assert_eq!(found.refusal, None);
    let chain = machine.chain().unwrap();
    let real = real_chain(chain, &machine.reality.parameters);
    let constants = ChainParameters::<f64>::of(&real);
    let close = |kind: ParameterKind, wanted: f64| {
        let estimate = found.estimate(kind).unwrap();
        let error = (estimate.new - wanted).abs();
        assert!(
            error < 3.0 * estimate.deviation,
            "{kind:?}: {} instead of {wanted}, {estimate:?}",
            estimate.new
        );
        assert!(estimate.deviation < 0.02 * wanted.abs().max(0.05), "{estimate:?}");
    };
    close(ParameterKind::TotalMass, constants.total_mass);
    close(ParameterKind::Length(0), real.links[0].length_m);
    for joint in 0..2 {
        close(ParameterKind::FirstMoment(joint), constants.a[joint]);
        close(ParameterKind::SecondMoment(joint), constants.b[(joint, joint)]);
        close(ParameterKind::Zero(joint), machine.reality.sensors.homing_error_rad.of_joint(joint));
    }
}

#[test]
fn the_flashed_image_is_shaken_with_the_bits_of_the_host() {
    // With its motions, so that this test and others share one image.
    let (machine, table) = rig_and_table_with_motions("single-quanser-ip02").clone();
    let Some(elf) = built_for(DEFAULT_BOARD, &machine, &table) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let mut board = VirtualBoard::start(&image, &conditions(DEFAULT_BOARD, 1).unwrap(), &table).unwrap();
    let log = with_firmware(&table, |host| {
        shake_with(&machine, &table, &mut Compared::new(&mut board, host), 3.0, 1).unwrap()
    });
    assert!(log.unwrap().ticks().len() > 2_000);
    // Other phases give another log.
    let log = |seed| run_shaken(&machine, &table, 3.0, seed, RunPlace::Host).unwrap();
    assert!(log(1) == log(1) && log(1) != log(2));
}

/// A defect of the inputs: changes what the firmware reads, given its inputs before the defect and the ticks since
/// then.
type Pinned = fn(&mut Pins, &Pins, u32);
/// A defect of the motor: what drives the cart instead of the firmware's command.
type Driven = fn(Drive) -> Drive;

const AS_IT_IS: Driven = |drive| drive;
const STUCK: Driven = |_| Drive::Duty(1.0);

/// The tick in which a defect begins.
const ONSET: usize = 2_500;

/// The host that shakes the rig, a defect from the onset on, and what it makes of the motor.
struct Disturbed {
    host: ShakingHost,
    pins: Pinned,
    motor: Driven,
    before: Option<Pins>,
    off: Option<usize>,
    on_again: bool,
    cart_m: f64,
}

impl Participant for Disturbed {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let Some(since) = world.ticks().checked_sub(ONSET) else {
            assert!(output.enable || self.host.log().ticks().len() < 20);
            return until(false);
        };
        if since == 0 {
            assert_eq!(world.session.status().state, State::Identifying);
        }
        if output.enable {
            output.drive = (self.motor)(output.drive);
            self.on_again |= self.off.is_some();
        } else if self.off.is_none() {
            (self.off, self.cart_m) = (Some(since + 1), world.bench.state()[0]);
        }
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        if let Some(since) = (world.ticks() + 1).checked_sub(ONSET) {
            let before = self.before.get_or_insert_with(|| pins.clone());
            (self.pins)(pins, before, since as u32);
        }
        Ok(())
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let is_content = self.host.feed(&mut world.session).is_ok();
        until(!is_content || self.off.is_some_and(|off| world.ticks() > ONSET + off + 200))
    }
}

/// Shakes the double pendulum for 2.5 s, then with a defect. Returns the fault, the ticks from the defect to motor
/// off, the position of the cart then (m), and whether the motor came on again.
fn defective(pins: Pinned, motor: Driven) -> (Option<Fault>, u32, f64, bool) {
    let run = with_firmware(&double().1, |target| {
        let (mut world, host) = shaken(target);
        let (before, off, on_again, cart_m) = (None, None, false, 0.0);
        let mut disturbed = Disturbed { host, pins, motor, before, off, on_again, cart_m };
        world.run(ONSET + 2_000, &mut [&mut disturbed]).unwrap();
        let off = disturbed.off.map_or(u32::MAX, |off| off as u32);
        (world.session.fault(), off, disturbed.cart_m, disturbed.on_again)
    });
    run.unwrap()
}

#[test]
fn no_defect_is_missed_while_the_rig_is_shaken() {
    type Case = (&'static str, Pinned, Driven, Fault, u32);
    let cases: [Case; 12] = [
        ("supply not a number", |pins, _, _| pins.supply_v = f32::NAN, AS_IT_IS, Fault::NotFinite, 1),
        (
            "emergency stop",
            |pins, _, tick| pins.contacts.emergency_stop = tick == 0,
            AS_IT_IS,
            Fault::EmergencyStop,
            1,
        ),
        ("driver", |pins, _, tick| pins.contacts.driver_fault = tick == 0, AS_IT_IS, Fault::Driver, 1),
        ("limit switch", |pins, _, _| pins.contacts.limit_high = true, AS_IT_IS, Fault::LimitSwitch, 1),
        ("clock", |pins, _, _| pins.contacts.clock_fault = true, AS_IT_IS, Fault::Clock, 1),
        ("board", |pins, _, _| pins.contacts.board_fault = true, AS_IT_IS, Fault::Board, 1),
        ("overruns", |pins, _, _| pins.contacts.overrun = true, AS_IT_IS, Fault::Overrun, 3),
        ("supply too high", |pins, _, _| pins.supply_v *= 1.4, AS_IT_IS, Fault::Supply, 3),
        (
            "cart's encoder frozen",
            |pins, before, _| pins.raw_counts[0] = before.raw_counts[0],
            AS_IT_IS,
            Fault::Frozen,
            1_200,
        ),
        (
            "a link's encoder frozen",
            |pins, before, _| pins.raw_counts[2] = before.raw_counts[2],
            AS_IT_IS,
            Fault::Frozen,
            1_800,
        ),
        (
            "a link's encoder jumps",
            |pins, _, _| pins.raw_counts[1] = pins.raw_counts[1].wrapping_add(300),
            AS_IT_IS,
            Fault::Encoder,
            1,
        ),
        ("motor stuck at full force", |_, _, _| (), STUCK, Fault::Speed, 400),
    ];
    for (name, pins, motor, wanted, most_ticks) in cases {
        let (fault, ticks, cart_m, on_again) = defective(pins, motor);
        assert_eq!(fault, Some(wanted), "{name}, {ticks} ticks");
        assert!(ticks <= most_ticks && !on_again, "{name}: {ticks} ticks");
        assert!(cart_m.abs() < 0.3, "{name}: the cart is at {cart_m} m");
    }
    // Negative control: without a defect nothing ends it.
    assert_eq!(defective(|_, _, _| (), AS_IT_IS), (None, u32::MAX, 0.0, false));
}

/// Counts the ticks with the motor on.
struct OnTicks(u32);

impl Participant for OnTicks {
    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.0 += u32::from(world.last_output().enable);
        until(false)
    }
}

#[test]
fn a_silent_host_and_the_stop_key_end_it() {
    let ended = |stop: bool| {
        with_firmware(&double().1, |target| {
            let (mut world, mut host) = shaken(target);
            world.run(ONSET, &mut [&mut host]).unwrap();
            if stop {
                world.session.send(Request::Disarm);
            }
            // No more forces are sent.
            let mut on = OnTicks(0);
            world.run(6_000, &mut [&mut on]).unwrap();
            (on.0, world.session.status().state, world.session.fault(), world.bench.state()[0])
        })
        .unwrap()
    };
    let (on, state, fault, _) = ended(true);
    assert!(on <= 3 && (state, fault) == (State::Calibrated, None), "{on} {state:?} {fault:?}");
    let (on, state, fault, _) = ended(false);
    assert!(
        (100..5_200).contains(&on) && (state, fault) == (State::Calibrated, None),
        "{on} {state:?} {fault:?}"
    );
}

/// Whether the firmware shakes the machine of `rig` to the end, with forces for the rig `file`.
fn is_shaken_to_the_end(rig: &Rig, file: &Rig, seconds: f64, seed: u64) -> bool {
    let table = crate::published::table(rig);
    let feed = Feed::new(file, &table, seconds, seed).unwrap();
    let outcome = with_firmware(&table, |target| {
        let (mut world, mut host) = begun(feed, rig, &table, target, seed);
        world.run(usize::MAX, &mut [&mut host]).unwrap();
        host.finish().unwrap();
        world.session.fault().is_none()
    });
    outcome.unwrap()
}

/// The carts of these seeds ran into the limits of the rail while the amplitude was that of the first 20 s, and rose
/// after every interval in which the links moved little.
#[test]
fn a_machine_is_shaken_for_as_long_as_it_is_asked_to() {
    let rigs = [rig("single-quanser-ip02"), first_hour(6.3)];
    for (rig, seconds, seed) in
        [(&rigs[0], 20.0, 2), (&rigs[0], 60.0, 3), (&rigs[1], 40.0, 1), (&rigs[1], 60.0, 2)]
    {
        assert!(is_shaken_to_the_end(rig, rig, seconds, seed), "{}, {seconds} s, seed {seed}", rig.name);
    }
    // Negative control: forces for a rail that is twice as long.
    let mut longer = rigs[0].clone();
    longer.chain_mut().unwrap().cart.travel_m = [-0.8, 0.8];
    assert!(!is_shaken_to_the_end(&rigs[0], &longer, 20.0, 2));
}

/// Before the motor's force followed its speed within a tick, 0.985 kg were found.
#[test]
fn the_rig_of_the_first_hour_is_found_to_weigh_what_its_file_says() {
    let rig = first_hour(6.3);
    let table = crate::published::table(&rig);
    for seed in [1, 2] {
        let log = run_shaken(&rig, &table, 20.0, seed, RunPlace::Host).unwrap();
        let settings = Settings { trust_wiring: true, ..Settings::default() };
        let found = identify(&rig, &[(PathBuf::from("run.log"), log)], &settings, &|_| ()).unwrap();
        let mass = found.estimate(ParameterKind::TotalMass).unwrap();
        let off = (mass.new - rig.chain().unwrap().total_mass_kg()) / mass.deviation;
        assert!(off.abs() < 2.5 && mass.deviation < 2e-3, "seed {seed}: {mass:?}");
    }
}

/// Counts the bytes on the line: all, and the most in a tick.
struct LineBytes([usize; 2]);

impl Participant for LineBytes {
    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let sent = world.session.last_bytes().len();
        self.0 = [self.0[0] + sent, self.0[1].max(sent)];
        until(false)
    }
}

#[test]
fn the_log_of_four_links_fits_the_line() {
    let (machine, table) = rig_and_table("quadruple-paper").clone();
    let log = with_firmware(&table, |target| {
        let feed = Feed::new(&machine, &table, 5.0, 1).unwrap();
        let (mut world, mut host) = begun(feed, &machine, &table, target, 1);
        let mut line = LineBytes([0; 2]);
        world.run(2_000, &mut [&mut host, &mut line]).unwrap();
        assert_eq!((host.log().lost(), world.ticks()), (0, 2_000));
        // 10 bits per byte at 460 800 Bd.
        let per_second = f64::from(line.0[0] as u32) / 2.0;
        assert!((13_000.0..0.6 * 46_080.0).contains(&per_second), "{per_second} bytes per second");
        println!("{per_second} bytes per second with telemetry");
        host.log().clone()
    });
    let log: Log = log.unwrap();
    assert!(log.ticks().len() > 1_900);
}

/// The double pendulum, ready to be shaken, and a host at the other end of its line, which loses the bytes of the ticks
/// for which `is_lost` holds. Returns the log, and the ticks with the motor on after the host has ended.
fn over_line(host: &(Rig, TableValues), is_lost: fn(u32) -> bool) -> (Result<Log, LineError>, u32) {
    let (machine, table) = double();
    with_firmware(table, |target| {
        let mut world = checked_and_hanging(machine, table, target, 1).unwrap();
        let since_1970 = |tick: u32| {
            Duration::from_secs(1_800_000_000)
                + Duration::from_secs_f64(f64::from(tick) * machine.tick.period_s)
        };
        let mut line = OverLine::new(&host.0, &host.1, 5.0, 1, since_1970(0)).unwrap();
        let (mut ended, mut on) = (None, 0);
        for tick in 0..20_000 {
            let now = since_1970(tick);
            if ended.is_none() {
                let done = line.poll(now);
                let arrived = if is_lost(tick) { Vec::new() } else { line.take_outgoing() };
                world.session.send_bytes(&arrived);
                ended = done.err().map(Err).or_else(|| line.is_over().then_some(Ok(())));
            }
            let inputs = world.inputs();
            let output = world.session.tick(&inputs).unwrap();
            on += u32::from(ended.is_some() && output.enable);
            world.bench.tick(if output.enable { output.drive } else { Drive::Force(0.0) });
            if ended.is_none() && !is_lost(tick) {
                ended = line.receive(world.session.last_bytes(), now).err().map(Err);
            }
            world.session.forget_received();
        }
        let ended = ended.expect("it ends");
        (ended.and_then(|()| Ok(line.finish()?)), on)
    })
    .unwrap()
}

#[test]
fn a_machine_behind_a_line_is_shaken_and_logged_and_hangs_with_the_motor_off_when_the_line_is_cut() {
    let (log, on) = over_line(double(), |_| false);
    let log = log.unwrap();
    assert_eq!((log.lost(), on), (0, 0));
    let seconds =
        log.ticks().iter().filter(|tick| tick.drive != OFF).count() as f64 * double().0.tick.period_s;
    assert!((6.2..10.0).contains(&seconds), "{seconds} s");
    // Requests and forces that are lost now and then are sent again, or their ticks are left to spring and damper.
    let (log, on) = over_line(double(), |tick| tick % 97 < 2);
    assert_eq!((log.is_ok(), on), (true, 0));
    // The host gives up; by then the cart is back.
    let (cut, on) = over_line(double(), |tick| tick > 2_000);
    assert!(matches!(cut, Err(LineError::Silent)) && on < 5_000, "{on}");
}

#[test]
fn a_machine_that_is_not_the_files_or_is_not_checked_is_not_shaken() {
    let other = rig_and_table("single-quanser-ip02");
    let (refused, on) = over_line(other, |_| false);
    assert!(matches!(refused, Err(LineError::Harness(HarnessError::Mismatch(_)))) && on == 0);
    let (machine, table) = double();
    let refused = with_firmware(table, |target| {
        let scenario = Scenario::at_rest(machine, Law::Lqr);
        let mut world = World::new(machine, table, &scenario, target).unwrap();
        let mut line = OverLine::new(machine, table, 5.0, 1, Duration::from_secs(1)).unwrap();
        (0..1_000).find_map(|tick| {
            let now = Duration::from_secs(1) + Duration::from_millis(tick);
            line.poll(now).unwrap();
            world.session.send_bytes(&line.take_outgoing());
            let inputs = world.inputs();
            world.session.tick(&inputs).unwrap();
            line.receive(world.session.last_bytes(), now).err()
        })
    });
    let refused = refused.unwrap().expect("it is refused").to_string();
    assert!(refused.contains("home first") && refused.contains("firmware monitor"), "{refused}");
}
