//! The kinds of defects, and the outcome that each must have.

use upright::protocol::simulated_pins::InjectedFault;
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;

use super::trial::Phase;

/// A kind of defect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // the table below says what each is
pub enum Kind {
    SupplyNotANumber,
    SupplySag,
    SupplyDip,
    SupplySurge,
    SupplySpike,
    EmergencyStop,
    DriverFault,
    LimitSwitch,
    OneOverrun,
    Overruns,
    LinkEncoderFrozen,
    CartEncoderFrozen,
    BadSample,
    EncoderJump,
    EncoderReversed,
    EncodersSwapped,
    CountsLost,
    SensorLate,
    SensorIntermittent,
    MotorDead,
    MotorReversed,
    MotorStuck,
    MotorWeak,
    Push,
    HostSilent,
    HostDeaf,
    FrameDamaged,
    FrameTruncated,
    FrameReplayed,
    Rubbish,
    SetpointNotANumber,
    SetpointOutOfRange,
    ArmUnhomed,
    ArmHanging,
    ArmStopped,
    ArmHeld,
    Panic,
    HardFault,
    StackOverflow,
    StalledTick,
    LockUp,
    CrystalStops,
    CrystalMissing,
    CrystalWrong,
    ChipWrong,
    BrownOut,
    StopBetweenTicks,
    HostWireOpen,
    LineNoise,
    LineFlood,
    TableBit,
    RamBit,
    WriteLost,
    EncoderWireOpen,
}

/// The outcome that a defect must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Motor off with this fault, at most this number of ticks after the onset. Where the list of faults has no
    /// number, it follows from the rig's limits.
    Fault(Fault, Ticks),
    /// Motor off, with any fault, before a link is far beyond its limit. At best this takes the given number of ticks
    /// from the first visible difference to a healthy rig.
    Off(u32),
    /// Balancing continues, and the rejected measurement is counted.
    Counted,
    /// Balancing continues, with every output bit for bit as without the defect.
    Ignored,
    /// Motor off, with any fault, before a link is far beyond its limit.
    Changed,
    /// Links and cart stay within their limits until the motor is off, if it is turned off at all.
    Bounded,
    /// The firmware refuses to arm, for these reasons at least.
    Refused(Inhibits),
    /// The motor is off in the same tick, and the firmware stops running.
    Dead,
    /// A jog ends without a fault, as soon after the last command as when the key is released; a rig that was
    /// shaken brings its cart back first.
    LetGo,
    /// A jog ends with this finding about the motor, which keeps it from arming.
    Found(MotorSign),
}

/// Number of ticks within which a fault must turn the motor off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ticks {
    /// This number.
    Exactly(u32),
    /// The ticks of `supply_time_s`, plus one.
    Supply,
    /// The ticks of `link_timeout_s` from the last command on, plus those that its bytes take.
    Link,
}

