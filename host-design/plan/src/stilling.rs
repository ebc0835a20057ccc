//! Random runs of the whole firmware that stills tumbling links.

use core::f64::consts::PI;
use core::fmt;

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use super::SwingUpError;
use super::robustness::{scale_friction, scale_mass};
use upright_closed_loop::harness::{
    Flow, HarnessError, Participant, RailEnds, Target, World, until, with_firmware,
};
use upright_design::plant::chain_plant;
use upright_design::rig::{CartInput, Chain, PerJoint, Rig, Tolerances};
use upright_design::simulate::{Scenario, SimulationError};
use upright_design::study::{Study, infinite_if_null};
use upright_design::table::TableValues;

/// The base begins within this share of the rail from the middle.
const START: f64 = 0.3;
/// Errors of each mass, and of all friction.
const MASS: f64 = 0.1;
const FRICTION: f64 = 0.3;
/// Longest time that is watched (s): longer than the firmware stills after a command.
const LONGEST_S: f64 = 21.0;

/// What the links of a machine do when stilling begins, and what the machine is like.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tumbling {
    /// Energy above that of hanging links, as a multiple of that of upright ones.
    pub energies: f64,
    /// Whether the machine has the dry friction of a typical one, wrong by up to 30 %.
    pub has_dry_friction: bool,
}

/// How a run has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stilled {
    /// When the links hung still (s); infinite if they did not.
    #[serde(deserialize_with = "infinite_if_null")]
    pub time_s: f64,
    /// The fault that ended it, if there was one.
    pub fault: Option<String>,
    /// Largest distance of the base from the middle (m).
    pub farthest_m: f64,
    /// Largest speed of the base (m/s).
    pub fastest_m_per_s: f64,
    /// Whether the base has touched an end of the rail.
    pub is_at_end: bool,
    /// Largest energy that the drive has returned to its supply, more than it has taken since (J); with a force that is
    /// no motor's, the work of the links on the base.
    pub returned_j: f64,
}

