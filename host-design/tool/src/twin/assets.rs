//! The files of the page. They are part of the program: the page needs no network.

use crate::figure::COLOURS_CSS;

/// A file of the page.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Asset {
    /// Its name in the address; empty for the page itself.
    pub(crate) name: &'static str,
    /// Its media type.
    pub(crate) media_type: &'static str,
    /// Its content.
    pub(crate) content: &'static str,
}

const SCRIPT: &str = "text/javascript";

/// All files of the page.
pub(crate) const ASSETS: [Asset; 15] = [
    Asset { name: "", media_type: "text/html", content: include_str!("page/page.html") },
    Asset { name: "colours.css", media_type: "text/css", content: COLOURS_CSS },
    Asset { name: "page.css", media_type: "text/css", content: include_str!("page/page.css") },
    Asset { name: "main.js", media_type: SCRIPT, content: include_str!("page/main.js") },
    Asset { name: "colours.js", media_type: SCRIPT, content: include_str!("page/colours.js") },
    Asset { name: "scale.js", media_type: SCRIPT, content: include_str!("page/scale.js") },
    Asset { name: "words.js", media_type: SCRIPT, content: include_str!("page/words.js") },
    Asset { name: "link.js", media_type: SCRIPT, content: include_str!("page/link.js") },
    Asset { name: "guide.js", media_type: SCRIPT, content: include_str!("page/guide.js") },
    Asset { name: "history.js", media_type: SCRIPT, content: include_str!("page/history.js") },
    Asset { name: "above.js", media_type: SCRIPT, content: include_str!("page/above.js") },
    Asset { name: "rig.js", media_type: SCRIPT, content: include_str!("page/rig.js") },
    Asset { name: "scope.js", media_type: SCRIPT, content: include_str!("page/scope.js") },
    Asset { name: "controls.js", media_type: SCRIPT, content: include_str!("page/controls.js") },
    Asset { name: "drawers.js", media_type: SCRIPT, content: include_str!("page/drawers.js") },
];
