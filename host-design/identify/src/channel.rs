//! The channels of a log: the encoders of the cart and of the joints.

use upright_design::rig::{Chain, Rig};

use crate::error::IdentifyError;

/// The chain of a rig whose cart and links all have an encoder.
pub(crate) fn chain_of(rig: &Rig) -> Result<&Chain, IdentifyError> {
    rig.chain()
        .filter(|chain| rig.sensors().len() == chain.links.len() + 1)
        .ok_or_else(|| IdentifyError::NoEncoders(rig.name.clone()))
}

/// Name of a channel: the cart, or a joint counted from 1.
pub(crate) fn channel_name(channel: usize) -> String {
    if channel == 0 { "the cart".to_owned() } else { format!("joint {channel}") }
}
