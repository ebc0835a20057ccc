//! What a board can do for a rig, checked before the compiler is started, whose errors name lines of the image.

use upright::boards::parts::PartInterface;
use upright::boards::rp::RpChip;
use upright::boards::wiring::Signal;
use upright::boards::{BoardRow, Family, PULSES_HZ, f4};
use upright::table::{SensorRow, StepMap};
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use super::error::{BuildError, MOST_PERCENT};

/// Longest tick of a Pico in cycles while a rig of one to four links balances or rests, as measured in the emulator.
pub const PICO_BALANCING_CYCLES: [u32; 4] = [15_000, 21_000, 27_000, 34_500];
/// The same while it follows a motion.
pub const PICO_MOTION_CYCLES: [u32; 4] = [30_000, 44_000, 60_000, 83_000];
/// Cycles by which a tick is longer that reads sensors on two wires.
pub const PICO_READING_CYCLES: u32 = 12_500;

/// Checks what the board can do for this rig, as far as that is known before it is designed.
///
/// # Errors
/// [`BuildError`] if the board counts too few encoders, or cannot make the tick.
pub fn check_rig(board: &'static BoardRow, rig: &Rig) -> Result<(), BuildError> {
    counts(board, rig.sensors().len())?;
    makes_tick(board, rig.tick.period_s)
}

/// Checks what the board can do with this table.
///
/// # Errors
/// [`BuildError`] as for [`check_rig`], or if the drive takes too many pulses, the board does not read one of the
/// sensors, or ticks would take too long.
pub fn check_table(board: &'static BoardRow, table: &TableValues) -> Result<(), BuildError> {
    let tick_s = f64::from(table.tick_s);
    counts(board, table.sensors())?;
    makes_tick(board, tick_s)?;
    gives_pulses(board, tick_s, table.drive.pulses())?;
    reads_all(board, table)?;
    let is_on_two_wires = |row: &SensorRow| matches!(row.kind.interface(), Some(PartInterface::TwoWires(_)));
    let reading = if table.rows().iter().any(is_on_two_wires) { PICO_READING_CYCLES } else { 0 };
    has_time(board, table.sensors(), tick_s, table.swing_up.is_some(), reading)
}

pub(super) fn counts(board: &'static BoardRow, needed: usize) -> Result<(), BuildError> {
    if needed > board.encoders() { Err(BuildError::Encoders { board, needed }) } else { Ok(()) }
}

pub(super) fn makes_tick(board: &'static BoardRow, tick_s: f64) -> Result<(), BuildError> {
    let [shortest_us, longest_us] = board.tick_us().map(f64::from);
    // A table has the tick as f32.
    let is_possible = (shortest_us * (1.0 - 1e-6)..=longest_us * (1.0 + 1e-6)).contains(&(tick_s * 1e6));
    if is_possible { Ok(()) } else { Err(BuildError::Tick { board, tick_s }) }
}

/// A tick may have a pulse more than its speed needs, because positions are rounded.
fn gives_pulses(board: &'static BoardRow, tick_s: f64, steps: Option<&StepMap>) -> Result<(), BuildError> {
    let most = (f64::from(board.pulses() - 1) / tick_s).min(PULSES_HZ.into());
    let rate = steps.map_or(0.0, |steps| f64::from(steps.speed_limit_m_per_s) / f64::from(steps.step_m));
    if rate > most { Err(BuildError::Pulses { board, most, rate }) } else { Ok(()) }
}

/// Whether the board has the wires for sensors of this kind.
fn has_wires(board: &BoardRow, interface: PartInterface) -> bool {
    let is_on_two_wires = matches!(interface, PartInterface::TwoWires(_));
    let wanted = if is_on_two_wires { Signal::AngleClock } else { Signal::AngleSelect };
    match &board.family {
        Family::F4(board) => board.wiring.iter().any(|wire| wire.signal == wanted),
        Family::Rp(_) => is_on_two_wires,
    }
}

/// Checks that the board reads the absolute sensors of the table's rig, if it has any. Those on the bus are of one
/// kind.
fn reads_all(board: &'static BoardRow, table: &TableValues) -> Result<(), BuildError> {
    let mut on_bus: Option<(PartInterface, usize)> = None;
    for (sensor, row) in table.rows().iter().enumerate() {
        let (Some(interface), Some(reading)) = (row.kind.interface(), row.kind.reading()) else { continue };
        if !has_wires(board, interface) {
            return Err(BuildError::AbsoluteSensor { sensor });
        }
        match interface {
            PartInterface::Analog if sensor != 1 || reading.bits != f4::WIPER_BITS => {
                return Err(BuildError::Potentiometer { board, link: sensor });
            }
            PartInterface::Frames if reading.bits != f4::ANGLE_BITS => {
                return Err(BuildError::AngleBits { board, sensor });
            }
            PartInterface::Analog => {}
            PartInterface::Frames | PartInterface::TwoWires(_) => match on_bus {
                Some((other, first)) if other != interface => {
                    return Err(BuildError::DifferentParts { board, sensors: [first, sensor] });
                }
                _ => on_bus = Some((interface, sensor)),
            },
        }
    }
    Ok(())
}

