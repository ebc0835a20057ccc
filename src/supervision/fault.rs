//! The faults: one list for code, documentation and tests.
//!
//! A new fault gets a variant with the next code, an [`Entry`] in [`Fault::ALL`] and a place in [`Fault::PRECEDENCE`];
//! the test of the documentation then fails until `docs/faults.md` lists it, too.

use serde::{Deserialize, Serialize};

/// Why the motor was turned off. Latched: the first cause stays until it is cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum Fault {
    /// A measurement, the estimate or the force is not a finite number.
    NotFinite = 1,
    /// A link leans further than the limit.
    Angle = 2,
    /// The cart is beyond its soft limits.
    Rail = 3,
    /// The cart is faster than the limit.
    Speed = 4,
    /// A limit switch is pressed, or its wire is open.
    LimitSwitch = 5,
    /// The emergency stop is pressed, or its wire is open.
    EmergencyStop = 6,
    /// The power stage has reported a fault.
    Driver = 7,
    /// The supply of the power stage is too low or too high.
    Supply = 8,
    /// Measurements of one encoder contradict the model.
    Encoder = 9,
    /// An encoder stands still while the model predicts motion.
    Frozen = 10,
    /// The rig does not move as the motor's force should move it.
    Motor = 11,
    /// The law has requested more than the largest force for too long.
    Saturated = 12,
    /// Ticks were not finished in time.
    Overrun = 13,
    /// The host that commands the set-point is silent.
    LinkLost = 14,
    /// The gain table has changed in memory.
    Table = 15,
    /// Ticks stopped: the independent watchdog has reset the microcontroller.
    Watchdog = 16,
    /// The program has failed: panic, processor fault, stack overflow or changed memory.
    Crash = 17,
    /// The crystal or the PLL has failed to start, or the crystal has the wrong frequency.
    Clock = 18,
    /// The chip is the wrong one, a register of the motor's timer has lost what was written to it, or the chip's
    /// supply is low.
    Board = 19,
    /// The cart or a link is too far from the planned motion.
    TrackingError = 20,
    /// The measurements are further from the model than after any push that the rig survives.
    Disturbed = 21,
    /// The code in flash is not as it was linked.
    Image = 22,
}

/// Longest time from a fault's first effect on the firmware's inputs to motor off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reaction {
    /// This many ticks; 1: in the same tick.
    Ticks(u32),
    /// This many ticks after the time that the rig file gives under this key of `[limits]`.
    After(&'static str, u32),
    /// Not a number of ticks: the text says how or when the motor is turned off.
    Hardware(&'static str),
}

impl core::fmt::Display for Reaction {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Reaction::Ticks(ticks) => write!(f, "{ticks}"),
            Reaction::After(key, ticks) => write!(f, "`{key}` + {ticks}"),
            Reaction::Hardware(what) => f.write_str(what),
        }
    }
}

/// A fault's row in the table of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// The fault, whose discriminant is the code.
    pub fault: Fault,
    /// Short name.
    pub name: &'static str,
    /// When it is raised.
    pub condition: &'static str,
    /// Longest time to motor off.
    pub reaction: Reaction,
    /// What to do about it.
    pub remedy: &'static str,
}

