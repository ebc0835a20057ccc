//! A rig that a person can pull, change and break, run by the firmware itself: what the twin does, without a connection
//! to its page.
//!
//! | file | what is in it |
//! |---|---|
//! | `request.rs`, `greeting.rs`, `console.rs` | what a page asks for, what it is told first, and what it is shown |
//! | `simulated.rs` | the simulated machine, with `pull.rs`, `property.rs`, `challenge.rs`, `pace.rs` |
//! | `in_page.rs` | the twin of one page, in the page itself |
//! | `connected.rs` | a real board, whose serial line the page has opened |

mod challenge;
mod connected;
mod console;
mod greeting;
mod in_page;
mod pace;
mod property;
mod pull;
mod request;
mod simulated;

pub use console::Console;
pub use greeting::{breakable, greeting};
pub use in_page::{InPage, TELEMETRY_S};
pub use property::Properties;
pub use request::{Holding, MachineRequest, PageRequest};
pub use simulated::{PoweredMachine, SimulatedMachine};
