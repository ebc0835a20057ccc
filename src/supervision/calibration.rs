//! What has to be done by hand before arming: homing and the check of the signs.

use crate::board::Contacts;
use crate::supervision::homing::{Homing, Rail};
use crate::supervision::sign_check::{SignCheck, Signs};
use crate::supervision::stillness::Stillness;
use crate::table::limits::Limits;

/// Homing, sign check, and what is still.
#[derive(Debug, Clone)]
pub struct Calibration<const NY: usize> {
    homing: Homing,
    rail: Rail,
    signs: SignCheck<NY>,
    still: Stillness<NY>,
    slow: Stillness<NY>,
}

impl<const NY: usize> Calibration<NY> {
    /// Nothing is known yet.
    pub fn new(limits: &Limits<NY>) -> Self {
        Self {
            homing: Homing::default(),
            rail: Rail::default(),
            signs: SignCheck::new(&limits.sign_counts),
            still: Stillness::default(),
            slow: Stillness::default(),
        }
    }

    /// How far homing is.
    pub fn homing(&self) -> Homing {
        self.homing
    }

    /// How far the check of the signs is.
    pub fn signs(&self) -> Signs {
        self.signs.signs()
    }

    /// Forgets everything: positions can no longer be trusted.
    pub fn lose(&mut self, limits: &Limits<NY>) {
        *self = Self::new(limits);
    }

    /// Takes the counts of a tick with the motor off.
    pub fn update(&mut self, counts: &[i32; NY], limits: &Limits<NY>) {
        self.still.update(counts, &[1; NY]);
        self.slow.update(counts, &limits.slow_counts);
    }

    /// Whether nothing has moved by more than a count for long enough to be homed.
    pub fn is_still(&self, limits: &Limits<NY>) -> bool {
        self.still.ticks() >= limits.still_ticks
    }

    /// Ticks for which everything has been slow.
    pub fn slow_ticks(&self) -> u32 {
        self.slow.ticks()
    }

    /// The time of being slow starts anew.
    pub fn restart_slow(&mut self, counts: &[i32; NY]) {
        self.slow.restart(counts);
    }

    /// Positions are known.
    pub fn homed(&mut self) {
        self.homing = Homing::Homed;
    }

    /// Begins to look for the switches.
    pub fn begin_rail(&mut self) {
        self.rail = Rail::default();
        self.homing = self.rail.progress();
    }

    /// Looks for the switches: gives the counts of all sensors once they are known and nothing moves; an error ends it.
    ///
    /// # Errors
    /// The rail is not the one of the rig file.
    pub fn find_rail(
        &mut self,
        counts: &[i32; NY],
        contacts: &Contacts,
        limits: &Limits<NY>,
    ) -> Result<Option<[i32; NY]>, crate::supervision::homing::WrongTravel> {
        let cart = counts.first().copied().unwrap_or_default();
        let found = self.rail.update(cart, contacts, limits.travel_counts, limits.middle_counts);
        self.homing = if found.is_err() { Homing::WrongTravel } else { self.rail.progress() };
        let off_the_switches = !(contacts.limit_low || contacts.limit_high);
        Ok(found?.filter(|_| off_the_switches && self.is_still(limits)).map(|position| {
            let mut home = limits.rest_counts;
            if let Some(cart) = home.first_mut() {
                *cart = position;
            }
            home
        }))
    }

    /// Homing was given up, and a check that is not done.
    pub fn give_up(&mut self) {
        if matches!(self.homing, Homing::Touch { .. } | Homing::HoldStill) {
            self.homing = Homing::NotHomed;
        }
        self.signs.give_up();
    }

    /// Begins to check the signs.
    pub fn begin_signs(&mut self, limits: &Limits<NY>) {
        self.signs.begin(&limits.sign_counts);
    }

    /// Checks the signs.
    pub fn check_signs(&mut self, counts: &[i32; NY], limits: &Limits<NY>) {
        let at_rest = self.is_still(limits) && hang(counts, limits);
        self.signs.update(counts, at_rest, &limits.sign_counts);
    }
}

/// Whether the links hang, to half of what counts as a turn by hand.
pub fn hang<const NY: usize>(counts: &[i32; NY], limits: &Limits<NY>) -> bool {
    let mut from_rest = *counts;
    for (count, &rest) in from_rest.iter_mut().zip(&limits.rest_counts) {
        *count = count.wrapping_sub(rest);
    }
    let from_rest = limits.within_half_a_turn(&from_rest);
    let links = from_rest.iter().zip(&limits.sign_counts).skip(1);
    links.into_iter().all(|(moved, &enough)| enough == 0 || moved.unsigned_abs() <= enough.unsigned_abs() / 2)
}
