//! The page in one file: module, examples, scripts and styles are in it, so it needs no network and no server.

use serde::Serialize;
use serde_json::{Value, json};
use upright::protocol::BAUD;
use upright_page::{Desk, Lab};

use super::motions::without_knots;
use super::twin::{TwinPage, bare, shared};
use crate::figure::{COLOURS_CSS, page_theme, style_sheet};
use crate::packed::packed;
use crate::policy::{base64, source};

const PAGE: &str = include_str!("page/desk.html");
const STYLE: &str = include_str!("page/desk.css");
const WORKER: &str =
    concat!(include_str!("page/worker.js"), include_str!("page/running.js"), include_str!("page/talking.js"));
const SCRIPTS: [&str; 18] = [
    include_str!("page/lzma.js"),
    include_str!("page/link.js"),
    include_str!("page/sharing.js"),
    include_str!("page/motions.js"),
    include_str!("page/drawing.js"),
    include_str!("page/number.js"),
    include_str!("page/past.js"),
    include_str!("page/editor.js"),
    include_str!("page/panels.js"),
    include_str!("page/dials.js"),
    include_str!("page/machine.js"),
    include_str!("page/compared.js"),
    include_str!("page/live.js"),
    include_str!("page/serial.js"),
    include_str!("page/balance.js"),
    include_str!("page/labs.js"),
    include_str!("page/trust.js"),
    include_str!("page/desk.js"),
];
/// Where the twin's page has the modules that the desk has, too, and what stands behind them in the desk's script.
const SHARED_MARK: &str = "{shared}";
const SHARED_END: &str = "end of what is shared";
/// The rig that moves when the page is opened.
const FIRST: &str = "single-quanser-ip02";

/// A rig from which a person can start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Example {
    /// Its name.
    pub name: String,
    /// Its rig file.
    pub toml: String,
    /// Its stored motions from hanging to upright and back, if there are any.
    pub motions: Option<String>,
}

/// The page with this module, these examples and these labs.
///
/// Its content security policy lets it run the scripts and styles in it, which it names by their hashes, and the
/// module; it cannot ask any computer for anything.
pub fn page(module: &[u8], examples: &[Example], labs: &[Lab]) -> String {
    // The rules of the figures come first: the colours of the dark scheme replace theirs.
    let style = [style_sheet().as_str(), COLOURS_CSS, STYLE].concat();
    let twin = TwinPage::new();
    let shared = shared();
    let script = bare(&format!("'use strict';\n{{\n{shared}'{SHARED_END}';\n{}}}\n", SCRIPTS.concat()));
    // A document inside the page has its policy.
    let policy = format!(
        "default-src 'none'; script-src '{}' '{}' 'wasm-unsafe-eval' blob:; style-src '{}' '{}'; img-src data:; \
         worker-src blob:; base-uri 'none'; form-action 'none'",
        source(&script),
        source(&twin.script),
        source(&style),
        source(&twin.style)
    );
    let (shown, knots) = shown(examples);
    // The page puts back what its own script has, too.
    let texts = json!({
        "twin": twin.html.replacen(&shared, SHARED_MARK, 1),
        "labs": labs.iter().map(Lab::shown).collect::<Vec<_>>(),
    });
    let parts = [
        ("{policy}", policy),
        ("{style}", style),
        ("{baud}", BAUD.to_string()),
        ("{examples}", embedded(&shown)),
        ("{first}", embedded(&first(examples))),
        ("{worker}", embedded(&bare(WORKER))),
        ("{theme}", embedded(&page_theme())),
        ("{texts}", base64(&packed(embedded(&texts).as_bytes()))),
        ("{motions}", base64(&packed(&knots))),
        ("{module}", base64(&packed(module))),
        ("{script}", script),
    ];
    let (mut page, mut rest) = (String::new(), PAGE);
    for (mark, part) in parts {
        // Every mark is in the page; a test checks that none is left.
        let (before, after) = rest.split_once(mark).unwrap_or((rest, ""));
        page += before;
        page += &part;
        rest = after;
    }
    page + rest
}

/// The rig that is shown before the module can be asked: its name, and what is drawn of it.
fn first(examples: &[Example]) -> Value {
    let Some(first) = examples.iter().find(|example| example.name == FIRST).or(examples.first()) else {
        return Value::Null;
    };
    let question = json!({ "ask": "check", "toml": first.toml }).to_string();
    let sketch: Value = serde_json::from_str(&Desk::default().answer(&question)).unwrap_or_default();
    json!({ "name": first.name, "sketch": sketch })
}

/// The examples as the page reads them, and the knots of all their motions.
fn shown(examples: &[Example]) -> (Vec<Value>, Vec<u8>) {
    let mut knots = Vec::new();
    let mut of = |example: &Example| {
        let motions = example.motions.as_deref().and_then(without_knots).map(|(text, mut bytes)| {
            let from = knots.len();
            knots.append(&mut bytes);
            json!({ "text": text, "from": from })
        });
        json!({ "name": example.name, "toml": example.toml, "motions": motions })
    };
    (examples.iter().map(&mut of).collect(), knots)
}

/// JSON that can stand in a page.
fn embedded(value: &impl Serialize) -> String {
    // Serialising strings into memory does not fail.
    serde_json::to_string(value).unwrap_or_default().replace("</", "<\\/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_holds_all_of_its_parts_and_asks_for_nothing() {
        let toml = "name = \"</script>\"".to_owned();
        let page = page(b"module", &[Example { name: "mine".to_owned(), toml, motions: None }], &[]);
        assert!(page.contains("default-src 'none'") && page.contains("<\\/script>"));
        assert_eq!(page.matches("</script>").count(), 8);
        assert!(page.trim_end().ends_with("</html>"), "a mark is missing in the page");
        for request in ["src=\"", "@import", "fetch(", "XMLHttpRequest", "https://", "url("] {
            assert!(!page.contains(request), "{request}");
        }
    }
}
