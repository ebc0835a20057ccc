//! How the columns of a table are to be read, where their names leave it open.

/// What the angles of a table are measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleReference {
    /// Each against the vertical.
    Absolute,
    /// Each against the link below, the first against the vertical.
    Relative,
}

/// Where the angles of a table are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleZero {
    /// With all links upright.
    Upright,
    /// With all links hanging.
    Hanging,
}

/// How the columns of a table are to be read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Reading {
    /// Names of the columns, instead of those in the file.
    pub columns: Vec<String>,
    /// Time from one row to the next (s), if no column has the time.
    pub period_s: Option<f64>,
    /// What the angles are measured against.
    pub angles: Option<AngleReference>,
    /// Where the angles are 0.
    pub zero: Option<AngleZero>,
    /// Names of the columns that count in the other sense.
    pub reversed: Vec<String>,
    /// Counts per turn of the columns in counts, instead of those in the rig file.
    pub counts_per_turn: Option<f64>,
    /// Whether the cart cannot move.
    pub is_clamped: bool,
}
