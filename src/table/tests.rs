//! The checksum guards every bit of a table, in every field.

use std::format;
use std::string::String;
use std::vec::Vec;

use nalgebra::{SMatrix, SVector};

use super::*;

const LIMITS: Limits = Limits {
    rail_m: [-1.0, 1.0],
    angle_rad: 0.35,
    speed_m_per_s: 2.0,
    jog_force_n: 1.5,
    supply_min_v: 9.0,
    supply_ticks: 2,
    saturated_ticks: 3,
    link_ticks: 4,
    arm_angle_rad: 0.05,
    arm_ticks: 5,
    still_ticks: 6,
    travel_counts: [2000, 20],
    middle_counts: 7,
};

const THRESHOLDS: Thresholds<2> = Thresholds {
    innovation: [0.1, 0.2],
    frozen: [0.3, 0.4],
    push: [0.5, 0.6],
    motor: MotorTest { a: [1.0, 2.0, 3.0, 4.0], b: [5.0, 6.0], ratio: 0.5, energy: 7.0 },
};

/// The cart's sensor and a link's, an absolute one.
fn sensors(next: &mut impl FnMut() -> f32) -> [SensorRow; 2] {
    let kinds = [SensorKind::Counter, SensorKind::Absolute(ReadingMap { bits: 12, zero_counts: 17 })];
    let row = |sensor: usize| SensorRow {
        state: 2 * sensor as u32,
        kind: kinds[sensor],
        step: next(),
        delay_s: next(),
        turn_counts: [0, 4096][sensor],
        rest_counts: [0, 2048][sensor],
        sign_counts: [50, 130][sensor],
        slow_counts: [8, 9][sensor],
        still_counts: [1, 3][sensor],
    };
    core::array::from_fn(row)
}

/// A model of two links.
fn model(next: &mut impl FnMut() -> f32) -> ChainModel<2> {
    ChainModel {
        inverse_mass: next(),
        a: SVector::from_fn(|_, _| next()),
        weight: SVector::from_fn(|_, _| next()),
        b: SMatrix::from_fn(|_, _| next()),
        b_reduced: SMatrix::from_fn(|_, _| next()),
        reaction: SVector::from_fn(|_, _| next()),
        cart_friction: next(),
        joint_frictions: SVector::from_fn(|_, _| next()),
        turning: Some(Turning { beta: SMatrix::from_fn(|_, _| next()), reaction: next() }),
    }
}

/// A table with every optional part, all numbers different.
fn full() -> GainTable<4, 2> {
    let mut number = 0.5;
    let mut next = || {
        number += 0.25;
        number
    };
    let laws = PerLaw::from_fn(|_| {
        Some(LawGains {
            k: SVector::from_fn(|_, _| next()),
            k_pending: next(),
            k_integral: next(),
            n: next(),
            setpoint_step: next(),
        })
    });
    let mut table = GainTable {
        format: TABLE_FORMAT,
        dimensions: [4, 2],
        output: 0,
        rig_hash: 0x0123_4567_89ab_cdef,
        tick_s: 0.01,
        sensors: sensors(&mut next),
        drive: DriveMap::Volts(MotorMap {
            force: ForceMap { limit_n: next(), late: Late { acts: 0.75, stays: 0.5 } },
            volts_per_newton: next(),
            volts_per_speed: next(),
            dead_zone_v: next(),
            slew_v_per_tick: next(),
            supply_v: next(),
        }),
        laws,
        observer: Some(ObserverGains {
            ad: SMatrix::from_fn(|_, _| next()),
            bd: SVector::from_fn(|_, _| next()),
            l: SMatrix::from_fn(|_, _| next()),
        }),
        friction: Some(FrictionMap {
            axes: SMatrix::from_fn(|_, _| next()),
            effect: SMatrix::from_fn(|_, _| next()),
        }),
        limits: LIMITS,
        thresholds: THRESHOLDS,
        stilling: Some(StillingGains {
            after_fall_ticks: 2000,
            stiffness: next(),
            damping: next(),
            most_n: [next(), next()],
            friction_n: next(),
            imitated: Some(ImitatedBase { taken: [next(), next()], model: model(&mut next) }),
            braking_m_per_s2: next(),
            speed_m_per_s: next(),
            rail_m: [-1.25, 1.25],
        }),
        crc: 0,
    };
    table.crc = table.checksum();
    table
}

