//! The monitor and the firmware over a line that loses frames.

use std::collections::VecDeque;
use std::time::Duration;

use upright::board::Contacts;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{Pins, with_firmware};
use upright_tool::monitor::{Monitor, MonitorAction};

use crate::published::rig_and_table;

/// One direction of the line.
struct Direction {
    percent_lost: u64,
    seed: u64,
    partial: Vec<u8>,
}

impl Direction {
    fn new(percent_lost: u64, seed: u64) -> Self {
        Self { percent_lost, seed, partial: Vec::new() }
    }

    /// The frames of these bytes that arrive.
    fn pass(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut arrived = Vec::new();
        for &byte in bytes {
            self.partial.push(byte);
            if byte == 0 {
                self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                if self.seed >> 33 & 0xffff >= self.percent_lost * 0x1_0000 / 100 {
                    arrived.append(&mut self.partial);
                }
                self.partial.clear();
            }
        }
        arrived
    }
}

/// Runs the firmware, with its links hanging, and a monitor for `duration_ms`; `each` is called before each tick.
fn talk(
    percent_lost: u64,
    duration_ms: u64,
    mut each: impl FnMut(u64, Duration, &mut Monitor, &mut [Direction; 2]),
) -> Monitor {
    let (rig, table) = rig_and_table("single-quanser-ip02").clone();
    assert_eq!(rig.tick.period_s, 0.002);
    let mut pins = Pins {
        raw_counts: heapless::Vec::from_slice(&vec![0; table.sensors()]).unwrap(),
        supply_v: 24.0,
        contacts: Contacts::default(),
        received: heapless::Vec::new(),
        injected_fault: None,
    };
    let mut line = [Direction::new(percent_lost, 1), Direction::new(percent_lost, 2)];
    let mut monitor = Monitor::new("a line");
    let (mut waiting, mut serial) = (VecDeque::new(), Vec::new());
    with_firmware(&table, |target| {
        for ms in (0..duration_ms).step_by(2) {
            let now = Duration::from_secs(1_800_000_000) + Duration::from_millis(ms);
            each(ms, now, &mut monitor, &mut line);
            monitor.poll(now);
            waiting.extend(line[0].pass(&monitor.take_outgoing()));
            pins.received.clear();
            while !pins.received.is_full()
                && let Some(byte) = waiting.pop_front()
            {
                pins.received.push(byte).unwrap();
            }
            serial.clear();
            target.tick(&pins, &mut serial).unwrap();
            monitor.receive(&line[1].pass(&serial), now);
        }
    })
    .unwrap();
    monitor
}

fn lines<'a>(monitor: &'a Monitor, with: &'a str) -> impl Iterator<Item = &'a String> {
    monitor.log.iter().filter(move |line| line.contains(with))
}

#[test]
fn every_command_is_answered_over_a_line_that_loses_a_third_of_the_frames() {
    let laws = |number: u64| if number.is_multiple_of(2) { Law::PolePlacement } else { Law::Lqr };
    for percent_lost in [0, 33] {
        let monitor = talk(percent_lost, 10_500, |ms, now, monitor, _| {
            // 20 commands, 500 ms apart; each has taken effect before the next.
            if ms % 500 == 0 && ms > 0 {
                let number = ms / 500;
                if number > 1 {
                    let law = monitor.telemetry.as_ref().map(|telemetry| telemetry.law);
                    assert_eq!(law, Some(laws(number - 1)), "{percent_lost} %, command {}", number - 1);
                }
                monitor.act(MonitorAction::Send(Request::Select(laws(number))), now);
            }
        });
        assert_eq!(lines(&monitor, "law").filter(|line| line.ends_with("done")).count(), 20);
        assert_eq!(lines(&monitor, "not answered").count(), 0);
        // The negative control: frames are really lost, and commands come more than once.
        let statistics = monitor.statistics.unwrap();
        assert_eq!(statistics.replayed > 0, percent_lost > 0, "{statistics:?}");
    }
}

#[test]
fn a_line_that_is_cut_is_reported_and_only_disarming_waits_for_it() {
    let monitor = talk(0, 8_000, |ms, now, monitor, line| {
        let cut = (1_000..5_000).contains(&ms);
        line.iter_mut().for_each(|direction| direction.percent_lost = if cut { 100 } else { 0 });
        match ms {
            900 | 1_100 => monitor.act(MonitorAction::Send(Request::HomeRail), now),
            // Homing began before the cut. What was asked for during the cut is given up.
            2_500 => {
                assert_eq!(lines(monitor, "done").count(), 1);
                assert_eq!(lines(monitor, "not answered, given up").count(), 1, "{:?}", monitor.log);
                monitor.act(MonitorAction::Send(Request::HomeRail), now);
            }
            2_600 => monitor.act(MonitorAction::Send(Request::Disarm), now),
            4_998 => {
                let told = lines(monitor, "disarm: not answered, it is repeated").count();
                assert_eq!(told, 1, "{:?}", monitor.log);
                assert_eq!(monitor.telemetry.as_ref().map(|told| told.state), Some(State::Homing));
            }
            5_100 => {
                assert_eq!(lines(monitor, "disarm: done").count(), 1, "{:?}", monitor.log);
                assert_eq!(monitor.telemetry.as_ref().map(|told| told.state), Some(State::Disarmed));
            }
            _ => {}
        }
    });
    // Nothing that was asked for earlier takes effect after the disarming.
    assert_eq!(monitor.telemetry.as_ref().map(|told| told.state), Some(State::Disarmed));
    assert_eq!(lines(&monitor, "home").filter(|line| line.ends_with("done")).count(), 1);
}
