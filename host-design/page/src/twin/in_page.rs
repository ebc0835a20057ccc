//! The twin of one page, in the page itself: some ticks at a time, as the page asks for them.

use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};
use upright::table::Law;
use upright_closed_loop::conversation::Monitor;
use upright_closed_loop::harness::{HarnessError, endless_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};

use super::connected::{ConnectedBoard, Exchange};
use super::console::Console;
use super::greeting::{breakable, greeting};
use super::property::Properties;
use super::request::{MachineRequest, PageRequest};
use super::simulated::{PoweredMachine, SimulatedMachine};
use crate::designed::DeskDesign;
use crate::refusal::{FILE, PageRefusal, failed};

/// Time between two telemetry messages (s).
pub const TELEMETRY_S: f32 = 0.005;
/// Number of the only viewer.
const VIEWER: u64 = 1;

/// What the thread of a page asks its twin.
#[derive(Debug, Deserialize)]
#[serde(tag = "twin", rename_all = "kebab-case")]
enum TwinQuestion {
    /// Switches the power of another rig on, raised or hanging. `since_1970_s` is the time (s); `own` are a person's
    /// own gains K.
    Start { toml: String, motions: Option<String>, own: Option<Vec<f64>>, upright: bool, since_1970_s: f64 },
    /// What the person asks for, then the ticks that are due after `passed_s` of real time, but at most `most_ticks`.
    /// A person who `is_silent` for too long is no longer in command.
    Run { asked: Vec<PageRequest>, passed_s: f64, most_ticks: u32, is_silent: bool },
    /// Begins a conversation with the real board of this rig.
    Connect { toml: String, motions: Option<String> },
    /// Goes on with that conversation.
    Exchange(Exchange),
}

/// The twin of a page; it answers questions in JSON with objects in JSON.
///
/// What begins with a new rig stays in memory until the program ends, so a page starts the program again for it.
#[derive(Default)]
pub struct InPage {
    twin: Option<Twin>,
    board: Option<ConnectedBoard>,
}

struct Twin {
    machine: SimulatedMachine<'static>,
    epoch: Duration,
    console: Console,
    world: TwinPower,
}

/// Whether the machine runs.
enum TwinPower {
    On(Box<PoweredMachine<'static, 'static>>),
    /// The firmware has stopped, and why; properties for the next power-up.
    Stopped(String, Box<Properties>),
}

impl InPage {
    /// Answers `start` and `connect` with `hello`, `run` and `exchange` with a `picture`. A question that cannot be
    /// answered gives `failed`.
    pub fn answer(&mut self, question: &str) -> String {
        let answer = serde_json::from_str(question)
            .map_err(PageRefusal::from)
            .and_then(|question| self.answered(question));
        answer.unwrap_or_else(|refusal| failed(&refusal)).to_string()
    }

    fn answered(&mut self, question: TwinQuestion) -> Result<Value, PageRefusal> {
        match question {
            TwinQuestion::Start { toml, motions, own, upright, since_1970_s } => {
                let twin = Twin::start(&toml, motions.as_deref(), own.as_deref(), (upright, since_1970_s))?;
                let hello = twin.hello();
                self.twin = Some(twin);
                Ok(json!({ "hello": hello, "you": VIEWER }))
            }
            TwinQuestion::Run { asked, passed_s, most_ticks, is_silent } => {
                let twin = self.twin.as_mut().ok_or(PageRefusal::NoTwin)?;
                Ok(twin.run(asked, [passed_s, f64::from(most_ticks)], is_silent))
            }
            TwinQuestion::Connect { toml, motions } => {
                let (board, told) = ConnectedBoard::connect(&toml, motions.as_deref())?;
                self.board = Some(board);
                Ok(told)
            }
            TwinQuestion::Exchange(exchange) => {
                let board = self.board.as_mut().ok_or(PageRefusal::NoBoard)?;
                Ok(board.exchange(exchange))
            }
        }
    }
}

