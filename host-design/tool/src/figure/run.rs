//! A simulated run over time as a figure.

use upright_design::number::significant;
use upright_design::rig::{Chain, PlantDescription, Rig};
use upright_design::simulate::{Sample, Trace};

use super::{Axis, Curve, Figure, FigureError, Panel};

/// Position, angles, rates and force of a run over time, one below the other, as an SVG document.
///
/// # Errors
/// [`FigureError`] from the drawing library.
pub fn run_svg(rig: &Rig, trace: &Trace, title: &str) -> Result<String, FigureError> {
    let end_s = trace.samples().last().map_or(1.0, |sample| sample.t).max(1e-9);
    run_figure(Figure::new(title), rig, trace, end_s).svg()
}

/// Adds the panels of a run to `figure`: position, angles, rates and force with their limits, or the states and the
/// input of a `[model]`. The time axis ends at `end_s`.
pub(crate) fn run_figure(figure: Figure, rig: &Rig, trace: &Trace, end_s: f64) -> Figure {
    let run = DrawnRun { rig, trace, end_s };
    let panels = match &rig.plant {
        PlantDescription::Chain(chain) => {
            vec![run.position(chain), run.angles(chain), run.rates(chain), run.force()]
        }
        PlantDescription::Model(_) => vec![run.output(), run.other_states(), run.input()],
    };
    panels.into_iter().fold(figure, Figure::with)
}

struct DrawnRun<'a> {
    rig: &'a Rig,
    trace: &'a Trace,
    end_s: f64,
}

impl DrawnRun<'_> {
    fn panel(&self, label: &str) -> Panel {
        Panel::new(Axis::linear("time (s)").range(0.0, self.end_s), Axis::linear(label)).high(178)
    }

    fn curve(&self, value: impl Fn(&Sample<&[f64]>) -> f64) -> Vec<[f64; 2]> {
        self.trace.samples().map(|sample| [sample.t, value(&sample)]).collect()
    }

    /// Lower and upper limit, as lines across the panel.
    fn limits(&self, name: &str, limits: [f64; 2]) -> Curve {
        let [low, high] = limits.map(|limit| [[0.0, limit], [self.end_s, limit]]);
        Curve::limit(name, [low.as_slice(), &[[f64::NAN; 2]], &high].concat())
    }

    fn position(&self, chain: &Chain) -> Panel {
        let rail = chain.cart.travel_m;
        let base = chain.base;
        let right = base.position().of(&number(rail[1]));
        let name = base.words(&format!("rail {} to {right}", number(rail[0])));
        let mut panel = self
            .panel(&base.position().title())
            .with(Curve::reference("set-point", self.curve(|sample| sample.target)));
        if self.trace.samples().any(|sample| sample.setpoint != sample.target) {
            let governed = self.curve(|sample| sample.setpoint);
            panel = panel.with(Curve::line("governed set-point", 1, governed));
        }
        let position = self.curve(|sample| sample.state[0]);
        panel.with(Curve::line("x", 0, position)).with(self.limits(&name, rail))
    }

    fn angles(&self, chain: &Chain) -> Panel {
        let panel = (0..chain.links.len()).fold(self.panel("angles (°)"), |panel, joint| {
            let points = self.curve(|sample| sample.state[2 + 2 * joint].to_degrees());
            panel.with(Curve::line(format!("θ{}", joint + 1), joint, points))
        });
        match self.rig.limits.angle_rad.map(f64::to_degrees) {
            Some(limit) => panel.with(self.limits(&format!("limit ±{}°", number(limit)), [-limit, limit])),
            None => panel,
        }
    }

    fn rates(&self, chain: &Chain) -> Panel {
        (0..chain.links.len()).fold(self.panel("rates (°/s)"), |panel, joint| {
            let points = self.curve(|sample| sample.state[3 + 2 * joint].to_degrees());
            panel.with(Curve::line(format!("θ{}'", joint + 1), joint, points))
        })
    }

    fn force(&self) -> Panel {
        // The force requested while a pendulum falls can be a hundred times the limit and would flatten all else.
        let largest = 2.0 * self.trace.samples().fold(0.0f64, |most, sample| most.max(sample.force.abs()));
        let is_cut_off = self.trace.samples().any(|sample| sample.requested.abs() > largest);
        let name = if is_cut_off { "requested (cut off)" } else { "requested" };
        let requested = self.curve(|sample| sample.requested.clamp(-largest, largest));
        let input = self.rig.input_quantity();
        let panel = self.panel(&input.title()).with(Curve::reference(name, requested)).with(Curve::line(
            "u",
            0,
            self.curve(|sample| sample.force),
        ));
        match self.rig.actuator.largest_input() {
            Some(limit) => {
                panel.with(self.limits(&format!("limit ±{}", input.of(&number(limit))), [-limit, limit]))
            }
            None => panel,
        }
    }

    fn output(&self) -> Panel {
        let output = self.rig.output();
        self.panel("output")
            .with(Curve::reference("set-point", self.curve(|sample| sample.target)))
            .with(Curve::line(format!("state {output}"), 0, self.curve(|sample| sample.state[output])))
    }

    fn other_states(&self) -> Panel {
        let others = (0..self.rig.states()).filter(|&state| state != self.rig.output());
        others.enumerate().fold(self.panel("other states"), |panel, (number, state)| {
            panel.with(Curve::line(state.to_string(), number, self.curve(|sample| sample.state[state])))
        })
    }

    fn input(&self) -> Panel {
        self.panel("input").with(Curve::line("u", 0, self.curve(|sample| sample.force)))
    }
}

/// Three significant digits, with a printed minus sign.
fn number(x: f64) -> String {
    significant(x, 3).replace('-', "−")
}
