//! Draws a [`Monitor`] on a terminal of 80 × 24 characters or more.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Wrap};
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::conversation::{Monitor, words};

const KEYS: &str = "h/H home (rail)  g check signs  m/M jog (held)  a arm  u up  n down  1…6 turn a link over  d/space disarm  c clear  ←→ 1 cm  0 zero  l law  r record  q quit";
const COLOURS: [Color; 6] =
    [Color::Cyan, Color::Yellow, Color::Magenta, Color::Green, Color::Blue, Color::Red];

/// Draws state, inputs, numbers, charts, log and keys of a monitor.
pub fn draw(monitor: &Monitor, frame: &mut Frame<'_>) {
    let head = header(monitor);
    let rows = monitor.telemetry.as_ref().map_or(0, |telemetry| telemetry.counts.len());
    let keys = Paragraph::new(KEYS.dim()).wrap(Wrap { trim: true });
    let width = frame.area().width.max(1);
    let keys_height = if (KEYS.chars().count() as u16) < width { 1 } else { 2 };
    let head_height = head
        .iter()
        .map(|line| (line.width() as u16).div_ceil(width.saturating_sub(2).max(1)).max(1))
        .sum::<u16>()
        + 2;
    let [top, middle, charts, log, bottom] = Layout::vertical([
        Constraint::Length(head_height),
        Constraint::Length(rows.max(3) as u16 + 3),
        Constraint::Min(0),
        Constraint::Length(6),
        Constraint::Length(keys_height),
    ])
    .areas(frame.area());
    let title = format!(" upright monitor {} ", monitor.connection);
    frame.render_widget(
        Paragraph::new(head).wrap(Wrap { trim: true }).block(Block::bordered().title(title)),
        top,
    );
    let [states, timing] = Layout::horizontal([Constraint::Fill(1), Constraint::Length(34)]).areas(middle);
    frame.render_widget(
        Paragraph::new(state_table(monitor)).block(Block::bordered().title(" states ")),
        states,
    );
    frame.render_widget(
        Paragraph::new(force_and_timing(monitor)).block(Block::bordered().title(" force, timing ")),
        timing,
    );
    draw_charts(monitor, frame, charts);
    let shown = usize::from(log.height.saturating_sub(2));
    let last = monitor.log.iter().skip(monitor.log.len().saturating_sub(shown));
    let lines: Vec<Line<'_>> = last.map(|line| Line::from(line.as_str())).collect();
    frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(" answers ")), log);
    frame.render_widget(keys, bottom);
}

fn colour(state: State) -> Color {
    match state {
        State::Disarmed | State::Calibrated => Color::White,
        State::Homing | State::Armed => Color::Yellow,
        State::Jogging | State::Identifying | State::Raising | State::Lowering | State::Stilling => {
            Color::Magenta
        }
        State::Balancing | State::Holding => Color::Green,
        State::Fault => Color::Red,
    }
}

fn header(monitor: &Monitor) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    if let Some(ended) = &monitor.ended {
        lines.push(Line::from(ended.to_string()).red().bold());
    }
    let Some(info) = monitor.info else {
        if monitor.ended.is_none() {
            lines.push(Line::from("waiting for the firmware's answer"));
        }
        return lines;
    };
    let [major, minor, patch] = info.version;
    let law = match monitor.telemetry.as_ref().map(|telemetry| telemetry.law) {
        None => "not known yet".to_owned(),
        Some(law) => law.to_string(),
    };
    let recording = monitor.recording.as_ref().map_or(String::new(), |file| format!("  recording {file}"));
    lines.push(Line::from(format!(
        "firmware {major}.{minor}.{patch}  image {:08x}  rig {:016x}  tick {} ms  law {law}{recording}",
        info.image,
        info.rig_hash,
        info.tick_s * 1e3,
    )));
    let Some(telemetry) = &monitor.telemetry else { return lines };
    let style = Style::new().fg(colour(telemetry.state)).bold();
    lines.push(Line::from(words::state(telemetry.state)).style(style));
    if let Some(fault) = telemetry.fault {
        let entry = fault.entry();
        let sensor = monitor.cause.filter(|cause| cause.fault == fault).and_then(|cause| cause.sensor);
        let at = sensor.map_or(String::new(), |sensor| format!(" at the {}", words::joint(sensor)));
        lines.push(Line::from(format!(
            "{} {}{at}, tick {}: {}",
            fault.code(),
            entry.name,
            telemetry.cause_tick,
            entry.condition
        )));
        lines.push(Line::from(format!("remedy: {}", entry.remedy)).yellow());
    } else if let Some(cause) = monitor.cause.filter(|_| telemetry.state == State::Disarmed) {
        lines.push(Line::from(format!("before: {}; {}", cause.fault, cause.fault.entry().remedy)));
    }
    lines.extend(monitor.crash.iter().map(|record| Line::from(words::crash(record))));
    lines.push(Line::from(words::inputs(telemetry)));
    lines.extend(words::instruction(telemetry).map(|what| Line::from(format!("now: {what}")).yellow()));
    if !telemetry.state.motor_is_on() && !telemetry.arming_inhibits.is_empty() {
        lines.push(Line::from(format!("against arming: {}", telemetry.arming_inhibits)));
    }
    let against = telemetry.swing_up_inhibits;
    let is_moving = matches!(telemetry.state, State::Raising | State::Lowering);
    if !is_moving && !against.is_empty() && !against.contains(Inhibits::NO_SWING_UP) {
        let motion = if telemetry.state == State::Balancing { "down" } else { "up" };
        lines.push(Line::from(format!("against {motion}: {against}")));
    }
    lines
}

