//! The tick gives the same bits as its equations written out plainly, whichever shortcuts it takes for a table.
//!
//! The law is written a second time here on purpose: the firmware's code is checked against it.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::control::state_feedback::saturate;
use upright::table::{
    DriveMap, ForceMap, FrictionMap, GainTable, Late, LawGains, Limits, ObserverGains, PerLaw, SensorRow,
    TABLE_FORMAT, Thresholds,
};
use upright_design::table::{MAX_MODEL_SENSORS, MAX_SENSORS, MAX_STATES, WithSize, with_size};

/// Structure of Ad, which decides the code path of the prediction.
#[derive(Debug, Clone, Copy)]
enum Pattern {
    Any,
    ChainWithFriction,
    ChainWithoutFriction,
}

/// The matrix of an observer's model with this pattern.
fn model<const NX: usize>(pattern: Pattern, number: &mut impl FnMut() -> f32) -> SMatrix<f32, NX, NX> {
    let mut ad = SMatrix::<f32, NX, NX>::from_fn(|_, _| 0.3 * number());
    if !matches!(pattern, Pattern::Any) {
        ad.set_column(0, &SVector::from_fn(|row, _| if row == 0 { 1.0 } else { 0.0 }));
    }
    if let Pattern::ChainWithoutFriction = pattern {
        ad.set_column(1, &SVector::zeros());
        (ad[(0, 1)], ad[(1, 1)]) = (0.5, 1.0);
        for (row, column) in (0..NX / 2).flat_map(|row| (0..NX / 2).map(move |column| (2 * row, 2 * column)))
        {
            ad[(row + 1, column + 1)] = ad[(row, column)];
        }
    }
    ad
}

/// A table from a stream of numbers; only the entries that the pattern requires are 0.
fn table<const NX: usize, const NY: usize>(
    pattern: Pattern,
    in_order: bool,
    [acts, stays]: [f32; 2],
    [integral, friction]: [bool; 2],
    numbers: &[f32],
) -> GainTable<NX, NY> {
    let mut numbers = numbers.iter().copied().cycle();
    let mut number = || numbers.next().unwrap();
    let ad = model(pattern, &mut number);
    let mut table = GainTable {
        format: TABLE_FORMAT,
        dimensions: [NX as u32, NY as u32],
        output: 0,
        rig_hash: 1,
        tick_s: 0.01,
        sensors: core::array::from_fn(|sensor| SensorRow {
            state: 2 * if in_order { sensor } else { NY - 1 - sensor } as u32,
            delay_s: if in_order { 0.0 } else { 0.1 * number().abs() },
            step: number().abs(),
            ..SensorRow::default()
        }),
        drive: DriveMap::Force(ForceMap { limit_n: 3.0, late: Late { acts, stays } }),
        laws: PerLaw {
            lqr: Some(LawGains {
                k: SVector::from_fn(|_, _| number()),
                k_pending: if acts > 0.0 { number() } else { 0.0 },
                k_integral: if integral { number() } else { 0.0 },
                n: number(),
                setpoint_step: 0.125,
            }),
            pole_placement: None,
        },
        observer: Some(ObserverGains {
            ad,
            bd: SVector::from_fn(|_, _| number()),
            l: SMatrix::from_fn(|_, _| 0.3 * number()),
        }),
        friction: friction.then(|| FrictionMap {
            axes: SMatrix::from_fn(|row, _| if row < 2 { number().abs() } else { number() }),
            effect: SMatrix::from_fn(|_, _| number()),
        }),
        limits: Limits::none(),
        thresholds: Thresholds::none(),
        stilling: None,
        crc: 0,
    };
    table.crc = table.checksum();
    table
}

/// The equations as documented, entry by entry, for the first `states` of the table.
struct Plain<'t, const NX: usize, const NY: usize> {
    table: &'t GainTable<NX, NY>,
    states: usize,
    x: [f32; NX],
    setpoint: f32,
    integral: f32,
    pending: f32,
}

impl<'t, const NX: usize, const NY: usize> Plain<'t, NX, NY> {
    fn started(table: &'t GainTable<NX, NY>, states: usize) -> Self {
        Self { table, states, x: [0.0; NX], setpoint: 0.0, integral: 0.0, pending: 0.0 }
    }

