//! What was found: the sizes of an imperfection, the runs of a size, and the cure.

use serde::Serialize;
use upright::table::Law;

use upright_design::number::significant;
use upright_design::rig::{Base, Imperfection, Rig};
use upright_design::simulate::{Disturbance, FallKind};

/// Settings of the search for the sizes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImperfectionSettings {
    /// Duration of each run (s).
    pub duration_s: f64,
    /// Number of runs of each size, with the seeds from 1; all of them have to survive.
    pub seeds: u64,
    /// Disturbances of the runs.
    pub disturbance: Disturbance,
    /// Relative precision of a size.
    pub relative: f64,
}

impl ImperfectionSettings {
    /// 4 runs of 10 s with the disturbances the rig file expects, to a tenth.
    pub fn of(rig: &Rig) -> Self {
        Self { duration_s: 10.0, seeds: 4, disturbance: Disturbance::of(rig), relative: 0.1 }
    }
}

/// Results of the runs with one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeRuns {
    /// Number of runs.
    pub runs: u64,
    /// Number of runs that the controller alone survives.
    pub survived: u64,
    /// Number of runs in which the whole firmware survives: neither its limits nor its fault detection turns the motor
    /// off.
    pub stayed_on: u64,
    /// How the first of the others ended.
    pub ended_by: Option<FallKind>,
    /// Largest angle of any link from the vertical in any run (rad).
    pub peak_angle_rad: f64,
    /// Largest distance of the cart from its set-point in any run (m).
    pub peak_position_m: f64,
}

/// How much of one imperfection alone a law survives.
#[derive(Debug, Clone, Serialize)]
pub struct Survival {
    /// The imperfection.
    pub imperfection: &'static Imperfection,
    /// Size from which a run of the controller alone falls; none: it survives the largest one tried.
    pub falls_at: Option<f64>,
    /// Size from which the whole firmware turns the motor off in a run; none: it stays on with the largest one tried.
    pub turned_off_at: Option<f64>,
    /// What ends the run of the whole firmware at that size.
    pub ended_by: Option<FallKind>,
    /// The same as `turned_off_at` with a set-point that moves by 0.1 m and back, or by half of the way to the nearer
    /// end of the rail.
    pub off_moving_at: Option<f64>,
    /// The best change of the rig file that was tried; none if none of them helps.
    pub cure: Option<Cure>,
    /// Every change that was tried.
    #[serde(skip)]
    pub tried: Vec<String>,
    /// For joint friction, the sizes for each of the bristle lengths; the sizes above are the smaller ones.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bristles: Vec<BristleSurvival>,
    /// Largest size tried.
    pub largest_tried: f64,
    /// Typical size in a poor machine over the smallest of these sizes: above 1 the imperfection is dangerous.
    pub danger: f64,
}

/// A change of the rig file with which the motor stays on up to a larger size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cure {
    /// Key and value.
    pub change: String,
    /// Size from which the whole firmware then turns the motor off, or the largest one tried.
    pub turned_off_at: f64,
}

/// Sizes of joint friction that builds up over this angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BristleSurvival {
    /// The angle (rad): `presliding_rad` of `[reality]`.
    pub bristle_rad: f64,
    /// As in [`Survival`].
    pub falls_at: Option<f64>,
    /// As in [`Survival`].
    pub turned_off_at: Option<f64>,
    /// As in [`Survival`].
    pub off_moving_at: Option<f64>,
}

impl Survival {
    /// What was found beside the sizes: the sizes for each bristle length, and the cure.
    pub fn remarks(&self) -> Vec<String> {
        let of_bristle = |of: &BristleSurvival| {
            let [falls, off, moving] =
                [of.falls_at, of.turned_off_at, of.off_moving_at].map(|size| self.size_text(size));
            let bristle = significant(of.bristle_rad, 2);
            format!(
                "friction that builds up over {bristle} rad: falls at {falls}, motor off {off}, moving {moving}"
            )
        };
        let cure = match (&self.cure, self.turned_off_at) {
            (Some(Cure { change, turned_off_at }), _) => {
                Some(format!("with {change}: motor off {}", significant(*turned_off_at, 2)))
            }
            (None, Some(_)) if !self.tried.is_empty() => {
                Some(format!("no cure found; tried: {}", self.tried.join(", ")))
            }
            (None, _) => None,
        };
        self.bristles.iter().map(of_bristle).chain(cure).collect()
    }

    /// [`Self::falls_at`] as text.
    pub fn falls_text(&self) -> String {
        self.size_text(self.falls_at)
    }

    /// [`Self::turned_off_at`] as text.
    pub fn turned_off_text(&self) -> String {
        self.size_text(self.turned_off_at)
    }

    /// [`Self::off_moving_at`] as text.
    pub fn off_moving_text(&self) -> String {
        self.size_text(self.off_moving_at)
    }

    /// What ends the run of the whole firmware at that size, as text; empty if it stays on.
    pub fn ended_by_text(&self) -> String {
        self.ended_by.map_or(String::new(), |kind| kind.to_string())
    }

    fn size_text(&self, size: Option<f64>) -> String {
        size.map_or_else(|| format!("> {}", significant(self.largest_tried, 2)), |size| significant(size, 2))
    }
}

/// What a law survives: each imperfection alone, the most dangerous one first, and those of the rig file together.
#[derive(Debug, Clone, Serialize)]
pub struct Imperfections {
    /// The law in the loop.
    pub law: Law,
    /// Settings of the search.
    pub settings: ImperfectionSettings,
    /// Each imperfection alone.
    pub alone: Vec<Survival>,
    /// Those that are not simulated on this machine.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// All imperfections of the rig file's `[reality]` together, at rest and with a set-point that moves; none without
    /// any.
    pub together: Option<SizeRuns>,
}

/// An imperfection that is not simulated on a machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LeftOut {
    /// Its key.
    pub key: &'static str,
    /// Why it is left out.
    pub reason: &'static str,
}

impl LeftOut {
    /// Those of a rig.
    pub fn of(rig: &Rig) -> Vec<Self> {
        let reason = |one: &Imperfection| Some(Self { key: one.key, reason: one.not_on(rig)? });
        Imperfection::of_base(rig.base()).iter().filter_map(reason).collect()
    }
}

impl SizeRuns {
    /// How many survive, as text: the controller alone, too, if the firmware turns the motor off in some.
    pub fn text(&self, base: Base) -> String {
        let Self { runs, survived, stayed_on, peak_angle_rad, peak_position_m, .. } = self;
        let off = self.ended_by.map_or(String::new(), |kind| format!(" ({kind})"));
        let alone =
            if survived == stayed_on { String::new() } else { format!("; the controller alone {survived}") };
        format!(
            "{stayed_on} of {runs} survive{off}{alone}, up to {peak_angle_rad:.3} rad and {peak_position_m:.3} {}",
            base.position().unit
        )
    }
}

/// A size that the loop has to survive according to `[verify]`, or the whole `[reality]`, and the results of its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RequiredSurvival {
    /// The key of the imperfection, or `reality`.
    pub key: &'static str,
    /// The requirement, with this key.
    pub requirement: &'static str,
    /// The required size; none for `[reality]`.
    pub size: Option<f64>,
    /// Results of the runs with this size, at rest and with a set-point that moves.
    pub verdict: SizeRuns,
}
