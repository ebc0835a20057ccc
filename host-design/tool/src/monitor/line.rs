//! The connection to a firmware: a serial port or a relay.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, SystemTime};

use serialport::SerialPort;
use upright::protocol::BAUD;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::conversation::Monitor;

/// Names of serial ports on this system, for an error message.
const PORTS: &str = if cfg!(windows) {
    "COM3, COM4 … in the device manager"
} else if cfg!(target_os = "macos") {
    "/dev/cu.usbmodem…"
} else {
    "/dev/ttyACM0 …; your user has to be in the group dialout"
};

/// Longest wait for received bytes.
const PATIENCE: Duration = Duration::from_millis(5);
/// Longest wait for a line that accepts no bytes.
const STUCK: Duration = Duration::from_secs(1);

/// A port that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// A serial device cannot be opened.
    #[error("{port}: {source}; is the board connected? Ports: {PORTS}")]
    Serial {
        /// As given on the command line.
        port: String,
        /// Why it fails.
        source: serialport::Error,
    },
    /// A TCP address cannot be connected to.
    #[error("tcp:{address}: {source}; start `upright firmware run RIG --serve {address}` first")]
    Tcp {
        /// As given on the command line.
        address: String,
        /// Why it fails.
        source: std::io::Error,
    },
}

/// A serial device or a TCP connection.
pub enum SerialLine {
    /// A serial device.
    Serial(Box<dyn SerialPort>),
    /// A connection to a relay, as `upright firmware run --serve` offers it.
    Tcp(TcpStream),
}

impl SerialLine {
    /// Opens a serial port at [`BAUD`], such as `/dev/ttyACM0` (Linux), `/dev/cu.usbmodem1101` (macOS) or `COM3`
    /// (Windows), or a relay (`tcp:HOST:PORT`).
    ///
    /// # Errors
    /// [`OpenError`] with the port and what to do.
    pub fn open(port: &str) -> Result<Self, OpenError> {
        let Some(address) = port.strip_prefix("tcp:") else {
            let serial = serialport::new(port, BAUD).timeout(PATIENCE).open();
            return serial
                .map(SerialLine::Serial)
                .map_err(|source| OpenError::Serial { port: port.to_owned(), source });
        };
        let connect = || {
            let stream = TcpStream::connect(address)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            stream.set_write_timeout(Some(STUCK))?;
            Ok(stream)
        };
        connect()
            .map(SerialLine::Tcp)
            .map_err(|source| OpenError::Tcp { address: address.to_owned(), source })
    }

    /// Waits for bytes, at most 5 ms, and returns them. Receiving none is not an error.
    ///
    /// # Errors
    /// If the line is closed.
    pub fn receive<'a>(&mut self, buffer: &'a mut [u8]) -> std::io::Result<&'a [u8]> {
        let (read, serial) = match self {
            SerialLine::Serial(port) => (port.read(buffer), true),
            SerialLine::Tcp(stream) => (stream.read(buffer), false),
        };
        match read {
            Ok(0) if !serial => Err(ErrorKind::UnexpectedEof.into()),
            Ok(length) => Ok(&buffer[..length]),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) =>
            {
                Ok(&[])
            }
            Err(error) => Err(error),
        }
    }

    /// Sends all `bytes`.
    ///
    /// # Errors
    /// If the line is closed, or accepts no bytes.
    pub fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        match self {
            SerialLine::Serial(port) => port.write_all(bytes),
            SerialLine::Tcp(stream) => stream.write_all(bytes),
        }
    }

    /// Sends all `bytes`, then returns what is received.
    ///
    /// # Errors
    /// As for [`send`](Self::send) and [`receive`](Self::receive).
    pub fn exchange<'a>(&mut self, bytes: &[u8], buffer: &'a mut [u8]) -> std::io::Result<&'a [u8]> {
        self.send(bytes)?;
        self.receive(buffer)
    }

    /// Sends what is due in a conversation, and receives for at most 5 ms; returns the telemetry. A line that fails
    /// ends the conversation.
    pub fn carry(&mut self, conversation: &mut Monitor) -> Vec<AnyTelemetry> {
        conversation.poll(now());
        match self.exchange(&conversation.take_outgoing(), &mut [0; 4096]) {
            Ok(bytes) => conversation.receive(bytes, now()),
            Err(error) => {
                conversation.close(&error);
                Vec::new()
            }
        }
    }
}

/// Time since 1970. Commands are numbered by it, so that numbers grow from one program run to the next.
pub fn now() -> Duration {
    SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default()
}
