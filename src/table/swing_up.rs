//! The motions of a swing-up: from hanging to upright, and back; also between other equilibria, if they are planned.
//!
//! A motion is stored as knots, between which the firmware interpolates. The columns, each with its values at all
//! knots, lie one after the other in a slice, because the number of knots differs from rig to rig. Values have 16
//! bits, with a unit for each column: that is finer than encoders resolve, and takes half the flash of `f32`.

use crate::table::chain_model::ChainModel;
use crate::table::checksum::{ChecksumScan, checksum};
use crate::table::equilibrium::Equilibrium;
use crate::table::error::TableError;
use crate::table::format::TABLE_FORMAT;
use crate::table::gain_table::GainTable;
#[cfg(test)]
use crate::table::part::WordsMut;
use crate::table::part::{Part, Reader, Resize, Shape, Words, is_finite, part};
use crate::table::thresholds::Thresholds;
#[cfg(feature = "firmware")]
use crate::table::words::{Fill, WordReader};

part! {
    /// A planned motion with its gains.
    #[derive(Copy)]
    pub struct MotionTable<'t,;> {
        /// Duration (ticks).
        pub ticks: u32,
        /// Ticks from one knot of `reference` to the next.
        pub reference_ticks: u32,
        /// Ticks from one knot of `filter` to the next.
        pub filter_ticks: u32,
        /// Lowest and highest planned position of the cart, from its first one (m).
        pub travel_m: [f32; 2],
        /// For each column of `reference`: what a value of 1 is.
        pub reference_units: &'t [f32],
        /// Columns of the reference state, the reference force (N) and the gains K, each with its values at all knots.
        pub reference: &'t [i16],
        /// For each column of `filter`: what a value of 1 is.
        pub filter_units: &'t [f32],
        /// Columns of L, sensor by sensor, each with its values at all knots of the filter.
        pub filter: &'t [i16],
    }
}

part! {
    /// A motion between two equilibria, at least one of which is neither upright nor hanging.
    #[derive(Copy)]
    pub struct TransitionTable<'t,;> {
        /// [`Equilibrium::bits`] of where it begins.
        pub from: u32,
        /// [`Equilibrium::bits`] of where it ends.
        pub to: u32,
        /// The motion. It begins with all joints within half a turn of 0, and may end whole turns away from that.
        pub motion: MotionTable<'t>,
    }
}

/// Most transitions that an image has room for: those of three links.
pub const MOST_TRANSITIONS: usize = 54;

impl Part for &[TransitionTable<'_>] {
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        self.iter().find_map(|transition| transition.part(at))
    }

    #[cfg(test)]
    fn part_mut(&mut self, _: &mut usize) -> Option<WordsMut<'_>> {
        None
    }

    fn read(&self, reader: &mut dyn Reader) {
        reader.list(self.len(), Shape::Slice);
        self.iter().for_each(|transition| transition.read(reader));
    }
}

/// The transitions are left out: see [`FillTransitions`].
#[cfg(feature = "firmware")]
impl<'t, 'words: 't> Fill<'words> for &'t [TransitionTable<'t>] {
    const EMPTY: Self = &[];

    fn fill(&mut self, words: &mut WordReader<'words>) {
        words.skip_list::<TransitionTable<'_>>();
    }
}

impl<'t> Resize<&'t [TransitionTable<'t>]> for &'t [TransitionTable<'t>] {
    fn resized(&self) -> &'t [TransitionTable<'t>] {
        self
    }
}

part! {
    /// Limits of the supervisor while the rig follows a motion. They take the place of those on angle, speed and rail.
    #[derive(Copy)]
    pub struct MotionLimits<;> {
        /// Largest distance of a link from its planned angle from the vertical (rad).
        pub deviation_rad: f32,
        /// Largest distance of the cart from its planned position (m).
        pub deviation_m: f32,
        /// Largest speed of the cart (m/s).
        pub speed_m_per_s: f32,
        /// Lowest and highest position of the cart (m).
        pub rail_m: [f32; 2],
    }
}

impl MotionLimits {
    /// Limits that are never exceeded.
    pub const fn none() -> Self {
        Self {
            deviation_rad: f32::MAX,
            deviation_m: f32::MAX,
            speed_m_per_s: f32::MAX,
            rail_m: [-f32::MAX, f32::MAX],
        }
    }

    fn is_sound(&self) -> bool {
        let [low, high] = self.rail_m;
        let others = [self.deviation_rad, self.deviation_m, self.speed_m_per_s];
        low < high && others.into_iter().all(|limit| limit > 0.0)
    }
}

