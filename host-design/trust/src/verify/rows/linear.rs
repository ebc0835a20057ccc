//! Rows from the linear model of the loop.

use super::quantity::Values::{Each, One};
use super::quantity::{TrustQuantity, force, input, is_chain, number};
use crate::verify::{LawTrust, LimitShare, Margins, NoiseShare};
use upright_design::rig::Rig;

pub(super) const QUANTITIES: &[TrustQuantity] = &[
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
                  unstable; of a stepper, the acceleration",
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
        values: One(|_, law| {
            let found = law.noise_run.as_ref()?.ripple.as_ref()?;
            let share = found
                .needed_share
                .map_or(String::new(), |share| format!(", {} % of the motor's", number(1e2 * share)));
            Some(format!("{} N{share}", number(found.needed_force_n?)))
        }),
    },
];

fn margins(law: &LawTrust) -> Option<&Margins> {
    law.linear.margins.as_ref()
}

/// Root mean squares of force, cart and joint angles; of input and output for a model.
fn ripple(rig: &Rig, force_n: f64, states: &[f64]) -> String {
    if !is_chain(rig) {
        return format!("input {}, output {}", number(force_n), number(states[rig.output()]));
    }
    let angles: Vec<String> = states.iter().skip(2).step_by(2).map(|&angle| number(1e3 * angle)).collect();
    let cart_mm = number(1e3 * states[rig.output()]);
    format!("{} {}, cart {cart_mm} mm, angles {} mrad", input(rig).0, force(rig, force_n), angles.join(" "))
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
