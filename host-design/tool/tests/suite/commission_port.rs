//! The first steps with a machine behind a port: its firmware answers over TCP, and a person types lines.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use upright_closed_loop::harness::with_firmware;
use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_test_support::limits::accepted;
use upright_tool::commission::{
    AtPort, CommissionPlan, CommissionRecord, CommissionStep, Commissioning, Journal, MachineAtHand,
    PersonTask, Planted, Simulated, Stop,
};
use upright_tool::monitor::SerialLine;

use crate::command::{SINGLE, path_of};

/// Real time for each of the machine's ticks of 2 ms.
const TICK: Duration = Duration::from_micros(200);

/// Serves the simulated machine of the file at a TCP port, faster than real time; its hand does what comes through
/// `tasks`.
fn serve(
    listener: &TcpListener,
    rig: &Rig,
    table: &TableValues,
    planted: Option<Planted>,
    tasks: &Receiver<PersonTask>,
) {
    let mut stream = accepted(listener, "the tool connects");
    let (reader, received) = channel();
    let mut incoming = stream.try_clone().unwrap();
    std::thread::spawn(move || {
        let mut buffer = [0; 256];
        while let Ok(length @ 1..) = incoming.read(&mut buffer)
            && reader.send(buffer[..length].to_vec()).is_ok()
        {}
    });
    with_firmware(table, |target| {
        let mut machine = Simulated::new(rig, table, planted, target, 1).unwrap();
        loop {
            while let Ok(task) = tasks.try_recv() {
                machine.ask(task).unwrap();
            }
            let bytes = match received.recv_timeout(TICK) {
                Err(RecvTimeoutError::Disconnected) => return,
                bytes => bytes.unwrap_or_default(),
            };
            let answer = machine.exchange(&bytes).unwrap();
            if stream.write_all(&answer).is_err() {
                return;
            }
        }
    })
    .unwrap();
}

/// The port, and the simulated hand at the machine behind it, which gets every task that the person is asked to do.
struct Heard {
    port: AtPort,
    hand: Sender<PersonTask>,
}

impl MachineAtHand for Heard {
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop> {
        self.port.exchange(bytes)
    }

    fn now(&self) -> Duration {
        self.port.now()
    }

    fn ask(&mut self, task: PersonTask) -> Result<(), Stop> {
        self.hand.send(task).unwrap();
        self.port.ask(task)
    }

    fn patience(&self) -> Duration {
        Duration::from_secs(4)
    }

    fn again(&mut self, failed: CommissionStep, back: CommissionStep) -> bool {
        self.port.again(failed, back)
    }
}

/// Does the first steps with a person who types `answers`, one each time when asked; returns how it ended, and the
/// steps.
fn commissioned(
    planted: Option<Planted>,
    answers: &'static [&'static str],
    is_stopped: bool,
) -> (Result<(), Stop>, Vec<(CommissionStep, bool)>) {
    let rig = Rig::from_path(Path::new(&path_of(SINGLE))).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let (hand, tasks) = channel();
    std::thread::scope(|threads| {
        let (rig, table, listener) = (&rig, &table, &listener);
        threads.spawn(move || serve(listener, rig, table, planted, &tasks));
        let (typed, said) = channel();
        let mut answers = answers.iter();
        // The person reads that Enter is asked for, and answers, or goes away.
        let mut typed = Some(typed);
        let show = move |_: &str| match (answers.next(), &typed) {
            (Some(answer), Some(typed)) => typed.send((*answer).to_owned()).unwrap(),
            _ => typed = None,
        };
        let stop = Arc::new(AtomicBool::new(false));
        stop.store(is_stopped, Ordering::Relaxed);
        let port = AtPort::new(SerialLine::open(&address).unwrap(), said, stop, Box::new(show));
        let mut machine = Heard { port, hand };
        let mut journal = Journal::new(CommissionRecord::new(rig, &address), None, Box::new(|_| ()));
        let plan =
            CommissionPlan { rig, table, file: Path::new("rig.toml"), text: "", seconds: 10.0, seed: 1 };
        let steps = [CommissionStep::Connect, CommissionStep::Contacts];
        let result = Commissioning::new(plan).run(&mut machine, &mut journal, &steps);
        (result, journal.record.steps.iter().map(|step| (step.step, step.passed)).collect())
    })
}

#[test]
fn a_person_at_a_port_is_led_through_the_contacts() {
    let (result, steps) = commissioned(None, &[""], false);
    assert!(result.is_ok(), "{result:?}");
    assert_eq!(steps, [(CommissionStep::Connect, true), (CommissionStep::Contacts, true)]);
}

#[test]
fn a_person_at_a_port_may_go_back_to_a_step_and_give_up() {
    let planted = "limit-switches-exchanged".parse().unwrap();
    let (result, steps) = commissioned(Some(planted), &["r", ""], false);
    assert!(
        matches!(&result, Err(Stop::Machine(words)) if words.contains("exchange the wires")),
        "{result:?}"
    );
    assert_eq!(
        steps,
        [
            (CommissionStep::Connect, true),
            (CommissionStep::Contacts, false),
            (CommissionStep::Contacts, false)
        ]
    );
}

#[test]
fn nobody_at_the_terminal_and_ctrl_c_end_it() {
    let (result, steps) = commissioned(None, &[], false);
    assert!(
        matches!(result, Err(Stop::Aborted)) && steps.last() == Some(&(CommissionStep::Contacts, false)),
        "{result:?}"
    );
    let (result, steps) = commissioned(None, &[""], true);
    assert!(
        matches!(result, Err(Stop::Aborted)) && steps == [(CommissionStep::Connect, false)],
        "{result:?}"
    );
}
