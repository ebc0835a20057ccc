//! Attribution of the image's functions to the parts of a tick.

use std::collections::HashMap;

use rustc_demangle::demangle;
use upright_board::{CodePlace, Image, TickPart};

/// Address of flash, where the code is.
const FLASH: u32 = 0x0800_0000;

/// The places of all half-words of flash, by the image's debug information; without it, every place is unknown.
pub(super) fn places(image: &Image) -> Vec<CodePlace> {
    let lines = image.lines();
    // A cache by name: thousands of instructions belong to a few hundred functions.
    let mut known = HashMap::new();
    let place = |half_word: usize| {
        let names = lines.as_ref().map_or(Vec::new(), |lines| lines.functions(FLASH + 2 * half_word as u32));
        place_of(names, &mut known)
    };
    (0..image.end() / 2).map(place).collect()
}

/// The place of an instruction, by the functions that it is in, the innermost first; `known` caches each function's.
fn place_of(names: Vec<String>, known: &mut HashMap<String, CodePlace>) -> CodePlace {
    names.into_iter().fold(CodePlace::default(), |place, name| {
        let own = known.entry(name).or_insert_with_key(|name| {
            let path = format!("{:#}", demangle(name));
            CodePlace { part: part_of(&path), controller: is_controller(&path) }
        });
        CodePlace { part: place.part.or(own.part), controller: place.controller.or(own.controller) }
    })
}

/// The part of the tick that a function belongs to, by its path; `None` if that depends on its caller.
fn part_of(path: &str) -> Option<TickPart> {
    let is =
        |owner: &str, names: &[&str]| path.contains(owner) && names.iter().any(|name| path.ends_with(name));
    if is("F4Hardware", &["::inputs"]) {
        Some(TickPart::Inputs)
    } else if is("F4Hardware", &["::drive"]) {
        Some(TickPart::Output)
    } else if is("firmware::Firmware", &["::accept", "::act"]) {
        Some(TickPart::Control)
    } else if is("firmware::Firmware", &["::report", "::predict", "::complete"])
        || path.contains("protocol::queue")
        || is("F4Hardware", &["::end_tick", "::feed_watchdog"])
    {
        Some(TickPart::Rest)
    } else {
        None
    }
}

/// Whether a function belongs to the controller, by its path; `None` if that depends on its caller.
fn is_controller(path: &str) -> Option<bool> {
    if path.contains("control::controller::Controller") {
        Some(true)
    } else if ["firmware::", "supervision::", "F4Hardware"].iter().any(|other| path.contains(other)) {
        Some(false)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_function_with_a_part_decides() {
        let names =
            ["core::f32::abs", "upright::control::controller::Controller::predict"].map(str::to_owned);
        let mut chain = names.to_vec();
        let place_of = |chain: &[String]| place_of(chain.to_vec(), &mut HashMap::new());
        assert_eq!(place_of(&chain), CodePlace { part: None, controller: Some(true) });
        chain.push("upright::firmware::Firmware<_,_,_>::complete".to_owned());
        assert_eq!(place_of(&chain), CodePlace { part: Some(TickPart::Rest), controller: Some(true) });
        assert_eq!(place_of(&[]), CodePlace::default());
    }
}