/// Number of words in each leaf of a part; `None` for words that cannot be changed.
fn sizes(part: &mut impl Part) -> Vec<Option<usize>> {
    let size = |leaf: usize| match part.part_mut(&mut { leaf })? {
        WordsMut::F32(values) => Some(Some(values.len())),
        WordsMut::U32(values) => Some(Some(values.len())),
        WordsMut::I32(values) => Some(Some(values.len())),
        WordsMut::U64(_) => Some(Some(2)),
        WordsMut::Fixed => Some(None),
    };
    (0..).map_while(size).collect()
}

/// Flips one bit of a word.
fn flip(part: &mut impl Part, leaf: usize, word: usize, bit: u32) {
    match part.part_mut(&mut { leaf }) {
        Some(WordsMut::F32(values)) => values[word] = f32::from_bits(values[word].to_bits() ^ 1 << bit),
        Some(WordsMut::U32(values)) => values[word] ^= 1 << bit,
        Some(WordsMut::I32(values)) => values[word] ^= 1 << bit,
        Some(WordsMut::U64(value)) => *value ^= 1 << (32 * word as u32 + bit),
        Some(WordsMut::Fixed) | None => panic!("leaf {leaf} has no word {word}"),
    }
}

/// Count of the numbers in the text of `{:?}`, which visits the fields without [`Part`].
fn numbers_in(debug: &str) -> usize {
    let starts_number =
        |word: &&str| word.trim_start_matches('-').starts_with(|first: char| first.is_ascii_digit());
    debug.split(|c: char| !(c.is_ascii_alphanumeric() || "-._".contains(c))).filter(starts_number).count()
}

#[test]
fn every_flipped_bit_of_a_full_table_is_refused() {
    let good = full();
    assert_eq!(good.check(), Ok(()));
    let mut flipped = 0;
    for (leaf, size) in sizes(&mut good.clone()).into_iter().enumerate() {
        for (word, bit) in (0..size.unwrap_or(0)).flat_map(|word| (0..32).map(move |bit| (word, bit))) {
            let mut damaged = good;
            flip(&mut damaged, leaf, word, bit);
            let expected = match leaf {
                0 => TableError::Format,
                1 => TableError::Dimensions,
                _ => TableError::Crc,
            };
            assert_eq!(damaged.check(), Err(expected), "leaf {leaf}, word {word}, bit {bit}");
            flipped += 1;
        }
    }
    for bit in 0..32 {
        let damaged = GainTable { crc: good.crc ^ 1 << bit, ..good };
        assert_eq!(damaged.check(), Err(TableError::Crc));
    }
    // All words except the checksum itself; the 64-bit hash counts as two.
    assert_eq!(flipped, 32 * (numbers_in(&format!("{good:?}")) - 1 + 1));
}

#[test]
fn a_part_that_is_missing_or_moved_to_the_other_law_is_refused() {
    let refused = |change: &dyn Fn(&mut GainTable<4, 2>)| {
        let mut damaged = full();
        change(&mut damaged);
        damaged.check()
    };
    let crc = Err(TableError::Crc);
    assert_eq!(refused(&|t| t.laws.lqr = None), crc);
    assert_eq!(refused(&|t| t.laws.pole_placement = None), crc);
    assert_eq!(refused(&|t| t.observer = None), crc);
    let of_motor = |drive: &DriveMap| *drive.force().unwrap();
    assert_eq!(refused(&|t| t.drive = DriveMap::Force(of_motor(&t.drive))), crc);
    assert_eq!(refused(&|t| t.drive = DriveMap::Pulses(StepMap::ideal(t.tick_s))), crc);
    assert_eq!(refused(&|t| t.sensors.swap(0, 1)), crc);
    assert_eq!(refused(&|t| t.sensors[1].kind = SensorKind::Counter), crc);
    assert_eq!(refused(&|t| core::mem::swap(&mut t.laws.lqr, &mut t.laws.pole_placement)), crc);
    let mut one = full();
    one.laws.lqr = None;
    one.crc = one.checksum();
    core::mem::swap(&mut one.laws.lqr, &mut one.laws.pole_placement);
    assert_eq!(one.check(), crc);
}

