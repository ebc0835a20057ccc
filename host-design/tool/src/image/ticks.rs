//! How long the ticks of rigs take that share the code of an image, so that only one of them has to be measured.

use std::path::{Path, PathBuf};

use super::checksum::file_hash;

/// The longest tick of any rig, by the longest one of another rig with the same code. Measured for all rigs in `rigs/`
/// and variants of one, the largest ratio is 1.15: known friction adds 6 %, a force instead of a voltage 8 %, and a
/// tick of 5 ms, in which the caches of the flash are emptied by the check of memory, 6 %.
pub const SPREAD: f64 = 1.25;

/// The longest tick that was measured with the code of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClassTicks {
    longest_ns: Option<u64>,
    /// The file that keeps it, and the checksum of the code.
    note: Option<(PathBuf, String)>,
}

impl ClassTicks {
    /// What is kept for the code in the file `elf`, which has these bytes. A tool that was built after that measures
    /// again: its model of the processor may have changed.
    pub(super) fn kept(elf: &Path, code: &[u8]) -> Self {
        let (path, hash) = (elf.with_extension("longest-tick"), file_hash(code));
        let changed = |path: &Path| std::fs::metadata(path).and_then(|about| about.modified());
        let tool = std::env::current_exe().and_then(|tool| changed(&tool));
        let is_current = matches!((changed(&path), tool), (Ok(noted), Ok(built)) if noted > built);
        let noted = std::fs::read_to_string(&path).ok().filter(|_| is_current);
        let longest_ns = noted.and_then(|noted| {
            let (longest_ns, of) = noted.split_once(' ')?;
            longest_ns.parse().ok().filter(|_| of == hash)
        });
        Self { longest_ns, note: Some((path, hash)) }
    }

    /// None that was measured, and none that will be kept.
    pub fn unknown() -> Self {
        Self::known(None)
    }

    /// Those of code that was measured elsewhere (ns).
    pub(super) fn known(longest_ns: Option<u64>) -> Self {
        Self { longest_ns, note: None }
    }

    /// The longest tick of those that were measured (ns).
    pub(super) fn longest_ns(&self) -> Option<u64> {
        self.longest_ns
    }

    /// No tick of any rig with this code takes longer (µs); `None` if none has been measured.
    pub fn bound_us(&self) -> Option<f64> {
        self.longest_ns.map(|longest_ns| longest_ns as f64 * 1e-3 * SPREAD)
    }

    /// Keeps the longest tick of a rig (µs), if it is longer than those before.
    pub fn keep(&mut self, longest_us: f64) {
        let longest_ns = ((longest_us * 1e3).ceil() as u64).max(self.longest_ns.unwrap_or(0));
        self.longest_ns = Some(longest_ns);
        if let Some((path, hash)) = &self.note {
            // Without the note, the next rig is measured, too.
            let _ = std::fs::write(path, format!("{longest_ns} {hash}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_tick_of_all_is_kept_for_this_code_alone() {
        let folder = tempfile::tempdir().unwrap();
        let elf = folder.path().join("image.elf");
        let mut ticks = ClassTicks::kept(&elf, b"code");
        assert_eq!(ticks.bound_us(), None);
        for longest_us in [30.0, 40.0, 35.0] {
            ticks.keep(longest_us);
        }
        assert_eq!(ticks.bound_us(), Some(40.0 * SPREAD));
        assert_eq!(ClassTicks::kept(&elf, b"code"), ticks);
        assert_eq!(ClassTicks::kept(&elf, b"other code").bound_us(), None);
    }

    #[test]
    fn a_tool_that_was_built_later_measures_again() {
        let folder = tempfile::tempdir().unwrap();
        let elf = folder.path().join("image.elf");
        ClassTicks::kept(&elf, b"code").keep(30.0);
        let note =
            std::fs::File::options().write(true).open(folder.path().join("image.longest-tick")).unwrap();
        note.set_modified(std::time::UNIX_EPOCH).unwrap();
        assert_eq!(ClassTicks::kept(&elf, b"code").bound_us(), None);
    }
}
