//! Lines and words of a text file with their positions.

use glam::DVec3;

use super::{ReadError, ReadErrorKind, TextPlace, point, truncated};

/// Bytes shown of an unexpected word.
const SHOWN: usize = 24;

/// Byte order of binary numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

/// A binary number of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// The type of a name: `names` has those of all types in their order with bars between them, several words for one.
    pub(super) fn named(word: &[u8], names: &str) -> Option<Self> {
        use Scalar::{F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        let mut all = names
            .split('|')
            .zip([I8, U8, I16, U16, I32, U32, I64, U64, F32, F64]);
        let is = |names: &str| names.split(' ').any(|name| name.as_bytes() == word);
        let known = all.find(|(names, _)| !word.is_empty() && is(names))?;
        Some(known.1)
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The value of the first [`Scalar::size`] bytes; `None` if there are fewer.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "bits read as the type that the file names"
    )]
    pub(super) fn read(self, bytes: &[u8], order: ByteOrder) -> Option<f64> {
        let own = bytes.get(..self.size())?;
        let fold = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        let bits = match order {
            ByteOrder::Big => own.iter().fold(0, fold),
            ByteOrder::Little => own.iter().rev().fold(0, fold),
        };
        Some(match self {
            Self::I8 => f64::from(bits as i8),
            Self::U8 => f64::from(bits as u8),
            Self::I16 => f64::from(bits as i16),
            Self::U16 => f64::from(bits as u16),
            Self::I32 => f64::from(bits as i32),
            Self::U32 => f64::from(bits as u32),
            Self::I64 => bits as i64 as f64,
            Self::U64 => bits as f64,
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
        })
    }
}

/// A file read line by line, word by word or number by number; lines end with LF, CR LF or CR.
pub(super) struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    /// Byte order of the numbers; `None` where they are words.
    pub(super) order: Option<ByteOrder>,
}

/// The words of one line.
#[derive(Clone, Default)]
pub(super) struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Text<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: 0,
            line: 1,
            order: None,
        }
    }

    /// Bytes not yet read.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    pub(super) fn skip(&mut self, bytes: usize) {
        self.at = (self.at + bytes).min(self.bytes.len());
    }

    /// Where the next line or word is.
    pub(super) fn line_place(&self) -> TextPlace {
        TextPlace::Line(self.line)
    }

    /// Where the next number is.
    pub(super) fn place(&self) -> TextPlace {
        match self.order {
            Some(_) => TextPlace::Byte(self.at),
            None => self.line_place(),
        }
    }

    /// The next number, of a type where it is binary.
    pub(super) fn number(
        &mut self,
        kind: Scalar,
        expected: &'static str,
    ) -> Result<f64, ReadError> {
        let Some(order) = self.order else {
            return float(self.need(expected)?, self.line_place());
        };
        let value = kind.read(self.rest(), order);
        let value = value.ok_or_else(|| truncated(expected, self.place()))?;
        self.skip(kind.size());
        Ok(value)
    }

    /// The next binary integer; exact up to 2^53, beyond which no index or count is in range.
    #[allow(
        clippy::cast_possible_truncation,
        reason = "whole numbers; larger ones saturate"
    )]
    pub(super) fn whole(&mut self, kind: Scalar, expected: &'static str) -> Result<i64, ReadError> {
        Ok(self.number(kind, expected)? as i64)
    }

    /// The next line; `None` at the end.
    pub(super) fn line(&mut self) -> Option<Words<'a>> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let end = rest
            .iter()
            .position(|b| matches!(b, b'\n' | b'\r'))
            .unwrap_or(rest.len());
        let words = Words {
            rest: &rest[..end],
            line: self.line,
        };
        self.line += usize::from(end < rest.len());
        self.skip(end + line_end(&rest[end..]));
        Some(words)
    }

    /// The next line with a word on it that is no comment.
    pub(super) fn full_line(&mut self, expected: &'static str) -> Result<Words<'a>, ReadError> {
        while let Some(words) = self.line() {
            if words.peek().is_some_and(|word| !word.starts_with(b"#")) {
                return Ok(words);
            }
        }
        Err(self.truncated(expected))
    }

    /// The next word, over line ends; `None` at the end.
    pub(super) fn word(&mut self) -> Option<&'a [u8]> {
        while let Some(&byte) = self.bytes.get(self.at) {
            if !byte.is_ascii_whitespace() {
                break;
            }
            let pair = byte == b'\r' && self.bytes.get(self.at + 1) == Some(&b'\n');
            self.line += usize::from(byte == b'\n' || (byte == b'\r' && !pair));
            self.at += 1;
        }
        let rest = self.rest();
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        self.at += end;
        (end > 0).then(|| &rest[..end])
    }

    pub(super) fn need(&mut self, expected: &'static str) -> Result<&'a [u8], ReadError> {
        self.word().ok_or_else(|| self.truncated(expected))
    }

    pub(super) fn integer(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        let word = self.need(expected)?;
        integer(word, self.line_place(), expected)
    }

    /// A count of things that take at least `least` bytes each of what follows.
    pub(super) fn count(&mut self, what: &'static str, least: usize) -> Result<usize, ReadError> {
        let value = self.integer(what)?;
        self.checked(value, what, least, self.line_place())
    }

    /// The same for a count that was read.
    pub(super) fn checked(
        &self,
        value: i64,
        what: &'static str,
        least: usize,
        place: TextPlace,
    ) -> Result<usize, ReadError> {
        check_count(value, what, least, self.rest().len(), place)
    }

    /// The end of the file: only white space and comments may follow.
    pub(super) fn end(&mut self) -> Result<(), ReadError> {
        match self.full_line("") {
            Err(_) => Ok(()),
            Ok(words) => {
                let bytes = self.rest().len() + words.rest.len();
                Err(ReadErrorKind::Trailing { bytes }.at(words.place()))
            }
        }
    }

    pub(super) fn truncated(&self, expected: &'static str) -> ReadError {
        truncated(expected, self.line_place())
    }
}

