//! A client without a page: drives a blade (or with `press` a probe) and prints force and latency.
//!
//! `cargo run --release -p phyxel-live --example lead -- URL [press]`

#![allow(clippy::print_stdout, reason = "an example")]

use std::collections::VecDeque;
use std::error::Error;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

type Answer<T> = Result<T, Box<dyn Error>>;

/// Poses a second, and how many are sent.
const RATE: u32 = 60;
const SENT: u32 = 240;

fn main() -> Answer<()> {
    let mut words = std::env::args().skip(1);
    let url = words
        .next()
        .ok_or("give the address that phyxel live prints")?;
    let press = words.next().is_some_and(|word| word == "press");
    let mut socket = join(&url)?;
    let (mut low, mut high, mut begun) = ([0.0; 3], [0.0; 3], None);
    let (mut waiting, mut late, mut sent, mut peak) = (VecDeque::new(), Vec::new(), 0, 0.0_f32);
    while sent < SENT || !waiting.is_empty() {
        // A hand moves once the bodies are at rest.
        if let Some(begun) = begun.filter(|_| sent < SENT)
            && Instant::elapsed(&begun) >= Duration::from_secs(1) * sent / RATE
        {
            sent += 1;
            socket.send(Message::binary(hand(sent, press, low, high)))?;
            waiting.push_back((sent, Instant::now()));
        }
        match socket.read() {
            Ok(Message::Text(text)) => {
                let told: serde_json::Value = serde_json::from_str(&text)?;
                let point = |key: &str| [0, 1, 2].map(|k| told[key][k].as_f64().unwrap_or(0.0));
                if told["type"] == "scene" {
                    (low, high) = (point("low"), point("high"));
                }
                if told["settling"] == false && begun.is_none() {
                    begun = Some(Instant::now());
                }
            }
            Ok(Message::Binary(state)) if state.starts_with(&[4, 0]) => {
                let word = |at: usize| {
                    let bytes = state.get(at..at + 4).and_then(|b| b.try_into().ok());
                    u32::from_le_bytes(bytes.unwrap_or_default())
                };
                // The first position in the table is that of the first client.
                let is_seen = |(number, _): &(u32, Instant)| *number <= word(40);
                let seen = waiting.drain(..waiting.partition_point(is_seen));
                late.extend(seen.map(|(_, sent)| 1e3 * sent.elapsed().as_secs_f64()));
                let force = [132, 136, 140].map(|at| f32::from_bits(word(at)).powi(2));
                peak = peak.max(force.iter().sum::<f32>().sqrt());
                socket.send(Message::binary(message(16, 12, &[word(8)], &[])))?;
            }
            Err(tungstenite::Error::Io(error))
                if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => {}
            Err(error) => return Err(error.into()),
            Ok(_) => {}
        }
    }
    late.sort_by(f64::total_cmp);
    let at = |percent: usize| late[(late.len() - 1) * percent / 100];
    println!("largest force {peak:.3} N");
    let (median, most, all) = (at(50), at(95), at(100));
    println!("pose to state: median {median:.2} ms, p95 {most:.2} ms, largest {all:.2} ms");
    Ok(())
}

/// What a hand does in its message of this number, in the box between two corners (m).
fn hand(sent: u32, press: bool, low: [f64; 3], high: [f64; 3]) -> Vec<u8> {
    let share = f64::from(sent) / f64::from(SENT);
    let phase = u32::from(sent > 1) + u32::from(sent == SENT);
    let at = |place: [f64; 3]| [0, 1, 2].map(|k| low[k] + place[k] * (high[k] - low[k]));
    let (kind, head, third, numbers) = if press {
        // From above into it and out again, not turned.
        let height = 1.1 - 0.4 * (share * std::f64::consts::PI).sin();
        let place = at([0.3, 0.5, height]);
        (17, 80, 0, [&place[..], &[0.0, 0.0, 0.0, 1.0]].concat())
    } else {
        // Across the top, from one side towards the other.
        let x = 0.2 + 0.5 * share;
        let edge = [at([x, 0.5, 1.1]), at([x, 0.5, 0.5])];
        (18, 24, 2, edge.concat())
    };
    message(kind, head, &[sent, phase, third, 0], &numbers)
}

/// Exchanges the code of an address for a token and opens a socket with it.
fn join(url: &str) -> Answer<WebSocket<TcpStream>> {
    let rest = url
        .strip_prefix("http://")
        .and_then(|rest| rest.split_once("/#"));
    let (address, code) = rest.ok_or("the address has no code")?;
    let mut stream = TcpStream::connect(address)?;
    write!(
        stream,
        "GET /token?{code} HTTP/1.1\r\nHost: {address}\r\n\r\n"
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    let good = answer.starts_with("HTTP/1.1 200");
    let token = answer.rsplit("\r\n").next().filter(|_| good);
    let token = token.ok_or("the code is not good any more")?;
    let mut request = format!("ws://{address}/session").into_client_request()?;
    let offered = format!("phyxel.1, token.{token}").parse()?;
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", offered);
    let stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    let (socket, _) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
    Ok(socket)
}

fn message(kind: u16, head: u16, words: &[u32], numbers: &[f64]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), head.to_le_bytes(), [0; 2], [0; 2]].concat();
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}
