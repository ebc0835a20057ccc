//! The kinds of defects, and the outcome that each must have.

use strum::{IntoStaticStr, VariantArray};
use upright::protocol::simulated_pins::InjectedFault;
use upright::supervision::fault::Fault as F;
use upright::supervision::inhibits::Inhibits;

use super::expected::Expected::{self, *};
use super::expected::Ticks::*;

/// What must be there for a defect to be possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Nothing: every place that runs the firmware can have it.
    Nothing,
    /// Pins in memory: a board's converter never returns NaN.
    SimulatedPins,
    /// A host that can stop reading: not a person's page.
    Process,
    /// A board.
    Board,
}

/// Defines [`Defect`] from rows: what it needs, a description, and the outcome that it must have.
macro_rules! defects {
    ($($name:ident $needs:ident $meaning:literal => $expected:expr;)*) => {
        /// A kind of defect.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        #[derive(IntoStaticStr, VariantArray)]
        #[serde(rename_all = "kebab-case")]
        #[strum(serialize_all = "kebab-case")]
        pub enum Defect {
            $(#[doc = concat!("Defect: ", $meaning, ".")] $name,)*
        }

        impl Defect {
            /// One-line description.
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$name => $meaning,)* }
            }

            /// The outcome that it must have.
            pub const fn expected(self) -> Expected {
                match self { $(Self::$name => $expected,)* }
            }

            /// What must be there for it to be possible.
            pub const fn needs(self) -> Needs {
                match self { $(Self::$name => Needs::$needs,)* }
            }
        }
    };
}

defects! {
    SupplyNotANumber SimulatedPins "the measured supply voltage is NaN" => Fault(F::NotFinite, Exactly(1));
    SupplySag Nothing "the supply stays below its lowest permitted voltage" => Fault(F::Supply, Supply);
    SupplyDip Nothing "the supply is too low for less than the time that makes it a fault" => Ignored;
    SupplySurge Nothing "the supply rises to 1.3 to 1.6 times the motor's voltage, as when the motor brakes" => Fault(F::Supply, Exactly(3));
    SupplySpike Nothing "the same for one or two ticks" => Ignored;
    EmergencyStop Nothing "pressed for one tick" => Fault(F::EmergencyStop, Exactly(1));
    DriverFault Nothing "reported for one tick" => Fault(F::Driver, Exactly(1));
    LimitSwitch Nothing "one of them pressed, or its wire open, for three ticks" => Fault(F::LimitSwitch, Exactly(1));
    OneOverrun Nothing "one or two ticks late" => Ignored;
    Overruns Nothing "three ticks in a row late" => Fault(F::Overrun, Exactly(3));
    LinkEncoderFrozen Nothing "a link's counter stands still" => Off(10);
    CartEncoderFrozen Nothing "the cart's counter stands still" => Off(10);
    BadSample Nothing "one measurement wrong by 2 to 20 thresholds" => Counted;
    EncoderJump Nothing "all measurements of an encoder wrong by 2 to 20 thresholds" => Off(3);
    EncoderReversed Nothing "an encoder counts backwards" => Off(5);
    EncodersSwapped Nothing "two neighbours' counters are swapped" => Off(5);
    CountsLost Nothing "an encoder loses a count every 5 to 50 ticks" => Bounded;
    SensorLate Nothing "an encoder's measurements are 1 to 20 ticks late" => Bounded;
    SensorIntermittent Nothing "two of three measurements are wrong" => Bounded;
    MotorDead Nothing "the motor produces no force" => Off(20);
    MotorReversed Nothing "the motor's force has the wrong sign" => Off(5);
    MotorStuck Nothing "the motor produces full force to one side" => Off(5);
    MotorWeak Nothing "the motor produces 10 to 50 % of the force" => Bounded;
    Push Nothing "a push by hand for 5 ms to 1 s at the cart or a link, with 0.1 to 0.9 of the force that balancing survives; in other states at the cart for 50 ms, with up to the force limit" => Survived;
    HostSilent Nothing "a host that commands the set-point sends nothing more" => Fault(F::LinkLost, Link);
    HostDeaf Process "the host stops reading the serial line" => Ignored;
    FrameDamaged Nothing "a disarm command with a wrong bit" => Ignored;
    FrameTruncated Nothing "a disarm command without its last bytes" => Ignored;
    FrameReplayed Nothing "a disarm command with an old number" => Ignored;
    Rubbish Nothing "random bytes on the serial line" => Ignored;
    SetpointNotANumber Nothing "a set-point of NaN or infinity" => Ignored;
    SetpointOutOfRange Nothing "a set-point beyond the rail" => Ignored;
    ArmUnhomed Nothing "arming before homing" => Refused(Inhibits::NOT_HOMED);
    ArmHanging Nothing "arming while the links hang" => Refused(Inhibits::TILTED);
    ArmStopped Nothing "arming with the emergency stop pressed" => Refused(Inhibits::FAULT.union(Inhibits::EMERGENCY_STOP));
    ArmHeld Nothing "an arm command that is repeated while a fault is cleared" => Refused(Inhibits::HELD);
    Panic Board "the firmware panics" => Dead;
    HardFault Board "the firmware accesses memory that does not exist" => Dead;
    StackOverflow Board "the firmware's stack overflows" => Dead;
    StalledTick Board "the core is stalled during a tick" => Fault(F::Watchdog, Exactly(3));
    LockUp Board "a processor fault whose handler faults as well" => Fault(F::Watchdog, Exactly(3));
    CrystalStops Board "the crystal stops oscillating" => Fault(F::Clock, Exactly(1));
    CrystalMissing Board "no crystal at power-up" => Refused(Inhibits::FAULT);
    CrystalWrong Board "a crystal of 4, 12, 16 or 25 MHz at power-up" => Refused(Inhibits::FAULT);
    ChipWrong Board "the image for an STM32F405 on an STM32F446" => Refused(Inhibits::FAULT);
    BrownOut Board "the chip's own supply is at 2.0 to 2.6 V for 0.3 ms" => Fault(F::Board, Exactly(2));
    StopBetweenTicks Board "the emergency stop opens and closes again between two ticks" => Fault(F::EmergencyStop, Exactly(1));
    HostWireOpen Board "the wire from a host that commands the set-point is open" => Fault(F::LinkLost, Link);
    LineNoise Board "random bytes at wrong baud rates on the serial line" => Ignored;
    LineFlood Board "bytes without a pause on the serial line" => Ignored;
    TableBit Board "a bit of the gain table in use changes" => Fault(F::Crash, Exactly(9));
    RamBit Board "a bit of the firmware's variables or stack changes" => Bounded;
    WriteLost Board "a write to a register of the motor's timer is lost at power-up" => Refused(Inhibits::FAULT);
    EncoderWireOpen Nothing "a wire of an encoder is open: its count alternates between two values" => Off(10);
    CartJammed Nothing "the cart of a stepper is stuck" => Off(20);
    PulsesMissing Nothing "a stepper misses 50 to 95 % of its pulses" => Off(20);
    SomePulsesMissing Nothing "a stepper misses 5 to 50 % of its pulses" => Bounded;
    StepsLost Nothing "a stepper misses all pulses of 1 to 10 ticks, then follows again" => Bounded;
    SensorDead Nothing "an absolute sensor reads 0 or all ones: its wire is open, or it has lost its magnet" => Off(10);
    SensorBit Nothing "a bit of an absolute sensor's reading is wrong in one of 5 to 50 ticks" => Bounded;
    SampleInvalid SimulatedPins "a board knows that all readings of an absolute sensor are bad" => Fault(F::Encoder, Exactly(3));
    SensorWire Board "the data wire of an absolute sensor is open, or has a short circuit, or it does not answer at its address" => Fault(F::Encoder, Exactly(3));
    MagnetMissing Board "the magnet of an absolute sensor is missing, which the sensor says" => Fault(F::Encoder, Exactly(3));
    FrameBit Board "a bit of an absolute sensor's frame, parity and error flag included, is wrong in one of 5 to 50 ticks; one on two wires holds its data wire" => Counted;
}

