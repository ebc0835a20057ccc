//! Why a table of measurements cannot be used.

/// Why a table of measurements cannot be used. Lines and columns are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be opened or read; the text is that of the operating system.
    #[error("cannot be read ({0}); check path and permissions")]
    Unreadable(String),
    /// The file is neither a log of Upright nor text.
    #[error("is neither a log of Upright nor text; export it as CSV")]
    NotText,
    /// No row of numbers.
    #[error("holds no row of numbers; check the path")]
    Empty,
    /// The first line has numbers instead of names.
    #[error("line {line}: has no names of columns; give {fields} with --columns, as in --columns {example}")]
    NoHeader {
        /// Line.
        line: usize,
        /// Number of fields in it.
        fields: usize,
        /// Names for a table of the rig.
        example: String,
    },
    /// A line has another number of fields than there are columns.
    #[error(
        "line {line}: has {found} fields instead of {wanted}; {}", if *is_decimal { DECIMAL } else { FIELDS }
    )]
    Fields {
        /// Line.
        line: usize,
        /// Number of its fields.
        found: usize,
        /// Number of columns.
        wanted: usize,
        /// Whether the commas of numbers may have been taken for separators.
        is_decimal: bool,
    },
    /// A field is not a finite number.
    #[error("line {line}, column {column}: {text:?} is not a number; correct it, or cut the file there")]
    Number {
        /// Line.
        line: usize,
        /// Name of the column.
        column: String,
        /// The field.
        text: String,
    },
    /// The name of a column has no known meaning.
    #[error("column {column} ({name:?}): {problem}; {}", advice(columns))]
    Column {
        /// Number of the column.
        column: usize,
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: String,
        /// All names, with `-` for this one.
        columns: String,
    },
    /// A quantity is missing, or there is a choice that the names leave open.
    #[error("{what}: {remedy}")]
    Open {
        /// What is open.
        what: String,
        /// What to say.
        remedy: String,
    },
    /// A value contradicts what is said about the recording.
    #[error("line {line}, column {column}: {what}; {remedy}")]
    Contradicts {
        /// Line.
        line: usize,
        /// Name of the column.
        column: String,
        /// The contradiction.
        what: String,
        /// What to do.
        remedy: String,
    },
}

const FIELDS: &str = "correct the line, or the names of the columns";
const DECIMAL: &str = "with decimal commas, separate the columns by semicolons or tabs";

fn advice(columns: &str) -> String {
    format!(
        "names are time_s, x_m, angle_1_rad and so on (rad, deg, counts), force_n, voltage_v, duty, and - for a column that is \
         not used: --columns {columns}"
    )
}