/// Negative control: a part written by hand, as nobody should, that forgets a field.
#[derive(Debug)]
struct Forgetful {
    guarded: [f32; 2],
    forgotten: f32,
}

impl Part for Forgetful {
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        self.guarded.part(at)
    }

    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        self.guarded.part_mut(at)
    }

    fn read(&self, reader: &mut dyn Reader) {
        self.guarded.read(reader);
    }
}

#[test]
fn a_forgotten_field_is_found_by_counting() {
    let mut forgetful = Forgetful { guarded: [1.0, 2.0], forgotten: 3.0 };
    let words: usize = sizes(&mut forgetful).into_iter().flatten().sum();
    assert_eq!((words, numbers_in(&format!("{forgetful:?}"))), (2, 3));
    let before = checksum::checksum(&forgetful);
    forgetful.forgotten = 4.0;
    assert_eq!(checksum::checksum(&forgetful), before);
}

#[test]
fn every_number_that_is_not_finite_is_refused_even_with_the_right_checksum() {
    let good = full();
    for (leaf, size) in sizes(&mut good.clone()).into_iter().enumerate() {
        for word in 0..size.unwrap_or(0) {
            let mut damaged = good;
            let Some(WordsMut::F32(values)) = damaged.part_mut(&mut { leaf }) else { continue };
            values[word] = f32::INFINITY;
            damaged.crc = damaged.checksum();
            assert!(damaged.check().is_err(), "leaf {leaf}, word {word}");
        }
    }
}

#[test]
fn whole_turns_are_taken_off_where_the_joint_rests() {
    let mut table: GainTable<6, 3> = full().resized();
    for (sensor, turn_counts) in table.sensors.iter_mut().zip([0, 4096, 1000]) {
        sensor.turn_counts = turn_counts;
    }
    let unwound = |counts, bits| table.unwound(&counts, Equilibrium::of_bits(bits));
    assert_eq!(unwound([7, 3 * 4096 + 5, -1003], 0b00), [7, 5, -3]);
    assert_eq!(unwound([70_000, -2047, 998], 0b11), [70_000, 2049, -2]);
    // Link 1 is down, link 2 up: its joint rests half a turn back.
    assert_eq!(unwound([0, 2040, 502], 0b01), [0, 2040, -498]);
    assert_eq!(unwound([0, -5, -502], 0b10), [0, -5, 498]);
    let from_rest = |counts, bits| table.from_rest(&counts, Equilibrium::of_bits(bits));
    assert_eq!(from_rest([7, 2040, 502], 0b01), [7, -8, 2]);
    assert_eq!(table.within_half_a_turn(&[-5000, 4096 + 7, -1009]), [-5000, 7, -9]);
}

#[test]
fn a_table_in_another_size_and_back_is_the_same() {
    let good = full();
    let wide: GainTable<7, 5> = good.resized();
    assert_eq!(wide.sensors.map(|sensor| sensor.turn_counts), [0, 4096, 0, 0, 0]);
    let back: GainTable<4, 2> = wide.resized();
    assert_eq!(back, good);
}

#[test]
fn a_scan_gives_the_same_checksum_again_and_again() {
    let good = full();
    let mut scan = ChecksumScan::default();
    for _ in 0..3 {
        assert_eq!((0..1000).find_map(|_| scan.next(&good)), Some(good.crc));
    }
}

/// Collects the names of all fields.
struct Names(Vec<String>);

impl Reader for Names {
    fn begin(&mut self, _: &'static str) {}

    fn field(&mut self, name: &'static str, documentation: &[&'static str]) {
        assert!(documentation.iter().all(|line| !line.trim().is_empty()));
        self.0.push(name.into());
    }

