//! The server: listens on the loopback address, lets clients in, and passes messages on.

use std::collections::VecDeque;
use std::io;
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tungstenite::Message;
use tungstenite::handshake::server::{create_response, write_response};
use tungstenite::http::HeaderValue;

use crate::assets;
use crate::control::{Control, Scene, Told};
use crate::gate::{Gate, is_from_here};
use crate::http::{Request, only, read_head, respond, say, words};
use crate::incoming::{self, Hand, Incoming, MAX_MESH};
use crate::mailbox::{Mailbox, Outgoing};
use crate::outgoing::MAX_CLIENTS;
use crate::{locked, socket};

/// Name of the protocol, which clients ask for when they open a socket.
pub const PROTOCOL: &str = "phyxel.1";
/// Connections at a time that have not become clients; the oldest gives way to one more, so that those
/// who say nothing keep nobody out.
const MOST_STRANGERS: usize = 40;
/// Threads of connections at a time; one more waits until one ends.
const MOST_CONNECTIONS: usize = 48 + MAX_CLIENTS;
/// Time that clients have to take what waits for them when the server ends.
const FAREWELL: Duration = Duration::from_millis(300);
/// Messages of clients that may wait; readers wait then, and their clients with them.
const MOST_EVENTS: usize = 4096;

/// A server that cannot be started.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The port cannot be listened on.
    #[error("cannot listen on 127.0.0.1:{port}: {source}; name another port with --port")]
    Port {
        /// The port.
        port: u16,
        /// What the system said.
        source: io::Error,
    },
    /// The system has no random numbers for codes.
    #[error("cannot make a code for the page: {0}")]
    Random(#[from] getrandom::Error),
    /// The system gives no thread.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
}

/// What a client did.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// It came in: it knows nothing yet.
    Joined,
    /// It left; its hands are gone.
    Left,
    /// It moved a hand; its own number for that.
    Hand(u32, Hand),
    /// It asked for something.
    Control(Control),
    /// It sent a whole mesh file: extension and content.
    Mesh(String, Vec<u8>),
    /// It has drawn a state and may be sent another.
    Ready,
}

/// A client's position, 0 to [`MAX_CLIENTS`] - 1.
pub type ClientId = usize;

#[derive(Debug)]
struct Shared {
    gate: Gate,
    address: SocketAddr,
    server: String,
    clients: Mutex<[Option<Arc<Mailbox>>; MAX_CLIENTS]>,
    events: SyncSender<(ClientId, Event)>,
    strangers: Mutex<Strangers>,
    closing: AtomicBool,
}

/// Connections that have not become clients, oldest first.
#[derive(Debug, Default)]
struct Strangers {
    next: u64,
    open: VecDeque<(u64, TcpStream)>,
}

impl Strangers {
    /// Lets one in; the oldest gives way.
    fn admit(&mut self, stream: TcpStream) -> u64 {
        if self.open.len() == MOST_STRANGERS
            && let Some((_, oldest)) = self.open.pop_front()
        {
            // Its thread reads an end.
            let _ = oldest.shutdown(Shutdown::Both);
        }
        self.next += 1;
        self.open.push_back((self.next, stream));
        self.next
    }

    /// One has left, or is a client now.
    fn forget(&mut self, number: u64) {
        self.open.retain(|(known, _)| *known != number);
    }
}

impl Shared {
    /// Gives a client a position, if one is free.
    fn admit(&self, mailbox: &Arc<Mailbox>) -> Option<ClientId> {
        let mut clients = locked(&self.clients);
        let free = clients.iter().position(Option::is_none)?;
        clients[free] = Some(Arc::clone(mailbox));
        Some(free)
    }
}

/// A running server. It ends when dropped.
#[derive(Debug)]
pub struct Server {
    shared: Arc<Shared>,
    events: Receiver<(ClientId, Event)>,
}

/// Whom a message is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum To {
    /// All clients.
    All,
    /// One client.
    One(ClientId),
}

impl Server {
    /// Starts to listen on a port of the loopback address, or on a free one where `port` is 0.
    /// `server` is the program's name and version, as clients receive it.
    ///
    /// # Errors
    /// [`ServerError`].
    pub fn start(port: u16, server: &str) -> Result<Self, ServerError> {
        let failed = |source| ServerError::Port { port, source };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let (sender, events) = sync_channel(MOST_EVENTS);
        let shared = Arc::new(Shared {
            gate: Gate::new()?,
            address,
            server: server.to_owned(),
            clients: Mutex::default(),
            events: sender,
            strangers: Mutex::default(),
            closing: AtomicBool::new(false),
        });
        let listening = Arc::clone(&shared);
        std::thread::Builder::new()
            .name("live-listen".into())
            .spawn(move || listen(&listener, &listening))
            .map_err(ServerError::Thread)?;
        Ok(Self { shared, events })
    }

