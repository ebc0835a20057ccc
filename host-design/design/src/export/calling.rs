//! From where a program may call the functions of the header: one table for its first comment and for the guide.

/// Functions, and from where they may be called.
pub const CALLING: [(&[&str], &str); 4] = [
    (
        &["upright_trip", "upright_trip_at_switch"],
        "anywhere: they may interrupt every function, and each other",
    ),
    (&["upright_table_is_intact", "upright_arithmetic_is_exact"], "anywhere: they change nothing"),
    (&["upright_init"], "the start, before anything that calls another one"),
    (
        &[
            "upright_home",
            "upright_select",
            "upright_set_setpoint",
            "upright_arm",
            "upright_disarm",
            "upright_clear",
            "upright_control",
            "upright_predict",
            "upright_motor_is_on",
            "upright_blinks",
        ],
        "one task: none may interrupt another; outside the tick, with its interrupt off",
    ),
];

/// The table as part of a comment in C.
pub(super) fn comment() -> String {
    let row = |(functions, from): (&[&str], &str)| {
        let names = if functions.len() > 2 { "all others".to_owned() } else { functions.join(", ") };
        format!("     {names}: from {from}\n")
    };
    let rows: String = CALLING.into_iter().map(row).collect();
    format!("\n   What may interrupt what:\n{rows}")
}

#[cfg(test)]
mod tests {
    use super::CALLING;

    #[test]
    fn every_function_of_the_header_is_in_the_table_once() {
        let source = [include_str!("calls.h"), include_str!("faults.rs")].concat();
        let called = source.lines().filter_map(|line| {
            let declared = line.trim().trim_start_matches('"').strip_prefix("UPRIGHT_CALL ")?;
            declared.split('(').next()?.rsplit(' ').next()
        });
        let mut called: Vec<&str> = called.collect();
        let mut listed: Vec<&str> =
            CALLING.iter().flat_map(|(functions, _)| functions.iter().copied()).collect();
        called.sort_unstable();
        listed.sort_unstable();
        assert_eq!(called, listed);
    }
}
