//! The tables in the documents match the source. With UPRIGHT_BLESS=1 in the environment, the tests write them.

use std::collections::BTreeSet;
use std::process::Command;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use upright::boards::f4::{F4Board, HseSource};
use upright::boards::wiring::{STANDARD, Signal, Wire};
use upright::boards::{BOARDS, BoardRow, Family, named};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright_design::export::{CALLING, header_faults};
use upright_test_support::limits::output;
use upright_tool::campaign::Defect;
use upright_tool::commission::{CommissionStep, Planted};
use upright_tool::image::{PICO_BALANCING_CYCLES, PICO_MOTION_CYCLES};
use upright_tool::monitor::{MonitorAction, action, request};
use upright_tool::site::labs;

use crate::documents::{read, root};
use crate::published::rig_path;
use crate::stepper_command::{with_motor, with_slow_servo};

fn upright(arguments: &[&str]) -> String {
    let output = output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments));
    String::from_utf8(output.stdout).unwrap()
}

/// The text between the markers called `name`.
pub(crate) fn between<'a>(page: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = page.split_once(&format!("<!-- {name} -->"))?;
    Some(rest.split_once(&format!("<!-- /{name} -->"))?.0.trim())
}

/// Asserts that the table called `name` in `file` equals `wanted`, or writes it there.
fn hold(file: &str, name: &str, wanted: &str) {
    let page = read(file);
    let found = between(&page, name).unwrap_or_else(|| panic!("{file} has no <!-- {name} -->"));
    if std::env::var_os("UPRIGHT_BLESS").is_some() && found != wanted.trim() {
        let (before, rest) = page.split_once(&format!("<!-- {name} -->")).unwrap();
        let (_, after) = rest.split_once(&format!("<!-- /{name} -->")).unwrap();
        let page = format!("{before}<!-- {name} -->\n{}\n<!-- /{name} -->{after}", wanted.trim());
        return std::fs::write(root().join(file), page).unwrap();
    }
    assert_eq!(found, wanted.trim(), "put this between the markers in {file}:\n{wanted}");
}

/// The cells of each row of a table.
fn rows(table: &str) -> Vec<Vec<&str>> {
    let cells = |line| -> Vec<&str> { str::trim_matches(line, '|').split('|').map(str::trim).collect() };
    table.lines().skip(2).map(cells).collect()
}

fn faults() -> String {
    let mut table = String::from("| fault | what it means | what to do | ticks |\n|---|---|---|---|\n");
    for entry in Fault::ALL {
        table += &format!(
            "| {} {} | {} | {} | {} |\n",
            entry.fault.code(),
            entry.name,
            entry.condition,
            entry.remedy,
            entry.reaction
        );
    }
    table
}

/// How often a light blinks for the faults of the C header.
fn blinks() -> String {
    let mut rows: Vec<(u8, Vec<String>, Vec<&str>)> = Vec::new();
    for fault in header_faults() {
        if rows.last().is_none_or(|(blinks, ..)| *blinks != fault.blinks) {
            rows.push((fault.blinks, Vec::new(), Vec::new()));
        }
        let (_, codes, conditions) = rows.last_mut().unwrap();
        codes.push(fault.code.to_string());
        conditions.push(fault.condition);
    }
    let row = |(blinks, codes, conditions): (u8, Vec<String>, Vec<&str>)| {
        format!("| {blinks} | {} | {} |\n", codes.join(", "), conditions.join("; "))
    };
    "| blinks | `c.fault` | fault |\n|---|---|---|\n".to_owned()
        + &rows.into_iter().map(row).collect::<String>()
}

/// From where the functions of the C header may be called.
fn calling() -> String {
    let row = |(functions, from): (&[&str], &str)| format!("| `{}` | {from} |\n", functions.join("`, `"));
    "| function | from |\n|---|---|\n".to_owned() + &CALLING.into_iter().map(row).collect::<String>()
}