    /// Computes innovation, estimate and requested force, then prepares the next tick.
    fn tick(&mut self, target: f32, counts: &[u32; NY]) -> Vec<f32> {
        let (law, observer) = (self.table.laws.lqr.as_ref().unwrap(), self.table.observer.as_ref().unwrap());
        let e: [f32; NY] = core::array::from_fn(|i| {
            let sensor = &self.table.sensors[i];
            let state = sensor.state as usize;
            let rate = self.x.get(state + 1).copied().unwrap_or_default();
            sensor.step * counts[i] as i32 as f32 - (self.x[state] - sensor.delay_s * rate)
        });
        let x: [f32; NX] =
            core::array::from_fn(|i| (0..NY).fold(self.x[i], |sum, j| sum + observer.l[(i, j)] * e[j]));
        self.setpoint += saturate(target - self.setpoint, law.setpoint_step);
        let over = |start: f32, first: usize| {
            (first..self.states).step_by(2).fold(start, |sum, i| sum - law.k[i] * x[i])
        };
        let rate = |i: usize| x.get(2 * i + 1).copied().unwrap_or_default();
        let friction: [f32; NY] = core::array::from_fn(|i| {
            let map = self.table.friction.as_ref();
            map.map_or(0.0, |map| -saturate(map.axes[(1, i)] * rate(i), map.axes[(0, i)]))
        });
        let fed_forward = self
            .table
            .friction
            .as_ref()
            .map_or(-0.0, |map| (0..NY).fold(0.0, |sum, i| sum + map.axes[(2, i)] * friction[i]));
        let requested = over(law.n * self.setpoint, 0) + over(-0.0, 1) + fed_forward
            - law.k_pending * self.pending
            - law.k_integral * self.integral;
        let applied = saturate(requested, self.table.drive.largest_force_n());
        let (behind, late) = (self.pending - applied, self.table.drive.late());
        let now = applied + late.acts * behind;
        let moved = self.table.tick_s * (x[0] - self.setpoint);
        if law.k_integral != 0.0 && (requested - applied) * (-law.k_integral * moved) <= 0.0 {
            self.integral += moved;
        }
        self.pending = applied + late.stays * behind;
        self.x = core::array::from_fn(|i| {
            let effect = |j: usize| self.table.friction.as_ref().map_or(-0.0, |map| map.effect[(i, j)]);
            let linear =
                (0..self.states).fold(observer.bd[i] * now, |sum, j| sum + observer.ad[(i, j)] * x[j]);
            (0..NY).fold(linear, |sum, j| sum + effect(j) * friction[j])
        });
        e.into_iter().chain(x).chain([requested, applied]).chain(self.x).collect()
    }
}

type Ticks<const NY: usize> = Vec<(f32, [u32; NY])>;

/// The first difference between the firmware with `table` and the equations with the first `states` of `plain`.
fn difference<const NX: usize, const NY: usize>(
    table: &GainTable<NX, NY>,
    plain: &GainTable<NX, NY>,
    states: usize,
    ticks: &Ticks<NY>,
) -> Option<String> {
    let mut controller = Controller::new(table, [CounterWidth::Bits32; NY]).unwrap();
    controller.start(&[0; NY]).unwrap();
    let mut plain = Plain::started(plain, states);
    ticks.iter().enumerate().find_map(|(tick, (target, counts))| {
        controller.set_setpoint(*target).unwrap();
        let command = controller.control(counts);
        let mut found: Vec<f32> =
            controller.innovation().iter().chain(controller.estimate()).copied().collect();
        controller.predict();
        found.extend([command.requested_n, command.applied_n].iter().chain(controller.estimate()));
        let wanted = plain.tick(*target, counts);
        let differs = found.len() != wanted.len()
            // Skipping a term of 0 may change the sign of a sum that is 0.
            || found.iter().zip(&wanted).any(|(found, wanted)| {
                found.to_bits() != wanted.to_bits() && (*found, *wanted) != (0.0, 0.0)
            });
        differs.then(|| format!("tick {tick}: {found:?} instead of {wanted:?}"))
    })
}

fn ticks<const NY: usize>() -> impl Strategy<Value = Ticks<NY>> {
    let counts = prop::array::uniform::<_, NY>(-9i32..=9).prop_map(|counts| counts.map(|count| count as u32));
    prop::collection::vec((-2.0f32..2.0, counts), 1..8)
}

fn numbers() -> impl Strategy<Value = Vec<f32>> {
    // Both ends are powers of two: for 0.1, an assertion inside proptest fails about once in ten million samples.
    let number =
        (0.125f32..1.0, any::<bool>()).prop_map(|(size, negative)| if negative { -size } else { size });
    prop::collection::vec(number, 251)
}

fn patterns() -> impl Strategy<Value = Pattern> {
    prop::sample::select(vec![Pattern::Any, Pattern::ChainWithFriction, Pattern::ChainWithoutFriction])
}

