//! The constants of a chain's equations of motion.

use crate::numerics::{Matrix, Real, eigenvalues};
use crate::rig::{self, CartInput};

/// The constants of the equations of motion in `x, φ` for n links.
///
/// With `h_ij = l_j` for `j < i`, `c_i` for `j = i` and 0 for `j > i`, so that link i's centre of mass is
/// at `(x - Σ_j h_ij sin φ_j, Σ_j h_ij cos φ_j)`, Lagrange's equations (Goldstein, *Classical Mechanics*, §1.4) of
///
/// ```text
/// a_j = Σ_i m_i h_ij,   b_jk = Σ_i m_i h_ij h_ik + δ_jk I_j,   V = g Σ_j a_j cos φ_j
/// T = ½ M_t ẋ² - ẋ Σ_j a_j cos φ_j φ̇_j + ½ Σ_jk b_jk cos(φ_j - φ_k) φ̇_j φ̇_k
/// ```
///
/// are
///
/// ```text
/// M_t ẍ - Σ_j a_j cos φ_j φ̈_j + Σ_j a_j sin φ_j φ̇_j² = u - d_0 ẋ
/// -a_j cos φ_j ẍ + Σ_k b_jk (cos(φ_j - φ_k) φ̈_k + sin(φ_j - φ_k) φ̇_k²) - g a_j sin φ_j = Q_j
/// Q_j = τ_j - τ_{j+1},   τ_i = (torque given at joint i) - d_i θ̇_i,   τ_{n+1} = 0
/// ```
///
/// Where the drive imposes the cart's acceleration a, `ẍ = a` takes the place of the first equation.
///
/// On an arm, x is its angle, forces are torques about its axis, and masses of the base are moments of inertia about
/// it. Link i turns in a plane at the distance `r_i` from the axis and has the moment of inertia `I'_i` about its own
/// length. Then
///
/// ```text
/// M_t = (inertia of the arm) + Σ_i (m_i r_i² + I'_i),   a_j = Σ_i m_i r_i h_ij,   V = g Σ_ij m_i h_ij cos φ_j,
/// ```
///
/// the kinetic energy has the further term `½ ẋ² Σ_jk β_jk sin φ_j sin φ_k`, `β_jk = b_jk - δ_jk I'_j`, and with
/// `p_j = Σ_k β_jk sin φ_k` the left sides have the further terms
///
/// ```text
/// Σ_j p_j (sin φ_j ẍ + 2 cos φ_j φ̇_j ẋ)   and   -p_j cos φ_j ẋ²
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ChainParameters<R> {
    /// What the drive imposes on the cart.
    pub input: CartInput,
    /// `M_t`: mass of cart and links together (kg); without the cart, if its mass is not known.
    pub total_mass: R,
    /// `a_j`, n entries (kg·m).
    pub a: Vec<R>,
    /// `g Σ_i m_i h_ij`, n entries (N·m).
    pub weight: Vec<R>,
    /// `b_jk`, n×n, symmetric (kg·m²).
    pub b: Matrix<R>,
    /// `g` (m/s²).
    pub gravity: R,
    /// `d_0`: viscous friction of the cart (N·s/m).
    pub cart_friction: R,
    /// `d_i`: viscous friction of each joint on its relative rate, n entries (N·m·s/rad).
    pub joint_frictions: Vec<R>,
    /// `β_jk`, n×n, symmetric (kg·m²); none on a cart.
    pub turning: Option<Matrix<R>>,
}

