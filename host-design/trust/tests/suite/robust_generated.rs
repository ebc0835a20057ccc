//! `upright robust` on rigs that are not in the repository: it ends with a choice that survives the tolerances, or
//! with a reason.

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright_design::design::continuous_plant;
use upright_design::numerics::{Complex, eigenvalues};
use upright_design::rig::Rig;
use upright_trust::robust::{Choice, JudgeSettings, Judgement, RobustError, choose};

/// Friction of a joint over the weight of a link times its length, for 1 to 5 links: about what such a chain
/// survives.
const FRICTION: [f64; 5] = [4e-3, 4e-4, 1e-4, 3e-5, 1e-5];

struct Random(Pcg64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    fn one_of(&mut self, values: [f64; 3]) -> f64 {
        values[self.0.random_range(0..3)]
    }
}

fn list(count: usize, of: impl Fn(usize) -> f64) -> String {
    (0..count).map(|index| format!("{:.3e}", of(index))).collect::<Vec<_>>().join(", ")
}

/// The text of a rig with `links` links: with a long rail and a strong motor, or a short rail and a weak motor. The far
/// poles are 1.1 to 1.6 times the plant's own, mirrored.
fn generated(links: usize, is_short: bool) -> String {
    let mut random = Random(Pcg64::seed_from_u64(2 * links as u64 + u64::from(is_short)));
    let (rail_m, force_n) = match is_short {
        true => (random.between(0.15, 0.25), random.between(4.0, 8.0)),
        false => (random.between(0.5, 1.0), random.between(15.0, 40.0)),
    };
    let period_s = random.one_of([5e-4, 1e-3, 2e-3]);
    let mut text = format!(
        "name = \"generated-{links}-{}\"\n\n[cart]\nmass_kg = {:.3}\nfriction_n_s_per_m = {:.2}\n\
         travel_m = [-{rail_m:.3}, {rail_m:.3}]\nencoder_step_m = 2e-5\n",
        if is_short { "short" } else { "long" },
        random.between(0.2, 0.8),
        random.between(0.0, 3.0),
    );
    let mut torque_n_m = 0.0;
    for _ in 0..links {
        let (mass_kg, length_m) = (random.between(0.05, 0.2), random.between(0.08, 0.3));
        torque_n_m += 9.81 * mass_kg * length_m / links as f64;
        text += &format!(
            "\n[[link]]\nmass_kg = {mass_kg:.3}\nlength_m = {length_m:.3}\nencoder_counts_per_rev = {}\n",
            random.one_of([8192.0, 16384.0, 32768.0]),
        );
    }
    text += &format!(
        "\n[actuator]\nforce_limit_n = {force_n:.1}\n\n[tick]\nperiod_s = {period_s}\n\n\
         [lqr]\nstate_weights = [{}]\nforce_weight = 0.1\n\n\
         [kalman]\nforce_noise_n2_s = {:.3e}\njoint_noise = [{}]\n\n\
         [robust]\nmass_percent = {}\njoint_friction_n_m = {:.2e}\n",
        list(2 * links + 2, |state| if state % 2 == 0 { 100.0 } else { 1.0 }),
        (0.005 * force_n).powi(2) * period_s,
        list(links, |_| (1e-3 * torque_n_m).powi(2) * period_s),
        if links < 4 { 5 } else { 2 },
        FRICTION[links - 1] * torque_n_m,
    );
    let own = eigenvalues(&continuous_plant::<f64>(&rig(&text)).unwrap().a).unwrap();
    let mut distances: Vec<f64> = own.iter().map(Complex::modulus).collect();
    distances.sort_by(f64::total_cmp);
    let faster = random.between(1.1, 1.6);
    let far = list(2 * links, |index| -faster * distances[index + 2]);
    let settling_s = random.between(3.0, 5.0);
    text + &format!(
        "\n[pole_placement]\novershoot_percent = 2\nsettling_time_s = {settling_s:.1}\nfar_poles = [{far}]\n"
    )
}

fn rig(text: &str) -> Rig {
    Rig::from_toml(text, Path::new("generated.toml")).unwrap()
}

/// The outcome with the friction of the file times `friction`: a choice that survives, or the reason, which contains a
/// number.
fn outcome(text: &str, friction: f64) -> Result<Choice, String> {
    let rig = rig(text);
    let mut tolerances = rig.robust.clone().unwrap();
    tolerances.joint_friction_n_m *= friction;
    let settings = JudgeSettings { runs: 1, duration_s: 10.0, ..JudgeSettings::of(&rig) };
    match choose(&rig, &tolerances, &settings, false, &|_| ()) {
        Ok((choice, _)) => {
            assert!(choice.laws.len() == 2 && choice.laws.iter().all(|law| law.judgement.survives()));
            Ok(choice)
        }
        Err(RobustError::Unhelped(reason)) => {
            assert!(
                reason.contains("within reach") && reason.contains(|c: char| c.is_ascii_digit()),
                "{reason}"
            );
            Err(reason)
        }
        Err(error) => panic!("{}: {error}", rig.name),
    }
}

#[test]
fn a_generated_rig_gets_a_choice_or_a_reason() {
    let (one, two) = (generated(1, false), generated(2, false));
    for (links, text) in [(1, &one), (2, &two)] {
        let chosen = outcome(text, 1.0).unwrap_or_else(|reason| panic!("{links} links: {reason}"));
        let survived = |law: &Judgement| law.corners == Some([2 << links, 2 << links]);
        assert!(chosen.laws.iter().all(|law| survived(&law.judgement)));
    }
    // Ten times the friction.
    let reason = outcome(&one, 10.0).unwrap_err();
    assert!(reason.contains("loops survives friction"), "{reason}");
}
