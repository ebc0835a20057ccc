//! What a person does first in the page, with the keyboard alone, on a telephone's width.
//!
//! Runs where `UPRIGHT_REQUIRE_WASM=1` is set, and needs Chromium or Chrome.

use std::path::Path;

use upright_test_support::limits::until as until_there;

use crate::report_devtools::Browser;
use crate::site_page::{TELEPHONE, opened_in, root, until as until_designed, written};
use crate::twin_page::{MACHINE, STATE, let_pass, until, until_state};

/// Presses Tab until an expression is true of the element that has the focus.
fn tab_to(browser: &mut Browser, is_it: &str) {
    for _ in 0..300 {
        if browser.value(&format!("(({{ id, dataset }}) => {is_it})(document.activeElement)")) == true {
            return;
        }
        browser.strike("Tab");
    }
    panic!("the focus never comes to {is_it}");
}

/// Opens a panel of the desk.
fn turn_to(browser: &mut Browser, tab: &str) {
    tab_to(browser, &format!("dataset.tab === '{tab}'"));
    browser.strike("Enter");
}

/// A rig file without its comments, as a person types it.
fn without_comments(file: &str) -> String {
    let text = std::fs::read_to_string(root().join("rigs").join(file)).unwrap();
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim_end());
    lines.filter(|line| !line.is_empty()).map(|line| format!("{line}\n")).collect()
}

/// What the page has saved as `file`, once it is there.
pub(crate) fn saved(file: &Path) -> String {
    until_there(&format!("{} is saved", file.display()), || {
        std::fs::read_to_string(file).ok().filter(|text| !text.is_empty())
    })
}

/// Types the paper's rig into the empty editor, and saves its table into a folder.
fn typed_and_exported(browser: &mut Browser, folder: &Path) {
    let toml = without_comments("quadruple-paper.toml");
    turn_to(browser, "file");
    tab_to(browser, "id === 'toml'");
    for command in ["selectAll", "deleteBackward"] {
        browser.edit(command);
    }
    assert_eq!(browser.value("document.getElementById('toml').value"), "");
    until_designed(browser, "!document.getElementById('problem').hidden");
    for letter in toml.chars() {
        let key = letter.to_string();
        browser.strike(if letter == '\n' { "Enter" } else { &key });
    }
    assert_eq!(browser.value("document.getElementById('toml').value"), toml);
    until_designed(
        browser,
        "document.getElementById('problem').hidden && !document.getElementById('balance').disabled",
    );
    let gains = browser.value("document.getElementById('gains').textContent");
    assert!(gains.as_str().unwrap().contains("3.16228  3.68443  −14.6001  −5.75422"), "{gains}");

    // The table that is saved is the one of the command line, byte for byte.
    let typed = folder.join("typed.toml");
    std::fs::write(&typed, &toml).unwrap();
    browser.save_into(folder);
    turn_to(browser, "export");
    tab_to(browser, "id === 'save-table'");
    browser.strike("Enter");
    let table = saved(&folder.join("gains.rs"));
    assert_eq!(table, written(&["design", typed.to_str().unwrap()], "--out"));
    // Negative control: with another weight, the command line writes another table.
    std::fs::write(&typed, toml.replace("force_weight = 1\n", "force_weight = 2\n")).unwrap();
    assert_ne!(table, written(&["design", typed.to_str().unwrap()], "--out"));
}

#[test]
fn the_papers_rig_is_typed_designed_exported_balanced_pulled_broken_and_put_back_with_keys_alone() {
    let Some((mut browser, folder)) = opened_in(TELEPHONE) else { return };
    typed_and_exported(&mut browser, folder.path());
    turn_to(&mut browser, "try");
    tab_to(&mut browser, "id === 'balance'");
    browser.strike("Enter");
    until(&mut browser, "document.querySelector('#twin iframe')?.contentWindow?.upright?.seen?.picture");
    browser.inside = Some("#twin iframe");
    until_state(&mut browser, "Balancing");
    let_pass(&mut browser, 1.0);
    // Four links survive little: the cart is pulled.
    tab_to(&mut browser, "id === 'rig'");
    browser.strike("0");
    browser.key_event("keyDown", "ArrowRight");
    until(&mut browser, &format!("{MACHINE}.pull?.body === 0"));
    browser.key_event("keyUp", "ArrowRight");
    let_pass(&mut browser, 3.0);
    assert_eq!(browser.value(STATE), "Balancing", "{}", browser.value("upright.seen.picture.fault"));

    tab_to(&mut browser, "dataset.tab === 'break'");
    browser.strike("Enter");
    tab_to(&mut browser, "dataset.defect === 'encoder-wire-open'");
    browser.strike("Enter");
    until_state(&mut browser, "Fault");
    browser.key("b");
    until_state(&mut browser, "Balancing");
    browser.strike("Escape");
    until(&mut browser, &format!("({STATE}) !== 'Balancing'"));
    for inside in [browser.inside, None] {
        browser.inside = inside;
        let width = browser.value("document.documentElement.scrollWidth").as_u64();
        assert!(width.is_some_and(|width| width <= u64::from(TELEPHONE)), "it scrolls sideways: {width:?}");
    }
    assert_eq!(browser.errors(), Vec::<String>::new());
}
