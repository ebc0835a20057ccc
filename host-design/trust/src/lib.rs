#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! | module | from | to |
//! |---|---|---|
//! | [`verify`] | table and requirements | the trust report |
//! | [`robust`] | rig file and tolerances | weights, poles and noise that survive them |

#![forbid(unsafe_code)]

pub mod robust;
pub mod verify;
