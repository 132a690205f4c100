//! As much of HTTP/1.1 as a fixed table of files and one upgrade need.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Most bytes of a request's head.
const MOST_HEAD: usize = 8 << 10;
/// Time in which a head must have come, all of it: from the same machine it comes at once.
pub(crate) const HEAD_TIME: Duration = Duration::from_secs(2);

/// A request's head.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Head {
    pub(crate) method: String,
    pub(crate) path: String,
    pub(crate) query: String,
    /// Names in lower case.
    headers: Vec<(String, String)>,
}

impl Head {
    /// Understands a head that ends with an empty line.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(bytes).ok()?;
        let printable = |c: char| (' '..='~').contains(&c) || c == '\t' || c == '\r' || c == '\n';
        if !text.chars().all(printable) {
            return None;
        }
        let mut lines = text
            .strip_suffix("\r\n\r\n")
            .map_or_else(|| text.strip_suffix("\r\n"), Some)?
            .split("\r\n");
        let mut request = lines.next()?.split(' ');
        let (method, target, version) = (request.next()?, request.next()?, request.next()?);
        if request.next().is_some() || version != "HTTP/1.1" || !target.starts_with('/') {
            return None;
        }
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let mut headers = Vec::new();
        for line in lines {
            let (name, value) = line.split_once(':')?;
            if name.is_empty() || name.contains([' ', '\t']) || value.contains(['\r', '\n']) {
                return None;
            }
            headers.push((name.to_ascii_lowercase(), value.trim().to_owned()));
        }
        Some(Self {
            method: method.to_owned(),
            path: path.to_owned(),
            query: query.to_owned(),
            headers,
        })
    }

    /// How often a header is there.
    pub(crate) fn count(&self, name: &str) -> usize {
        self.headers.iter().filter(|(n, _)| n == name).count()
    }

    /// The value of a header that is there once.
    pub(crate) fn only(&self, name: &str) -> Option<&str> {
        let mut values = self.headers.iter().filter(|(n, _)| n == name);
        let value = values.next().map(|(_, value)| &**value);
        value.filter(|_| values.next().is_none())
    }

    /// Whether a comma-separated header has a word, whatever its case.
    pub(crate) fn has_word(&self, name: &str, word: &str) -> bool {
        self.words(name).any(|w| w.eq_ignore_ascii_case(word))
    }

    /// Words of a comma-separated header.
    pub(crate) fn words(&self, name: &str) -> impl Iterator<Item = &str> {
        let values = self.headers.iter().filter(move |(n, _)| n == name);
        values.flat_map(|(_, value)| value.split(',').map(str::trim))
    }
}

/// Reads a head; also what came behind it. `None` where it is no request, too long or too slow.
pub(crate) fn read_head(stream: &mut TcpStream) -> io::Result<Option<(Head, Vec<u8>)>> {
    let until = Instant::now() + HEAD_TIME;
    let mut bytes = Vec::new();
    let mut piece = [0; 1024];
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(None);
        }
        stream.set_read_timeout(Some(left))?;
        let count = match stream.read(&mut piece) {
            Ok(0) => return Ok(None),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        let seen = bytes.len().saturating_sub(3);
        bytes.extend_from_slice(&piece[..count]);
        if let Some(at) = bytes[seen..].windows(4).position(|w| w == b"\r\n\r\n") {
            let behind = bytes.split_off(seen + at + 4);
            return Ok(Head::parse(&bytes).map(|head| (head, behind)));
        }
        if bytes.len() > MOST_HEAD {
            return Ok(None);
        }
    }
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
    use super::Head;
    use proptest::prelude::*;

    #[test]
    fn heads_are_read_as_they_are() {
        let text = "GET /a?b=c HTTP/1.1\r\nHost: x\r\nConnection: keep-alive, Upgrade\r\n\r\n";
        let head = Head::parse(text.as_bytes()).expect("it is one");
        assert_eq!((&*head.path, &*head.query), ("/a", "b=c"));
        assert_eq!(head.only("host"), Some("x"));
        assert!(head.has_word("connection", "upgrade"));
        assert!(!head.has_word("connection", "up"));
        for bad in [
            "GET http://x/ HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.0\r\n\r\n",
            "GET  / HTTP/1.1\r\n\r\n",
            "GET / HTTP/1.1\r\nno colon\r\n\r\n",
            "GET / HTTP/1.1\r\n folded: x\r\n\r\n",
            "GET /\u{e9} HTTP/1.1\r\n\r\n",
        ] {
            assert_eq!(Head::parse(bad.as_bytes()), None, "{bad}");
        }
    }

    proptest! {
        #[test]
        fn nothing_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            drop(Head::parse(&bytes));
        }
    }
}
