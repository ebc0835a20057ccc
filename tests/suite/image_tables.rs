//! The tables of a rig as words in an image: what is written is what the firmware reads, and anything else is refused.

use upright::boards::DEFAULT_BOARD;
use upright::flash_image::{ImageTables, LAYOUT};
use upright::table::{Fill, GainTable, MOST_TRANSITIONS, SwingUpTable, TableError, TransitionTable};
use upright_design::motion::Transition;
use upright_design::table::{TableValues, class_source, image_tables};

use crate::published::{rig_and_table, rig_and_table_with_motions};

const SIZE: [usize; 2] = [6, 3];

/// Fills a gain table of a double pendulum from these words of an image for the default board.
fn read(words: &[u32]) -> GainTable<6, 3> {
    let mut table = GainTable::EMPTY;
    ImageTables::at(words, DEFAULT_BOARD.name, SIZE).fill_gains(&mut table);
    table
}

/// The words of a double pendulum with motions, and its table.
fn double() -> (Vec<u32>, &'static TableValues) {
    let (_, table) = rig_and_table_with_motions("double-quanser-dbpen");
    (image_tables(DEFAULT_BOARD, table), table)
}

#[test]
fn the_firmware_reads_the_tables_that_were_written() {
    let (mut words, table) = double();
    let length = words.len();
    // What follows in flash is erased.
    words.resize(length + 100, u32::MAX);
    let tables = ImageTables::at(&words, DEFAULT_BOARD.name, SIZE);
    assert_eq!(tables.words.len(), length);
    let gains = read(&words);
    assert_eq!((gains.check(), &gains), (Ok(()), &table.table::<6, 3>()));

    let wanted = table.swing_up.as_ref().unwrap();
    let others = wanted.transitions();
    let mut room = [TransitionTable::EMPTY; MOST_TRANSITIONS];
    let mut swing_up = SwingUpTable::<3, 2>::EMPTY;
    tables.fill_swing_up(&mut swing_up, &mut room);
    assert_eq!(swing_up.check(&gains), Ok(()));
    assert_eq!(swing_up, wanted.table::<3, 2>(&others));
}

#[test]
fn every_changed_bit_of_the_gain_table_is_refused() {
    let (words, table) = double();
    let header = ImageTables::header(DEFAULT_BOARD.name, SIZE, [0, 0]).len();
    let gains = words[header - 2] as usize;
    assert_eq!(gains, table.bytes() / 4 + 1);
    // The last word of the header is the number of words of the swing-up, which follows.
    for word in (0..header - 1).chain(header..header + gains) {
        for bit in [0, 7, 31] {
            let mut damaged = words.clone();
            damaged[word] ^= 1 << bit;
            assert!(read(&damaged).check().is_err(), "word {word}, bit {bit}");
        }
    }
}

#[test]
fn tables_for_something_else_are_refused() {
    let (words, _) = double();
    for length in 0..words.len() - 1 {
        assert_eq!(
            read(&words[..length]).check(),
            Err(TableError::Format),
            "{length} words of {}",
            words.len()
        );
    }
    let as_for = |board: &str, size| {
        let mut table = GainTable::<6, 3>::EMPTY;
        ImageTables::at(&words, board, size).fill_gains(&mut table);
        table.check()
    };
    assert_eq!(as_for(DEFAULT_BOARD.name, SIZE), Ok(()));
    assert_eq!(as_for("pico", SIZE), Err(TableError::Format));
    assert_eq!(as_for(DEFAULT_BOARD.name, [8, 4]), Err(TableError::Format));
    let mut newer = words.clone();
    assert_eq!(newer[1], LAYOUT);
    newer[1] += 1;
    assert_eq!(read(&newer).check(), Err(TableError::Format));
    // Erased flash, and lengths beyond its end.
    assert_eq!(read(&[u32::MAX; 64]).check(), Err(TableError::Format));
    assert_eq!(ImageTables::at(&[u32::MAX; 64], "pico", SIZE).words, &[] as &[u32]);
}

#[test]
fn transitions_are_read_as_far_as_there_is_room_for_them() {
    let mut table = double().1.clone();
    let swing_up = table.swing_up.as_mut().unwrap();
    let [first, second] = [0, 1].map(|number| Transition::all(2)[number]);
    swing_up.others = vec![(first, swing_up.raise.clone()), (second, swing_up.lower.clone())];
    let words = image_tables(DEFAULT_BOARD, &table);
    let ends = |transition: Transition| [transition.from(2).bits(), transition.to(2).bits()];
    let enough = (Ok(()), vec![ends(first), ends(second)]);
    assert_eq!(with_room::<2>(&words), enough);
    assert_eq!(with_room::<3>(&words), enough);
    assert_eq!(with_room::<1>(&words), (Err(TableError::Crc), Vec::new()));
}

/// The check of a swing-up that is read with room for so many transitions, and the ends of these.
fn with_room<const ROOM: usize>(words: &[u32]) -> (Result<(), TableError>, Vec<[u32; 2]>) {
    let mut room = [TransitionTable::EMPTY; ROOM];
    let mut swing_up = SwingUpTable::<3, 2>::EMPTY;
    ImageTables::at(words, DEFAULT_BOARD.name, SIZE).fill_swing_up(&mut swing_up, &mut room);
    let ends = swing_up.others.iter().map(|other| [other.from, other.to]).collect();
    (swing_up.check(&read(words)), ends)
}

#[test]
fn rigs_that_differ_in_numbers_share_the_code_of_an_image() {
    let class = |rig| class_source(&rig_and_table(rig).1);
    assert_eq!(class("single-quanser-ip02"), class("single-multiarm"));
    assert_ne!(class("single-quanser-ip02"), class("single-stepper"), "another drive");
    assert_ne!(class("single-quanser-ip02"), class("single-absolute"), "another sensor");
    assert_ne!(class("single-quanser-ip02"), class("double-quanser-dbpen"), "another size");
    let with_motions = class_source(&rig_and_table_with_motions("single-quanser-ip02").1);
    assert_ne!(class("single-quanser-ip02"), with_motions);
}
