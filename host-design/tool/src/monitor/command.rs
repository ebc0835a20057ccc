//! Keys as actions.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use upright::protocol::message::Request;
use upright::table::Equilibrium;
use upright_closed_loop::conversation::MonitorAction;

/// Change of the set-point per press of an arrow key (m).
const SHIFT_M: f32 = 0.01;

/// The action of a key; `None` if the key does nothing.
pub fn action(key: &KeyEvent) -> Option<MonitorAction> {
    if key.modifiers.contains(KeyModifiers::CONTROL) {
        return (key.code == KeyCode::Char('c')).then_some(MonitorAction::Quit);
    }
    Some(match key.code {
        KeyCode::Char('h') => MonitorAction::Send(Request::Home),
        KeyCode::Char('H') => MonitorAction::Send(Request::HomeRail),
        KeyCode::Char('g') => MonitorAction::Send(Request::CheckSigns),
        KeyCode::Char('m') => MonitorAction::Send(Request::Jog { along: true }),
        KeyCode::Char('M') => MonitorAction::Send(Request::Jog { along: false }),
        KeyCode::Char('a') => MonitorAction::Send(Request::Arm),
        KeyCode::Char('u') => MonitorAction::Send(Request::Goto(Equilibrium::UPRIGHT)),
        KeyCode::Char('n') => MonitorAction::Send(Request::Goto(Equilibrium::HANGING)),
        KeyCode::Char('s') => MonitorAction::Send(Request::Still),
        KeyCode::Char('d' | ' ') => MonitorAction::Send(Request::Disarm),
        KeyCode::Char('c') => MonitorAction::Send(Request::Clear),
        KeyCode::Char('0') => MonitorAction::Send(Request::Setpoint(0.0)),
        KeyCode::Char(link @ '1'..='6') => MonitorAction::Turn(usize::from(link as u8 - b'1')),
        KeyCode::Left => MonitorAction::Shift(-SHIFT_M),
        KeyCode::Right => MonitorAction::Shift(SHIFT_M),
        KeyCode::Char('l') => MonitorAction::OtherLaw,
        KeyCode::Char('r') => MonitorAction::Record,
        KeyCode::Char('q') => MonitorAction::Quit,
        _ => return None,
    })
}
