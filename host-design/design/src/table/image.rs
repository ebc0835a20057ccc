//! The tables as an image in flash carries them.

use upright::boards::BoardRow;
use upright::flash_image::ImageTables;
use upright::table::{Part, Reader, Shape, Variant, Words};

use super::any_size::{WithSize, with_size};
use super::swing_up::SwingUpValues;
use super::values::TableValues;

/// The words that follow the code of an image for `board`: see [`flash_image`](upright::flash_image).
pub fn image_tables(board: &BoardRow, table: &TableValues) -> Vec<u32> {
    let mut gains = table.words();
    gains.push(table.crc());
    let swing_up = table
        .swing_up
        .as_ref()
        .and_then(|swing_up| with_size(table.states(), table.sensors(), SwingUpWords(swing_up)));
    let swing_up = swing_up.unwrap_or_default();
    let size = [table.states(), table.sensors()];
    let header = ImageTables::header(board.name, size, [gains.len(), swing_up.len()]);
    header.into_iter().chain(gains).chain(swing_up).collect()
}

/// The words of a swing-up with its checksum.
struct SwingUpWords<'a>(&'a SwingUpValues);

impl WithSize for SwingUpWords<'_> {
    type Output = Vec<u32>;

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output {
        let others = self.0.transitions();
        let table = self.0.table::<NY, N>(&others);
        let mut writer = WordWriter::default();
        table.read(&mut writer);
        writer.words.push(table.crc);
        writer.words
    }
}

/// Writes what a [`WordReader`](upright::table::WordReader) takes.
#[derive(Default)]
struct WordWriter {
    words: Vec<u32>,
}

impl WordWriter {
    /// The length of a list, if that is not part of its type.
    fn length(&mut self, length: usize, shape: Shape) {
        if shape == Shape::Slice {
            self.words.push(length as u32);
        }
    }
}

impl Reader for WordWriter {
    fn begin(&mut self, _: &'static str) {}

    fn field(&mut self, _: &'static str, _: &[&'static str]) {}

    fn words(&mut self, words: Words<'_>, shape: Shape) {
        let length = match words {
            Words::F32(values) => values.len(),
            Words::U32(values) => values.len(),
            Words::I32(values) => values.len(),
            Words::I16(values) => values.len(),
            Words::U64(_) => 1,
        };
        self.length(length, shape);
        self.words.extend((0..).map_while(|index| words.get(index)));
    }

    fn variant(&mut self, variant: Variant) {
        self.words.push(variant.number);
    }

    fn list(&mut self, length: usize, shape: Shape) {
        self.length(length, shape);
    }

    fn end(&mut self) {}
}
