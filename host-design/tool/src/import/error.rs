//! Why a file cannot be imported.

use upright_design::rig::RigError;

/// Why a file cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The text is not XML.
    #[error("this is no XML: {0}; a macro (xacro) has to be expanded first")]
    Xml(#[from] roxmltree::Error),
    /// It is XML, but no URDF.
    #[error("the outermost element is <{0}>, that of a URDF is <robot>")]
    NotUrdf(String),
    /// An element or an attribute is missing.
    #[error("line {line}: <{element}> has no {what}")]
    Missing {
        /// Line of the file.
        line: u32,
        /// Name of the element.
        element: String,
        /// What it should have.
        what: &'static str,
    },
    /// Something that should be numbers is not.
    #[error("line {line}: {attribute} = {value:?}: numbers wanted here: {count}")]
    Numbers {
        /// Line of the file.
        line: u32,
        /// Name of the attribute.
        attribute: &'static str,
        /// What it says.
        value: String,
        /// How many numbers it should have.
        count: usize,
    },
    /// A joint names a link that is not there.
    #[error("joint {joint:?} names the link {link:?}, which is not in the file")]
    NoLink {
        /// Name of the joint.
        joint: String,
        /// Name of the link.
        link: String,
    },
    /// Not exactly one link is the child of no joint.
    #[error("these links are the child of no joint: {0}; exactly one has to be, which stands on the ground")]
    Roots(String),
    /// Two joints move on the same link.
    #[error(
        "joint {first:?} and joint {second:?} move on the same link: only a cart and a chain of hinges can be imported"
    )]
    Branch {
        /// Name of a joint.
        first: String,
        /// Name of the other one.
        second: String,
    },
    /// The machine has no cart, or no hinge.
    #[error("there is no {0}: a cart and a chain of hinges can be imported")]
    TooShort(&'static str),
    /// A joint is of another type than the chain needs there.
    #[error("joint {joint:?} is {kind}, here is needed: {needed}")]
    Type {
        /// Name of the joint.
        joint: String,
        /// Its type.
        kind: String,
        /// What is needed.
        needed: &'static str,
    },
    /// The first joint turns about a vertical axis.
    #[error(
        "joint {0:?} turns about a vertical axis: this is a rotary pendulum, no cart on a rail. Near upright it is a cart in \
         other numbers: see \"A rotary base\" in docs/other-machines.md"
    )]
    Rotary(String),
    /// A joint points in a direction that the chain does not allow.
    #[error("joint {joint:?}: its axis has to be {needed}")]
    Axis {
        /// Name of the joint.
        joint: String,
        /// What is needed.
        needed: &'static str,
    },
    /// A link's centre of mass is not on the line between its joints.
    #[error(
        "joint {joint:?}: the centre of mass of its link is {off_m:.4} m off the line from this joint to the next; on the line it could be imported"
    )]
    OffLine {
        /// Name of the joint.
        joint: String,
        /// Distance from the line (m).
        off_m: f64,
    },
    /// A moving body has no mass, or its centre of mass is in its joint.
    #[error("joint {joint:?}: its link has no {what}")]
    Without {
        /// Name of the joint.
        joint: String,
        /// What is missing.
        what: &'static str,
    },
    /// The rig file would not be valid.
    #[error(transparent)]
    Rig(#[from] RigError),
}
