//! The linear model, compared with the matrices that the paper prints.

use crate::published::rig;
use upright::table::Equilibrium;
use upright_design::numerics::Wide;
use upright_design::plant::{ChainParameters, LinearModel, linearise};
use upright_design::rig::{Chain, PlantDescription};
use upright_paper::published::{A, B};

fn paper() -> Chain {
    match rig("quadruple-paper").plant {
        PlantDescription::Chain(chain) => chain,
        PlantDescription::Model(_) => panic!("quadruple-paper describes links"),
    }
}

fn model(chain: &Chain) -> LinearModel<f64> {
    linearise(&ChainParameters::of(chain), Equilibrium::UPRIGHT).expect("a mass matrix with an inverse")
}

/// Number of odd rows (ẋ, θ̇_1, …) of A in columns θ_1 … θ_4, and of B, that differ from the printed ones in six
/// significant digits.
fn misprints(model: &LinearModel<f64>) -> usize {
    let digits = |value: f64| format!("{value:.5e}");
    let differs = |printed: &str, computed: f64| digits(printed.parse().unwrap()) != digits(computed);
    let mut wrong = 0;
    for (i, (row, b)) in A.iter().zip(B).enumerate().filter(|(i, _)| i % 2 == 1) {
        wrong += usize::from(differs(b, model.b[(i, 0)]));
        wrong += (2..10).step_by(2).filter(|&j| differs(row[j], model.a[(i, j)])).count();
    }
    wrong
}

#[test]
fn the_papers_matrices_come_out_to_every_printed_digit() {
    let ours = model(&paper());
    assert_eq!(misprints(&ours), 0, "{ours:?}");
    // The paper prints seven digits of this entry.
    assert_eq!(format!("{:.5}", ours.a[(1, 2)]), "28.25280");
    // The entries that are not printed follow from the structure: positions follow velocities, and nothing else has an
    // effect.
    for row in 0..10 {
        for column in 0..10 {
            let printed = row % 2 == 1 && column % 2 == 0 && column > 0;
            let velocity = row % 2 == 0 && column == row + 1;
            if !printed {
                assert_eq!(ours.a[(row, column)], f64::from(u8::from(velocity)));
            }
        }
    }
    let wide = linearise(&ChainParameters::<Wide>::of(&paper()), Equilibrium::UPRIGHT).unwrap();
    let rounded = LinearModel {
        a: wide.a.map(Wide::round_to_f64),
        b: wide.b.map(Wide::round_to_f64),
        torque_inputs: wide.torque_inputs.map(Wide::round_to_f64),
    };
    assert_eq!(misprints(&rounded), 0);
}

#[test]
fn slightly_wrong_rigs_do_not_give_the_papers_matrices() {
    let mut heavier_cart = paper();
    heavier_cart.cart.mass_kg = heavier_cart.cart.mass_kg.map(|mass| 1.001 * mass);
    let mut longer_link = paper();
    longer_link.links[3].length_m *= 1.001;
    let mut points = paper();
    points.links[0].inertia_kg_m2 = Some(0.0);
    for wrong in [heavier_cart, longer_link, points] {
        assert!(misprints(&model(&wrong)) >= 5);
    }
}
