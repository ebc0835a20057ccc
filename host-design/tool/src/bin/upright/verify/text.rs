//! The trust report as text.

use core::fmt::Write;

use upright_design::number::poles;
use upright_design::rig::Rig;
use upright_trust::verify::{Check, LawTrust, TrustReport, rows};

/// The whole report; `arguments` are those of `upright verify` with which the worst random plant is run again.
pub(super) fn report(rig: &Rig, report: &TrustReport, arguments: &str) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_report(&mut out, rig, report, arguments);
    out
}

fn write_report(out: &mut String, rig: &Rig, report: &TrustReport, arguments: &str) -> core::fmt::Result {
    writeln!(
        out,
        "{} (hash {:016x}), tick {} s, delay {} ticks",
        rig.name,
        rig.hash(),
        rig.tick.period_s,
        rig.tick.delay_ticks
    )?;
    for law in &report.laws {
        writeln!(out, "\n{}", law.linear.law.key())?;
        for row in rows(rig, law) {
            line(out, &row.name, &row.value)?;
        }
        worst_random_plant(out, law, arguments)?;
        poles_and_certificates(out, law)?;
    }
    writeln!(out, "\nrequirements")?;
    report.checks.iter().try_for_each(|check| requirement(out, check))
}

fn worst_random_plant(out: &mut String, law: &LawTrust, arguments: &str) -> core::fmt::Result {
    let Some(worst) = law.monte_carlo.as_ref().and_then(|runs| runs.worst.as_ref()) else { return Ok(()) };
    let name = law.linear.law.option();
    let command = format!("upright verify {arguments} --law {name} --replay {}", worst.seed);
    line(out, "worst random plant", &command)
}

fn poles_and_certificates(out: &mut String, law: &LawTrust) -> core::fmt::Result {
    for (index, poles) in poles(&law.linear.poles, 3).chunks(5).enumerate() {
        line(out, if index == 0 { "poles" } else { "" }, &poles.join("  "))?;
    }
    for certificate in &law.linear.certificates {
        let [low, high] = certificate.bits;
        let (gain, residual, condition) = (&certificate.gain, certificate.residual, certificate.condition);
        let text = format!(
            "{gain}: residual {residual:.0e}, the same at {low} and {high} bits, condition {condition:.1e}"
        );
        line(out, "certificate", &text)?;
    }
    Ok(())
}

fn requirement(out: &mut String, check: &Check) -> core::fmt::Result {
    let remark = check.remark().map_or(String::new(), |remark| format!("; {remark}"));
    let verdict = match () {
        () if check.holds => "ok",
        () if check.fewest_runs.is_some() => "open",
        () => "FAILS",
    };
    let (found, required) = (check.found_text(), check.required_text());
    writeln!(
        out,
        "  {verdict:<6}{:<15}{:<60}{found:>10}  required {required}{remark}",
        check.law.key(),
        check.requirement
    )
}

fn line(out: &mut String, name: &str, text: &str) -> core::fmt::Result {
    writeln!(out, "  {name:<26}{text}")
}
