//! Ways in which a table may have been described wrongly.

use core::f64::consts::PI;

use upright_design::number::significant;

use super::columns::RecordingColumns;
use super::reading::{AngleReference, AngleZero};
use super::text::RecordingTable;

/// Degrees per radian.
const DEGREES: f64 = 180.0 / PI;
/// Wrong counts per turn, or steps of a motor's pulses, that are tried.
pub(crate) const FACTORS: [f64; 6] = [0.25, 1.0 / 3.0, 0.5, 2.0, 3.0, 4.0];
/// Wrong units of a cart's position that are tried: mm for m and so on.
const LENGTHS: [f64; 6] = [1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3];

/// A way in which a table was described wrongly. Channels are cart (0) and links.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Misreading {
    /// A column counts in the other sense.
    Reversed(usize),
    /// The drive has the other sign.
    Drive,
    /// The columns of two links are exchanged.
    Exchanged(usize, usize),
    /// A column gives this many times the motion.
    Scaled(usize, f64),
    /// An angle against the vertical is that of the link below and this many times the angle of the joint.
    Joint(usize, f64),
    /// All angles are this many times those of the motion.
    AllScaled(f64),
    /// The angles are measured against the vertical although it was said against the link below, or the reverse.
    Reference,
    /// The angles are 0 with the links upright although it was said hanging, or the reverse.
    Zero,
}

impl Misreading {
    /// Whether both are one error: the same, or two factors of a column.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        match (*self, *other) {
            (Misreading::Scaled(one, _), Misreading::Scaled(two, _))
            | (Misreading::Joint(one, _), Misreading::Joint(two, _)) => one == two,
            (Misreading::AllScaled(_), Misreading::AllScaled(_)) => true,
            (Misreading::AllScaled(_), Misreading::Scaled(channel, _))
            | (Misreading::Scaled(channel, _), Misreading::AllScaled(_)) => channel > 0,
            _ => self == other,
        }
    }
}

/// What a table was said to be, in the words of its columns and of the options.
#[derive(Debug, Clone, PartialEq)]
pub struct SaidOfTable {
    /// Names of the columns of cart and links, and of the drive.
    names: Vec<String>,
    drive: Option<String>,
    has_cart: bool,
    is_absolute: bool,
    is_upright: bool,
}

impl SaidOfTable {
    /// Every misreading of the sense of columns: sets of columns, of which the model can tell the ones from the others.
    pub(crate) fn senses(&self) -> Vec<Vec<Misreading>> {
        let first = usize::from(!self.has_cart);
        let channels = self.names.len() - first;
        let of = |set: usize| -> Vec<Misreading> {
            let reversed = (0..channels).filter(|channel| set >> channel & 1 == 1);
            match set.count_ones() as usize == channels {
                true => vec![Misreading::Drive],
                false => reversed.map(|channel| Misreading::Reversed(first + channel)).collect(),
            }
        };
        // Seen from behind, a machine moves in the same way: without a force, a set is the same as all others. Of
        // both the smaller one, of two that are equally large that without the first column.
        let is_smaller = |set: &usize| {
            let twice = 2 * set.count_ones() as usize;
            twice < channels || (twice == channels && set & 1 == 0)
        };
        (1..1 << channels).filter(|set| self.drive.is_some() || is_smaller(set)).map(of).collect()
    }

    /// Every misreading by itself that is none of the sense.
    pub(crate) fn others(&self) -> Vec<Misreading> {
        let links = 1..self.names.len();
        let pairs = links.clone().flat_map(|one| (one + 1..self.names.len()).map(move |other| (one, other)));
        let mut all: Vec<Misreading> = pairs.map(|(one, other)| Misreading::Exchanged(one, other)).collect();
        let angles = FACTORS.into_iter().chain([DEGREES, 1.0 / DEGREES]);
        all.extend(angles.clone().map(Misreading::AllScaled));
        if self.names.len() > 2 {
            all.extend(links.flat_map(|link| angles.clone().map(move |by| Misreading::Scaled(link, by))));
            all.push(Misreading::Reference);
        }
        if self.is_absolute {
            let by = FACTORS.into_iter().chain([-1.0]);
            let upper = 2..self.names.len();
            all.extend(upper.flat_map(|link| by.clone().map(move |by| Misreading::Joint(link, by))));
        }
        if self.has_cart {
            let lengths = FACTORS.into_iter().chain(LENGTHS);
            all.extend(lengths.map(|by| Misreading::Scaled(0, by)));
        }
        // Without a drive, a table whose first link hangs nowhere is refused before.
        if self.drive.is_some() {
            all.push(Misreading::Zero);
        }
        all
    }

    /// The names of all columns with a sense but those of `channels`.
    pub(crate) fn names_without(&self, channels: &[usize]) -> Vec<String> {
        let first = usize::from(!self.has_cart);
        let names = self.names.iter().enumerate().skip(first);
        let names = names.filter(|(channel, _)| !channels.contains(channel)).map(|(_, name)| name.clone());
        names.chain(self.drive.clone()).collect()
    }

