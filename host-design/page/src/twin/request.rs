//! What the page asks for.

use serde::Deserialize;

/// A message of the page. Messages without parameters are written with braces: serde refuses unknown fields only there.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub enum PageRequest {
    /// Nothing: shows that the page is alive.
    Alive {},
    /// To be in command, if nobody else is.
    Command {},
    /// To give up command.
    Release {},
    /// A command to the firmware, in the words of the monitor: `arm`, `set-point 0.05`.
    Say {
        /// The command.
        line: String,
    },
    /// To start or stop a recording.
    Record {
        /// Whether it begins.
        on: bool,
    },
    /// An action on the simulated machine.
    Machine {
        /// The action.
        what: MachineRequest,
    },
}

/// What can be done with a simulated machine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum MachineRequest {
    /// Pulls a body towards a point.
    Pull {
        /// 0: cart, 1: first link …
        body: usize,
        /// Where on the link: 0 at its joint, 1 at its end.
        along: f64,
        /// The point, along the rail (m).
        x: f64,
        /// The point, up from the rail (m).
        y: f64,
    },
    /// Lets go of what is pulled.
    LetGo {},
    /// Holds the rig by hand.
    Hold {
        /// How.
        how: Holding,
    },
    /// Sets a property of the machine that the controller does not know.
    Set {
        /// Its name.
        name: String,
        /// Its value, in its unit.
        value: f64,
    },
    /// Begins a defect of the campaign, or mends the machine.
    Defect {
        /// Its name; none to mend the machine.
        name: Option<String>,
        /// At which sensor (0: cart).
        sensor: usize,
    },
    /// Sets the speed of time.
    Speed {
        /// 1 is real time.
        factor: f64,
    },
    /// Stops simulated time, or resumes it.
    Pause {
        /// Whether time stops.
        on: bool,
    },
    /// Runs some ticks while time is stopped.
    Step {
        /// How many.
        ticks: u32,
    },
    /// Begins or ends the challenge.
    Challenge {
        /// Whether it begins.
        on: bool,
    },
    /// Switches the power off and on.
    Restart {
        /// Whether the rig is then raised by hand; otherwise it hangs.
        upright: bool,
    },
}

/// What a hand does with the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Holding {
    /// Nothing.
    Free,
    /// Lets the links hang, cart at the middle.
    Hanging,
    /// Does what the sign check asks for.
    Guided,
    /// Holds all links upright.
    Upright,
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_message_with_an_unknown_field_is_refused_whatever_it_asks() {
        let machine = |what: serde_json::Value| json!({ "ask": "machine", "what": what });
        let messages = [
            json!({ "ask": "alive" }),
            json!({ "ask": "command" }),
            json!({ "ask": "release" }),
            json!({ "ask": "say", "line": "arm" }),
            json!({ "ask": "record", "on": true }),
            machine(json!({ "do": "let-go" })),
            machine(json!({ "do": "pause", "on": true })),
        ];
        for message in messages {
            assert!(serde_json::from_value::<PageRequest>(message.clone()).is_ok(), "{message}");
            for place in [&[][..], &["what"]] {
                let mut other = message.clone();
                let object = place.iter().try_fold(&mut other, |inner, name| inner.get_mut(name));
                let Some(object) = object else { continue };
                object["x"] = json!(1);
                assert!(serde_json::from_value::<PageRequest>(other.clone()).is_err(), "{other}");
            }
        }
    }
}
