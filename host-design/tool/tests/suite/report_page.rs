//! The page for all kinds of rigs: complete, self-contained and safe.

use std::path::Path;

use upright_design::motion::Transition;
use upright_plan::Margin;

use crate::report_rigs::{
    LINEAR, SINGLE, coarse_report, quick_report, report_with_imperfections, report_with_margins,
};
use upright_design::rig::Rig;
use upright_tool::report::{REGION_POINTS, Report};

const LARGEST: usize = 5_000_000;

/// `links` links of 0.3 m without encoders, for the LQR alone.
fn chain(links: usize, name: &str) -> Rig {
    let link = "[[link]]\nmass_kg = 0.2\nlength_m = 0.3\n".repeat(links);
    let weights: Vec<String> = (0..=links).map(|_| "10, 1".to_owned()).collect();
    let text = format!(
        "name = {name:?}\n[cart]\nmass_kg = 1\n{link}[tick]\nperiod_s = 0.002\n[lqr]\nstate_weights = [{}]\nforce_weight = 1\n",
        weights.join(", ")
    );
    Rig::from_toml(&text, Path::new("test.toml")).unwrap()
}

/// Largest size (bytes) that a page with coarse maps would have with fine ones: a rectangle of 200 bytes for each
/// initial state.
fn with_fine_maps(report: &Report) -> usize {
    let maps = report.pictures.iter().filter(|picture| picture.name.starts_with("region-")).count();
    report.html.len() + maps * REGION_POINTS * REGION_POINTS * 200
}