part! {
    /// The motions of a rig with `NY` sensors and `N` links, and what is needed to follow them.
    pub struct SwingUpTable<'t, NY to MY, N to M;> {
        /// Layout of the table: `TABLE_FORMAT` of the writer.
        pub format: u32,
        /// Hash of the rig file's values.
        pub rig_hash: u64,
        /// Control period (s).
        pub tick_s: f32,
        /// The equations of motion, for the prediction.
        pub model: ChainModel<N>,
        /// What the supervisor allows while the rig follows a motion.
        pub limits: MotionLimits,
        /// Thresholds at which the supervisor takes encoders and motor to be at fault while the rig follows a motion.
        pub thresholds: Thresholds<NY>,
        /// From hanging at rest to upright at rest.
        pub raise: MotionTable<'t>,
        /// From upright at rest to hanging at rest.
        pub lower: MotionTable<'t>,
        /// Between other equilibria.
        pub others: &'t [TransitionTable<'t>],
        sealed by
        /// CRC-32 (ISO-HDLC) of all fields above.
        pub crc,
    }
}

/// A swing-up whose transitions need room of their own when it is filled.
#[cfg(feature = "firmware")]
pub trait FillTransitions<'t>: Fill<'t> {
    /// Reads the transitions from `words`, their number first, into this room. Without enough room there are none, and
    /// the check of the swing-up fails.
    fn fill_transitions(&mut self, words: WordReader<'t>, room: &'t mut [TransitionTable<'t>]);
}

#[cfg(feature = "firmware")]
impl<'t> FillTransitions<'t> for NoSwingUp {
    fn fill_transitions(&mut self, _: WordReader<'t>, _: &'t mut [TransitionTable<'t>]) {}
}

#[cfg(feature = "firmware")]
impl<'t, const NY: usize, const N: usize> FillTransitions<'t> for SwingUpTable<'t, NY, N> {
    fn fill_transitions(&mut self, mut words: WordReader<'t>, room: &'t mut [TransitionTable<'t>]) {
        if let Some(list) = room.get_mut(..words.word() as usize) {
            list.iter_mut().for_each(|transition| transition.fill(&mut words));
            self.others = list;
        }
    }
}

impl MotionTable<'_> {
    /// Columns of `reference`: a state, the force, a gain for each state.
    pub const fn reference_columns(states: usize) -> usize {
        2 * states + 1
    }

    /// Whether there are knots up to the last tick, at least four for the interpolation.
    fn has_all_knots(&self, states: usize, sensors: usize) -> bool {
        let has = |values: &[i16], units: &[f32], columns: usize, ticks: u32| {
            let knots = values.len() / columns.max(1);
            let reach = (knots as u32).saturating_sub(1).saturating_mul(ticks);
            units.len() == columns && values.len() == knots * columns && knots >= 4 && reach >= self.ticks
        };
        self.ticks > 0
            && has(
                self.reference,
                self.reference_units,
                Self::reference_columns(states),
                self.reference_ticks,
            )
            && has(self.filter, self.filter_units, states * sensors, self.filter_ticks)
    }
}

impl<const NY: usize, const N: usize> SwingUpTable<'_, NY, N> {
    /// CRC-32 (ISO-HDLC) of every field except `crc`.
    pub fn checksum(&self) -> u32 {
        checksum(self)
    }

    /// Checks that the table is intact, plausible and made for the same rig and tick as the gain table `gains`.
    ///
    /// # Errors
    /// The first [`TableError`] found.
    pub fn check<const NX: usize>(&self, gains: &GainTable<NX, NY>) -> Result<(), TableError> {
        if self.format != TABLE_FORMAT {
            return Err(TableError::Format);
        }
        if self.crc != self.checksum() {
            return Err(TableError::Crc);
        }
        if self.rig_hash != gains.rig_hash {
            return Err(TableError::RigHash);
        }
        if self.tick_s.to_bits() != gains.tick_s.to_bits() {
            return Err(TableError::Tick);
        }
        let complete = |motion: &MotionTable<'_>| motion.has_all_knots(NX, NY);
        if NX != 2 * N + 2 || NY != N + 1 || !complete(&self.raise) || !complete(&self.lower) {
            return Err(TableError::Dimensions);
        }
        let fits = |TransitionTable { from, to, motion }: &TransitionTable<'_>| {
            from != to && *from < 1 << N && *to < 1 << N && complete(motion)
        };
        if !self.others.iter().all(fits) {
            return Err(TableError::Dimensions);
        }
        let is_sound = self.limits.is_sound() && self.thresholds.is_sound();
        if is_sound && is_finite(self) { Ok(()) } else { Err(TableError::Value) }
    }
}

/// The swing-up of a build: [`NoSwingUp`], for which no code is generated, or a [`SwingUpTable`].
pub trait SwingUp<const NX: usize, const NY: usize> {
    /// Whether there may be motions. If not, the code for them is left out.
    const IS_POSSIBLE: bool;