impl Defect {
    /// Every kind of defect.
    pub const ALL: &[Self] = Self::VARIANTS;

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The fault inside the microcontroller, if it is one.
    pub fn inside_the_microcontroller(self) -> Option<InjectedFault> {
        match self {
            Self::Panic => Some(InjectedFault::Panic),
            Self::HardFault => Some(InjectedFault::HardFault),
            Self::StackOverflow => Some(InjectedFault::StackOverflow),
            _ => None,
        }
    }

    /// Whether there is a guard that can be disabled: without it, the defect must be missed.
    pub fn needs_guard(self) -> bool {
        matches!(
            self,
            Self::WriteLost | Self::StalledTick | Self::LockUp | Self::StopBetweenTicks | Self::StackOverflow
        )
    }

    /// Whether only an absolute sensor can have it.
    pub fn is_of_absolute(self) -> bool {
        self.is_of_frames()
            || matches!(self, Self::SensorDead | Self::SensorBit | Self::SampleInvalid | Self::SensorWire)
    }

    /// Whether not every sensor can have it: only absolute ones, or only encoders.
    pub fn is_of_some_sensors(self) -> bool {
        self.is_of_absolute() || self == Self::EncoderWireOpen
    }

    /// Whether only an absolute sensor on a bus can have it.
    pub fn is_of_frames(self) -> bool {
        matches!(self, Self::MagnetMissing | Self::FrameBit)
    }

    /// Whether it is found by a threshold of the gain table: without thresholds it must be missed.
    pub fn needs_detection(self) -> bool {
        matches!(
            self,
            Self::LinkEncoderFrozen
                | Self::CartEncoderFrozen
                | Self::EncoderJump
                | Self::EncoderReversed
                | Self::EncodersSwapped
                | Self::MotorDead
                | Self::MotorReversed
                | Self::MotorStuck
                | Self::EncoderWireOpen
                | Self::CartJammed
                | Self::PulsesMissing
                | Self::SensorDead
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_defect_has_the_name_that_serde_gives_it_and_no_other_has() {
        let names: std::collections::HashSet<_> = Defect::ALL.iter().map(|defect| defect.name()).collect();
        assert_eq!(names.len(), Defect::ALL.len());
        for &defect in Defect::ALL {
            assert_eq!(serde_json::to_value(defect).unwrap(), defect.name());
        }
    }

    #[test]
    fn a_defect_that_the_simulated_pins_can_have_needs_no_board() {
        let needs_board = Defect::ALL.iter().filter(|defect| defect.needs() == Needs::Board);
        assert_eq!(needs_board.count(), 20);
        assert_eq!(Defect::EncoderWireOpen.needs(), Needs::Nothing);
    }
}
