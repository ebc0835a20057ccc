//! A planned motion, followed by the firmware's controller against the nonlinear plant.

use upright::control::controller::Controller;
use upright::control::motion::Player;
use upright::table::SwingUp;

use super::bench::Bench;
use super::error::SimulationError;
use super::scenario::Scenario;
use crate::rig::{PlantDescription, Rig};
use crate::table::{SwingUpValues, TableValues, WithSize, with_firmware_size};

/// Which motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From hanging to upright.
    Raise,
    /// From upright to hanging.
    Lower,
}

/// What a run along a motion has reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Extremes {
    /// Largest innovation of each sensor (m or rad).
    pub innovation: Vec<f64>,
    /// Largest distance of the cart from its planned position (m).
    pub deviation_m: f64,
    /// Largest distance of a link from its planned angle from the vertical (rad).
    pub deviation_rad: f64,
    /// True state at the end of the motion (m, m/s, rad, rad/s …).
    pub end: Vec<f64>,
}

/// Follows a motion of `table` with the rig `rig`, which may differ from the one that the table is for. Start and
/// disturbances are those of `scenario`. No supervisor ends the run.
///
/// # Errors
/// [`SimulationError`] if the plant cannot be built or the firmware refuses the table.
pub fn follow(
    rig: &Rig,
    table: &TableValues,
    direction: Direction,
    scenario: &Scenario,
) -> Result<Option<Extremes>, SimulationError> {
    let Some(swing_up) = &table.swing_up else { return Ok(None) };
    let bench = Bench::new(rig, scenario)?;
    let (states, sensors) = (table.states(), table.sensors());
    with_firmware_size(states, sensors, Follow { table, swing_up, direction, bench })
        .ok_or(SimulationError::Size { states, sensors })?
        .map(Some)
}

struct Follow<'a> {
    table: &'a TableValues,
    swing_up: &'a SwingUpValues,
    direction: Direction,
    bench: Bench,
}

impl WithSize for Follow<'_> {
    type Output = Result<Extremes, SimulationError>;

    fn run<const NX: usize, const NY: usize, const N: usize>(mut self) -> Self::Output {
        let table = self.table.table::<NX, NY>();
        let swing_up = self.swing_up.table::<NY, N>();
        let build = self.table.build();
        swing_up.check(&build, NX)?;
        let mut controller = Controller::new(&table, &build, Bench::widths())?;
        let mut at_zero = [0; NY];
        self.bench.read_counters_at_zero(&mut at_zero);
        controller.encoders_mut().home(&at_zero, &[0; NY]);
        controller.start(&self.bench.counters())?;
        let motion = match self.direction {
            Direction::Raise => swing_up.raise,
            Direction::Lower => swing_up.lower,
        };
        let mut player = Player::<NX, NY>::new(motion, controller.estimate()[0]);
        let mut innovation = vec![0.0f64; NY];
        let (mut deviation_m, mut deviation_rad) = (0.0f64, 0.0f64);
        loop {
            let counters = self.bench.counters();
            let command = controller.control_on_course(&counters, player.now(), |_, _, e| {
                for (largest, e) in innovation.iter_mut().zip(e) {
                    *largest = largest.max(f64::from(e.abs()));
                }
            });
            let away = controller.estimate() - player.now().x;
            deviation_m = deviation_m.max(f64::from(away[0].abs()));
            let mut lean = 0.0;
            for joint in away.as_slice().iter().skip(2).step_by(2) {
                lean += f64::from(*joint);
                deviation_rad = deviation_rad.max(lean.abs());
            }
            self.bench.tick(command.drive);
            controller.predict_on_course(|state, force| {
                SwingUp::<NX, NY>::predict(&swing_up, state, force, table.tick_s);
            });
            if player.advance() {
                break;
            }
        }
        Ok(Extremes { innovation, deviation_m, deviation_rad, end: self.bench.state().to_vec() })
    }
}

/// Spread of the masses and frictions with which a motion's thresholds are found.
const SPREAD: [f64; 2] = [0.05, 0.3];
/// Rigs with other masses and frictions for them.
const RIGS: u32 = 8;
/// What such a rig reaches is allowed this many times.
const MARGIN: f64 = 2.0;
/// Least distance that the cart may have from its planned position (m).
const LEAST_DEVIATION_M: f32 = 0.02;

/// Sets the thresholds with which the firmware supervises the motions of `table`: those of balancing, and twice the
/// innovation that rigs with masses off by 5 % and frictions off by 30 %, in several combinations of signs, reach on
/// either motion. Does nothing without a swing-up.
///
/// # Errors
/// [`SimulationError`] if the runs cannot be made.
pub fn set_motion_thresholds(rig: &Rig, table: &mut TableValues) -> Result<(), SimulationError> {
    let sensors = table.sensors();
    let (mut largest, mut deviation_m) = (vec![0.0f64; sensors], 0.0f64);
    for number in 0..RIGS {
        let other = with_other_masses(rig, number);
        for direction in [Direction::Raise, Direction::Lower] {
            let mut scenario = Scenario::swing_up(&other, 0.0, None);
            if direction == Direction::Lower {
                scenario.start.fill(0.0);
            }
            let Some(reached) = follow(&other, table, direction, &scenario)? else { return Ok(()) };
            deviation_m = deviation_m.max(reached.deviation_m);
            for (largest, reached) in largest.iter_mut().zip(&reached.innovation) {
                *largest = largest.max(*reached);
            }
        }
    }
    let balancing = table.thresholds.clone();
    let Some(swing_up) = &mut table.swing_up else { return Ok(()) };
    swing_up.deviation_m = ((1.0 + MARGIN) * deviation_m) as f32 + LEAST_DEVIATION_M;
    swing_up.thresholds = balancing;
    let thresholds = &mut swing_up.thresholds;
    let mut wider = vec![1.0f32; sensors];
    for (sensor, wider) in wider.iter_mut().enumerate() {
        *wider = 1.0 + (MARGIN * largest[sensor]) as f32 / thresholds.innovation[sensor];
        thresholds.innovation[sensor] *= *wider;
        thresholds.frozen[sensor] *= *wider;
    }
    thresholds.motor.energy *= wider[0] * wider[0];
    Ok(())
}

/// `rig` with every mass and friction off by [`SPREAD`], up or down as the bits of a number say.
fn with_other_masses(rig: &Rig, number: u32) -> Rig {
    let mut other = rig.clone();
    let PlantDescription::Chain(chain) = &mut other.plant else { return other };
    let mut bits = number.wrapping_mul(0x9e37_79b9).rotate_left(9);
    let mut off = |spread: f64| {
        bits = bits.rotate_left(1);
        if bits & 1 == 1 { 1.0 + spread } else { 1.0 - spread }
    };
    chain.cart.mass_kg *= off(SPREAD[0]);
    chain.cart.friction_n_s_per_m *= off(SPREAD[1]);
    for link in &mut chain.links {
        let factor = off(SPREAD[0]);
        link.mass_kg *= factor;
        link.inertia_kg_m2 = link.inertia_kg_m2.map(|inertia| factor * inertia);
        link.friction_n_m_s_per_rad *= off(SPREAD[1]);
    }
    other
}