fn state_table(monitor: &Monitor) -> Vec<Line<'_>> {
    let Some(telemetry) = &monitor.telemetry else { return vec![Line::from("no telemetry yet")] };
    let mut lines =
        vec![Line::from(format!("{:<7}{:>11}{:>11}{:>8}{:>9}", "", "estimate", "per s", "counts", "innov."))];
    // The states of a model are not pairs for each sensor: entries that do not exist are shown as dashes.
    for (i, &counts) in telemetry.counts.iter().enumerate() {
        let (position, rate) = (telemetry.estimate.get(2 * i), telemetry.estimate.get(2 * i + 1));
        let unit = if i == 0 { "m" } else { "rad" };
        let number = |value: Option<&f32>| value.map_or("-".to_owned(), |value| format!("{value:.4}"));
        lines.push(Line::from(format!(
            "{:<7}{:>11}{:>11}{:>8}{:>9}",
            words::joint(i as u8),
            format!("{} {unit}", number(position)),
            number(rate),
            counts,
            telemetry.innovation.get(i).map_or(String::new(), |value| format!("{value:.5}")),
        )));
    }
    lines
}

fn force_and_timing(monitor: &Monitor) -> Vec<Line<'_>> {
    let mut lines = Vec::new();
    if let Some(telemetry) = &monitor.telemetry {
        let wanted = monitor.wanted.map_or("-".to_owned(), |wanted| format!("{wanted:.3}"));
        lines.push(Line::from(format!("set-point {:.3} m, wanted {wanted}", telemetry.setpoint_m)));
        lines.push(Line::from(format!(
            "force {:.2} N, applied {:.2} N",
            telemetry.requested_n, telemetry.applied_n
        )));
        lines.push(Line::from(format!("drive {:>7.3} {}", telemetry.drive, bar(telemetry.drive))));
        lines.push(Line::from(format!("cycles {}, worst {}", telemetry.cycles, telemetry.worst_cycles)));
    }
    if let Some(all) = monitor.statistics {
        lines.push(Line::from(format!("overruns {}, dropped {}", all.overruns, all.dropped)));
        lines.push(Line::from(format!("malformed {}, replayed {}", all.malformed, all.replayed)));
    }
    lines
}

/// A bar for a value from −1 to 1, with 0 in the middle.
fn bar(value: f32) -> String {
    const HALF: i32 = 6;
    let end = (value.clamp(-1.0, 1.0) * HALF as f32).round() as i32;
    let cell = |i: i32| match i {
        0 => '│',
        i if i.signum() == end.signum() && i.abs() <= end.abs() => '█',
        _ => '·',
    };
    (-HALF..=HALF).map(cell).collect()
}

fn draw_charts(monitor: &Monitor, frame: &mut Frame<'_>, area: Rect) {
    let (Some(info), Some(last)) = (monitor.info, monitor.history.back()) else { return };
    let series = |value: &dyn Fn(&AnyTelemetry) -> Option<f32>| -> Vec<(f64, f64)> {
        let age = |telemetry: &AnyTelemetry| {
            -f64::from(last.tick.wrapping_sub(telemetry.tick)) * f64::from(info.tick_s)
        };
        let finite = |value: &f32| value.is_finite();
        let points = monitor.history.iter().filter_map(|t| Some((age(t), value(t).filter(finite)?.into())));
        points.collect()
    };
    let angles = (1..last.counts.len().min(last.estimate.len() / 2))
        .map(|i| series(&|telemetry| telemetry.estimate.get(2 * i).copied()))
        .collect();
    let cart =
        vec![series(&|telemetry| telemetry.estimate.first().copied()), series(&|t| Some(t.setpoint_m))];
    let force = vec![series(&|telemetry| Some(telemetry.applied_n))];
    let areas: [Rect; 3] = Layout::horizontal([Constraint::Fill(1); 3]).areas(area);
    let charts = [(" cart, set-point (m) ", cart), (" angles (rad) ", angles), (" force (N) ", force)];
    for (area, (title, lines)) in areas.into_iter().zip(charts) {
        draw_chart(frame, area, title, &lines);
    }
}

fn draw_chart(frame: &mut Frame<'_>, area: Rect, title: &str, lines: &[Vec<(f64, f64)>]) {
    let values = lines.iter().flatten().map(|(_, value)| *value);
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return;
    }
    let room = ((high - low) * 0.05).max(1e-4);
    let (low, high) = (low - room, high + room);
    let datasets = lines.iter().zip(COLOURS.iter().cycle()).map(|(points, colour)| {
        Dataset::default()
            .data(points)
            .graph_type(GraphType::Line)
            .marker(Marker::Braille)
            .style(Style::new().fg(*colour))
    });
    let chart = Chart::new(datasets.collect())
        .block(Block::bordered().title(title))
        .x_axis(Axis::default().bounds([-10.0, 0.0]).labels(["-10 s", "now"]))
        .y_axis(Axis::default().bounds([low, high]).labels([format!("{low:.3}"), format!("{high:.3}")]));
    frame.render_widget(chart, area);
}
