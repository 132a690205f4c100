//! As much of HTTP/1.1 as a fixed table of files and one upgrade need.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use tungstenite::Error;
use tungstenite::error::ProtocolError;
use tungstenite::handshake::machine::TryParse;
pub(crate) use tungstenite::handshake::server::Request;

/// Most bytes of a request's head.
const MOST_HEAD: usize = 8 << 10;
/// Time in which a head must have come, all of it: from the same machine it comes at once.
const HEAD_TIME: Duration = Duration::from_secs(2);

/// Status and words of the answer to what is refused.
pub(crate) type Refusal = [&'static str; 2];

const NO_REQUEST: Refusal = ["400 Bad Request", "not a request\n"];

/// Understands a head that ends with an empty line.
pub(crate) fn parsed(head: &[u8]) -> Result<Request, Refusal> {
    // The parser takes other texts and ends of lines, too.
    let ends = head.iter().filter(|byte| **byte == b'\n').count();
    let pairs = head.windows(2).filter(|pair| *pair == b"\r\n").count();
    let is_plain = head.is_ascii() && ends == pairs;
    match Request::try_parse(head) {
        Err(Error::Protocol(ProtocolError::WrongHttpMethod)) => {
            Err(["405 Method Not Allowed", "GET only\n"])
        }
        Ok(Some((_, request))) if is_plain && request.uri().authority().is_none() => Ok(request),
        _ => Err(NO_REQUEST),
    }
}

/// The value of a header that is there once.
pub(crate) fn only<'a>(request: &'a Request, name: &str) -> Option<&'a str> {
    let mut values = request.headers().get_all(name).iter();
    let value = values.next()?.to_str().ok();
    value.filter(|_| values.next().is_none())
}

/// Words of a comma-separated header.
pub(crate) fn words<'a>(
    request: &'a Request,
    name: &str,
) -> impl Iterator<Item = &'a str> + use<'a> {
    let values = request.headers().get_all(name).iter();
    let texts = values.filter_map(|value| value.to_str().ok());
    texts.flat_map(|text| text.split(',').map(str::trim))
}

/// Reads a head; also what came behind it. Refused is what is no request, too long or too slow.
pub(crate) fn read_head(stream: &mut TcpStream) -> io::Result<Result<(Request, Vec<u8>), Refusal>> {
    let until = Instant::now() + HEAD_TIME;
    let mut bytes = Vec::new();
    let mut piece = [0; 1024];
    while bytes.len() <= MOST_HEAD {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            break;
        }
        stream.set_read_timeout(Some(left))?;
        let count = match stream.read(&mut piece) {
            Ok(0) => break,
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        let seen = bytes.len().saturating_sub(3);
        bytes.extend_from_slice(&piece[..count]);
        if let Some(at) = bytes[seen..].windows(4).position(|w| w == b"\r\n\r\n") {
            let behind = bytes.split_off(seen + at + 4);
            return Ok(parsed(&bytes).map(|request| (request, behind)));
        }
    }
    Ok(Err(NO_REQUEST))
}

/// Nothing but this page's own files, and its own socket.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
     connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Writes a response and ends the connection's own side.
pub(crate) fn respond(
    stream: &mut TcpStream,
    status: &str,
    content_type: &str,
    body: &[u8],
) -> io::Result<()> {
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nContent-Length: {}\r\n\
         Connection: close\r\nCache-Control: no-store\r\nContent-Security-Policy: {POLICY}\r\n\
         X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()?;
    // What was written arrives.
    stream.shutdown(Shutdown::Write)
}

/// The same in plain words.
pub(crate) fn say(stream: &mut TcpStream, status: &str, words: &str) -> io::Result<()> {
    let plain = "text/plain; charset=utf-8";
    respond(stream, status, plain, words.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_are_read_as_they_are() {
        let text = "GET /a?b=c HTTP/1.1\r\nHost: x\r\nConnection: keep-alive, Upgrade\r\n\r\n";
        let request = parsed(text.as_bytes()).expect("it is one");
        assert_eq!(request.uri().path_and_query().expect("a path"), "/a?b=c");
        assert_eq!(only(&request, "host"), Some("x"));
        let found: Vec<&str> = words(&request, "connection").collect();
        assert_eq!(found, ["keep-alive", "Upgrade"]);
        for bad in [
            "GET http://x/ HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.0\r\n\r\n",
            "GET  / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nno colon\r\n\r\n",
            "GET / HTTP/1.1\r\n folded: x\r\n\r\n",
            "GET / HTTP/1.1\r\na: b\nc: d\r\n\r\n",
            "GET /\u{e9} HTTP/1.1\r\n\r\n",
        ] {
            assert_eq!(parsed(bad.as_bytes()).err(), Some(NO_REQUEST), "{bad}");
        }
    }
}
