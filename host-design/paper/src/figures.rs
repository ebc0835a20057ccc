//! The comparison as files: the paper's figures 5 to 8, Table 2 over the length of its runs, spectra; and their data.

use super::{BAND, Loop, Reproduction, Robustness, Settling, StepResponse, Trajectory, printed};
use upright_tool::figure::{Axis, Curve, Figure, FigureError, Panel};

impl Reproduction {
    /// Names and contents of all files: `summary.md`, figures as SVG, and for each its data as CSV.
    ///
    /// # Errors
    /// [`FigureError`] from the drawing library.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>, FigureError> {
        let mut files = vec![("summary.md".to_owned(), self.summary().into_bytes())];
        for figure in 5..=8 {
            let of_figure: Vec<&StepResponse> =
                self.responses.iter().filter(|response| response.figure == figure).collect();
            files.push((format!("figure-{figure}.svg"), response(&of_figure).svg()?.into_bytes()));
            for one in of_figure {
                let kind = match one.kind {
                    Loop::Continuous => "continuous",
                    Loop::FullState => "full-state",
                    Loop::Encoders => "encoders",
                };
                files.push((format!("figure-{figure}-{kind}.csv"), trajectory_csv(&one.trajectory)));
            }
        }
        for (name, figure) in [("table-2", self.settling.figure()), ("spectra", spectra(&self.robustness))] {
            files.push((format!("{name}.svg"), figure.svg()?.into_bytes()));
            files.push((format!("{name}.csv"), figure.csv()?.into_bytes()));
        }
        Ok(files)
    }
}

/// States and force at all samples, seven digits.
fn trajectory_csv(trajectory: &Trajectory) -> Vec<u8> {
    let joints = trajectory.states.first().map_or(0, |state| state.len() / 2 - 1);
    let mut text = "t_s,force_n,x_m,xdot_m_per_s".to_owned();
    for joint in 1..=joints {
        text += &format!(",theta{joint}_rad,theta{joint}dot_rad_per_s");
    }
    text.push('\n');
    for (index, (state, force)) in trajectory.states.iter().zip(&trajectory.forces_n).enumerate() {
        text += &format!("{:.6}", index as f64 * trajectory.sample_s);
        for value in [force].into_iter().chain(state) {
            text += &format!(",{value:.6e}");
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn over_time(trajectory: &Trajectory, value: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
    (0..trajectory.states.len()).map(|index| [index as f64 * trajectory.sample_s, value(index)]).collect()
}

/// One of the paper's figures: position in all loops; angles, rates and force in the paper's loop.
fn response(responses: &[&StepResponse]) -> Figure {
    let Some(first) = responses.first() else { return Figure::new("") };
    let time = || Axis::linear("time (s)");
    let disturbed = if first.figure >= 7 { ", with disturbances" } else { "" };
    let title = format!("Figure {} of the paper: {}{disturbed}", first.figure, first.law);

    let set_point = over_time(&first.trajectory, |_| 1.0);
    let mut position =
        Panel::new(time(), Axis::linear("position (m)")).with(Curve::reference("set-point", set_point));
    for (number, one) in responses.iter().enumerate() {
        let trajectory = over_time(&one.trajectory, |index| one.trajectory.states[index][0]);
        position = position.with(Curve::line(one.kind.name(), number, trajectory));
    }
    let joints = first.figures.peak_angles_deg.len();
    let mut angles = Panel::new(time(), Axis::linear("angles (°)"));
    let mut rates = Panel::new(time(), Axis::linear("rates (°/s)"));
    let degrees = |state: usize| {
        over_time(&first.trajectory, |index| first.trajectory.states[index][state].to_degrees())
    };
    for joint in 0..joints {
        angles = angles.with(Curve::line(format!("θ{}", joint + 1), joint, degrees(2 + 2 * joint)));
        rates = rates.with(Curve::line(format!("rate of θ{}", joint + 1), joint, degrees(3 + 2 * joint)));
    }
    let force = over_time(&first.trajectory, |index| first.trajectory.forces_n[index]);
    let force = Panel::new(time(), Axis::linear("force (N)")).with(Curve::line("", 0, force));
    Figure::new(title).with(position).with(angles).with(rates).with(force)
}

impl Settling {
    /// Distance of the cart from the set-point over time for each row, and how many verdicts a run of that length
    /// shares with the paper.
    fn figure(&self) -> Figure {
        let time = || Axis::linear("length of the run (s)").range(0.0, 12.0);
        let mut distance =
            Panel::new(time(), Axis::log("distance from the set-point (%)").range(0.1, 200.0)).high(360);
        for (number, row) in self.rows.iter().enumerate() {
            let trajectory = &row.trajectory;
            let name = match &row.fall {
                Some(_) => format!("ts = {} s, falls", row.settling_time_s),
                None => format!("ts = {} s", row.settling_time_s),
            };
            let points = over_time(trajectory, |index| 100.0 * (trajectory.states[index][0] - 1.0).abs());
            distance = distance.with(Curve::line(name, number, points));
        }
        let band = 100.0 * BAND;
        distance = distance.with(Curve::limit("2 %", vec![[0.0, band], [12.0, band]]));
        let steps = self.rows.first().map_or(0.0, |row| row.trajectory.sample_s);
        let agreeing = (0..=1200).map(|index| {
            let horizon = f64::from(index) * steps;
            let same = |(row, printed): (&super::SettlingRow, bool)| {
                row.trajectory.stabilised(1.0, horizon) == printed
            };
            [horizon, self.rows.iter().zip(printed()).map(same).filter(|&same| same).count() as f64]
        });
        let mut count = Panel::new(time(), Axis::linear("verdicts as printed, of 7").range(0.0, 7.5))
            .high(190)
            .with(Curve::line("", 0, agreeing.collect()));
        if let Some([first, last]) = self.horizons_s {
            let edge = |at: f64| vec![[at, 0.0], [at, 7.5]];
            count = count
                .with(Curve::limit(format!("all 7: {first:.2} to {last:.2} s"), edge(first)))
                .with(Curve::limit("", edge(last)));
        }
        Figure::new("Table 2 of the paper: verdicts by the length of the runs").with(distance).with(count)
    }
}

/// Highest frequency shown (Hz): there is hardly any motion above it.
const HIGHEST_HZ: f64 = 200.0;

/// Spectra of cart, first joint and force under the paper's disturbances.
fn spectra(all: &[Robustness]) -> Figure {
    let mut figure = Figure::new("At rest under the paper's disturbances");
    for (signal, label, scale) in
        [("x", "cart (mm/√Hz)", 1e3), ("theta1", "θ1 (mrad/√Hz)", 1e3), ("u", "force (N/√Hz)", 1.0)]
    {
        let mut panel =
            Panel::new(Axis::log("frequency (Hz)").range(0.1, HIGHEST_HZ), Axis::log(label)).high(250);
        let shown = all.iter().filter(|one| one.kind != Loop::FullState);
        for (number, one) in shown.enumerate() {
            let Some(ripple) = one.ripples.iter().find(|ripple| ripple.signal == signal) else { continue };
            let points = ripple.spectrum.amplitudes().into_iter().filter(|point| point[0] <= HIGHEST_HZ);
            let points = points.map(|[frequency, amplitude]| [frequency, scale * amplitude]);
            panel = panel.with(Curve::line(
                format!("{}, {}", one.law, one.kind.name()),
                number,
                points.collect(),
            ));
        }
        figure = figure.with(panel);
    }
    figure
}