    /// What is wrong, and what to say instead.
    pub(crate) fn explain(&self, misreading: Misreading) -> String {
        match misreading {
            Misreading::Reversed(channel) => {
                let name = &self.names[channel];
                format!(
                    "column {name} counts in the other sense: say --reversed {name}, or leave it out there"
                )
            }
            Misreading::Drive => {
                let name = self.drive.as_deref().unwrap_or_default();
                format!("column {name} has the other sign: say --reversed {name}, or leave it out there")
            }
            Misreading::Exchanged(one, other) => format!(
                "columns {} and {} are exchanged: exchange their names with --columns",
                self.names[one], self.names[other]
            ),
            Misreading::Scaled(channel, by) => {
                self.explain_scale(&format!("column {}", self.names[channel]), channel, by)
            }
            Misreading::AllScaled(by) if self.names.len() == 2 => {
                self.explain_scale(&format!("column {}", self.names[1]), 1, by)
            }
            Misreading::AllScaled(by) => self.explain_scale("every column of an angle", 1, by),
            Misreading::Joint(link, by) => format!(
                "{} is {} and {} times the angle of joint {link}: correct its encoder's sense or counts before adding up",
                self.names[link],
                self.names[link - 1],
                significant(by, 3)
            ),
            Misreading::Reference if self.is_absolute => {
                "the angles are measured against the link below: say --angles relative".to_owned()
            }
            Misreading::Reference => {
                "the angles are measured against the vertical: say --angles absolute".to_owned()
            }
            Misreading::Zero if self.is_upright => {
                "the angles are 0 with the links hanging: say --zero hanging".to_owned()
            }
            Misreading::Zero => "the angles are 0 with the links upright: say --zero upright".to_owned(),
        }
    }

    fn explain_scale(&self, what: &str, channel: usize, by: f64) -> String {
        let name = &self.names[channel];
        let is_near = |other: f64| (by / other - 1.0).abs() < 1e-9;
        if channel > 0 && (is_near(DEGREES) || is_near(1.0 / DEGREES)) {
            let (unit, short) = if by > 1.0 { ("degrees", "deg") } else { ("radians", "rad") };
            return format!("{what} is in {unit}: call it angle_{channel}_{short}");
        }
        let remedy = match channel {
            _ if !name.to_lowercase().contains("counts") => "correct its unit",
            0 => "correct encoder_step_m in the file",
            _ => "correct --counts-per-turn, or encoder_counts_per_rev in the file",
        };
        format!("{what} gives {} times the motion: {remedy}", significant(by, 3))
    }
}

impl RecordingColumns {
    /// What the table was said to be.
    pub(crate) fn said(&self, table: &RecordingTable) -> SaidOfTable {
        let name = |index: usize| table.names.get(index).cloned().unwrap_or_default();
        let cart = self.cart.map_or_else(String::new, |(index, _)| name(index));
        SaidOfTable {
            names: core::iter::once(cart).chain(self.angles.iter().map(|(index, _)| name(*index))).collect(),
            drive: self.drive.map(|(index, _)| name(index)),
            has_cart: !self.is_clamped,
            is_absolute: self.reference == AngleReference::Absolute,
            is_upright: self.zero == AngleZero::Upright,
        }
    }

    /// The columns as they have to be read if these were misread.
    pub(crate) fn reread(mut self, misread: &[Misreading]) -> Self {
        let scale = |scaled: &mut (usize, f64), by: f64| scaled.1 /= by;
        for misreading in misread {
            match *misreading {
                Misreading::Reversed(0) => self.cart.iter_mut().for_each(|cart| scale(cart, -1.0)),
                Misreading::Reversed(link) => scale(&mut self.angles[link - 1], -1.0),
                Misreading::Drive => self.drive.iter_mut().for_each(|drive| scale(drive, -1.0)),
                Misreading::Exchanged(one, other) => {
                    self.angles.swap(one - 1, other - 1);
                    self.stretch.swap(one - 1, other - 1);
                }
                Misreading::Scaled(0, by) => self.cart.iter_mut().for_each(|cart| scale(cart, by)),
                Misreading::Scaled(link, by) => self.scale_angle(link - 1, by),
                Misreading::Joint(link, by) => self.joints[link - 1] *= by,
                Misreading::AllScaled(by) => (0..self.angles.len()).for_each(|at| self.scale_angle(at, by)),
                Misreading::Reference => {
                    self.reference = match self.reference {
                        AngleReference::Absolute => AngleReference::Relative,
                        AngleReference::Relative => AngleReference::Absolute,
                    }
                }
                Misreading::Zero => {
                    self.zero = match self.zero {
                        AngleZero::Upright => AngleZero::Hanging,
                        AngleZero::Hanging => AngleZero::Upright,
                    }
                }
            }
        }
        self
    }

    /// A unit scales the values of a column, wrong counts what they are away from hanging.
    fn scale_angle(&mut self, at: usize, by: f64) {
        if [DEGREES, 1.0 / DEGREES].contains(&by) {
            self.angles[at].1 /= by;
        } else {
            self.stretch[at] *= by;
        }
    }
}
