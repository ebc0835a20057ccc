//! The faults of the header: what they are called in C, and how often a light blinks for each.

use upright::supervision::fault::Fault;

/// A fault as the header knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeaderFault {
    /// Name in C, without `UPRIGHT_`.
    pub name: &'static str,
    /// Code, that of the firmware; from 100 on, the firmware does not have it.
    pub code: u8,
    /// When it is raised, in a word or two.
    pub condition: &'static str,
    /// How often a light blinks for it: few enough to be counted. Faults with one place to look at share a number.
    pub blinks: u8,
    /// Whether pulses then bring the cart to rest, as in the firmware.
    brakes: bool,
}

/// Faults of the firmware, with their names in C and their blinks.
const OF_THE_FIRMWARE: [(&str, Fault, u8); 11] = [
    ("ANGLE", Fault::Angle, 1),
    ("RAIL", Fault::Rail, 2),
    ("LIMIT_SWITCH", Fault::LimitSwitch, 2),
    ("SPEED", Fault::Speed, 3),
    ("ENCODER", Fault::Encoder, 4),
    ("FROZEN", Fault::Frozen, 4),
    ("MOTOR", Fault::Motor, 5),
    ("DISTURBED", Fault::Disturbed, 6),
    ("SATURATED", Fault::Saturated, 7),
    ("NOT_FINITE", Fault::NotFinite, 9),
    ("TABLE", Fault::Table, 9),
];

/// Faults that only the header has: code, condition and blinks.
const OWN: [(&str, u8, &str, u8); 2] = [
    ("CALLER", 100, "upright_trip()", 8),
    ("ARITHMETIC", 101, "processor or compiler do not round as IEEE single precision", 9),
];

/// Every fault of the header, by its number of blinks.
pub fn header_faults() -> Vec<HeaderFault> {
    let of_firmware = OF_THE_FIRMWARE.map(|(name, fault, blinks)| HeaderFault {
        name,
        code: fault.code(),
        condition: match fault {
            Fault::Table => "the table has other values than those exported",
            fault => fault.entry().name,
        },
        blinks,
        brakes: fault.leaves_drive_working(),
    });
    let own = OWN.map(|(name, code, condition, blinks)| HeaderFault {
        name,
        code,
        condition,
        blinks,
        brakes: false,
    });
    let mut faults: Vec<_> = of_firmware.into_iter().chain(own).collect();
    faults.sort_by_key(|fault| fault.blinks);
    faults
}

/// The faults as an enumeration in C.
pub(super) fn enumeration() -> String {
    let line = |HeaderFault { name, code, condition, .. }: HeaderFault| {
        format!("    UPRIGHT_{name} = {code}, /* {condition} */\n")
    };
    let lines: String = header_faults().into_iter().map(line).collect();
    let title = "/* Why the motor was turned off; the codes are those of the firmware. */";
    format!("{title}\ntypedef enum {{\n    UPRIGHT_NO_FAULT = 0,\n{lines}}} upright_fault;\n\n")
}

/// Functions in C of a fault: how often a light blinks for it, and with pulses whether they bring the cart to rest.
/// They are chains of conditions: of a switch, a compiler would make a table, which takes RAM on an AVR.
pub(super) fn functions(has_steps: bool) -> String {
    let faults = header_faults();
    let is_one_of = |faults: &mut dyn Iterator<Item = &HeaderFault>| {
        faults
            .map(|fault| format!("fault == UPRIGHT_{}", fault.name))
            .collect::<Vec<_>>()
            .join("\n        || ")
    };
    let line = |blinks: u8| {
        let faults = is_one_of(&mut faults.iter().filter(|fault| fault.blinks == blinks));
        format!("    if ({faults}) {{\n        return {blinks};\n    }}\n")
    };
    let last = faults.last().map_or(0, |fault| fault.blinks);
    let blinks: String = (1..=last).map(line).collect();
    let mut text = format!(
        "/* How often a light blinks for a fault, so that it can be counted; 0 without a fault. */\n\
         UPRIGHT_CALL uint8_t upright_blinks(upright_fault fault)\n{{\n{blinks}    return 0;\n}}\n\n"
    );
    if has_steps {
        let brakes = is_one_of(&mut faults.iter().filter(|fault| fault.brakes));
        text += &format!(
            "/* Whether the drive may still bring the cart to rest after a fault. */\n\
             static inline bool upright_brakes(upright_fault fault)\n{{\n    return {brakes};\n}}\n\n"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_light_blinks_so_seldom_that_it_can_be_counted_and_no_number_is_left_out() {
        let mut blinks: Vec<u8> = header_faults().iter().map(|fault| fault.blinks).collect();
        blinks.dedup();
        assert_eq!(blinks, (1..=9).collect::<Vec<u8>>());
    }
}
