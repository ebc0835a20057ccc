//! What the trust report says of one law: its parts, how each of them is computed, and the rows that show them. The
//! text report and the page show the rows, and a test compares the documentation with their names and meanings.

use serde::Serialize;
use upright::table::Law;

use QuantityValues::{Each, One};

use super::corners::MOST_LINKS;
use super::{
    Attraction, AttractionSettings, CoarsestEncoder, CornerSettings, Corners, Effort, EncoderSettings,
    ImperfectionSettings, LimitShare, LinearReport, Margins, MassTolerance, MonteCarlo, NoiseRun, NoiseShare,
    Outcome, PushSurvival, RequiredSurvival, Tilt, VerifyError, attraction, coarsest_encoder, corner_noise,
    corners, mass_tolerances, monte_carlo, noise_run, pushes, required_imperfections, spread,
};
use upright_design::number::significant;
use upright_design::parallel::{Progress, ProgressStep};
use upright_design::rig::Rig;
use upright_design::simulate::Disturbance;
use upright_design::table::TableValues;

/// What was found for one law. Parts for which a rig has no data (masses of a `[model]`, encoders) are none, and so
/// are the runs of an unstable loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawTrust {
    /// Margins, tick, noise, rounding, certificates.
    pub linear: LinearReport,
    /// Largest tilts and step.
    pub attraction: Option<Attraction>,
    /// Pushes by hand.
    pub pushes: Vec<PushSurvival>,
    /// Ripple in simulated runs with noise.
    pub noise_run: Option<NoiseRun>,
    /// The same at the corners of `[robust]`; none without `[robust]`.
    pub corner_noise: Option<NoiseRun>,
    /// The coarsest encoder.
    pub coarsest_encoder: Option<CoarsestEncoder>,
    /// Runs with every combination of mass errors.
    pub corners: Option<Corners>,
    /// Tolerated error of each single mass, the most critical first.
    pub mass_tolerances: Vec<MassTolerance>,
    /// Runs with random plants.
    pub monte_carlo: Option<MonteCarlo>,
    /// Imperfections of the machine that `[verify]` requires the loop to survive.
    pub imperfections: Vec<RequiredSurvival>,
}

impl LawTrust {
    /// A report with the linear part only.
    pub fn linear_only(linear: LinearReport) -> Self {
        Self {
            linear,
            attraction: None,
            pushes: Vec::new(),
            noise_run: None,
            corner_noise: None,
            coarsest_encoder: None,
            corners: None,
            mass_tolerances: Vec::new(),
            monte_carlo: None,
            imperfections: Vec::new(),
        }
    }
}

/// Computes all parts of one law.
pub(super) fn law_trust(
    rig: &Rig,
    table: &TableValues,
    linear: LinearReport,
    effort: Effort<'_>,
    progress: Progress<'_>,
) -> Result<LawTrust, VerifyError> {
    let stage = |name| progress(ProgressStep::Begin(name, 1));
    let law = linear.law;
    let is_chain = rig.chain().is_some();
    let mut trust = LawTrust::linear_only(linear);
    if !trust.linear.stable {
        return Ok(trust);
    }
    stage("region of attraction");
    trust.attraction = known(attraction(rig, table, law, &AttractionSettings::default()))?;
    if is_chain {
        stage("pushes");
        trust.pushes = known(pushes(rig, table, law))?.unwrap_or_default();
    }
    stage("noise");
    trust.noise_run = noise(rig, table, law)?;
    if rig.robust.is_some() && is_chain && rig.links() <= MOST_LINKS {
        stage("corners of [robust]");
        trust.corner_noise = known(corner_noise(rig, table, law, &Disturbance::of(rig)))?;
    }
    if table.observer.is_some() && is_chain {
        stage("coarsest encoder");
        trust.coarsest_encoder = known(coarsest_encoder(rig, law, &EncoderSettings::of(rig)))?;
    }
    // With more links there are too many combinations to try.
    if is_chain && rig.links() <= MOST_LINKS {
        stage("mass errors");
        let settings = CornerSettings::of(rig);
        trust.corners = known(corners(rig, table, law, rig.verify.corner_percent, &settings))?;
        let mut tolerances = known(mass_tolerances(rig, table, law, &settings))?.unwrap_or_default();
        tolerances.sort_by(|one, other| one.percent().total_cmp(&other.percent()));
        trust.mass_tolerances = tolerances;
    }
    if is_chain {
        stage("imperfections");
        let found = required_imperfections(rig, table, law, &ImperfectionSettings::of(rig));
        trust.imperfections = known(found)?.unwrap_or_default();
        progress(ProgressStep::Begin("random plants", effort.runs as u64));
        let done = || progress(ProgressStep::Done);
        trust.monte_carlo = known(monte_carlo(rig, table, law, &spread(rig, effort.late), &effort, &done))?;
    }
    Ok(trust)
}

