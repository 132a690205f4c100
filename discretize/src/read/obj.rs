//! Wavefront OBJ: `v` and `f`; everything else is skipped.

use super::text::{Text, unexpected};
use super::{Failure, Raw, point, vertex_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, Failure> {
    let mut raw = Raw::default();
    // Faces may precede their vertices: indices are checked at the end.
    let mut faces: Vec<(i64, super::Place)> = Vec::new();
    let mut sizes: Vec<usize> = Vec::new();
    let mut text = Text::new(bytes);
    while let Some(mut words) = text.line() {
        let place = words.place();
        match words.next() {
            Some(b"v") => {
                let mut xyz = [0.0; 3];
                for x in &mut xyz {
                    *x = words.float("three coordinates")?;
                }
                raw.vertices.push(point(xyz, place)?);
            }
            Some(b"f") => {
                let before = faces.len();
                for word in words {
                    let first = word.split(|b| *b == b'/').next().unwrap_or(word);
                    let written = super::text::integer(first, place, "a vertex number")?;
                    let vertices = i64::try_from(raw.vertices.len()).unwrap_or(i64::MAX);
                    let zero_based = match written {
                        0 => return Err(unexpected("a vertex number from 1", first, place)),
                        n if n > 0 => n - 1,
                        n => match vertices.checked_add(n) {
                            Some(v) if v >= 0 => v,
                            _ => vertex_index(n, raw.vertices.len(), place).map(i64::from)?,
                        },
                    };
                    faces.push((zero_based, place));
                }
                sizes.push(faces.len() - before);
            }
            _ => {}
        }
    }
    let mut corners = Vec::new();
    let mut rest = faces.as_slice();
    for size in sizes {
        let (face, after) = rest.split_at(size);
        rest = after;
        corners.clear();
        for &(v, place) in face {
            corners.push(vertex_index(v, raw.vertices.len(), place)?);
        }
        raw.polygon(&corners);
    }
    Ok(raw)
}
