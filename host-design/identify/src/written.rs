//! What the new rig file says, once it is written and read again.

use std::path::Path;

use upright_design::rig::{Chain, Rig, RigError};

use crate::estimated::Identification;
use crate::old_values::old_values;
use crate::parameters::{Layout, priors};
use crate::rig_file::rig_file;

/// The parameters `p` that were found from recordings of `rig`, as the new rig file has them. Tilt, delay and zeros are
/// those of the recordings, and masses and frictions those in the newtons of the old file.
///
/// # Errors
/// [`RigError`] if the new file would not be valid.
pub(crate) fn as_written(
    rig: &Rig,
    text: &str,
    found: &Identification,
    p: &[f64],
) -> Result<Vec<f64>, RigError> {
    let name = Path::new("the new file");
    let new = Rig::from_toml(&rig_file(text, rig, found, "", name)?, name)?;
    let (Some(chain), Some(old)) = (new.chain(), rig.chain()) else { return Ok(p.to_vec()) };
    let layout = Layout { links: old.links.len() };
    let start: Vec<f64> = priors(&new, chain, false).iter().map(|prior| prior.value).collect();
    let mut written = old_values(&new, layout, &start, p);
    let last = layout.first_moment(layout.links - 1);
    let scale = match (new.actuator.motor(), rig.actuator.motor()) {
        _ if found.is_moved || !found.is_driven => p[last] / written[last],
        (Some(new), Some(old)) => new.resistance_ohm / old.resistance_ohm,
        _ => 1.0,
    };
    for (kind, value) in layout.kinds().into_iter().zip(&mut written) {
        if kind.is_of_masses() || kind.is_of_cart() {
            *value *= scale;
        }
    }
    let step = |chain: &Chain, rig: &Rig| {
        rig.actuator.pulses().map(|drive| drive.step_m).or(chain.cart.encoder_step_m)
    };
    // A table in metres has a scale of its own.
    written[layout.travel()] = match (found.is_log, step(chain, &new), step(old, rig)) {
        (true, Some(new), Some(old)) => new / old,
        _ => p[layout.travel()],
    };
    Ok(written)
}
