use std::io::Write;
use std::path::Path;
use upright::control::actuator::Drive;
use upright::table::Law;
use upright_design::rig::{PerJoint, Rig};
use upright_design::simulate::{Bench, Scenario};
fn main() {
    for (name, frictions) in [
        ("quadruple-paper", [0.0, 1e-4, 3e-4]),
        ("triple-glueck-eder-kugi", [0.0, 1e-3, 8e-3]),
        ("double-quanser-dbpen", [0.0, 5e-4, 4e-3]),
        ("single-quanser-ip02", [0.0, 5e-4, 1e-2]),
    ] {
        let base = Rig::from_path(Path::new(&format!("rigs/{name}.toml"))).unwrap();
        let n = base.states() / 2 - 1;
        for f in frictions {
            let mut rig = base.clone();
            rig.reality.friction.joint_friction_n_m = PerJoint::all(f);
            for seed in 0..6u64 {
                let mut out = std::io::BufWriter::new(
                    std::fs::File::create(format!("/tmp/z/{}_{f:e}_{seed}.csv", &name[..4])).unwrap(),
                );
                let mut s = seed.wrapping_mul(0x9E3779B97F4A7C15).wrapping_add(12345);
                let mut r = || {
                    s ^= s << 13;
                    s ^= s >> 7;
                    s ^= s << 17;
                    (s >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
                };
                let mut start = vec![0.0; base.states()];
                start[2] = std::f64::consts::PI;
                for j in 0..n {
                    start[2 + 2 * j] += 0.2 * r();
                }
                let scenario = Scenario {
                    start,
                    seed,
                    force_noise_n: 0.0,
                    torque_noise_n_m: 0.0,
                    ..Scenario::at_rest(&rig, Law::Lqr)
                };
                let mut bench = Bench::new(&rig, &scenario).unwrap();
                let ticks = (20.0 / rig.tick.period_s) as usize;
                writeln!(out, "# {} {}", rig.tick.period_s, rig.sensors()[1].step::<f64>()).unwrap();
                for _ in 0..ticks {
                    bench.tick(Drive::Force(0.0));
                    for j in 0..n {
                        let a = bench.state()[2 + 2 * j] - if j == 0 { std::f64::consts::PI } else { 0.0 };
                        write!(out, "{:.7} ", a).unwrap();
                    }
                    writeln!(out).unwrap();
                }
            }
        }
    }
}
