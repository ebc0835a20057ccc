//! `upright firmware monitor`

use std::fs::File;
use std::io::{BufRead, IsTerminal, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use clap::Args;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
#[cfg(unix)]
use signal_hook::consts::SIGHUP;
use signal_hook::consts::{SIGINT, SIGTERM};
use upright_closed_loop::client::ExpectedRig;
use upright_design::rig::{CartOnly, Rig};
use upright_tool::monitor::record::{TelemetryCsv, json};
use upright_tool::monitor::{MonitorAction, SerialLine, action, now, request, view};

use super::built::designed;
use crate::twin;
use crate::variation::{Wanted, positive};
use upright_command::Failure;

/// Shows the telemetry of a firmware live and sends commands to it; exit status 1 if the connection is lost or the
/// firmware uses another version of the messages.
///
/// If the monitor ends after it has commanded a set-point, the firmware turns the motor off: link lost. Without a
/// terminal, or with --json, it prints one JSON object per telemetry message, prints answers to stderr, and reads
/// commands as lines of stdin: home, home-rail, check-signs, arm, disarm, clear, set-point METRES, law lqr, law
/// pole-placement.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware monitor /dev/ttyACM0                       a board
  upright firmware monitor tcp:127.0.0.1:7777                 after: upright firmware run RIG --serve 127.0.0.1:7777
  upright firmware monitor /dev/ttyACM0 --csv run.csv
  upright firmware monitor /dev/ttyACM0 --web 8080 --rig rigs/single-quanser-ip02.toml   as a page in the browser
  echo set-point 0.05 | upright firmware monitor tcp:127.0.0.1:7777 --json --duration 5")]
pub(crate) struct MonitorCommand {
    /// Serial port (/dev/ttyACM0, COM3 …), or tcp:HOST:PORT
    port: String,
    /// Record telemetry to this CSV file from the start
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Print one JSON object per telemetry message
    #[arg(long)]
    json: bool,
    /// Show it on the page of `upright twin` instead, served on this port of this computer; 0 picks a free one
    #[arg(long, value_name = "PORT", requires = "rig", conflicts_with_all = ["csv", "json"])]
    web: Option<u16>,
    /// Rig file of the machine: the firmware of another rig or tick is refused; the page needs it
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// End after this time (s)
    #[arg(long, value_name = "S", value_parser = positive)]
    duration: Option<f64>,
}

/// Time between two frames on the screen.
const PICTURE: Duration = Duration::from_millis(50);

impl MonitorCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [
            SIGTERM,
            SIGINT,
            #[cfg(unix)]
            SIGHUP,
        ] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let until = self.duration.map(|duration| Instant::now() + Duration::from_secs_f64(duration));
        let rig = self.rig.as_deref().map(Rig::from_path).transpose()?;
        if let Some((rig, path)) = rig.as_ref().zip(self.rig.as_deref()) {
            rig.needs_cart(CartOnly::Conversation, path)?;
        }
        if let Some((port, rig)) = self.web.zip(self.rig.as_deref()) {
            let (rig, table) = designed(rig, Wanted::SwingUp)?;
            let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
            return twin::show(&self.port, &rig, &table, address, &|| goes_on(&stop, until));
        }
        let mut conversation = Conversation {
            model: upright_tool::monitor::Monitor::new(&self.port),
            line: SerialLine::open(&self.port)?,
            expected: rig.as_ref().map(ExpectedRig::from),
            recorder: None,
            stop,
            until,
        };
        if let Some(path) = &self.csv {
            conversation.record(path)?;
        }
        if self.json || !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() {
            conversation.as_lines()?;
        } else {
            conversation.on_screen(&mut Screen::new()?)?;
        }
        match &conversation.model.ended {
            Some(ended) => Err(Failure::check(format!("{}: {ended}", self.port))),
            None => Ok(()),
        }
    }
}

/// The terminal in full-screen mode. Dropping this restores it, and so does a panic.
struct Screen(DefaultTerminal);

