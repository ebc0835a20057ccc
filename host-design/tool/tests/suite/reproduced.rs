//! One run of `upright reproduce`, with which several tests compare: it takes many seconds.

use std::collections::BTreeMap;
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;

/// What the command printed and wrote.
pub(crate) struct Reproduced {
    pub(crate) output: Output,
    /// Names and contents of the files.
    pub(crate) files: BTreeMap<String, Vec<u8>>,
    /// `numbers.json`.
    pub(crate) numbers: Value,
}

/// The command, started in a folder that is not the checkout.
pub(crate) static REPRODUCED: LazyLock<Reproduced> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_upright"))
        .args(["reproduce", "--out", "new/folder"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let entries = std::fs::read_dir(folder.path().join("new/folder")).unwrap();
    let read = |entry: std::fs::DirEntry| {
        (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
    };
    let files: BTreeMap<_, _> = entries.map(|entry| read(entry.unwrap())).collect();
    let numbers = serde_json::from_slice(&files["numbers.json"]).unwrap();
    Reproduced { output, files, numbers }
});

impl Reproduced {
    /// A file as text.
    pub(crate) fn text(&self, name: &str) -> &str {
        std::str::from_utf8(&self.files[name]).unwrap()
    }
}
