//! The format of gain tables.

/// Version of the layout of [`GainTable`](super::GainTable); a table with another version is refused.
pub const TABLE_FORMAT: u32 = crate::table_format!(18);

/// The format of a generated gain table, if it is [`TABLE_FORMAT`]. Any other one is an error at compile time that says
/// what to do:
///
/// ```
/// assert_eq!(upright::table_format!(18), upright::table::TABLE_FORMAT);
/// ```
/// ```compile_fail
/// let format = upright::table_format!(17); // a table that an older version has written
/// ```
#[macro_export]
macro_rules! table_format {
    (18) => {
        18
    };
    ($other:literal) => {
        compile_error!(concat!(
            "this gain table has format ",
            $other,
            ", but this version of `upright` has another one: write the table again with `upright design RIG` of the \
             same version; if it is src/gains.rs of the tool's own checkout, put the committed one back first: `git \
             checkout src/gains.rs`"
        ))
    };
}