impl Kind {
    /// Every kind with its name, a description, and the outcome that it must have.
    pub const ALL: [(Kind, &str, &str, Expected); 54] = {
        use Expected::*;
        use Ticks::*;
        [
            (
                Kind::SupplyNotANumber,
                "supply-not-a-number",
                "the measured supply voltage is NaN",
                Fault(F::NotFinite, Exactly(1)),
            ),
            (
                Kind::SupplySag,
                "supply-sag",
                "the supply stays below its lowest permitted voltage",
                Fault(F::Supply, Supply),
            ),
            (
                Kind::SupplyDip,
                "supply-dip",
                "the supply is too low for less than the time that makes it a fault",
                Ignored,
            ),
            (
                Kind::SupplySurge,
                "supply-surge",
                "the supply rises to 1.3 to 1.6 times the motor's voltage, as when the motor brakes",
                Fault(F::Supply, Exactly(3)),
            ),
            (Kind::SupplySpike, "supply-spike", "the same for one or two ticks", Ignored),
            (
                Kind::EmergencyStop,
                "emergency-stop",
                "pressed for one tick",
                Fault(F::EmergencyStop, Exactly(1)),
            ),
            (Kind::DriverFault, "driver-fault", "reported for one tick", Fault(F::Driver, Exactly(1))),
            (
                Kind::LimitSwitch,
                "limit-switch",
                "one of them pressed, or its wire open, for three ticks",
                Fault(F::LimitSwitch, Exactly(1)),
            ),
            (Kind::OneOverrun, "one-overrun", "one or two ticks late", Ignored),
            (Kind::Overruns, "overruns", "three ticks in a row late", Fault(F::Overrun, Exactly(3))),
            (Kind::LinkEncoderFrozen, "link-encoder-frozen", "a link's counter stands still", Off(10)),
            (Kind::CartEncoderFrozen, "cart-encoder-frozen", "the cart's counter stands still", Off(10)),
            (Kind::BadSample, "bad-sample", "one measurement wrong by 2 to 20 thresholds", Counted),
            (
                Kind::EncoderJump,
                "encoder-jump",
                "all measurements of an encoder wrong by 2 to 20 thresholds",
                Off(3),
            ),
            (Kind::EncoderReversed, "encoder-reversed", "an encoder counts backwards", Off(5)),
            (Kind::EncodersSwapped, "encoders-swapped", "two neighbours' counters are swapped", Off(5)),
            (Kind::CountsLost, "counts-lost", "an encoder loses a count every 5 to 50 ticks", Bounded),
            (Kind::SensorLate, "sensor-late", "an encoder's measurements are 1 to 20 ticks late", Bounded),
            (Kind::SensorIntermittent, "sensor-intermittent", "two of three measurements are wrong", Bounded),
            (Kind::MotorDead, "motor-dead", "the motor produces no force", Off(20)),
            (Kind::MotorReversed, "motor-reversed", "the motor's force has the wrong sign", Off(5)),
            (Kind::MotorStuck, "motor-stuck", "the motor produces full force to one side", Off(5)),
            (Kind::MotorWeak, "motor-weak", "the motor produces 10 to 50 % of the force", Bounded),
            (Kind::Push, "push", "a push on the cart for 50 ms, with up to the force limit", Bounded),
            (
                Kind::HostSilent,
                "host-silent",
                "a host that commands the set-point sends nothing more",
                Fault(F::LinkLost, Link),
            ),
            (Kind::HostDeaf, "host-deaf", "the host stops reading the serial line", Ignored),
            (Kind::FrameDamaged, "frame-damaged", "a disarm command with a wrong bit", Ignored),
            (Kind::FrameTruncated, "frame-truncated", "a disarm command without its last bytes", Ignored),
            (Kind::FrameReplayed, "frame-replayed", "a disarm command with an old number", Ignored),
            (Kind::Rubbish, "rubbish", "random bytes on the serial line", Ignored),
            (Kind::SetpointNotANumber, "setpoint-not-a-number", "a set-point of NaN or infinity", Ignored),
            (Kind::SetpointOutOfRange, "setpoint-out-of-range", "a set-point beyond the rail", Ignored),
            (Kind::ArmUnhomed, "arm-unhomed", "arming before homing", Refused(Inhibits::NOT_HOMED)),
            (Kind::ArmHanging, "arm-hanging", "arming while the links hang", Refused(Inhibits::TILTED)),
            (
                Kind::ArmStopped,
                "arm-stopped",
                "arming with the emergency stop pressed",
                Refused(Inhibits::FAULT.union(Inhibits::EMERGENCY_STOP)),
            ),
            (
                Kind::ArmHeld,
                "arm-held",
                "an arm command that is repeated while a fault is cleared",
                Refused(Inhibits::HELD),
            ),
            (Kind::Panic, "panic", "the firmware panics", Dead),
            (Kind::HardFault, "hard-fault", "the firmware accesses memory that does not exist", Dead),
            (Kind::StackOverflow, "stack-overflow", "the firmware's stack overflows", Dead),
            (
                Kind::StalledTick,
                "stalled-tick",
                "the core is stalled during a tick",
                Fault(F::Watchdog, Exactly(3)),
            ),
            (
                Kind::LockUp,
                "lock-up",
                "a processor fault whose handler faults as well",
                Fault(F::Watchdog, Exactly(3)),
            ),
            (
                Kind::CrystalStops,
                "crystal-stops",
                "the crystal stops oscillating",
                Fault(F::Clock, Exactly(1)),
            ),
            (Kind::CrystalMissing, "crystal-missing", "no crystal at power-up", Refused(Inhibits::FAULT)),
            (
                Kind::CrystalWrong,
                "crystal-wrong",
                "a crystal of 4, 12, 16 or 25 MHz at power-up",
                Refused(Inhibits::FAULT),
            ),
            (
                Kind::ChipWrong,
                "chip-wrong",
                "the image for an STM32F405 on an STM32F446",
                Refused(Inhibits::FAULT),
            ),
            (
                Kind::BrownOut,
                "brown-out",
                "the chip's own supply is at 2.0 to 2.6 V for 0.3 ms",
                Fault(F::Board, Exactly(2)),
            ),
            (
                Kind::StopBetweenTicks,
                "stop-between-ticks",
                "the emergency stop opens and closes again between two ticks",
                Fault(F::EmergencyStop, Exactly(1)),
            ),
            (
                Kind::HostWireOpen,
                "host-wire-open",
                "the wire from a host that commands the set-point is open",
                Fault(F::LinkLost, Link),
            ),
            (Kind::LineNoise, "line-noise", "random bytes at wrong baud rates on the serial line", Ignored),
            (Kind::LineFlood, "line-flood", "bytes without a pause on the serial line", Ignored),
            (Kind::TableBit, "table-bit", "a bit of the gain table in use changes", Changed),
            (Kind::RamBit, "ram-bit", "a bit of the firmware's variables or stack changes", Bounded),
            (
                Kind::WriteLost,
                "write-lost",
                "a write to a register of the motor's timer is lost at power-up",
                Refused(Inhibits::FAULT),
            ),
            (
                Kind::EncoderWireOpen,
                "encoder-wire-open",
                "a wire of an encoder is open: its count alternates between two values",
                Off(10),
            ),
        ]
    };

