#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| upright_fuzz_checks::commands::check(bytes));
