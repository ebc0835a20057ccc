//! A real board in the page: the firmware on this computer behind a serial port that the test gives to the browser,
//! with the frames of the wire.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use std::time::Instant;

use serde_json::json;
use upright::table::Law;
use upright_closed_loop::harness::{World, with_firmware};
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};
use upright_design::table::{Gains, TableValues};

use crate::report_devtools::Browser;
use crate::site_page::{opened, root, type_in, until as until_designed};
use crate::twin_page::STATE;

/// A port as browsers give it, whose bytes the test carries.
const PORT: &str = "
    window.wire = { sent: [], options: null, isOpen: false };
    const port = {
      async open(options) {
        Object.assign(wire, { options, isOpen: true });
        port.readable = new ReadableStream({ start(controller) { wire.board = controller; } });
        port.writable = new WritableStream({ write(bytes) { wire.sent.push(...bytes); } });
      },
      async close() { wire.isOpen = false; },
    };
    Object.defineProperty(navigator, 'serial', { configurable: true, value: { requestPort: async () => port } });
    wire.carry = (bytes) => {
      if (bytes.length > 0 && wire.isOpen) wire.board.enqueue(Uint8Array.from(bytes));
      return wire.sent.splice(0);
    };";

/// Longest time of the board between two times at which bytes are carried (s).
const LONGEST_S: f64 = 0.02;

/// A board under power, in real time; on a busy machine its time waits for the browser.
struct Board<'a, 't> {
    world: World<'t>,
    rig: &'a Rig,
    output: upright::board::Output,
    last: Instant,
    t_s: f64,
    due_s: f64,
    /// Whether the line carries the bytes of the page to the board.
    is_connected: bool,
}

impl Board<'_, '_> {
    /// Runs the ticks that are due, and carries the bytes of both directions.
    fn run(&mut self, browser: &mut Browser) {
        let mut sent = Vec::new();
        self.due_s += self.last.elapsed().as_secs_f64().min(LONGEST_S);
        self.last = Instant::now();
        while self.t_s < self.due_s {
            let drive = if self.output.enable {
                self.output.drive
            } else {
                upright::control::actuator::Drive::Force(0.0)
            };
            self.world.bench.tick(drive);
            let inputs = self.world.inputs();
            self.output = self.world.session.tick(&inputs).unwrap();
            sent.extend_from_slice(self.world.session.last_bytes());
            self.world.session.forget_received();
            self.t_s += self.rig.tick.period_s;
        }
        let inside = browser.inside.take();
        let received = browser.value(&format!("wire.carry({})", json!(sent)));
        browser.inside = inside;
        if self.is_connected {
            let bytes: Vec<u8> = serde_json::from_value(received).unwrap();
            self.world.session.send_bytes(&bytes);
        }
    }

    /// Runs until an expression is true; at most for these seconds of its time. Returns whether it is.
    fn until(&mut self, browser: &mut Browser, seconds: f64, expression: &str) -> bool {
        let end_s = self.t_s + seconds;
        while browser.value(&format!("Boolean({expression})")) != true {
            if self.t_s > end_s {
                return false;
            }
            self.run(browser);
        }
        true
    }
}

/// Lets the page connect to the board of the single rig, while it balances, and does `act` with both.
fn with_board(firmware_is_its_own: bool, act: impl FnOnce(&mut Browser, &mut Board<'_, '_>)) {
    let Some((mut browser, _folder)) = opened() else { return };
    browser.value(PORT);
    let toml = std::fs::read_to_string(root().join("rigs/single-quanser-ip02.toml")).unwrap();
    let rig = Rig::from_toml(&toml, "rig.toml".as_ref()).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let shown = if firmware_is_its_own { toml } else { toml.replace("mass_kg = 0.230", "mass_kg = 0.231") };
    type_in(&mut browser, &shown);
    until_designed(
        &mut browser,
        "upright.desk.design.states === 4 && !document.getElementById('connect').disabled",
    );
    let scenario = Scenario { sensing: Sensing::Encoders, ..Scenario::at_rest(&rig, Law::Lqr) };
    with_firmware(&table, |firmware| {
        let mut world = World::new(&rig, &table, &scenario, firmware).unwrap();
        let output = world.raise(None).unwrap();
        let mut board = Board {
            world,
            rig: &rig,
            output,
            last: Instant::now(),
            t_s: 0.0,
            due_s: 0.0,
            is_connected: true,
        };
        browser.value("document.getElementById('connect').click()");
        let frame = "document.querySelector('#twin iframe')?.contentWindow?.upright?.seen?.picture";
        assert!(board.until(&mut browser, 20.0, frame), "the page is not connected");
        assert_eq!(browser.value("wire.options.baudRate"), upright::protocol::BAUD);
        browser.inside = Some("#twin iframe");
        act(&mut browser, &mut board);
        browser.inside = None;
        assert_eq!(browser.errors(), Vec::<String>::new());
    })
    .unwrap();
}

#[test]
fn the_motor_of_a_board_is_stopped_from_the_page_and_when_the_page_goes_back_to_its_desk() {
    with_board(true, |browser, board| {
        assert!(board.until(browser, 20.0, &format!("({STATE}) === 'Balancing'")));
        // What only a simulation can do is not there.
        assert_eq!(browser.value("document.querySelector('[data-tab=break]').hidden"), true);
        assert!(board.until(browser, 5.0, "upright.seen.picture.wanted_m !== null"));
        browser.value("document.getElementById('stop').click()");
        assert!(board.until(browser, 2.0, &format!("({STATE}) === 'Calibrated'")));
        assert!(!board.output.enable);
    });
    with_board(true, |browser, board| {
        assert!(board.until(browser, 20.0, &format!("({STATE}) === 'Balancing'")) && board.output.enable);
        browser.inside = None;
        browser.value("document.getElementById('close').click()");
        assert!(board.until(browser, 2.0, "!wire.isOpen"), "the port stays open");
        // What the page has sent before it closed the port still arrives, long before the line would be lost.
        assert!(!board.until(browser, 0.1, "false") && !board.output.enable);
    });
}

#[test]
fn a_lost_line_turns_the_motor_off_and_one_that_carries_does_not() {
    with_board(true, |browser, board| {
        assert!(board.until(browser, 5.0, "upright.seen.picture.wanted_m !== null"));
        // Negative control: longer than the firmware waits for a keep-alive.
        assert!(
            !board.until(browser, 1.5, &format!("({STATE}) !== 'Balancing'")) && board.output.enable,
            "{}",
            browser.value("upright.seen.picture")
        );
        board.is_connected = false;
        assert!(board.until(browser, 3.0, &format!("({STATE}) === 'Fault'")));
        assert!(!board.output.enable);
        assert_eq!(browser.value("upright.seen.picture.fault.name"), "link lost");
    });
}

#[test]
fn a_board_with_the_firmware_of_another_rig_is_not_commanded() {
    with_board(false, |browser, board| {
        assert!(board.until(browser, 20.0, "upright.seen.picture.ended !== null"));
        browser.value("document.getElementById('stop').click()");
        assert!(
            !board.until(browser, 1.0, "false") && board.output.enable,
            "it balances on, without this page"
        );
    });
}