fn inhibits() -> String {
    let rows = Inhibits::ALL.iter().map(|(_, text)| match text.split_once(": ") {
        Some((reason, remedy)) => format!("| {reason} | {remedy} |\n"),
        None => format!("| {text} | |\n"),
    });
    "| reason | what to do |\n|---|---|\n".to_owned() + &rows.collect::<String>()
}

fn defects() -> String {
    let rows = Defect::ALL.iter().map(|defect| format!("| `{}` | {} |\n", defect.name(), defect.meaning()));
    "| kind | defect |\n|---|---|\n".to_owned() + &rows.collect::<String>()
}

fn steps() -> String {
    let rows = CommissionStep::ALL.iter().map(|(_, name, finds_out)| format!("| {name} | {finds_out} |\n"));
    "| step | what is found out |\n|---|---|\n".to_owned() + &rows.collect::<String>()
}

fn planted() -> String {
    let row = |one: Planted| {
        let [single, double] = [1, 2].map(|links| one.found_in(links).name());
        let step =
            if single == double { single.to_owned() } else { format!("{double}; with one link {single}") };
        format!("| `{one}` | {} | {step} |\n", one.meaning())
    };
    "| defect | what is wrong | found in |\n|---|---|---|\n".to_owned()
        + &Planted::all().map(row).collect::<String>()
}

/// The statuses that `upright --help` lists.
fn exit_statuses(help: &str) -> String {
    let list = help.split_once("Exit status:\n").unwrap().1.split_once("\n\n").unwrap().0;
    let row = |line: &str| {
        let (status, meaning) = line.trim().split_once("  ").unwrap();
        format!("| {status} | {meaning} |\n")
    };
    "| status | meaning |\n|---|---|\n".to_owned() + &list.lines().map(row).collect::<String>()
}

/// Names of the commands that a help text lists.
fn commands(help: &str) -> BTreeSet<&str> {
    let list = help.split_once("Commands:\n").unwrap().1.split_once("\n\n").unwrap().0;
    let names = list.lines().filter_map(|line| line.strip_prefix("  ")?.split_once(' '));
    names.map(|(name, _)| name).filter(|name| !name.is_empty() && *name != "help").collect()
}

#[test]
fn the_page_about_faults_holds_the_table_of_the_source() {
    hold("docs/faults.md", "faults", &faults());
}

#[test]
fn the_page_about_faults_holds_the_order_within_a_tick() {
    hold("docs/faults.md", "precedence", &Fault::PRECEDENCE.map(|fault| fault.to_string()).join(", "));
}

#[test]
fn the_page_about_faults_holds_the_reasons_against_a_command() {
    hold("docs/faults.md", "inhibits", &inhibits());
}

#[test]
fn the_page_about_the_c_header_holds_what_a_light_blinks_and_what_may_interrupt_what() {
    hold("docs/c-header.md", "blinks", &blinks());
    hold("docs/c-header.md", "calling", &calling());
}

#[test]
fn the_page_about_injection_holds_the_kinds_of_defects() {
    hold("docs/fault-injection.md", "defects", &defects());
}

#[test]
fn the_page_about_commissioning_holds_steps_and_planted_defects() {
    hold("docs/commission.md", "steps", &steps());
    hold("docs/commission.md", "planted", &planted());
}

#[test]
fn the_page_about_labs_holds_those_of_the_page() {
    let mut table = "| lab | minutes | what one can do afterwards |\n|---|---|---|\n".to_owned();
    for (number, lab) in (1..).zip(labs(&root().join("lessons")).unwrap()) {
        table += &format!("| {number} {} | {} | {} |\n", lab.title, lab.minutes, lab.goals);
    }
    hold("docs/labs.md", "labs", &table);
}

#[test]
fn the_page_about_commands_holds_the_exit_statuses_of_the_help() {
    hold("docs/commands.md", "exit statuses", &exit_statuses(&upright(&["--help"])));
}

