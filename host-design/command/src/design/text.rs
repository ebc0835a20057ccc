//! A design as text.

use core::fmt::Write;

use upright::table::Law;
use upright_design::design::{Certified, DesignPoles, DriveLimits, Feedback};
use upright_design::number::{self, significant};
use upright_design::reality::StepMotor;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::{LawValues, TableValues};

use super::law_report::LawReport;
use crate::stilling::stilling;

pub(super) fn design(rig: &Rig, certified: &Certified, poles: &DesignPoles, reports: &[LawReport]) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_design(&mut out, rig, certified, poles, reports);
    out
}

fn write_design(
    out: &mut String,
    rig: &Rig,
    certified: &Certified,
    poles: &DesignPoles,
    reports: &[LawReport],
) -> core::fmt::Result {
    let [low, high] = certified.bits;
    let plant = match rig.plant {
        PlantDescription::Chain(_) => "nonlinear plant",
        PlantDescription::Model(_) => "the linear model",
    };
    writeln!(out, "{} (hash {:016x})", rig.name, rig.hash())?;
    writeln!(
        out,
        "{} states, tick {} ms, delay {} ticks; every gain equal at {low} and {high} bits",
        rig.states(),
        short(rig.tick.period_s * 1e3),
        rig.tick.delay_ticks
    )?;
    for report in reports {
        let law = report.law;
        writeln!(out, "\n{law}")?;
        let [continuous_poles, sampled_poles] = poles.in_table(law);
        if let Some(gains) = certified.double.continuous.in_table()[law] {
            write_law(out, "continuous", "s", gains, continuous_poles)?;
        }
        if let Some(gains) = certified.double.sampled.in_table()[law] {
            write_law(out, "sampled", "z", gains, sampled_poles)?;
        }
        let assessment = &report.assessment;
        writeln!(
            out,
            "  spectral radius at the tick: {:.6} exact, {:.6} rounded to f32, {:.6} with the continuous gains\n  \
             rounding to f32 changes no gain by more than {:.1e}, relative",
            assessment.exact, assessment.rounded, assessment.continuous_at_tick, assessment.largest_rounding
        )?;
        if law == Law::Lqr
            && let Some(limits) = DriveLimits::of(rig, &certified.double)
        {
            writeln!(out, "  the drive has to follow: {limits}")?;
        }
        match &report.run {
            Some(run) => writeln!(out, "  closed loop, firmware against {plant}: {run}")?,
            None if rig.actuator.held().is_motion() && rig.kalman.is_none() => {
                writeln!(
                    out,
                    "  no closed loop: a drive that counts its own pulses needs an observer, [kalman]"
                )?;
            }
            None => writeln!(out, "  no closed loop: this design makes no table")?,
        }
    }
    write!(out, "{}", stilling(rig))
}

fn write_law(
    out: &mut String,
    name: &str,
    plane: &str,
    law: &Feedback<f64>,
    poles: Option<&Vec<[f64; 2]>>,
) -> core::fmt::Result {
    let k: Vec<String> = law.k.entries().iter().map(|&gain| short(gain)).collect();
    writeln!(out, "  {name}")?;
    writeln!(out, "    K       {}", wrapped(&k))?;
    writeln!(
        out,
        "    N       {}",
        law.n.map_or("none: no constant input holds the output away from 0".to_owned(), short)
    )?;
    let poles = poles.map_or(Vec::new(), |found| number::poles(found, 6));
    writeln!(out, "    poles {plane} {}", wrapped(&poles))
}

/// Six significant digits.
fn short(x: f64) -> String {
    significant(x, 6)
}

fn wrapped(items: &[String]) -> String {
    let lines: Vec<String> = items.chunks(6).map(|line| line.join("  ")).collect();
    lines.join("\n            ")
}

/// Warnings before flashing.
pub(super) fn warnings(
    rig: &Rig,
    certified: &Certified,
    reports: &[LawReport],
    table: Option<&TableValues>,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for LawReport { law, assessment, .. } in reports {
        if assessment.continuous_at_tick >= 1.0 {
            warnings.push(format!(
                "{law}: the continuous gains are unstable at the tick of {} ms (spectral radius {:.2}); the table holds the sampled ones",
                short(rig.tick.period_s * 1e3),
                assessment.continuous_at_tick
            ));
        }
        if assessment.rounded >= 1.0 {
            warnings.push(format!(
                "{law}: rounded to f32 the gains do not stabilise the plant (spectral radius {:.6})",
                assessment.rounded
            ));
        }
    }
    let sampled = &certified.double.sampled;
    if sampled.each().present().any(|(_, law)| law.n.is_none()) {
        warnings.push(
            "no constant input holds the output away from 0: N is 0 in the table, set-points have no effect"
                .to_owned(),
        );
    }
    let ungoverned = |law: &LawValues| law.setpoint_step == f32::MAX && law.n != 0.0;
    if let Some(table) = table.filter(|_| rig.chain().is_some())
        && table.laws.present().any(|(_, law)| ungoverned(law))
    {
        warnings.push(
            "the loop is too slow for a bound on its step response: the set-point is not governed".to_owned(),
        );
    }
    if rig.actuator.largest_input().is_none() {
        warnings
            .push("no force limit: give actuator.force_limit_n or a motor before connecting one".to_owned());
    }
    warnings.extend(warning_of_drive(rig, certified));
    if reports.is_empty() {
        warnings.push("the rig file asks for no control law: add [lqr] or [pole_placement]".to_owned());
    }
    warnings
}

/// What is wrong with the drive of the real machine, as `[reality]` describes it.
fn warning_of_drive(rig: &Rig, certified: &Certified) -> Option<String> {
    let limits = DriveLimits::of(rig, &certified.double)?;
    let motor = StepMotor::of(rig).zip(rig.chain()).and_then(|(motor, chain)| motor.resonance_hz(chain));
    if let Some((found_hz, least_hz)) = motor.zip(limits.resonance_hz).filter(|(found, least)| found < least)
    {
        return Some(format!(
            "the motor of [reality] resonates with the cart at {found_hz:.0} Hz, below the {least_hz:.0} Hz that the loop \
             needs: take a stronger motor, a lighter cart or less acceleration"
        ));
    }
    let found_hz = rig.reality.step_motor.bandwidth_hz.filter(|hz| !limits.bandwidths_hz().contains(hz))?;
    Some(format!(
        "the servo of [reality] has a bandwidth of {found_hz} Hz; the loop needs {limits}: give the servo's real bandwidth \
         in [actuator] (bandwidth_hz)"
    ))
}
