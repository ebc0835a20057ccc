//! What a Raspberry Pi Pico and a Pico 2 can do.

use upright::table::StepMap;

use super::pico_board::PicoBoard;

/// Processor clock of a Pico (Hz).
const CLOCK_HZ: f64 = 125e6;
/// Encoders that both count.
pub const PICO_ENCODERS: usize = 5;
/// Shortest and longest tick (s).
pub const PICO_TICK_S: [f64; 2] = [0.000_5, 0.1];

/// Most step pulses in a tick, and in a second: a driver needs 2.5 µs from a change of direction to a pulse.
const PULSES: [f64; 2] = [4096.0, 200e3];

/// Longest tick in cycles while a rig of one to four links balances or rests, as measured in the emulator.
pub const PICO_BALANCING_CYCLES: [u32; 4] = [15_000, 21_000, 27_000, 34_000];
/// The same while it follows a motion.
pub const PICO_MOTION_CYCLES: [u32; 4] = [29_500, 44_000, 60_000, 83_000];
/// Largest share of a period that a tick may take (%).
const MOST_PERCENT: f64 = 75.0;

/// Why one of the boards cannot run a rig.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum PicoError {
    /// Too many encoders.
    #[error(
        "{} counts {PICO_ENCODERS} encoders, and this rig has {needed}: use another board (`upright firmware boards`)",
        board.name()
    )]
    Encoders {
        /// Which board.
        board: PicoBoard,
        /// Number of the rig's sensors.
        needed: usize,
    },
    /// A tick that it cannot make.
    #[error(
        "{} makes ticks of 0.5 to 100 ms, and this rig's is {} ms: change tick.period_s", board.name(), tick_s * 1e3
    )]
    Tick {
        /// Which board.
        board: PicoBoard,
        /// The rig's tick (s).
        tick_s: f64,
    },
    /// A drive that takes too many pulses.
    #[error(
        "{} gives {most:.0} step pulses in a second at most, and the drive of this rig may take {rate:.0}: \
         lower actuator.step_rate_limit_hz", board.name()
    )]
    Pulses {
        /// Which board.
        board: PicoBoard,
        /// Most pulses in a second.
        most: f64,
        /// Pulses of this rig's drive in a second, at most.
        rate: f64,
    },
    /// A tick that takes a Pico too long.
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

/// Checks what the board can do before the compiler is started.
pub(super) fn check(
    board: PicoBoard,
    sensors: usize,
    tick_s: f64,
    has_motions: bool,
    steps: Option<&StepMap>,
) -> Result<(), PicoError> {
    if sensors > PICO_ENCODERS {
        return Err(PicoError::Encoders { board, needed: sensors });
    }
    if !(PICO_TICK_S[0] * (1.0 - 1e-6)..=PICO_TICK_S[1] * (1.0 + 1e-6)).contains(&tick_s) {
        return Err(PicoError::Tick { board, tick_s });
    }
    let most = PULSES[1].min((PULSES[0] - 1.0) / tick_s);
    let rate = steps.map_or(0.0, |steps| f64::from(steps.speed_limit_m_per_s) / f64::from(steps.step_m));
    if rate > most {
        return Err(PicoError::Pulses { board, most, rate });
    }
    // With a floating-point unit, the longest tick has 7,700 instructions (docs/results/chips.md), the shortest period
    // 75,000 cycles.
    if board == PicoBoard::Pico2 {
        return Ok(());
    }
    let links = sensors.saturating_sub(2).min(PICO_BALANCING_CYCLES.len() - 1);
    let fits = |cycles: u32| f64::from(cycles) <= CLOCK_HZ * tick_s * MOST_PERCENT / 1e2;
    let (balancing, motion) = (PICO_BALANCING_CYCLES[links], PICO_MOTION_CYCLES[links]);
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
pub(super) mod tests {
    use super::*;

    /// A drive of 20 pulses per mm with this speed limit, in ticks of 10 ms.
    pub(in crate::image) fn stepper(speed_limit_m_per_s: f32) -> StepMap {
        StepMap {
            step_m: 5e-5,
            acceleration_limit_m_per_s2: 8.0,
            speed_limit_m_per_s,
            lag_s: 0.0,
            lead_s: 5e-3,
        }
    }

    #[test]
    fn what_a_pico_cannot_do_is_refused_with_the_numbers() {
        assert_eq!(check(PicoBoard::Pico, 5, 1e-3, false, None), Ok(()));
        assert_eq!(check(PicoBoard::Pico, 2, 2e-3, true, None), Ok(()));
        let refused = |sensors, tick_s, motions| {
            check(PicoBoard::Pico, sensors, tick_s, motions, None).unwrap_err().to_string()
        };
        assert!(refused(6, 1e-3, false).contains("counts 5 encoders"));
        assert!(refused(2, 2e-4, false).contains("0.5 to 100 ms"));
        assert_eq!(check(PicoBoard::Pico, 5, 1e-3, true, None), Ok(()));
        let four_links = refused(5, 7e-4, true);
        assert!(four_links.contains("83000 cycles") && four_links.contains("95 %"), "{four_links}");
        assert!(four_links.contains("--no-motions"), "{four_links}");
        assert_eq!(check(PicoBoard::Pico, 5, 5e-4, false, None), Ok(()));
        assert_eq!(check(PicoBoard::Pico2, 5, 1e-3, true, None), Ok(()));
        assert_eq!(check(PicoBoard::Pico, 2, 1e-2, false, Some(&stepper(5.0))), Ok(()));
        let fast = check(PicoBoard::Pico, 2, 1e-2, false, Some(&stepper(15.0))).unwrap_err().to_string();
        assert!(fast.contains("200000 step pulses") && fast.contains("300000"), "{fast}");
        let slow_tick = check(PicoBoard::Pico, 2, 0.1, false, Some(&stepper(5.0))).unwrap_err().to_string();
        assert!(slow_tick.contains("40950 step pulses"), "{slow_tick}");
        let too_many = check(PicoBoard::Pico2, 6, 1e-3, false, None).unwrap_err().to_string();
        assert!(too_many.starts_with("pico2 counts 5 encoders"), "{too_many}");
    }
}