    /// Where the server listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.shared.address
    }

    /// An address for one client, with a new code. The code is behind the `#`: browsers do not send it
    /// on, nor keep it in what they tell other pages.
    ///
    /// # Errors
    /// [`ServerError::Random`].
    pub fn url(&self) -> Result<String, ServerError> {
        self.urls()()
    }

    /// What gives out addresses from any thread, as [`Server::url`].
    pub fn urls(&self) -> impl Fn() -> Result<String, ServerError> + Send + use<> {
        let shared = Arc::clone(&self.shared);
        move || {
            let code = shared.gate.code()?;
            Ok(format!("http://{}/#{code}", shared.address))
        }
    }

    /// What clients do, in order.
    #[must_use]
    pub const fn events(&self) -> &Receiver<(ClientId, Event)> {
        &self.events
    }

    /// Number of clients.
    #[must_use]
    pub fn client_count(&self) -> usize {
        locked(&self.shared.clients).iter().flatten().count()
    }

    /// Whether any client would be sent a state at once; if not, none need be made.
    #[must_use]
    pub fn wants_state(&self) -> bool {
        let clients = locked(&self.shared.clients);
        clients.iter().flatten().any(|client| client.wants_state())
    }

    /// Offers a state to all clients, instead of one that still waits for them.
    pub fn put_state(&self, number: u32, state: Vec<u8>) {
        let state = Arc::new(state);
        for mailbox in locked(&self.shared.clients).iter().flatten() {
            mailbox.put_state(number, Arc::clone(&state));
        }
    }

    /// Sends all of a scene, which clients are notified of first. What waits for them of an earlier one is left out.
    pub fn begin(&self, to: To, scene: Scene, messages: Vec<Vec<u8>>) {
        let told = Told::Scene(Box::new(scene)).text();
        let messages = messages
            .into_iter()
            .map(|bytes| Outgoing::Binary(Arc::new(bytes)));
        let all: Vec<Outgoing> = std::iter::once(Outgoing::Text(told.into()))
            .chain(messages)
            .collect();
        self.each(to, |mailbox| mailbox.begin(all.iter().cloned()));
    }

    /// Clients that fell behind and have taken what waited for them: changes were left out, so that they need
    /// the whole scene ([`Server::begin`]).
    #[must_use]
    pub fn behind(&self) -> Vec<ClientId> {
        let clients = locked(&self.shared.clients);
        let behind = clients.iter().enumerate().filter(|(_, mailbox)| {
            let mailbox = mailbox.as_ref();
            mailbox.is_some_and(|mailbox| mailbox.has_caught_up())
        });
        behind.map(|(client, _)| client).collect()
    }

    /// Sends a binary message: a change of the scene. A client for whom too many wait is not sent it.
    pub fn send(&self, to: To, message: Vec<u8>) {
        let message = Outgoing::Binary(Arc::new(message));
        self.each(to, |mailbox| mailbox.push(message.clone()));
    }

    /// Tells something in JSON.
    pub fn tell(&self, to: To, message: &Told) {
        let message = Outgoing::Text(message.text().into());
        self.each(to, |mailbox| mailbox.push(message.clone()));
    }

    fn each(&self, to: To, act: impl Fn(&Mailbox)) {
        for (id, mailbox) in locked(&self.shared.clients).iter().enumerate() {
            if let Some(mailbox) = mailbox
                && (to == To::All || to == To::One(id))
            {
                act(mailbox);
            }
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::SeqCst);
        self.each(To::All, Mailbox::end);
        // The program may end with the server: clients are to learn that the session has ended.
        let begun = Instant::now();
        while self.client_count() > 0 && begun.elapsed() < FAREWELL {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.each(To::All, Mailbox::close);
        // Wakes the listener.
        drop(TcpStream::connect(self.shared.address));
    }
}

fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.closing.load(Ordering::SeqCst) {
            return;
        }
        let Ok(stream) = stream else {
            // Out of file handles, most likely: others may end soon.
            std::thread::sleep(Duration::from_millis(50));
            continue;
        };
        let Ok(other) = stream.try_clone() else {
            continue;
        };
        let number = locked(&shared.strangers).admit(other);
        // Those who gave way end as soon as their threads run, each of which has a share.
        while Arc::strong_count(shared) > MOST_CONNECTIONS {
            std::thread::sleep(Duration::from_millis(1));
        }
        let own = Arc::clone(shared);
        let started = std::thread::Builder::new()
            .name("live-client".into())
            .spawn(move || {
                // A connection that breaks concerns nobody else.
                let _ = connection(stream, number, &own);
                locked(&own.strangers).forget(number);
            });
        if started.is_err() {
            locked(&shared.strangers).forget(number);
        }
    }
}

