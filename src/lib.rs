#![no_std]
//! Upright.
