//! A rig, its design and its runs as one self-contained HTML page.

mod animation;
mod cost;
mod drawing;
mod error;
mod frequency;
mod imperfections;
mod number;
mod page;
mod plot;
mod poles;
mod region;
mod responses;
mod runs;
mod source;
mod trust;

pub use error::ReportError;
pub use source::ReportSource;

use upright::table::Law;
use upright_design::design::DesignPoles;
use upright_design::parallel::{Progress, ProgressStep};

use self::page::ReportPage;
pub(crate) use self::plot::Plot;
use crate::figure::{Figure, FigureError, margins_figure, pixels};

/// Usual number of initial states along each axis of the map of the region of attraction.
pub const REGION_POINTS: usize = 31;

/// A finished report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The page, as one self-contained HTML file.
    pub html: String,
    /// The pictures of the page, in the order of the page.
    pub pictures: Vec<Picture>,
}

/// A picture of a report for use elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Name for a file, without its extension.
    pub name: String,
    /// As an SVG document.
    pub svg: String,
    /// Every point of every curve; none for the drawing of the rig.
    pub csv: Option<String>,
}

impl Picture {
    /// As a PNG file, twice as large as the SVG says.
    ///
    /// # Errors
    /// [`FigureError::Png`] if it is too large.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        pixels(&self.svg, 2.0)
    }

    fn of_law(id: &str, law: Law, figure: &Figure) -> Result<Self, FigureError> {
        Self::of(format!("{id}-{}", law.option()), figure)
    }

    fn of(name: String, figure: &Figure) -> Result<Self, FigureError> {
        Ok(Self { name, svg: figure.svg()?, csv: Some(figure.csv()?) })
    }
}

/// Makes the report.
///
/// # Errors
/// [`ReportError`] if a run cannot be started or a figure cannot be drawn; a rig that falls is not an error.
pub fn report(source: &ReportSource<'_>, progress: Progress<'_>) -> Result<Report, ReportError> {
    let ReportSource { rig, certified, table, trust, .. } = *source;
    progress(ProgressStep::Begin("runs", 1));
    let designed_poles = certified.poles(rig)?;
    let mut scenes = runs::scenes(rig, &designed_poles, table, trust, source.seed)?;
    scenes.extend(source.swing_up.map(|run| runs::swing_up(rig, run, source.seed)));
    scenes.extend(source.route.map(|run| runs::route(rig, run, source.seed)));
    let mut pictures = Vec::new();
    let mut page = ReportPage::new(source, &designed_poles, &scenes)?;
    if let Some(chain) = rig.chain() {
        let svg = drawing::svg(chain);
        page.drawing = Some(svg.clone());
        pictures.push(Picture { name: "rig".to_owned(), svg, csv: None });
    }
    progress(ProgressStep::Begin("figures of the runs", 1));
    for (scene, entry) in scenes.iter().zip(&mut page.scenes) {
        for (run, figure) in scene.runs.iter().zip(responses::figures(rig, scene)) {
            pictures.push(Picture::of_law(scene.id, run.law, &figure)?);
            entry.plots.push(Plot::over_time(&figure, format!("{}, {}", scene.name, run.law.title()))?);
        }
    }
    progress(ProgressStep::Begin("poles and frequency", 1));
    show_linear_loops(source, &designed_poles, &mut page, &mut pictures)?;
    let mut stable =
        trust.laws.iter().filter(|part| part.linear.stable).map(|part| part.linear.law).peekable();
    if page.drawing.is_some() && stable.peek().is_some() {
        progress(ProgressStep::Begin("region of attraction", 1));
        for law in stable {
            let figure = region::figure(rig, table, law, source.region_points)?;
            pictures.push(Picture::of_law("region", law, &figure)?);
            page.regions.push(Plot::of(&figure, law.title().to_owned())?);
        }
    }
    if !source.margins.is_empty() {
        show_margins(source, &mut page, &mut pictures)?;
    }
    if !source.imperfections.is_empty() {
        show_imperfections(source, progress, &mut page, &mut pictures)?;
    }
    Ok(Report { html: page.html()?, pictures })
}

fn show_linear_loops(
    source: &ReportSource<'_>,
    designed: &DesignPoles,
    page: &mut ReportPage<'_>,
    pictures: &mut Vec<Picture>,
) -> Result<(), ReportError> {
    let ReportSource { rig, certified, table, trust, .. } = *source;
    let reports: Vec<_> = trust.laws.iter().map(|part| &part.linear).collect();
    let mut poles: Vec<Figure> = reports.iter().map(|report| poles::figure(rig, designed, report)).collect();
    Figure::same_scale(&mut poles);
    for (figure, report) in poles.iter().zip(&reports) {
        pictures.push(Picture::of_law("poles", report.law, figure)?);
        page.poles.push(Plot::of(figure, report.law.title().to_owned())?);
    }
    let stable = reports.iter().filter(|report| report.stable);
    let [mut bode, mut nyquist] = frequency::figures(rig, certified, table, &reports);
    Figure::same_scale(&mut bode);
    Figure::same_scale(&mut nyquist);
    for (report, (bode, nyquist)) in stable.zip(bode.iter().zip(&nyquist)) {
        let law = report.law;
        pictures.push(Picture::of_law("bode", law, bode)?);
        page.bode.push(Plot::of(bode, format!("Bode plot, {}", law.title()))?);
        pictures.push(Picture::of_law("nyquist", law, nyquist)?);
        page.nyquist.push(Plot::of(nyquist, format!("Nyquist plot, {}", law.title()))?);
    }
    Ok(())
}

fn show_margins(
    source: &ReportSource<'_>,
    page: &mut ReportPage<'_>,
    pictures: &mut Vec<Picture>,
) -> Result<(), ReportError> {
    let figure = margins_figure("How hard a link may be pushed", source.margins);
    pictures.push(Picture::of("margins".to_owned(), &figure)?);
    page.pushes.push(Plot::of(&figure, figure.title.clone())?);
    Ok(())
}

fn show_imperfections(
    source: &ReportSource<'_>,
    progress: Progress<'_>,
    page: &mut ReportPage<'_>,
    pictures: &mut Vec<Picture>,
) -> Result<(), ReportError> {
    progress(ProgressStep::Begin("imperfections", 1));
    let limit_cycles = imperfections::limit_cycles(source)?;
    pictures.push(Picture::of("limit-cycle".to_owned(), &limit_cycles)?);
    page.imperfect.push(Plot::of(&limit_cycles, "Limit cycle over the friction of the joints".to_owned())?);
    progress(ProgressStep::Begin("wrong masses", 1));
    if let Some(masses) = imperfections::wrong_masses(source)? {
        pictures.push(Picture::of("wrong-masses".to_owned(), &masses)?);
        page.imperfect.push(Plot::of(&masses, "Every combination of wrong masses".to_owned())?);
    }
    Ok(())
}
