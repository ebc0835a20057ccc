//! What must not happen while the motor stills the links after a fall, whatever is broken.

use upright_design::plant::{Plant, chain_plant};
use upright_design::rig::Rig;
use upright_design::table::TableValues;

/// The energy of a rig whose links are stilled, and for how long they may be.
pub(super) struct StilledRun {
    plant: Option<Box<dyn Plant>>,
    states: usize,
    longest_ticks: usize,
    /// First tick, and the largest energy allowed from then on (J).
    begun: Option<(usize, f64)>,
}

impl StilledRun {
    pub(super) fn of(rig: &Rig, table: &TableValues) -> Self {
        Self {
            plant: rig.chain().and_then(|chain| chain_plant(chain).ok()),
            states: rig.states(),
            longest_ticks: table.stilling.as_ref().map_or(0, |gains| gains.after_fall_ticks as usize),
            begun: None,
        }
    }

    /// Whether the motor stills the links for longer than the table says, or has added more energy since the fall than
    /// hanging links need to stand up. `state` is the true one in `tick`.
    pub(super) fn adds_energy(&mut self, state: &[f64], tick: usize) -> bool {
        let Some(plant) = &mut self.plant else { return false };
        let mut energy_j = |state: &[f64]| {
            plant.set_state(state);
            plant.energy().map_or(0.0, |energy| energy.potential + energy.kinetic)
        };
        let now_j = energy_j(state.get(..self.states).unwrap_or(state));
        let (first, most_j) = *self.begun.get_or_insert_with(|| {
            let upright_j = energy_j(&vec![0.0; self.states]);
            (tick, now_j + 2.0 * upright_j)
        });
        now_j > most_j || tick > first + self.longest_ticks + 1
    }
}
