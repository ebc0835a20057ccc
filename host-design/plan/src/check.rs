//! An independent check of a motion: every tick is integrated again by another method, and every limit has to hold.

use serde::Serialize;

use super::SwingUpError;
use super::setting::Setting;
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::plant::chain_plant;
use upright_design::plant::reference::{Tolerance, integrate};
use upright_design::rig::AbsoluteRange;

/// Largest difference that the adaptive integrator may find in a tick, in the units of the states.
const DRIFT: f64 = 5e-8;
/// Tolerance of the adaptive integrator.
const TOLERANCE: Tolerance = Tolerance { relative: 1e-11, absolute: 1e-11 };

/// Peak values of a motion that has passed the check.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peaks {
    /// Duration (s).
    pub duration_s: f64,
    /// Largest difference between a state and the adaptive integrator's result from the state before, in the units of
    /// the states.
    pub drift: f64,
    /// Largest force (N) or acceleration (m/s²).
    pub input: f64,
    /// Largest distance of the cart from the middle (m).
    pub position_m: f64,
    /// Largest speed of the cart (m/s).
    pub speed_m_per_s: f64,
    /// Largest rate of a joint (rad/s).
    pub rate_rad_per_s: f64,
    /// Largest used share of a limit of the actuator or the rail; 1: the limit is reached.
    pub used: f64,
}

/// Checks `motion`: its ends, the equations of motion, and the limits of the machine.
///
/// # Errors
/// [`SwingUpError::Broken`] with the condition that does not hold, or [`SwingUpError::DeadBand`].
pub(crate) fn check(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
) -> Result<Peaks, SwingUpError> {
    let broken = |what: String| SwingUpError::Broken { transition, what };
    let ends = transition.ends_near(&motion.x[motion.steps()]);
    if [&motion.x[0], &motion.x[motion.steps()]] != [&ends[0], &ends[1]] {
        return Err(broken("it does not begin and end at rest".to_owned()));
    }
    stays_in_travel(setting, motion, transition)?;
    let plant = chain_plant(setting.chain)?;
    let no_torques = vec![0.0; setting.chain.links.len()];
    let mut drift: f64 = 0.0;
    for (k, (x, &u)) in motion.x.iter().zip(&motion.u).enumerate() {
        let end = integrate(&*plant, x, |_, _| u, &no_torques, motion.tick_s, TOLERANCE)
            .map_err(|error| broken(format!("tick {k}: {error}")))?;
        for (end, next) in end.iter().zip(&motion.x[k + 1]) {
            drift = drift.max((end - next).abs());
        }
    }
    if drift > DRIFT {
        return Err(broken(format!(
            "the equations of motion are missed by {drift:.1e} in a tick, more than {DRIFT:.0e}"
        )));
    }
    let mut used: f64 = 0.0;
    for (k, x) in motion.x.iter().enumerate() {
        let u = motion.u.get(k).copied().unwrap_or(0.0);
        for limit in setting.actuator.limits() {
            let room = limit.room(x, u);
            if room < 0.0 {
                let t = k as f64 * motion.tick_s;
                return Err(broken(format!("the limit of the {} is exceeded at {t:.3} s", limit.name)));
            }
            used = used.max(1.0 - room / limit.bound);
        }
    }
    let largest = |of: &dyn Fn(&[f64]) -> f64| motion.x.iter().fold(0.0, |most: f64, x| most.max(of(x)));
    Ok(Peaks {
        duration_s: motion.duration_s(),
        drift,
        input: motion.input(),
        position_m: motion.position_m(),
        speed_m_per_s: largest(&|x| x[1].abs()),
        rate_rad_per_s: largest(&|x| x.iter().skip(3).step_by(2).fold(0.0, |most: f64, w| most.max(w.abs()))),
        used,
    })
}

/// Checks that no joint with a potentiometer comes into its dead band.
fn stays_in_travel(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
) -> Result<(), SwingUpError> {
    for sensor in setting.rig.sensors() {
        let Some(range) = sensor.absolute.filter(AbsoluteRange::has_dead_band) else { continue };
        let position = |x: &Vec<f64>| (x[sensor.state] / sensor.step::<f64>()).round() as i64;
        let is_dead = |x: &Vec<f64>| range.is_dead(range.reading(position(x)));
        let Some(tick) = motion.x.iter().position(is_dead) else { continue };
        let zeros = range.zeros_that_read(motion.x.iter().map(position));
        let (link, at_s) = (sensor.state / 2, tick as f64 * motion.tick_s);
        return Err(SwingUpError::DeadBand { transition, link, at_s, zeros });
    }
    Ok(())
}