impl<R: Real> ChainParameters<R> {
    /// Computes the constants from the exact values in a rig file. The default centre of mass is `l/2`, the default
    /// inertia that of a uniform rod, `m l²/12`; both are rounded only in `R`.
    pub fn of(chain: &rig::Chain) -> Self {
        let n = chain.links.len();
        let mass: Vec<R> = chain.links.iter().map(|link| R::from_f64(link.mass_kg)).collect();
        let length: Vec<R> = chain.links.iter().map(|link| R::from_f64(link.length_m)).collect();
        let h = |i: usize, j: usize| match j.cmp(&i) {
            core::cmp::Ordering::Less => length[j].clone(),
            core::cmp::Ordering::Equal => match chain.links[i].centre_of_mass_m {
                Some(given) => R::from_f64(given),
                None => length[i].scale_by_power_of_two(-1),
            },
            core::cmp::Ordering::Greater => R::zero(),
        };
        let inertia = |j: usize| match chain.links[j].inertia_kg_m2 {
            Some(given) => R::from_f64(given),
            None => mass[j].clone() * &length[j] * &length[j] / &R::from_f64(12.0),
        };
        let cart_kg = chain.cart.mass_kg.unwrap_or_default();
        let axial = |i: usize| R::from_f64(chain.links[i].axial_inertia_kg_m2);
        let radius = |i: usize| chain.radius_m(i).map(R::from_f64);
        let of_base = |i: usize| match radius(i) {
            None => mass[i].clone(),
            Some(r) => mass[i].clone() * &r * &r + &axial(i),
        };
        let moment = |i: usize, j: usize| h(i, j) * &mass[i];
        let coupling = |i: usize, j: usize| match radius(i) {
            None => moment(i, j),
            Some(r) => moment(i, j) * &r,
        };
        let second_moments = |of_rotation: &dyn Fn(usize) -> R| {
            Matrix::from_fn(n, n, |j, k| {
                let of_rotation = if j == k { of_rotation(j) } else { R::zero() };
                (j.max(k)..n).fold(of_rotation, |sum, i| sum + &(h(i, j) * &h(i, k) * &mass[i]))
            })
        };
        let over_links = |of: &dyn Fn(usize, usize) -> R| -> Vec<R> {
            (0..n).map(|j| (j..n).fold(R::zero(), |sum, i| sum + &of(i, j))).collect()
        };
        let gravity = R::from_f64(chain.gravity_m_per_s2);
        Self {
            input: chain.input,
            total_mass: (0..n).fold(R::from_f64(cart_kg), |sum, i| sum + &of_base(i)),
            a: over_links(&coupling),
            weight: over_links(&moment).into_iter().map(|moment| gravity.clone() * &moment).collect(),
            b: second_moments(&inertia),
            turning: (!chain.base.is_cart()).then(|| second_moments(&|j| inertia(j) - &axial(j))),
            gravity,
            cart_friction: R::from_f64(chain.cart.friction_n_s_per_m),
            joint_frictions: chain
                .links
                .iter()
                .map(|link| R::from_f64(link.friction_n_m_s_per_rad))
                .collect(),
        }
    }

    /// Speed of an arm (rad/s) above which its hanging links leave the vertical, the least with
    /// `det(diag(weight) - α̇² β) = 0`; none on a cart, whose links hang at any speed.
    pub fn unstable_hanging_rad_per_s(&self) -> Option<f64> {
        let (beta, n) = (self.turning.as_ref()?, self.links());
        let scaled = Matrix::from_fn(n, n, |j, k| beta[(j, k)].to_f64() / self.weight[j].to_f64());
        let largest = eigenvalues(&scaled).ok()?.iter().map(|value| value.re).fold(0.0, f64::max);
        Some(1.0 / largest.sqrt())
    }

    /// Number of links, n.
    pub fn links(&self) -> usize {
        self.a.len()
    }

    /// `Σ_jk β_jk sin φ_j sin φ_k` at the absolute angles `phi` (kg·m²): what links that lean add to the inertia of
    /// their arm.
    fn inertia_of_leaning(&self, phi: &[R]) -> R {
        let Some(beta) = &self.turning else { return R::zero() };
        let sines: Vec<R> = phi.iter().map(Real::sin).collect();
        let each = (0..self.links()).flat_map(|j| (0..self.links()).map(move |k| (j, k)));
        each.fold(R::zero(), |sum, (j, k)| sum + &(beta[(j, k)].clone() * &sines[j] * &sines[k]))
    }

    /// The mass matrix in `x, φ_1, …, φ_n` at the absolute angles `phi` (n entries, rad): (n+1)×(n+1),
    ///
    /// ```text
    /// [ M_t             -a_k cos φ_k           ]
    /// [ -a_j cos φ_j    b_jk cos(φ_j - φ_k)    ]
    /// ```
    ///
    /// On an arm, its first entry is larger by `Σ_jk β_jk sin φ_j sin φ_k`.
    /// Its first row is 1, 0, … if the drive imposes the cart's acceleration.
    ///
    /// # Panics
    /// If `phi` has fewer than n entries.
    pub fn mass_matrix(&self, phi: &[R]) -> Matrix<R> {
        let coupling = |j: usize| -(phi[j].cos() * &self.a[j]);
        let is_imposed = self.input == CartInput::Acceleration;
        Matrix::from_fn(self.links() + 1, self.links() + 1, |row, column| match (row, column) {
            (0, 0) if is_imposed => R::one(),
            (0, _) if is_imposed => R::zero(),
            (0, 0) => self.total_mass.clone() + &self.inertia_of_leaning(phi),
            (0, j) | (j, 0) => coupling(j - 1),
            (j, k) => (phi[j - 1].clone() - &phi[k - 1]).cos() * &self.b[(j - 1, k - 1)],
        })
    }
}
