//! Access: reads a request, lets it in or refuses it.
//!
//! The page can move a motor, so a request has to name this server in `Host` (a foreign name that resolves to this
//! machine does not), has to know the secret in the address, and for the WebSocket has to come from this very page.

use std::io::{Read, Write};
use std::net::{IpAddr, TcpStream};
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

use super::assets::{ASSETS, Asset};

/// Longest request (bytes).
const MAX_REQUEST: usize = 8192;
/// Most header lines of a request.
const MAX_HEADERS: usize = 64;
/// Longest time from the first byte to the last of a request, and wait for a client to accept bytes of the answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Headers of every answer. Nothing is loaded from elsewhere, no page may embed this one, and the secret does not leave
/// the address.
const HEADERS: &str = "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; \
connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\nConnection: close\r\n";

/// Decides who is let in.
pub(super) struct Access {
    secret: String,
    port: u16,
    is_loopback: bool,
}

/// A request that was let in.
#[derive(Debug, PartialEq)]
pub(super) enum Admitted {
    /// A file of the page.
    File(&'static Asset),
    /// The recording, as CSV.
    Recording,
    /// The WebSocket; holds the value of `Sec-WebSocket-Accept`.
    Socket(String),
}

/// Why a request was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refused {
    /// It cannot be read, or is too long.
    Malformed,
    /// Another method than GET.
    Method,
    /// `Host` does not name this server.
    Host,
    /// The secret is missing or wrong, or there is no such file.
    NotFound,
    /// The WebSocket is opened by another page.
    Origin,
}

impl Refused {
    fn status(self) -> &'static str {
        match self {
            Refused::Malformed => "400 Bad Request",
            Refused::Method => "405 Method Not Allowed",
            Refused::Host => "421 Misdirected Request",
            Refused::NotFound => "404 Not Found",
            Refused::Origin => "403 Forbidden",
        }
    }
}

impl Access {
    /// Access to the server at this address and port.
    pub(super) fn new(secret: String, address: IpAddr, port: u16) -> Self {
        Self { secret, port, is_loopback: address.is_loopback() }
    }

    /// Reads the request that a client sends first, and decides. A refusal is answered here.
    pub(super) fn answer(&self, stream: &mut TcpStream) -> std::io::Result<Option<Admitted>> {
        stream.set_write_timeout(Some(PATIENCE))?;
        let admitted = match read_head(stream)? {
            Some(head) => self.admit(&head),
            None => Err(Refused::Malformed),
        };
        match admitted {
            Ok(admitted) => Ok(Some(admitted)),
            Err(refused) => {
                send(stream, refused.status(), "text/plain", refused.status().as_bytes())?;
                Ok(None)
            }
        }
    }

    /// Decides about a request; `head` is everything up to and including the empty line.
    fn admit(&self, head: &[u8]) -> Result<Admitted, Refused> {
        let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(head) {
            Ok(httparse::Status::Complete(_)) => {}
            _ => return Err(Refused::Malformed),
        }
        if request.method != Some("GET") {
            return Err(Refused::Method);
        }
        let header = |name: &str| {
            let mut all = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
            // Different readers may pick different ones of two headers of the same name.
            let only = all.next().filter(|_| all.next().is_none());
            only.and_then(|header| std::str::from_utf8(header.value).ok())
        };
        let host = header("Host").filter(|host| self.is_here(host)).ok_or(Refused::Host)?;
        let path = request.path.unwrap_or_default();
        let (secret, name) =
            path.strip_prefix('/').and_then(|path| path.split_once('/')).ok_or(Refused::NotFound)?;
        if !is_same(secret.as_bytes(), self.secret.as_bytes()) {
            return Err(Refused::NotFound);
        }
        match name {
            "socket" => {
                if header("Origin") != Some(format!("http://{host}").as_str()) {
                    return Err(Refused::Origin);
                }
                let upgrade = header("Upgrade").is_some_and(|value| value.eq_ignore_ascii_case("websocket"));
                let version = header("Sec-WebSocket-Version") == Some("13");
                let key = header("Sec-WebSocket-Key").filter(|_| upgrade && version);
                Ok(Admitted::Socket(derive_accept_key(key.ok_or(Refused::Malformed)?.as_bytes())))
            }
            "recording.csv" => Ok(Admitted::Recording),
            _ => {
                let asset = ASSETS.iter().find(|asset| asset.name == name).ok_or(Refused::NotFound)?;
                Ok(Admitted::File(asset))
            }
        }
    }

    /// Whether the value of `Host` names this server: on the loopback interface by its usual names, otherwise by an
    /// address in digits, which no foreign name server can give out.
    fn is_here(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return false };
        let address = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        let named = match address {
            Ok(address) => !self.is_loopback || address.is_loopback(),
            Err(_) => name.eq_ignore_ascii_case("localhost"),
        };
        named && port.parse() == Ok(self.port)
    }
}