impl Twin {
    fn start(
        toml: &str,
        motions: Option<&str>,
        own: Option<&[f64]>,
        (upright, since_1970_s): (bool, f64),
    ) -> Result<Self, PageRefusal> {
        let rig = Rig::from_toml(toml, FILE.as_ref())?;
        let table = DeskDesign::design(&rig)?.with_own(&rig, own)?.table_with(&rig, motions)?;
        let law = table.laws.present().next().map_or(Law::Lqr, |(law, _)| law);
        let scenario = Scenario { sensing: Sensing::Encoders, ..Scenario::at_rest(&rig, law) };
        let machine = SimulatedMachine {
            rig: Box::leak(Box::new(rig)),
            table: Box::leak(Box::new(table)),
            scenario: Box::leak(Box::new(scenario)),
        };
        let epoch = Duration::try_from_secs_f64(since_1970_s).unwrap_or_default();
        let world = powered(machine, Properties::of(machine.rig), upright, epoch)?;
        let monitor = Monitor::with_telemetry_every(TELEMETRY_S, &machine.rig.name);
        let console = Console::new(monitor, machine.rig.base());
        Ok(Self { machine, epoch, console, world: TwinPower::On(world) })
    }

    fn hello(&self) -> Value {
        let SimulatedMachine { rig, table, .. } = self.machine;
        greeting(rig, table, "this page", Some(&breakable(table)))
    }

    fn run(&mut self, asked: Vec<PageRequest>, [passed_s, most_ticks]: [f64; 2], is_silent: bool) -> Value {
        let mut left = most_ticks as u32;
        let mut goes_on = || {
            let goes_on = left > 0;
            left = left.saturating_sub(1);
            goes_on
        };
        let Self { console, world, .. } = self;
        let ran = match world {
            TwinPower::On(world) => {
                asked.into_iter().try_for_each(|request| heard(request, world, console)).and_then(|()| {
                    console.watch(is_silent, world.now());
                    world.run(passed_s, console, &mut goes_on)?;
                    Ok(world.restart())
                })
            }
            // Nothing else can be done while the firmware is stopped.
            TwinPower::Stopped(..) => Ok(asked.iter().find_map(|request| match request {
                PageRequest::Machine { what: MachineRequest::Restart { upright } } => Some(*upright),
                _ => None,
            })),
        };
        match ran {
            Ok(None) => {}
            Ok(Some(upright)) => self.switch_off_and_on(upright),
            Err(error) => self.stop(&error),
        }
        self.shown()
    }

    fn shown(&mut self) -> Value {
        let machine = match &self.world {
            TwinPower::On(world) => world.picture(),
            TwinPower::Stopped(why, _) => json!({ "stopped": why }),
        };
        let picture = self.console.picture(&machine, Some(VIEWER));
        let csv = self.console.recorded().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        json!({ "picture": picture, "csv": csv })
    }

    fn properties(&self) -> Properties {
        match &self.world {
            TwinPower::On(world) => world.properties().clone(),
            TwinPower::Stopped(_, properties) => Properties::clone(properties),
        }
    }

    fn stop(&mut self, error: &HarnessError) {
        self.console.monitor.note(format!("{error}; switch the power off and on"));
        self.world = TwinPower::Stopped(error.to_string(), Box::new(self.properties()));
    }

    fn switch_off_and_on(&mut self, upright: bool) {
        if let TwinPower::On(world) = &self.world {
            self.epoch = world.now();
        }
        match powered(self.machine, self.properties(), upright, self.epoch) {
            Ok(world) => {
                self.world = TwinPower::On(world);
                let monitor = Monitor::with_telemetry_every(TELEMETRY_S, &self.machine.rig.name);
                self.console.begin_again(monitor);
            }
            Err(error) => self.stop(&error),
        }
    }
}

/// Carries out a request.
fn heard(
    request: PageRequest,
    world: &mut PoweredMachine<'static, 'static>,
    console: &mut Console,
) -> Result<(), HarnessError> {
    match request {
        // The only viewer is always in command.
        PageRequest::Alive {} | PageRequest::Command {} | PageRequest::Release {} => Ok(()),
        PageRequest::Say { line } => {
            console.say(&line, world.now());
            Ok(())
        }
        PageRequest::Record { on } => {
            console.record(on);
            Ok(())
        }
        PageRequest::Machine { what } => world.carry_out(what, console),
    }
}

