//! Files broken byte by byte.

use crate::cloud::Random;

/// Words that files are made of, and some that break them.
const WORDS: [&str; 26] = [
    "nan",
    "-inf",
    "1e400",
    "-1",
    "0",
    "18446744073709551615",
    "-9223372036854775808",
    "4294967296",
    "200000000",
    "99999999999999999999",
    "1e-320",
    "\"",
    "((((((((((",
    "]",
    "\u{1b}[31m",
    "\u{0}",
    "\r",
    "#",
    "vertex",
    "element face 5\n",
    "OFF\n",
    "solid\n",
    "v 0 0 0\n",
    "f 1 2 3\n",
    "end_header\n",
    "ä\u{2028}",
];

/// Breaks a file in one to four positions.
#[must_use]
pub fn broken(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() + 1);
        let end = (at + 1 + random.below(64)).min(bytes.len());
        match random.below(9) {
            0 => bytes.truncate(at),
            1 => {
                bytes.drain(at..end);
            }
            2 => {
                let slice = bytes[at..end].to_vec();
                bytes.splice(at..at, slice);
            }
            3 | 4 => {
                let word = random.pick(&WORDS).as_bytes().to_vec();
                bytes.splice(at..at, word);
            }
            5 => {
                for byte in &mut bytes[at..end] {
                    *byte = random.bits().to_le_bytes()[0];
                }
            }
            6 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            // A digit becomes another one.
            7 => {
                let digits = (at..bytes.len()).find(|k| bytes[*k].is_ascii_digit());
                if let Some(k) = digits {
                    bytes[k] = *random.pick(b"0123456789");
                }
            }
            _ => {
                // A number becomes a word.
                let digit = (at..bytes.len()).find(|k| bytes[*k].is_ascii_digit());
                if let Some(start) = digit {
                    let number = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
                    let end = (start..bytes.len()).find(|k| !number(&bytes[*k]));
                    let word = random.pick(&WORDS).as_bytes().to_vec();
                    bytes.splice(start..end.unwrap_or(bytes.len()), word);
                }
            }
        }
    }
    bytes
}
