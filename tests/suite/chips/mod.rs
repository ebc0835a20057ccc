//! One set of bits: recorded runs of the firmware are replayed by an image on six instruction sets in QEMU.
//!
//! For other instruction sets than that of the boards, the compiler builds Rust's core library. This takes minutes: it
//! runs with `--ignored`.

mod image;
pub(crate) mod recorded;

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::OnceLock;

use self::image::{FLUSHED, Image, MACHINES, Machine, Replayed, images};
use self::recorded::{Replay, runs};
use crate::equipment::if_possible;
use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::repository;
use upright_tool::image::TARGET;

/// The images and the runs, if compiler and emulators are there: for all tests, and the runs are recorded while the
/// images are compiled.
fn prepared() -> Option<&'static (Vec<Image>, Vec<Replay>)> {
    static PREPARED: OnceLock<Option<(Vec<Image>, Vec<Replay>)>> = OnceLock::new();
    let prepare = || {
        std::thread::scope(|scope| {
            let runs = scope.spawn(runs);
            let images = images_if_possible(&MACHINES)?;
            Some((images, runs.join().unwrap()))
        })
    };
    PREPARED.get_or_init(prepare).as_ref()
}

/// What each image does in each run, in this order, with an emulator on each core.
fn replayed(images: &[Image], runs: &[Replay]) -> Vec<Replayed> {
    let pairs: Vec<_> = images.iter().flat_map(|image| runs.iter().map(move |run| (image, run))).collect();
    let workers = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let share = |worker: usize| {
        pairs
            .iter()
            .skip(worker)
            .step_by(workers)
            .map(|(image, run)| image.replay(run, 0))
            .collect::<Vec<_>>()
    };
    let shares: Vec<Vec<Replayed>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|worker| scope.spawn(move || share(worker))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let mut shares: Vec<_> = shares.into_iter().map(Vec::into_iter).collect();
    (0..pairs.len()).filter_map(|place| shares[place % workers].next()).collect()
}

/// The images, if compiler and emulators are there.
fn images_if_possible(machines: &'static [Machine]) -> Option<Vec<Image>> {
    for program in machines.iter().map(Machine::emulator) {
        if std::process::Command::new(program).arg("--version").output().is_err() {
            assert!(!is_required("UPRIGHT_REQUIRE_IMAGE"), "install {program}");
            not_exercised(&format!("recorded runs in QEMU: {program} is missing"));
            return None;
        }
    }
    if_possible(images(machines), "the replaying image")
}

/// The first tick in which the image gives other bytes than the host; `None` if all are equal.
fn first_difference(replay: &Replay, replayed: &Replayed) -> Option<usize> {
    // After the last tick, the image sends what the host has not collected any more.
    let begins = std::iter::once(0).chain(replay.ends.iter().copied());
    begins
        .zip(&replay.ends)
        .position(|(begin, &end)| replayed.sent.get(begin..end) != Some(&replay.wanted[begin..end]))
}

/// Mean and largest number of instructions per tick with the motor on.
struct Instructions {
    run: &'static str,
    target: &'static str,
    mean: f64,
    most: f64,
}

#[test]
fn the_instruction_set_of_the_boards_gives_the_bits_of_the_host() {
    let boards = MACHINES.iter().position(|machine| machine.target == TARGET).unwrap();
    let Some(images) = images_if_possible(&MACHINES[boards..][..1]) else { return };
    let runs = runs();
    for (replay, replayed) in runs.iter().zip(replayed(&images, &runs)) {
        assert_eq!(first_difference(replay, &replayed), None, "{}: first different tick", replay.name);
    }
    // Negative control: another count.
    let changed = &runs[0].with_another_count();
    assert!(first_difference(&runs[0], &images[0].replay(changed, 0)).is_some());
}

