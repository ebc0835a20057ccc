//! What a person does before arming: homing and the sign check. Both work on encoder counts with the motor off.

use crate::board::Contacts;
use crate::supervision::homing::{Homing, Rail, WrongTravel};
use crate::supervision::inhibits::Inhibits;
use crate::supervision::sign_check::{SignCheck, Signs};
use crate::supervision::stillness::Stillness;
use crate::supervision::swinging::Swinging;
use crate::table::{Limits, SensorRow};

/// Progress of homing and sign check, and how long the rig has been still or slow.
#[derive(Debug, Clone)]
pub struct Calibration<const NY: usize> {
    homing: Homing,
    rail: Rail,
    signs: SignCheck<NY>,
    still: Stillness<NY>,
    slow: Stillness<NY>,
    swinging: Swinging<NY>,
}

impl<const NY: usize> Calibration<NY> {
    /// Not homed, signs unchecked.
    #[inline(never)]
    pub fn new(sensors: &[SensorRow; NY]) -> Self {
        Self {
            homing: Homing::default(),
            rail: Rail::default(),
            signs: SignCheck::new(sensors),
            still: Stillness::default(),
            slow: Stillness::default(),
            swinging: Swinging::default(),
        }
    }

    /// Progress of homing.
    pub fn homing(&self) -> Homing {
        self.homing
    }

    /// Progress of the sign check.
    pub fn signs(&self) -> Signs {
        self.signs.signs()
    }

    /// Back to not homed and unchecked: positions can no longer be trusted.
    pub fn invalidate(&mut self, sensors: &[SensorRow; NY]) {
        *self = Self::new(sensors);
    }

    /// Takes the counts of a tick with the motor off; `still` is the largest motion of each sensor that is still
    /// (counts).
    pub fn update(&mut self, counts: &[i32; NY], sensors: &[SensorRow; NY]) {
        self.still.update(counts, &sensors.each_ref().map(|sensor| sensor.still_counts));
        self.slow.update(counts, &sensors.each_ref().map(|sensor| sensor.slow_counts));
    }

    /// Takes the counts of a tick in which the links may swing out; `steps` is the travel per count (m or rad).
    pub fn update_swinging(&mut self, counts: &[i32; NY], sensors: &[SensorRow; NY], tick_s: f32) {
        self.swinging.update(counts, sensors, tick_s);
    }

    /// Position of each sensor (counts) for homing here: the cart is at 0, and the links hang still or swing about
    /// hanging.
    ///
    /// # Errors
    /// The inhibits of homing.
    pub fn hanging(
        &self,
        counts: &[i32; NY],
        sensors: &[SensorRow; NY],
        limits: &Limits,
    ) -> Result<[i32; NY], Inhibits> {
        let mut home = sensors.each_ref().map(|sensor| sensor.rest_counts);
        match self.swinging.zeros() {
            Ok(zeros) => {
                for ((home, &count), &zero) in home.iter_mut().zip(counts).zip(zeros) {
                    let away = count as f32 - zero;
                    *home = home.wrapping_add((away + f32::copysign(0.5, away)) as i32);
                }
            }
            Err(inhibits) => inhibits.when(!self.is_still(limits)).err_if_any()?,
        }
        Ok(home)
    }

    /// Whether nothing has moved by more than is still for [`Limits::still_ticks`], as homing requires.
    pub fn is_still(&self, limits: &Limits) -> bool {
        self.still.ticks() >= limits.still_ticks
    }

    /// Number of ticks for which no sensor has moved by more than [`SensorRow::slow_counts`].
    pub fn slow_ticks(&self) -> u32 {
        self.slow.ticks()
    }

    /// Restarts the count of slow ticks at these counts.
    pub fn restart_slow(&mut self, counts: &[i32; NY]) {
        self.slow.restart(counts);
    }

    /// Records that positions are known.
    pub fn set_homed(&mut self) {
        self.homing = Homing::Homed;
        // Its means are those of counts relative to another position.
        self.swinging.forget();
    }

    /// Records that a link hangs elsewhere than at its absolute sensor's zero: homing waits.
    pub fn set_other_zero(&mut self) {
        self.homing = Homing::OtherZero;
    }

    /// Starts homing by the limit switches.
    pub fn start_rail_homing(&mut self) {
        self.rail = Rail::default();
        self.homing = self.rail.progress();
    }

    /// One tick of homing by the limit switches. Returns the positions of all sensors (counts) once both switches have
    /// been pressed, the cart is off them, and the links hang still or have swung for long enough.
    ///
    /// # Errors
    /// [`WrongTravel`]: the rail is not the one in the rig file; homing ends.
    pub fn update_rail_homing(
        &mut self,
        counts: &[i32; NY],
        contacts: &Contacts,
        sensors: &[SensorRow; NY],
        limits: &Limits,
    ) -> Result<Option<[i32; NY]>, WrongTravel> {
        let cart = counts.first().copied().unwrap_or_default();
        let found = self.rail.update(cart, contacts, limits.travel_counts, limits.middle_counts);
        self.homing = if found.is_err() { Homing::WrongTravel } else { self.rail.progress() };
        let off_the_switches = !(contacts.limit_low || contacts.limit_high);
        Ok(found?.filter(|_| off_the_switches).and_then(|position| {
            let mut home = self.hanging(counts, sensors, limits).ok()?;
            if let Some(cart) = home.first_mut() {
                *cart = position;
            }
            Some(home)
        }))
    }

    /// Where a drive has to move the cart in homing by the limit switches, with the cart at these counts: the
    /// direction, and, once both switches have been pressed, its distance from position 0 (counts).
    ///
    /// # Errors
    /// [`WrongTravel`] if a switch is not where it should be; homing ends.
    pub fn homing_way(&mut self, cart: i32, limits: &Limits) -> Result<(i32, Option<i32>), WrongTravel> {
        let way = self.rail.way(cart, limits.travel_counts, limits.middle_counts);
        if way.is_err() {
            self.homing = Homing::WrongTravel;
        }
        way
    }

    /// Positions are not known any more; signs that are checked stay so.
    pub fn forget_homing(&mut self) {
        if self.homing == Homing::Homed {
            self.homing = Homing::NotHomed;
        }
    }

    /// Cancels homing and a sign check that are in progress; what is finished stays.
    #[inline(never)]
    pub fn cancel(&mut self) {
        if !matches!(self.homing, Homing::Homed | Homing::WrongTravel) {
            self.homing = Homing::NotHomed;
        }
        self.signs.cancel();
    }

    /// Starts the sign check.
    pub fn start_sign_check(&mut self, sensors: &[SensorRow; NY]) {
        self.signs.start(sensors);
    }

    /// One tick of the sign check.
    pub fn update_sign_check(&mut self, counts: &[i32; NY], sensors: &[SensorRow; NY], limits: &Limits) {
        let at_rest = self.is_still(limits) && links_hang(counts, sensors);
        self.signs.update(counts, at_rest, sensors);
    }
}

/// Whether all links hang at rest, to within half of [`SensorRow::sign_counts`].
pub fn links_hang<const NY: usize>(counts: &[i32; NY], sensors: &[SensorRow; NY]) -> bool {
    counts.iter().zip(sensors).skip(1).all(|(&count, sensor)| sensor.hangs(count))
}
