//! The table of a swing-up on the host: its values for any number of links.

use nalgebra::{SMatrix, SVector};
use upright::table::{
    ChainModel, MotionLimits, MotionTable, SwingUpTable, TABLE_FORMAT, Thresholds, TransitionTable, Turning,
};

use super::any_size::{MAX_SENSORS, WidestTable};
use super::error::{NoTable, finite};
use crate::motion::{PlannedMotion, RaiseAndLower, Transition};
use crate::plant::{ChainParameters, ChainPlant};
use crate::rig::Rig;

/// Time between two knots of reference state, force and gains (s) …
const REFERENCE_S: f64 = 0.01;
/// … and of the filter.
const FILTER_S: f64 = 0.05;

/// The values of a swing-up table, with knots taken from a planned motion.
#[derive(Debug, Clone, PartialEq)]
pub struct SwingUpValues {
    /// Constants of the equations of motion.
    pub chain: ChainParameters<f64>,
    /// See [`SwingUpTable::limits`].
    pub limits: MotionLimits,
    /// See [`SwingUpTable::thresholds`].
    pub thresholds: Thresholds<MAX_SENSORS>,
    /// The motion from hanging to upright.
    pub raise: MotionValues,
    /// The motion from upright to hanging.
    pub lower: MotionValues,
    /// The motions between other equilibria.
    pub others: Vec<(Transition, MotionValues)>,
    rig_hash: u64,
    tick_s: f32,
}

/// The values of a [`MotionTable`].
#[derive(Debug, Clone, PartialEq)]
pub struct MotionValues {
    /// See [`MotionTable::ticks`].
    pub ticks: u32,
    /// See [`MotionTable::reference_ticks`].
    pub reference_ticks: u32,
    /// See [`MotionTable::filter_ticks`].
    pub filter_ticks: u32,
    /// See [`MotionTable::travel_m`].
    pub travel_m: [f32; 2],
    /// See [`MotionTable::reference_units`].
    pub reference_units: Vec<f32>,
    /// See [`MotionTable::reference`].
    pub reference: Vec<i16>,
    /// See [`MotionTable::filter_units`].
    pub filter_units: Vec<f32>,
    /// See [`MotionTable::filter`].
    pub filter: Vec<i16>,
}

impl SwingUpValues {
    /// The table of `motions` for `rig`, whose gain table is `table`. The supervisor detects nothing during its
    /// motions: its limits are [`MotionLimits::none`], its thresholds [`Thresholds::none`].
    ///
    /// # Errors
    /// [`NoTable`] if the rig has no chain, a delay, or no observer, if the motions are those of another rig, or if a
    /// value does not fit into single precision.
    pub fn of(rig: &Rig, table: &WidestTable, motions: &RaiseAndLower) -> Result<Self, NoTable> {
        let Some(chain) = rig.chain() else {
            return Err(NoTable::SwingUp("a [model] has no nonlinear equations of motion"));
        };
        if table.observer.is_none() || table.laws.lqr.is_none() {
            return Err(NoTable::SwingUp("it needs [lqr] and [kalman]"));
        }
        if rig.tick.delay_ticks != 0 {
            return Err(NoTable::SwingUp("its control law is without delay: set delay_ticks = 0"));
        }
        let values = |motion: &PlannedMotion| MotionValues::of(table, motion);
        Ok(Self {
            chain: ChainParameters::of(chain),
            limits: MotionLimits::none(),
            thresholds: Thresholds::none(),
            raise: values(&motions.raise)?,
            lower: values(&motions.lower)?,
            others: Vec::new(),
            rig_hash: table.rig_hash,
            tick_s: table.tick_s,
        })
    }

    /// Adds a motion between other equilibria.
    ///
    /// # Errors
    /// As for [`of`](Self::of).
    pub fn add(
        &mut self,
        table: &WidestTable,
        transition: Transition,
        motion: &PlannedMotion,
    ) -> Result<(), NoTable> {
        self.others.push((transition, MotionValues::of(table, motion)?));
        Ok(())
    }

    /// The firmware's motions between other equilibria, a part of its [`table`](Self::table).
    pub fn transitions(&self) -> Vec<TransitionTable<'_>> {
        let links = self.chain.a.len();
        let ends = |transition: &Transition| [transition.from(links).bits(), transition.to(links).bits()];
        let others = self.others.iter().map(|(transition, motion)| (ends(transition), motion.table()));
        others.map(|([from, to], motion)| TransitionTable { from, to, motion }).collect()
    }

    /// The firmware's table, complete with its checksum.
    ///
    /// # Panics
    /// If `N` is not the number of links. `NY` must be `N + 1`.
    pub fn table<'a, const NY: usize, const N: usize>(
        &'a self,
        others: &'a [TransitionTable<'a>],
    ) -> SwingUpTable<'a, NY, N> {
        let plant = ChainPlant::<N>::new(&self.chain).expect("a swing-up for this number of links");
        let mut table = SwingUpTable {
            format: TABLE_FORMAT,
            rig_hash: self.rig_hash,
            tick_s: self.tick_s,
            model: narrow(plant.model()),
            limits: self.limits,
            thresholds: upright::table::Resize::resized(&self.thresholds),
            raise: self.raise.table(),
            lower: self.lower.table(),
            others,
            crc: 0,
        };
        table.crc = table.checksum();
        table
    }

    /// Size of the knots of all motions, and of their units (bytes).
    pub fn bytes(&self) -> usize {
        let bytes = |motion: &MotionValues| {
            size_of_val(&motion.reference[..])
                + size_of_val(&motion.filter[..])
                + size_of_val(&motion.reference_units[..])
                + size_of_val(&motion.filter_units[..])
        };
        let others: usize = self.others.iter().map(|(_, motion)| bytes(motion)).sum();
        bytes(&self.raise) + bytes(&self.lower) + others
    }
}

