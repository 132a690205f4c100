//! Wavefront OBJ: `v` and `f`; everything else is skipped.

use std::borrow::Cow;

use super::text::{Text, line_end, unexpected};
use super::{RawMesh, ReadError, TextPlace, out_of_range};

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    // Faces may precede their vertices: indices are checked at the end.
    let mut corners: Vec<i64> = Vec::new();
    let mut faces: Vec<(usize, TextPlace)> = Vec::new();
    let joined = join_lines(bytes);
    let mut text = Text::new(&joined);
    while let Some(mut words) = text.line() {
        let place = words.place();
        match words.next() {
            Some(b"v") => raw.vertices.push(words.point()?),
            Some(b"f") => {
                let before = corners.len();
                for word in words {
                    let first = word.split(|b| *b == b'/').next().unwrap_or(word);
                    let written = super::text::integer(first, place, "a vertex number")?;
                    let vertices = i64::try_from(raw.vertices.len()).unwrap_or(i64::MAX);
                    corners.push(match written {
                        0 => return Err(unexpected("a vertex number from 1", first, place)),
                        n if n > 0 => n,
                        n => match vertices.checked_add(n) {
                            Some(v) if v >= 0 => v + 1,
                            _ => return Err(out_of_range(n, raw.vertices.len(), place)),
                        },
                    });
                }
                faces.push((corners.len() - before, place));
            }
            _ => {}
        }
    }
    let count = raw.vertices.len();
    let mut face = Vec::new();
    let mut rest = corners.as_slice();
    for (size, place) in faces {
        let (own, after) = rest.split_at(size);
        rest = after;
        face.clear();
        for &number in own {
            match u32::try_from(number - 1) {
                Ok(v) if (v as usize) < count => face.push(v),
                _ => return Err(out_of_range(number, count, place)),
            }
        }
        raw.polygon(&face, place)?;
    }
    Ok(raw)
}

/// The text with lines that end in a backslash joined to the next. The joined lines' ends follow
/// behind, so that later lines keep their numbers.
fn join_lines(bytes: &[u8]) -> Cow<'_, [u8]> {
    let continued = |pair: &[u8]| pair[0] == b'\\' && matches!(pair[1], b'\n' | b'\r');
    if !bytes.windows(2).any(continued) {
        return Cow::Borrowed(bytes);
    }
    let mut out = Vec::with_capacity(bytes.len());
    let (mut rest, mut owed) = (bytes, 0);
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        let ends = line_end(rest);
        if byte == b'\\' && ends > 0 {
            out.push(b' ');
            rest = &rest[ends..];
            owed += 1;
        } else {
            out.push(byte);
            if byte == b'\n' {
                out.extend(std::iter::repeat_n(b'\n', owed));
                owed = 0;
            }
        }
    }
    Cow::Owned(out)
}
