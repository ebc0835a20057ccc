//! The command line `upright`, as a library: figures, the report, firmware images and where they run, fault campaigns,
//! the monitor, comparisons and the paper's results. Models, design and simulation are those of `upright-design`,
//! identification that of `upright-identify`.
//!
//! | module | what is in it |
//! |---|---|
//! | [`figure`] | figures as SVG, PNG and CSV |
//! | [`report`] | the HTML page |
//! | [`image`] | builds firmware images, measures flash, stack and panics |
//! | [`import`] | rig files from a URDF |
//! | [`simulator_model`] | the machine as MJCF and URDF |
//! | [`in_the_loop`] | runs the whole firmware, on the host or as an image on the virtual board |
//! | [`campaign`] | fault injection |
//! | [`commission`] | from a wired rig to a balancing one, step by step |
//! | [`monitor`] | telemetry and commands in a terminal |
//! | [`compare`] | rigs and sweeps side by side |
//! | [`identified`] | results of an identification, as text, JSON, page and rig file |
//! | [`twin`] | the live twin: a page on which the rig moves |
//! | [`site`] | the whole of it in a page, with nothing to install |
//! | [`marking`] | a class's labs, run again |
//!
//! ```
//! use upright_tool::figure::{Curve, Figure, Axis, Panel};
//!
//! let points = (0..100).map(|i| 0.1 * f64::from(i)).map(|t| [t, (-t).exp()]).collect();
//! let panel = Panel::new(Axis::linear("time (s)"), Axis::linear("angle (°)"));
//! let svg = Figure::new("decay").with(panel.with(Curve::line("θ1", 0, points))).svg()?;
//! assert!(svg.contains("time (s)"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod campaign;
pub mod commission;
pub mod compare;
pub mod figure;
pub mod identified;
pub mod image;
pub mod import;
pub mod in_the_loop;
pub mod markdown;
pub mod marking;
pub mod monitor;
mod packed;
mod policy;
pub mod report;
pub mod simulator_model;
pub mod site;
pub mod twin;