    /// The motions without the model, if there are any.
    fn motions(&self) -> Option<Motions<'_, NY>>;

    /// Replaces the state by the one `dt` (s) later, with `force` (N) held, by the nonlinear model.
    fn predict(&self, state: &mut [f32; NX], force: f32, dt: f32);

    /// Checks the table: see [`SwingUpTable::check`].
    ///
    /// # Errors
    /// The first [`TableError`] found.
    fn check(&self, gains: &GainTable<NX, NY>) -> Result<(), TableError>;

    /// Adds a word to the scan of the table; after the last word, returns whether the table is intact.
    fn scan<'a>(&'a self, scan: &mut ChecksumScan<'a>) -> Option<bool>;
}

/// The motions of a [`SwingUpTable`] and the limits and thresholds that supervise them.
#[derive(Debug, Clone, Copy)]
pub struct Motions<'t, const NY: usize> {
    /// From hanging to upright.
    pub raise: &'t MotionTable<'t>,
    /// From upright to hanging.
    pub lower: &'t MotionTable<'t>,
    /// Between other equilibria.
    pub others: &'t [TransitionTable<'t>],
    /// See [`SwingUpTable::limits`].
    pub limits: &'t MotionLimits,
    /// See [`SwingUpTable::thresholds`].
    pub thresholds: &'t Thresholds<NY>,
}

impl<'t, const NY: usize> Motions<'t, NY> {
    /// The motion from one equilibrium to another, if there is one.
    pub fn between(&self, from: Equilibrium, to: Equilibrium) -> Option<&'t MotionTable<'t>> {
        let hanging = Equilibrium::hanging(NY - 1);
        if (from, to) == (hanging, Equilibrium::UPRIGHT) {
            return Some(self.raise);
        }
        if (from, to) == (Equilibrium::UPRIGHT, hanging) {
            return Some(self.lower);
        }
        let leads = |other: &&TransitionTable<'_>| (other.from, other.to) == (from.bits(), to.bits());
        self.others.iter().find(leads).map(|other| &other.motion)
    }
}

/// The swing-up of a rig file without `[swing_up]`: there are no motions.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoSwingUp;

#[cfg(feature = "firmware")]
impl Fill<'_> for NoSwingUp {
    const EMPTY: Self = Self;

    fn fill(&mut self, _: &mut WordReader<'_>) {}
}

impl<const NX: usize, const NY: usize> SwingUp<NX, NY> for NoSwingUp {
    const IS_POSSIBLE: bool = false;

    #[inline(always)]
    fn motions(&self) -> Option<Motions<'_, NY>> {
        None
    }

    fn predict(&self, _: &mut [f32; NX], _: f32, _: f32) {}

    fn check(&self, _: &GainTable<NX, NY>) -> Result<(), TableError> {
        Ok(())
    }

    #[inline(always)]
    fn scan(&self, _: &mut ChecksumScan<'_>) -> Option<bool> {
        None
    }
}

impl<const NX: usize, const NY: usize, const N: usize> SwingUp<NX, NY> for SwingUpTable<'_, NY, N> {
    const IS_POSSIBLE: bool = true;

    fn motions(&self) -> Option<Motions<'_, NY>> {
        let Self { raise, lower, others, limits, thresholds, .. } = self;
        Some(Motions { raise, lower, others, limits, thresholds })
    }

    fn predict(&self, state: &mut [f32; NX], force: f32, dt: f32) {
        self.model.predict(state, force, dt);
    }

    fn check(&self, gains: &GainTable<NX, NY>) -> Result<(), TableError> {
        SwingUpTable::check(self, gains)
    }

    fn scan<'a>(&'a self, scan: &mut ChecksumScan<'a>) -> Option<bool> {
        scan.next(self).map(|crc| crc == self.crc)
    }
}

/// A swing-up that is only known at run time; `None`: there are no motions.
impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> SwingUp<NX, NY> for Option<S> {
    const IS_POSSIBLE: bool = S::IS_POSSIBLE;

    fn motions(&self) -> Option<Motions<'_, NY>> {
        self.as_ref()?.motions()
    }

    fn predict(&self, state: &mut [f32; NX], force: f32, dt: f32) {
        if let Some(table) = self {
            table.predict(state, force, dt);
        }
    }

    fn check(&self, gains: &GainTable<NX, NY>) -> Result<(), TableError> {
        self.as_ref().map_or(Ok(()), |table| table.check(gains))
    }

    fn scan<'a>(&'a self, scan: &mut ChecksumScan<'a>) -> Option<bool> {
        self.as_ref()?.scan(scan)
    }
}
