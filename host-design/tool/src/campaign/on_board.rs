//! Defects that only a board has, on the virtual board: its conditions at power-up, and the events in the tick of the
//! onset.

use core::ops::Range;

use rand::RngExt;
use rand_pcg::Pcg64;
use upright::boards::parts::PartInterface;
use upright_board::{
    Chip, Conditions, ExternalLevel, Image, Input, Pin, RegisterDefect, SensorDefect, Time,
    UNITS_PER_MICROSECOND as US, UNITS_PER_SECOND,
};

use upright_closed_loop::defects::{Defect, Trial};
use upright_design::table::TableValues;

use crate::in_the_loop::Event;

/// Registers of timer 1 on which the motor's force depends (RM0090, 17.4): ARR, RCR, CCMR1, CCER, BDTR.
const MOTOR_REGISTERS: [u32; 5] = [0x4001_002c, 0x4001_0030, 0x4001_0018, 0x4001_0020, 0x4001_0044];
/// Frequencies of crystals that are not this board's (Hz).
const WRONG_CRYSTALS: [u32; 4] = [4_000_000, 12_000_000, 16_000_000, 25_000_000];
/// The highest byte of the vector of HardFault.
const HARD_FAULT_VECTOR: u32 = 0x0800_000f;
/// An unmapped address.
const NOWHERE: u32 = 0x3000_0000;
/// A time after the beginning of a tick, at which it still runs.
const INSIDE: Time = 3 * US;
/// Time for which the supply of the chip is below the voltage detector's threshold.
const DIP: Time = 300 * US;

/// What only a board has of a defect.
pub(super) trait OnChip {
    /// Conditions of the trial's board, drawn within their tolerances.
    fn conditions(self, trial: &Trial, typical: Conditions) -> Conditions;

    /// Faults injected at power-up; without `guarded`, they disable the guard that this kind needs.
    fn at_power_up(self, trial: &Trial, guarded: bool) -> Vec<Input>;

    /// Whether it is present from power-up on, and prevents arming.
    fn begins_at_power_up(self) -> bool;

    /// Events in the first tick of the defect, for a board that receives from the host at the pin `receive`.
    fn events(self, trial: &Trial, table: &TableValues, image: &Image, receive: Pin) -> Vec<Event>;
}

impl OnChip for Defect {
    fn conditions(self, trial: &Trial, typical: Conditions) -> Conditions {
        let mut conditions = Conditions { seed: trial.seed, ..typical };
        // The watchdog's oscillator and the others within their tolerances (datasheet, LSI and HSI).
        conditions.lsi_hz = (17_000.0 + 30_000.0 * trial.size) as u32;
        conditions.hsi_hz = (16_000_000.0 * (1.0 + 0.01 * trial.sign * trial.size)) as u32;
        match self {
            Defect::CrystalMissing => conditions.crystal.hz = 0,
            Defect::CrystalWrong => {
                conditions.crystal.hz = WRONG_CRYSTALS[(trial.size * 3.99) as usize];
            }
            Defect::ChipWrong => conditions.chip = Chip::F446,
            _ => {}
        }
        conditions
    }

    fn at_power_up(self, trial: &Trial, guarded: bool) -> Vec<Input> {
        let register = MOTOR_REGISTERS[(trial.size * 4.99) as usize];
        match self {
            Defect::WriteLost if guarded => vec![Input::LoseWrite(register)],
            Defect::WriteLost => vec![Input::LoseWriteUnseen(register)],
            Defect::StalledTick | Defect::LockUp if !guarded => vec![Input::IgnoreWatchdog],
            Defect::StopBetweenTicks if !guarded => vec![Input::IgnoreBreak],
            Defect::StackOverflow if !guarded => vec![Input::IgnoreMpu],
            _ => Vec::new(),
        }
    }

    fn begins_at_power_up(self) -> bool {
        matches!(self, Defect::CrystalMissing | Defect::CrystalWrong | Defect::ChipWrong | Defect::WriteLost)
    }

