//! The virtual board compared with the firmware on the host: from the same inputs, the same bits in every tick.

use std::collections::VecDeque;
use std::time::Duration;

use upright::board::Output;
use upright::control::actuator::Drive;
use upright_closed_loop::client::{AnyTelemetry, Client, Received};
use upright_closed_loop::harness::{HarnessError, Pace, Pins, Target};

use super::VirtualBoard;

/// PWM is inactive for this share of each period at the least, whatever the duty.
const LEAST_PAUSE: f32 = 0.02;

/// A board and the firmware in this process, which gets the inputs that the board's image has latched.
pub struct Compared<'a> {
    board: &'a mut VirtualBoard,
    host: &'a mut dyn Target,
    /// Bytes that came with the tick before.
    received: Vec<u8>,
    was_stopped: bool,
    streams: [TelemetryStream; 2],
    /// Ticks that were compared.
    pub ticks: u64,
    /// Telemetry messages that were compared.
    pub messages: u64,
}

/// Telemetry of the board or of the host.
struct TelemetryStream {
    client: Client,
    telemetry: VecDeque<AnyTelemetry>,
}

impl TelemetryStream {
    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(Received::Telemetry(telemetry)) = self.client.receive(byte, Duration::ZERO) {
                self.telemetry.push_back(telemetry);
            }
        }
    }
}

impl<'a> Compared<'a> {
    /// Compares a board and a host that have both just started.
    pub fn new(board: &'a mut VirtualBoard, host: &'a mut dyn Target) -> Self {
        let streams =
            [(); 2].map(|()| TelemetryStream { client: Client::default(), telemetry: VecDeque::new() });
        Self { board, host, received: Vec::new(), was_stopped: false, streams, ticks: 0, messages: 0 }
    }

    /// Checks that the duty at the pins is that of the host, to the timer's clock; or that as many pulses came.
    fn compare_output(&self, board: &Output, host: &Output) -> Result<(), HarnessError> {
        let stage = self.board.stage();
        if stage.enable != host.enable {
            return self
                .differs(format!("enable is {} at the pin, {} on the host", stage.enable, host.enable));
        }
        let pulses = [board.pulses(), host.pulses()];
        if pulses[0] != pulses[1] {
            return self.differs(format!("{} pulses at the pin, {} on the host", pulses[0], pulses[1]));
        }
        if !host.enable || matches!(host.drive, Drive::Steps(_)) {
            return Ok(());
        }
        let duty = host.duty;
        let period = stage.period_clocks as f32;
        let wanted = ((duty.abs() * period + 0.5) as u32).min((period * (1.0 - LEAST_PAUSE)) as u32 + 1);
        let same = stage.high_clocks.abs_diff(wanted) <= u32::from(duty.abs() >= 1.0 - LEAST_PAUSE);
        let along = stage.high_clocks == 0 || stage.along == (duty > 0.0);
        if same && along {
            Ok(())
        } else {
            self.differs(format!("a duty of {duty} on the host is {stage:?} at the pins"))
        }
    }

    /// Checks that the inputs, estimate and force in the telemetry are the same in every bit.
    fn compare_telemetry(&mut self) -> Result<(), HarnessError> {
        let [board, host] = &mut self.streams;
        while let (Some(ours), Some(theirs)) = (board.telemetry.front(), host.telemetry.front()) {
            if bits(ours) != bits(theirs) {
                let text = format!("telemetry is {ours:?} on the board, {theirs:?} on the host");
                return self.differs(text);
            }
            board.telemetry.pop_front();
            host.telemetry.pop_front();
            self.messages += 1;
        }
        Ok(())
    }

    fn differs<T>(&self, what: String) -> Result<T, HarnessError> {
        Err(HarnessError::Board(format!("and the host differ in tick {}: {what}", self.ticks)))
    }
}

/// The fields to compare: all but those that a clock measures, or that only one of the two has.
fn bits(telemetry: &AnyTelemetry) -> (String, Vec<u32>) {
    let AnyTelemetry {
        tick,
        state,
        law,
        fault,
        cause_tick,
        homing,
        signs,
        motor,
        arming_inhibits,
        counts,
        ..
    } = telemetry;
    let words =
        format!("{:?}", (tick, state, law, fault, cause_tick, homing, signs, motor, arming_inhibits, counts));
    let values = telemetry.estimate.iter().chain(&telemetry.innovation);
    let single = [telemetry.setpoint_m, telemetry.requested_n, telemetry.applied_n, telemetry.drive];
    (words, values.chain(&single).map(|value| value.to_bits()).collect())
}

impl Target for Compared<'_> {
    fn tick(&mut self, pins: &Pins, serial: &mut Vec<u8>) -> Result<Output, HarnessError> {
        let begin = serial.len();
        let output = self.board.tick(pins, serial)?;
        let mut latched = self.board.latched(pins, &self.received);
        self.received.clone_from(&self.board.received);
        // The break input's flag is set again while the contact is open, and is found once more in the next tick.
        let stopped = std::mem::replace(&mut self.was_stopped, pins.contacts.emergency_stop);
        latched.contacts.emergency_stop |= stopped;
        let mut from_host = Vec::new();
        let host = self.host.tick(&latched, &mut from_host)?;
        self.compare_output(&output, &host)?;
        self.streams[0].take(&serial[begin..]);
        self.streams[1].take(&from_host);
        self.compare_telemetry()?;
        self.ticks += 1;
        Ok(output)
    }

    fn pace(&self) -> Pace {
        self.board.pace()
    }
}
