//! F. J. Ticona Coaquira, "Design and comparison of two linear controllers with precompensation gain for the Quadruple
//! inverted pendulum": every digit it prints.
//!
//! Its gains were computed from A and B as printed, rounded to six digits (`rigs/quadruple-paper-printed.toml`). From
//! the exact equations of motion (`rigs/quadruple-paper.toml`) they differ by up to 5.3e-5, relative: five of the
//! twenty printed gains then end in another digit, and the pole placement's N is 11.0075.

use crate::published::{designed, rig};
use upright_design::design::{Certified, Feedback, design};
use upright_design::numerics::eigenvalues;
use upright_design::rig::Rig;
use upright_paper::published::{LQR_K, LQR_N, PLACEMENT_K, PLACEMENT_N};

fn printed_k(law: &Feedback<f64>) -> String {
    law.k.entries().iter().map(|gain| format!("{gain:.2}")).collect::<Vec<_>>().join(" ")
}

fn printed_n(law: &Feedback<f64>) -> String {
    format!("{:.4}", law.n.unwrap())
}

/// The continuous laws: [LQR, pole placement].
fn laws(certified: &Certified) -> [&Feedback<f64>; 2] {
    certified.double.continuous.each().into_array().map(Option::unwrap)
}

#[test]
fn every_printed_digit_of_both_designs_comes_from_the_printed_matrices() {
    let certified = designed("quadruple-paper-printed");
    let [lqr, placement] = laws(certified);
    assert_eq!((printed_k(lqr).as_str(), printed_n(lqr).as_str()), (LQR_K.join(" ").as_str(), LQR_N));
    assert_eq!(
        (printed_k(placement).as_str(), printed_n(placement).as_str()),
        (PLACEMENT_K.join(" ").as_str(), PLACEMENT_N)
    );
}

#[test]
fn another_weight_or_another_far_pole_prints_other_digits() {
    let mut other = rig("quadruple-paper-printed");
    other.lqr.as_mut().unwrap().state_weights[9] = 1.01;
    let text = "poles: -40 to -47, the last one moved to -47.01";
    match other.pole_placement.as_mut().unwrap() {
        upright_design::rig::PolePlacement::Response { far_poles, .. } => far_poles[7] = -47.01,
        upright_design::rig::PolePlacement::Poles(_) => panic!("{text}"),
    }
    let certified = design(&other).unwrap();
    let [lqr, placement] = laws(&certified);
    assert_ne!(printed_k(lqr), LQR_K.join(" "));
    assert_ne!(printed_k(placement), PLACEMENT_K.join(" "), "{text}");
}

#[test]
fn the_exact_model_gives_the_printed_gains_to_the_accuracy_of_the_printed_matrices() {
    let (exact, printed) = (designed("quadruple-paper"), designed("quadruple-paper-printed"));
    // A and B are printed with six digits: half a unit in the last digit is up to 5e-6 of an entry, and the most
    // sensitive gain magnifies it elevenfold.
    for (exact, printed) in laws(exact).into_iter().zip(laws(printed)) {
        for (exact, printed) in exact.k.entries().iter().zip(printed.k.entries()) {
            assert!((exact / printed - 1.0).abs() < 6e-5, "{exact} {printed}");
        }
    }
    let [lqr, placement] = laws(exact);
    let differing = |ours: String, theirs: [&str; 10]| {
        ours.split(' ').zip(theirs).filter(|(ours, theirs)| ours != theirs).count()
    };
    assert_eq!(
        differing(printed_k(lqr), LQR_K) + differing(printed_k(placement), PLACEMENT_K),
        5,
        "{} {}",
        printed_k(lqr),
        printed_k(placement)
    );
    assert_eq!(printed_n(lqr), LQR_N);
    assert_eq!(printed_n(placement), "11.0075");
}

#[test]
fn the_precompensation_of_the_lqr_is_the_root_of_ten() {
    let certified = designed("quadruple-paper");
    // The correctly rounded answer, to the last bit.
    assert_eq!(laws(certified)[0].n.unwrap().to_bits(), 10f64.sqrt().to_bits());
}

#[test]
fn open_loop_poles_are_two_integrators_and_four_pairs() {
    let poles = eigenvalues(&designed("quadruple-paper").double.a).unwrap();
    let mut real: Vec<String> = poles
        .iter()
        .map(|pole| {
            // A double eigenvalue of a matrix rounded to f64 is accurate to about half the digits.
            assert!(pole.im.abs() < 1e-5, "{pole:?}");
            format!("{:.3}", if pole.re.abs() < 1e-5 { 0.0 } else { pole.re })
        })
        .collect();
    real.sort();
    let mut wanted = [
        "0.000",
        "0.000",
        "10.255",
        "-10.255",
        "21.634",
        "-21.634",
        "38.386",
        "-38.386",
        "71.914",
        "-71.914",
    ];
    wanted.sort();
    assert_eq!(real, wanted);
}

#[test]
fn closed_loop_poles_are_those_of_the_paper() {
    let poles = designed("quadruple-paper").poles(&rig("quadruple-paper")).unwrap();
    let fastest = poles.continuous.lqr.as_ref().unwrap().iter().map(|pole| pole[0]).fold(0.0, f64::min);
    assert_eq!(format!("{fastest:.1}"), "-527.6");
    let placed: Vec<[String; 2]> = poles
        .continuous
        .pole_placement
        .as_ref()
        .unwrap()
        .iter()
        .map(|[re, im]| [format!("{re:.6}"), format!("{:.6}", im.abs())])
        .collect();
    let mut wanted: Vec<[String; 2]> =
        (40..48).rev().map(|pole| [format!("-{pole}.000000"), "0.000000".into()]).collect();
    wanted.extend([(); 2].map(|()| ["-0.666667".into(), "0.454792".into()]));
    assert_eq!(placed, wanted);
}

#[test]
fn the_papers_gains_survive_ticks_of_one_and_two_milliseconds_only() {
    // (tick, delay, spectral radius with the LQR's continuous gains held over the tick)
    let mut rig = Rig { pole_placement: None, kalman: None, ..rig("quadruple-paper") };
    for (period_s, delay_ticks, wanted) in
        [(0.001, 0, None), (0.002, 0, None), (0.003, 0, Some("1.08")), (0.002, 1, Some("1.29"))]
    {
        rig.tick = upright_design::rig::Tick { period_s, delay_ticks };
        let lqr = design(&rig).unwrap().assess(&rig).unwrap().lqr.unwrap();
        assert!(lqr.exact < 1.0 && lqr.rounded < 1.0, "redesigned for the tick it always holds");
        match wanted {
            None => assert!(lqr.continuous_at_tick < 1.0, "{period_s}: {lqr:?}"),
            Some(wanted) => assert_eq!(format!("{:.2}", lqr.continuous_at_tick), wanted),
        }
    }
    rig.tick = upright_design::rig::Tick { period_s: 0.005, delay_ticks: 0 };
    let lqr = design(&rig).unwrap().assess(&rig).unwrap().lqr.unwrap();
    assert_eq!(format!("{:.1}", lqr.continuous_at_tick), "3.1");
}
