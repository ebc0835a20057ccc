//! How long cart and links have been still.

/// Number of ticks for which all counts have stayed near a reference.
#[derive(Debug, Clone)]
pub struct Stillness<const NY: usize> {
    reference: [i32; NY],
    ticks: u32,
}

impl<const NY: usize> Default for Stillness<NY> {
    fn default() -> Self {
        Self { reference: [0; NY], ticks: 0 }
    }
}

impl<const NY: usize> Stillness<NY> {
    /// Takes the counts of a tick. If one is further than `allowed` from its reference, these counts become the
    /// reference and the number of ticks restarts at 0.
    pub fn update(&mut self, counts: &[i32; NY], allowed: &[i32; NY]) {
        let near = |((&count, &reference), &allowed): ((&i32, &i32), &i32)| {
            count.wrapping_sub(reference).unsigned_abs() <= allowed.unsigned_abs()
        };
        if counts.iter().zip(&self.reference).zip(allowed).all(near) {
            self.ticks = self.ticks.saturating_add(1);
        } else {
            self.restart(counts);
        }
    }

    /// Makes these counts the reference and restarts the number of ticks at 0.
    pub fn restart(&mut self, counts: &[i32; NY]) {
        (self.reference, self.ticks) = (*counts, 0);
    }

    /// Number of ticks since something moved.
    pub fn ticks(&self) -> u32 {
        self.ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_of_flicker_is_still_and_a_slow_drift_is_not() {
        let mut stillness = Stillness::<2>::default();
        for tick in 0..100 {
            stillness.update(&[0, tick % 2], &[1, 1]);
        }
        assert_eq!(stillness.ticks(), 100);
        let mut longest = 0;
        for tick in 0..100 {
            stillness.update(&[tick / 5, 0], &[1, 1]);
            longest = longest.max(if tick > 10 { stillness.ticks() } else { 0 });
        }
        assert!(longest <= 10, "{longest}");
    }
}
