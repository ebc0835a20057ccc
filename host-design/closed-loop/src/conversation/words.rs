//! States, sensors and instructions in words.

use crate::client::AnyTelemetry;
use upright::board::Contacts;
use upright::protocol::message::CrashRecord;
use upright::supervision::homing::Homing;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

/// A state of the supervisor in words.
pub fn state(state: State) -> &'static str {
    match state {
        State::Disarmed => "disarmed: positions are not known",
        State::Homing => "homing",
        State::Calibrated => "calibrated: motor off",
        State::Jogging => "jogging: the motor pushes the cart while the key is held",
        State::Identifying => "identifying: the motor shakes the links",
        State::Armed => "armed: waits until all links are upright and still",
        State::Raising => "raising: the motor is on",
        State::Balancing => "balancing: the motor is on",
        State::Holding => "holding where some links hang: the motor is on",
        State::Lowering => "lowering: the motor is on",
        State::Stilling => "stilling: the motor brings the links to rest",
        State::Fault => "fault: motor off",
    }
}

/// Name of a sensor by its index: 0 is the cart's, then those of the links.
pub fn joint(sensor: u8) -> String {
    if sensor == 0 { "cart".to_owned() } else { format!("link {sensor}") }
}

/// Where the program has crashed: the words that the board records, with the registers of a Cortex-M as its manual
/// names them (ARM DDI 0403, B3.2). Program counter (PC) and link register (LR) are 0 after a panic, and after a stack
/// overflow, which leaves no room for them; BFAR is valid if bit 15 of CFSR is set. An address without a link register
/// and without a fault of the processor is that of memory that has changed.
pub fn crash(record: &CrashRecord) -> String {
    let CrashRecord([pc, lr, cfsr, hfsr, bfar]) = record;
    if *pc != 0 && [lr, cfsr, hfsr] == [&0; 3] {
        return format!(
            "memory has changed at {pc:#010x}: the gain table, or, at the end of the image, its code"
        );
    }
    format!("crash at PC {pc:#010x}, LR {lr:#010x}, CFSR {cfsr:#010x}, HFSR {hfsr:#010x}, BFAR {bfar:#010x}")
}

/// Supply of the power stage, and the contacts and flags that are active in this tick.
pub fn inputs(telemetry: &AnyTelemetry) -> String {
    let Contacts { limit_low, limit_high, emergency_stop, driver_fault, overrun, clock_fault, board_fault } =
        telemetry.contacts;
    let all = [
        (limit_low, "limit switch low"),
        (limit_high, "limit switch high"),
        (emergency_stop, "emergency stop"),
        (driver_fault, "driver fault"),
        (overrun, "overrun"),
        (clock_fault, "clock"),
        (board_fault, "board"),
    ];
    let active: Vec<&str> = all.into_iter().filter(|(active, _)| *active).map(|(_, name)| name).collect();
    let active = if active.is_empty() { "none".to_owned() } else { active.join(", ") };
    format!("supply {:.1} V, active inputs: {active}", telemetry.supply_v)
}

/// What to do about [`Homing::OtherZero`].
pub const OTHER_ZERO: &str = "a link hangs elsewhere than at its absolute sensor's zero: let it hang, or measure the zero: `upright commission --zeros`";

/// The next step that homing, sign check or motor check asks of a person; `None` if there is none.
pub fn instruction(telemetry: &AnyTelemetry) -> Option<String> {
    let move_it = |sensor: u8| match sensor {
        0 => "push the cart along +x".to_owned(),
        link => format!("turn link {link} counter-clockwise"),
    };
    match (telemetry.homing, telemetry.signs) {
        (Homing::Touch { low: false, .. }, _) => {
            Some("push the cart to the switch at the low end".to_owned())
        }
        (Homing::Touch { .. }, _) => Some("push the cart to the switch at the high end".to_owned()),
        (Homing::HoldStill, _) => {
            Some("let the links hang still, or swing for 15 s, away from the switches".to_owned())
        }
        (Homing::OtherZero, _) => Some(OTHER_ZERO.to_owned()),
        (Homing::WrongTravel, _) => {
            Some("the switches are not as far apart as the rig file says; check them, home again".to_owned())
        }
        (_, Signs::Rest(sensor)) => Some(format!("let the links hang at rest; then {}", move_it(sensor))),
        (_, Signs::Move(sensor)) => Some(move_it(sensor)),
        (_, Signs::Reversed(sensor)) => {
            let remedy = "swap its channels, or set the direction of an absolute sensor";
            Some(format!("the encoder of the {} counts the wrong way: {remedy}", joint(sensor)))
        }
        (_, Signs::Swapped { asked, moved }) => Some(format!(
            "the encoder of the {} has counted instead of that of the {}: swap their plugs",
            joint(moved),
            joint(asked)
        )),
        _ => motor(telemetry.motor),
    }
}

/// What to do about the motor, once the encoders' signs are checked.
fn motor(sign: MotorSign) -> Option<String> {
    match sign {
        MotorSign::Reversed => Some(
            "the motor pushes the wrong way: switch its supply off and swap its wires, or its direction signal"
                .to_owned(),
        ),
        MotorSign::Still => Some(
            "the motor has not moved the cart: check its supply, its wires, the cart, and `jog_force_n` of the rig file"
                .to_owned(),
        ),
        MotorSign::Unchecked | MotorSign::Checked => None,
    }
}
