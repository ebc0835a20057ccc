//! Solves a collection of Riccati problems with known answers and counts the correctly rounded gains.
//!
//! ```sh
//! cargo run --release -p upright-design --example riccati_collection -- COLLECTION.json …
//! ```
//!
//! A collection is a JSON array of objects with `id`, matrices `A`, `B`, `Q`, `R` as arrays of rows, an optional `S`
//! (its presence makes the problem a sampled one), the known gain `K` (computed with 1000 bits), and `degenerate` for
//! problems whose closed loop lies on the stability boundary. Exit status 1 if the gain of any non-degenerate problem
//! is not correctly rounded.

use std::process::ExitCode;
use std::time::Instant;

use serde::Deserialize;
use upright_design::design::{Cost, NoStabilisingSolution, care, dare};
use upright_design::numerics::{Matrix, Wide, with_precision};

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct Problem {
    #[serde(rename = "id")]
    id: String,
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    q: Vec<Vec<f64>>,
    r: Vec<Vec<f64>>,
    s: Option<Vec<Vec<f64>>>,
    k: Vec<Vec<f64>>,
    #[serde(rename = "degenerate", default)]
    degenerate: bool,
}

impl Problem {
    fn gain(&self) -> Result<Vec<Vec<f64>>, NoStabilisingSolution> {
        let matrix = |rows: &Vec<Vec<f64>>| Matrix::<Wide>::from_f64_rows(rows);
        let (a, b) = (matrix(&self.a), matrix(&self.b));
        let mut cost = Cost::new(matrix(&self.q), matrix(&self.r));
        let regulator = match &self.s {
            Some(s) => {
                cost.s = matrix(s);
                dare(&a, &b, &cost)
            }
            None => care(&a, &b, &cost),
        }?;
        Ok(regulator.k.round_to_f64_rows())
    }

    /// The known gain. Entries below `2^-960` of the largest are the rounding error of a calculation with 1000 bits:
    /// the answer there is zero.
    fn known_gain(&self) -> Vec<Vec<f64>> {
        let largest = self.k.iter().flatten().fold(0.0f64, |largest, entry| largest.max(entry.abs()));
        let noise = largest * 2f64.powi(-960);
        self.k
            .iter()
            .map(|row| row.iter().map(|&entry| if entry.abs() < noise { 0.0 } else { entry }).collect())
            .collect()
    }

    /// Doubles the precision until two in a row round to the same gain; returns it with the lower of the two
    /// precisions (bits).
    fn certified_gain(&self) -> Result<(Vec<Vec<f64>>, usize), NoStabilisingSolution> {
        let mut before = Err(NoStabilisingSolution);
        for bits in [256, 512, 1024, 2048] {
            let gain = with_precision(bits, || self.gain());
            if gain.is_ok() && gain == before {
                return gain.map(|gain| (gain, bits / 2));
            }
            before = gain;
        }
        Err(NoStabilisingSolution)
    }
}

fn main() -> ExitCode {
    let files: Vec<String> = std::env::args().skip(1).collect();
    if files.is_empty() {
        eprintln!("usage: riccati_collection COLLECTION.json …");
        return ExitCode::from(2);
    }
    let (mut right, mut wanted) = (0, 0);
    for file in &files {
        let problems: Vec<Problem> = match std::fs::read_to_string(file)
            .map_err(|e| e.to_string())
            .and_then(|text| serde_json::from_str(&text).map_err(|e| e.to_string()))
        {
            Ok(problems) => problems,
            Err(error) => {
                eprintln!("{file}: {error}");
                return ExitCode::from(2);
            }
        };
        for problem in &problems {
            let start = Instant::now();
            let result = problem.certified_gain();
            let known = problem.known_gain();
            let verdict = match &result {
                Ok((gain, bits)) if *gain == known => format!("correctly rounded at {bits} bits"),
                Ok((_, bits)) => format!("WRONG at {bits} bits"),
                Err(error) => error.to_string(),
            };
            let correct = matches!(&result, Ok((gain, _)) if *gain == known);
            if problem.degenerate {
                println!("{:12} degenerate: {verdict}", problem.id);
            } else {
                wanted += 1;
                right += usize::from(correct);
                let (n, m) = (problem.a.len(), problem.r.len());
                println!(
                    "{:12} n = {n:2}, m = {m:2}: {verdict} ({:.2} s)",
                    problem.id,
                    start.elapsed().as_secs_f64()
                );
            }
        }
    }
    println!("{right} of {wanted} gains correctly rounded");
    if right == wanted { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
