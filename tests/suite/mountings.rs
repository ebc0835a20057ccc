//! Absolute sensors of the simulated rig, mounted in any way that a rig file may say: homing, balancing and the log of
//! a shaken rig are those of the same rig with encoders.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use proptest::prelude::*;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::Law;
use upright_closed_loop::harness::{Recording, record, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario, simulate};
use upright_design::table::{Gains, TableValues};
use upright_identify::{shake, shake_with};

use crate::published::{certified, rig_of};

/// How a joint is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mounting {
    /// An encoder with as many counts per turn as a sensor of these bits has.
    Encoder(u32),
    /// An absolute sensor: bits, reading while the links hang.
    Absolute(u32, u32),
    /// A potentiometer: bits, travel (rad), reading while the links hang.
    Potentiometer(u32, f64, u32),
}

impl Mounting {
    fn keys(self) -> String {
        match self {
            Self::Encoder(bits) => format!("encoder_counts_per_rev = {}", 1u32 << bits.min(16)),
            Self::Absolute(bits, zero) => format!("sensor_bits = {bits}\nsensor_zero_counts = {zero}"),
            Self::Potentiometer(bits, travel, zero) => {
                format!("sensor_bits = {bits}\nsensor_travel_rad = {travel}\nsensor_zero_counts = {zero}")
            }
        }
    }

    /// An encoder with the same steps.
    fn as_encoder(self) -> String {
        match self {
            Self::Encoder(bits) | Self::Absolute(bits, _) => Self::Encoder(bits).keys(),
            Self::Potentiometer(bits, travel, _) => {
                format!("encoder_step_rad = {:e}", travel / f64::from(1u32 << bits.min(16)))
            }
        }
    }
}

/// A rig file with these links, each with the keys of its sensor; `cart` has those of the cart.
fn text(cart: &str, links: &[String]) -> String {
    let links_text: String =
        links.iter().map(|keys| format!("[[link]]\nmass_kg = 0.15\nlength_m = 0.45\n{keys}\n")).collect();
    let joints = "100, 1, ".repeat(links.len());
    let noise = "1e-8, ".repeat(links.len());
    format!(
        "name = \"mounted\"\n[cart]\nmass_kg = 0.8\nencoder_step_m = 2e-5\n{cart}\ntravel_m = [-0.4, 0.4]\n{links_text}\
         [actuator]\nforce_limit_n = 15\n[lqr]\nstate_weights = [100, 1, {joints}]\nforce_weight = 0.1\n\
         [kalman]\nforce_noise_n2_s = 2e-4\njoint_noise = [{noise}]\n"
    )
}

/// The same machine with its sensors and with encoders; `None` if the reader refuses it.
fn rigs(cart_bits: Option<u32>, links: &[Mounting]) -> Option<[Rig; 2]> {
    let cart = cart_bits.map_or_else(String::new, |bits| format!("sensor_bits = {bits}"));
    let keys: Vec<String> = links.iter().map(|link| link.keys()).collect();
    let mounted = Rig::from_toml(&text(&cart, &keys), Path::new("rig.toml")).ok()?;
    let keys: Vec<String> = links.iter().map(|link| link.as_encoder()).collect();
    Some([mounted, rig_of(&text("", &keys))])
}

/// Their gain tables. The gains do not depend on the zeros, so that one design serves all of them.
fn tables(rigs: &[Rig; 2]) -> [TableValues; 2] {
    rigs.each_ref().map(|rig| TableValues::of(rig, certified(&rigs[1]), Gains::Sampled).unwrap())
}

fn mounting() -> impl Strategy<Value = Mounting> {
    prop_oneof![
        Just(Mounting::Encoder(12)),
        (prop::sample::select(vec![12u32, 14, 18]), any::<prop::sample::Index>())
            .prop_map(|(bits, zero)| Mounting::Absolute(bits, zero.index(1 << bits) as u32)),
        (prop::sample::select(vec![3.7, 5.0, 6.1]), any::<prop::sample::Index>())
            .prop_map(|(travel, zero)| Mounting::Potentiometer(12, travel, zero.index(1 << 12) as u32)),
    ]
}

