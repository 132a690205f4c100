//! A client without a page: leads a blade along a path and prints force and latency.
//!
//! `cargo run --release -p phyxel-live --example lead -- URL [press]`: with `press` a probe is led instead.

use std::collections::VecDeque;
use std::error::Error;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

type Answer<T> = Result<T, Box<dyn Error>>;

/// Poses a second that are sent.
const RATE: u32 = 60;
const SENT: u32 = 240;

fn main() -> Answer<()> {
    let mut arguments = std::env::args().skip(1);
    let url = arguments
        .next()
        .ok_or("give the address that phyxel live prints")?;
    let press = arguments.next().is_some_and(|word| word == "press");
    let (address, code) = url
        .strip_prefix("http://")
        .and_then(|rest| rest.split_once("/#"))
        .ok_or("the address has no code")?;
    let mut socket = join(address, &token(address, code)?)?;
    let (low, high, settled) = scene(&mut socket)?;
    println!("box {low:?} to {high:?}, at rest after {settled:.1} s");
    let middle = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    let size = [0, 1, 2].map(|k| high[k] - low[k]);
    socket
        .get_mut()
        .set_read_timeout(Some(Duration::from_millis(1)))?;
    let (mut waiting, mut late) = (VecDeque::new(), Vec::new());
    let (begun, mut sent, mut peak) = (Instant::now(), 0, 0.0_f32);
    while sent < SENT || !waiting.is_empty() {
        if sent < SENT && begun.elapsed() >= Duration::from_secs(1) * sent / RATE {
            sent += 1;
            let share = f64::from(sent) / f64::from(SENT);
            let phase = [0, 1, 2][usize::from(sent > 1) + usize::from(sent == SENT)];
            let message = if press {
                // From above, a tenth of the height into it and out again.
                let depth = size[2] * (0.6 - 0.7 * (share * std::f64::consts::PI).sin());
                pose(
                    sent,
                    phase,
                    [middle[0] - 0.2 * size[0], middle[1], middle[2] + depth],
                )
            } else {
                // Across the top, from left to right, a quarter of the height deep.
                let x = low[0] + size[0] * (0.2 + 0.5 * share);
                let heel = [x, middle[1], high[2] + 0.1 * size[2]];
                edge(sent, phase, heel, [x, middle[1], middle[2]])
            };
            socket.send(Message::binary(message))?;
            waiting.push_back((sent, Instant::now()));
        }
        let Some(state) = binary(&mut socket)? else {
            continue;
        };
        let u32_at = |at: usize| {
            state
                .get(at..at + 4)
                .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        if u32_at(0).map(|kind| kind & 0xffff) != Some(4) {
            continue;
        }
        // Our place in the table is the first where we are alone.
        let (number, seen) = (u32_at(8).unwrap_or(0), u32_at(40).unwrap_or(0));
        while let Some((_, stamp)) = waiting.front().filter(|(sequence, _)| *sequence <= seen) {
            late.push(1e3 * stamp.elapsed().as_secs_f64());
            waiting.pop_front();
        }
        let force = [132, 136, 140].map(|at| f32::from_bits(u32_at(at).unwrap_or(0)));
        peak = peak.max(force.iter().map(|x| x * x).sum::<f32>().sqrt());
        let mut ack = vec![16, 0, 12, 0, 0, 0, 0, 0];
        ack.extend(number.to_le_bytes());
        socket.send(Message::binary(ack))?;
        if begun.elapsed() > Duration::from_secs(120) {
            return Err("the server does not keep up".into());
        }
    }
    late.sort_by(f64::total_cmp);
    let at = |share: f64| {
        late.get(((late.len() - 1) as f64 * share) as usize)
            .copied()
            .unwrap_or(0.0)
    };
    println!("largest force {peak:.3} N");
    println!(
        "pose to state: median {:.2} ms, p95 {:.2} ms, largest {:.2} ms of {}",
        at(0.5),
        at(0.95),
        at(1.0),
        late.len()
    );
    Ok(())
}

/// A code's token.
fn token(address: &str, code: &str) -> Answer<String> {
    let mut stream = TcpStream::connect(address)?;
    write!(
        stream,
        "GET /token?{code} HTTP/1.1\r\nHost: {address}\r\n\r\n"
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    let good = answer.starts_with("HTTP/1.1 200");
    let token = answer.rsplit("\r\n").next().filter(|_| good);
    Ok(token.ok_or("the code is not good any more")?.to_owned())
}

fn join(address: &str, token: &str) -> Answer<WebSocket<TcpStream>> {
    let mut request = format!("ws://{address}/session").into_client_request()?;
    let offered = format!("phyxel.1, token.{token}").parse()?;
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", offered);
    let stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    Ok(tungstenite::client(request, stream)?.0)
}

/// The box round all bodies, once they are at rest.
fn scene(socket: &mut WebSocket<TcpStream>) -> Answer<([f64; 3], [f64; 3], f64)> {
    let (begun, mut found) = (Instant::now(), None);
    loop {
        let Message::Text(text) = socket.read()? else {
            continue;
        };
        let told: serde_json::Value = serde_json::from_str(&text)?;
        let point = |key: &str| [0, 1, 2].map(|k| told[key][k].as_f64().unwrap_or(0.0));
        if told["type"] == "scene" {
            found = Some((point("low"), point("high")));
        }
        if let (Some((low, high)), Some(false)) = (found, told["settling"].as_bool()) {
            return Ok((low, high, begun.elapsed().as_secs_f64()));
        }
    }
}

/// A binary message, if one is there.
fn binary(socket: &mut WebSocket<TcpStream>) -> Answer<Option<Vec<u8>>> {
    match socket.read() {
        Ok(Message::Binary(bytes)) => Ok(Some(bytes.to_vec())),
        Ok(_) => Ok(None),
        Err(tungstenite::Error::Io(error))
            if matches!(
                error.kind(),
                std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
            ) =>
        {
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

fn message(kind: u16, head: u16, words: &[u32], numbers: &[f64]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), head.to_le_bytes(), [0; 2], [0; 2]].concat();
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

fn edge(sequence: u32, phase: u32, [a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> Vec<u8> {
    message(18, 24, &[sequence, phase, 2, 0], &[a, b, c, d, e, f])
}

fn pose(sequence: u32, phase: u32, [x, y, z]: [f64; 3]) -> Vec<u8> {
    message(
        17,
        80,
        &[sequence, phase, 0, 0],
        &[x, y, z, 0.0, 0.0, 0.0, 1.0],
    )
}
