//! Object File Format.

use super::text::{Text, Words, check_count, unexpected};
use super::{RawMesh, ReadError, unsupported, vertex_index};

/// Whether a word opens an OFF file, with its optional prefixes for colours, normals and texture.
pub(super) fn is_keyword(word: &[u8]) -> bool {
    word.strip_suffix(b"OFF")
        .is_some_and(|prefix| matches!(prefix, b"" | b"C" | b"N" | b"CN" | b"ST" | b"STC" | b"STN"))
}

/// Whether a line has the three counts that a file without the keyword begins with.
pub(super) fn is_counts(words: Words<'_>) -> bool {
    let mut counts = 0;
    for word in words.take_while(|word| !word.starts_with(b"#")) {
        if !word.iter().all(u8::is_ascii_digit) {
            return false;
        }
        counts += 1;
    }
    counts == 3
}

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut text = Text::new(bytes);
    let mut words = text.full_line("`OFF`")?;
    // The keyword is optional.
    let place = words.place();
    let mut first = words.clone();
    if first.next().is_some_and(is_keyword) {
        words = first;
    } else if !is_counts(words.clone()) {
        return Err(unexpected("`OFF`", words.next().unwrap_or_default(), place));
    }
    let mut counts = Vec::new();
    loop {
        let place = words.place();
        for word in words.by_ref().take_while(|w| !w.starts_with(b"#")) {
            if word.eq_ignore_ascii_case(b"BINARY") {
                return Err(unsupported("binary OFF files", "write OFF as text", place));
            }
            counts.push(super::text::integer(word, place, "a count")?);
        }
        if counts.len() >= 2 {
            break;
        }
        words = text.full_line("the counts of vertices and faces")?;
    }
    let vertices = text.checked(counts[0], "vertices", 6, text.place())?;
    let faces = text.checked(counts[1], "faces", 2, text.place())?;
    raw.vertices.reserve(vertices);
    for _ in 0..vertices {
        let mut words = text.full_line("a vertex")?;
        raw.vertices.push(words.point()?);
        numbers_only(words)?;
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        let mut words = text.full_line("a face")?;
        let place = words.place();
        let size = words.integer("the number of corners")?;
        let size = check_count(size, "corners", 1, text.rest().len() + bytes.len(), place)?;
        corners.clear();
        for _ in 0..size {
            let v = words.integer("a vertex number")?;
            corners.push(vertex_index(v, vertices, place)?);
        }
        numbers_only(words)?;
        raw.polygon(&corners, place)?;
    }
    text.end()?;
    Ok(raw)
}

/// Normals, colours and texture coordinates may follow on a line, and nothing else.
fn numbers_only(words: Words<'_>) -> Result<(), ReadError> {
    let place = words.place();
    for word in words.take_while(|word| !word.starts_with(b"#")) {
        super::text::float(word, place)?;
    }
    Ok(())
}
