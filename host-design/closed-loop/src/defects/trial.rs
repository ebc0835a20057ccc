//! One run with one defect, drawn from the campaign's seed and its number: the same every time.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::boards::parts::PartInterface;
use upright::table::Law;

use super::defect::Defect;
use super::expected::Phase;
use upright_design::rig::Rig;
use upright_design::simulate::{Disturbance, HandPush, Scenario, Sensing};
use upright_design::table::{SwingUpValues, TableValues};

/// A defect, and the run that it happens in.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Number of the trial in its campaign.
    pub number: u64,
    /// Defect of the defect.
    pub kind: Defect,
    /// What the rig does when the defect begins.
    pub phase: Phase,
    /// Set-point and disturbances of the run.
    pub scenario: Scenario,
    /// The push by hand, if the defect is one: its times count from the onset.
    pub push: Option<HandPush>,
    /// First tick of the defect, counted from the release.
    pub onset: usize,
    /// Ticks of the run from the onset on.
    pub watched: usize,
    /// Number of the sensor (0: cart).
    pub sensor: usize,
    /// Direction: −1 or 1.
    pub sign: f64,
    /// Severity, from 0 to 1.
    pub size: f64,
    /// Seed of everything random after the onset.
    pub seed: u64,
}

/// Number of ticks within which a command takes effect.
const COMMAND_TICKS: usize = 4;
/// Time for which a raised rig balances before it is lowered (s).
const UPRIGHT_S: f64 = 0.5;

impl Defect {
    /// Whether a rig with this table can have it.
    pub fn is_possible(self, table: &TableValues) -> bool {
        match self {
            Self::SupplySag | Self::SupplyDip => table.limits.supply_min_v > 0.0,
            Self::SupplySurge | Self::SupplySpike => table.drive.supply_v().is_some(),
            Self::LinkEncoderFrozen => table.sensors() > 1,
            Self::EncodersSwapped => table.sensors() > 1 + first_encoder(table),
            // The board counts the pulses that it gives.
            Self::CartEncoderFrozen | Self::MotorStuck | Self::MotorWeak => table.drive.pulses().is_none(),
            Self::CartJammed | Self::PulsesMissing | Self::SomePulsesMissing | Self::StepsLost => {
                table.drive.pulses().is_some()
            }
            kind if kind.is_of_some_sensors() => {
                (0..table.sensors()).any(|sensor| kind.can_have(table, sensor))
            }
            _ => true,
        }
    }

    /// Whether this sensor can have it, which not every sensor has.
    fn can_have(self, table: &TableValues, sensor: usize) -> bool {
        let interface = table.sensors[sensor].kind.interface();
        if self == Self::EncoderWireOpen {
            return sensor >= first_encoder(table) && interface.is_none();
        }
        // Simulated pins have no room for a mark beside the cart's counter of 32 bits.
        let is_not_shown = sensor == 0 && self == Self::SampleInvalid;
        interface.is_some_and(|interface| {
            !is_not_shown
                && match interface {
                    PartInterface::Analog => !self.is_of_frames(),
                    PartInterface::TwoWires(part) => self != Self::MagnetMissing || part.has_state(),
                    PartInterface::Frames => true,
                }
        })
    }
}

/// The first sensor from `sensor` on, in turn, that can have a defect that not every sensor has.
pub(super) fn able(kind: Defect, table: &TableValues, sensor: usize) -> usize {
    let all = (0..table.sensors()).cycle().skip(sensor);
    all.take(table.sensors()).find(|&sensor| kind.can_have(table, sensor)).unwrap_or(sensor)
}

/// Number of the first sensor that is an encoder: a drive with pulses has none at the cart.
pub(super) fn first_encoder(table: &TableValues) -> usize {
    usize::from(table.drive.pulses().is_some())
}