/// Checks the ticks of a Pico, which has no floating-point unit. With one, the longest tick has 7,700 instructions
/// (docs/results/chips.md), and the ticks of boards that the virtual board stands for are measured there.
fn has_time(
    board: &'static BoardRow,
    sensors: usize,
    tick_s: f64,
    has_motions: bool,
    reading: u32,
) -> Result<(), BuildError> {
    let Family::Rp(rp) = &board.family else { return Ok(()) };
    if rp.chip != RpChip::Rp2040 {
        return Ok(());
    }
    let clock_hz = f64::from(rp.chip.clock_hz());
    let links = sensors.saturating_sub(2).min(PICO_BALANCING_CYCLES.len() - 1);
    let fits = |cycles: u32| f64::from(cycles) <= clock_hz * tick_s * MOST_PERCENT / 1e2;
    let [balancing, motion] =
        [PICO_BALANCING_CYCLES[links], PICO_MOTION_CYCLES[links]].map(|cycles| cycles + reading);
    if !fits(balancing) {
        let remedy = "make tick.period_s longer, or use another board";
        return Err(BuildError::Cycles {
            what: "that balances",
            cycles: balancing,
            clock_hz,
            tick_s,
            remedy,
        });
    }
    if has_motions && !fits(motion) {
        let remedy = "make tick.period_s longer, use another board, or leave the motions out (--no-motions)";
        return Err(BuildError::Cycles {
            what: "that follows a motion",
            cycles: motion,
            clock_hz,
            tick_s,
            remedy,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use upright::boards::named;

    /// A drive of 20 pulses per mm with this speed limit, in ticks of 10 ms.
    fn stepper(speed_limit_m_per_s: f32) -> StepMap {
        StepMap {
            step_m: 5e-5,
            acceleration_limit_m_per_s2: 8.0,
            speed_limit_m_per_s,
            lag_s: 0.0,
            lead_s: 5e-3,
        }
    }

    #[test]
    fn what_the_board_cannot_do_is_refused_before_the_compiler_is_started() {
        let feather = named("feather-f405").unwrap();
        for tick_s in [0.05, 1.1e-4] {
            let refused = makes_tick(feather, tick_s).unwrap_err().to_string();
            let tick = format!("0.12 to 33 ms, and this rig's is {} ms", tick_s * 1e3);
            assert!(refused.starts_with("feather-f405") && refused.contains(&tick), "{refused}");
        }
        assert!(counts(feather, 3).unwrap_err().to_string().contains("counts 2 encoders"));
        // As in the rig file, and as rounded in the table.
        for tick_s in [1.2e-4, f64::from(1.2e-4_f32), 1e-3, 0.033, f64::from(0.033_f32)] {
            assert!(makes_tick(feather, tick_s).is_ok(), "{tick_s}");
        }
        let refused = |board, tick_s, speed| {
            gives_pulses(board, tick_s, Some(&stepper(speed))).unwrap_err().to_string()
        };
        assert!(gives_pulses(feather, 1e-2, Some(&stepper(1.2))).is_ok());
        let too_many = refused(feather, 1e-2, 1.3);
        assert!(too_many.contains("25500 step pulses") && too_many.contains("26000"), "{too_many}");
        assert!(refused(feather, 1e-3, 10.5).contains("200000 step pulses"));
        let pico = named("pico").unwrap();
        assert!(gives_pulses(pico, 1e-2, Some(&stepper(5.0))).is_ok());
        let fast = refused(pico, 1e-2, 15.0);
        assert!(fast.contains("200000 step pulses") && fast.contains("300000"), "{fast}");
        assert!(refused(pico, 0.1, 5.0).contains("40950 step pulses"));
    }

    #[test]
    fn what_a_pico_cannot_do_is_refused_with_the_numbers() {
        let [pico, pico2] = ["pico", "pico2"].map(|name| named(name).unwrap());
        assert!(counts(pico, 6).unwrap_err().to_string().starts_with("pico counts 5 encoders"));
        assert!(makes_tick(pico, 2e-4).unwrap_err().to_string().contains("0.5 to 100 ms"));
        for (board, sensors, tick_s, has_motions) in [
            (pico, 5, 1e-3, false),
            (pico, 2, 2e-3, true),
            (pico, 5, 1e-3, true),
            (pico, 5, 5e-4, false),
            (pico2, 5, 7e-4, true),
        ] {
            assert!(has_time(board, sensors, tick_s, has_motions, 0).is_ok(), "{board} {sensors} {tick_s}");
        }
        let four_links = has_time(pico, 5, 7e-4, true, 0).unwrap_err().to_string();
        assert!(four_links.contains("83000 cycles") && four_links.contains("95 %"), "{four_links}");
        assert!(four_links.contains("--no-motions"), "{four_links}");
        // Sensors on two wires take as long as half a link.
        assert!(has_time(pico, 2, 2.5e-4, false, 0).is_ok());
        let slow = has_time(pico, 2, 2.5e-4, false, PICO_READING_CYCLES).unwrap_err().to_string();
        assert!(slow.contains("27500 cycles"), "{slow}");
    }
}
