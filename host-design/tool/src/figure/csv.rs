//! A figure as numbers.

use std::fmt::Write;

use super::{Figure, FigureError};

impl Figure {
    /// Every point of every curve as CSV, including those that the drawing leaves out: panel (its vertical axis),
    /// curve, x, y, value, with one line for each point or cell of a map. Numbers are shortest decimals.
    ///
    /// # Errors
    /// [`FigureError::Draw`] if the text cannot be made.
    pub fn csv(&self) -> Result<String, FigureError> {
        let mut text = "panel,x_axis,curve,x,y,value\n".to_owned();
        for panel in &self.panels {
            // Encoded once: the start is the same in each line, and numbers need no quotes.
            let start = |name: &str| record_start([&panel.y.label, &panel.x.label, name]);
            for curve in &panel.curves {
                let start = start(&curve.name)?;
                for [x, y] in &curve.points {
                    writeln!(text, "{start}{x},{y},").map_err(failed)?;
                }
            }
            for map in panel.heat.iter() {
                let start = start(&map.name)?;
                for (y, row) in map.rows.iter().zip(&map.values) {
                    for (x, value) in map.columns.iter().zip(row) {
                        write!(text, "{start}{x},{y},").map_err(failed)?;
                        if let Some(value) = value {
                            write!(text, "{value}").map_err(failed)?;
                        }
                        text.push('\n');
                    }
                }
            }
        }
        Ok(text)
    }
}

/// These fields as CSV, and a comma after them.
fn record_start(fields: [&str; 3]) -> Result<String, FigureError> {
    let write = || -> Result<Vec<u8>, Box<dyn std::error::Error>> {
        let mut csv = ::csv::Writer::from_writer(Vec::new());
        csv.write_record(fields)?;
        Ok(csv.into_inner()?)
    };
    let bytes = write().map_err(failed)?;
    let line = String::from_utf8(bytes).map_err(failed)?;
    Ok(line.trim_end_matches('\n').to_owned() + ",")
}

fn failed(error: impl std::fmt::Display) -> FigureError {
    FigureError::Draw(error.to_string())
}