#[test]
#[ignore = "builds for six instruction sets"]
fn six_instruction_sets_give_the_bits_of_the_host() {
    let Some((images, runs)) = prepared() else { return };
    let (mut measured, mut replayed) = (Vec::new(), replayed(images, runs).into_iter());
    for image in images {
        for replay in runs {
            let replayed = replayed.next().unwrap();
            let different = first_difference(replay, &replayed);
            assert_eq!(different, None, "{} on {}: first different tick", replay.name, image.machine.target);
            let target = image.machine.target;
            measured.push(Instructions {
                run: replay.name,
                target,
                mean: replayed.mean,
                most: replayed.most,
            });
        }
    }
    let changed = &runs[0].with_another_count();
    assert!(
        first_difference(&runs[0], &images[0].replay(changed, 0)).is_some(),
        "another count is not noticed"
    );
    hold_the_document(&measured);
}

#[test]
#[ignore = "builds for six instruction sets"]
fn fused_products_and_flushed_subnormals_are_noticed() {
    let Some((images, runs)) = prepared() else { return };
    let with_unit = |image: &&Image| image.machine.name == "mps2-an386";
    let image = images.iter().find(with_unit).unwrap();
    let fused = if_possible(Image::fused(image.machine), "the image with fused products").unwrap();
    for replay in runs {
        let different = first_difference(replay, &fused.replay(replay, 0));
        println!("fused: {} differs from tick {different:?}", replay.name);
        assert!(different.is_some(), "fused products are not noticed in {}", replay.name);
    }
    for replay in runs.iter().filter(|run| run.name.ends_with("at rest")) {
        let different = first_difference(replay, &image.replay(replay, FLUSHED));
        println!("flushed: {} differs from tick {different:?} of {}", replay.name, replay.ends.len());
        assert!(different.is_some(), "flushed subnormals are not noticed in {}", replay.name);
    }
}

/// Rows of the document for what was measured, by target and run.
fn table(measured: &[Instructions]) -> String {
    let mut table =
        String::from("| instruction set | run | instructions in a tick: mean | most |\n|---|---|---|---|\n");
    for Instructions { run, target, mean, most } in measured {
        writeln!(table, "| {target} | {run} | {mean:.0} | {most:.0} |").unwrap();
    }
    table
}

/// Holds the measured numbers within a tenth of those in docs/results/chips.md. With UPRIGHT_BLESS=1 in the
/// environment, writes them there instead.
fn hold_the_document(measured: &[Instructions]) {
    let path: PathBuf = repository().join("docs/results/chips.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once("<!-- instructions -->\n").unwrap();
    let (found, after) = rest.split_once("<!-- /instructions -->").unwrap();
    if std::env::var_os("UPRIGHT_BLESS").is_some() {
        let page = format!("{before}<!-- instructions -->\n{}<!-- /instructions -->{after}", table(measured));
        return std::fs::write(&path, page).unwrap();
    }
    let rows: Vec<Vec<&str>> =
        found.lines().skip(2).map(|row| row.trim_matches('|').split('|').collect()).collect();
    assert_eq!(rows.len(), measured.len(), "rows of docs/results/chips.md");
    for (row, Instructions { run, target, mean, most }) in rows.iter().zip(measured) {
        assert_eq!([row[0].trim(), row[1].trim()], [*target, *run]);
        for (cell, number) in [(row[2], mean), (row[3], most)] {
            let documented: f64 = cell.trim().parse().unwrap();
            assert!(
                (0.9..=1.1).contains(&(number / documented)),
                "{target}, {run}: {number}, documented: {documented}"
            );
        }
    }
}

#[test]
fn the_document_names_every_instruction_set() {
    let page = std::fs::read_to_string(repository().join("docs/chips.md")).unwrap();
    let missing =
        |page: &str| MACHINES.iter().filter(|Machine { target, .. }| !page.contains(target)).count();
    assert_eq!(missing(&page), 0);
    assert_eq!(missing(&page.replace("thumbv6m", "thumbv5")), 1);
}
