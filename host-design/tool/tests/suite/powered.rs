//! The flashed image on the virtual board, switched on and listened to.

use crate::gains::{SENSORS, STATES};
use upright::boards::DEFAULT_BOARD;
use upright::flash_image::{REFERENCE, WordSums};
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Command, Message, Reply, Request, Telemetry};
use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright_board::{Conditions, ExternalLevel, Image, Input, Rules, SimulatedBoard, seconds};

use crate::equipment::built;

pub(crate) const BAUD: u32 = 460_800;

/// The image; none without a compiler.
pub(crate) fn image() -> Option<Image> {
    let elf = built(DEFAULT_BOARD)?;
    Some(Image::from_elf(&std::fs::read(elf).unwrap()).unwrap())
}

/// The image whose first `end` bytes are what was linked, with the checksum of what they are now.
pub(crate) fn sealed(image: Image, end: usize) -> Image {
    let flash = image.flash();
    let words: Vec<u32> = flash[..end].as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let WordSums { plain, weighted } = WordSums::of_image(&words);
    let reference = [plain.to_le_bytes(), weighted.to_le_bytes()].concat();
    image.with_bytes(0x0800_0000 + 4 * REFERENCE.start as u32, reference)
}

/// A board with all contacts closed and the motor's supply on.
pub(crate) struct Powered {
    pub(crate) board: SimulatedBoard,
    frames: Receiver<512>,
    pub(crate) telemetry: Vec<Telemetry<STATES, SENSORS>>,
    pub(crate) replies: Vec<Reply>,
}

impl Powered {
    pub(crate) fn with(image: &Image, conditions: &Conditions, rules: Rules) -> Self {
        let mut board = SimulatedBoard::power_on(image, conditions, rules).unwrap();
        let [low, high] = conditions.wiring.limits;
        for contact in [conditions.wiring.emergency_stop, low, high] {
            board.apply(Input::Level(contact, ExternalLevel::Low));
        }
        board.apply(Input::Supply(24.0));
        Self { board, frames: Receiver::new(), telemetry: Vec::new(), replies: Vec::new() }
    }

    pub(crate) fn strict(image: &Image, conditions: &Conditions) -> Self {
        Self::with(image, conditions, Rules::STRICT)
    }

    /// Runs to this time after power-on, and reads what the board sends. Checks the baud rate: a byte with another bit
    /// time could not be read.
    pub(crate) fn run(&mut self, time_s: f64) {
        self.board.run_until(seconds(time_s)).unwrap();
        for byte in self.board.sent() {
            let baud = seconds(1.0) as f64 / byte.bit as f64;
            assert!((baud / f64::from(BAUD) - 1.0).abs() < 0.03, "{baud} baud");
            match self.frames.push::<Message<STATES, SENSORS>>(byte.value) {
                Some(Ok(Message::Telemetry(telemetry))) => self.telemetry.push(telemetry),
                Some(Ok(Message::Reply(reply))) => self.replies.push(reply),
                Some(Ok(Message::Log(_))) => panic!("nobody has asked for a log"),
                Some(Err(error)) => panic!("{error:?}"),
                None => {}
            }
        }
    }

    pub(crate) fn ask(&mut self, id: u64, request: Request) {
        let (mut scratch, mut out) = ([0; 64], [0; 64]);
        let frame = frame::encode(&Command { id, request }, &mut scratch, &mut out).unwrap();
        self.board.send(frame, BAUD);
    }

    /// Time since power-on (s).
    pub(crate) fn seconds(&self) -> f64 {
        self.board.now() as f64 / seconds(1.0) as f64
    }

    pub(crate) fn last(&self) -> (State, Option<Fault>) {
        self.telemetry.last().map(|telemetry| (telemetry.state, telemetry.fault)).expect("telemetry")
    }
}