impl<'a> Words<'a> {
    pub(super) fn place(&self) -> TextPlace {
        TextPlace::Line(self.line)
    }

    fn peek(&self) -> Option<&'a [u8]> {
        let rest = self.rest.trim_ascii_start();
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        (end > 0).then(|| &rest[..end])
    }

    /// Three coordinates.
    pub(super) fn point(&mut self) -> Result<DVec3, ReadError> {
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            *x = self.float("three coordinates")?;
        }
        point(xyz, self.place())
    }

    pub(super) fn float(&mut self, expected: &'static str) -> Result<f64, ReadError> {
        let place = self.place();
        float(self.need(expected)?, place)
    }

    pub(super) fn integer(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        let place = self.place();
        integer(self.need(expected)?, place, expected)
    }

    fn need(&mut self, expected: &'static str) -> Result<&'a [u8], ReadError> {
        let place = self.place();
        self.next().ok_or_else(|| truncated(expected, place))
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let word = self.peek()?;
        let skipped = self.rest.len() - self.rest.trim_ascii_start().len();
        self.rest = &self.rest[skipped + word.len()..];
        Some(word)
    }
}

/// A number that should not stand there.
pub(super) fn unexpected_number(
    expected: &'static str,
    found: &dyn std::fmt::Display,
    place: TextPlace,
) -> ReadError {
    unexpected(expected, found.to_string().as_bytes(), place)
}

/// Bytes of the line's end that some bytes begin with, 0 if they do not.
pub(super) fn line_end(bytes: &[u8]) -> usize {
    match bytes {
        [b'\r', b'\n', ..] => 2,
        [b'\n' | b'\r', ..] => 1,
        _ => 0,
    }
}

pub(super) fn unexpected(expected: &'static str, found: &[u8], place: TextPlace) -> ReadError {
    let found = String::from_utf8_lossy(&found[..found.len().min(SHOWN)]).into_owned();
    ReadErrorKind::Unexpected { expected, found }.at(place)
}

/// A finite number.
pub(super) fn float(word: &[u8], place: TextPlace) -> Result<f64, ReadError> {
    let value: f64 = std::str::from_utf8(word)
        .ok()
        .and_then(|w| w.parse().ok())
        .ok_or_else(|| unexpected("a number", word, place))?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(ReadErrorKind::NotFinite.at(place))
    }
}

pub(super) fn integer(
    word: &[u8],
    place: TextPlace,
    expected: &'static str,
) -> Result<i64, ReadError> {
    std::str::from_utf8(word)
        .ok()
        .and_then(|w| w.parse().ok())
        .ok_or_else(|| unexpected(expected, word, place))
}

/// A count that the bytes left can justify.
pub(super) fn check_count(
    value: i64,
    what: &'static str,
    least: usize,
    left: usize,
    place: TextPlace,
) -> Result<usize, ReadError> {
    match usize::try_from(value) {
        Ok(count) if count.saturating_mul(least.max(1)) <= left.saturating_add(1) => Ok(count),
        _ => {
            let count = value.unsigned_abs();
            Err(ReadErrorKind::Count { what, count }.at(place))
        }
    }
}
