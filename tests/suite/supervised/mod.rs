//! Brings the rigs of `rigs/` to balance with the whole firmware.

use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Cause;
use upright_closed_loop::harness::{HarnessError, World, with_firmware};
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
    test: impl FnOnce(&mut World<'_>) -> R,
) -> Result<R, HarnessError> {
    with_firmware(values, |target| {
        let mut world = World::new(rig, values, scenario, target)?;
        let output = world.raise(None)?;
        world.bench.tick(output.drive);
        Ok(test(&mut world))
    })?
}

/// One tick of firmware and rig.
pub(crate) fn tick(world: &mut World<'_>) -> Output {
    let inputs = world.inputs();
    let output = world.session.tick(&inputs).unwrap();
    world.bench.tick(output.drive);
    output
}

/// Sends a request and runs firmware and rig until the answer arrives.
pub(crate) fn ask(world: &mut World<'_>, request: Request) -> Answer {
    let id = world.session.send(request);
    for _ in 0..3 {
        tick(world);
        while let Some((answered, answer)) = world.session.next_reply() {
            if answered == id {
                return answer;
            }
        }
    }
    panic!("no answer to {request:?}")
}

/// The first cause of the fault.
pub(crate) fn cause(world: &mut World<'_>) -> Option<Cause> {
    match ask(world, Request::Cause) {
        Answer::Cause(cause) => cause,
        other => panic!("{other:?}"),
    }
}

/// Number of measurements that the firmware has rejected so far.
pub(crate) fn rejected(world: &mut World<'_>) -> u32 {
    match ask(world, Request::Statistics) {
        Answer::Statistics(statistics) => statistics.rejected_samples,
        other => panic!("{other:?}"),
    }
}
