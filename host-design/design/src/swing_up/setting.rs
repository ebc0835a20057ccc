//! What the rig file says about swing-up, with every default filled in.

use super::SwingUpError;
use super::dynamics::{Dynamics, dynamics};
use super::hold::tick;
use super::problem::Bounds;
use super::tracking::{Filter, Noise, stationary};
use crate::numerics::Matrix;
use crate::rig::{Chain, Motor, PlantDescription, Rig, Sensor, SwingUpRules};
use crate::verify::Disturbance;

/// Process noise that the filter expects in motion, as multiples of the rig's: in motion, wrong masses disturb more
/// than at rest.
const JOINT_NOISE: f64 = 100.0;
const FORCE_NOISE: f64 = 10.0;
/// Time after which the filter at rest has settled.
const SETTLE_S: f64 = 2.0;

/// Everything that searching and judging needs to know about a rig.
pub(super) struct Setting<'a> {
    pub(super) rig: &'a Rig,
    pub(super) rules: SwingUpRules,
    pub(super) chain: &'a Chain,
    pub(super) dynamics: Box<dyn Dynamics>,
    pub(super) tick_s: f64,
    /// What the actuator can do; a plan keeps away from it.
    pub(super) actuator: Bounds,
    pub(super) disturbance: Disturbance,
    pub(super) noise: Noise,
    /// Encoder step of each sensor.
    pub(super) steps: Vec<f64>,
    pub(super) weights: Matrix<f64>,
    pub(super) force_weight: f64,
    /// Cost-to-go, K and the filter's gain about upright, all stationary.
    pub(super) upright_cost: Matrix<f64>,
    pub(super) upright_k: Matrix<f64>,
    pub(super) upright_l: Matrix<f64>,
    /// Cost-to-go about hanging.
    pub(super) hanging_cost: Matrix<f64>,
    /// Covariances of the settled filters.
    pub(super) hanging_covariance: Matrix<f64>,
    pub(super) upright_covariance: Matrix<f64>,
}

impl<'a> Setting<'a> {
    pub(super) fn of(rig: &'a Rig) -> Result<Self, SwingUpError> {
        let PlantDescription::Chain(chain) = &rig.plant else { return Err(SwingUpError::NotAChain) };
        let (Some(lqr), Some(kalman)) = (&rig.lqr, &rig.kalman) else {
            return Err(SwingUpError::Needs("[lqr] and [kalman]"));
        };
        let force_n =
            rig.force_limit_n().ok_or(SwingUpError::Needs("force_limit_n in [actuator], or a motor"))?;
        if rig.tick.delay_ticks != 0 {
            return Err(SwingUpError::Delay);
        }
        let sensors = rig.sensors();
        if sensors.len() != chain.links.len() + 1 {
            return Err(SwingUpError::Needs("an encoder at every link"));
        }
        let (dynamics, tick_s) = (dynamics(chain)?, rig.tick.period_s);
        let steps: Vec<f64> = sensors.iter().map(|sensor| sensor.step()).collect();
        let rounding = |(sensor, step): (&Sensor, &f64)| (sensor.state, step * step / 12.0);
        let joints = kalman.joint_noise.iter().map(|intensity| JOINT_NOISE * intensity);
        let rules = rig.swing_up.clone().unwrap_or_default();
        let wrong = rules.friction_spread_percent / 100.0;
        let of_links = chain.links.iter().map(|link| link.friction_n_m_s_per_rad);
        let frictions = [chain.cart.friction_n_s_per_m].into_iter().chain(of_links);
        let noise = Noise {
            friction_errors: frictions.map(|friction| wrong * friction).collect(),
            intensities: [FORCE_NOISE * kalman.force_noise_n2_s].into_iter().chain(joints).collect(),
            sensors: sensors.iter().zip(&steps).map(rounding).collect(),
        };
        let weights = Matrix::from_diagonal(&lqr.state_weights);
        let (states, force_weight) = (rig.states(), lqr.force_weight);
        let (upright, hanging) = (vec![0.0; states], hanging(states));
        let at_upright = tick(&*dynamics, &upright, 0.0, tick_s);
        let at_hanging = tick(&*dynamics, &hanging, 0.0, tick_s);
        let (upright_cost, upright_k) = stationary(&at_upright, &weights, force_weight, tick_s);
        let (hanging_cost, _) = stationary(&at_hanging, &weights, force_weight, tick_s);
        let settle = (SETTLE_S / tick_s) as usize;
        let mut filter = Filter::new(&*dynamics, &noise, states, tick_s);
        filter.settle(&hanging, &at_hanging, settle)?;
        let hanging_covariance = filter.covariance.clone();
        let mut filter = Filter::new(&*dynamics, &noise, states, tick_s);
        let upright_l = filter.settle(&upright, &at_upright, settle)?;
        let upright_covariance = filter.covariance.clone();
        Ok(Self {
            actuator: Bounds {
                force_n,
                motor: rig.actuator.motor.as_ref().map(motor),
                speed_m_per_s: None,
                rail_m: Some(chain.cart.travel_m),
            },
            disturbance: Disturbance::of(rig),
            rig,
            rules,
            chain,
            tick_s,
            noise,
            steps,
            weights,
            force_weight,
            upright_cost,
            upright_k,
            upright_l,
            hanging_cost,
            hanging_covariance,
            upright_covariance,
            dynamics,
        })
    }
}

/// Hanging at rest with the cart at 0.
pub(super) fn hanging(states: usize) -> Vec<f64> {
    let mut state = vec![0.0; states];
    state[2] = core::f64::consts::PI;
    state
}

/// Force at standstill with the voltage beyond the dead zone, and its loss with speed by back-EMF.
fn motor(motor: &Motor) -> [f64; 2] {
    let volts_per_speed = motor.volts_per_speed();
    let newtons_per_volt = volts_per_speed / motor.resistance_ohm;
    [newtons_per_volt * (motor.supply_v - motor.dead_zone_v), newtons_per_volt * volts_per_speed]
}
