//! Records as they would have been recorded otherwise: with other wiring, fewer samples or an earlier drive.

use crate::record::Record;

impl Record {
    /// Every `share`-th sample, with the drive of every tick.
    pub(crate) fn thinned(&self, share: usize) -> Self {
        let share = share.max(1);
        let mut record = self.clone();
        (record.stride, record.dt_s) = (share * self.stride, share as f64 * self.dt_s);
        for piece in &mut record.pieces {
            piece.y = piece.y.chunks(self.channels).step_by(share).flatten().copied().collect();
        }
        record
    }

    /// A copy whose drive acts so many ticks later; ticks without measurement or drive are left out.
    pub(crate) fn shifted(&self, ticks: i64) -> Self {
        let mut record = self.clone();
        let (late, early) = (ticks.max(0) as usize, (-ticks).max(0) as usize);
        let skipped = late.div_ceil(self.stride);
        for piece in &mut record.pieces {
            let last = piece.drive.len().saturating_sub(late);
            let first = (skipped * self.stride - late + early).min(last);
            piece.drive = piece.drive[first..last].to_vec();
            let samples = piece.drive.len().div_ceil(self.stride);
            let y = piece.y.chunks(self.channels).skip(skipped).take(samples);
            piece.y = y.flatten().copied().collect();
        }
        record.pieces.retain(|piece| !piece.y.is_empty());
        record
    }

    /// A copy with `change` applied to each row of measurements, and to the path of a cart whose motion is imposed.
    pub(crate) fn rewired(&self, change: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        let mut record = self.clone();
        let mut row = vec![0.0; self.channels];
        for piece in &mut record.pieces {
            piece.y = piece.y.chunks(self.channels).flat_map(&change).collect();
            for position in piece.drive.iter_mut().flatten().filter(|_| self.is_moved) {
                row[0] = *position;
                *position = change(&row)[0];
            }
        }
        record
    }

    /// A copy with the motor reversed.
    pub(crate) fn reversed(&self) -> Self {
        let mut record = self.clone();
        record
            .pieces
            .iter_mut()
            .flat_map(|piece| &mut piece.drive)
            .flatten()
            .for_each(|drive| *drive = -*drive);
        record
    }
}
