//! Errors in a rig file. Each names the place, the key, what was found and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Largest rig file accepted (bytes): a hundred times the size of the longest realistic one.
pub const MAX_BYTES: u64 = 1 << 20;

/// A rig file that cannot be used.
///
/// Printed as `file:line:column: key: what is wrong; remedy`. Entries of lists count from 1, as joints do:
/// `link[2].mass_kg` is the mass of the second link.
#[derive(Debug, Clone, PartialEq, Error)]
pub struct RigError {
    /// The file, as named by the caller.
    pub file: PathBuf,
    /// Position in the file; none for an error about the file as a whole.
    pub place: Option<Place>,
    /// The key in full, such as `link[2].mass_kg`; none for an error that is about no key.
    pub key: Option<String>,
    /// What is wrong with it.
    pub kind: Box<RigErrorKind>,
}

/// A position in a text file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// What is wrong with a rig file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RigErrorKind {
    /// There is no such file.
    #[error("no such file; check the path, or copy one of the files in rigs/")]
    NoFile,
    /// The path names a directory.
    #[error("this is a directory; name a rig file (*.toml) in it")]
    Directory,
    /// The operating system refuses to read the file.
    #[error("cannot be read ({reason}); check its permissions")]
    Unreadable {
        /// The operating system's reason.
        reason: String,
    },
    /// The file is too large to be a rig file.
    #[error(
        "more than {MAX_BYTES} bytes, accepted: at most that many; a rig file is a page of text, check the path"
    )]
    TooLarge,
    /// The file is not text.
    #[error("byte {offset} is not UTF-8; save the file as UTF-8 text")]
    NotUtf8 {
        /// Offset of the first bad byte, from 0.
        offset: usize,
    },
    /// The text is in a format of other programs.
    #[error(
        "this is {format}, accepted: TOML; `upright import` reads URDF; otherwise copy one of the files in rigs/ and type \
         lengths, masses and inertias into it"
    )]
    OtherFormat {
        /// Name of the format.
        format: &'static str,
    },
    /// The text is not TOML.
    #[error("not TOML: {message}; a line is `[table]`, `key = value` or `# comment`")]
    NotToml {
        /// The parser's message.
        message: String,
    },
    /// A key or table is given twice.
    #[error("given twice; keep one of the two")]
    Duplicate,
    /// No such key or table.
    #[error("unknown; {}accepted here: {accepts}", suggest(.suggestion))]
    UnknownKey {
        /// The key that was probably meant.
        suggestion: Option<String>,
        /// All keys accepted at this place.
        accepts: String,
    },
    /// A required key or table is missing.
    #[error("missing; add {remedy}")]
    MissingKey {
        /// What to add.
        remedy: String,
    },
    /// The value is of another type.
    #[error("found {found}, accepted: {accepts}; {remedy}")]
    WrongType {
        /// The value as written in the file.
        found: String,
        /// What is accepted.
        accepts: String,
        /// What to do.
        remedy: String,
    },
    /// A list is too short or too long.
    #[error("found a list of {found}, accepted: {accepts}; {remedy}")]
    WrongLength {
        /// Number of entries in the file.
        found: usize,
        /// The accepted number.
        accepts: String,
        /// What to do.
        remedy: String,
    },
    /// The value is not a finite number.
    #[error("found {found}, accepted: a finite number; {remedy}")]
    NotFinite {
        /// The value as written in the file.
        found: String,
        /// What to do.
        remedy: String,
    },
    /// The value is physically impossible or outside the range that the design handles.
    #[error("found {found}, accepted: {accepts}; {remedy}")]
    OutOfRange {
        /// The value as written in the file.
        found: String,
        /// What is accepted.
        accepts: String,
        /// What to do.
        remedy: String,
    },
    /// A part of the program is made for carts alone.
    #[error(
        "{part} takes [cart] alone; near upright, an arm of this length is a cart in other numbers: mass_kg and friction are \
         those of the arm divided by radius_m², travel and encoder step are multiplied by it"
    )]
    CartOnly {
        /// The part.
        part: &'static str,
    },
    /// Two keys or tables exclude each other.
    #[error("given together with {other}; {remedy}")]
    Conflict {
        /// The other key or table.
        other: String,
        /// What to do.
        remedy: String,
    },
    /// The number of poles is not the number of states: no gain places them.
    #[error("the number of poles is {found}, accepted: {accepts}; {remedy}")]
    PoleCount {
        /// Number of poles in the file.
        found: usize,
        /// The accepted number.
        accepts: String,
        /// What to do.
        remedy: String,
    },
    /// A complex pole without its conjugate: no real gain places it.
    #[error("pole {pole} stands alone, accepted: complex poles in exact conjugate pairs; add {conjugate}")]
    UnpairedPole {
        /// The pole, as `[re, im]`.
        pole: String,
        /// The pole to add.
        conjugate: String,
    },
}

impl RigErrorKind {
    /// The same with other words in what is accepted and what to do.
    pub(super) fn worded(mut self, words: &dyn Fn(&str) -> String) -> Self {
        let texts = match &mut self {
            Self::UnknownKey { accepts, .. } => vec![accepts],
            Self::MissingKey { remedy } | Self::NotFinite { remedy, .. } | Self::Conflict { remedy, .. } => {
                vec![remedy]
            }
            Self::WrongType { accepts, remedy, .. }
            | Self::WrongLength { accepts, remedy, .. }
            | Self::OutOfRange { accepts, remedy, .. }
            | Self::PoleCount { accepts, remedy, .. } => vec![accepts, remedy],
            _ => Vec::new(),
        };
        texts.into_iter().for_each(|text| *text = words(text));
        self
    }
}

impl RigError {
    /// An error about the file as a whole.
    pub(super) fn of_file(file: &Path, kind: RigErrorKind) -> Self {
        RigError { file: file.to_owned(), place: None, key: None, kind: Box::new(kind) }
    }

    /// The exit code of a program that stops on this error: 2 for a bad file, 3 for a design problem without solution.
    pub fn exit_code(&self) -> u8 {
        match *self.kind {
            RigErrorKind::PoleCount { .. } | RigErrorKind::UnpairedPole { .. } => 3,
            _ => 2,
        }
    }
}

impl fmt::Display for RigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(Place { line, column }) = self.place {
            write!(f, ":{line}:{column}")?;
        }
        if let Some(key) = &self.key {
            write!(f, ": {key}")?;
        }
        write!(f, ": {}", self.kind)
    }
}

fn suggest(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|key| format!("did you mean `{key}`? ")).unwrap_or_default()
}