impl Trial {
    /// The trial `number` of a campaign: its kind is one of `kinds`, in turn. With a table that has a swing-up, the
    /// defects of the motion are tried while raising and lowering, in turn.
    pub fn draw(rig: &Rig, table: &TableValues, kinds: &[Defect], seed: u64, number: u64) -> Self {
        let kind = kinds[(number % kinds.len() as u64) as usize];
        // A generator for each trial, so that it does not depend on the others.
        let mut random = Pcg64::new(u128::from(seed) << 64 | u128::from(number), 0xcafe_f00d);
        let laws: Vec<Law> = table.laws.present().map(|(law, _)| law).collect();
        let law = laws[random.random_range(0..laws.len())];
        let disturbance = Disturbance::of(rig);
        let sign = |random: &mut Pcg64| if random.random() { 1.0 } else { -1.0 };
        // At rest, after a step, or disturbed more than usual.
        let (step_m, disturbed) = match random.random_range(0..3) {
            0 => (0.0, 1.0),
            1 => (sign(&mut random) * random.random_range(0.02..0.1), 1.0),
            _ => (0.0, 1.5),
        };
        let per_second = 1.0 / rig.tick.period_s;
        let scenario = Scenario {
            sensing: Sensing::Encoders,
            step_m,
            force_noise_n: disturbed * disturbance.force_n,
            torque_noise_n_m: disturbed * disturbance.torque_n_m,
            seed: random.random(),
            substeps: 2,
            // Anywhere, so that counters wrap around in some runs.
            counter_start: random.random(),
            ..Scenario::at_rest(rig, law)
        };
        let (first, sensors) = (first_encoder(table), table.sensors());
        let sensor = match kind {
            Defect::CartEncoderFrozen => 0,
            Defect::LinkEncoderFrozen => random.random_range(1..sensors.max(2)),
            Defect::EncodersSwapped => random.random_range(first..sensors.saturating_sub(1).max(first + 1)),
            kind if kind.is_of_some_sensors() => able(kind, table, random.random_range(first..sensors)),
            _ => random.random_range(first..sensors),
        };
        let trial = Self {
            number,
            kind,
            phase: Phase::Balancing,
            scenario,
            push: None,
            onset: random.random_range((0.2 * per_second) as usize..(0.7 * per_second) as usize),
            watched: (0.8 * per_second) as usize,
            sensor,
            sign: sign(&mut random),
            size: random.random(),
            seed: random.random(),
        };
        let moves =
            !matches!(kind, Defect::ArmUnhomed | Defect::ArmHanging | Defect::ArmStopped | Defect::ArmHeld);
        match &table.swing_up {
            Some(swing_up) if moves => {
                let is_raised = (number / kinds.len() as u64).is_multiple_of(2);
                trial.in_motion(rig, swing_up, is_raised, random.random())
            }
            _ => trial,
        }
    }

    /// The same defect while the rig is raised or lowered; `when` (0 to 1) sets how late in the motion.
    fn in_motion(self, rig: &Rig, swing_up: &SwingUpValues, is_raised: bool, when: f64) -> Self {
        let (up, down) = (swing_up.raise.ticks as usize, swing_up.lower.ticks as usize);
        let upright = (UPRIGHT_S / rig.tick.period_s) as usize;
        let (phase, begin, ticks) = match is_raised {
            true => (Phase::Raising, 0, up),
            false => (Phase::Lowering, up + upright, down),
        };
        let onset = begin + COMMAND_TICKS + (0.8 * when * (ticks as f64)) as usize;
        let lower_at_s = (!is_raised).then_some(begin as f64 * rig.tick.period_s);
        let swing = Scenario::swing_up(rig, 0.0, lower_at_s);
        let scenario = Scenario {
            start: swing.start,
            begin: swing.begin,
            goals: swing.goals,
            step_m: 0.0,
            law: Law::Lqr,
            ..self.scenario
        };
        // A raised rig then balances for a while; a lowered one turns its motor off.
        let after = if is_raised { upright / 2 } else { 0 };
        let watched = (begin + ticks + after).saturating_sub(onset).max(1);
        Self { phase, scenario, onset, watched, ..self }
    }

    /// Generator of everything random after the onset.
    pub fn random(&self) -> Pcg64 {
        Pcg64::seed_from_u64(self.seed)
    }
}
