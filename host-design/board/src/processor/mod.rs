//! The processor core: registers, exceptions, memory protection and counters of a Cortex-M4.

pub(crate) mod flash_cache;
pub(crate) mod mpu;
pub(crate) mod nvic;
pub(crate) mod pipeline;
pub(crate) mod registers;
pub(crate) mod system;
pub(crate) mod systick;
pub(crate) mod watch;