impl Fault {
    /// Every fault, by code.
    pub const ALL: [Entry; 22] = [
        Entry {
            fault: Fault::NotFinite,
            name: "not finite",
            condition: "a measurement, the estimate or the force is not a finite number",
            reaction: Reaction::Ticks(1),
            remedy: "check the supply's measurement; if it comes again, report it with the telemetry before it",
        },
        Entry {
            fault: Fault::Angle,
            name: "angle",
            condition: "a link leans further than `angle_rad` from the vertical while the rig balances",
            reaction: Reaction::Ticks(1),
            remedy: "let the links hang, then raise them again; smaller disturbances, or a design with more force",
        },
        Entry {
            fault: Fault::Rail,
            name: "rail",
            condition: "the cart is closer than `rail_margin_m` to an end of the rail; while raising or lowering, than a \
                        quarter of it",
            reaction: Reaction::Ticks(1),
            remedy: "push the cart to the middle; if it drifted there, an encoder loses counts, or the rail is not level",
        },
        Entry {
            fault: Fault::Speed,
            name: "speed",
            condition: "the cart is faster than `speed_m_per_s`; while raising or lowering, than the swing-up's limit",
            reaction: Reaction::Ticks(1),
            remedy: "smaller disturbances, or a higher limit if the rig can take it",
        },
        Entry {
            fault: Fault::LimitSwitch,
            name: "limit switch",
            condition: "a limit switch is pressed, or its wire is open, while the motor is on",
            reaction: Reaction::Ticks(1),
            remedy: "push the cart off the switch; if it was not there, check the wire, and home again",
        },
        Entry {
            fault: Fault::EmergencyStop,
            name: "emergency stop",
            condition: "the emergency stop is pressed, or its wire is open; it also cuts the power stage by hardware",
            reaction: Reaction::Ticks(1),
            remedy: "release the emergency stop, then clear",
        },
        Entry {
            fault: Fault::Driver,
            name: "driver",
            condition: "the power stage has reported a fault since the last tick, however briefly",
            reaction: Reaction::Ticks(1),
            remedy: "check motor wiring, short circuits and temperature of the power stage",
        },
        Entry {
            fault: Fault::Supply,
            name: "supply",
            condition: "the supply is below `supply_min_v` for `supply_time_s`, or above 1.25 times the motor's `supply_v` for \
                        three ticks",
            reaction: Reaction::After("supply_time_s", 1),
            remedy: "check the supply and its current limit; if it rises while the motor brakes, give it a capacitor or a brake \
                     chopper",
        },
        Entry {
            fault: Fault::Encoder,
            name: "encoder",
            condition: "three readings in a row of one encoder contradict the model, or fail the check of an \
                        absolute sensor: it jumps, or is reversed, swapped or late",
            reaction: Reaction::Ticks(3),
            remedy: "check plug, wire and coupling of this encoder; if it is the cart's, the motor too; on a \
                     stepper the drive in any case; home, and check the signs again",
        },
        Entry {
            fault: Fault::Frozen,
            name: "frozen encoder",
            condition: "an encoder stands still although the model moves it; while balancing with a force, also \
                        one with an open wire",
            reaction: Reaction::Ticks(10),
            remedy: "check plug, wire and coupling of this encoder, and on a stepper the drive; home, and check the signs \
                     again",
        },
        Entry {
            fault: Fault::Motor,
            name: "motor",
            condition: "the rig does not move as the motor's force should move it: the motor is dead, weak, \
                        stuck or reversed, or the cart has hit something",
            reaction: Reaction::Ticks(20),
            remedy: "check motor, coupling and belt, and the masses in the rig file; on a stepper also its \
                     driver, current and switches of the microsteps; keep hands off the cart",
        },
        Entry {
            fault: Fault::Saturated,
            name: "saturated",
            condition: "the law asks for more than the largest force in every tick of `saturation_time_s`",
            reaction: Reaction::After("saturation_time_s", 1),
            remedy: "find out what holds the cart; smaller disturbances, or a stronger motor",
        },
        Entry {
            fault: Fault::Overrun,
            name: "overrun",
            condition: "three ticks in a row were not finished in time; single ones are counted",
            reaction: Reaction::Ticks(3),
            remedy: "give the rig a longer `period_s`, or build the firmware with optimisation",
        },
        Entry {
            fault: Fault::LinkLost,
            name: "link lost",
            condition: "no command for `link_timeout_s` although the host has commanded a set-point while balancing",
            reaction: Reaction::After("link_timeout_s", 1),
            remedy: "check the cable; the host must send beats while it commands the set-point",
        },
        Entry {
            fault: Fault::Table,
            name: "table",
            condition: "the gain table no longer fits its checksum",
            reaction: Reaction::Hardware("at most two passes over the table"),
            remedy: "flash the firmware again; if it comes again, the memory is damaged",
        },
        Entry {
            fault: Fault::Watchdog,
            name: "watchdog",
            condition: "ticks stopped, so the watchdog has reset the microcontroller",
            reaction: Reaction::Hardware("2 to 6 periods, by the watchdog"),
            remedy: "report it with the firmware's version; home and check the signs again",
        },
        Entry {
            fault: Fault::Crash,
            name: "crash",
            condition: "panic, processor fault, stack overflow, or a changed bit of table or code; the watchdog \
                        has reset the microcontroller",
            reaction: Reaction::Hardware("at once, in the handler"),
            remedy: "report it with the firmware's version; home and check the signs again",
        },
        Entry {
            fault: Fault::Clock,
            name: "clock",
            condition: "the crystal or the PLL has not started, or the crystal has another frequency than the \
                        board's; or a stepper's pulses did not end in time",
            reaction: Reaction::Ticks(1),
            remedy: "flash the image for this board, or check its crystal; then reset",
        },
        Entry {
            fault: Fault::Board,
            name: "board",
            condition: "the chip is not the one that the image is for, a register of the motor's timer has lost what was \
                        written to it, or the chip's own supply was below 2.8 V",
            reaction: Reaction::Ticks(1),
            remedy: "flash the image for this board, check its 3.3 V; then reset",
        },
        Entry {
            fault: Fault::TrackingError,
            name: "tracking error",
            condition: "while raising or lowering, cart or link are further from the planned motion than the swing-up's \
                        `deviation_m` or `deviation_rad`",
            reaction: Reaction::Ticks(1),
            remedy: "let the links hang; check masses and friction in the rig file, and that nothing touches the links",
        },
        Entry {
            fault: Fault::Disturbed,
            name: "disturbed",
            condition: "three readings in a row are further from the model than after any push that the rig \
                        survives: pushed too hard, or an encoder is reversed or swapped, or the motor is stuck",
            reaction: Reaction::Ticks(3),
            remedy: "let the links hang, then raise them again; if nobody pushed, check encoders and motor",
        },
        Entry {
            fault: Fault::Image,
            name: "image",
            condition: "at the start, the code in flash is not as it was linked: it is damaged, or `upright \
                        firmware build` has not made this image",
            reaction: Reaction::Hardware("the motor never comes on"),
            remedy: "flash the firmware again; if it comes again, the memory is damaged",
        },
    ];

