//! What some tests need and not every machine has: a compiler for the image, a browser, gcc. A test without it
//! says so and passes; if the environment variable `UPRIGHT_REQUIRE_IMAGE`, `UPRIGHT_REQUIRE_BROWSER` or
//! `UPRIGHT_REQUIRE_GCC` is set, it fails.

use std::fmt::Debug;
use std::io::Write;

/// Says on stderr what a test leaves out, in spite of the test program, which hides what a passing test prints with the
/// macros.
pub fn not_exercised(what: &str) {
    let _ = writeln!(std::io::stderr(), "not exercised: {what}");
}

/// Whether this variable demands the equipment.
pub fn is_required(variable: &str) -> bool {
    std::env::var_os(variable).is_some()
}

/// What was built or found; `None` if it needs the missing compiler for the image, which `is_missing` knows by its
/// error. `what` it is for.
///
/// # Panics
/// At any other error, and at this one where the image is required.
pub fn if_possible<T, E: Debug + ToString>(
    result: Result<T, E>,
    is_missing: impl Fn(&E) -> bool,
    what: &str,
) -> Option<T> {
    match result {
        Err(error) if is_missing(&error) && !is_required("UPRIGHT_REQUIRE_IMAGE") => {
            not_exercised(&format!("{what}: {}", error.to_string()));
            None
        }
        result => Some(result.unwrap()),
    }
}
