//! The trust report for reading.

use core::fmt::Write;

use upright_design::rig::Rig;
use upright_design::verify::{LawTrust, Mass, TrustReport};

pub(super) fn report(rig: &Rig, report: &TrustReport, file: &str) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_report(&mut out, rig, report, file);
    out
}

fn write_report(out: &mut String, rig: &Rig, report: &TrustReport, file: &str) -> core::fmt::Result {
    writeln!(
        out,
        "{} (hash {:016x}), tick {} s, delay {} ticks",
        rig.name,
        rig.hash(),
        rig.tick.period_s,
        rig.tick.delay_ticks
    )?;
    for law in &report.laws {
        writeln!(out, "\n{}", law.linear.law)?;
        linear(out, rig, law)?;
        runs(out, rig, law, file)?;
    }
    writeln!(out, "\nrequirements")?;
    for check in &report.checks {
        let found = check.found.map_or(if check.holds { "no limit" } else { "none" }.to_owned(), number);
        let verdict = if check.holds { "ok" } else { "FAILS" };
        writeln!(
            out,
            "  {verdict:<6}{:<15}{:<60}{found:>10}  required {}",
            check.law,
            check.requirement,
            number(check.required)
        )?;
    }
    Ok(())
}

fn linear(out: &mut String, rig: &Rig, law: &LawTrust) -> core::fmt::Result {
    let part = &law.linear;
    line(
        out,
        "spectral radius",
        &format!("{:.6}{}", part.spectral_radius, if part.stable { "" } else { "  NOT STABLE" }),
    )?;
    let poles: Vec<String> = part
        .poles
        .iter()
        .filter(|pole| pole[1] >= 0.0)
        .map(|&[re, im]| if im == 0.0 { number(re) } else { format!("{}±{}i", number(re), number(im)) })
        .collect();
    for (index, poles) in poles.chunks(5).enumerate() {
        line(out, if index == 0 { "poles" } else { "" }, &poles.join("  "))?;
    }
    if let Some(margins) = &part.margins {
        let highest = margins.highest_gain.map_or("any".to_owned(), number);
        line(
            out,
            "gain margin",
            &format!("the force may be off by a factor of {} to {highest}", number(margins.lowest_gain)),
        )?;
        let phase = margins
            .phase_margin_rad
            .map_or("no limit".to_owned(), |phase| format!("{:.1}°", phase.to_degrees()));
        line(out, "phase margin", &phase)?;
        let delay = match (margins.delay_margin_s, margins.delay_margin_ticks) {
            (Some(s), Some(ticks)) => format!("{} ms = {} ticks", number(1e3 * s), number(ticks)),
            _ => "no limit".to_owned(),
        };
        line(out, "delay margin", &delay)?;
        line(
            out,
            "peak sensitivity",
            &format!(
                "{} at {} rad/s; disk margin {}",
                number(margins.peak_sensitivity),
                number(margins.peak_sensitivity_rad_per_s),
                number(margins.disk_margin)
            ),
        )?;
    }
    if let Some(tick) = &part.tick {
        let longest = tick
            .longest_stable_s
            .map_or("30 ticks and more".to_owned(), |s| format!("{} ms", number(1e3 * s)));
        line(out, "longest stable tick", &format!("{longest}, same table"))?;
        line(
            out,
            "tolerated jitter",
            &format!("{} ms (Kao and Lincoln: sufficient, not necessary)", number(1e3 * tick.jitter_s)),
        )?;
    }
    if let Some(rounding) = &part.rounding {
        line(
            out,
            "rounding to f32",
            &format!(
                "gains {} ULP, spectral radius {:+.1e}",
                number(rounding.gain_ulp),
                rounding.spectral_radius_change
            ),
        )?;
        if let (Some(force), Some(relative)) =
            (rounding.force_difference_n, rounding.force_difference_relative)
        {
            line(
                out,
                "f32 against f64",
                &format!("force differs by at most {} N ({:.1e} of its peak)", number(force), relative),
            )?;
        }
    }
    for certificate in &part.certificates {
        let [low, high] = certificate.bits;
        line(
            out,
            "certificate",
            &format!(
                "{}: residual {:.0e}, the same at {low} and {high} bits, condition {:.1e}",
                certificate.gain, certificate.residual, certificate.condition
            ),
        )?;
    }
    if let (Some(shares), Some(run)) = (&part.noise, &law.noise_run) {
        for share in shares {
            let angles: Vec<String> =
                share.states.iter().skip(2).step_by(2).map(|&angle| number(1e3 * angle)).collect();
            line(
                out,
                &format!("RMS, {}", share.source),
                &format!(
                    "force {} N, cart {} mm, angles {} mrad",
                    number(share.force_n),
                    number(1e3 * share.states[rig.output()]),
                    angles.join(" ")
                ),
            )?;
        }
        let angles: Vec<String> =
            run.state_rms.iter().skip(2).step_by(2).map(|&angle| number(1e3 * angle)).collect();
        line(
            out,
            "RMS, simulated",
            &format!(
                "force {} N, cart {} mm, angles {} mrad",
                number(run.force_rms_n),
                number(1e3 * run.state_rms[rig.output()]),
                angles.join(" ")
            ),
        )?;
    }
    Ok(())
}

