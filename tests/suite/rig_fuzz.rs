//! No file, however mangled, makes the reader panic, and every error is one plain line with a valid exit code.

use std::path::Path;

use proptest::prelude::*;
use upright_design::rig::Rig;
use upright_fuzz_checks::rig::check;

const SEEDS: [&str; 4] = [
    include_str!("../../rigs/quadruple-paper.toml"),
    include_str!("../../rigs/single-quanser-ip02.toml"),
    include_str!("../../rigs/double-quanser-dbpen.toml"),
    "name = \"m\"\n[model]\na = [[0, 1], [2, 0]]\nb = [0, 1]\nmeasured = [0]\nmeasured_steps = [1e-3]\n\
     [pole_placement]\npoles = [[-1, 2], [-1, -2]]\n[kalman]\nforce_noise_n2_s = 1\n",
];

/// Pieces that a TOML parser treats specially, and numbers at the limits.
const PIECES: &[&str] = &[
    "[",
    "]",
    "[[",
    "]]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "\"",
    "'",
    "\"\"\"",
    "#",
    "\n",
    "\r",
    "\t",
    " ",
    "\\",
    "-",
    "+",
    "_",
    "0",
    "e",
    "nan",
    "-inf",
    "1e999",
    "1e-999",
    "-0.0",
    "9223372036854775808",
    "true",
    "2026-01-01",
    "\u{0}",
    "ü",
    "\u{feff}",
    "link",
    "cart",
    "model",
    "[]",
    "[[]]",
    "{}",
    "[cart]",
    "[[link]]",
    "[model]",
    "a.b.c = 1\n",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("rig_fuzz_{}.toml", std::process::id()));
        std::fs::write(&path, &bytes)?;
        let result = Rig::from_path(&path);
        std::fs::remove_file(&path)?;
        if let Err(error) = result {
            prop_assert!(matches!(error.exit_code(), 2 | 3));
        }
        check(&bytes);
    }

    #[test]
    fn any_text(text in "\\PC{0,100}") {
        check(text.as_bytes());
    }

    #[test]
    fn toml_like_pieces(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..40)) {
        check(pieces.concat().as_bytes());
    }

    #[test]
    fn good_files_with_a_few_bytes_changed(
        seed in prop::sample::select(&SEEDS[..]),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = seed.as_bytes().to_vec();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        check(&bytes);
    }

    #[test]
    fn good_files_with_pieces_inserted_and_cut(
        seed in prop::sample::select(&SEEDS[..]),
        changes in prop::collection::vec(
            (any::<prop::sample::Index>(), 0_usize..30, prop::sample::select(PIECES)), 1..5),
    ) {
        let mut text: Vec<char> = seed.chars().collect();
        for (at, cut, piece) in changes {
            let at = at.index(text.len());
            let end = (at + cut).min(text.len());
            text.splice(at..end, piece.chars());
            if text.is_empty() {
                break;
            }
        }
        check(text.into_iter().collect::<String>().as_bytes());
    }
}

/// Nesting as deep as a file can hold is refused; the parser does not follow it until the stack overflows.
#[test]
fn deep_nesting() {
    for (open, close) in [("[", "]"), ("{a=", "}"), ("a.", "b")] {
        let deep = format!("name = {}1{}\n", open.repeat(100_000), close.repeat(100_000));
        check(deep.as_bytes());
        check(format!("{}b = 1\n", "a.".repeat(100_000)).as_bytes());
        check(format!("[{}b]\n", "a.".repeat(100_000)).as_bytes());
    }
}