    fn events(self, trial: &Trial, table: &TableValues, image: &Image, receive: Pin) -> Vec<Event> {
        let mut random = trial.random();
        let tick = (f64::from(table.tick_s) * UNITS_PER_SECOND as f64) as Time;
        let at = |after: Time, input: Input| Event::Input { after, input };
        let anywhere = (trial.size * tick as f64) as Time;
        let mut bit_of = |begin: u32, bytes: u32| Input::FlipBit {
            address: begin + random.random_range(0..bytes.max(1)),
            bit: random.random_range(0..8),
        };
        match self {
            Defect::StalledTick => vec![at(INSIDE, Input::Stall(Time::MAX / 2))],
            Defect::LockUp => vec![
                at(INSIDE, Input::FlipBit { address: HARD_FAULT_VECTOR, bit: 6 }),
                at(INSIDE, Input::Jump(NOWHERE)),
            ],
            Defect::CrystalStops => vec![at(anywhere, Input::StopCrystal)],
            Defect::StopBetweenTicks => {
                // At least the time of a tick's code away from both ticks.
                let when = tick / 10 + (trial.size * 0.7 * tick as f64) as Time;
                vec![Event::Stop { after: when, open: tick / 20 }]
            }
            Defect::BrownOut => {
                let volts = 2.0 + 0.6 * trial.size as f32;
                vec![at(anywhere, Input::ChipSupply(volts)), at(anywhere + DIP, Input::ChipSupply(3.3))]
            }
            Defect::SensorWire | Defect::MagnetMissing | Defect::FrameBit => {
                of_absolute_sensor(trial, table, tick, &mut random)
            }
            Defect::HostWireOpen => vec![at(0, Input::Level(receive, ExternalLevel::Open)), Event::CutLine],
            Defect::LineNoise => {
                let bauds = [9_600, 57_600, 115_200, 460_800, 500_000, 1_000_000];
                let mut bytes = |count: usize| (0..count).map(|_| random.random::<u8>()).collect::<Vec<_>>();
                bauds.iter().map(|&baud| Event::Bytes { bytes: bytes(20), baud }).collect()
            }
            Defect::LineFlood => {
                // Without a pause, for a third of the time after which a silent host is a fault.
                let ticks = if table.limits.link_ticks > 0 { table.limits.link_ticks / 3 } else { 50 };
                let bytes = (u64::from(ticks) * tick / (10 * UNITS_PER_SECOND / 460_800)) as usize;
                let bytes = (0..bytes).map(|i| if i % 7 == 0 { 0 } else { random.random::<u8>() }).collect();
                vec![Event::Bytes { bytes, baud: 460_800 }]
            }
            Defect::TableBit => {
                let table = gain_table(image);
                vec![at(anywhere, bit_of(table.start, table.end - table.start))]
            }
            Defect::RamBit => {
                // Half of these bits are in the state of the control task, which is a ninth of the memory.
                let control = image.object("local_resource_control").filter(|_| trial.sign > 0.0);
                let all = 0x2000_0000..image.symbol("__euninit").unwrap_or(0x2000_2000);
                let memory = control.unwrap_or(all);
                vec![at(anywhere, bit_of(memory.start, memory.end - memory.start))]
            }
            _ => Vec::new(),
        }
    }
}

/// Events of a defect of an absolute sensor.
fn of_absolute_sensor(trial: &Trial, table: &TableValues, tick: Time, random: &mut Pcg64) -> Vec<Event> {
    let at = |after: Time, input: Input| Event::Input { after, input };
    let encoder = trial.sensor;
    match (table.sensors[encoder].kind.interface(), trial.kind) {
        (Some(PartInterface::Analog), Defect::SensorWire) => {
            // It turns on all the time.
            let share = if trial.sign > 0.0 { 0.0 } else { 1.0 };
            let ticks = 0..trial.watched as Time;
            ticks.map(|since| at(since * tick, Input::Wiper(share))).collect()
        }
        (Some(PartInterface::TwoWires(part)), Defect::MagnetMissing) => {
            // It turns on all the time, and says in each tick that it has no magnet.
            let [address, first] = [part.address, part.register];
            let values = part.registers(None);
            let ticks = 0..trial.watched as Time;
            ticks
                .map(|since| at(since * tick, Input::Registers { encoder, address, first, values }))
                .collect()
        }
        (Some(PartInterface::TwoWires(_)), Defect::SensorWire) => {
            let defect = match (trial.sign > 0.0, trial.size > 0.5) {
                (true, true) => RegisterDefect::WireOpen,
                (true, false) => RegisterDefect::OtherAddress,
                (false, _) => RegisterDefect::WireGrounded,
            };
            vec![at(0, Input::RegisterDefect { encoder, defect })]
        }
        (Some(PartInterface::TwoWires(_)), Defect::FrameBit) => {
            let every = tick * (5 + (45.0 * trial.size) as Time);
            let holds = Input::RegisterDefect { encoder, defect: RegisterDefect::Holds };
            (0..trial.watched as Time * tick / every).map(|number| at(number * every, holds)).collect()
        }
        (_, Defect::SensorWire | Defect::MagnetMissing) => {
            let defect = match trial.kind {
                Defect::MagnetMissing => SensorDefect::NoMagnet,
                _ if trial.sign > 0.0 => SensorDefect::WireOpen,
                _ => SensorDefect::WireGrounded,
            };
            vec![at(0, Input::AngleDefect { encoder, defect })]
        }
        (_, Defect::FrameBit) => {
            let every = tick * (5 + (45.0 * trial.size) as Time);
            let show = |after, defect| at(after, Input::AngleDefect { encoder, defect });
            let one = |number: Time| {
                let bits = SensorDefect::FlippedBits(1 << random.random_range(0..16));
                let begin = number * every;
                [show(begin, bits), show(begin + tick / 2, SensorDefect::None)]
            };
            (0..trial.watched as Time * tick / every).flat_map(one).collect()
        }
        _ => Vec::new(),
    }
}

/// The gain table in RAM.
///
/// # Panics
/// If the image has no such table: it is one of ours.
fn gain_table(image: &Image) -> Range<u32> {
    image.object("local_init_table").unwrap_or_else(|| panic!("an image without a gain table in RAM"))
}