fn runs(out: &mut String, rig: &Rig, law: &LawTrust, file: &str) -> core::fmt::Result {
    if let Some(attraction) = &law.attraction {
        for tilt in &attraction.tilts {
            line(
                out,
                &format!("tilt of link {}", tilt.link),
                &format!(
                    "recovers from {} rad ({:.2}°), peak force {} N",
                    number(tilt.edge.size),
                    tilt.edge.size.to_degrees(),
                    number(tilt.edge.peak_force_n)
                ),
            )?;
        }
        if let Some(worst) = &attraction.worst {
            let signs: String = worst.signs.iter().map(|&sign| if sign > 0 { '+' } else { '-' }).collect();
            line(
                out,
                "worst combination",
                &format!(
                    "all links by {} rad, sides {signs}, of {} tried",
                    number(worst.edge.size),
                    worst.tried
                ),
            )?;
        }
        if let Some(step) = &attraction.raw_step {
            line(
                out,
                "largest raw step",
                &format!(
                    "{} m without the governor{}, peak force {} N",
                    number(step.size),
                    if step.at_largest_tried { " (largest tried)" } else { "" },
                    number(step.peak_force_n)
                ),
            )?;
        }
    }
    if let Some(encoder) = &law.coarsest_encoder {
        let factor = encoder.factor.map_or("not even the rig's own".to_owned(), |factor| {
            format!("{} times coarser", number(factor))
        });
        let counts: Vec<String> = encoder.counts_per_rev.iter().map(|&counts| number(counts)).collect();
        line(
            out,
            "coarsest encoders",
            &format!("{factor} (links: {} counts per turn), gains designed anew", counts.join(" ")),
        )?;
    }
    if let Some(corners) = &law.corners {
        line(
            out,
            "wrong masses",
            &format!(
                "±{} %: {} of {} corners stand",
                number(corners.percent),
                corners.stand,
                corners.corners
            ),
        )?;
        let signs: String =
            corners.weakest.signs.iter().map(|&sign| if sign > 0 { '+' } else { '-' }).collect();
        line(out, "weakest corner", &format!("{signs} (cart, then links: heavier +, lighter -)"))?;
    }
    if let Some(critical) = law.mass_tolerances.first() {
        let which = match critical.mass {
            Mass::Cart => "the cart's mass".to_owned(),
            Mass::Link(link) => format!("the mass of link {link}"),
        };
        line(
            out,
            "weigh best",
            &format!(
                "{which}: alone it may be {} % lighter or {} % heavier",
                number(critical.lighter_percent),
                number(critical.heavier_percent)
            ),
        )?;
    }
    if let Some(runs) = &law.monte_carlo {
        let [low, high] = runs.interval;
        line(
            out,
            "random plants",
            &format!(
                "±{} %: {} of {} stand ({:.1} %, 95 % interval {:.1} to {:.1} %)",
                number(rig.verify.spread_percent),
                runs.stood,
                runs.runs,
                100.0 * runs.success_rate,
                100.0 * low,
                100.0 * high
            ),
        )?;
        if let Some(worst) = &runs.worst {
            let law = law.linear.law.replace('_', "-");
            line(
                out,
                "worst of them",
                &format!("upright verify {file} --law {law} --replay {}", worst.seed),
            )?;
        }
    }
    Ok(())
}

fn line(out: &mut String, name: &str, text: &str) -> core::fmt::Result {
    writeln!(out, "  {name:<24}{text}")
}

/// Three significant digits.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}