/// Serves one connection to its end.
fn connection(mut stream: TcpStream, number: u64, shared: &Arc<Shared>) -> io::Result<()> {
    stream.set_write_timeout(Some(Duration::from_secs(10)))?;
    let (request, early) = match read_head(&mut stream)? {
        Ok(read) => read,
        Err([status, words]) => return say(&mut stream, status, words),
    };
    if !is_from_here(&request) {
        let words = "only this machine's own pages may ask\n";
        return say(&mut stream, "403 Forbidden", words);
    }
    let code = request.uri().query().unwrap_or_default();
    match request.uri().path() {
        "/token" => match shared.gate.exchange(code) {
            Some(token) => say(&mut stream, "200 OK", token),
            None => {
                let words = "this code is not good, or not any more\n";
                say(&mut stream, "403 Forbidden", words)
            }
        },
        "/session" => session(stream, number, &request, early, shared),
        path => match assets::find(path) {
            Some(asset) => {
                let (kind, content) = (asset.content_type, asset.content.as_bytes());
                respond(&mut stream, "200 OK", kind, content)
            }
            None => say(&mut stream, "404 Not Found", "no such page\n"),
        },
    }
}

/// Upgrades a connection to a client's socket.
fn session(
    mut stream: TcpStream,
    number: u64,
    request: &Request,
    early: Vec<u8>,
    shared: &Arc<Shared>,
) -> io::Result<()> {
    use std::io::Write;
    let offered = || words(request, "sec-websocket-protocol");
    let once = ["sec-websocket-version", "sec-websocket-key"].map(|name| only(request, name));
    let fits = !once.contains(&None) && offered().any(|word| word == PROTOCOL);
    let answer = create_response(request).ok().filter(|_| fits);
    let Some(mut answer) = answer else {
        let words = "a WebSocket with the protocol phyxel.1 lives here\n";
        return say(&mut stream, "400 Bad Request", words);
    };
    let protocol = HeaderValue::from_static(PROTOCOL);
    answer
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", protocol);
    let mut head = Vec::new();
    write_response(&mut head, &answer).map_err(io::Error::other)?;
    // Browsers let a page set no header but this.
    let token = offered().find_map(|word| word.strip_prefix("token."));
    if !token.is_some_and(|token| shared.gate.knows(token)) {
        return say(&mut stream, "403 Forbidden", "no token of this session\n");
    }
    let mailbox = Arc::new(Mailbox::default());
    let Some(client) = shared.admit(&mailbox) else {
        return say(&mut stream, "503 Service Unavailable", "too many clients\n");
    };
    locked(&shared.strangers).forget(number);
    let result = stream.write_all(&head).and_then(|()| {
        let hello = Told::Hello {
            protocol: PROTOCOL,
            server: shared.server.clone(),
            client,
        };
        mailbox.push(Outgoing::Text(hello.text().into()));
        let mut ear = Ear {
            client,
            shared,
            mailbox: &mailbox,
            mesh: Vec::new(),
        };
        if !ear.pass_on(Event::Joined) {
            return Ok(());
        }
        socket::serve(stream, early, &mailbox, |message| ear.hear(message))
    });
    mailbox.close();
    locked(&shared.clients)[client] = None;
    // Who listens must learn of it, however busy.
    let _ = shared.events.send((client, Event::Left));
    result
}

/// What listens to one client.
struct Ear<'a> {
    client: ClientId,
    shared: &'a Shared,
    mailbox: &'a Mailbox,
    /// A mesh file on its way.
    mesh: Vec<u8>,
}

impl Ear<'_> {
    /// Takes a message in; `false` ends the client. What is not understood is left aside.
    fn hear(&mut self, message: Message) -> bool {
        match message {
            Message::Text(text) => match serde_json::from_str::<Control>(&text) {
                Ok(Control::Unknown) => true,
                Ok(control) => self.pass_on(Event::Control(control)),
                Err(error) => {
                    self.complain(&format!("not understood: {error}"));
                    true
                }
            },
            Message::Binary(bytes) => match incoming::decode(&bytes) {
                Some(Incoming::Ack(number)) => {
                    self.mailbox.acknowledge(number);
                    // Only to wake the sleeping threads; a full queue is awake.
                    let event = (self.client, Event::Ready);
                    !matches!(
                        self.shared.events.try_send(event),
                        Err(TrySendError::Disconnected(_))
                    )
                }
                Some(Incoming::Hand(sequence, hand)) => self.pass_on(Event::Hand(sequence, hand)),
                Some(Incoming::Mesh {
                    total,
                    offset,
                    extension,
                    piece,
                }) => self.take_piece(total, offset, extension, &piece),
                None => true,
            },
            _ => true,
        }
    }

    fn take_piece(&mut self, total: usize, offset: usize, extension: String, piece: &[u8]) -> bool {
        if offset == 0 {
            self.mesh.clear();
        }
        if offset != self.mesh.len() || total > MAX_MESH {
            self.mesh = Vec::new();
            self.complain("the pieces of the mesh file are not in order; send it again");
            return true;
        }
        self.mesh.extend_from_slice(piece);
        if self.mesh.len() == total {
            let mesh = std::mem::take(&mut self.mesh);
            return self.pass_on(Event::Mesh(extension, mesh));
        }
        true
    }

    fn pass_on(&self, event: Event) -> bool {
        self.shared.events.send((self.client, event)).is_ok()
    }

    fn complain(&self, text: &str) {
        let note = Told::Note {
            bad: true,
            text: text.to_owned(),
        };
        self.mailbox.push(Outgoing::Text(note.text().into()));
    }
}