/// Runs with noise on the machine of `[reality]`.
pub(super) fn noise(rig: &Rig, table: &TableValues, law: Law) -> Result<Option<NoiseRun>, VerifyError> {
    known(noise_run(rig, table, law, &Disturbance::of(rig), 4, 20.0))
}

/// A part for which the rig file has no data is left out; any other failure is an error.
fn known<T>(part: Result<T, VerifyError>) -> Result<Option<T>, VerifyError> {
    match part {
        Ok(part) => Ok(Some(part)),
        Err(VerifyError::NotAChain(_) | VerifyError::NoObserver) => Ok(None),
        Err(error) => Err(error),
    }
}

/// One row of the trust report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundRow {
    /// Name of the quantity, with its link or source.
    pub name: String,
    /// What was found, with its unit.
    pub value: String,
    /// What the value means.
    pub meaning: String,
}

/// One quantity of the trust report.
#[derive(Debug, Clone, Copy)]
pub struct TrustQuantity {
    /// Name of its row, or beginning of the names of its rows.
    pub name: &'static str,
    /// What the value means.
    pub meaning: &'static str,
    values: QuantityValues,
}

/// Function that makes the text of the values.
#[derive(Debug, Clone, Copy)]
enum QuantityValues {
    /// One row; none where the report does not have it.
    One(fn(&Rig, &LawTrust) -> Option<String>),
    /// A row for each link or source, whose name follows that of the quantity.
    Each(fn(&Rig, &LawTrust) -> Vec<(String, String)>),
}

