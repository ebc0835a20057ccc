//! Reuse of images from earlier builds whose sources have not changed since. Cargo itself keeps one image for each set
//! of features, and would compile it again whenever another rig's table was compiled in between.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

use super::checksum::file_hash;

/// Files in the folders of a crate and of the repository that decide what is compiled, beside the sources.
const SETTINGS: [&str; 4] = ["Cargo.toml", "Cargo.lock", "memory.x", ".cargo/config.toml"];

/// Environment variables, by the beginning of their names, that change what cargo compiles.
const VARIABLES: [&str; 3] = ["CARGO_BUILD_", "CARGO_PROFILE_", "CARGO_TARGET_THUMB"];

/// Whether `image` is as `cargo` made it, by the same call, and no file that it was made from has changed.
pub(super) fn is_current(image: &Path, cargo: &Command, version: &str) -> bool {
    let Ok(noted) = std::fs::read_to_string(note(image)) else { return false };
    let files = noted.lines().filter_map(|line| line.split_once("  ")).map(|(_, path)| PathBuf::from(path));
    origin(cargo, version, files).is_ok_and(|origin| origin == noted)
}

/// Notes what `image` was made from by the `cargo` that was started at `begin`: the files that the compiler lists in
/// `dependencies`, and the settings in `folders`. Nothing is noted, so that the next build compiles
/// again, if a file has changed since `begin`, or no source is listed.
pub(super) fn keep(
    image: &Path,
    cargo: &Command,
    version: &str,
    begin: SystemTime,
    dependencies: &Path,
    folders: &[&Path],
) -> std::io::Result<()> {
    let mut files = sources(&std::fs::read_to_string(dependencies)?);
    if files.is_empty() {
        return Ok(());
    }
    let settings = folders.iter().flat_map(|folder| SETTINGS.map(|name| folder.join(name)));
    files.extend(settings.filter(|path| path.exists()));
    for file in &files {
        if std::fs::metadata(file)?.modified()? >= begin {
            return Ok(());
        }
    }
    files.push(image.to_owned());
    std::fs::write(note(image), origin(cargo, version, files)?)
}

/// Forgets what `image` was made from.
pub(super) fn forget(image: &Path) {
    // If there is no note, there is nothing to forget.
    let _ = std::fs::remove_file(note(image));
}

fn note(image: &Path) -> PathBuf {
    image.with_extension("made-from")
}

/// The call, and each file with its checksum, one per line.
fn origin(
    cargo: &Command,
    version: &str,
    files: impl IntoIterator<Item = PathBuf>,
) -> std::io::Result<String> {
    let mut text = format!("{:?} {:?} of {version:?}\n", cargo.get_program(), cargo.get_args());
    let mut variables: Vec<_> = std::env::vars_os()
        .filter(|(name, _)| VARIABLES.iter().any(|begin| name.to_string_lossy().starts_with(begin)))
        .collect();
    variables.sort();
    text += &format!("{variables:?}\n");
    for file in files {
        text += &format!("{}  {}\n", file_hash(&std::fs::read(&file)?), file.display());
    }
    Ok(text)
}

/// The sources in a list as compilers write it for `make`: `TARGET: FILE FILE …`, with a backslash before a space in a
/// name.
fn sources(list: &str) -> Vec<PathBuf> {
    let Some((_, files)) = list.lines().next().and_then(|line| line.split_once(": ")) else {
        return Vec::new();
    };
    let files = files.replace("\\ ", "\0");
    files.split_whitespace().map(|file| PathBuf::from(file.replace('\0', " "))).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const VERSION: &str = "rustc 1.0";

    /// A folder with a source that has a space in its name, the settings and an image that were all made at some time.
    struct Folder {
        path: tempfile::TempDir,
        begin: SystemTime,
    }

    impl Folder {
        fn new() -> Self {
            let folder = Self {
                path: tempfile::tempdir().unwrap(),
                begin: SystemTime::now() + Duration::from_secs(1),
            };
            std::fs::create_dir(folder.file(".cargo")).unwrap();
            for name in SETTINGS.into_iter().chain(["a source.rs", "image.elf"]) {
                std::fs::write(folder.file(name), name).unwrap();
            }
            let source = folder.file("a source.rs").display().to_string().replace(' ', "\\ ");
            std::fs::write(folder.file("image.d"), format!("image: {source}\n")).unwrap();
            folder
        }

        fn file(&self, name: &str) -> PathBuf {
            self.path.path().join(name)
        }

        fn keep(&self, cargo: &Command) {
            let (image, list) = (self.file("image.elf"), self.file("image.d"));
            keep(&image, cargo, VERSION, self.begin, &list, &[self.path.path()]).unwrap();
        }

        fn is_current(&self, cargo: &Command) -> bool {
            is_current(&self.file("image.elf"), cargo, VERSION)
        }
    }

    fn call(features: &str) -> Command {
        let mut cargo = Command::new("cargo");
        cargo.args(["rustc", "--features", features]);
        cargo
    }

    #[test]
    fn an_image_is_current_until_anything_that_it_was_made_from_changes() {
        let folder = Folder::new();
        assert!(!folder.is_current(&call("a")), "nothing is noted yet");
        folder.keep(&call("a"));
        assert!(folder.is_current(&call("a")));
        for name in SETTINGS.into_iter().chain(["a source.rs", "image.elf"]) {
            let before = std::fs::read(folder.file(name)).unwrap();
            std::fs::write(folder.file(name), "changed").unwrap();
            assert!(!folder.is_current(&call("a")), "{name}");
            std::fs::write(folder.file(name), before).unwrap();
            assert!(folder.is_current(&call("a")), "{name}");
        }
        std::fs::remove_file(folder.file("a source.rs")).unwrap();
        assert!(!folder.is_current(&call("a")));
    }

    #[test]
    fn another_call_or_another_compiler_makes_another_image() {
        let folder = Folder::new();
        folder.keep(&call("a"));
        assert!(!folder.is_current(&call("b")));
        assert!(!is_current(&folder.file("image.elf"), &call("a"), "rustc 1.1"));
        forget(&folder.file("image.elf"));
        assert!(!folder.is_current(&call("a")));
    }

    #[test]
    fn an_image_without_known_sources_is_compiled_again() {
        let folder = Folder::new();
        std::fs::write(folder.file("image.d"), "of another form").unwrap();
        folder.keep(&call("a"));
        assert!(!folder.is_current(&call("a")));
    }

    #[test]
    fn a_file_that_was_changed_while_it_was_compiled_is_compiled_again() {
        let mut folder = Folder::new();
        folder.begin = SystemTime::UNIX_EPOCH;
        folder.keep(&call("a"));
        assert!(!folder.is_current(&call("a")));
    }
}
