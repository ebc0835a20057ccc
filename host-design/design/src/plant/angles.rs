//! Link angles from the vertical, from joint angles.

use core::f64::consts::TAU;

/// The n angles of a chain's links from the vertical, `φ_i = θ_1 + … + θ_i` (rad), from the state `x, ẋ, θ_1, θ̇_1, …`
/// (2n + 2 entries) with angles relative to the link below.
pub fn absolute_angles(state: &[f64]) -> impl Iterator<Item = f64> + '_ {
    let joints = state.as_chunks::<2>().0.get(1..).unwrap_or_default();
    joints.iter().scan(0.0, |angle, [relative, _]| {
        *angle += relative;
        Some(*angle)
    })
}

/// The multiple of 2π that is nearest to an angle (rad).
pub fn whole_turns(angle: f64) -> f64 {
    TAU * libm::round(angle / TAU)
}

/// The state of a chain with whole turns removed from the joint angles, so that each is within half a turn of 0.
pub fn without_turns(state: &[f64]) -> Vec<f64> {
    let mut state = state.to_vec();
    for angle in state.iter_mut().skip(2).step_by(2) {
        *angle -= whole_turns(*angle);
    }
    state
}

#[cfg(test)]
mod tests {
    use super::absolute_angles;

    #[test]
    fn each_angle_is_the_sum_of_those_up_to_its_link() {
        let angles: Vec<f64> = absolute_angles(&[9.0, 9.0, 0.25, 9.0, -0.5, 9.0, 1.0, 9.0]).collect();
        assert_eq!(angles, [0.25, -0.25, 0.75]);
        assert_eq!(absolute_angles(&[1.0, 2.0]).count(), 0);
    }
}
