//! Brings the rigs of `rigs/` to balance with the whole firmware.

use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Cause;
use upright_closed_loop::harness::{Harness, HarnessError, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

pub(crate) const ALL_RIGS: [&str; 4] =
    ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"];

pub(crate) fn rig(name: &str) -> Rig {
    Rig::from_path(format!("{}/../rigs/{name}.toml", env!("CARGO_MANIFEST_DIR")).as_ref()).unwrap()
}

/// Brings the rig from hanging to balance at the start of `scenario`, releases it, and continues with `test` after the
/// first tick of balancing.
pub(crate) fn balancing<R>(
    rig: &Rig,
    values: &TableValues,
    scenario: &Scenario,
    test: impl FnOnce(&mut Harness<'_>) -> R,
) -> Result<R, HarnessError> {
    with_firmware(values, |target| {
        let mut harness = Harness::new(rig, values, scenario, target)?;
        let output = harness.raise(None)?;
        harness.bench.tick(output.drive);
        Ok(test(&mut harness))
    })?
}

/// One tick of firmware and rig.
pub(crate) fn tick(harness: &mut Harness<'_>) -> Output {
    let inputs = harness.inputs();
    let output = harness.session.tick(&inputs).unwrap();
    harness.bench.tick(output.drive);
    output
}

/// Sends a request and runs firmware and rig until the answer arrives.
pub(crate) fn ask(harness: &mut Harness<'_>, request: Request) -> Answer {
    let id = harness.session.send(request);
    for _ in 0..3 {
        tick(harness);
        while let Some((answered, answer)) = harness.session.next_reply() {
            if answered == id {
                return answer;
            }
        }
    }
    panic!("no answer to {request:?}")
}

/// The first cause of the fault.
pub(crate) fn cause(harness: &mut Harness<'_>) -> Option<Cause> {
    match ask(harness, Request::Cause) {
        Answer::Cause(cause) => cause,
        other => panic!("{other:?}"),
    }
}

/// Number of measurements that the firmware has rejected so far.
pub(crate) fn rejected(harness: &mut Harness<'_>) -> u32 {
    match ask(harness, Request::Statistics) {
        Answer::Statistics(statistics) => statistics.rejected_samples,
        other => panic!("{other:?}"),
    }
}