#[test]
fn a_changed_word_of_a_table_would_be_noticed() {
    for table in [
        faults(),
        inhibits(),
        defects(),
        steps(),
        planted(),
        quantities(),
        exit_statuses(&upright(&["--help"])),
    ] {
        let page = format!("before\n<!-- x -->\n{table}\n<!-- /x -->\nafter");
        assert_eq!(between(&page, "x"), Some(table.trim()));
        let word = table.trim().rsplit(' ').nth(1).unwrap();
        assert_ne!(between(&page.replacen(word, "leant", 1), "x"), Some(table.trim()));
    }
    assert_eq!(between("no table", "x"), None);
}

#[test]
fn every_command_is_listed_with_its_guide() {
    let all = upright(&["--help"]);
    let firmware = upright(&["firmware", "--help"]);
    let mut wanted: BTreeSet<String> = commands(&all).iter().map(|&name| name.to_owned()).collect();
    assert!(wanted.remove("firmware"));
    wanted.extend(commands(&firmware).iter().map(|name| format!("firmware {name}")));
    let page = read("docs/commands.md");
    let rows = rows(between(&page, "commands").unwrap());
    let listed: BTreeSet<String> = rows.iter().map(|row| row[0].trim_matches('`').to_owned()).collect();
    assert_eq!(listed, wanted);
    // Negative control: a help text with one more command.
    let more = all.replacen("Commands:\n", "Commands:\n  dance  Dances\n", 1);
    assert!(commands(&more).contains("dance") && !listed.contains("dance"));
}

/// The key codes in a cell such as `d` or space.
fn keys(cell: &str) -> Vec<KeyCode> {
    let key = |word: &str| match word {
        "←" => KeyCode::Left,
        "→" => KeyCode::Right,
        "space" => KeyCode::Char(' '),
        _ => KeyCode::Char(word.trim_matches('`').chars().next().unwrap()),
    };
    cell.split(" or ").map(key).collect()
}

fn meaning(code: KeyCode) -> Option<MonitorAction> {
    action(&KeyEvent::new(code, KeyModifiers::NONE))
}

#[test]
fn every_key_of_the_monitor_is_listed_with_the_line_that_does_the_same() {
    let page = read("docs/in-the-loop.md");
    let mut listed = Vec::new();
    for row in rows(between(&page, "keys of the monitor").unwrap()) {
        for code in keys(row[0]) {
            let meaning = meaning(code).unwrap_or_else(|| panic!("{row:?}: this key does nothing"));
            let line = row[2].trim_matches('`');
            if !line.is_empty() && !line.contains(' ') || line == "set-point 0" {
                assert_eq!(meaning, MonitorAction::Send(request(line).unwrap()), "{row:?}");
            }
            listed.push(code);
        }
    }
    let printable = (' '..='~').map(KeyCode::Char);
    for code in printable.chain([KeyCode::Left, KeyCode::Right, KeyCode::Up, KeyCode::Down, KeyCode::Enter]) {
        assert_eq!(meaning(code).is_some(), listed.contains(&code), "{code:?}");
    }
    // Negative control: a key whose meaning differs from that of a line.
    assert_ne!(meaning(KeyCode::Char('a')), Some(MonitorAction::Send(request("disarm").unwrap())));
}

/// Names and meanings in the trust report; a name that ends in a space is followed by a link or a source.
fn quantities() -> String {
    let rows = upright_trust::verify::QUANTITIES.iter().map(|quantity| {
        let more = if quantity.name.ends_with(' ') { "…" } else { "" };
        format!("| `{}{more}` | {} |\n", quantity.name, quantity.meaning)
    });
    "| row | meaning |\n|---|---|\n".to_owned() + &rows.collect::<String>()
}

#[test]
fn the_page_about_trust_holds_the_meanings_of_the_source() {
    hold("docs/trust.md", "rows of verify", &quantities());
}

