//! The twin's page as a part of another page: its files in one document.

use crate::figure::{COLOURS_CSS, style_sheet};
use crate::twin::assets::{ASSETS, Asset};

/// The modules of its script, each after those that it imports: first those that the desk has, too.
const MODULES: [&str; 12] = [
    "colours.js",
    "scale.js",
    "words.js",
    "guide.js",
    "above.js",
    "rig.js",
    "link.js",
    "history.js",
    "scope.js",
    "controls.js",
    "drawers.js",
    "main.js",
];
const SHARED: usize = 6;

/// The twin's page in one document.
pub(super) struct TwinPage {
    /// The document.
    pub(super) html: String,
    /// The style sheet in it.
    pub(super) style: String,
    /// The script in it.
    pub(super) script: String,
}

impl TwinPage {
    /// Puts the files together.
    pub(super) fn new() -> Self {
        let style = [style_sheet().as_str(), COLOURS_CSS, file("page.css")].concat();
        let own: String = MODULES.iter().skip(SHARED).map(|name| module(name, file(name))).collect();
        let script = format!("'use strict';\n{}{}", shared(), bare(&own));
        let is_apart =
            |line: &&str| line.starts_with("<link rel=\"stylesheet\"") || line.starts_with("<script");
        let (mut html, mut is_styled) = (String::new(), false);
        for line in file("").lines() {
            match line {
                line if !is_apart(&line) => html.extend([line, "\n"]),
                _ if is_styled => {}
                _ => {
                    is_styled = true;
                    html.extend(["<style>", &style, "</style>\n"]);
                }
            }
        }
        // Last, as scripts that are modules are run.
        let html = html.replace("</body>", &format!("<script>{script}</script>\n</body>"));
        Self { html, style, script }
    }
}

/// The modules that the desk has, too.
pub(super) fn shared() -> String {
    let modules: String = MODULES.iter().take(SHARED).map(|name| module(name, file(name))).collect();
    bare(&format!("const modules = {{}};\n{modules}"))
}

/// A script without its comments and indentation, which a page need not carry.
pub(super) fn bare(script: &str) -> String {
    let lines = script.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//"));
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// The content of a file of the twin's page.
fn file(name: &str) -> &'static str {
    ASSETS.iter().find(|asset: &&Asset| asset.name == name).map_or("", |asset| asset.content)
}

/// A module as a block that finds its imports in `modules`, and puts its exports there.
fn module(name: &str, text: &str) -> String {
    let (mut block, mut exports) = (String::new(), Vec::new());
    for line in text.lines() {
        let imported = line.strip_prefix("import ").and_then(|line| line.strip_suffix("';"));
        match (imported.and_then(|line| line.split_once(" from './")), line.strip_prefix("export ")) {
            (Some((names, from)), _) => block += &format!("const {names} = modules['{from}'];\n"),
            (None, Some(defined)) => {
                let words = defined.split(|letter: char| !letter.is_alphanumeric());
                exports.extend(words.skip(1).find(|word| !word.is_empty()));
                block += &format!("{defined}\n");
            }
            (None, None) => block += &format!("{line}\n"),
        }
    }
    format!("{{\n{block}modules['{name}'] = {{ {} }};\n}}\n", exports.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_module_finds_what_it_imports_and_gives_what_it_exports() {
        let text = "import { a, b } from './x.js';\nexport function f(c) { return a(c); }\nexport const g = b;\nlet h;\n";
        let block = "{\nconst { a, b } = modules['x.js'];\nfunction f(c) { return a(c); }\nconst g = b;\nlet h;\n\
                     modules['y.js'] = { f, g };\n}\n";
        assert_eq!(module("y.js", text), block);
    }

    #[test]
    fn each_file_of_the_page_is_in_the_document_after_what_it_imports() {
        let TwinPage { html, script, .. } = TwinPage::new();
        for Asset { name, content, .. } in ASSETS.iter().filter(|asset| asset.name.ends_with(".js")) {
            let own = script.find(&format!("modules['{name}'] =")).expect(name);
            for line in content.lines().filter(|line| line.starts_with("import ")) {
                let from = line.split("'./").nth(1).and_then(|from| from.strip_suffix("';")).unwrap();
                assert!(script.find(&format!("modules['{from}'] =")).is_some_and(|at| at < own), "{line}");
            }
        }
        assert_eq!(script.matches("\nimport ").count() + script.matches("\nexport ").count(), 0);
        assert!(
            !html.contains("src=") && !html.contains("stylesheet") && html.contains("<canvas id=\"rig\"")
        );
    }
}
