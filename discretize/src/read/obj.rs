//! Wavefront OBJ: `v` and `f`, and for textures `vt`, `usemtl`, `mtllib`; everything else is skipped.

use std::borrow::Cow;

use super::text::{Text, unexpected};
use super::texture::{NONE, RawTexture};
use super::{Failure, Raw, ReadErrorKind, TextPlace, out_of_range, point, vertex_index};

/// Into an empty `raw`.
pub(super) fn parse(bytes: &[u8], mut raw: Raw) -> Result<Raw, Failure> {
    let mut texture = raw.texture.take();
    // Faces may precede their vertices: indices are checked at the end.
    let mut corners: Vec<i64> = Vec::new();
    let mut faces: Vec<(usize, TextPlace)> = Vec::new();
    // One number for each corner, and one material for each face.
    let (mut places, mut materials): (Vec<i64>, Vec<u32>) = (Vec::new(), Vec::new());
    let mut material = NONE;
    let joined = join_lines(bytes);
    let mut text = Text::new(&joined);
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
                    let mut numbers = word.split(|b| *b == b'/');
                    let first = numbers.next().unwrap_or(word);
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
                    if let Some(texture) = &texture {
                        let word = numbers.next().filter(|word| !word.is_empty());
                        places.push(texture_number(word, texture, place)?);
                    }
                }
                faces.push((corners.len() - before, place));
                if texture.is_some() {
                    materials.push(material);
                }
            }
            Some(word @ (b"vt" | b"usemtl" | b"mtllib")) => {
                let Some(texture) = &mut texture else {
                    continue;
                };
                match word {
                    b"vt" => {
                        let u = words.float("texture coordinates")?;
                        let v = words.next().map(|v| super::text::float(v, place));
                        texture
                            .coordinates
                            .push([u, v.transpose()?.unwrap_or(0.0)].into());
                    }
                    b"usemtl" => material = texture.material(&words.text()),
                    _ => texture.libraries.push((words.text().into_owned(), place)),
                }
            }
            _ => {}
        }
    }
    let count = raw.vertices.len();
    let mut face = Vec::new();
    let mut rest = corners.as_slice();
    let mut rest_places = places.as_slice();
    let mut materials = materials.into_iter();
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
        if let (Some(texture), Some(material)) = (&mut texture, materials.next()) {
            let (own, after) = rest_places.split_at(size);
            rest_places = after;
            texture.polygon(own, material, place)?;
        }
    }
    raw.texture = texture;
    Ok(raw)
}

/// The number, from 1, of a corner's texture coordinates; 0 without any.
fn texture_number(
    word: Option<&[u8]>,
    texture: &RawTexture,
    place: TextPlace,
) -> Result<i64, Failure> {
    let Some(word) = word else { return Ok(0) };
    let count = texture.coordinates.len();
    let expected = "the number of texture coordinates";
    match super::text::integer(word, place, expected)? {
        0 => Err(unexpected(
            "a number of texture coordinates from 1",
            word,
            place,
        )),
        n if n > 0 => Ok(n),
        n => match i64::try_from(count).ok().and_then(|all| all.checked_add(n)) {
            Some(v) if v >= 0 => Ok(v + 1),
            _ => Err(Failure {
                place,
                kind: ReadErrorKind::TextureOutOfRange { index: n, count },
            }),
        },
    }
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
        let ends = if rest.starts_with(b"\r\n") {
            2
        } else {
            usize::from(matches!(rest.first(), Some(b'\n' | b'\r')))
        };
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
