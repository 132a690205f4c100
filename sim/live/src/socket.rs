//! One client's socket: a thread that reads and a thread that writes.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{CloseFrame, Role, WebSocket, WebSocketConfig};
use tungstenite::{Bytes, Message};

use crate::mailbox::{Mailbox, Outgoing};

/// Largest message (bytes) that a client may send.
pub(crate) const MOST_MESSAGE: usize = 1 << 20;
/// A client that is not heard of for so long is gone: browsers answer pings even of hidden pages.
const SILENCE: Duration = Duration::from_secs(40);
/// Time without a message after which a ping is sent.
const PING: Duration = Duration::from_secs(10);
/// Time that one write may take.
const WRITE_TIME: Duration = Duration::from_secs(10);

/// The reading side's view of the stream: what it writes (pongs, closes) goes the way of all
/// messages, so that frames of two threads never mix.
struct ReadSide {
    stream: TcpStream,
    pending: Vec<u8>,
    mailbox: Arc<Mailbox>,
}

impl Read for ReadSide {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        self.stream.read(to)
    }
}

impl Write for ReadSide {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if !self.pending.is_empty() {
            let bytes = std::mem::take(&mut self.pending);
            self.mailbox.push(Outgoing::Raw(bytes));
        }
        Ok(())
    }
}

fn config() -> WebSocketConfig {
    WebSocketConfig::default()
        .read_buffer_size(16 << 10)
        .write_buffer_size(0)
        .max_message_size(Some(MOST_MESSAGE))
        .max_frame_size(Some(MOST_MESSAGE))
}

/// Serves an upgraded stream until it ends; `receive` is called with every message and says whether
/// to continue. `early` came behind the handshake.
pub(crate) fn serve(
    stream: TcpStream,
    early: Vec<u8>,
    mailbox: &Arc<Mailbox>,
    mut receive: impl FnMut(Message) -> bool,
) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(WRITE_TIME))?;
    let writing = stream.try_clone()?;
    let outgoing = Arc::clone(mailbox);
    let writer = std::thread::Builder::new()
        .name("live-write".into())
        .spawn(move || write(writing, &outgoing))?;
    let side = ReadSide {
        stream: stream.try_clone()?,
        pending: Vec::new(),
        mailbox: Arc::clone(mailbox),
    };
    let mut socket = WebSocket::from_partially_read(side, early, Role::Server, Some(config()));
    loop {
        match socket.read() {
            Ok(Message::Close(_)) => {
                // The answer is in the socket's hands: it goes out with the next flush.
                let _ = socket.flush();
                mailbox.push(Outgoing::Close);
                break;
            }
            Ok(message) => {
                if !receive(message) {
                    mailbox.close();
                    break;
                }
                // Pongs.
                let _ = socket.flush();
            }
            Err(_) => {
                mailbox.close();
                break;
            }
        }
    }
    // The writer ends by itself: its mailbox is closed, or its write fails in time.
    let _ = writer.join();
    let _ = stream.shutdown(Shutdown::Both);
    Ok(())
}

fn write(stream: TcpStream, mailbox: &Mailbox) {
    let mut socket = WebSocket::from_raw_socket(stream, Role::Server, Some(config()));
    while let Some(message) = mailbox.next(PING) {
        let sent = match message {
            Outgoing::Text(text) => socket.send(Message::text(&*text)),
            Outgoing::Binary(bytes) => {
                let bytes = Bytes::from_owner(Shared(bytes));
                socket.send(Message::Binary(bytes))
            }
            Outgoing::Ping => socket.send(Message::Ping(Bytes::new())),
            Outgoing::Raw(bytes) => socket.get_mut().write_all(&bytes).map_err(Into::into),
            Outgoing::Close => break,
            Outgoing::End => {
                let frame = CloseFrame {
                    code: CloseCode::Away,
                    reason: "".into(),
                };
                let _ = socket.send(Message::Close(Some(frame)));
                mailbox.close();
                // The client answers; what it has sent before is still read, or the frame would be lost.
                let _ = socket.get_ref().shutdown(Shutdown::Write);
                return;
            }
        };
        if sent.is_err() {
            break;
        }
    }
    mailbox.close();
    let _ = socket.get_ref().shutdown(Shutdown::Both);
}

/// Bytes that several clients are sent.
struct Shared(Arc<Vec<u8>>);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}
