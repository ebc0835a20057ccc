//! Checks the text of a rig file and builds a [`Rig`] from it.

use super::base::Base;
use super::error::RigError;
use super::key::Section;
use super::node::{Node, RigSource, Table};
use super::sections::chain::CartInput;
use super::sections::{
    SECTIONS, TOP, actuator, chain, friction, integral, kalman, limits, lqr, model, pole_placement, reality,
    robust, swing_up, tick, verify,
};
use super::value::Keys;
use super::{Actuator, Integral, Limits, PlantDescription, Reality, Rig, Tick};
use crate::number::significant;

/// Checks a whole rig file.
pub(super) fn rig(source: &RigSource<'_>) -> Result<Rig, RigError> {
    let document = source.document()?;
    let base = Base::of(&document);
    let source = &RigSource { base, ..*source };
    let root = Table::root(source, &document, &TOP, &SECTIONS.map(|section| section.name))?;
    let name = name(&root)?;
    let given = |section: &Section| root.get(section.name);
    let tick = scalars(&root, &tick::TICK)?.unwrap_or_else(Tick::default);
    let actuator = given(&actuator::ACTUATOR)
        .map_or(Ok(Actuator::default()), |node| actuator::actuator(&node, &tick))?;
    let input = actuator.input();
    let plant = chain::plant(&root, input)?;
    let states = plant.states();
    let reality = |node: Node<'_>| reality::reality(&node, &plant, tick.period_s, actuator.motor().is_some());
    let reality = given(&reality::REALITY).map_or(Ok(Reality::default().on(base)), reality)?;
    let (verify, must_survive) = given(&verify::VERIFY)
        .map_or(Ok(Default::default()), |node| verify::verify(&node, &actuator, &reality))?;
    let rig = Rig {
        name,
        robust: given(&robust::ROBUST)
            .map(|node| robust::robust(&node, &plant, tick.period_s))
            .transpose()?,
        lqr: given(&lqr::LQR)
            .map(|node| lqr::lqr(&node, states, matches!(plant, PlantDescription::Chain(_)), input))
            .transpose()?,
        pole_placement: given(&pole_placement::POLE_PLACEMENT)
            .map(|node| pole_placement::pole_placement(&node, states))
            .transpose()?,
        kalman: given(&kalman::KALMAN).map(|node| kalman::kalman(&node, &plant, input)).transpose()?,
        integral: scalars::<Integral>(&root, &integral::INTEGRAL)?,
        friction: given(&friction::FRICTION)
            .map(|node| friction::friction(&node, &plant, given(&kalman::KALMAN).is_some()))
            .transpose()?,
        limits: given(&limits::LIMITS)
            .map_or(Ok(Limits::default()), |node| limits::limits(&node, &plant, input))?,
        verify,
        must_survive,
        reality,
        actuator,
        tick,
        swing_up: given(&swing_up::SWING_UP).map(|node| swing_up::swing_up(&node, input)).transpose()?,
        plant,
    };
    if rig.kalman.is_some() {
        position_is_measured(&root, &rig.plant)?;
    }
    turns_are_counted(&root, &rig)?;
    Ok(rig)
}

/// A section of scalars, if given.
fn scalars<T: Keys>(root: &Table<'_>, section: &'static Section) -> Result<Option<T>, RigError> {
    root.get(section.name).map(|node| T::read(&node.table(section)?)).transpose()
}

/// The name is stored in the gain table and printed on terminals, so it must be short and printable.
fn name(root: &Table<'_>) -> Result<String, RigError> {
    const LONGEST: usize = 64;
    const MEANING: &str = "`name = \"...\"`, the name of the rig, at the top of the file";
    let accepts = TOP.key("name").rule.accepts;
    let node = root.need("name", MEANING)?;
    let name = node.text(accepts, "the name in quotes")?;
    let plain = name.replace(['"', '\'', '\\'], "_");
    let printable = plain.escape_debug().eq(plain.chars());
    if name.trim().is_empty() || name.len() > LONGEST || !printable {
        return Err(
            node.out_of_range(accepts, "shorten it, and leave out line breaks and control characters")
        );
    }
    Ok(name.to_owned())
}

/// Between two readings, an absolute sensor of the cart must turn by less than half a turn.
fn turns_are_counted(root: &Table<'_>, rig: &Rig) -> Result<(), RigError> {
    let cart = rig.chain().map(|chain| &chain.cart);
    let Some((bits, step_m)) = cart.and_then(|cart| cart.sensor_bits.zip(cart.encoder_step_m)) else {
        return Ok(());
    };
    let in_a_tick_m = rig.limits.speed_m_per_s.unwrap_or_default() * rig.tick.period_s;
    let least = 2.0 * in_a_tick_m / bits.exp2();
    if step_m > least {
        return Ok(());
    }
    let accepts = format!("a number > {}: less than half a turn in a tick", significant(least, 3));
    let remedy = "use a larger pulley, or lower speed_m_per_s of [limits] or period_s of [tick]";
    let cart = root.need("cart", "[cart]")?.table(&chain::CART)?;
    Err(cart.required("encoder_step_m")?.out_of_range(&accepts, remedy))
}

/// An observer needs the resolution of its sensors, and no observer can find the cart's position from the angles
/// alone.
fn position_is_measured(root: &Table<'_>, plant: &PlantDescription) -> Result<(), RigError> {
    match plant {
        PlantDescription::Chain(chain)
            if chain.input == CartInput::Force && chain.cart.encoder_step_m.is_none() =>
        {
            Err(root
                .need("cart", "[cart]")?
                .table(&chain::CART)?
                .missing("encoder_step_m", "the travel per encoder count in m: [kalman] needs it"))
        }
        PlantDescription::Model(model) if model.measured_steps.is_empty() => Err(root
            .need("model", "[model]")?
            .table(&model::MODEL)?
            .missing("measured_steps", "the step of each sensor: [kalman] needs them")),
        _ => Ok(()),
    }
}
