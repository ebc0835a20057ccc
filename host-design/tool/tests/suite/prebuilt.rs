//! Images that are built without a compiler: bit for bit the compiled ones, on the virtual board, too.

use std::path::Path;
use std::process::{Command, Output};

use upright::boards::{BoardRow, DEFAULT_BOARD, named};
use upright_board::{Conditions, Image};
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_plan::up_and_down;
use upright_test_support::limits::output;
use upright_tool::image::{BuiltImage, ClassTicks, PREBUILT_VARIABLE, Prebuilt, SPREAD, build_for};
use upright_tool::in_the_loop::{VirtualBoard, run_compared};

use crate::equipment::if_possible;
use crate::published::{rig_and_table, rig_and_table_with_motions, rig_path};

/// A file with the images for a single pendulum, with motions, on these boards; `None` without a compiler.
fn prebuilt(folder: &Path, boards: &[&'static BoardRow]) -> Option<Prebuilt> {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let mut images = Prebuilt::none_by("of this test");
    for board in boards {
        if_possible(build_for(board, rig, table), "prebuilt images")?;
        let mut ticks = ClassTicks::unknown();
        ticks.keep(30.0);
        assert!(!images.has(board, table));
        images.take_in(board, table, &ticks).unwrap();
        assert!(images.has(board, table));
    }
    let path = folder.join("images.lzma");
    std::fs::write(&path, images.packed()).unwrap();
    Some(Prebuilt::read(&path).unwrap())
}

/// What is flashed: the file for a Pico, the contents of flash elsewhere.
fn flashed(image: &BuiltImage) -> Vec<u8> {
    let bytes = std::fs::read(image.flashed()).unwrap();
    if image.uf2.is_some() { bytes } else { Image::from_elf(&bytes).unwrap().flash() }
}

/// The image of a rig without a compiler, which has to be the compiled one.
fn equal(prebuilt: &Prebuilt, board: &'static BoardRow, (rig, table): &(Rig, TableValues)) -> BuiltImage {
    let compiled = flashed(&build_for(board, rig, table).unwrap());
    let image = prebuilt.build_for(board, rig, table).unwrap().unwrap();
    assert_eq!(image.ticks.bound_us(), Some(30.0 * SPREAD));
    assert!(compiled.len() > 20_000 && flashed(&image) == compiled, "{board} {}", rig.name);
    image
}

#[test]
fn an_image_without_a_compiler_is_the_compiled_one_and_raises_its_rig() {
    let (folder, pico) = (tempfile::tempdir().unwrap(), named("pico").unwrap());
    let Some(prebuilt) = prebuilt(folder.path(), &[DEFAULT_BOARD, pico]) else { return };
    assert_eq!((prebuilt.count(), prebuilt.compiler()), (2, "of this test"));
    equal(&prebuilt, pico, rig_and_table_with_motions("single-multiarm"));
    equal(&prebuilt, DEFAULT_BOARD, rig_and_table_with_motions("single-multiarm"));
    let own @ (rig, table) = rig_and_table_with_motions("single-quanser-ip02");
    let image = equal(&prebuilt, DEFAULT_BOARD, own);
    let image = Image::from_elf(&std::fs::read(image.elf).unwrap()).unwrap();
    assert!(
        image.lines().is_none_or(|lines| lines.line(0x0800_0400).is_none()),
        "it has debugging information"
    );
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), table).unwrap();
    let motion = up_and_down(rig, table, 0.1).unwrap();
    let (recording, [ticks, _]) = run_compared(rig, table, &motion, &mut board).unwrap();
    assert!(recording.fault.is_none() && ticks > 2_000, "{ticks} {:?}", recording.fault);

    // Rigs with other code, and another board.
    let (without_motions, two_links) =
        (rig_and_table("single-quanser-ip02"), rig_and_table("double-quanser-dbpen"));
    for (rig, table) in [without_motions, two_links] {
        assert_eq!(prebuilt.build_for(pico, rig, table).unwrap(), None, "{}", rig.name);
    }
    assert_eq!(prebuilt.build_for(named("pico2").unwrap(), rig, table).unwrap(), None);
}

/// Runs the tool with an empty PATH, and this file of prebuilt images.
fn upright_alone(images: Option<&Path>, arguments: &[&str]) -> Output {
    let nowhere = tempfile::tempdir().unwrap();
    let mut upright = Command::new(env!("CARGO_BIN_EXE_upright"));
    upright
        .args(["firmware", "build"])
        .args(arguments)
        .env("PATH", nowhere.path())
        .env_remove(PREBUILT_VARIABLE);
    if let Some(images) = images {
        upright.env(PREBUILT_VARIABLE, images);
    }
    output(&mut upright)
}

#[test]
fn the_tool_needs_no_compiler_for_rigs_that_there_is_an_image_for_and_one_for_others() {
    let folder = tempfile::tempdir().unwrap();
    if prebuilt(folder.path(), &[named("pico").unwrap()]).is_none() {
        return;
    }
    let images = folder.path().join("images.lzma");
    let [single, double] = ["single-quanser-ip02", "double-quanser-dbpen"].map(rig_path);
    let on_pico = |rig: &Path| [rig.to_str().unwrap().to_owned(), "--board=pico".to_owned()];
    let run = |images: Option<&Path>, rig: &Path, more: &[&str]| {
        let arguments = on_pico(rig);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).chain(more.iter().copied()).collect();
        let output = upright_alone(images, &arguments);
        (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    };
    let (status, said) = run(Some(&images), &single, &[]);
    assert!(status == Some(0) && said.contains(".uf2"), "{said}");
    let (status, said) = run(Some(&images), &double, &[]);
    assert!(status == Some(4) && said.contains("no image is prebuilt for pico"), "{said}");
    for (images, more) in [(None, &[][..]), (Some(images.as_path()), &["--from-source"])] {
        let (status, said) = run(images, &single, more);
        assert!(status == Some(4) && said.contains("rustup target add"), "{said}");
    }
    // A file that is not there, or not whole.
    let whole = std::fs::read(&images).unwrap();
    std::fs::write(&images, &whole[..whole.len() - 1]).unwrap();
    let (status, said) = run(Some(&images), &single, &[]);
    assert!(status == Some(2) && said.contains("no whole file of prebuilt images"), "{said}");
    let (status, said) = run(Some(&folder.path().join("other.lzma")), &single, &[]);
    assert!(status == Some(2) && said.contains(PREBUILT_VARIABLE), "{said}");
}
