//! Closes the loop on a PC: the firmware with the table of this crate, against the simulated machine of `rig.toml`.

use std::error::Error;
use std::path::Path;

use own_board::gains::{SWING_UP, TABLE};
use upright::table::Law;
use upright_design::design::design;
use upright_closed_loop::harness::{record, with_table};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};

fn main() -> Result<(), Box<dyn Error>> {
    let rig = Rig::from_path(Path::new("rig.toml"))?;
    let values = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
    let scenario = Scenario { step_m: 0.1, duration_s: 5.0, ..Scenario::at_rest(&rig, Law::Lqr) };
    // From power-up: homing, sign check, raising the link, arming, and then the step.
    let run = with_table(&TABLE, &SWING_UP, |firmware| record(&rig, &values, &scenario, firmware))??;
    println!("{} ticks, fault: {:?}", run.ticks.len(), run.fault);
    println!("cart {:.4} m from the set-point at the end", run.summary.final_error_m);
    match run.summary.fall {
        Some(fall) => Err(fall.to_string().into()),
        None => Ok(()),
    }
}