/// Every quantity, in the order in which they are shown.
pub const QUANTITIES: &[TrustQuantity] = &[
    TrustQuantity {
        name: "spectral radius",
        meaning: "largest absolute value of a pole of the sampled loop: stable below 1",
        values: One(|_, law| {
            let suffix = if law.linear.stable { "" } else { ", NOT STABLE" };
            Some(format!("{:.6}{suffix}", law.linear.spectral_radius))
        }),
    },
    TrustQuantity {
        name: "gain margin",
        meaning: "factors by which the real force may constantly differ from the commanded force before the loop is \
                  unstable; of a DC motor, the voltage, and of a stepper, the acceleration",
        values: One(|_, law| {
            let margins = margins(law)?;
            let highest = margins.highest_gain.map_or("any".to_owned(), number);
            Some(format!("factor {} to {highest}", number(margins.lowest_gain)))
        }),
    },
    TrustQuantity {
        name: "phase margin",
        meaning: "phase that the loop may lose or gain",
        values: One(|_, law| {
            let phase = margins(law)?.phase_margin_rad;
            Some(phase.map_or("no limit".to_owned(), |phase| format!("{:.1}°", phase.to_degrees())))
        }),
    },
    TrustQuantity {
        name: "delay margin",
        meaning: "additional delay of the force, including fractions of a tick, at which the loop becomes unstable",
        values: One(|_, law| {
            let margins = margins(law)?;
            Some(match (margins.delay_margin_s, margins.delay_margin_ticks) {
                (Some(s), Some(ticks)) => format!("{} ms = {} ticks", number(1e3 * s), number(ticks)),
                _ => "no limit".to_owned(),
            })
        }),
    },
    TrustQuantity {
        name: "peak sensitivity",
        meaning: "largest amplification of a disturbance over all frequencies (Ms), and where it occurs",
        values: One(|_, law| {
            let margins = margins(law)?;
            let frequency = number(margins.peak_sensitivity_rad_per_s);
            Some(format!("{} at {frequency} rad/s", number(margins.peak_sensitivity)))
        }),
    },
    TrustQuantity {
        name: "disk margin",
        meaning: "size of the disk in which gain and phase may change together; 0: no margin",
        values: One(|_, law| Some(number(margins(law)?.disk_margin))),
    },
    TrustQuantity {
        name: "longest stable tick",
        meaning: "longest period at which the same table still gives a stable loop",
        values: One(|_, law| {
            let longest = law.linear.tick.as_ref()?.longest_stable_s;
            Some(longest.map_or("30 ticks or more".to_owned(), |s| format!("{} ms", number(1e3 * s))))
        }),
    },
    TrustQuantity {
        name: "jitter margin",
        meaning: "each force may be late by any time up to this, differently in every tick (C.-Y. Kao and B. Lincoln, \
                  Automatica 40, 2004); sufficient, not necessary",
        values: One(|_, law| Some(format!("{} ms", number(1e3 * law.linear.tick.as_ref()?.jitter_s)))),
    },
    TrustQuantity {
        name: "least resonance",
        meaning: "frequency to which the resonance of a step motor with the cart may fall before the loop, which does not know \
                  of it, is unstable; its damping is `motor_damping_percent` of `[reality]`",
        values: One(|_, law| Some(format!("{} Hz", number(law.linear.drive?.resonance_hz?)))),
    },
    TrustQuantity {
        name: "least bandwidth",
        meaning: "the same for the bandwidth of a servo that follows its speed with a lag of first order",
        values: One(|_, law| Some(format!("{} Hz", number(law.linear.drive?.bandwidth_hz)))),
    },
    TrustQuantity {
        name: "least bandwidth, order 2",
        meaning: "the same for a servo of second order, damping ratio 0.7",
        values: One(|_, law| Some(format!("{} Hz", number(law.linear.drive?.second_order_hz?)))),
    },
    TrustQuantity {
        name: "largest bandwidth",
        meaning: "how fast a servo may really be whose lag is made up for",
        values: One(|_, law| Some(format!("{} Hz", number(law.linear.drive?.largest_bandwidth_hz?)))),
    },
    TrustQuantity {
        name: "least driver lag",
        meaning: "how short the lag of a force may really be that is made up for, before the loop is unstable",
        values: One(|_, law| Some(milliseconds(law.linear.lag?.least_s, "0"))),
    },
    TrustQuantity {
        name: "largest driver lag",
        meaning: "how long it may really be",
        values: One(|_, law| Some(milliseconds(law.linear.lag?.largest_s, "any"))),
    },
    TrustQuantity {
        name: "f32 gains",
        meaning: "largest rounding error of a gain in units in the last place (at most 0.5: all are correctly rounded), and \
                  the change of the spectral radius",
        values: One(|_, law| {
            let rounding = law.linear.rounding.as_ref()?;
            let change = rounding.spectral_radius_change;
            Some(format!("{} ULP, spectral radius {change:+.1e}", number(rounding.gain_ulp)))
        }),
    },
    TrustQuantity {
        name: "f32 against f64",
        meaning: "largest difference of the force, tick by tick, from the same controller in f64 with exact gains, and \
                  relative to the peak force of that run",
        values: One(|rig, law| {
            let rounding = law.linear.rounding.as_ref()?;
            let (force_n, relative) = (rounding.force_difference_n?, rounding.force_difference_relative?);
            Some(format!("{}, {relative:.1e} of the peak", force(rig, force_n)))
        }),
    },
    TrustQuantity {
        name: "RMS, ",
        meaning: "ripple at rest from this source, and from all, as the linear model predicts it; encoder resolution \
                  counts as white noise",
        values: Each(|rig, law| {
            let shares = law.linear.noise.iter().flatten().filter(|_| is_chain(rig));
            let row = |share: &NoiseShare| ripple(rig, share.force_n, &share.states);
            shares.map(|share| (share.source.clone(), row(share))).collect()
        }),
    },
    TrustQuantity {
        name: "simulated RMS",
        meaning: "the same in four runs of 20 s against the nonlinear plant, with real encoder steps and the dead zone of \
                  the motor: trust this row more",
        values: One(|rig, law| {
            let run = law.noise_run.as_ref()?;
            let fallen = run.runs - run.survived;
            Some(match &run.ripple {
                None => format!("all {fallen} runs fall"),
                Some(found) => {
                    let others =
                        if fallen > 0 { format!("; {fallen} further runs fall") } else { String::new() };
                    format!("{}{others}", ripple(rig, found.force_rms_n, &found.state_rms))
                }
            })
        }),
    },
    TrustQuantity {
        name: "of the limits",
        meaning: "largest share of each limit in those runs; a cart that uses most of its rail at rest reaches its end within \
                  hours",
        values: One(|rig, law| {
            let ripple = law.noise_run.as_ref()?.ripple.as_ref().filter(|_| is_chain(rig))?;
            Some(limits(ripple.limit_share)).filter(|text| !text.is_empty())
        }),
    },
    TrustQuantity {
        name: "within [robust]",
        meaning: "runs of 20 s with every combination of wrong masses of `[robust]`, with its friction, wrong zeros and \
                  latency; largest share of each limit",
        values: One(|_, law| {
            let run = law.corner_noise.as_ref()?;
            let survive = format!("{} of {} combinations survive", run.survived, run.runs);
            let shares = run.ripple.as_ref().map(|found| limits(found.limit_share));
            let shares = shares.filter(|text| !text.is_empty());
            Some([survive].into_iter().chain(shares).collect::<Vec<_>>().join("; "))
        }),
    },
    TrustQuantity {
        name: "force needed",
        meaning: "largest force that a stepper needed in those runs, with the cart's mass and friction, and its share of what \
                  the motor in `[reality]` has at that speed: stay below a half",
        values: One(|rig, law| {
            let found = law.noise_run.as_ref()?.ripple.as_ref()?;
            let share = found
                .needed_share
                .map_or(String::new(), |share| format!(", {} % of the motor's", number(1e2 * share)));
            Some(format!("{}{share}", rig.base().force().of(&number(found.needed_force_n?))))
        }),
    },
    TrustQuantity {
        name: "largest tilt, ",
        meaning: "largest initial angle from the vertical of this link alone, all others vertical, from which the loop \
                  recovers",
        values: Each(tilt_rows),
    },
    TrustQuantity {
        name: "largest tilt, all links",
        meaning: "the same for all links at once, in the combination of sides with the smallest angle",
        values: One(|_, law| {
            let worst = law.attraction.as_ref()?.worst.as_ref()?;
            let (size, sides) = (number(worst.edge.size), signs(&worst.signs));
            Some(format!("{size} rad, sides {sides}, of {} combinations", worst.tried))
        }),
    },
    TrustQuantity {
        name: "largest ungoverned step",
        meaning: "largest step of the set-point without the governor; 2 m is the largest tried",
        values: One(|rig, law| {
            let step = law.attraction.as_ref()?.raw_step.as_ref()?;
            let largest = if step.at_largest_tried { " (largest tried)" } else { "" };
            let size = rig.output_quantity().of(&number(step.size));
            let peak = force(rig, step.peak_force_n);
            Some(format!("{size}{largest}, peak {} {peak}", rig.input_quantity().name))
        }),
    },
    TrustQuantity {
        name: "push, ",
        meaning: "horizontal force at the cart or at the end of a link, for 50 ms and for 0.5 s, from which the controller \
                  alone falls, from which the firmware turns the motor off, and its fault",
        values: Each(|_, law| push_rows(law)),
    },
    TrustQuantity {
        name: "coarsest encoders",
        meaning: "how many times coarser all encoders may be, with gains redesigned for them",
        values: One(|_, law| {
            let encoder = law.coarsest_encoder.as_ref()?;
            let factor = encoder.factor.map_or("not even the rig's own".to_owned(), |factor| {
                format!("{} times coarser", number(factor))
            });
            let counts: Vec<String> = encoder.counts_per_rev.iter().map(|&counts| number(counts)).collect();
            Some(format!("{factor} (links: {} counts per turn)", counts.join(" ")))
        }),
    },
    TrustQuantity {
        name: "mass errors",
        meaning: "every combination of too heavy and too light cart and links, 10 s with disturbances, the table unchanged",
        values: One(|_, law| {
            let corners = law.corners.as_ref()?;
            let percent = number(corners.percent);
            Some(format!("±{percent} %: {} of {} combinations survive", corners.survived, corners.corners))
        }),
    },
    TrustQuantity {
        name: "worst mass errors",
        meaning: "the combination that falls first or, if none falls, has the largest angle",
        values: One(|rig, law| {
            let weakest = &law.corners.as_ref()?.weakest;
            let (masses, end) = (signs(&weakest.signs), end(&weakest.outcome));
            let cart = if weakest.signs.len() > rig.links() { "cart, then " } else { "" };
            Some(format!("{masses} ({cart}links: + heavier, - lighter){end}"))
        }),
    },
    TrustQuantity {
        name: "most critical mass",
        meaning: "the mass with the smallest tolerance when it alone is wrong",
        values: One(|_, law| {
            let critical = law.mass_tolerances.first()?;
            let (lighter, heavier) = (number(critical.lighter_percent), number(critical.heavier_percent));
            Some(format!("{}: alone -{lighter} % to +{heavier} %", critical.mass))
        }),
    },
    TrustQuantity {
        name: "random plants",
        meaning: "Monte Carlo: masses, lengths and inertias (by spread_percent) and friction (±20 %) drawn at random, with \
                  the 95 % interval of the share that survives (Wilson): 200 of 200 is not 100 %",
        values: One(|rig, law| {
            let runs = law.monte_carlo.as_ref()?;
            let [low, high] = runs.interval.map(|share| 100.0 * share);
            let spread = number(rig.verify.spread_percent);
            let share = 100.0 * runs.success_rate;
            let (survived, made) = (runs.survived, runs.runs);
            let end = runs.worst.as_ref().map_or(String::new(), |worst| end(&worst.outcome));
            Some(format!(
                "±{spread} %: {survived} of {made} survive ({share:.1} %, 95 % interval {low:.1} to {high:.1} %){end}"
            ))
        }),
    },
];

