//! The image for a Raspberry Pi Pico, which is a crate of its own: `boards/rp2040/`.

use std::path::{Path, PathBuf};

use upright_design::rig::Rig;
use upright_design::table::{TableValues, gains_source, write_atomically};

use super::build::{images, one_at_a_time};
use super::compiler::{Compiler, compiler_for_chips};
use super::error::BuildError;
use super::uf2::uf2;
use crate::project::checkout;

/// The target of the RP2040: Cortex-M0+.
const TARGET: &str = "thumbv6m-none-eabi";
/// Processor clock (Hz).
const CLOCK_HZ: f64 = 125e6;
/// Encoders that it counts.
pub const PICO_ENCODERS: usize = 5;
/// Shortest and longest tick (s).
pub const PICO_TICK_S: [f64; 2] = [0.000_5, 0.1];

/// Longest tick in cycles, by the number of links from one to four, while the rig balances and while a motion is
/// followed; docs/pico.md says how they were measured.
const BALANCING_CYCLES: [u32; 4] = [21_500, 34_000, 48_000, 64_000];
const MOTION_CYCLES: [u32; 4] = [56_000, 90_000, 136_000, 190_000];
/// Largest share of a period that a tick may take (%).
const MOST_PERCENT: f64 = 75.0;

/// The files of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PicoImage {
    /// For a debugger.
    pub elf: PathBuf,
    /// For the drive that a Pico shows while BOOTSEL is held.
    pub uf2: PathBuf,
}

/// Why a Pico cannot run a rig.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum PicoError {
    /// Too many encoders.
    #[error(
        "pico counts {PICO_ENCODERS} encoders, and this rig has {0}: use another board (`upright firmware boards`)"
    )]
    Encoders(usize),
    /// A tick that it cannot make.
    #[error("pico makes ticks of 0.5 to 100 ms, and this rig's is {} ms: change tick.period_s", .0 * 1e3)]
    Tick(f64),
    /// A tick that takes too long.
    #[error(
        "a tick {what} takes up to {cycles} cycles on a pico, {:.2} ms at 125 MHz: {:.0} % of this rig's {} ms, and {MOST_PERCENT} % \
         is the most: {remedy}",
        f64::from(*cycles) / CLOCK_HZ * 1e3, f64::from(*cycles) / CLOCK_HZ / tick_s * 1e2, tick_s * 1e3
    )]
    Cycles {
        /// What the firmware does in it.
        what: &'static str,
        /// Cycles of the longest tick.
        cycles: u32,
        /// The rig's tick (s).
        tick_s: f64,
        /// What to do.
        remedy: &'static str,
    },
}

/// Builds the image with the table of `rig`.
///
/// # Errors
/// [`BuildError`] if a Pico cannot run this rig, there is no compiler, or it fails.
pub fn build_pico(rig: &Rig, table: &TableValues) -> Result<PicoImage, BuildError> {
    check(table.sensors(), rig.tick.period_s, table.swing_up.is_some())?;
    let name = format!(
        "pico-{:016x}-{:08x}-{:08x}",
        rig.hash(),
        table.crc(),
        table.swing_up_crc().unwrap_or_default()
    );
    let gains = images()?.join(format!("{name}.rs"));
    // An included file cannot have module documentation.
    let source = gains_source(rig, table).replace("//!", "//");
    if std::fs::read_to_string(&gains).ok().as_ref() != Some(&source) {
        write_atomically(&gains, source.as_bytes())?;
    }
    let _others_wait = one_at_a_time()?;
    let bytes = compiled(&gains)?;
    let image =
        PicoImage { elf: images()?.join(format!("{name}.elf")), uf2: images()?.join(format!("{name}.uf2")) };
    write_atomically(&image.elf, &bytes)?;
    write_atomically(&image.uf2, &uf2(&image.elf, &bytes)?)?;
    Ok(image)
}

/// Compiles the image; returns the ELF file.
fn compiled(gains: &Path) -> Result<Vec<u8>, BuildError> {
    let Compiler { program, mut cargo, target_directory, .. } = compiler_for_chips(&[TARGET])?;
    cargo.current_dir(checkout()?.join("boards/rp2040")).env("UPRIGHT_GAINS", gains);
    cargo.args(["build", "--quiet", "--release", "--locked", "--target", TARGET]);
    let output = cargo.output().map_err(|source| BuildError::Start(program, source))?;
    if !output.status.success() {
        return Err(BuildError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let path = target_directory.join(TARGET).join("release/upright-rp2040");
    std::fs::read(&path).map_err(|source| BuildError::File { path, source })
}

/// Checks what a Pico can do before the compiler is started.
fn check(sensors: usize, tick_s: f64, has_motions: bool) -> Result<(), PicoError> {
    if sensors > PICO_ENCODERS {
        return Err(PicoError::Encoders(sensors));
    }
    if !(PICO_TICK_S[0] * (1.0 - 1e-6)..=PICO_TICK_S[1] * (1.0 + 1e-6)).contains(&tick_s) {
        return Err(PicoError::Tick(tick_s));
    }
    let links = sensors.saturating_sub(2).min(BALANCING_CYCLES.len() - 1);
    let fits = |cycles: u32| f64::from(cycles) <= CLOCK_HZ * tick_s * MOST_PERCENT / 1e2;
    let (balancing, motion) = (BALANCING_CYCLES[links], MOTION_CYCLES[links]);
    if !fits(balancing) {
        let remedy = "make tick.period_s longer, or use another board";
        return Err(PicoError::Cycles { what: "that balances", cycles: balancing, tick_s, remedy });
    }
    if has_motions && !fits(motion) {
        let remedy = "make tick.period_s longer, use another board, or leave the motions out (--no-motions)";
        return Err(PicoError::Cycles { what: "that follows a motion", cycles: motion, tick_s, remedy });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_pico_cannot_do_is_refused_with_the_numbers() {
        assert_eq!(check(5, 1e-3, false), Ok(()));
        assert_eq!(check(2, 2e-3, true), Ok(()));
        let refused = |sensors, tick_s, motions| check(sensors, tick_s, motions).unwrap_err().to_string();
        assert!(refused(6, 1e-3, false).contains("counts 5 encoders"));
        assert!(refused(2, 2e-4, false).contains("0.5 to 100 ms"));
        let four_links = refused(5, 1e-3, true);
        assert!(four_links.contains("190000 cycles") && four_links.contains("152 %"), "{four_links}");
        assert!(four_links.contains("--no-motions"), "{four_links}");
        assert!(refused(5, 6e-4, false).contains("that balances"));
    }
}
