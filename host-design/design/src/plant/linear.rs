//! The exact linear model of a chain about an equilibrium.

use upright::table::Equilibrium;

use super::ChainParameters;
use crate::numerics::{Matrix, Real, Singular, solve};
use crate::rig::CartInput;

/// Linear model `ẋ = A x + B u + G τ` in deviations from an equilibrium. A chain has s = 2n + 2 states, in the order
/// that the module `plant` defines.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel<R> {
    /// `A`, s×s.
    pub a: Matrix<R>,
    /// `B`, s×1: the force on the cart (N), or its acceleration (m/s²) where the drive imposes that.
    pub b: Matrix<R>,
    /// `G`, s×n: the torques at the joints (N·m).
    pub torque_inputs: Matrix<R>,
}

/// Linearises the equations of motion of [`ChainParameters`], frictions included, about an equilibrium.
///
/// With `σ_j = 1` for a link that is up and `-1` for one that is down, and `φ` now a deviation from the equilibrium,
/// the equations to first order are:
///
/// ```text
/// M [ẍ; φ̈] = [u - d_0 ẋ;  σ_j g a_j φ_j + τ_j - τ_{j+1} - d_j θ̇_j + d_{j+1} θ̇_{j+1}],
/// φ_j = θ_1 + … + θ_j,   θ̈_i = φ̈_i - φ̈_{i-1}
/// ```
///
/// Where the drive imposes the cart's acceleration u, the first row is `ẍ = u`.
///
/// # Errors
/// [`Singular`] if the mass matrix has no inverse: some motion of the chain moves no mass.
#[doc(alias = "linearize")]
pub fn linearise<R: Real>(
    parameters: &ChainParameters<R>,
    about: Equilibrium,
) -> Result<LinearModel<R>, Singular> {
    let n = parameters.links();
    let rest = |link: usize| if about.is_down(link) { (R::pi(), -R::one()) } else { (R::zero(), R::one()) };
    let (angles, sigma): (Vec<R>, Vec<R>) = (0..n).map(rest).unzip();
    // Columns: forces and torques on x, φ caused by each of θ_1 … θ_n, ẋ, θ̇_1 … θ̇_n, u, τ_1 … τ_n.
    let (rates, inputs) = (n, 2 * n + 1);
    let mut causes = Matrix::zeros(n + 1, 3 * n + 2);
    if parameters.input == CartInput::Force {
        causes[(0, rates)] = -parameters.cart_friction.clone();
    }
    causes[(0, inputs)] = R::one();
    for j in 1..=n {
        let gravity_torque = sigma[j - 1].clone() * &parameters.weight[j - 1];
        for i in 1..=j {
            causes[(j, i - 1)] = gravity_torque.clone();
        }
        // A torque at joint i acts on link i and, with opposite sign, on the link below: Q_i = τ_i, Q_{i-1} = -τ_i.
        let friction = parameters.joint_frictions[j - 1].clone();
        causes[(j, inputs + j)] = R::one();
        causes[(j, rates + j)] = -friction.clone();
        if j > 1 {
            causes[(j - 1, inputs + j)] = -R::one();
            causes[(j - 1, rates + j)] = friction;
        }
    }
    let absolute = solve(&parameters.mass_matrix(&angles), &causes)?;
    let acceleration = |i: usize, cause: usize| match i {
        0 | 1 => absolute[(i, cause)].clone(),
        _ => absolute[(i, cause)].clone() - &absolute[(i - 1, cause)],
    };

    // State 2i is a position and its derivative is state 2i + 1, whose derivative is acceleration i.
    let s = 2 * n + 2;
    let a = Matrix::from_fn(s, s, |row, column| match (row % 2, column) {
        (0, _) => R::from_f64(if column == row + 1 { 1.0 } else { 0.0 }),
        (_, 0) => R::zero(), // nothing depends on the cart's position
        _ if column % 2 == 0 => acceleration(row / 2, column / 2 - 1),
        _ => acceleration(row / 2, rates + column / 2),
    });
    let input = |row: usize, cause: usize| match row % 2 {
        0 => R::zero(),
        _ => acceleration(row / 2, cause),
    };
    Ok(LinearModel {
        a,
        b: Matrix::from_fn(s, 1, |row, _| input(row, inputs)),
        torque_inputs: Matrix::from_fn(s, n, |row, joint| input(row, inputs + 1 + joint)),
    })
}