    fn row(self) -> &'static (Kind, &'static str, &'static str, Expected) {
        // A test checks that every kind is in the table, in its order.
        &Self::ALL[self as usize]
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// One-line description.
    pub fn meaning(self) -> &'static str {
        self.row().2
    }

    /// The outcome that it must have.
    pub fn expected(self) -> Expected {
        self.row().3
    }

    /// The outcome that it must have in a phase; some kinds prove nothing in a jog or while the rig is shaken.
    pub(super) fn expected_in(self, phase: Phase) -> Expected {
        let special = match phase {
            Phase::Jogging => self.while_jogging(),
            Phase::Shaken => self.while_shaken(),
            Phase::Balancing | Phase::Raising | Phase::Lowering => None,
        };
        special.unwrap_or_else(|| self.expected())
    }

    /// The fault inside the microcontroller, if it is one.
    pub(super) fn inside_the_microcontroller(self) -> Option<InjectedFault> {
        match self {
            Kind::Panic => Some(InjectedFault::Panic),
            Kind::HardFault => Some(InjectedFault::HardFault),
            Kind::StackOverflow => Some(InjectedFault::StackOverflow),
            _ => None,
        }
    }

    /// Whether it is possible only with an image.
    pub fn needs_image(self) -> bool {
        self.inside_the_microcontroller().is_some()
    }

    /// Whether it is possible only on a board.
    pub fn needs_board(self) -> bool {
        (Kind::StalledTick as usize..=Kind::WriteLost as usize).contains(&(self as usize))
    }

    /// Whether no board can have it: a board's converter never returns NaN.
    pub fn needs_simulated_pins(self) -> bool {
        self == Kind::SupplyNotANumber
    }

    /// Whether it is possible only with the firmware in this process.
    pub fn needs_process(self) -> bool {
        self == Kind::HostDeaf
    }

    /// Whether it is found by a threshold of the gain table: without thresholds it must be missed.
    pub fn needs_detection(self) -> bool {
        matches!(
            self,
            Kind::LinkEncoderFrozen
                | Kind::CartEncoderFrozen
                | Kind::EncoderJump
                | Kind::EncoderReversed
                | Kind::EncodersSwapped
                | Kind::MotorDead
                | Kind::MotorReversed
                | Kind::MotorStuck
                | Kind::EncoderWireOpen
        )
    }
}

use Fault as F;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_every_kind_in_order() {
        for (index, (kind, name, meaning, _)) in Kind::ALL.iter().enumerate() {
            assert_eq!(*kind as usize, index);
            assert!(!name.is_empty() && !meaning.is_empty());
        }
    }
}
