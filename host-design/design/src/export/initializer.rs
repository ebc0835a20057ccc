//! The initializer of the table in C, and the checksum of its words.

use core::fmt::Write;

/// The text of a C initializer, member by member.
pub(super) struct Initializer {
    text: String,
    words: Vec<u32>,
}

impl Initializer {
    pub(super) fn new() -> Self {
        Self { text: String::new(), words: Vec::new() }
    }

    /// A line of text that has no values of its own: a brace, a comment.
    pub(super) fn line(&mut self, text: &str) {
        self.text += text;
        self.text.push('\n');
    }

    /// A number.
    pub(super) fn float(&mut self, name: &str, value: f32) {
        let literal = self.floating(value);
        self.member(name, &literal);
    }

    /// An array of numbers.
    pub(super) fn floats(&mut self, name: &str, values: impl IntoIterator<Item = f32>) {
        let literals: Vec<String> = values.into_iter().map(|value| self.floating(value)).collect();
        self.member(name, &format!("{{{}}}", literals.join(", ")));
    }

    /// An array of arrays, one per line.
    pub(super) fn columns(&mut self, name: &str, columns: impl IntoIterator<Item = Vec<f32>>) {
        self.line(&format!("    /* {name} */ {{"));
        for column in columns {
            let literals: Vec<String> = column.into_iter().map(|value| self.floating(value)).collect();
            self.line(&format!("        {{{}}},", literals.join(", ")));
        }
        self.line("    },");
    }

    /// A number of ticks.
    pub(super) fn ticks(&mut self, name: &str, value: u32) {
        self.words.push(value);
        self.member(name, &format!("{value}ul"));
    }

    /// An array of indices.
    pub(super) fn indices(&mut self, name: &str, values: impl IntoIterator<Item = u32>) {
        let literal = |value: u32| {
            self.words.push(value);
            format!("{value}ul")
        };
        let literals: Vec<String> = values.into_iter().map(literal).collect();
        self.member(name, &format!("{{{}}}", literals.join(", ")));
    }

    /// An array of counts.
    pub(super) fn counts(&mut self, name: &str, values: impl IntoIterator<Item = i32>) {
        let literal = |value: i32| {
            self.words.push(value as u32);
            format!("{value}l")
        };
        let literals: Vec<String> = values.into_iter().map(literal).collect();
        self.member(name, &format!("{{{}}}", literals.join(", ")));
    }

    /// An array of pairs of indices.
    pub(super) fn pairs(&mut self, name: &str, values: impl Iterator<Item = [u32; 2]>) {
        let literal = |[low, high]: [u32; 2]| {
            self.words.extend([low, high]);
            format!("{{{low}ul, {high}ul}}")
        };
        let literals: Vec<String> = values.map(literal).collect();
        self.member(name, &format!("{{{}}}", literals.join(", ")));
    }

    /// The text, with the checksum of all words at its end: FNV-1a, word by word.
    pub(super) fn sealed(self) -> String {
        let hash =
            self.words.iter().fold(2_166_136_261, |hash: u32, word| (hash ^ word).wrapping_mul(16_777_619));
        self.text + &format!("    /* checksum */ {hash}ul\n")
    }

    /// The shortest decimal that reads back as `value`.
    fn floating(&mut self, value: f32) -> String {
        self.words.push(value.to_bits());
        format!("{value:?}f")
    }

    fn member(&mut self, name: &str, value: &str) {
        // Writing into a String cannot fail.
        let _ = writeln!(self.text, "    /* {name} */ {value},");
    }
}
