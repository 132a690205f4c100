//! Wavefront OBJ: `v` and `f`; everything else is skipped.

use super::text::{Text, unexpected};
use super::{Failure, Place, Raw, out_of_range, point, vertex_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, Failure> {
    let mut raw = Raw::default();
    // Faces may precede their vertices: indices are checked at the end.
    let mut corners: Vec<i64> = Vec::new();
    let mut faces: Vec<(usize, Place)> = Vec::new();
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
                            _ => vertex_index(n, raw.vertices.len(), place).map(i64::from)?,
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