    /// Which fault is latched when several occur in one tick: the first of these. Inputs come first, then the limits
    /// on the estimate, then the tests of the innovation, and last what is checked after the motor was driven.
    ///
    /// [`Fault::NotFinite`] is listed once but has two checks: that of the supply voltage comes after the limit
    /// switches, that of the requested force after the overrun. A [`Fault::Motor`] found by rejected measurements of
    /// several sensors has the place of [`Fault::Encoder`]. [`Fault::Watchdog`] and [`Fault::Crash`] reset the
    /// microcontroller, and [`Fault::Image`] is found before the first tick.
    pub const PRECEDENCE: [Fault; 19] = [
        Fault::Clock,
        Fault::Board,
        Fault::EmergencyStop,
        Fault::Driver,
        Fault::LimitSwitch,
        Fault::NotFinite,
        Fault::Supply,
        Fault::Overrun,
        Fault::Rail,
        Fault::Angle,
        Fault::TrackingError,
        Fault::Speed,
        Fault::Encoder,
        Fault::Frozen,
        Fault::Motor,
        Fault::Disturbed,
        Fault::Saturated,
        Fault::LinkLost,
        Fault::Table,
    ];

    /// The fault's number in telemetry and documentation.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The fault's row in [`Fault::ALL`].
    pub fn entry(self) -> &'static Entry {
        const ALL: &[Entry] = &Fault::ALL;
        // A test checks that every entry is at the index given by its code.
        ALL.get(self as usize - 1).unwrap_or(&ALL[0])
    }

    /// Whether the rig has left what the control law holds, while motor and sensors may be sound.
    pub fn is_fall(self) -> bool {
        let of_state = matches!(self, Fault::Angle | Fault::Rail | Fault::Speed | Fault::TrackingError);
        of_state || matches!(self, Fault::Disturbed | Fault::Saturated)
    }

    /// Whether positions can no longer be trusted after this fault, so that homing and sign check are due again.
    pub fn loses_positions(self) -> bool {
        matches!(self, Fault::Encoder | Fault::Frozen | Fault::Watchdog | Fault::Crash)
    }

    /// Whether a drive with pulses may still bring the cart to rest after this fault, before it lets go of it. After
    /// the others, it lets go at once: it or the firmware may be at fault, or something is in the cart's way.
    pub fn leaves_drive_working(self) -> bool {
        let of_cart = matches!(self, Fault::Rail | Fault::Speed | Fault::LimitSwitch | Fault::Saturated);
        let of_links = matches!(self, Fault::Angle | Fault::Encoder | Fault::Frozen | Fault::TrackingError);
        of_cart || of_links || self == Fault::LinkLost
    }

    /// Whether the motor's sign has to be checked again after this fault: the motor, or the encoder that it was
    /// checked against, is in doubt.
    pub fn doubts_motor(self) -> bool {
        self.loses_positions() || matches!(self, Fault::Motor | Fault::Disturbed)
    }
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.entry().name)
    }
}

/// A latched fault: what, when, and at which sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cause {
    /// The fault.
    pub fault: Fault,
    /// Number of the tick since the start of the firmware.
    pub tick: u32,
    /// The sensor at which it was found (0: cart, 1: first link …), if it concerns one.
    pub sensor: Option<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_is_at_the_index_of_its_code() {
        for (entry, code) in Fault::ALL.iter().zip(1..) {
            assert_eq!(entry.fault.code(), code);
            assert_eq!(entry.fault.entry(), entry);
            assert!(!entry.name.is_empty() && !entry.condition.is_empty() && !entry.remedy.is_empty());
        }
    }
}
