//! The server as strangers, slow and broken clients find it.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use phyxel_live::{Control, Event, Hand, HandPhase, MAX_CLIENTS, PROTOCOL, Server, To, Told};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Bytes, Message, WebSocket};

type Socket = WebSocket<TcpStream>;

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(20);

fn connected(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// Sends `text` and reads what comes until the end.
fn talk(server: &Server, text: &str) -> String {
    let mut stream = connected(server);
    stream.write_all(text.as_bytes()).unwrap();
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

fn get(server: &Server, target: &str, more: &str) -> String {
    let host = server.address();
    let asked = format!("GET {target} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n");
    talk(server, &asked)
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or("")
}

fn token(server: &Server) -> String {
    let url = server.url().unwrap();
    let code = url.rsplit('#').next().unwrap().to_owned();
    let answer = get(server, &format!("/token?{code}"), "");
    assert_eq!(status(&answer), "200", "{answer}");
    answer.rsplit("\r\n").next().unwrap().to_owned()
}

fn join(server: &Server, token: &str, origin: Option<&str>) -> Result<Socket, String> {
    let address = server.address();
    let target = format!("ws://{address}/session");
    let mut request = target.into_client_request().unwrap();
    let headers = request.headers_mut();
    let offered = format!("{PROTOCOL}, token.{token}");
    headers.insert("Sec-WebSocket-Protocol", offered.parse().unwrap());
    if let Some(origin) = origin {
        headers.insert("Origin", origin.parse().unwrap());
    }
    let joined = tungstenite::client(request, connected(server));
    let joined = joined.map(|(socket, _)| socket);
    joined.map_err(|error| error.to_string())
}

/// The next event of any client.
fn event(server: &Server) -> (usize, Event) {
    let heard = server.events().recv_timeout(PATIENCE);
    heard.expect("an event comes")
}

fn edge(sequence: u32, phase: u32) -> Message {
    let mut bytes = vec![18, 0, 24, 0, 0, 0, 0, 0];
    for number in [sequence, phase, 2, 0] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [0.0, 0.0, 0.0, 0.0, 0.0, 0.1_f64] {
        bytes.extend(number.to_le_bytes());
    }
    Message::Binary(bytes.into())
}

#[test]
fn only_the_page_is_served_and_under_a_strict_policy() {
    let server = Server::start(0, "test").unwrap();
    let page = get(&server, "/", "");
    assert_eq!(status(&page), "200");
    let policy = "default-src 'none', frame-ancestors 'none', nosniff, no-store, no-referrer";
    for header in policy.split(", ") {
        assert!(page.contains(header), "{header}");
    }
    for asset in ["/main.js", "/style.css", "/shaders.js", "/icon.svg"] {
        assert_eq!(status(&get(&server, asset, "")), "200", "{asset}");
    }
    let others = "/../Cargo.toml //main.js /MAIN.JS /page/main.js /%2e%2e/x /session/";
    for other in others.split(' ') {
        assert_eq!(status(&get(&server, other, "")), "404", "{other}");
    }
    let address = server.address();
    let post = format!("POST / HTTP/1.1\r\nHost: {address}\r\nContent-Length: 0\r\n\r\n");
    assert_eq!(status(&talk(&server, &post)), "405");
    let foreign = "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n";
    assert_eq!(status(&talk(&server, foreign)), "403");
    let foreign = get(&server, "/", "Origin: http://evil.example\r\n");
    assert_eq!(status(&foreign), "403");
    // A socket without a token, and one without the protocol.
    let upgrade = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    assert_eq!(status(&get(&server, "/session", upgrade)), "400");
    let more = format!("{upgrade}Sec-WebSocket-Protocol: {PROTOCOL}\r\n");
    assert_eq!(status(&get(&server, "/session", &more)), "403");
}

#[test]
fn a_code_is_good_once_and_a_token_is_needed() {
    let server = Server::start(0, "test").unwrap();
    let url = server.url().unwrap();
    let code = url.rsplit('#').next().unwrap();
    let target = format!("/token?{code}");
    let foreign = get(&server, &target, "Origin: http://evil.example\r\n");
    assert_eq!(status(&foreign), "403", "a foreign page does not get it");
    for code in ["", &code[1..]] {
        let other = get(&server, &format!("/token?{code}"), "");
        assert_eq!(status(&other), "403", "'{code}' is another");
    }
    assert_eq!(status(&get(&server, &target, "")), "200", "nor uses it up");
    assert_eq!(status(&get(&server, &target, "")), "403", "it was used");
    let token = token(&server);
    let own = format!("http://{}", server.address());
    assert!(join(&server, "", None).is_err());
    assert!(join(&server, code, None).is_err());
    assert!(join(&server, &token[1..], None).is_err());
    assert!(join(&server, &token, Some("http://evil.example")).is_err());
    assert!(join(&server, &token, Some("null")).is_err());
    assert!(server.events().try_recv().is_err(), "none of these came in");
    assert!(join(&server, &token, Some(&own)).is_ok());
    assert!(matches!(event(&server), (0, Event::Joined)));
}

#[test]
fn clients_come_speak_and_go_and_their_places_are_free_again() {
    let server = Server::start(0, "test 1").unwrap();
    let token = token(&server);
    let mut sockets: Vec<Socket> = Vec::new();
    for client in 0..MAX_CLIENTS {
        let mut socket = join(&server, &token, None).unwrap();
        assert_eq!(event(&server), (client, Event::Joined));
        let hello = socket.read().unwrap().into_text().unwrap();
        let own = format!("\"client\":{client}");
        for part in ["\"type\":\"hello\"", "test 1", &own] {
            assert!(hello.contains(part), "{hello}");
        }
        sockets.push(socket);
    }
    // There is no place left.
    assert!(join(&server, &token, None).is_err());
    // Two speak at once; each is known by its position.
    sockets[3].send(edge(1, 0)).unwrap();
    sockets[5].send(Message::text(r#"{"do":"play"}"#)).unwrap();
    let mut heard = [event(&server), event(&server)];
    heard.sort_by_key(|(client, _)| *client);
    let (3, Event::Hand(1, Hand::Edge { phase, .. })) = &heard[0] else {
        unreachable!("the edge of the third: {:?}", heard[0]);
    };
    assert_eq!(*phase, HandPhase::Begin);
    assert_eq!(heard[1], (5, Event::Control(Control::Play)));
    // What is not understood is answered or left aside, and what comes later is heard.
    for strange in ["{", "[]", r#"{"do":"fly"}"#, r#"{"do":"step","steps":-1}"#] {
        sockets[5].send(Message::text(strange)).unwrap();
    }
    sockets[5].send(Message::binary(vec![1, 2, 3])).unwrap();
    sockets[5].send(Message::text(r#"{"do":"undo"}"#)).unwrap();
    assert_eq!(event(&server), (5, Event::Control(Control::Undo)));
    // One is killed in the middle of a stroke.
    drop(sockets.remove(3));
    assert_eq!(event(&server), (3, Event::Left));
    let mut next = join(&server, &token, None).unwrap();
    assert_eq!(event(&server), (3, Event::Joined));
    // What is for one is not for all.
    let note = |text: &str| Told::Note {
        bad: false,
        text: text.to_owned(),
    };
    server.tell(To::One(2), &note("not for you"));
    server.tell(To::All, &note("for all"));
    for part in ["hello", "for all"] {
        assert!(next.read().unwrap().into_text().unwrap().contains(part));
    }
}

#[test]
fn one_state_is_in_flight() {
    let server = Server::start(0, "test").unwrap();
    let mut socket = join(&server, &token(&server), None).unwrap();
    event(&server);
    socket.read().unwrap();
    let state = |number: u32| {
        let mut bytes = vec![4, 0, 104, 0, 1, 0, 0, 0];
        bytes.extend(number.to_le_bytes());
        bytes
    };
    assert!(server.wants_state());
    for number in 1..=5 {
        server.put_state(number, state(number));
        // The first is on its way before the others come.
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(!server.wants_state());
    assert_eq!(socket.read().unwrap().into_data(), state(1));
    let acknowledge = |socket: &mut Socket, number: u32| {
        let head = [16, 0, 12, 0, 0, 0, 0, 0];
        let bytes = [&head[..], &number.to_le_bytes()].concat();
        socket.send(Message::binary(bytes)).unwrap();
        assert_eq!(event(&server), (0, Event::Ready));
    };
    acknowledge(&mut socket, 7);
    // What is queued does not wait for states, and nothing has come before it: another was acknowledged.
    server.send(To::All, vec![9]);
    assert_eq!(socket.read().unwrap().into_data(), vec![9]);
    acknowledge(&mut socket, 1);
    assert_eq!(socket.read().unwrap().into_data(), state(5), "the newest");
}

#[test]
fn who_falls_behind_gets_the_scene_anew_and_an_end_is_told() {
    let server = Server::start(0, "test").unwrap();
    let token = token(&server);
    let mut socket = join(&server, &token, None).unwrap();
    event(&server);
    socket.read().unwrap();
    // Changes without end for one who reads nothing: the server keeps some of them.
    for _ in 0..40 {
        server.send(To::All, vec![0; 1 << 20]);
    }
    assert_eq!(server.behind(), [0; 0], "much waits for it");
    let mut changes = 0;
    while server.behind().is_empty() {
        changes += usize::from(socket.read().unwrap().is_binary());
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(changes < 40, "{changes} of 40");
    server.begin(To::One(0), phyxel_live::Scene::default(), vec![vec![7]]);
    assert_eq!(server.behind(), [0; 0]);
    while !socket.read().unwrap().is_text() {}
    assert_eq!(socket.read().unwrap().into_data(), vec![7]);
    // Who has the token learns whether the session is still the same; and of its end.
    let again = get(&server, &format!("/token?{token}"), "");
    assert!(again.ends_with(&token), "{again}");
    let begun = Instant::now();
    let ended = std::thread::spawn(move || socket.read());
    drop(server);
    let Message::Close(Some(frame)) = ended.join().unwrap().unwrap() else {
        unreachable!("an end is told");
    };
    assert_eq!(u16::from(frame.code), 1001);
    assert!(begun.elapsed() < Duration::from_secs(2));
}

#[test]
fn slow_half_open_and_flooding_strangers_do_not_keep_others_out() {
    let server = Server::start(0, "test").unwrap();
    // More that say nothing, or half a request, than there are positions.
    let address = server.address();
    let mut silent: Vec<TcpStream> = Vec::new();
    for k in 0..150 {
        let mut stream = TcpStream::connect(address).unwrap();
        if k % 2 == 0 {
            let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost: ");
        }
        silent.push(stream);
    }
    // The oldest give way: who asks is answered at once.
    assert_eq!(status(&get(&server, "/", "")), "200");
    // One that sends a byte at a time is cut off after two seconds all the same.
    let begun = Instant::now();
    let mut slow = silent.pop().unwrap();
    slow.set_read_timeout(Some(Duration::from_millis(200)))
        .unwrap();
    let mut answer = [0; 64];
    let ended = loop {
        let _ = slow.write_all(b"a");
        match slow.read(&mut answer) {
            Ok(0) => break true,
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => break true,
            _ => {}
        }
        if begun.elapsed() > Duration::from_secs(60) {
            break false;
        }
    };
    assert!(ended, "a slow sender must not hold a place for ever");
    let long = format!("X: {}\r\n", "a".repeat(20_000));
    assert_ne!(status(&get(&server, "/", &long)), "200");
    // A frame larger than allowed ends its client.
    let token = token(&server);
    let mut socket = join(&server, &token, None).unwrap();
    assert_eq!(event(&server), (0, Event::Joined));
    let _ = socket.send(Message::Binary(Bytes::from(vec![0; 2 << 20])));
    assert_eq!(event(&server), (0, Event::Left));
}
