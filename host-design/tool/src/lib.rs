//! What the command line is made of: figures, the report, the firmware image and where it runs, fault campaigns, the
//! monitor, comparisons and the paper's results.

#![forbid(unsafe_code)]

pub mod campaign;
pub mod compare;
pub mod figure;
pub mod image;
pub mod in_the_loop;
pub mod monitor;
pub mod project;
pub mod report;
pub mod reproduce;
