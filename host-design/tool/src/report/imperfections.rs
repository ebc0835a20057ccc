//! How much of each imperfection of the machine each law survives, as tables and figures.

use super::ReportSource;
use crate::figure::{Axis, Curve, Figure, Panel};
use upright_design::rig::Base;
use upright_trust::verify::{
    CornerSettings, Imperfections, LeftOut, Survival, VerifyError, corners, limit_cycle,
};

/// Errors of the masses for which every combination is run (%).
const PERCENTS: [f64; 9] = [2.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 70.0];
/// Errors beyond this one are run only as long as all combinations survive (%).
const ENOUGH_PERCENT: f64 = 30.0;
/// With more links there are too many combinations for each percentage.
const MOST_LINKS: usize = 5;

/// The size of each imperfection at which one law falls, and at which the motor is turned off.
pub(super) struct SurvivalTable {
    pub(super) law: &'static str,
    pub(super) rows: Vec<SurvivalRow>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) together: Option<String>,
}

/// One imperfection alone.
pub(super) struct SurvivalRow {
    pub(super) is_dangerous: bool,
    pub(super) key: &'static str,
    pub(super) falls_at: String,
    pub(super) turned_off_at: String,
    pub(super) off_moving_at: String,
    pub(super) typical: String,
    pub(super) source: &'static str,
    pub(super) remedy: String,
    pub(super) remarks: Vec<String>,
}

impl SurvivalTable {
    /// One for each law of the report.
    pub(super) fn of_all(source: &ReportSource<'_>) -> Vec<Self> {
        source.imperfections.iter().map(|found| Self::of(found, source.rig.base())).collect()
    }

    fn of(found: &Imperfections, base: Base) -> Self {
        let together = found.together.map(|all| all.text(base));
        Self {
            law: found.law.title(),
            rows: found.alone.iter().map(|survival| SurvivalRow::of(survival, base)).collect(),
            left_out: found.left_out.clone(),
            together,
        }
    }
}

impl SurvivalRow {
    fn of(survival: &Survival, base: Base) -> Self {
        let one = survival.imperfection;
        let unit = one.unit;
        Self {
            is_dangerous: survival.danger > 1.0,
            key: one.key,
            falls_at: format!("{} {unit}", survival.falls_text()),
            turned_off_at: match survival.ended_by {
                Some(kind) => format!("{} {unit} ({kind})", survival.turned_off_text()),
                None => format!("{} {unit}", survival.turned_off_text()),
            },
            off_moving_at: format!("{} {unit}", survival.off_moving_text()),
            typical: format!("{} {unit}", one.typical_text()),
            source: one.source,
            remedy: base.words(one.remedy),
            remarks: survival.remarks(),
        }
    }
}

/// Amplitude of the limit cycle over the friction of the joints, a curve for each law.
pub(super) fn limit_cycles(source: &ReportSource<'_>) -> Result<Figure, VerifyError> {
    let ReportSource { rig, table, imperfections, .. } = *source;
    let x = Axis::log("Coulomb friction of each joint (N·m)");
    let mut panel = Panel::new(x, Axis::linear("largest angle of a link (mrad)")).high(360);
    for (number, found) in imperfections.iter().enumerate() {
        let friction = found.alone.iter().find(|one| !one.bristles.is_empty());
        let Some(friction) = friction else { continue };
        let cycle = limit_cycle(rig, table, found.law, &found.settings, friction)?;
        let survival = cycle.iter().filter(|(_, verdict)| verdict.survived == found.settings.seeds);
        let points: Vec<[f64; 2]> =
            survival.map(|(size, verdict)| [*size, 1e3 * verdict.peak_angle_rad]).collect();
        panel = with_line(panel, found.law.title(), number, points);
    }
    Ok(Figure::narrow(format!("{}: limit cycle over friction", rig.name)).with(panel))
}

/// Share of the combinations of wrong masses that survive, over the percentage, a curve for each law; none for a chain
/// with too many combinations.
pub(super) fn wrong_masses(source: &ReportSource<'_>) -> Result<Option<Figure>, VerifyError> {
    let ReportSource { rig, table, imperfections, .. } = *source;
    if rig.links() > MOST_LINKS {
        return Ok(None);
    }
    let x = Axis::linear("error of the masses (±%)");
    let y = Axis::linear("combinations that survive (%)").range(0.0, 105.0);
    let mut panel = Panel::new(x, y).high(360);
    for (number, found) in imperfections.iter().enumerate() {
        let settings = CornerSettings { duration_s: found.settings.duration_s, ..CornerSettings::of(rig) };
        let mut points = vec![[0.0, 100.0]];
        for percent in PERCENTS {
            let tried = corners(rig, table, found.law, percent, &settings)?;
            points.push([percent, 100.0 * tried.survived as f64 / tried.corners as f64]);
            if tried.survived == 0 || (percent >= ENOUGH_PERCENT && tried.survived < tried.corners) {
                break;
            }
        }
        panel = with_line(panel, found.law.title(), number, points);
    }
    Ok(Some(Figure::narrow(format!("{}: wrong masses", rig.name)).with(panel)))
}

/// A line through markers.
fn with_line(panel: Panel, name: &str, number: usize, points: Vec<[f64; 2]>) -> Panel {
    // Number 0 is for the crosses.
    let line = Curve::line(name, 1 + number, points.clone());
    panel.with(line).with(Curve::markers("", 1 + number, points))
}
