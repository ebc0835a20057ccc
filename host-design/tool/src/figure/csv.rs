//! A figure as numbers.

use super::{Figure, FigureError};

impl Figure {
    /// Every point of every curve as CSV, including those that the drawing leaves out: panel (its vertical axis),
    /// curve, x, y, value, with one line for each point or cell of a map. Numbers are shortest decimals.
    ///
    /// # Errors
    /// [`FigureError::Draw`] if the text cannot be made.
    pub fn csv(&self) -> Result<String, FigureError> {
        let write = || -> Result<Vec<u8>, Box<dyn std::error::Error>> {
            let mut csv = ::csv::Writer::from_writer(Vec::new());
            csv.write_record(["panel", "x_axis", "curve", "x", "y", "value"])?;
            for panel in &self.panels {
                let (panel_name, x_axis) = (panel.y.label.as_str(), panel.x.label.as_str());
                for curve in &panel.curves {
                    for [x, y] in &curve.points {
                        let (x, y) = (x.to_string(), y.to_string());
                        csv.write_record([panel_name, x_axis, &curve.name, &x, &y, ""])?;
                    }
                }
                for map in panel.heat.iter() {
                    for (y, row) in map.rows.iter().zip(&map.values) {
                        for (x, value) in map.columns.iter().zip(row) {
                            let (x, y) = (x.to_string(), y.to_string());
                            let value = value.map_or(String::new(), |value| value.to_string());
                            csv.write_record([panel_name, x_axis, &map.name, &x, &y, &value])?;
                        }
                    }
                }
            }
            Ok(csv.into_inner()?)
        };
        let bytes = write().map_err(|error| FigureError::Draw(error.to_string()))?;
        String::from_utf8(bytes).map_err(|error| FigureError::Draw(error.to_string()))
    }
}
