//! What a tick with 30 states costs on the virtual board: `cargo bench -p upright-tool --bench thirty_states`. Fails if
//! it takes more than a quarter of its period. The design takes half a minute.

use upright::boards::DEFAULT_BOARD;
use upright::table::Law;
use upright_board::{Conditions, Image};
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_tool::image::build_for;
use upright_tool::in_the_loop::measure;

/// A linear model of 30 states, the most that a table holds: a cart and 14 oscillators, two of them measured.
fn thirty_states() -> Rig {
    let (states, mut a) = (30, vec![vec![0.0; 30]; 30]);
    a[0][1] = 1.0;
    for state in (2..states).step_by(2) {
        let rate = 2.0 + state as f64 / 2.0;
        a[state][state + 1] = 1.0;
        (a[state + 1][state], a[state + 1][state + 1]) = (-rate * rate, -0.2 * rate);
    }
    let b: Vec<f64> = (0..states).map(|state| [0.0, if state == 1 { 1.0 } else { 0.3 }][state % 2]).collect();
    let text = format!(
        "name = \"thirty-states\"\n[model]\na = {a:?}\nb = {b:?}\nmeasured = [0, 2]\nmeasured_steps = [1e-4, 1e-4]\n\
         [actuator]\nforce_limit_n = 20\n[lqr]\nstate_weights = {:?}\nforce_weight = 1\n\
         [kalman]\nforce_noise_n2_s = 1e-5\n",
        vec![1.0; states]
    );
    Rig::from_toml(&text, "thirty-states.toml".as_ref()).unwrap()
}

fn main() {
    let rig = thirty_states();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    assert_eq!(table.states(), 30);
    let built = build_for(DEFAULT_BOARD, &rig, &table).unwrap();
    let image = Image::from_elf(&std::fs::read(built.elf).unwrap()).unwrap();
    let scenario = Scenario { duration_s: 0.5, force_noise_n: 0.1, ..Scenario::at_rest(&rig, Law::Lqr) };
    let cycles = measure(&rig, &table, &scenario, &image, &Conditions::f405(1)).unwrap();
    println!("{cycles:#?}");
    assert_eq!((cycles.ended.as_deref(), cycles.check()), (None, Ok(())));
    assert!(cycles.balancing.unwrap().ticks >= 500);
}
