//! What the page asks for.

use serde::Deserialize;

/// A message of the page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum PageRequest {
    /// Nothing: shows that the page is alive.
    Alive,
    /// To be in command, if nobody else is.
    Command,
    /// To give up command.
    Release,
    /// A command to the firmware, in the words of the monitor: `arm`, `set-point 0.05`.
    Say { line: String },
    /// To start or stop a recording.
    Record { on: bool },
    /// An action on the simulated machine.
    Machine { what: MachineRequest },
}

/// What can be done with a simulated machine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum MachineRequest {
    /// Pulls a body (0: cart, 1: first link …) at the fraction `along` of its length towards a point (m).
    Pull { body: usize, along: f64, x: f64, y: f64 },
    /// Lets go of what is pulled.
    LetGo,
    /// Holds the rig by hand.
    Hold { how: Holding },
    /// Sets a property of the machine that the controller does not know.
    Set { name: String, value: f64 },
    /// Begins a defect of the campaign, or mends the machine.
    Defect { name: Option<String>, sensor: usize },
    /// Speed of time: 1 is real time.
    Speed { factor: f64 },
    /// Stops simulated time, or resumes it.
    Pause { on: bool },
    /// Runs some ticks while time is stopped.
    Step { ticks: u32 },
    /// Begins or ends the challenge.
    Challenge { on: bool },
    /// Switches the power off and on.
    Restart { upright: bool },
}

/// What a hand does with the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Holding {
    /// Nothing.
    Free,
    /// Lets the links hang, cart at the middle.
    Hanging,
    /// Does what the sign check asks for.
    Guided,
    /// Holds all links upright.
    Upright,
}
