//! Defects that are planted in a simulated machine, and the step that has to find each.

use core::fmt;
use core::str::FromStr;

use upright::board::Output;
use upright_closed_loop::harness::{Flow, HarnessError, Participant, Pins, World};
use upright_design::rig::{Link, PerJoint, Rig};
use upright_design::simulate::{Bench, Scenario, StepDefect};
use upright_design::table::TableValues;

use super::step::CommissionStep;
use crate::campaign::{Defect, Defective, Trial};

/// What is wrong in the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    /// A defect of the fault campaign, from power-up on.
    Campaign(Defect),
    StopMissing,
    SwitchMissing,
    SwitchesExchanged,
    CountsWrong,
    CartFriction,
    JointFriction,
}

/// A defect in a simulated machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Planted {
    what: What,
    /// Number of the sensor (0: cart).
    sensor: usize,
}

/// A defect's name on the command line, what is wrong, the sensor if it is in one, its description, and the step that
/// has to find it.
type PlantedRow = (&'static str, What, usize, &'static str, CommissionStep);

/// Force of the dry friction at the cart, as a share of the motor's force in the jog.
const STUCK: f64 = 1.5;

/// Dry friction torque of each joint, as a share of the largest torque of its link's weight: the sine of 9°.
const HELD: f64 = 0.15;

const ALL: [PlantedRow; 15] = {
    use CommissionStep::{Contacts, Excitation, Homing, Motor, Signs, Turns};
    use Defect::{
        CartEncoderFrozen, EncoderReversed, EncoderWireOpen, EncodersSwapped, LinkEncoderFrozen,
        MotorReversed, SupplySag,
    };
    use What::{
        Campaign, CartFriction, CountsWrong, JointFriction, StopMissing, SwitchMissing, SwitchesExchanged,
    };
    [
        ("emergency-stop-missing", StopMissing, 0, "the emergency stop never opens", Contacts),
        ("limit-switch-missing", SwitchMissing, 0, "the limit switch at the high end never opens", Contacts),
        ("limit-switches-exchanged", SwitchesExchanged, 0, "the two limit switches are exchanged", Contacts),
        ("supply-sag", Campaign(SupplySag), 0, "the supply is too low", Contacts),
        (
            "cart-encoder-reversed",
            Campaign(EncoderReversed),
            0,
            "the cart's encoder counts backwards",
            Homing,
        ),
        ("cart-encoder-frozen", Campaign(CartEncoderFrozen), 0, "the cart's encoder does not count", Homing),
        ("cart-counts-wrong", CountsWrong, 0, "the cart's encoder yields twice the expected counts", Homing),
        ("encoder-reversed", Campaign(EncoderReversed), 1, "the encoder of link 1 counts backwards", Signs),
        ("encoder-frozen", Campaign(LinkEncoderFrozen), 1, "the encoder of link 1 does not count", Signs),
        ("encoder-wire-open", Campaign(EncoderWireOpen), 1, "a wire of the encoder of link 1 is open", Signs),
        (
            "encoders-swapped",
            Campaign(EncodersSwapped),
            1,
            "the encoders of links 1 and 2 are exchanged; with one link those of cart and link",
            Signs,
        ),
        ("counts-wrong", CountsWrong, 1, "the encoder of link 1 yields twice the expected counts", Turns),
        ("motor-reversed", Campaign(MotorReversed), 0, "the motor's wires are exchanged", Motor),
        (
            "cart-stuck",
            CartFriction,
            0,
            "the cart's friction is more than the motor's force in the jog",
            Motor,
        ),
        (
            "joints-stick",
            JointFriction,
            0,
            "the dry friction of each joint holds its link up to 9° from hanging",
            Excitation,
        ),
    ]
};

/// A name that no defect has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no such defect; give one of {}", ALL.map(|row| row.0).join(", "))]
pub struct NoSuchDefect;

impl Planted {
    /// Every defect.
    pub fn all() -> impl Iterator<Item = Self> {
        ALL.iter().map(|&(_, what, sensor, ..)| Self { what, sensor })
    }

    fn row(self) -> &'static PlantedRow {
        // Every defect is made from a row.
        ALL.iter().find(|row| (row.1, row.2) == (self.what, self.sensor)).unwrap_or(&ALL[0])
    }

    /// What is wrong.
    pub fn meaning(self) -> &'static str {
        self.row().3
    }

    /// The step that has to find it in a rig with this many links.
    pub fn found_in(self, links: usize) -> CommissionStep {
        match self.what {
            // With one link, its plug can only be exchanged with the cart's.
            What::Campaign(Defect::EncodersSwapped) if links == 1 => CommissionStep::Homing,
            _ => self.row().4,
        }
    }

    /// Changes the machine itself.
    pub(super) fn change(self, machine: &mut Rig, table: &TableValues) {
        let Some(chain) = machine.chain().cloned() else { return };
        let friction = &mut machine.reality.friction;
        match self.what {
            What::CartFriction => friction.cart_friction_n = STUCK * f64::from(table.limits.jog_force_n),
            What::JointFriction => {
                let torque = |link: &Link| HELD * link.mass_kg * link.centre_m() * chain.gravity_m_per_s2;
                friction.joint_friction_n_m = PerJoint::each(chain.links.iter().map(torque).collect());
            }
            _ => {}
        }
    }
}

impl fmt::Display for Planted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.row().0)
    }
}

impl FromStr for Planted {
    type Err = NoSuchDefect;

    fn from_str(name: &str) -> Result<Self, NoSuchDefect> {
        let row = ALL.iter().find(|row| row.0 == name).ok_or(NoSuchDefect)?;
        Ok(Self { what: row.1, sensor: row.2 })
    }
}

/// A defect between machine and firmware, tick by tick.
pub(super) struct DefectWires<'a> {
    planted: Planted,
    defective: Option<Defective<'a>>,
    at_power_up: Option<u32>,
}

impl<'a> DefectWires<'a> {
    pub(super) fn new(rig: &Rig, table: &'a TableValues, scenario: &Scenario, planted: Planted) -> Self {
        let of_kind = |kind: Defect| {
            let trial = Trial::by_hand(kind, scenario, table, planted.sensor, scenario.seed);
            // It is there from power-up on.
            Defective::new(rig, table, trial, Some(1))
        };
        let defective = match planted.what {
            What::Campaign(kind) => Some(of_kind(kind)),
            _ => None,
        };
        Self { planted, defective, at_power_up: None }
    }
}

impl Participant for DefectWires<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        if self.planted.what == What::CartFriction {
            world.bench.spoil(StepDefect::Jammed);
        }
        self.defective.act(world, output)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        match self.planted.what {
            What::StopMissing => pins.contacts.emergency_stop = false,
            What::SwitchMissing => pins.contacts.limit_high = false,
            What::SwitchesExchanged => {
                std::mem::swap(&mut pins.contacts.limit_low, &mut pins.contacts.limit_high);
            }
            What::CountsWrong => {
                let count = &mut pins.raw_counts[self.planted.sensor];
                let begin = *self.at_power_up.get_or_insert(*count);
                *count = Bench::reading(self.planted.sensor, count.wrapping_mul(2).wrapping_sub(begin));
            }
            What::Campaign(_) | What::CartFriction | What::JointFriction => {}
        }
        self.defective.pins(world, pins)
    }
}
