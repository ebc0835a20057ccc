//! Defects in a jog and while the rig is shaken: which of them prove something there, and the outcome that each must
//! have.

use rand::RngExt;
use upright::protocol::HOST_SILENCE_S;
use upright::supervision::jog::{LONGEST_S, MotorSign};
use upright::supervision::shaking::RETURN_S;

use super::defect::Defect;
use super::expected::{Expected, Phase};
use super::trial::Trial;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};

/// Time for which a jog is watched from the onset on (s).
const JOG_WATCHED_S: f64 = 0.4;
/// The defects begin between these times (s): while the cart is pushed each way, and while everything is shaken.
const ONSET_S: [f64; 2] = [0.05, 5.0];
/// Time for which a defect is watched while the rig is shaken (s): usually, and at most for one that has to turn the
/// motor off.
const WATCHED_S: [f64; 2] = [1.0, 6.0];
/// Duration for which a rig has to be shaken (s).
pub const SHAKEN_S: f64 = ONSET_S[1] + WATCHED_S[1];

impl Defect {
    /// The outcome that it must have in a phase; some kinds prove nothing in a jog or while the rig is shaken.
    pub fn expected_in(self, phase: Phase) -> Expected {
        let special = match phase {
            Phase::Jogging => self.while_jogging(),
            Phase::Shaken => self.while_shaken(),
            Phase::Raising | Phase::Lowering if self == Self::Push => Some(Expected::Bounded),
            Phase::Balancing | Phase::Raising | Phase::Lowering => None,
        };
        special.unwrap_or_else(|| self.expected())
    }

    /// The outcome that it must have in a jog; `None` if it proves nothing there.
    pub fn while_jogging(self) -> Option<Expected> {
        match self {
            Defect::HostSilent | Defect::HostWireOpen => Some(Expected::LetGo),
            Defect::MotorDead | Defect::CartEncoderFrozen | Defect::CartJammed | Defect::EncoderWireOpen => {
                Some(Expected::Found(MotorSign::Still))
            }
            Defect::MotorReversed | Defect::EncoderReversed => Some(Expected::Found(MotorSign::Reversed)),
            Defect::SupplyNotANumber
            | Defect::SupplySag
            | Defect::SupplyDip
            | Defect::SupplySurge
            | Defect::SupplySpike
            | Defect::EmergencyStop
            | Defect::DriverFault
            | Defect::LimitSwitch
            | Defect::OneOverrun
            | Defect::Overruns
            | Defect::FrameDamaged
            | Defect::FrameTruncated
            | Defect::FrameReplayed
            | Defect::Rubbish
            | Defect::Panic
            | Defect::HardFault
            | Defect::StackOverflow
            | Defect::StalledTick
            | Defect::LockUp
            | Defect::CrystalStops
            | Defect::BrownOut
            | Defect::StopBetweenTicks => Some(self.expected()),
            _ => None,
        }
    }

    /// The outcome that it must have while the rig is shaken; `None` if it proves nothing there.
    pub fn while_shaken(self) -> Option<Expected> {
        match self {
            Defect::HostSilent | Defect::HostWireOpen | Defect::HostDeaf => Some(Expected::LetGo),
            // What stands still while the motor pushes, and a cart that runs away.
            Defect::LinkEncoderFrozen
            | Defect::CartEncoderFrozen
            | Defect::EncoderWireOpen
            | Defect::MotorStuck => Some(Expected::Changed),
            // There is no observer: only what leads beyond a limit is found. The log shows the rest to the host.
            Defect::BadSample
            | Defect::EncoderJump
            | Defect::SensorDead
            | Defect::EncoderReversed
            | Defect::EncodersSwapped
            | Defect::MotorDead
            | Defect::MotorReversed
            | Defect::CartJammed
            | Defect::PulsesMissing
            | Defect::SomePulsesMissing
            | Defect::StepsLost
            | Defect::Push => Some(Expected::Bounded),
            Defect::ArmUnhomed
            | Defect::ArmHanging
            | Defect::ArmStopped
            | Defect::ArmHeld
            | Defect::CrystalMissing
            | Defect::CrystalWrong
            | Defect::ChipWrong
            | Defect::WriteLost => None,
            _ => Some(self.expected()),
        }
    }
}

impl Trial {
    /// The outcome that it must have.
    pub fn expected(&self) -> Expected {
        self.kind.expected_in(self.phase)
    }

    /// The same defect in a jog. Ticks count from the first one with the motor on.
    pub fn in_jog(self, rig: &Rig) -> Self {
        let ticks = |seconds: f64| (seconds / rig.tick.period_s) as usize;
        let is_there_before = matches!(self.kind.while_jogging(), Some(Expected::Found(_)));
        let (onset, watched) = match is_there_before {
            true => (0, ticks(f64::from(LONGEST_S)) + 2),
            // In a jog with the cart held, which lasts for 1 s.
            false => (self.onset / 2, ticks(JOG_WATCHED_S)),
        };
        let scenario = Scenario {
            sensing: Sensing::Encoders,
            seed: self.scenario.seed,
            substeps: self.scenario.substeps,
            counter_start: self.scenario.counter_start,
            ..Scenario::at_rest(rig, self.scenario.law)
        };
        let sensor = rig.actuator.input().motor_sensor();
        Self { phase: Phase::Jogging, scenario, onset, watched, sensor, ..self }
    }

    /// The same defect while the rig is shaken. Ticks count from the first one with the motor on.
    pub fn in_shaking(self, rig: &Rig) -> Self {
        let ticks = |seconds: f64| (seconds / rig.tick.period_s) as usize;
        let watched_s = match self.kind.while_shaken() {
            Some(Expected::LetGo) => f64::from(HOST_SILENCE_S + RETURN_S) + WATCHED_S[0],
            Some(Expected::Changed) => WATCHED_S[1],
            _ => WATCHED_S[0],
        };
        let onset = self.random().random_range(ticks(ONSET_S[0])..ticks(ONSET_S[1]));
        Self { phase: Phase::Shaken, onset, watched: ticks(watched_s), ..self }
    }
}