    fn words(&mut self, _: Words<'_>, _: Shape) {}

    fn variant(&mut self, _: Variant) {}

    fn list(&mut self, _: usize, _: Shape) {}

    fn end(&mut self) {}
}

#[test]
fn a_reader_hears_every_name_in_the_order_of_declaration() {
    let mut names = Names(Vec::new());
    full().read(&mut names);
    let debug = format!("{:?}", full());
    let mut rest = debug.as_str();
    for name in &names.0 {
        let found = rest.find(&format!("{name}: "));
        assert!(found.is_some(), "{name}");
        rest = &rest[found.unwrap() + name.len()..];
    }
    assert_eq!(names.0.last().map(String::as_str), Some("rail_m"));
}

/// Columns of a motion for four states and two sensors, with four knots: reference, force and gains; and the filter.
const COURSE: [i16; 4 * 9] = [5; 4 * 9];
const FILTER: [i16; 4 * 8] = [-25; 4 * 8];

fn motion<'t>(reference: &'t [i16], filter: &'t [i16]) -> MotionTable<'t> {
    let (reference_units, filter_units) = (&[0.5; 9], &[0.25; 8]);
    MotionTable {
        ticks: 6,
        reference_ticks: 2,
        filter_ticks: 2,
        travel_m: [-0.5, 0.5],
        reference_units,
        reference,
        filter_units,
        filter,
    }
}

/// The table of a swing-up of one link.
fn swing_up<'t>(reference: &'t [i16], filter: &'t [i16]) -> SwingUpTable<'t, 2, 1> {
    let mut table = SwingUpTable {
        format: TABLE_FORMAT,
        rig_hash: 0x0123_4567_89ab_cdef,
        tick_s: 0.01,
        model: ChainModel {
            inverse_mass: 1.0,
            a: SVector::repeat(0.1),
            weight: SVector::repeat(1.0),
            b: SMatrix::repeat(0.2),
            b_reduced: SMatrix::repeat(0.1),
            reaction: SVector::repeat(0.1),
            cart_friction: 0.0,
            joint_frictions: SVector::repeat(0.0),
            turning: Some(Turning { beta: SMatrix::repeat(0.2), reaction: 1.0 }),
        },
        limits: MotionLimits {
            deviation_rad: 0.35,
            deviation_m: 0.1,
            speed_m_per_s: 1.5,
            rail_m: [-0.4, 0.4],
        },
        thresholds: full().thresholds,
        raise: motion(reference, filter),
        lower: motion(reference, filter),
        others: &[],
        crc: 0,
    };
    table.crc = table.checksum();
    table
}

#[test]
fn every_flipped_bit_of_a_motion_is_refused() {
    let good = swing_up(&COURSE, &FILTER);
    assert_eq!(good.check(&full()), Ok(()));
    for (word, bit) in (0..COURSE.len()).flat_map(|word| (0..16).map(move |bit| (word, bit))) {
        let mut reference = COURSE;
        reference[word] ^= 1 << bit;
        let damaged = SwingUpTable { lower: motion(&reference, &FILTER), ..good.clone() };
        assert_eq!(damaged.check(&full()), Err(TableError::Crc), "word {word}, bit {bit}");
    }
    for (leaf, size) in sizes(&mut good.clone()).into_iter().enumerate().skip(1) {
        for (word, bit) in (0..size.unwrap_or(0)).flat_map(|word| (0..32).map(move |bit| (word, bit))) {
            let mut damaged = good.clone();
            flip(&mut damaged, leaf, word, bit);
            assert_eq!(damaged.check(&full()), Err(TableError::Crc), "leaf {leaf}, word {word}, bit {bit}");
        }
    }
    let mut scan = ChecksumScan::default();
    assert_eq!((0..1000).find_map(|_| scan.next(&good)), Some(good.crc));
}

fn transition(from: u32, to: u32, reference: &[i16]) -> TransitionTable<'_> {
    TransitionTable { from, to, motion: motion(reference, &FILTER) }
}

