//! The virtual board as one of the boards.

use std::sync::LazyLock;

use upright::boards::f4::{F4Board, F4Chip, HseSource};
use upright::boards::wiring::{Signal, Wire, wire_of};
use upright::boards::{BOARDS, BoardRow, Family};
use upright_board::{BoardWiring, Chip, Conditions, Pin, pin};

use super::error::BuildError;

/// Conditions of the virtual board as this board, at typical values; `seed` determines everything random.
///
/// # Errors
/// [`BuildError::NotVirtual`] if it does not stand for a board of this family.
pub fn conditions(board: &'static BoardRow, seed: u64) -> Result<Conditions, BuildError> {
    static WIRINGS: LazyLock<Vec<Option<BoardWiring>>> = LazyLock::new(|| {
        let wiring = |board: &'static BoardRow| match &board.family {
            Family::F4(board) => Some(wiring(board)),
            Family::Rp(_) => None,
        };
        BOARDS.iter().map(wiring).collect()
    });
    let row = BOARDS.iter().position(|row| row == board);
    let (Family::F4(f4), Some(wiring)) = (&board.family, row.and_then(|row| WIRINGS[row].as_ref())) else {
        return Err(BuildError::NotVirtual { board });
    };
    let chip = match f4.chip {
        F4Chip::F405 => Chip::F405,
        F4Chip::F407 => Chip::F407,
        F4Chip::F446 => Chip::F446,
    };
    let mut conditions = Conditions { wiring, chip_v: f4.reference_v, ..Conditions::typical(chip, seed) };
    conditions.crystal.hz = f4.crystal_hz;
    conditions.crystal.is_clock_input = f4.sources.first() == Some(&HseSource::Clock);
    Ok(conditions)
}

/// The wiring of a board.
fn wiring(board: &'static F4Board) -> BoardWiring {
    let wire = |signal| wire_of(board.wiring, signal);
    let at = |signal| pin_of(wire(signal));
    let is_there = |wanted| board.wiring.iter().any(|wire| wire.signal == wanted);
    let encoders: Vec<(Pin, Pin)> = (0..)
        .take_while(|&sensor| is_there(Signal::Encoder(sensor, b'A')))
        .map(|sensor| (at(Signal::Encoder(sensor, b'A')), at(Signal::Encoder(sensor, b'B'))))
        .collect();
    let angle_bus = is_there(Signal::AngleSelect)
        .then(|| [Signal::AngleSelect, Signal::AngleClock, Signal::AngleCommand].map(at));
    let supply = wire(Signal::Supply).function.strip_prefix("ADC1_IN").and_then(|number| number.parse().ok());
    // The pins PA0 to PA7 are the channels 0 to 7 of the converter.
    let wiper = wire(Signal::Encoder(1, b'B'));
    let wiper_channel = (wiper.port == b'A' && wiper.pin < 8).then_some(wiper.pin.into());
    BoardWiring {
        encoders: encoders.leak(),
        angle_bus,
        pwm: at(Signal::Pwm),
        direction: at(Signal::Direction),
        enable: at(Signal::Enable),
        driver_fault: at(Signal::DriverFault),
        emergency_stop: at(Signal::EmergencyStop),
        limits: [Signal::LimitLow, Signal::LimitHigh].map(at),
        tick: at(Signal::Tick),
        receive: at(Signal::Receive),
        usart: wire(Signal::Receive).number("USART"),
        supply_channel: supply.unwrap_or_default(),
        wiper_channel,
        supply_divider: board.supply_divider,
        reference_v: board.reference_v,
    }
}

fn pin_of(wire: Wire) -> Pin {
    pin(char::from(wire.port), wire.pin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use upright::boards::{DEFAULT_BOARD, named};

    #[test]
    fn the_virtual_board_is_wired_as_the_row_says() {
        assert_eq!(conditions(DEFAULT_BOARD, 1).unwrap(), Conditions::f405(1));
        let feather = conditions(named("feather-f405").unwrap(), 1).unwrap();
        assert_eq!((feather.wiring.usart, feather.wiring.pwm), (3, pin('B', 13)));
        assert_eq!((feather.wiring.encoders.len(), feather.wiring.angle_bus), (2, None));
        let pico = conditions(named("pico").unwrap(), 1).unwrap_err().to_string();
        assert!(pico.contains("pico") && pico.contains("weact-f405"), "{pico}");
    }
}
