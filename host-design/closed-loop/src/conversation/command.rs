//! Actions of a person, and lines of text as commands.

use upright::protocol::message::Request;
use upright::table::{Equilibrium, Law};

use upright_design::motion::equilibrium_named;

/// What a person asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MonitorAction {
    /// Send this command to the firmware.
    Send(Request),
    /// Move the set-point by this (m).
    Shift(f32),
    /// Go to the equilibrium in which the link of this index (0: the first one) is turned over and the others stay.
    Turn(usize),
    /// Switch to the other control law.
    OtherLaw,
    /// Start or stop a recording.
    Record,
    /// End the monitor.
    Quit,
}

/// A line that is not a command.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no command; give home, home-rail, check-signs, jog +x|-x, arm, up, down, goto LINKS (as ud), still, disarm, clear, set-point METRES, or law lqr|pole-placement"
)]
pub struct BadCommand(String);

/// The request of a line of text, such as `arm` or `set-point 0.05` (m).
///
/// # Errors
/// [`BadCommand`], which lists the commands.
pub fn request(line: &str) -> Result<Request, BadCommand> {
    let bad = || BadCommand(line.trim().to_owned());
    let words: Vec<&str> = line.split_whitespace().collect();
    Ok(match words.as_slice() {
        ["home"] => Request::Home,
        ["home-rail"] => Request::HomeRail,
        ["check-signs"] => Request::CheckSigns,
        ["jog", "+x"] => Request::Jog { along: true },
        ["jog", "-x"] => Request::Jog { along: false },
        ["arm"] => Request::Arm,
        ["up"] => Request::Goto(Equilibrium::UPRIGHT),
        ["down"] => Request::Goto(Equilibrium::HANGING),
        ["goto", links] => Request::Goto(equilibrium_named(links, links.len()).ok_or_else(bad)?),
        ["still"] => Request::Still,
        ["disarm"] => Request::Disarm,
        ["clear"] => Request::Clear,
        ["set-point", metres] => Request::Setpoint(metres.parse().map_err(|_| bad())?),
        ["law", name] => Request::Select(Law::from_option(name).ok_or_else(bad)?),
        _ => return Err(bad()),
    })
}