/// Compares in a time that does not reveal where the difference is.
fn is_same(given: &[u8], secret: &[u8]) -> bool {
    given.len() == secret.len() && given.iter().zip(secret).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}

/// Reads up to the empty line; `None` if that does not come within [`MAX_REQUEST`] bytes and [`PATIENCE`].
fn read_head(stream: &mut TcpStream) -> std::io::Result<Option<Vec<u8>>> {
    let (mut head, mut buffer) = (Vec::new(), [0; 1024]);
    let begin = Instant::now();
    while !head.ends_with(b"\r\n\r\n") {
        let left = PATIENCE.saturating_sub(begin.elapsed());
        if left.is_zero() {
            return Ok(None);
        }
        stream.set_read_timeout(Some(left))?;
        let length = stream.read(&mut buffer)?;
        head.extend_from_slice(&buffer[..length]);
        if length == 0 || head.len() > MAX_REQUEST {
            return Ok(None);
        }
    }
    Ok(Some(head))
}

/// Sends an answer with a body.
pub(super) fn send(
    stream: &mut TcpStream,
    status: &str,
    media_type: &str,
    body: &[u8],
) -> std::io::Result<()> {
    let length = body.len();
    let head = format!(
        "HTTP/1.1 {status}\r\n{HEADERS}Content-Type: {media_type}; charset=utf-8\r\nContent-Length: {length}\r\n\r\n"
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)
}

/// Accepts the WebSocket.
pub(super) fn accept(stream: &mut TcpStream, accept_key: &str) -> std::io::Result<()> {
    let answer = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept_key}\r\n\r\n"
    );
    stream.write_all(answer.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOCKET: &str = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                          Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

    fn access() -> Access {
        Access::new("s3cret".to_owned(), IpAddr::from([127, 0, 0, 1]), 8080)
    }

    fn asked(line: &str, headers: &str) -> Result<Admitted, Refused> {
        access().admit(format!("{line} HTTP/1.1\r\n{headers}\r\n").as_bytes())
    }

    #[test]
    fn the_page_is_served_to_who_knows_the_secret() {
        let page = asked("GET /s3cret/", "Host: 127.0.0.1:8080\r\n");
        assert!(matches!(page, Ok(Admitted::File(asset)) if asset.name.is_empty()));
        for path in ["/", "/s3cret", "/wrong!/", "/s3cre/", "/s3cret0/", "//", "/s3cret/../x", "/s3cret/x.js"]
        {
            let refused = asked(&format!("GET {path}"), "Host: 127.0.0.1:8080\r\n");
            assert_eq!(refused, Err(Refused::NotFound), "{path}");
        }
    }

    #[test]
    fn a_foreign_name_for_this_machine_is_refused() {
        for host in ["localhost:8080", "127.0.0.1:8080", "[::1]:8080"] {
            assert!(asked("GET /s3cret/", &format!("Host: {host}\r\n")).is_ok(), "{host}");
        }
        for host in
            ["evil.example:8080", "127.0.0.1", "127.0.0.1:81", "192.168.1.2:8080", "localhost.evil:8080"]
        {
            assert_eq!(asked("GET /s3cret/", &format!("Host: {host}\r\n")), Err(Refused::Host), "{host}");
        }
        assert_eq!(asked("GET /s3cret/", ""), Err(Refused::Host));
        let twice = "Host: 127.0.0.1:8080\r\nHost: evil.example:8080\r\n";
        assert_eq!(asked("GET /s3cret/", twice), Err(Refused::Host));
    }

    #[test]
    fn the_socket_is_opened_by_this_page_only() {
        let from =
            |origin: &str| asked("GET /s3cret/socket", &format!("Host: localhost:8080\r\n{origin}{SOCKET}"));
        // The answer that RFC 6455, section 1.3, gives for this key.
        let accepted = Ok(Admitted::Socket("s3pPLMBiTxaQ9kYGzzhZRbK+xOo=".to_owned()));
        assert_eq!(from("Origin: http://localhost:8080\r\n"), accepted);
        for origin in
            ["", "Origin: null\r\n", "Origin: http://evil.example\r\n", "Origin: https://localhost:8080\r\n"]
        {
            assert_eq!(from(origin), Err(Refused::Origin), "{origin}");
        }
    }

    #[test]
    fn other_methods_and_garbage_are_refused() {
        assert_eq!(asked("POST /s3cret/", "Host: 127.0.0.1:8080\r\n"), Err(Refused::Method));
        assert_eq!(access().admit(b"\x00\x01\r\n\r\n"), Err(Refused::Malformed));
        assert_eq!(
            asked("GET /s3cret/socket", "Host: localhost:8080\r\nOrigin: http://localhost:8080\r\n"),
            Err(Refused::Malformed)
        );
    }
}