/// The table with these transitions and its checksum.
fn with_others<'t>(others: &'t [TransitionTable<'t>]) -> SwingUpTable<'t, 2, 1> {
    let mut table = SwingUpTable { others, ..swing_up(&COURSE, &FILTER) };
    table.crc = table.checksum();
    table
}

#[test]
fn every_flipped_bit_of_a_transition_is_refused() {
    let good = [transition(0, 1, &COURSE), transition(1, 0, &COURSE)];
    let table = with_others(&good);
    assert_eq!(table.check(&full()), Ok(()));
    for (word, bit) in (0..COURSE.len()).flat_map(|word| (0..16).map(move |bit| (word, bit))) {
        let mut reference = COURSE;
        reference[word] ^= 1 << bit;
        let damaged = [good[0], transition(1, 0, &reference)];
        let damaged = SwingUpTable { others: &damaged, ..table.clone() };
        assert_eq!(damaged.check(&full()), Err(TableError::Crc), "word {word}, bit {bit}");
    }
    for bit in 0..32 {
        let damaged = [transition(1 << bit ^ 1, 0, &COURSE), good[1]];
        let damaged = SwingUpTable { others: &damaged, ..table.clone() };
        assert_eq!(damaged.check(&full()), Err(TableError::Crc), "bit {bit}");
    }
    let shorter = SwingUpTable { others: &good[..1], ..table.clone() };
    assert_eq!(shorter.check(&full()), Err(TableError::Crc));
    // With the right checksum: an equilibrium that does not exist, the same one twice, or too few knots.
    let dimensions = Err(TableError::Dimensions);
    assert_eq!(with_others(&[transition(0, 2, &COURSE)]).check(&full()), dimensions);
    assert_eq!(with_others(&[transition(1, 1, &COURSE)]).check(&full()), dimensions);
    let cut = [TransitionTable { motion: motion(&COURSE[9..], &FILTER), ..good[0] }];
    assert_eq!(with_others(&cut).check(&full()), dimensions);
    let mut scan = ChecksumScan::default();
    assert_eq!((0..1000).find_map(|_| scan.next(&table)), Some(table.crc));
}

#[test]
fn a_motion_that_does_not_fit_is_refused_even_with_the_right_checksum() {
    let refused = |change: &dyn Fn(&mut SwingUpTable<'_, 2, 1>)| {
        let mut table = swing_up(&COURSE, &FILTER);
        change(&mut table);
        table.crc = table.checksum();
        table.check(&full())
    };
    assert_eq!(refused(&|_| ()), Ok(()));
    assert_eq!(refused(&|t| t.format += 1), Err(TableError::Format));
    assert_eq!(refused(&|t| t.rig_hash ^= 1), Err(TableError::RigHash));
    assert_eq!(refused(&|t| t.tick_s *= 2.0), Err(TableError::Tick));
    let dimensions = Err(TableError::Dimensions);
    assert_eq!(refused(&|t| t.raise.reference = &COURSE[9..]), dimensions, "too few values");
    assert_eq!(refused(&|t| t.raise.reference = &COURSE[4..]), dimensions, "a column less");
    assert_eq!(refused(&|t| t.lower.filter_ticks = 1), dimensions, "knots that end too early");
    assert_eq!(refused(&|t| t.lower.reference_ticks = 0), dimensions);
    assert_eq!(refused(&|t| t.raise.ticks = 0), dimensions);
    assert_eq!(refused(&|t| t.limits.deviation_rad = f32::NAN), Err(TableError::Value));
    assert_eq!(refused(&|t| t.limits.speed_m_per_s = 0.0), Err(TableError::Value));
    assert_eq!(refused(&|t| t.limits.rail_m = [0.4, -0.4]), Err(TableError::Value));
    assert_eq!(refused(&|t| t.raise.filter_units = &[1.0; 7]), dimensions, "a column without a unit");
    assert_eq!(refused(&|t| t.raise.filter_units = &[f32::INFINITY; 8]), Err(TableError::Value));
    let wide: GainTable<6, 2> = full().resized();
    assert_eq!(swing_up(&COURSE, &FILTER).check(&wide), dimensions, "more states");
}
