//! The viewers: one connection each, one of them in command.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Error, Message, Utf8Bytes, WebSocket};
use upright_page::twin::PageRequest;

/// Most viewers at a time.
pub(super) const MAX_VIEWERS: usize = 8;
/// Longest message of a viewer (bytes).
const MAX_MESSAGE: usize = 2048;
/// Most messages of a viewer that wait to be handled; a viewer that sends more is shut out.
const MAX_WAITING: usize = 256;
/// Pictures that a slow viewer may be behind; more are dropped.
const PICTURES: usize = 8;
/// How often a connection looks for pictures to send.
const LOOK: Duration = Duration::from_millis(4);
/// Longest time that a viewer may take to accept bytes.
const STUCK: Duration = Duration::from_secs(1);

/// Number of a viewer.
pub(super) type ViewerId = u64;

/// What a viewer does.
#[derive(Debug)]
pub(super) enum ViewerEvent {
    /// Has connected.
    Came,
    /// Asks for something.
    Asks(PageRequest),
    /// Is gone, or was shut out.
    Went,
}

/// All connections.
#[derive(Clone)]
pub(super) struct Connections {
    greeting: Arc<Value>,
    connected: Arc<Mutex<ConnectionTable>>,
}

struct ConnectionTable {
    outlets: BTreeMap<ViewerId, SyncSender<Utf8Bytes>>,
    next: ViewerId,
    events: Sender<(ViewerId, ViewerEvent)>,
    waiting: Arc<Mutex<BTreeMap<ViewerId, usize>>>,
}

impl Connections {
    /// No viewers yet, and the queue of their events. `greeting` is what every viewer is told first.
    pub(super) fn new(greeting: Value) -> (Self, EventQueue) {
        let (events, receiver) = channel();
        let waiting = Arc::default();
        let connected =
            ConnectionTable { outlets: BTreeMap::new(), next: 1, events, waiting: Arc::clone(&waiting) };
        let viewers = Self { greeting: Arc::new(greeting), connected: Arc::new(Mutex::new(connected)) };
        (viewers, EventQueue { events: receiver, waiting })
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, ConnectionTable> {
        // The content is consistent after every statement, so a panic elsewhere does not matter.
        self.connected.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether another viewer may connect.
    pub(super) fn has_room(&self) -> bool {
        self.locked().outlets.len() < MAX_VIEWERS
    }

    /// Whether no viewer is connected.
    pub(super) fn is_empty(&self) -> bool {
        self.locked().outlets.is_empty()
    }

    /// Sends to one viewer.
    pub(super) fn tell(&self, viewer: ViewerId, text: &str) {
        if let Some(outlet) = self.locked().outlets.get(&viewer) {
            // A viewer whose queue is full misses it.
            let _ = outlet.try_send(Utf8Bytes::from(text));
        }
    }

    /// Sends to all.
    pub(super) fn tell_all(&self, text: String) {
        let text = Utf8Bytes::from(text);
        for outlet in self.locked().outlets.values() {
            match outlet.try_send(text.clone()) {
                // A slow viewer misses pictures; a gone one is removed by its own thread.
                Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
            }
        }
    }

    /// Serves one viewer until the connection ends.
    pub(super) fn serve(&self, stream: TcpStream) {
        let (outlet, pictures) = sync_channel(PICTURES);
        let (id, events, waiting) = {
            let mut connected = self.locked();
            let id = connected.next;
            connected.next += 1;
            let hello = json!({ "hello": *self.greeting, "you": id }).to_string();
            // It has to come before any picture. The queue has room: nothing else has been sent yet.
            let _ = outlet.try_send(Utf8Bytes::from(hello));
            connected.outlets.insert(id, outlet);
            (id, connected.events.clone(), Arc::clone(&connected.waiting))
        };
        let _ = events.send((id, ViewerEvent::Came));
        // However it ends, the viewer is gone.
        let _ = converse(stream, &pictures, |request| {
            let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
            let count = waiting.entry(id).or_default();
            *count += 1;
            *count <= MAX_WAITING && events.send((id, ViewerEvent::Asks(request))).is_ok()
        });
        self.locked().outlets.remove(&id);
        let _ = events.send((id, ViewerEvent::Went));
    }
}

/// What the viewers do, in order.
pub(super) struct EventQueue {
    events: Receiver<(ViewerId, ViewerEvent)>,
    waiting: Arc<Mutex<BTreeMap<ViewerId, usize>>>,
}

impl EventQueue {
    /// The next event, if there is one.
    pub(super) fn next(&self) -> Option<(ViewerId, ViewerEvent)> {
        let (id, event) = self.events.try_recv().ok()?;
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        match &event {
            ViewerEvent::Asks(_) => waiting.entry(id).and_modify(|count| *count = count.saturating_sub(1)),
            ViewerEvent::Came | ViewerEvent::Went => {
                waiting.remove(&id);
                return Some((id, event));
            }
        };
        Some((id, event))
    }
}

/// Passes requests in and pictures out. Ends with the connection, with garbage, or when `asks` refuses.
fn converse(
    stream: TcpStream,
    pictures: &Receiver<Utf8Bytes>,
    mut asks: impl FnMut(PageRequest) -> bool,
) -> Result<(), Error> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(STUCK))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE))
        .read_buffer_size(2 * MAX_MESSAGE);
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config));
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => {
                let is_taken = serde_json::from_str(&text).is_ok_and(&mut asks);
                if !is_taken {
                    return socket.close(None);
                }
            }
            Ok(Message::Ping(_) | Message::Pong(_)) => {}
            Ok(_) => return Ok(()),
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
        for picture in pictures.try_iter() {
            socket.write(Message::Text(picture))?;
        }
        socket.flush()?;
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn no_picture_comes_before_the_greeting() {
        let (viewers, events_in) = Connections::new(json!("greeting"));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let page = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let serving = viewers.clone();
        std::thread::spawn(move || serving.serve(listener.accept().unwrap().0));
        while viewers.is_empty() {
            std::thread::yield_now();
        }
        viewers.tell_all("picture".to_owned());
        let mut page = WebSocket::from_raw_socket(page, Role::Client, None);
        let mut read = || page.read().unwrap().into_text().unwrap().to_string();
        let hello = json!({ "hello": "greeting", "you": 1 }).to_string();
        assert_eq!([read(), read()], [hello.as_str(), "picture"]);
        assert!(matches!(events_in.next(), Some((1, ViewerEvent::Came))));
    }
}
