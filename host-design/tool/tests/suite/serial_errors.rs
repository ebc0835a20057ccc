//! Errors of the serial line of the flashed image, on the virtual board: afterwards it hears commands again.

use crate::gains::{SENSORS, STATES};
use upright::boards::DEFAULT_BOARD;
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Command, Message, Request};
use upright_board::{Conditions, Image, Input, Rules, SimulatedBoard, seconds};

use crate::equipment::built;

const BAUD: u32 = 460_800;

/// Identifiers of the commands that are answered within 50 ms each: 1 before the line is disturbed, 2 and 3 after it.
fn answered(image: &Image, disturbance: Option<Input>) -> Vec<u64> {
    let mut board = SimulatedBoard::power_on(image, &Conditions::f405(1), Rules::STRICT).unwrap();
    let (mut frames, mut answered) = (Receiver::<512>::new(), Vec::new());
    board.run_until(seconds(0.1)).unwrap();
    for id in 1..=3 {
        if let Some(disturbance) = disturbance.filter(|_| id == 2) {
            board.apply(disturbance);
            // The background task runs at least once in a tick.
            board.run_until(board.now() + seconds(0.002)).unwrap();
        }
        let (mut scratch, mut out) = ([0; 64], [0; 64]);
        let frame = frame::encode(&Command { id, request: Request::Info }, &mut scratch, &mut out).unwrap();
        board.send(frame, BAUD);
        board.run_until(board.now() + seconds(0.05)).unwrap();
        for byte in board.sent() {
            if let Some(Ok(Message::Reply(reply))) = frames.push::<Message<STATES, SENSORS>>(byte.value) {
                answered.push(reply.id);
            }
        }
    }
    answered
}

#[test]
fn an_overrun_or_a_dma_error_does_not_make_the_board_deaf() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    for disturbance in [None, Some(Input::Overrun), Some(Input::ReceiveError)] {
        assert_eq!(answered(&image, disturbance), [1, 2, 3], "{disturbance:?}");
    }
}
