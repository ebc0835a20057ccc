//! How much of each imperfection the loop survives, as text.

use core::fmt::Write;

use upright_design::rig::Base;
use upright_trust::verify::{Imperfections, Survival};

/// The table of one law: the most dangerous imperfection first.
pub(super) fn table(found: &Imperfections, base: Base) -> String {
    let mut out = String::new();
    // Writing into a String cannot fail.
    let _ = write_table(&mut out, found, base);
    out
}

fn write_table(out: &mut String, found: &Imperfections, base: Base) -> core::fmt::Result {
    writeln!(
        out,
        "{}: each imperfection alone, {} runs of each size",
        found.law.key(),
        found.settings.seeds
    )?;
    writeln!(
        out,
        "  {:<26}{:<6}{:>12}{:>12}{:>12}   {:<22}typical",
        "", "", "falls at", "motor off", "moving", "by"
    )?;
    for survival in &found.alone {
        write_survival(out, survival, base)?;
    }
    for one in &found.left_out {
        writeln!(out, "  {:<26}{}", one.key, one.reason)?;
    }
    match &found.together {
        None => writeln!(out, "  the rig file has no [reality]"),
        Some(all) => writeln!(out, "  [reality] of the rig file: {}", all.text(base)),
    }
}

fn write_survival(out: &mut String, survival: &Survival, base: Base) -> core::fmt::Result {
    let one = survival.imperfection;
    let (falls, off, by) = (survival.falls_text(), survival.turned_off_text(), survival.ended_by_text());
    let moving = survival.off_moving_text();
    let (key, unit, typical, source) = (one.key, one.unit, one.typical_text(), one.source);
    writeln!(out, "  {key:<25} {unit:<5} {falls:>12}{off:>12}{moving:>12}   {by:<22}{typical} ({source})")?;
    survival.remarks().iter().try_for_each(|remark| writeln!(out, "      {remark}"))?;
    if survival.danger > 1.0 { writeln!(out, "      do: {}", base.words(one.remedy)) } else { Ok(()) }
}