/// The rows of one law. Those that the report does not have, because the rig has no such part or the loop is unstable,
/// are left out.
pub fn rows(rig: &Rig, law: &LawTrust) -> Vec<FoundRow> {
    let rows_of = |quantity: &'static TrustQuantity| {
        let values = match quantity.values {
            One(value) => value(rig, law).map(|value| (String::new(), value)).into_iter().collect(),
            Each(values) => values(rig, law),
        };
        values.into_iter().map(|(part, value)| FoundRow {
            name: rig.words(&format!("{}{part}", quantity.name)),
            value: rig.words(&value),
            meaning: rig.words(quantity.meaning),
        })
    };
    QUANTITIES.iter().flat_map(rows_of).collect()
}

fn margins(law: &LawTrust) -> Option<&Margins> {
    law.linear.margins.as_ref()
}

/// Root mean squares of force, cart and joint angles; of input and output for a model.
fn ripple(rig: &Rig, force_n: f64, states: &[f64]) -> String {
    if !is_chain(rig) {
        return format!("input {}, output {}", number(force_n), number(states[rig.output()]));
    }
    let angles: Vec<String> = states.iter().skip(2).step_by(2).map(|&angle| number(1e3 * angle)).collect();
    let (position, unit) = (number(1e3 * states[rig.output()]), rig.output_quantity().unit);
    format!(
        "{} {}, cart {position} m{unit}, angles {} mrad",
        rig.input_quantity().name,
        force(rig, force_n),
        angles.join(" ")
    )
}

