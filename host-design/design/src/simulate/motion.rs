//! Raising, balancing and lowering by the firmware's controller against the nonlinear plant, without a supervisor.

use upright::control::controller::Controller;
use upright::control::motion::Playback;
use upright::supervision::detection::Detection;
use upright::table::{
    Equilibrium, MotionTable, SensorRow, SwingUp, SwingUpTable, Thresholds, without_errors,
};

use super::bench::Bench;
use super::error::SimulationError;
use super::scenario::Scenario;
use crate::rig::Rig;
use crate::table::{SwingUpValues, TableValues, WithSize, with_firmware_size};

/// Extreme values that a run reaches during its motions, by the controller's own estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    /// Largest innovation of each sensor (m or rad).
    pub innovation: Vec<f64>,
    /// Largest predicted motion of each sensor while its counter stands still (m or rad): [`Detection::moved`].
    pub moved: Vec<f64>,
    /// Largest distance of the cart from its planned position (m).
    pub deviation_m: f64,
    /// Largest distance of a link from its planned angle from the vertical (rad).
    pub deviation_rad: f64,
    /// Largest speed of the cart (m/s).
    pub speed_m_per_s: f64,
    /// Lowest and highest position of the cart (m).
    pub travel_m: [f64; 2],
}

impl Extremes {
    /// The extremes before the first tick.
    pub fn none(sensors: usize) -> Self {
        Self {
            innovation: vec![0.0; sensors],
            moved: vec![0.0; sensors],
            deviation_m: 0.0,
            deviation_rad: 0.0,
            speed_m_per_s: 0.0,
            travel_m: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    /// Extends these extremes by those of another run.
    pub fn include(&mut self, other: &Self) {
        raise_to(&mut self.innovation, &other.innovation);
        raise_to(&mut self.moved, &other.moved);
        self.deviation_m = self.deviation_m.max(other.deviation_m);
        self.deviation_rad = self.deviation_rad.max(other.deviation_rad);
        self.speed_m_per_s = self.speed_m_per_s.max(other.speed_m_per_s);
        self.travel_m = [self.travel_m[0].min(other.travel_m[0]), self.travel_m[1].max(other.travel_m[1])];
    }

    /// Includes a tick with this estimate; `away` is the estimate minus the planned state.
    fn note(&mut self, estimate: &[f32], away: &[f32]) {
        self.deviation_m = self.deviation_m.max(f64::from(away[0].abs()));
        let mut lean = 0.0;
        for joint in away.iter().skip(2).step_by(2) {
            lean += f64::from(*joint);
            self.deviation_rad = self.deviation_rad.max(lean.abs());
        }
        let [position, speed] = [estimate[0], estimate[1]].map(f64::from);
        self.speed_m_per_s = self.speed_m_per_s.max(speed.abs());
        self.travel_m = [self.travel_m[0].min(position), self.travel_m[1].max(position)];
    }
}

/// Raises each entry of `largest` to that of `values`, if that is larger.
fn raise_to(largest: &mut [f64], values: &[f64]) {
    largest.iter_mut().zip(values).for_each(|(largest, value)| *largest = largest.max(*value));
}

/// Runs motions of `table` on `rig`, which may differ from the rig that the table is for, from the start of `scenario`
/// and with its disturbances. Without `other`, the links are raised, balanced for `balance_ticks` and lowered. With
/// `other`, only this one of the table's other motions is run; if a link is up at its end, the links are held there
/// for `balance_ticks`. None if the table has no motions.
///
/// # Errors
/// [`SimulationError`] if the plant cannot be built or the firmware refuses the table.
pub fn follow(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    other: Option<usize>,
    balance_ticks: usize,
) -> Result<Option<Extremes>, SimulationError> {
    let Some(swing_up) = &table.swing_up else { return Ok(None) };
    let bench = Bench::new(rig, scenario)?;
    let (states, sensors) = (table.states(), table.sensors());
    with_firmware_size(states, sensors, Follow { table, swing_up, bench, other, balance_ticks })
        .ok_or(SimulationError::Size { states, sensors })?
        .map(Some)
}

struct Follow<'a> {
    table: &'a TableValues,
    swing_up: &'a SwingUpValues,
    bench: Bench,
    /// Index of one of the table's other motions, to run instead of raising and lowering.
    other: Option<usize>,
    balance_ticks: usize,
}

impl WithSize for Follow<'_> {
    type Output = Result<Extremes, SimulationError>;

