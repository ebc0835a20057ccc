//! The image that is flashed, on the virtual board, from power-up to balancing with no one's help but the simulated
//! hand.

use upright::control::actuator::Drive;
use upright::gains::{RIG_HASH, SENSORS, STATES, TABLE, TICK_S};
use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Command, Message, Request, Telemetry};
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_board::{Board, Conditions, Image, Input, Rules, Time, Wire, Wiring, pin, seconds};
use upright_design::harness::{Hand, Status};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario};
use upright_tool::image::{Kind, build_if_possible};

const BAUD: u32 = 460_800;
/// The counters change so long before a tick.
const BEFORE_THE_TICK: Time = 252_000;

/// The board with a simulated rig, and a hand.
struct OnTheBoard {
    board: Board,
    bench: Bench,
    hand: Hand,
    positions: [i64; SENSORS],
    last: [u32; SENSORS],
    frames: Receiver<512>,
    telemetry: Option<Telemetry<STATES, SENSORS>>,
    tick: Time,
    number: u32,
    id: u64,
}

impl OnTheBoard {
    fn power_on(image: &Image, rig: &Rig) -> Self {
        let mut board = Board::power_on(image, &Conditions::f405(1), Wiring::upright(), Rules::NOTED)
            .expect("good vectors");
        for contact in [pin('B', 12), pin('C', 0), pin('C', 1)] {
            board.apply(Input::Level(contact, Wire::Low));
        }
        board.apply(Input::Supply(24.0));
        let mut scenario = Scenario::at_rest(rig, Law::Lqr);
        scenario.start[2] = 0.002;
        let mut bench = Bench::new(rig, &scenario).unwrap();
        let hand = Hand::new(rig, &scenario.start);
        bench.hold(hand.held());
        let last = bench.counters();
        // The first tick: SysTick is exception 15.
        while board.exception() != 15 {
            let next = board.now() + 1;
            board.run_until(next).unwrap();
        }
        let tick = board.now();
        Self {
            board,
            bench,
            hand,
            positions: [0; SENSORS],
            last,
            frames: Receiver::new(),
            telemetry: None,
            tick,
            number: 0,
            id: 0,
        }
    }

    /// Until shortly before the next tick; what the motor did, as a share of full force.
    fn step(&mut self) -> f64 {
        let before = self.board.driven();
        self.tick += seconds(f64::from(TICK_S));
        self.board.run_until(self.tick - BEFORE_THE_TICK).unwrap();
        let after = self.board.driven();
        let along = (after.along - before.along) as f64 - (after.against - before.against) as f64;
        for byte in self.board.sent() {
            if let Some(Ok(Message::Telemetry(telemetry))) = self.frames.push(byte.value) {
                self.telemetry = Some(telemetry);
            }
        }
        self.number += 1;
        along / seconds(f64::from(TICK_S)) as f64
    }

    fn ask(&mut self, request: Request) {
        self.id += 1;
        let (mut scratch, mut out) = ([0; 64], [0; 64]);
        let frame = frame::encode(&Command { id: self.id, request }, &mut scratch, &mut out).unwrap();
        self.board.send(frame, BAUD);
    }

    /// The shafts turn to where the rig is.
    fn turn(&mut self) {
        let counters: [u32; SENSORS] = self.bench.counters();
        for (encoder, (now, last)) in counters.into_iter().zip(self.last).enumerate() {
            let moved = now.wrapping_sub(last) as i32;
            let moved = if encoder == 0 { moved } else { i32::from(moved as i16) };
            self.positions[encoder] += i64::from(moved);
            let end = self.board.now();
            self.board.apply(Input::Encoder { encoder, position: self.positions[encoder], end });
        }
        self.last = counters;
    }

    /// A tick with the hand, until the motor is on.
    fn by_hand(&mut self) {
        let _ = self.step();
        let status = self.telemetry.as_ref().map_or(
            Status { state: State::Disarmed, signs: Signs::Unchecked },
            |telemetry| Status { state: telemetry.state, signs: telemetry.signs },
        );
        if let Some(act) = self.hand.act(self.number, &status) {
            self.bench.hold(&act.held);
            if let Some(request) = act.request {
                self.ask(request);
            }
        }
        self.turn();
    }

    /// A tick in which the motor alone holds the rig.
    fn alone(&mut self) {
        let share = self.step();
        self.bench.tick(Drive::Force((share * f64::from(TABLE.force_limit_n)) as f32));
        self.turn();
    }
}

#[test]
fn the_flashed_image_balances_from_power_up() {
    let Some(elf) = build_if_possible(Kind::Board(upright_tool::image::Board::WeactF405)).unwrap() else {
        return;
    };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let rig = Rig::from_path("../../rigs/quadruple-paper.toml".as_ref()).unwrap();
    assert_eq!(rig.hash(), RIG_HASH);
    let mut run = OnTheBoard::power_on(&image, &rig);
    while !run.board.power_stage().enable {
        run.by_hand();
        assert!(run.number < 30_000, "{:?}", run.telemetry);
    }
    eprintln!("balancing after {} ticks", run.number);
    let (mut ticks, mut squares) = (0.0, [0.0; 2]);
    for tick in 0..5_000 {
        run.alone();
        let (position, angle) = (run.bench.state()[0], run.bench.state()[2]);
        assert!(angle.abs() < 0.1, "{:?}\n{:?}", run.bench.state(), run.telemetry);
        if tick >= 1_000 {
            ticks += 1.0;
            squares = [squares[0] + position * position, squares[1] + angle * angle];
        }
    }
    // The steps of the encoders keep it moving: `upright verify` gives 14.5 mm and 14.3 mrad RMS for a force without
    // PWM and with further disturbances.
    let [position_rms, angle_rms] = squares.map(|sum: f64| (sum / ticks).sqrt());
    eprintln!("RMS: cart {position_rms:.4} m, first link {angle_rms:.4} rad");
    assert!(position_rms < 0.05 && angle_rms < 0.03, "{position_rms} {angle_rms}");
}
