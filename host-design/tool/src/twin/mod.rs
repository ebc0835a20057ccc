//! The live twin: a page on which the rig moves, run by the firmware itself, and on which a person can do what one
//! would do at the bench.
//!
//! The firmware runs in this process, in an emulator, or on a board; the conversation with it is the same everywhere.
//! A simulated machine can be pulled, changed and broken as well.
//!
//! | file | what is in it |
//! |---|---|
//! | `access.rs` | which requests are let in |
//! | `half_open.rs` | connections that have not asked yet |
//! | `connections.rs` | connections of pages |
//! | `dispatcher.rs` | who is in command, and the recording |
//! | `simulated.rs` | a simulated machine in real time; what it does is in [`upright_page::twin`] |
//! | `connected.rs` | a machine behind a serial line |
//! | `page/` | the page |
//!
//! ```
//! let server = upright_tool::twin::Server::listen("127.0.0.1:0".parse()?)?;
//! assert!(server.address()?.starts_with("http://127.0.0.1:"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod access;
pub(crate) mod assets;
mod connected;
mod connections;
mod dispatcher;
mod half_open;
mod server;
mod simulated;

pub use server::Server;
pub use upright_page::twin::SimulatedMachine;