impl MotionValues {
    fn of(table: &WidestTable, motion: &PlannedMotion) -> Result<Self, NoTable> {
        let ([states, sensors], ticks) = (table.dimensions.map(|number| number as usize), motion.steps());
        let sizes = motion.x.first().map(Vec::len) == Some(states)
            && motion.l.first().map(|l| (l.rows(), l.cols())) == Some((states, sensors));
        if !sizes || motion.tick_s as f32 != table.tick_s {
            return Err(NoTable::SwingUp("the motion was planned for another rig or tick"));
        }
        let per_knot = |seconds: f64| (seconds / motion.tick_s).round().max(1.0) as usize;
        let (reference_ticks, filter_ticks) = (per_knot(REFERENCE_S), per_knot(FILTER_S));
        let knots = |every: usize| (0..=ticks.div_ceil(every).max(3)).map(move |knot| knot * every);
        let (mut reference, mut filter) = (Vec::new(), Vec::new());
        for tick in knots(reference_ticks) {
            // After the end: at rest where the motion ends, with its last gains.
            let last = tick.min(ticks - 1);
            reference.extend(motion.x[tick.min(ticks)].iter().copied());
            reference.push(if tick < ticks { motion.u[tick] } else { 0.0 });
            reference.extend(motion.k[last].entries());
        }
        for tick in knots(filter_ticks) {
            let l = &motion.l[tick.min(ticks - 1)];
            filter.extend((0..sensors).flat_map(|column| (0..states).map(move |row| l[(row, column)])));
        }
        let (reference_units, reference) = in_units(&reference, MotionTable::reference_columns(states))?;
        let (filter_units, filter) = in_units(&filter, states * sensors)?;
        let first = motion.x[0][0];
        let travelled = || motion.x.iter().map(|x| x[0] - first);
        Ok(Self {
            ticks: ticks as u32,
            reference_ticks: reference_ticks as u32,
            filter_ticks: filter_ticks as u32,
            travel_m: [travelled().fold(0.0, f64::min) as f32, travelled().fold(0.0, f64::max) as f32],
            reference_units,
            reference,
            filter_units,
            filter,
        })
    }

    /// The planned state in `tick`, interpolated between its two neighbouring knots; after the end, the last one.
    pub fn planned(&self, states: usize, tick: usize) -> Vec<f64> {
        let (knots, every) =
            (self.reference.len() / self.reference_units.len(), self.reference_ticks as usize);
        let share = (tick % every) as f64 / every as f64;
        let between = |state: usize| {
            let at = |knot: usize| f64::from(self.reference[state * knots + knot.min(knots - 1)]);
            let (before, after) = (at(tick / every), at(tick / every + 1));
            f64::from(self.reference_units[state]) * (before + share * (after - before))
        };
        (0..states).map(between).collect()
    }

    /// This motion as a part of the firmware's table.
    fn table(&self) -> MotionTable<'_> {
        MotionTable {
            ticks: self.ticks,
            reference_ticks: self.reference_ticks,
            filter_ticks: self.filter_ticks,
            travel_m: self.travel_m,
            reference_units: &self.reference_units,
            reference: &self.reference,
            filter_units: &self.filter_units,
            filter: &self.filter,
        }
    }
}

/// Quantises rows of `width` values, column by column, to whole multiples of the column's unit. The largest magnitude
/// in a column is `i16::MAX` units.
fn in_units(rows: &[f64], width: usize) -> Result<(Vec<f32>, Vec<i16>), NoTable> {
    let (mut units, mut values) = (Vec::new(), Vec::new());
    for column in 0..width {
        let of_column = || rows.iter().skip(column).step_by(width);
        let largest = of_column().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let unit = if largest > 0.0 { largest / f64::from(i16::MAX) } else { 1.0 };
        let unit = finite("a value of the swing-up", unit as f32)?;
        units.push(unit);
        values.extend(of_column().map(|value| (value / f64::from(unit)).round() as i16));
    }
    Ok((units, values))
}

/// The model, each constant rounded once to `f32`.
pub(super) fn narrow<const N: usize>(model: &ChainModel<N, f64>) -> ChainModel<N> {
    let vector = |of: &SVector<f64, N>| SVector::from_fn(|j, _| of[j] as f32);
    let matrix = |of: &SMatrix<f64, N, N>| SMatrix::from_fn(|j, k| of[(j, k)] as f32);
    ChainModel {
        inverse_mass: model.inverse_mass as f32,
        a: vector(&model.a),
        weight: vector(&model.weight),
        b: matrix(&model.b),
        b_reduced: matrix(&model.b_reduced),
        reaction: vector(&model.reaction),
        cart_friction: model.cart_friction as f32,
        joint_frictions: vector(&model.joint_frictions),
        turning: model
            .turning
            .as_ref()
            .map(|turning| Turning { beta: matrix(&turning.beta), reaction: turning.reaction as f32 }),
    }
}