/// Runs of the whole firmware with `table` on machines like `rig` whose links tumble, with the seeds from `seed` on.
///
/// # Errors
/// [`SwingUpError`] if the firmware cannot be made to still the links.
pub fn stilled(
    rig: &Rig,
    table: &TableValues,
    tumbling: Tumbling,
    (seed, runs): (u64, u64),
    study: &Study,
) -> Result<Vec<Stilled>, SwingUpError> {
    let name = format!("{} energies, dry friction: {}", tumbling.energies, tumbling.has_dry_friction);
    study.outcomes(&name, runs, |number| {
        with_firmware(table, |target| still(rig, table, tumbling, seed + number, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    })
}

/// The run with this seed: a hand turns the links there, and lets go of them with their rates when the firmware begins.
fn still(
    rig: &Rig,
    table: &TableValues,
    tumbling: Tumbling,
    seed: u64,
    target: &mut dyn Target,
) -> Result<Stilled, HarnessError> {
    let (machine, start) = drawn(rig, tumbling, seed)?;
    let scenario = Scenario { seed, substeps: 2, ..Scenario::swing_up(&machine, 0.0, None) };
    let mut world = World::new(&machine, table, &scenario, target)?;
    world.by_hand_until(|status| {
        let is_checked = status.signs == Signs::Checked && status.motor == MotorSign::Checked;
        status.state == State::Calibrated && is_checked
    })?;
    world.hand.hold_in(&start);
    let _ = world.tick(&mut [])?;
    world.let_go();
    match world.ask(Request::Still)? {
        Answer::Done => {}
        answer => return Err(HarnessError::Refused { request: Request::Still, answer }),
    }
    let mut watch = StillingWatch::of(rig);
    world.run((LONGEST_S / rig.tick.period_s) as usize, &mut [&mut RailEnds::of(rig), &mut watch])?;
    Ok(watch.seen)
}

/// A machine like `rig` with errors of masses and friction, and links that tumble with the wanted energy; drawn with
/// `seed`.
fn drawn(rig: &Rig, tumbling: Tumbling, seed: u64) -> Result<(Rig, Vec<f64>), SimulationError> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut machine = rig.clone();
    let mut start = vec![0.0; rig.states()];
    let factors: Vec<f64> = (0..=start.len() / 2).map(|_| random.random_range(-1.0..=1.0)).collect();
    let Some(chain) = machine.chain_mut() else { return Ok((machine, start)) };
    let links = chain.links.len();
    (0..=links).for_each(|body| scale_mass(chain, body, 1.0 + MASS * factors[body]));
    let friction = 1.0 + FRICTION * factors[links + 1];
    scale_friction(chain, friction);
    set_in_motion(chain, tumbling.energies, &mut start, &mut random)?;
    if tumbling.has_dry_friction
        && let Some(of_file) = rig.chain()
    {
        let typical = Tolerances::typical(of_file);
        let dry = &mut machine.reality.friction;
        dry.joint_friction_n_m = PerJoint::all(friction * typical.joint_friction_n_m);
        if of_file.input == CartInput::Force {
            dry.cart_friction_n = friction * typical.cart_friction_n;
        }
    }
    Ok((machine, start))
}

/// Draws a position of the base, angles and rates, so that the links have so many times the energy of upright ones.
fn set_in_motion(
    chain: &Chain,
    energies: f64,
    start: &mut [f64],
    random: &mut Pcg64,
) -> Result<(), SimulationError> {
    let mut plant = chain_plant(chain)?;
    let upright_j = plant.energy().map_or(0.0, |energy| energy.potential);
    let wanted_j = (2.0 * energies - 1.0) * upright_j;
    let [low, high] = chain.cart.travel_m;
    loop {
        start[0] = START * random.random_range(low..=high);
        for (number, joint) in start.as_chunks_mut::<2>().0.iter_mut().skip(1).enumerate() {
            // Within half a turn of where it hangs: a hand that turns it there in a tick confuses no counter.
            let hangs = if number == 0 { PI } else { 0.0 };
            *joint = [hangs + random.random_range(-PI..=PI), StandardNormal.sample(random)];
        }
        plant.set_state(start);
        let Some(energy) = plant.energy().filter(|energy| energy.potential < wanted_j) else { continue };
        let faster = ((wanted_j - energy.potential) / energy.kinetic).sqrt();
        start.iter_mut().skip(3).step_by(2).for_each(|rate| *rate *= faster);
        return Ok(());
    }
}

/// Watches the rig until the firmware has ended its stilling.
struct StillingWatch<'a> {
    rig: &'a Rig,
    seen: Stilled,
    returned_j: f64,
    /// Duty, or none, and speed of the base at the start of the tick.
    driven: (Option<f64>, f64),
}

impl<'a> StillingWatch<'a> {
    fn of(rig: &'a Rig) -> Self {
        let seen = Stilled {
            time_s: f64::INFINITY,
            fault: None,
            farthest_m: 0.0,
            fastest_m_per_s: 0.0,
            is_at_end: false,
            returned_j: 0.0,
        };
        Self { rig, seen, returned_j: 0.0, driven: (None, 0.0) }
    }

    /// Power that the drive takes from its supply in this tick (W).
    fn taken_w(&self, force_n: f64) -> f64 {
        match (self.rig.actuator.motor(), self.driven) {
            (Some(motor), (Some(duty), _)) => duty * motor.supply_v * force_n / motor.newtons_per_amp(),
            (_, (_, speed)) => force_n * speed,
        }
    }
}

