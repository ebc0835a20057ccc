//! How long it takes here to compile an image, so that one who waits is told what is left.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// The first compilation, of all libraries, on two cores of 2024.
const FIRST: Duration = Duration::from_secs(60);
/// A later one, before any is known.
const LATER: Duration = Duration::from_secs(15);

/// How long the next compilation for a `target` usually takes, if it is the first one or not; `images` is the folder in
/// which images are kept.
pub(super) fn duration(images: &Path, target: &str, is_first: bool) -> Duration {
    if is_first {
        return FIRST;
    }
    let known = std::fs::read_to_string(note(images, target)).ok();
    let millis = known.and_then(|known| known.trim().parse().ok());
    millis.map_or(LATER, Duration::from_millis)
}

/// Notes how long a compilation that was not the first one has taken.
pub(super) fn keep(images: &Path, target: &str, taken: Duration) {
    // Without the note, LATER is told.
    let _ = std::fs::write(note(images, target), taken.as_millis().to_string());
}

fn note(images: &Path, target: &str) -> PathBuf {
    images.join(format!("usual-{target}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_compilation_tells_how_long_the_next_one_takes_unless_it_is_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let images = folder.path();
        assert_eq!(duration(images, "m4", true), FIRST);
        assert_eq!(duration(images, "m4", false), LATER);
        keep(images, "m4", Duration::from_millis(7300));
        assert_eq!(duration(images, "m4", false), Duration::from_millis(7300));
        assert_eq!(duration(images, "m4", true), FIRST, "the libraries were removed");
        assert_eq!(duration(images, "m0", false), LATER, "of another target");
        std::fs::write(images.join("usual-m4"), "no number").unwrap();
        assert_eq!(duration(images, "m4", false), LATER);
    }
}
