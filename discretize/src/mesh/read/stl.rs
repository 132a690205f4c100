//! STL: triangles without shared corners, as text or binary.

use super::text::{ByteOrder, Scalar, Text, unexpected};
use super::{RawMesh, ReadError, ReadErrorKind, TextPlace, is_padding, point};
use crate::mesh::index;

const HEADER: usize = 84;
const FACET: usize = 50;

/// A binary STL has exactly the length its count says; text never starts like that by chance.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    let Some(count) = bytes.get(80..HEADER).and_then(|b| b.try_into().ok()) else {
        return false;
    };
    let facets = u32::from_le_bytes(count) as usize;
    let exact = facets
        .checked_mul(FACET)
        .and_then(|n| n.checked_add(HEADER))
        .is_some_and(|n| n == bytes.len());
    // A file cut short still shows bytes that no text has. Formats with a magic word were recognised
    // apart before.
    exact || bytes[..HEADER].contains(&0)
}

pub(super) fn parse_binary(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut at = 0;
    // Some tools write one solid after the other, each with a header of its own.
    while at == 0 || !is_padding(&bytes[at..]) {
        at = solid(bytes, at, &mut raw)?;
    }
    Ok(raw)
}

/// Reads the solid whose header begins at a byte; where the next one may begin.
fn solid(bytes: &[u8], start: usize, raw: &mut RawMesh) -> Result<usize, ReadError> {
    let rest = &bytes[start..];
    let trailing = ReadErrorKind::Trailing { bytes: rest.len() }.at(TextPlace::Byte(start));
    let Some((header, facets)) = rest.split_at_checked(HEADER) else {
        return Err(trailing);
    };
    let count = u32::from_le_bytes([header[80], header[81], header[82], header[83]]);
    let facets = facets.chunks_exact(FACET);
    if facets.len() < count as usize {
        let (what, count) = ("triangles", u64::from(count));
        return Err(if start > 0 {
            trailing
        } else {
            ReadErrorKind::Count { what, count }.at(TextPlace::Byte(80))
        });
    }
    let first_facet = start + HEADER;
    for (f, facet) in facets.take(count as usize).enumerate() {
        let first = index(raw.vertices.len());
        for corner in 1..4 {
            let at = 12 * corner;
            let float = |axis: usize| Scalar::F32.read(&facet[at + 4 * axis..], ByteOrder::Little);
            let xyz = [0, 1, 2].map(|axis| float(axis).unwrap_or(f64::NAN));
            let place = TextPlace::Byte(first_facet + f * FACET + at);
            raw.vertices.push(point(xyz, place)?);
        }
        raw.triangles.push([first, first + 1, first + 2]);
    }
    Ok(first_facet + count as usize * FACET)
}

pub(super) fn parse_ascii(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut text = Text::new(bytes);
    let mut corners = 0;
    let mut ended = true;
    while let Some(mut words) = text.line() {
        let place = words.place();
        let Some(word) = words.next() else { continue };
        match word.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                raw.vertices.push(words.point()?);
                corners += 1;
            }
            b"endfacet" => {
                if corners != 3 {
                    return Err(unexpected("three vertices before", word, place));
                }
                let end = index(raw.vertices.len());
                raw.triangles.push([end - 3, end - 2, end - 1]);
                corners = 0;
            }
            b"solid" => ended = false,
            b"endsolid" => ended = true,
            b"facet" | b"outer" if corners != 0 => {
                return Err(unexpected("`endfacet` of the triangle before", word, place));
            }
            b"facet" | b"outer" | b"endloop" | b"color" => {}
            _ => return Err(unexpected("a line of an STL text", word, place)),
        }
    }
    if corners != 0 {
        return Err(text.truncated("`endfacet`"));
    }
    if !ended {
        return Err(text.truncated("`endsolid`"));
    }
    Ok(raw)
}