/// Whether a row's name is explained: exactly, or by a name that ends in `…`.
fn explains(listed: &str, name: &str) -> bool {
    match listed.trim_matches('`').strip_suffix('…') {
        Some(beginning) => name.starts_with(beginning),
        None => listed.trim_matches('`') == name,
    }
}

#[test]
fn every_row_of_verify_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let single = std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap();
    let tolerating = folder.path().join("tolerating.toml");
    let late = single.replace("[actuator]", "[actuator]\ndriver_lag_s = 0.02");
    std::fs::write(&tolerating, format!("{late}\n[robust]\nmass_percent = 1\n")).unwrap();
    let reports =
        [tolerating.display().to_string(), with_motor(folder.path()), with_slow_servo(folder.path())]
            .map(|rig| upright(&["verify", &rig, "--law", "lqr", "--runs", "1"]));
    // Two spaces, then the name in 26 columns; a line without a name continues the one above.
    let names: Vec<&str> = reports
        .iter()
        .flat_map(|report| report.split_once("\nrequirements").unwrap().0.lines())
        .filter_map(|line| line.strip_prefix("  ")?.get(..26).map(str::trim))
        .filter(|name| !name.is_empty())
        .collect();
    let page = read("docs/trust.md");
    let tables = ["rows of verify", "further rows of verify"].map(|name| rows(between(&page, name).unwrap()));
    let explained = |name: &str| tables.iter().flatten().any(|row| explains(row[0], name));
    for name in &names {
        assert!(explained(name), "docs/trust.md does not explain `{name}`");
    }
    for row in tables.iter().flatten() {
        assert!(names.iter().any(|name| explains(row[0], name)), "verify prints no {}", row[0]);
    }
    assert!(names.len() > 20 && !explained("luck margin") && !explained("RMS"));
}

#[test]
fn the_readme_shows_what_design_prints() {
    let rig = rig_path("quadruple-paper");
    let printed = upright(&["design", rig.to_str().unwrap(), "--no-write"]);
    let shown_by = |line: &str| printed.lines().any(|printed| printed.trim() == line.trim());
    let page = read("README.md");
    let block: Vec<&str> =
        page.lines().filter(|line| line.starts_with("    ") && line.trim() != "…").collect();
    assert!(block.len() > 8, "{block:?}");
    for line in block {
        assert!(shown_by(line), "README.md: `design` does not print\n{line}");
    }
    assert!(!shown_by("K       3.16228  3.68443"));
}

fn ticks_of_a_pico() -> String {
    let head = "| links | balancing (cycles) | following a motion (cycles) |\n|---|---|---|\n".to_owned();
    let rows = (1..).zip(PICO_BALANCING_CYCLES.iter().zip(PICO_MOTION_CYCLES));
    rows.fold(head, |table, (links, (balancing, motion))| {
        table + &format!("| {links} | {balancing} | {motion} |\n")
    })
}

/// The tests in the emulator compare these numbers with what they measure.
#[test]
fn the_page_about_the_pico_holds_the_ticks_of_the_source() {
    hold("docs/results/pico.md", "ticks", &ticks_of_a_pico());
}

fn connected_to(signal: Signal, has_bus: bool) -> String {
    let at = |what: &str, other: &str| if has_bus { format!("{what}; or {other}") } else { what.to_owned() };
    match signal {
        Signal::Encoder(0, b'A') => at("cart encoder, A", "MISO"),
        Signal::Encoder(0, channel) => format!("cart encoder, {}", char::from(channel)),
        Signal::Encoder(link, b'A') => at(&format!("link {link} encoder, A"), "MISO"),
        Signal::Encoder(1, _) => at("link 1 encoder, B", "wiper"),
        Signal::Encoder(link, channel) => format!("link {link} encoder, {}", char::from(channel)),
        Signal::Pwm => "power stage, PWM: high drives; or STEP".to_owned(),
        Signal::Direction => "power stage, direction: high pushes along +x".to_owned(),
        Signal::Enable => "power stage, enable: high; 10 kΩ to ground".to_owned(),
        Signal::DriverFault => "power stage, fault: low; open drain".to_owned(),
        Signal::EmergencyStop => "emergency stop: opens when pressed".to_owned(),
        Signal::LimitLow => "limit switch, low end: opens when pressed".to_owned(),
        Signal::LimitHigh => "limit switch, high end: opens when pressed".to_owned(),
        Signal::Supply => "supply voltage through 22 kΩ; 1 kΩ to ground".to_owned(),
        Signal::AngleSelect => "absolute sensors, select (CSn)".to_owned(),
        Signal::AngleClock => "absolute sensors, clock (CLK, SCL)".to_owned(),
        Signal::AngleCommand => "absolute sensors, command (MOSI)".to_owned(),
        Signal::Transmit => "serial line to the host".to_owned(),
        Signal::Receive => "serial line from the host".to_owned(),
        Signal::Tick => "oscilloscope: high while a tick runs".to_owned(),
        Signal::StatusLed => "status LED".to_owned(),
    }
}

