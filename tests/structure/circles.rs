//! Circles of files and of folders in a crate.
//!
//! A file uses another one if a path in it leads to an item that the other one defines, also through a `pub use`. What
//! a file imports or re-exports from another one counts as used, and so does what a `mod.rs` imports from its children.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::{Names, Source};

/// What each thing uses, by name.
type Uses<'a> = BTreeMap<&'a str, BTreeSet<&'a str>>;

/// A crate: its files by their paths without `.rs`, `mod.rs` as `FOLDER/mod`, the root as `lib` or `main`.
pub(crate) type Files<'a> = BTreeMap<&'a str, &'a Source>;

/// The module that a file is.
fn module(file: &str) -> Names {
    let mut names: Names = file.split('/').map(str::to_owned).collect();
    if matches!(names.last().map(String::as_str), Some("mod" | "lib" | "main")) {
        names.pop();
    }
    names
}

struct Modules<'a> {
    files: BTreeMap<Names, &'a str>,
    /// The absolute path of each imported name of a module.
    imported: BTreeMap<Names, BTreeMap<&'a str, Names>>,
}

impl<'a> Modules<'a> {
    fn of(files: &Files<'a>) -> Self {
        let of_modules = files.keys().map(|file| (module(file), *file)).collect();
        let mut modules = Self { files: of_modules, imported: BTreeMap::new() };
        // An import can begin with an imported name.
        for _ in 0..2 {
            for (&file, &source) in files {
                for import in &source.imports {
                    if let Some(path) = modules.absolute(&module(file), &import.path) {
                        modules.imported.entry(module(file)).or_default().insert(&import.name, path);
                    }
                }
            }
        }
        modules
    }

    /// The path from the root of the crate; `None` if it leads to another crate or begins with a type.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Names> {
        let mut start = module.to_vec();
        let mut rest = path;
        match path[0].as_str() {
            "crate" => return Some(path[1..].to_vec()),
            "self" => rest = &path[1..],
            "super" => {
                while rest.first().is_some_and(|name| name == "super") {
                    start.pop()?;
                    rest = &rest[1..];
                }
            }
            name => {
                let child: Names = start.iter().cloned().chain([name.to_owned()]).collect();
                if !self.files.contains_key(&child) {
                    start = self.imported.get(module)?.get(name)?.clone();
                    rest = &path[1..];
                }
            }
        }
        start.extend_from_slice(rest);
        Some(start)
    }

    /// The file that defines what an absolute path leads to.
    fn file(&self, path: &[String], depth: usize) -> Option<&'a str> {
        let (known, file) =
            (0..=path.len()).rev().find_map(|n| self.files.get(&path[..n]).map(|file| (n, *file)))?;
        let (module, rest) = path.split_at(known);
        let elsewhere = rest.first().and_then(|name| self.imported.get(module)?.get(name.as_str()));
        match elsewhere {
            Some(start) if start[..] != path[..known + 1] && depth < 8 => {
                self.file(&[start.as_slice(), &rest[1..]].concat(), depth + 1)
            }
            _ => Some(file),
        }
    }

    fn used_by(&self, file: &str, source: &Source) -> BTreeSet<&'a str> {
        let module = module(file);
        let imports = source.imports.iter().filter_map(|import| {
            let path = self.absolute(&module, &import.path)?;
            match path.split_last() {
                Some((glob, before)) if glob == "*" => self.file(before, 0),
                // Of a module that is imported, what is used is told by the paths that begin with its name.
                _ if self.files.contains_key(&path) => None,
                _ => self.file(&path, 0),
            }
        });
        let paths = source.paths.iter().filter_map(|path| self.file(&self.absolute(&module, path)?, 0));
        imports.chain(paths).filter(|used| *used != file).collect()
    }
}

/// All that can be reached from `start` in one step or more.
fn reached<'a>(uses: &Uses<'a>, start: &str) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut left: Vec<&str> = uses.get(start).into_iter().flatten().copied().collect();
    while let Some(next) = left.pop() {
        if reached.insert(next) {
            left.extend(uses.get(next).into_iter().flatten());
        }
    }
    reached
}

fn rings<'a>(uses: &Uses<'a>) -> BTreeSet<Vec<&'a str>> {
    let all: BTreeMap<_, _> = uses.keys().map(|thing| (*thing, reached(uses, thing))).collect();
    let ring = |thing: &&'a str| {
        let back = |other: &&&str| all.get(**other).is_some_and(|reached| reached.contains(thing));
        all[thing].iter().filter(back).copied().collect::<Vec<_>>()
    };
    uses.keys().map(ring).filter(|ring| ring.len() > 1).collect()
}

/// Each circle of files, and each circle of files and folders in a folder, as one line.
pub(crate) fn circles(files: &Files) -> Vec<String> {
    let modules = Modules::of(files);
    let uses: Uses = files
        .iter()
        .filter(|(file, _)| !matches!(**file, "lib" | "main")) // They only list the modules.
        .map(|(file, source)| (*file, modules.used_by(file, source)))
        .collect();
    let mut found: Vec<_> = rings(&uses).iter().map(|ring| format!("files: {}", ring.join(", "))).collect();
    let folders: BTreeSet<&str> = files
        .keys()
        .flat_map(|file| file.match_indices('/').map(|(at, _)| &file[..=at]))
        .chain([""])
        .collect();
    for folder in folders {
        let part = |file: &'_ str| -> Option<(usize, usize)> {
            let inside = file.strip_prefix(folder)?;
            Some((folder.len(), folder.len() + inside.find('/').unwrap_or(inside.len())))
        };
        let mut parts = Uses::new();
        for (file, used) in &uses {
            let Some(from) = part(file).map(|(start, end)| &file[start..end]) else { continue };
            let used = used.iter().filter_map(|used| part(used).map(|(start, end)| &used[start..end]));
            parts.entry(from).or_default().extend(used.filter(|part| *part != from));
        }
        let is_of_files = |ring: &&Vec<&str>| {
            ring.iter().all(|part| files.contains_key(format!("{folder}{part}").as_str()))
        };
        found.extend(rings(&parts).iter().filter(|ring| !is_of_files(ring)).map(|ring| {
            format!("folders in {}: {}", if folder.is_empty() { "src/" } else { folder }, ring.join(", "))
        }));
    }
    found
}
