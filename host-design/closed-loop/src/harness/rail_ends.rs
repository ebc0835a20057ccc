//! The rail of a simulated rig: a limit switch at each end of its travel, and an end stop behind each switch.

use upright::board::Contacts;

use upright_design::rig::{PlantDescription, Rig};

use super::error::HarnessError;
use super::target::Pins;
use super::world::{Participant, World};

/// Distance from a limit switch to the end stop behind it (m).
const OVERTRAVEL_M: f64 = 0.01;
/// How far a person pushes the cart into a switch (m).
const PRESSED_M: f64 = 0.002;

/// Where switches and end stops are; a rig without a chain has none.
#[derive(Debug, Clone, Copy)]
pub struct RailEnds {
    travel_m: [f64; 2],
}

impl RailEnds {
    /// The rail of `rig`.
    pub fn of(rig: &Rig) -> Self {
        let travel_m = match &rig.plant {
            PlantDescription::Chain(chain) => chain.cart.travel_m,
            PlantDescription::Model(_) => [f64::NEG_INFINITY, f64::INFINITY],
        };
        Self { travel_m }
    }

    /// Opens the switches that a cart at this position (m) presses.
    pub fn press(&self, cart_m: f64, contacts: &mut Contacts) {
        let [low, high] = self.travel_m;
        contacts.limit_low |= cart_m <= low;
        contacts.limit_high |= cart_m >= high;
    }

    /// Positions at which a person has pushed the cart into a switch (m).
    pub fn pressed_m(&self) -> [f64; 2] {
        self.beyond(PRESSED_M)
    }

    /// Positions of the end stops (m).
    pub fn stops_m(&self) -> [f64; 2] {
        self.beyond(OVERTRAVEL_M)
    }

    /// Whether a cart at this position (m) is between the end stops.
    pub fn holds(&self, cart_m: f64) -> bool {
        let [low, high] = self.stops_m();
        (low..=high).contains(&cart_m)
    }

    fn beyond(&self, by_m: f64) -> [f64; 2] {
        [self.travel_m[0] - by_m, self.travel_m[1] + by_m]
    }
}

impl Participant for RailEnds {
    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        self.press(world.bench.state()[0], &mut pins.contacts);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cart_presses_the_switch_at_its_end_before_it_comes_to_the_stop() {
        let rail = RailEnds { travel_m: [-0.4, 0.5] };
        let pressed = |cart_m: f64| {
            let mut contacts = Contacts::default();
            rail.press(cart_m, &mut contacts);
            [contacts.limit_low, contacts.limit_high]
        };
        assert_eq!([-0.399, 0.499].map(pressed), [[false; 2]; 2]);
        assert_eq!(rail.pressed_m().map(pressed), [[true, false], [false, true]]);
        assert!(rail.pressed_m().into_iter().all(|end| rail.holds(end)));
        // Negative control.
        assert!(!rail.holds(-0.411) && !rail.holds(0.511));
    }
}