fn run(rig: &Rig, table: &TableValues, scenario: &Scenario) -> Recording {
    with_firmware(table, |firmware| record(rig, table, scenario, firmware)).unwrap().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Wherever the rig is switched on and however its links turn after that.
    #[test]
    fn the_counts_of_any_mounting_are_those_of_an_encoder(
        link in mounting(),
        cart_bits in prop::option::of(12..17u32),
        counter_start: u32,
        start_rad in -30.0..30.0f64,
        moves in prop::collection::vec((-2.9..2.9f64, -0.03..0.03f64), 1..20),
    ) {
        let Some([mounted, encoders]) = rigs(cart_bits, &[link]) else {
            return Err(TestCaseError::reject("the reader refuses it"));
        };
        let mut state = vec![0.0, 0.0, start_rad, 0.0];
        let bench = |rig: &Rig| {
            let scenario = Scenario { start: state.clone(), counter_start, ..Scenario::at_rest(rig, Law::Lqr) };
            let bench = Bench::new(rig, &scenario).unwrap();
            let mut zero = [0; 2];
            bench.read_counters_at_zero(&mut zero);
            (bench, zero)
        };
        let mut both = [bench(&mounted), bench(&encoders)];
        let turn = mounted.sensors()[1].absolute.map_or(1 << 16, |range| range.turn);
        for (turned_rad, moved_m) in moves {
            state[0] += moved_m;
            state[2] += turned_rad;
            let read = both.each_mut().map(|(bench, zero)| {
                bench.hold(&state);
                let raw: [u32; 2] = bench.counters();
                [0, 1].map(|sensor| (raw[sensor], Bench::signed(sensor, raw[sensor].wrapping_sub(zero[sensor]))))
            });
            let [mounted, encoder] = read;
            prop_assert_eq!(mounted[0].1, encoder[0].1);
            if mounted[1].0 & BAD_SAMPLE == 0 {
                // A potentiometer has only the turn that it reads.
                let apart = match link {
                    Mounting::Potentiometer(..) => (mounted[1].1 - encoder[1].1).rem_euclid(turn.into()),
                    _ => mounted[1].1 - encoder[1].1,
                };
                prop_assert_eq!(apart, 0);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_mounting_is_homed_and_balances_as_an_encoder_does(
        links in prop::collection::vec(mounting(), 1..3),
        cart_bits in prop::option::of(12..17u32),
        counter_start: u32,
    ) {
        let Some(rigs) = rigs(cart_bits, &links) else {
            return Err(TestCaseError::reject("the reader refuses it"));
        };
        let scenario = |rig: &Rig| {
            let mut scenario = Scenario { duration_s: 1.0, counter_start, ..Scenario::at_rest(rig, Law::Lqr) };
            (scenario.start[2], scenario.step_m) = (0.004, 0.03);
            scenario
        };
        let tables = tables(&rigs);
        let both = [0, 1].map(|which| (&rigs[which], &tables[which], scenario(&rigs[which])));
        // The controller alone, homed at position 0: bit by bit.
        let [mounted, encoders] =
            both.each_ref().map(|(rig, table, scenario)| format!("{:?}", simulate(rig, table, scenario).unwrap().1));
        prop_assert_eq!(mounted, encoders);
        // The whole firmware, homed where the links hang.
        let [mounted, encoders] = both.each_ref().map(|(rig, table, scenario)| run(rig, table, scenario));
        prop_assert!(mounted.fault.is_none() && mounted.summary.survives(), "{:?} {}", mounted.fault, mounted.summary);
        // A potentiometer that is raised over its end has been rounded once more: it may be off by a count.
        if !links.iter().any(|link| matches!(link, Mounting::Potentiometer(..))) {
            prop_assert!(mounted.ticks == encoders.ticks);
        }
    }
}

/// Every kind of sensor, shaken: the same log as with an encoder, up to whole counts of rounding none at all.
#[test]
fn the_log_of_a_shaken_rig_begins_at_rest_and_is_that_of_an_encoder() {
    let shaken = |rig: &Rig| shake(rig, 4.0, 3).unwrap().deviations();
    let encoder = shaken(&rigs(None, &[Mounting::Encoder(12)]).unwrap()[1]);
    for zero in [0, 1, 228, 2047, 2048, 2049, 3000, 4095] {
        let [mounted, _] = rigs(Some(13), &[Mounting::Absolute(12, zero)]).unwrap();
        assert!(shaken(&mounted) == encoder, "{zero}");
    }
    // A potentiometer is shaken within what it reads.
    for zero in [458, 700, 2802, 3500] {
        let [mounted, _] = rigs(None, &[Mounting::Potentiometer(12, 5.0, zero)]).unwrap();
        let (angles, step) = (shaken(&mounted), 5.0 / 4096.0);
        let joint = || angles.iter().skip(1).step_by(2).map(|&counts| counts as f64 * step);
        assert_eq!(joint().next(), Some(0.0), "{zero}");
        let most = joint().fold(0.0, |most: f64, angle| most.max(angle.abs()));
        let room = mounted.sensors()[1].room_rad().unwrap();
        assert!(most > 0.15 && most < room.min(1.2), "{zero}: {most} of {room}");
    }
}

/// Beyond that, the motor would be turned off.
#[test]
fn the_firmware_shakes_a_rig_within_what_its_potentiometer_reads() {
    for (zero, seed) in [(458, 1), (458, 2), (3000, 1)] {
        let rigs = rigs(None, &[Mounting::Potentiometer(12, 5.0, zero)]).unwrap();
        let [table, _] = tables(&rigs);
        let shaken = with_firmware(&table, |target| shake_with(&rigs[0], &table, target, 5.0, seed)).unwrap();
        assert!(shaken.is_ok(), "{zero} {seed}: {}", shaken.unwrap_err());
    }
}

/// A property of the machine that changes while it runs does not turn its links.
#[test]
fn a_rig_that_is_built_again_counts_on() {
    let [rig, _] = &rigs(Some(14), &[Mounting::Absolute(12, 3000)]).unwrap();
    let scenario = Scenario { counter_start: 77, ..Scenario::at_rest(rig, Law::Lqr) };
    let mut bench = Bench::new(rig, &scenario).unwrap();
    for quarter in 1..=22 {
        bench.hold(&[0.01 * f64::from(quarter), 0.0, 0.25 * TAU * f64::from(quarter), 0.0]);
    }
    let before: [u32; 2] = bench.counters();
    let mut again = Bench::new(rig, &scenario).unwrap();
    again.take_over(&bench);
    assert_eq!(again.counters::<2>(), before);
    let (mut zero, mut zero_again) = ([0; 2], [0; 2]);
    bench.read_counters_at_zero(&mut zero);
    again.read_counters_at_zero(&mut zero_again);
    assert_eq!(zero, zero_again);
    // Negative control: it has turned further than a new rig would know.
    let turned = Bench::signed(1, before[1].wrapping_sub(zero[1])) as f64 * TAU / 4096.0;
    assert!((turned - 11.0 * PI).abs() < 0.01, "{turned}");
}
