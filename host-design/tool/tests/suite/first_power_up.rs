//! "First power-up" and "First balance" of docs/commission.md, followed step by step: the flashed image on the virtual
//! board, with the keys and the screen of the monitor.

use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use upright::board::{Contacts, Output};
use upright::boards::DEFAULT_BOARD;
use upright::control::actuator::Drive;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_board::{Conditions, Image};
use upright_closed_loop::harness::{Pins, Session};
use upright_design::simulate::{Bench, Scenario};
use upright_tool::image::flash_checksum;
use upright_tool::in_the_loop::VirtualBoard;
use upright_tool::monitor::{Monitor, action, view};

use crate::equipment::built;
use crate::published::rig_and_table;

/// Factor on the motor's force: 0 without the motor, -1 with its wires swapped.
type Motor = f32;

/// A person with the monitor, at a rig that is held by hand while the motor is off.
struct Person<'b> {
    session: Session<'b>,
    bench: Bench,
    monitor: Monitor,
    held: Vec<f64>,
    contacts: Contacts,
    supply_v: f32,
    motor: Motor,
    ticks: u32,
}

impl Person<'_> {
    fn now(&self) -> Duration {
        Duration::from_secs(1_800_000_000) + Duration::from_millis(self.ticks.into())
    }

    /// One tick of 1 ms.
    fn tick(&mut self) -> Output {
        self.ticks += 1;
        let now = self.now();
        self.monitor.poll(now);
        self.session.send_bytes(&self.monitor.take_outgoing());
        let mut counters = [0; 5];
        self.bench.read_counters(&mut counters);
        let pins = Pins {
            raw_counts: heapless::Vec::from_slice(&counters).unwrap(),
            supply_v: self.supply_v,
            contacts: self.contacts,
            received: heapless::Vec::new(),
            injected_fault: None,
        };
        let output = self.session.tick(&pins).unwrap();
        self.monitor.receive(self.session.last_bytes(), now);
        self.session.forget_received();
        if output.enable {
            self.bench.tick(Drive::Force(self.motor * output.drive.value()));
            self.held[0] = self.bench.state()[0];
        } else {
            self.bench.hold(&self.held);
        }
        output
    }

    fn wait(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e3) as u32 {
            self.tick();
        }
    }

    fn press(&mut self, code: KeyCode) {
        let key = KeyEvent::new(code, KeyModifiers::NONE);
        self.monitor.act(action(&key).unwrap(), self.now());
    }

    /// Holds a key, which the terminal repeats every 30 ms; returns the number of ticks with the motor on.
    fn hold(&mut self, key: char, seconds: f64) -> u32 {
        let mut on = 0;
        for tick in 0..(seconds * 1e3) as u32 {
            if tick % 30 == 0 {
                self.press(KeyCode::Char(key));
            }
            on += u32::from(self.tick().enable);
        }
        on
    }

    /// What the screen shows.
    fn screen(&self) -> String {
        let mut terminal = Terminal::new(TestBackend::new(300, 48)).unwrap();
        terminal.draw(|frame| view::draw(&self.monitor, frame)).unwrap();
        let cells = terminal.backend().buffer().content().iter();
        cells.map(|cell| cell.symbol()).collect()
    }

    #[track_caller]
    fn sees(&self, text: &str) {
        assert!(self.screen().contains(text), "{text}: {}", self.screen());
    }

    #[track_caller]
    fn sees_no(&self, text: &str) {
        assert!(!self.screen().contains(text), "{text}: {}", self.screen());
    }

    fn counts(&self, sensor: usize) -> i32 {
        self.monitor.telemetry.as_ref().unwrap().counts[sensor]
    }

    fn state(&self) -> State {
        self.monitor.telemetry.as_ref().unwrap().state
    }

    /// Does what the sign check asks for.
    fn follow_the_sign_check(&mut self) {
        let hanging = self.held.clone();
        for _ in 0..20_000 {
            match self.monitor.telemetry.as_ref().unwrap().signs {
                Signs::Move(0) => self.held[0] += 5e-4,
                Signs::Move(link) => {
                    let joint = 2 * usize::from(link);
                    self.held[joint] += 2e-3;
                    if let Some(outer) = self.held.get_mut(joint + 2) {
                        *outer -= 2e-3;
                    }
                }
                Signs::Checked => return,
                _ => self.held[2..].copy_from_slice(&hanging[2..]),
            }
            self.tick();
        }
        panic!("{:?}", self.monitor.telemetry);
    }
}