fn same_bits<const NX: usize, const NY: usize>(patterns: impl Strategy<Value = Pattern>) {
    let shares = prop::sample::select(vec![[0.0, 0.0], [1.0, 0.0], [0.75, 0.625]]);
    let inputs = (patterns, any::<bool>(), shares, any::<[bool; 2]>(), numbers(), ticks::<NY>());
    let same = |(pattern, in_order, delay, options, numbers, ticks): (_, _, _, _, Vec<f32>, _)| {
        let table = table::<NX, NY>(pattern, in_order, delay, options, &numbers);
        difference(&table, &table, NX, &ticks)
            .map_or(Ok(()), |difference| Err(TestCaseError::fail(difference)))
    };
    TestRunner::default().run(&inputs, same).unwrap();
}

#[test]
fn a_tick_gives_the_bits_of_the_plain_equations() {
    same_bits::<10, 5>(patterns());
    same_bits::<4, 2>(patterns());
    same_bits::<2, 1>(patterns());
    // An odd number of states: not a chain of links.
    same_bits::<5, 2>(Just(Pattern::Any));
    same_bits::<1, 1>(Just(Pattern::Any));
}

/// A controller with room for more states than its table has, on the host: against the equations of the table alone.
struct WithRoom {
    states: usize,
    spoilt: bool,
}

impl WithSize for WithRoom {
    type Output = Option<String>;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Option<String> {
        let (states, numbers) = (self.states, (1..252).map(|i| ((i * 37 % 97) as f32 - 48.5) / 64.0));
        let numbers: Vec<f32> = numbers.collect();
        let mut table = table::<NX, NY>(Pattern::Any, true, [0.75, 0.625], [true, false], &numbers);
        let (law, observer) = (table.laws.lqr.as_mut().unwrap(), table.observer.as_mut().unwrap());
        for beyond in states..NX {
            law.k[beyond] = 0.0;
            observer.bd[beyond] = 0.0;
            observer.ad.row_mut(beyond).fill(0.0);
            observer.ad.column_mut(beyond).fill(0.0);
            observer.l.row_mut(beyond).fill(0.0);
        }
        for sensor in &mut table.sensors {
            sensor.state = sensor.state.min(states as u32 - 1);
        }
        if self.spoilt {
            observer.ad[(states - 1, 0)] += 0.25;
        }
        let mut padded = table;
        if self.spoilt {
            padded.observer.as_mut().unwrap().ad[(states - 1, 0)] -= 0.25;
        }
        padded.crc = padded.checksum();
        let counts = |tick: i32| core::array::from_fn(|sensor| (tick * (sensor as i32 + 3) % 19 - 9) as u32);
        let ticks: Ticks<NY> = (0..20).map(|tick| (0.5, counts(tick))).collect();
        difference(&padded, &table, states, &ticks)
    }
}

#[test]
fn a_controller_with_room_for_more_states_gives_the_same_bits_for_every_size_of_a_rig_file() {
    let models =
        (1..=MAX_STATES).flat_map(|states| (1..=MAX_MODEL_SENSORS).map(move |sensors| (states, sensors)));
    let chains = (1..MAX_SENSORS).map(|links| (2 * links + 2, links + 1));
    for (states, sensors) in models.chain(chains) {
        let differs = |spoilt| with_size(states, sensors, WithRoom { states, spoilt }).unwrap();
        assert_eq!(differs(false), None, "{states} states, {sensors} sensors");
        assert!(differs(true).is_some(), "{states} states, {sensors} sensors");
    }
    for (states, sensors) in [(0, 1), (31, 1), (5, 3), (8, 3)] {
        assert!(
            with_size(states, sensors, WithRoom { states, spoilt: false }).is_none(),
            "{states}, {sensors}"
        );
    }
}

proptest! {
    /// Every single entry matters: the comparison above would notice a shortcut that skips one.
    #[test]
    fn one_entry_off_by_one_bit_is_noticed(numbers in numbers(), pattern in patterns(), row in 0..10usize, column in 0..10usize) {
        let table = table::<10, 5>(pattern, true, [0.0; 2], [false; 2], &numbers);
        let mut other = table;
        let entry = &mut other.observer.as_mut().unwrap().ad[(row, column)];
        // Makes an entry of 0 large enough to be visible in a sum.
        *entry = if *entry == 0.0 { 0.25 } else { f32::from_bits(entry.to_bits() ^ 1 << 20) };
        other.crc = other.checksum();
        let ticks = vec![(0.5, [3, 5, 7, 2, 1]); 3];
        prop_assert_eq!(difference(&table, &table, 10, &ticks), None);
        prop_assert_eq!(difference(&other, &other, 10, &ticks), None);
        prop_assert!(difference(&table, &other, 10, &ticks).is_some());
        prop_assert!(difference(&other, &table, 10, &ticks).is_some());
    }
}