impl Participant for StillingWatch<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let duty = if let Drive::Duty(duty) = output.drive { Some(duty.into()) } else { None };
        self.driven = (duty, world.bench.state()[1]);
        until(false)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let [position, speed] = [world.bench.state()[0], world.bench.state()[1]];
        let seen = &mut self.seen;
        seen.farthest_m = seen.farthest_m.max(position.abs());
        seen.fastest_m_per_s = seen.fastest_m_per_s.max(speed.abs());
        let [low, high] =
            self.rig.chain().map_or([f64::NEG_INFINITY, f64::INFINITY], |chain| chain.cart.travel_m);
        seen.is_at_end |= !(low..=high).contains(&position);
        let period_s = self.rig.tick.period_s;
        self.returned_j = (self.returned_j - period_s * self.taken_w(world.force_n())).max(0.0);
        self.seen.returned_j = self.seen.returned_j.max(self.returned_j);
        let has_ended = world.session.status().state != State::Stilling;
        if has_ended {
            self.seen.fault = world.session.fault().map(|fault| fault.to_string());
            // The firmware goes on for 20 s, and has then not stilled the links.
            let time_s = world.ticks() as f64 * period_s;
            let is_still = self.seen.fault.is_none()
                && time_s < f64::from(upright::supervision::stilling::LONGEST_S) - 0.1;
            self.seen.time_s = if is_still { time_s } else { f64::INFINITY };
        }
        until(has_ended)
    }
}

/// The share of the runs that are still after a time: the time until which a share of them (0 to 1) is.
pub fn quantile_s(runs: &[Stilled], share: f64) -> f64 {
    let mut times: Vec<f64> = runs.iter().map(|run| run.time_s).collect();
    times.sort_by(f64::total_cmp);
    let index = (share * times.len() as f64).ceil().max(1.0) as usize - 1;
    times.get(index).copied().unwrap_or(f64::INFINITY)
}

/// What the runs say about a rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StillingRuns {
    /// Runs made.
    pub runs: usize,
    /// Runs in which the links hung still in the end, without a fault.
    pub still: usize,
    /// Runs in which the base has touched an end of the rail.
    pub at_end: usize,
    /// Time until half and 95 % of all runs were still (s); infinite if fewer were.
    pub within_s: [f64; 2],
    /// Energy returned to the supply that 95 % of the runs do not exceed (J).
    pub returned_j: f64,
    /// Capacitor that takes it before the supply counts as too high (F); none without a known supply.
    pub capacitor_f: Option<f64>,
}

impl StillingRuns {
    /// Sums up `all`, which are runs of `rig` with `table`.
    pub fn of(table: &TableValues, all: &[Stilled]) -> Self {
        let count = |what: &dyn Fn(&&Stilled) -> bool| all.iter().filter(what).count();
        let mut returned: Vec<f64> = all.iter().map(|run| run.returned_j).collect();
        returned.sort_by(f64::total_cmp);
        let returned_j = returned.get(returned.len() * 95 / 100).copied().unwrap_or_default();
        // ½ C (V_max² - V²) = E
        let capacitor = |supply_v: f32| {
            let [supply_v, max_v] = [supply_v, table.drive.supply_max_v()].map(f64::from);
            2.0 * returned_j / (max_v * max_v - supply_v * supply_v)
        };
        Self {
            runs: all.len(),
            still: count(&|run| run.time_s.is_finite()),
            at_end: count(&|run| run.is_at_end),
            within_s: [0.5, 0.95].map(|share| quantile_s(all, share)),
            returned_j,
            capacitor_f: table.drive.supply_v().map(capacitor),
        }
    }
}

impl fmt::Display for StillingRuns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [half_s, most_s] = self.within_s;
        let Self { runs, still, at_end, returned_j, .. } = self;
        writeln!(
            f,
            "  runs that are still   {still} of {runs}; half of them after {half_s:.1} s, 95 % after {most_s:.1} s"
        )?;
        writeln!(f, "  runs at an end stop   {at_end}")?;
        write!(f, "  returned to supply    {returned_j:.2} J in 95 %")?;
        match self.capacitor_f {
            Some(capacitor_f) => writeln!(f, ": a capacitor of {:.1} mF, or a chopper", 1e3 * capacitor_f),
            None => writeln!(f),
        }
    }
}