    fn run<const NX: usize, const NY: usize, const N: usize>(mut self) -> Self::Output {
        let table = self.table.table::<NX, NY>();
        let others = self.swing_up.transitions();
        // Of the other motions only the one that is run: the firmware checks every word of its table.
        let other = self.other.and_then(|other| others.get(other));
        let swing_up = self.swing_up.table::<NY, N>(other.map_or(&[], core::slice::from_ref));
        swing_up.check(&table)?;
        let mut controller = Controller::new(&table, Bench::widths())?;
        let mut at_zero = [0; NY];
        self.bench.read_counters_at_zero(&mut at_zero);
        controller.encoders_mut().home(&at_zero, &[0; NY]);
        controller.start(&read(&mut self.bench, &table.sensors))?;
        let tick_s = table.tick_s;
        let mut run = MotionRun {
            controller,
            sensors: &table.sensors,
            swing_up: &swing_up,
            bench: self.bench,
            tick_s,
            reached: Extremes::none(NY),
        };
        match other {
            None => {
                run.follow(swing_up.raise, 0);
                run.balance(self.balance_ticks)?;
                run.follow(swing_up.lower, 0);
            }
            Some(other) => {
                let hangs = other.to == Equilibrium::hanging(N).bits();
                run.follow(other.motion, if hangs { 0 } else { self.balance_ticks });
            }
        }
        Ok(run.reached)
    }
}

/// What the firmware makes of the readings of the counters.
fn read<const NY: usize>(bench: &mut Bench, sensors: &[SensorRow; NY]) -> [u32; NY] {
    let mut counters = bench.counters();
    without_errors(sensors, &mut counters);
    counters
}

struct MotionRun<'t, const NX: usize, const NY: usize, const N: usize> {
    controller: Controller<'t, NX, NY>,
    sensors: &'t [SensorRow; NY],
    swing_up: &'t SwingUpTable<'t, NY, N>,
    bench: Bench,
    tick_s: f32,
    reached: Extremes,
}

impl<'t, const NX: usize, const NY: usize, const N: usize> MotionRun<'t, NX, NY, N> {
    /// Follows `motion` from the set-point, with the tests of the supervisor but without its thresholds, stays at its
    /// end for `hold_ticks`, and then hands over to the control law.
    fn follow(&mut self, motion: MotionTable<'t>, hold_ticks: usize) {
        let Self { controller, sensors, bench, reached, .. } = self;
        let mut playback = Playback::<NX, NY>::new(motion, controller.law_state().setpoint);
        let (mut detection, nothing) = (Detection::<NY>::default(), Thresholds::none());
        detection.start(controller.encoders().counts(), &controller.positions().data.0[0]);
        let mut held = 0;
        loop {
            let counters = read(bench, sensors);
            let command = controller.control_on_reference(&counters, playback.now(), |counts, y, e| {
                raise_to(&mut reached.innovation, &e.map(|e| f64::from(e.abs())));
                detection.test(&nothing, counts, y, e);
                raise_to(&mut reached.moved, &detection.moved().map(|moved| f64::from(moved.abs())));
            });
            let estimate = controller.estimate();
            reached.note(estimate.as_slice(), (estimate - playback.now().x).as_slice());
            bench.tick(command.drive);
            controller.predict_on_reference(
                |counts, corrected, force| detection.finish_tick(&nothing.motor, counts, corrected, force),
                |state, force| SwingUp::<NX, NY>::predict(self.swing_up, state, force, self.tick_s),
            );
            if playback.advance() {
                if held == hold_ticks {
                    break;
                }
                held += 1;
            }
        }
        controller.hand_over(playback.now().x[0]);
    }

    /// Balances for `ticks` at the position where the motion has ended.
    fn balance(&mut self, ticks: usize) -> Result<(), SimulationError> {
        let here = self.controller.law_state().setpoint;
        self.controller.set_setpoint(here)?;
        for _ in 0..ticks {
            let command = self.controller.control(&read(&mut self.bench, self.sensors));
            self.bench.tick(command.drive);
            self.controller.predict();
        }
        Ok(())
    }
}
