//! Takes the gain table in the file that UPRIGHT_GAINS names, as `upright design RIG --out FILE` writes it.

use std::path::PathBuf;

fn main() {
    let variable = |name: &str| std::env::var(name).unwrap_or_else(|_| panic!("{name} is not set"));
    println!("cargo::rerun-if-env-changed=UPRIGHT_GAINS");
    let gains = variable("UPRIGHT_GAINS");
    println!("cargo::rerun-if-changed={gains}");
    let source =
        std::fs::read_to_string(&gains).unwrap_or_else(|error| panic!("UPRIGHT_GAINS: {gains}: {error}"));
    // An included file cannot have module documentation.
    let included = PathBuf::from(variable("OUT_DIR")).join("gains.rs");
    std::fs::write(included, source.replace("//!", "//")).expect("OUT_DIR can be written");
}
