//! Why a table is refused.

/// Reason for refusing a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableError {
    /// Written for another version of the layout.
    Format,
    /// The stored number of states or sensors differs from that of the type, or a state index is out of range.
    Dimensions,
    /// The checksum does not match the contents.
    Crc,
    /// The swing-up is that of another rig than the gains.
    RigHash,
    /// The swing-up is for another control period than the gains.
    Tick,
    /// A share of the pending force that is not from 0 to 1.
    Delay,
    /// A value is not finite, or a limit, supply or step is not positive.
    Value,
    /// The table holds no control law.
    NoLaw,
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            TableError::Format => "the table has another layout: run `upright design` of this version again",
            TableError::Dimensions => "the table's numbers of states and sensors are not those of this build",
            TableError::Crc => {
                "the table's checksum is wrong: it was changed or damaged, run `upright design` again"
            }
            TableError::RigHash => "the swing-up was designed for another rig than the gains",
            TableError::Tick => "the swing-up was designed for another control period than the gains",
            TableError::Delay => "the table's share of the pending force is not from 0 to 1",
            TableError::Value => {
                "the table holds a value that is not finite, or a limit that is not positive"
            }
            TableError::NoLaw => "the table holds no control law",
        })
    }
}

impl core::error::Error for TableError {}