impl Screen {
    fn new() -> std::io::Result<Self> {
        ratatui::try_init().map(Self).inspect_err(|_| ratatui::restore())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

struct Conversation {
    model: upright_tool::monitor::Monitor,
    line: SerialLine,
    /// The rig that the firmware has to be built for, if a rig file is given.
    expected: Option<ExpectedRig>,
    recorder: Option<TelemetryCsv<File>>,
    stop: Arc<AtomicBool>,
    until: Option<Instant>,
}

impl Conversation {
    fn goes_on(&self) -> bool {
        goes_on(&self.stop, self.until)
    }

    fn record(&mut self, path: &Path) -> Result<(), Failure> {
        let file = File::create_new(path).map_err(|error| {
            Failure::argument(format!("{}: {error}; give the name of a new file", path.display()))
        })?;
        self.recorder = Some(TelemetryCsv::new(file));
        self.model.recording = Some(path.display().to_string());
        Ok(())
    }

    /// Sends pending bytes and receives, calling `each` with every telemetry; takes at most 5 ms if the line is
    /// silent.
    fn exchange(
        &mut self,
        mut each: impl FnMut(&serde_json::Value) -> std::io::Result<()>,
    ) -> Result<(), Failure> {
        if self.model.ended.is_some() {
            std::thread::sleep(PICTURE);
            return Ok(());
        }
        for telemetry in self.line.carry(&mut self.model) {
            each(&json(&telemetry))?;
            if let Some(recorder) = &mut self.recorder {
                recorder.push(&telemetry)?;
            }
        }
        if let Some(rig) = self.expected {
            self.model.expect_rig(rig);
        }
        Ok(())
    }

    fn as_lines(&mut self) -> Result<(), Failure> {
        let said = lines_of_stdin();
        let mut out = std::io::stdout().lock();
        while self.goes_on() && self.model.ended.is_none() {
            // No command before the first telemetry, which is only accepted once the firmware has named its version of
            // the messages.
            while self.model.telemetry.is_some()
                && let Ok(line) = said.try_recv()
            {
                match request(&line) {
                    Ok(request) => self.model.act(MonitorAction::Send(request), now()),
                    Err(bad) => eprintln!("{bad}"),
                }
            }
            self.exchange(|object| writeln!(out, "{object}"))?;
            out.flush()?;
            self.model.log.drain(..).for_each(|line| eprintln!("{line}"));
        }
        Ok(())
    }

    fn on_screen(&mut self, screen: &mut Screen) -> Result<(), Failure> {
        let mut next = Instant::now();
        while self.goes_on() {
            self.exchange(|_| Ok(()))?;
            while event::poll(Duration::ZERO)? {
                let Event::Key(key) = event::read()? else { continue };
                match action(&key).filter(|_| key.kind != KeyEventKind::Release) {
                    Some(MonitorAction::Quit) => return Ok(()),
                    Some(MonitorAction::Record) => self.switch_recording(),
                    Some(action) => self.model.act(action, now()),
                    None => (),
                }
            }
            if Instant::now() >= next {
                screen.0.draw(|frame| view::draw(&self.model, frame))?;
                next = Instant::now() + PICTURE;
            }
        }
        Ok(())
    }

    fn switch_recording(&mut self) {
        if self.recorder.take().is_some() {
            let file = self.model.recording.take().unwrap_or_default();
            return self.model.note(format!("recorded {file}"));
        }
        let path = PathBuf::from(format!("monitor-{}.csv", now().as_secs()));
        if let Err(error) = self.record(&path) {
            self.model.note(error.to_string());
        }
    }
}

/// Whether to keep running: no signal has come, and the time is not over.
fn goes_on(stop: &AtomicBool, until: Option<Instant>) -> bool {
    !stop.load(Ordering::Relaxed) && until.is_none_or(|until| Instant::now() < until)
}

/// Lines of stdin as they arrive. A separate thread reads them, because reading may block for ever.
pub(crate) fn lines_of_stdin() -> Receiver<String> {
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    lines
}
