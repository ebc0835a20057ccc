//! Figures: their contents, and that they are legible without colour.

use upright_tool::figure::{Axis, Curve, Figure, FigureError, HeatMap, Panel};

fn wave(amplitude: f64) -> Vec<[f64; 2]> {
    (0..=200).map(|i| f64::from(i) * 0.05).map(|t| [t, amplitude * t.sin()]).collect()
}

fn one(panel: Panel) -> Figure {
    Figure::new("a figure").with(panel)
}

fn plain() -> Panel {
    Panel::new(Axis::linear("time (s)"), Axis::linear("angle (°)"))
}

#[test]
fn every_curve_differs_from_the_others_without_its_colour() {
    let panel = (0..7).fold(plain(), |panel, number| panel.with(Curve::line("c", number, wave(1.0))));
    let svg = one(panel).svg().unwrap();
    let dash = |line: &str| {
        line.split("stroke-dasharray=\"").nth(1).map(|rest| rest.split('"').next().unwrap().to_owned())
    };
    let mut dashes: Vec<Option<String>> = svg
        .lines()
        .filter(|line| line.starts_with("<polyline") && line.contains("stroke-width=\"8\""))
        .map(dash)
        .collect();
    dashes.sort();
    dashes.dedup();
    assert_eq!(dashes.len(), 7, "{dashes:?}");
}

#[test]
fn axes_name_quantity_and_unit() {
    let svg = one(plain().with(Curve::line("θ1", 0, wave(1.0)))).svg().unwrap();
    for text in ["time (s)", "angle (°)", "θ1", "a figure"] {
        assert!(svg.contains(text), "{text}");
    }
}

#[test]
fn ticks_of_a_logarithmic_axis_are_short_numbers() {
    for power in -9..6 {
        let low = 10f64.powi(power);
        let panel = Panel::new(Axis::log("x"), Axis::linear("y"));
        let svg = one(panel.with(Curve::line("", 0, vec![[low, 0.0], [60.0 * low, 1.0]]))).svg().unwrap();
        // 5 times a millionth is 4.9999999999999996e-6.
        assert!(!svg.contains("99999") && !svg.contains("00000000"), "{power}");
    }
}

#[test]
fn text_from_a_rig_file_cannot_become_markup() {
    let svg = one(plain().with(Curve::line("<script>alert(1)</script>", 0, wave(1.0)))).svg().unwrap();
    assert!(!svg.contains("<script"));
    assert!(svg.contains("&lt;script&gt;"));
}

#[test]
fn the_plot_area_maps_values_to_the_drawing() {
    let figure = one(Panel::new(Axis::linear("t").range(0.0, 10.0), Axis::linear("y").range(-1.0, 1.0))
        .with(Curve::line("", 0, vec![[0.0, -1.0], [10.0, 1.0]])));
    let drawing = figure.draw().unwrap();
    let area = drawing.panels[0];
    assert_eq!((area.x, area.y), ([0.0, 10.0], [-1.0, 1.0]));
    let line = format!(
        "points=\"{},{} {},{} \"",
        area.horizontal[0], area.vertical[0], area.horizontal[1], area.vertical[1]
    );
    assert!(drawing.svg.contains(&line), "{line}");
}

#[test]
fn curves_of_different_size_get_the_same_scale_on_request() {
    let mut figures = [1.0, 5.0].map(|size| one(plain().with(Curve::line("", 0, wave(size)))));
    let range = |figure: &Figure| figure.draw().unwrap().panels[0].y;
    assert_ne!(range(&figures[0]), range(&figures[1]));
    Figure::same_scale(&mut figures);
    assert_eq!(range(&figures[0]), range(&figures[1]));
    assert!(range(&figures[0])[1] >= 4.9);
}

#[test]
fn a_far_limit_does_not_flatten_the_curves() {
    let limited = |limit: f64| {
        let limit = Curve::limit("limit", vec![[0.0, limit], [10.0, limit]]);
        one(plain().with(limit).with(Curve::line("", 0, wave(1.0)))).draw().unwrap().panels[0].y[1]
    };
    assert!(limited(1.2) > 1.2);
    assert!(limited(100.0) < 2.0);
}

#[test]
fn one_unit_is_as_long_both_ways_in_a_map_of_poles() {
    let poles = Curve::markers("poles", 0, vec![[0.99, 0.01], [0.99, -0.01]]);
    let panel = Panel::new(Axis::linear("Re z"), Axis::linear("Im z")).equal().unit_circle().with(poles);
    let area = one(panel).draw().unwrap().panels[0];
    let per_unit =
        |ends: [i32; 2], range: [f64; 2]| f64::from(ends[1] - ends[0]).abs() / (range[1] - range[0]);
    let ratio = per_unit(area.horizontal, area.x) / per_unit(area.vertical, area.y);
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
}

#[test]
fn an_impossible_range_is_an_error_that_names_the_axis() {
    let of = |axis: Axis| one(Panel::new(axis, Axis::linear("y")).with(Curve::line("", 0, wave(1.0)))).svg();
    let error = of(Axis::log("frequency (rad/s)").range(0.0, 1.0)).unwrap_err();
    assert!(matches!(&error, FigureError::Range { label, .. } if label == "frequency (rad/s)"));
    assert!(of(Axis::linear("t").range(1.0, 1.0)).is_err());
    assert!(of(Axis::linear("t").range(0.0, f64::NAN)).is_err());
    assert!(of(Axis::linear("t").range(0.0, 1.0)).is_ok());
}

#[test]
fn csv_has_every_point_of_every_curve() {
    let values = vec![vec![Some(1.5), None]];
    let heat = HeatMap {
        name: "settles".into(),
        unit: "s".into(),
        columns: vec![0.0, 1.0],
        rows: vec![0.5],
        values,
    };
    let map = Panel { heat: Some(heat), ..Panel::new(Axis::linear("a"), Axis::linear("b")) };
    let figure = one(plain().with(Curve::line("θ1, first", 0, wave(1.0)))).with(map);
    let csv = figure.csv().unwrap();
    assert_eq!(csv.lines().count(), 1 + 201 + 2);
    let last: Vec<&str> = csv.lines().rev().take(2).collect();
    assert_eq!(last, ["b,a,settles,1,0.5,", "b,a,settles,0,0.5,1.5"]);
    assert!(csv.contains("\"θ1, first\""));
}

#[test]
fn a_png_shows_curve_and_text_without_fonts_of_the_system() {
    let with = |name: &str, size: f64| one(plain().with(Curve::line(name, 0, wave(size)))).png(1.0).unwrap();
    let png = with("θ1", 1.0);
    assert_eq!(&png[1..4], b"PNG");
    assert_ne!(png, with("θ2", 1.0), "the text is not there");
    assert_ne!(png, with("θ1", 2.0), "the curve is not there");
}
