//! Limits on waiting: what a test waits for, a program, a connection or a thread, comes in time, or the test ends and
//! says what has not come. Nothing that a test starts outlives it, also if it fails.

use std::io::{BufRead, BufReader, Read};
use std::net::{TcpListener, TcpStream};
use std::ops::{Deref, DerefMut};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest time for anything. It decides nothing but when a test gives up: what takes a minute on an idle machine takes
/// a quarter of an hour on one that has ten other programs for each core.
pub const PATIENCE: Duration = Duration::from_secs(1800);

/// Waits until `found` returns something, and returns that.
///
/// # Panics
/// If it does not within `limit`; `what` says what should have come.
pub fn until_within<T>(limit: Duration, what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begin.elapsed() < limit, "after {limit:?}, this has not come: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits until `found` returns something, with all [`PATIENCE`].
///
/// # Panics
/// As [`until_within`].
pub fn until<T>(what: &str, found: impl FnMut() -> Option<T>) -> T {
    until_within(PATIENCE, what, found)
}

/// Runs a command to its end, with nothing on stdin, and returns what it prints.
///
/// # Panics
/// If it does not start, or takes longer than [`PATIENCE`].
pub fn output(command: &mut Command) -> Output {
    output_within(command, PATIENCE)
}

/// The same with another limit.
///
/// # Panics
/// If it does not start, or takes longer than `limit`.
pub fn output_within(command: &mut Command, limit: Duration) -> Output {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let process = command.spawn().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    output_of(process, &format!("the end of {command:?}"), limit)
}

/// What a process prints to the pipes that it was started with, once it has ended. Its stdin is closed.
///
/// # Panics
/// If it takes longer than `limit`; `what` is the end of which program. It is killed then.
pub fn output_of(process: Child, what: &str, limit: Duration) -> Output {
    let mut process = Running(process);
    drop(process.stdin.take());
    let stdout = process.stdout.take().map(all_of);
    let stderr = process.stderr.take().map(all_of);
    let status = until_within(limit, what, || process.try_wait().unwrap());
    let text = |pipe: Option<Receiver<Vec<u8>>>| {
        pipe.map_or(Vec::new(), |pipe| {
            pipe.recv_timeout(limit).unwrap_or_else(|_| panic!("{what}: a pipe stays open"))
        })
    };
    Output { status, stdout: text(stdout), stderr: text(stderr) }
}

/// Reads a pipe to its end, on a thread of its own, so that a full pipe stops nobody.
fn all_of(mut pipe: impl Read + Send + 'static) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.read_to_end(&mut bytes);
        let _ = sender.send(bytes);
    });
    receiver
}

/// A process that is killed when this is dropped.
#[derive(Debug)]
pub struct Running(pub Child);

impl Deref for Running {
    type Target = Child;

    fn deref(&self) -> &Child {
        &self.0
    }
}

impl DerefMut for Running {
    fn deref_mut(&mut self) -> &mut Child {
        &mut self.0
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // A killed process ends at once. One that has ended before cannot be killed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The lines that a program prints, each of which may be waited for.
#[derive(Debug)]
pub struct Lines(Receiver<String>);

impl Lines {
    /// The lines of this pipe.
    pub fn from_pipe(pipe: impl Read + Send + 'static) -> Self {
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self(receiver)
    }

    /// The next line, without its end.
    ///
    /// # Panics
    /// If it does not come in time, or the pipe has ended; `what` says what the line is.
    pub fn next(&self, what: &str) -> String {
        received(&self.0, what)
    }
}

/// What another thread sends.
///
/// # Panics
/// If nothing comes in time, or nobody can send any more; `what` says what should have come.
pub fn received<T>(receiver: &Receiver<T>, what: &str) -> T {
    receiver.recv_timeout(PATIENCE).unwrap_or_else(|error| panic!("{what}: {error}"))
}

/// What a thread returns at its end.
///
/// # Panics
/// If it does not end in time, or has panicked; `what` says what it does.
pub fn joined<T>(thread: JoinHandle<T>, what: &str) -> T {
    until(what, || thread.is_finished().then_some(()));
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// The next connection to a listener.
///
/// # Panics
/// If nobody connects in time; `what` says who should.
pub fn accepted(listener: &TcpListener, what: &str) -> TcpStream {
    listener.set_nonblocking(true).unwrap();
    let stream = until(what, || listener.accept().ok()).0;
    listener.set_nonblocking(false).unwrap();
    stream.set_nonblocking(false).unwrap();
    stream
}

/// A flag that tells threads to end; it is set when this is dropped, also by a test that fails.
#[derive(Debug)]
pub struct SetAtEnd<'a>(pub &'a AtomicBool);

impl Drop for SetAtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}