/// A time (s) in milliseconds; `none` if there is no limit.
fn milliseconds(seconds: Option<f64>, none: &str) -> String {
    seconds.map_or(none.to_owned(), |s| format!("{} ms", number(1e3 * s)))
}

/// The shares of the limits that there are; empty if there is none.
fn limits(share: LimitShare) -> String {
    let all = [("rail", share.rail), ("angle", share.angle), ("speed", share.speed)];
    let text =
        |(name, share): (&str, Option<f64>)| share.map(|share| format!("{name} {} %", number(1e2 * share)));
    all.into_iter().filter_map(text).collect::<Vec<_>>().join(", ")
}

/// How a run ended that did not survive; empty for one that did.
fn end(outcome: &Outcome) -> String {
    outcome.fall.as_ref().map_or(String::new(), |fall| format!("; {fall}"))
}

/// A row for the cart and for each link, with both durations.
fn push_rows(law: &LawTrust) -> Vec<(String, String)> {
    let at =
        |force_n: Option<f64>| force_n.map_or("no force tried".to_owned(), |n| format!("{} N", number(n)));
    let text = |push: &PushSurvival| {
        let (falls, off) = (at(push.falls_at_n), at(push.turned_off_at_n));
        let by = push.ended_by.map_or(String::new(), |kind| format!(" ({kind})"));
        format!("{} s: falls at {falls}, motor off at {off}{by}", number(push.duration_s))
    };
    let of_body = law.pushes.chunk_by(|one, other| one.body == other.body);
    let row = |pushes: &[PushSurvival]| {
        let name = match pushes[0].body {
            0 => "cart".to_owned(),
            link => format!("end of link {link}"),
        };
        (name, pushes.iter().map(text).collect::<Vec<_>>().join("; "))
    };
    of_body.map(row).collect()
}

fn tilt_rows(rig: &Rig, law: &LawTrust) -> Vec<(String, String)> {
    let tilts = law.attraction.iter().flat_map(|attraction| &attraction.tilts);
    let row = |tilt: &Tilt| {
        let (size, degrees) = (number(tilt.edge.size), tilt.edge.size.to_degrees());
        let peak = force(rig, tilt.edge.peak_force_n);
        let value = format!("{size} rad ({degrees:.2}°), peak {} {peak}", rig.input_quantity().name);
        (format!("link {}", tilt.link), value)
    };
    tilts.map(row).collect()
}

/// Three significant digits.
fn number(x: f64) -> String {
    significant(x, 3)
}

/// Whether lengths, angles and forces have the units of a chain; a model has units of its own.
fn is_chain(rig: &Rig) -> bool {
    rig.chain().is_some()
}

/// A force, the cart's acceleration where the drive imposes that, or the input of a model, with its unit.
fn force(rig: &Rig, force_n: f64) -> String {
    rig.input_quantity().of(&number(force_n))
}

/// Signs of a combination, such as `+-+-`.
fn signs(signs: &[i8]) -> String {
    signs.iter().map(|&sign| if sign > 0 { '+' } else { '-' }).collect()
}
