//! Tables of text that read well on a terminal and are Markdown.

/// A Markdown table with aligned columns: the first `left` ones to the left, the others to the right. Every row has as
/// many cells as the header.
pub fn markdown_table(header: &[&str], left: usize, rows: &[Vec<String>]) -> String {
    let width = |text: &str| text.chars().count();
    let widths: Vec<usize> = header
        .iter()
        .enumerate()
        .map(|(column, name)| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| width(cell)).fold(width(name).max(3), usize::max)
        })
        .collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut line = String::from("|");
        for (column, (cell, &wide)) in cells.zip(&widths).enumerate() {
            let space = " ".repeat(wide.saturating_sub(width(cell)));
            let cell = if column < left { format!(" {cell}{space} |") } else { format!(" {space}{cell} |") };
            line.push_str(&cell);
        }
        line.push('\n');
        line
    };
    let mut table = line(&mut header.iter().copied());
    table.push('|');
    for (column, &wide) in widths.iter().enumerate() {
        let dashes = "-".repeat(wide);
        table.push_str(&if column < left { format!("-{dashes}-|") } else { format!("-{dashes}:|") });
    }
    table.push('\n');
    for row in rows {
        table.push_str(&line(&mut row.iter().map(String::as_str)));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_by_characters_not_bytes() {
        let rows = [vec!["θ1".to_owned(), "1.5".to_owned()], vec!["cart".to_owned(), "10".to_owned()]];
        let table = markdown_table(&["what", "m"], 1, &rows);
        assert_eq!(table, "| what |   m |\n|------|----:|\n| θ1   | 1.5 |\n| cart |  10 |\n");
    }
}