fn pin(wire: &Wire) -> String {
    format!("P{}{}", char::from(wire.port), wire.pin)
}

fn wiring(wires: &[Wire]) -> String {
    let has_bus = wires.iter().any(|wire| wire.signal == Signal::AngleSelect);
    let head = "| pin | function | connected to | inside |\n|---|---|---|---|\n".to_owned();
    wires.iter().fold(head, |table, wire| {
        let (pull_up, what) = (if wire.pull_up { "pull-up" } else { "" }, connected_to(wire.signal, has_bus));
        table + &format!("| {} | {} | {what} | {pull_up} |\n", pin(wire), wire.function)
    })
}

/// The boards whose wiring is on the page.
fn f4_boards() -> impl Iterator<Item = (&'static BoardRow, &'static F4Board)> {
    BOARDS.iter().filter_map(|row| match &row.family {
        Family::F4(board) => Some((row, board)),
        Family::Rp(_) => None,
    })
}

fn boards() -> String {
    let head = "| `--board` | board | chip | links | tick | clock at HSE | status LED |\n|---|---|---|---|---|---|---|\n";
    let row = |(row, board): (&BoardRow, &F4Board)| {
        let sources = board.sources.iter().map(|source| match source {
            HseSource::Crystal => "crystal",
            HseSource::Clock => "clock input",
        });
        let led = if board.status_led_is_low { "low" } else { "high" };
        let [shortest_ms, longest_ms] = row.tick_us().map(|us| f64::from(us) / 1e3);
        format!(
            "| `{row}` | {} | {} | {} | {shortest_ms} to {longest_ms} ms | {} MHz {} | {}, on while {led} |\n",
            row.product,
            row.chip(),
            row.encoders() - 1,
            board.crystal_hz / 1_000_000,
            sources.collect::<Vec<_>>().join(", else "),
            pin(&board.status_led),
        )
    };
    head.to_owned() + &f4_boards().map(row).collect::<String>()
}

/// What is special about each board.
fn notes() -> String {
    let head = "| `--board` | supply of the chip | special |\n|---|---|---|\n".to_owned();
    f4_boards().fold(head, |table, (row, board)| {
        table + &format!("| `{row}` | {} V | {} |\n", board.reference_v, board.special)
    })
}

#[test]
fn the_page_about_the_board_shows_the_boards_and_their_wiring() {
    hold("docs/board.md", "boards", &boards());
    hold("docs/board.md", "notes", &notes());
    hold("docs/board.md", "wiring", &wiring(&STANDARD));
    let feather = named("feather-f405").unwrap();
    for (row, board) in f4_boards() {
        if row == feather {
            hold("docs/board.md", "wiring of the Feather", &wiring(board.wiring));
        } else {
            assert_eq!(board.wiring, STANDARD, "{row} has a wiring that the page does not show");
        }
    }
    // Negative control: another pin.
    let mut other = STANDARD;
    other[0].pin += 1;
    assert_ne!(wiring(&other), wiring(&STANDARD));
}