/// With the supply off: telemetry, contacts, counts.
fn without_supply(person: &mut Person<'_>, checksum: u32) {
    // 1
    person.wait(0.3);
    person.sees(&format!("image {checksum:08x}"));
    person.sees("disarmed: positions are not known");
    // 2
    person.sees("active inputs: none");
    type Contact = (&'static str, fn(&mut Contacts, bool));
    let contacts: [Contact; 3] = [
        ("emergency stop", |contacts, open| contacts.emergency_stop = open),
        ("limit switch low", |contacts, open| contacts.limit_low = open),
        ("limit switch high", |contacts, open| contacts.limit_high = open),
    ];
    for (name, set) in contacts {
        set(&mut person.contacts, true);
        person.wait(0.05);
        person.sees(&format!("active inputs: {name}"));
        set(&mut person.contacts, false);
        person.wait(0.05);
        person.sees("active inputs: none");
        assert_eq!(person.state() == State::Fault, name == "emergency stop");
        person.press(KeyCode::Char('c'));
        person.wait(0.1);
        assert_eq!(person.state(), State::Disarmed);
    }
    // 3 and 4: 20 µm and 2π / 4096 rad per count.
    for (sensor, amount, counts) in
        [(0, 0.1, 5000), (1, 0.5, 326), (2, 0.5, 326), (3, 0.5, 326), (4, 0.5, 326)]
    {
        let before = person.counts(sensor);
        person.held[2 * sensor] += amount;
        person.wait(0.05);
        assert!((person.counts(sensor) - before - counts).abs() <= 1, "{}", person.counts(sensor) - before);
        person.held[2 * sensor] -= amount;
    }
}

/// The power stage without the motor.
fn without_motor(person: &mut Person<'_>) {
    // 5
    person.supply_v = 23.0;
    person.wait(0.1);
    person.sees("supply 23.0 V");
    // 6
    person.wait(0.6);
    person.press(KeyCode::Char('h'));
    person.wait(0.1);
    assert_eq!(person.state(), State::Calibrated);
    person.press(KeyCode::Char('g'));
    person.wait(0.1);
    person.sees("now: let the links hang at rest; then turn link 4 counter-clockwise");
    person.follow_the_sign_check();
    person.wait(0.2);
    person.sees("the motor's sign is not checked");
    // 7
    assert_eq!(person.hold('m', 1.3), 1000);
    person.sees("the motor has not moved the cart");
    person.wait(0.2);
    assert!(person.hold('M', 0.3) > 290);
    person.wait(0.2);
    person.hold('m', 0.3);
    person.sees("jogging");
    person.contacts.emergency_stop = true;
    assert!(!person.tick().enable, "in hardware, and in the same tick");
    person.contacts.emergency_stop = false;
    person.wait(0.2);
    assert_eq!(person.state(), State::Fault);
    person.press(KeyCode::Char('c'));
    person.wait(0.2);
}

/// The motor at its terminals.
fn with_motor(person: &mut Person<'_>) {
    // 8, at first with its wires swapped.
    person.motor = -1.0;
    person.hold('m', 0.3);
    person.sees("the motor pushes the wrong way");
    person.motor = 1.0;
    person.wait(0.2);
    let before = person.held[0];
    person.hold('m', 0.3);
    assert!((0.02..0.1).contains(&(person.held[0] - before)));
    assert_eq!(person.monitor.telemetry.as_ref().unwrap().motor, MotorSign::Checked);
    person.sees_no("the motor's sign is not checked");
}

fn first_balance(person: &mut Person<'_>) {
    // 4: the links are raised by hand.
    person.held[2..].fill(0.0);
    person.wait(0.2);
    person.press(KeyCode::Char('a'));
    person.wait(0.5);
    assert_eq!(person.state(), State::Balancing);
    // 5
    person.press(KeyCode::Right);
    person.wait(1.0);
    person.sees("m: done");
    assert_eq!(person.state(), State::Balancing);
    person.press(KeyCode::Char('d'));
    person.wait(0.1);
    assert_eq!(person.state(), State::Calibrated);
}

#[test]
fn the_guide_can_be_followed_step_by_step() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let mut held = vec![0.0; rig.states()];
    held[2] = std::f64::consts::PI;
    let mut bench = Bench::new(&rig, &Scenario::at_rest(&rig, Law::Lqr)).unwrap();
    bench.hold(&held);
    let mut person = Person {
        session: Session::new(&mut board),
        bench,
        monitor: Monitor::new("the virtual board"),
        held,
        contacts: Contacts::default(),
        supply_v: 0.0,
        motor: 0.0,
        ticks: 0,
    };
    without_supply(&mut person, flash_checksum(&image));
    without_motor(&mut person);
    with_motor(&mut person);
    first_balance(&mut person);
}
