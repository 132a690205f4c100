//! Gmsh MSH as text: versions 1, 2 and 4.1.

use super::text::{Text, Words, unexpected_number};
use super::{RawMesh, ReadError, out_of_range, unsupported};
use crate::mesh::index;

/// Gmsh's element types.
const TRIANGLE: i64 = 2;
const QUAD: i64 = 3;
const TETRAHEDRON: i64 = 4;
/// Points and lines.
const WITHOUT_FACE: [i64; 3] = [1, 8, 15];

#[derive(Clone, Copy, PartialEq)]
enum Version {
    One,
    Two,
    Four,
}

/// Node numbers, which are sparse, with their vertices: sorted once all are read.
type Numbers = Vec<(i64, u32)>;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut text = Text::new(bytes);
    let mut version = Version::One;
    let mut numbers = Numbers::new();
    while let Some(mut words) = text.line() {
        match words.next() {
            Some(b"$MeshFormat") => version = header(&mut text)?,
            Some(b"$NOD" | b"$Nodes") => {
                if version == Version::Four {
                    node_blocks(&mut text, &mut raw, &mut numbers)?;
                } else {
                    nodes(&mut text, &mut raw, &mut numbers)?;
                }
                numbers.sort_unstable();
            }
            Some(b"$ELM" | b"$Elements") => match version {
                Version::Four => element_blocks(&mut text, &mut raw, &numbers)?,
                _ => elements(&mut text, version, &mut raw, &numbers)?,
            },
            _ => {}
        }
    }
    Ok(raw)
}

fn header(text: &mut Text<'_>) -> Result<Version, ReadError> {
    let mut words = text.full_line("the version")?;
    let place = words.place();
    let version = words.float("the version")?;
    if words.integer("0 for text, 1 for binary")? != 0 {
        return Err(unsupported("binary MSH files", "save as text", place));
    }
    match version {
        2.0..3.0 => Ok(Version::Two),
        4.1..5.0 => Ok(Version::Four),
        _ => {
            let what = "MSH versions other than 1, 2 and 4.1";
            Err(unsupported(what, "save as version 2.2 or 4.1", place))
        }
    }
}

fn nodes(text: &mut Text<'_>, raw: &mut RawMesh, numbers: &mut Numbers) -> Result<(), ReadError> {
    for _ in 0..text.count("nodes", 8)? {
        let mut words = text.full_line("a node")?;
        let number = words.integer("a node number")?;
        numbers.push((number, index(raw.vertices.len())));
        raw.vertices.push(words.point()?);
    }
    Ok(())
}

/// Number of the blocks of version 4, each of `least` bytes and more; the rest of their line is skipped.
fn blocks(text: &mut Text<'_>, what: &'static str, least: usize) -> Result<usize, ReadError> {
    let blocks = text.count(what, least)?;
    let _ = text.line();
    Ok(blocks)
}

fn node_blocks(
    text: &mut Text<'_>,
    raw: &mut RawMesh,
    numbers: &mut Numbers,
) -> Result<(), ReadError> {
    for _ in 0..blocks(text, "blocks of nodes", 2)? {
        let mut words = text.full_line("a block of nodes")?;
        for _ in 0..3 {
            words.integer("dimension, entity and parametric flag")?;
        }
        let size = words.integer("a number of nodes")?;
        let size = text.checked(size, "nodes", 8, words.place())?;
        for k in 0..size {
            let number = text.full_line("a node number")?.integer("a node number")?;
            numbers.push((number, index(raw.vertices.len() + k)));
        }
        for _ in 0..size {
            raw.vertices.push(text.full_line("a node")?.point()?);
        }
    }
    Ok(())
}

fn element_blocks(
    text: &mut Text<'_>,
    raw: &mut RawMesh,
    numbers: &Numbers,
) -> Result<(), ReadError> {
    for _ in 0..blocks(text, "elements or blocks", 4)? {
        let mut words = text.full_line("a block of elements")?;
        words.integer("a dimension")?;
        words.integer("an entity")?;
        let kind = words.integer("an element type")?;
        let size = words.integer("a number of elements")?;
        for _ in 0..text.checked(size, "elements", 4, words.place())? {
            let mut words = text.full_line("an element")?;
            words.integer("an element number")?;
            element(words, kind, raw, numbers)?;
        }
    }
    Ok(())
}

/// Elements of versions 1 and 2.
fn elements(
    text: &mut Text<'_>,
    version: Version,
    raw: &mut RawMesh,
    numbers: &Numbers,
) -> Result<(), ReadError> {
    for _ in 0..text.count("elements or blocks", 4)? {
        let mut words = text.full_line("an element")?;
        words.integer("an element number")?;
        let kind = words.integer("an element type")?;
        // Version 1: two regions and the number of nodes; version 2: a list of tags.
        let skip = match version {
            Version::One => 3,
            _ => words.integer("a number of tags")?,
        };
        if !(0..1024).contains(&skip) {
            return Err(unexpected_number("a number of tags", &skip, words.place()));
        }
        for _ in 0..skip {
            words.integer("a tag")?;
        }
        element(words, kind, raw, numbers)?;
    }
    Ok(())
}

/// Adds a triangle, quad or tetrahedron, whose nodes are the next of the words; other elements are skipped.
fn element(
    mut words: Words<'_>,
    kind: i64,
    raw: &mut RawMesh,
    numbers: &Numbers,
) -> Result<(), ReadError> {
    let size = match kind {
        TRIANGLE => 3,
        QUAD | TETRAHEDRON => 4,
        _ => {
            raw.skipped |= !WITHOUT_FACE.contains(&kind);
            return Ok(());
        }
    };
    let place = words.place();
    let mut corners = [0; 4];
    for corner in &mut corners[..size] {
        let number = words.integer("a node number")?;
        *corner = numbers
            .binary_search_by(|(n, _)| n.cmp(&number))
            .map(|found| numbers[found].1)
            .map_err(|_| out_of_range(number, numbers.len(), place))?;
    }
    if kind == TETRAHEDRON {
        raw.tetrahedra.push(corners);
        return Ok(());
    }
    raw.polygon(&corners[..size], place)
}