/// The machine with its power on.
fn powered(
    machine: SimulatedMachine<'static>,
    properties: Properties,
    upright: bool,
    epoch: Duration,
) -> Result<Box<PoweredMachine<'static, 'static>>, HarnessError> {
    let target = endless_firmware(machine.table)?;
    Ok(Box::new(PoweredMachine::new(machine, target, properties, upright, epoch)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page with its twin.
    #[derive(Default)]
    struct Page(InPage);

    impl Page {
        fn ask(&mut self, question: &Value) -> Value {
            serde_json::from_str(&self.0.answer(&question.to_string())).unwrap()
        }

        fn start(&mut self, rig: &str, upright: bool) -> Value {
            let file = format!("{}/../../rigs/{rig}.toml", env!("CARGO_MANIFEST_DIR"));
            let toml = std::fs::read_to_string(file).unwrap();
            let start = json!({ "twin": "start", "toml": toml, "upright": upright, "since_1970_s": 1.7e9 });
            self.ask(&start)["hello"].clone()
        }

        /// Runs a second after these requests.
        fn run(&mut self, asked: &[Value]) -> Value {
            let run = json!({ "twin": "run", "asked": asked, "passed_s": 1.0, "most_ticks": 10_000, "is_silent": false });
            self.ask(&run)
        }

        /// Does this with the machine, and returns the state a second later.
        fn state_after(&mut self, what: &Value) -> Value {
            let answer = self.run(&[json!({ "ask": "machine", "what": what })]);
            last_state(&answer)
        }
    }

    fn last_state(answer: &Value) -> Value {
        answer["picture"]["telemetry"].as_array().unwrap().last().unwrap()["state"].clone()
    }

    fn defect(name: &str) -> Value {
        json!({ "do": "defect", "name": name, "sensor": 0 })
    }

    #[test]
    fn a_rig_that_was_broken_balances_again_after_the_power_was_switched_off_and_on() {
        let mut page = Page::default();
        // Negative control: without a rig, there is nothing to run.
        assert!(page.run(&[])["failed"]["why"].as_str().unwrap().contains("no rig"));
        assert_eq!(page.start("single-quanser-ip02", true)["rig"], "single-quanser-ip02");
        assert_eq!(last_state(&page.run(&[])), "Balancing");
        assert_eq!(page.state_after(&defect("motor-reversed")), "Fault");
        page.run(&[json!({ "ask": "machine", "what": { "do": "restart", "upright": true } })]);
        assert_eq!(last_state(&page.run(&[])), "Balancing");
    }

    #[test]
    fn an_arm_balances_and_is_told_and_pulled_in_its_own_units() {
        for rig in ["single-qube-servo-2", "single-srv02-rotary", "double-quanser-rotary"] {
            let mut page = Page::default();
            let hello = page.start(rig, true);
            let arc_m = hello["base"]["arc_m"].as_f64().unwrap();
            assert_eq!((&hello["base"]["noun"], &hello["input"]), (&json!("arm"), &json!(["torque", "N·m"])));
            assert_eq!((&hello["sensors"][0], &hello["push_unit"]), (&json!("arm"), &json!("N·m")));
            let texts = |list: &str, name: &str| -> String {
                hello[list].as_array().unwrap().iter().map(|told| told[name].to_string()).collect()
            };
            for (list, name) in [("properties", "label"), ("defects", "meaning"), ("states", "text")] {
                let said = texts(list, name);
                assert!(!said.contains("cart") && !said.contains("rail"), "{said}");
            }
            // Ten degrees beside it.
            let pull = json!({ "do": "pull", "body": 0, "along": 0.0, "x": 0.17 * arc_m, "y": 0.0 });
            assert_eq!(page.state_after(&pull), "Balancing", "{rig}");
            let machine = page.run(&[])["picture"]["machine"].clone();
            assert!(machine["state"][0].as_f64().unwrap().abs() > 0.005, "{rig}: {machine}");
            assert_eq!(page.state_after(&defect("motor-reversed")), "Fault", "{rig}");
        }
        // Negative control: a cart.
        let hello = Page::default().start("single-quanser-ip02", true);
        assert_eq!((&hello["base"]["arc_m"], &hello["input"]), (&json!(1.0), &json!(["force", "N"])));
    }

    #[test]
    fn a_stepper_balances_and_is_pushed_and_broken() {
        for rig in ["single-stepper", "double-stepper", "quadruple-stepper"] {
            let mut page = Page::default();
            let hello = page.start(rig, true);
            let defects: Vec<_> =
                hello["defects"].as_array().unwrap().iter().map(|told| &told["name"]).collect();
            assert!(defects.iter().any(|&name| name == "cart-jammed"), "{defects:?}");
            assert!(!defects.iter().any(|&name| name == "motor-stuck"), "{defects:?}");
            for (name, value) in [("tilt", 0.1), ("mass", 3.0)] {
                let set = json!({ "do": "set", "name": name, "value": value });
                assert_eq!(page.state_after(&set), "Balancing", "{rig} {name}");
            }
            assert_eq!(page.state_after(&json!({ "do": "challenge", "on": true })), "Balancing");
            for _ in 0..10 {
                page.run(&[]);
            }
            let score = page.run(&[])["picture"]["machine"]["challenge"].clone();
            assert!(score["survived_n"].as_f64().unwrap() > 0.0, "{score}");
            for name in ["motor-dead", "motor-reversed", "cart-jammed", "pulses-missing"] {
                page.run(&[json!({ "ask": "machine", "what": { "do": "restart", "upright": true } })]);
                assert_eq!(last_state(&page.run(&[])), "Balancing", "{rig}");
                let mut state = page.state_after(&defect(name));
                for _ in 0..3 {
                    state = last_state(&page.run(&[]));
                }
                assert_eq!(state, "Fault", "{rig} {name}");
            }
        }
    }

    /// Whether the rig falls while its last link is pulled to the side for four seconds.
    fn falls_when_pulled(page: &mut Page, hello: &Value, by_m: f64) -> bool {
        page.run(&[]);
        let lengths = hello["lengths_m"].as_array().unwrap();
        let reach_m: f64 = lengths.iter().filter_map(Value::as_f64).sum();
        let pull = json!({ "do": "pull", "body": lengths.len(), "along": 1.0, "x": by_m, "y": reach_m });
        let mut state = page.state_after(&pull);
        for _ in 0..3 {
            state = last_state(&page.run(&[]));
        }
        state == "Fault"
    }

    #[test]
    fn the_page_is_told_whether_a_pull_that_is_held_fells_the_rig() {
        for (rig, falls) in [
            ("single-quanser-ip02", false),
            ("double-quanser-dbpen", false),
            ("triple-glueck-eder-kugi", true),
            ("quadruple-paper", true),
        ] {
            let mut page = Page::default();
            let hello = page.start(rig, true);
            assert_eq!(hello["falls_when_held"], falls, "{rig}");
            assert_eq!(falls_when_pulled(&mut page, &hello, 0.006), falls, "{rig}");
        }
    }

    #[test]
    fn a_drive_that_only_holds_the_cart_survives_no_challenge() {
        let mut page = Page::default();
        page.start("single-stepper", false);
        page.run(&[]);
        let home = json!({ "ask": "say", "line": "home" });
        assert_eq!(last_state(&page.run(&[home])), "Calibrated", "the drive holds the cart");
        page.state_after(&json!({ "do": "challenge", "on": true }));
        let score = page.run(&[])["picture"]["machine"]["challenge"].clone();
        assert_eq!(
            (score["is_over"].as_bool(), score["upright_s"].as_f64()),
            (Some(true), Some(0.0)),
            "{score}"
        );
    }
}