fn ids(html: &str) -> Vec<&str> {
    html.split("<section id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_rig_gets_a_whole_page_that_needs_nothing_else() {
    let report = quick_report(&crate::report_rigs::rig("double-quanser-dbpen"));
    let html = &report.html;
    assert!(html.len() < LARGEST, "{}", html.len());
    let sections =
        ["trust", "runs", "rig", "model", "poles", "gains", "frequency", "region", "cost", "provenance"];
    assert_eq!(ids(html), sections);
    // The address of a namespace is only a name; no browser opens it.
    let addresses = html.replace("http://www.w3.org/2000/svg", "");
    for outside in ["http:", "https:", "src=", "@import", "url("] {
        assert!(!addresses.contains(outside), "{outside}");
    }
    let names: Vec<&str> = report.pictures.iter().map(|picture| picture.name.as_str()).collect();
    let of = |id: &str| [format!("{id}-lqr"), format!("{id}-pole-placement")];
    let of_both = ["step", "tilt", "disturbances", "encoders", "poles", "bode", "nyquist", "region"].map(of);
    for name in of_both.iter().flatten().map(String::as_str).chain(["rig"]) {
        assert!(names.contains(&name), "{name}: {names:?}");
    }
    assert!(report.pictures.iter().all(|picture| picture.csv.is_some() == (picture.name != "rig")));
}

#[test]
fn the_same_rig_gets_the_same_page() {
    let rig = chain(1, "twice");
    assert_eq!(coarse_report(&rig), coarse_report(&rig));
}

#[test]
fn a_linear_model_has_no_drawing_and_the_page_says_so() {
    let report = &LINEAR;
    assert!(report.html.contains("nothing to draw and no\nanimation"));
    assert!(report.html.contains("No drawing: the rig file gives a linear model"));
    assert!(report.html.contains("gives no disturbances"));
    assert!(!report.html.contains("id=\"stages\""));
    assert!(!report.pictures.iter().any(|picture| picture.name.starts_with("rig")));
}

#[test]
fn a_chain_of_one_or_six_links_without_encoders_has_a_page() {
    for links in [1, 6] {
        let report = coarse_report(&chain(links, "links"));
        assert!(with_fine_maps(&report) < LARGEST, "{links} links: {}", with_fine_maps(&report));
        assert!(report.html.contains(&format!("{links} link")));
        let names: Vec<&str> = report.pictures.iter().map(|picture| picture.name.as_str()).collect();
        assert_eq!(
            names,
            ["rig", "step-lqr", "tilt-lqr", "poles-lqr", "bode-lqr", "nyquist-lqr", "region-lqr"]
        );
    }
}

#[test]
fn a_name_from_a_rig_file_cannot_become_a_script() {
    let name = "</title><script>alert(1)</script><img src=x onerror=alert(2)>";
    let report = coarse_report(&chain(1, name));
    assert!(!report.html.contains("<script>alert"), "the name is markup");
    assert!(!report.html.contains("<img"), "the name is markup");
    assert_eq!(report.html.matches("<script").count(), 2);
    for picture in &report.pictures {
        assert!(!picture.svg.contains("<script"), "{}", picture.name);
    }
    // Negative control: the page does show the rig's name, so the checks above would see it.
    let unescaped = report.html.replace("&#60;", "<").replace("&#62;", ">");
    assert!(unescaped.contains(name));
}

#[test]
fn the_margins_in_the_bode_plot_are_on_the_curve() {
    let report = &SINGLE;
    let mut marked = 0;
    for picture in report.pictures.iter().filter(|picture| picture.name.starts_with("bode-")) {
        for line in picture.csv.as_ref().unwrap().lines() {
            let fields: Vec<&str> = line.split(',').collect();
            let [_, _, curve, _, y, ..] = fields[..] else { continue };
            let y = || y.parse::<f64>().unwrap();
            if let Some(factor) = curve.strip_prefix("gain margin × ") {
                // The force times this factor makes |L| = 1 at that point; the page shows three digits.
                let product = y() * factor.parse::<f64>().unwrap();
                assert!((product - 1.0).abs() < 0.01, "{}: {line}: {product}", picture.name);
                marked += 1;
            } else if let Some(margin) = curve.strip_prefix("phase margin ") {
                let margin: f64 = margin.trim_end_matches('°').parse().unwrap();
                let beyond = (y() - 180.0).rem_euclid(360.0);
                let spare = beyond.min(360.0 - beyond);
                assert!((spare - margin).abs() < 0.5, "{}: {line}: {spare}", picture.name);
                marked += 1;
            }
        }
    }
    assert!(marked >= 4, "{marked}");
}

#[test]
fn margins_have_a_figure_where_they_are_asked_for() {
    let plain = &SINGLE;
    assert!(!plain.html.contains("id=\"pushes\""));
    let margins = [0.5, 0.0].map(|along| Margin { at_s: 1.0 - along, links_n: vec![[0.25, along]] });
    let rig = crate::report_rigs::rig("single-quanser-ip02");
    let report = report_with_margins(&rig, &[(Transition::Up, margins.to_vec())]);
    assert!(report.html.contains("id=\"pushes\"") && report.html.contains("href=\"#pushes\""));
    let [picture] = &report.pictures[plain.pictures.len()..] else { panic!("one more picture") };
    let csv = picture.csv.as_ref().unwrap();
    println!("{csv}");
    assert!(csv.contains("raising: push against") && csv.contains("raising: push along"), "{csv}");
    // A margin of 0 cannot be shown on a logarithmic axis.
    assert!(csv.lines().filter(|line| line.contains(",link 1,")).count() >= 3, "{csv}");
}

#[test]
fn imperfections_have_a_table_and_two_figures_where_they_are_asked_for() {
    let plain = &SINGLE;
    assert!(!plain.html.contains("id=\"imperfections\""));
    for name in ["single-quanser-ip02", "double-quanser-dbpen", "quadruple-paper"] {
        let report = report_with_imperfections(&crate::report_rigs::rig(name));
        assert!(report.html.contains("id=\"imperfections\"") && with_fine_maps(&report) < LARGEST, "{name}");
        for key in ["joint_friction_n_m", "parameter_spread_percent"] {
            assert_eq!(
                report.html.matches(&format!("<td><code>{key}</code></td>")).count(),
                1,
                "{name} {key}"
            );
        }
        let pictures: Vec<&str> = report.pictures.iter().map(|one| &*one.name).collect();
        assert!(pictures.ends_with(&["limit-cycle", "wrong-masses"]), "{name} {pictures:?}");
        let csv = |figure: &str| {
            let picture = report.pictures.iter().find(|one| one.name == figure).unwrap();
            let rows = picture.csv.as_ref().unwrap().lines().filter(|line| line.contains(",LQR,"));
            let numbers =
                rows.map(|line| line.split(',').skip(3).take(2).map(|x| x.parse().unwrap()).collect());
            numbers.collect::<Vec<Vec<f64>>>()
        };
        // More friction makes a larger limit cycle; without mass errors, every combination survives.
        let cycle = csv("limit-cycle");
        assert!(cycle.len() >= 5 && cycle[cycle.len() - 1][1] > 2.0 * cycle[0][1], "{name} {cycle:?}");
        assert_eq!(csv("wrong-masses")[0], [0.0, 100.0], "{name}");
    }
}
