//! A rig, its design and its runs as one page: HTML that needs nothing but a browser.

mod animation;
mod cost;
mod drawing;
mod error;
mod frequency;
mod number;
mod page;
mod plot;
mod poles;
mod region;
mod responses;
mod runs;
mod trust;

pub use error::ReportError;

use page::Page;
use plot::Plot;
use runs::law_name;
use upright::table::Law;

use crate::design::Certified;
use crate::figure::{Figure, FigureError, pixels};
use crate::rig::{PlantDescription, Rig};
use crate::table::TableValues;
use crate::verify::TrustReport;

/// What a report is made of.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its design.
    pub certified: &'a Certified,
    /// The table that is simulated.
    pub table: &'a TableValues,
    /// The trust report of this table.
    pub trust: &'a TrustReport,
    /// Seed of the disturbances in the runs.
    pub seed: u64,
    /// The command that made the report, to make it again.
    pub command: &'a str,
}

/// A report.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The page, a whole file.
    pub html: String,
    /// Its pictures, in its order.
    pub pictures: Vec<Picture>,
}

/// A picture of a report for use elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Name for a file, without its ending.
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

    fn of(name: String, figure: &Figure) -> Result<Self, FigureError> {
        Ok(Self { name, svg: figure.svg()?, csv: Some(figure.csv()?) })
    }
}

/// Makes the report; calls `stage` before each part.
///
/// # Errors
/// [`ReportError`] if a run cannot be started or a figure cannot be drawn; a rig that falls is no error.
pub fn report(source: &Source<'_>, stage: &dyn Fn(&str)) -> Result<Report, ReportError> {
    let Source { rig, certified, table, trust, .. } = *source;
    stage("runs");
    let scenes = runs::scenes(rig, certified, table, trust, source.seed)?;
    let laws = runs::laws(table);
    let mut pictures = Vec::new();
    let mut page = Page::new(source, &scenes)?;
    if let PlantDescription::Chain(chain) = &rig.plant {
        let svg = drawing::svg(chain);
        page.drawing = Some(svg.clone());
        pictures.push(Picture { name: "rig".to_owned(), svg, csv: None });
    }
    let mut keep = |id: &str, law: Law, figure: &Figure| -> Result<(), ReportError> {
        let law = if law == Law::Lqr { "lqr" } else { "pole-placement" };
        pictures.push(Picture::of(format!("{id}-{law}"), figure)?);
        Ok(())
    };
    stage("figures of the runs");
    for (scene, entry) in scenes.iter().zip(&mut page.scenes) {
        for (run, figure) in scene.runs.iter().zip(responses::figures(rig, scene)) {
            keep(scene.id, run.law, &figure)?;
            entry.plots.push(Plot::over_time(&figure, format!("{}, {}", scene.name, law_name(run.law)))?);
        }
    }
    stage("poles and frequency");
    for (&law, part) in laws.iter().zip(&trust.laws) {
        let figure = poles::figure(rig, certified, law, &part.linear);
        keep("poles", law, &figure)?;
        page.poles.push(Plot::of(&figure, law_name(law).to_owned())?);
        if let Some([bode, nyquist]) = frequency::figures(rig, certified, table, law, &part.linear) {
            keep("bode", law, &bode)?;
            page.bode.push(Plot::of(&bode, format!("Bode plot, {}", law_name(law)))?);
            keep("nyquist", law, &nyquist)?;
            page.nyquist.push(Plot::of(&nyquist, format!("Nyquist plot, {}", law_name(law)))?);
        }
    }
    let stable: Vec<Law> =
        laws.iter().zip(&trust.laws).filter(|(_, part)| part.linear.stable).map(|(law, _)| *law).collect();
    if page.drawing.is_some() && !stable.is_empty() {
        stage("region of attraction");
        for (&law, figure) in stable.iter().zip(region::figures(rig, table, &stable)?) {
            keep("region", law, &figure)?;
            page.regions.push(Plot::of(&figure, law_name(law).to_owned())?);
        }
    }
    Ok(Report { html: page.html()?, pictures })
}
