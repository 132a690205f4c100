//! Gmsh MSH as text: versions 1, 2 and 4.1.

use super::text::{Text, Words, unexpected};
use super::{Failure, Place, Raw, ReadErrorKind, point};
use crate::mesh::index;

/// Gmsh's element types.
const TRIANGLE: i64 = 2;
const QUAD: i64 = 3;
const TETRAHEDRON: i64 = 4;

#[derive(Clone, Copy, PartialEq)]
enum Version {
    One,
    Two,
    Four,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, Failure> {
    let mut raw = Raw::default();
    let mut text = Text::new(bytes);
    let mut version = Version::One;
    // Node numbers are sparse: (number, index), sorted once all are read.
    let mut numbers: Vec<(i64, u32)> = Vec::new();
    while let Some(mut words) = text.line() {
        match words.next() {
            Some(b"$MeshFormat") => version = header(&mut text)?,
            Some(b"$NOD" | b"$Nodes") => {
                nodes(&mut text, version, &mut raw, &mut numbers)?;
                numbers.sort_unstable();
            }
            Some(b"$ELM" | b"$Elements") => elements(&mut text, version, &mut raw, &numbers)?,
            _ => {}
        }
    }
    Ok(raw)
}

fn header(text: &mut Text<'_>) -> Result<Version, Failure> {
    let mut words = text.full_line("the version")?;
    let place = words.place();
    let version = words.float("the version")?;
    let binary = words.integer("0 for text")? != 0;
    if binary {
        return Err(Failure {
            place,
            kind: ReadErrorKind::Unsupported {
                what: "binary MSH files",
                fix: "save with `gmsh -save -bin 0` or as version 2 text",
            },
        });
    }
    if (2.0..3.0).contains(&version) {
        Ok(Version::Two)
    } else if (4.1..5.0).contains(&version) {
        Ok(Version::Four)
    } else {
        Err(Failure {
            place,
            kind: ReadErrorKind::Unsupported {
                what: "MSH versions other than 1, 2 and 4.1",
                fix: "save as version 2.2 or 4.1",
            },
        })
    }
}

fn coordinates(words: &mut Words<'_>) -> Result<glam::DVec3, Failure> {
    let mut xyz = [0.0; 3];
    for x in &mut xyz {
        *x = words.float("three coordinates")?;
    }
    point(xyz, words.place())
}

fn nodes(
    text: &mut Text<'_>,
    version: Version,
    raw: &mut Raw,
    numbers: &mut Vec<(i64, u32)>,
) -> Result<(), Failure> {
    if version != Version::Four {
        let count = text.count("nodes", 8)?;
        for _ in 0..count {
            let mut words = text.full_line("a node")?;
            let number = words.integer("a node number")?;
            numbers.push((number, index(raw.vertices.len())));
            raw.vertices.push(coordinates(&mut words)?);
        }
        return Ok(());
    }
    let blocks = text.count("blocks of nodes", 2)?;
    let _ = text.line();
    for _ in 0..blocks {
        let mut words = text.full_line("a block of nodes")?;
        for _ in 0..3 {
            words.integer("dimension, entity and parametric flag")?;
        }
        let size = words.integer("a number of nodes")?;
        let size = super::text::check_count(size, "nodes", 8, text.rest().len(), words.place())?;
        let first = numbers.len();
        for _ in 0..size {
            let mut words = text.full_line("a node number")?;
            numbers.push((words.integer("a node number")?, 0));
        }
        for number in &mut numbers[first..] {
            let mut words = text.full_line("a node")?;
            number.1 = index(raw.vertices.len());
            raw.vertices.push(coordinates(&mut words)?);
        }
    }
    Ok(())
}

fn elements(
    text: &mut Text<'_>,
    version: Version,
    raw: &mut Raw,
    numbers: &[(i64, u32)],
) -> Result<(), Failure> {
    let count = text.count("elements or blocks", 4)?;
    if version == Version::Four {
        let _ = text.line();
        for _ in 0..count {
            let mut words = text.full_line("a block of elements")?;
            words.integer("a dimension")?;
            words.integer("an entity")?;
            let kind = words.integer("an element type")?;
            let size = words.integer("a number of elements")?;
            let size =
                super::text::check_count(size, "elements", 4, text.rest().len(), words.place())?;
            for _ in 0..size {
                let mut words = text.full_line("an element")?;
                words.integer("an element number")?;
                element(kind, &mut words, raw, numbers)?;
            }
        }
        return Ok(());
    }
    for _ in 0..count {
        let mut words = text.full_line("an element")?;
        words.integer("an element number")?;
        let kind = words.integer("an element type")?;
        // Version 1: two regions and the number of nodes; version 2: a list of tags.
        let skip = if version == Version::One {
            3
        } else {
            words.integer("a number of tags")?
        };
        if !(0..1024).contains(&skip) {
            let shown = skip.to_string();
            return Err(unexpected(
                "a number of tags",
                shown.as_bytes(),
                words.place(),
            ));
        }
        for _ in 0..skip {
            words.integer("a tag")?;
        }
        element(kind, &mut words, raw, numbers)?;
    }
    Ok(())
}

fn element(
    kind: i64,
    words: &mut Words<'_>,
    raw: &mut Raw,
    numbers: &[(i64, u32)],
) -> Result<(), Failure> {
    let size = match kind {
        TRIANGLE => 3,
        QUAD | TETRAHEDRON => 4,
        _ => return Ok(()),
    };
    let mut corners = [0; 4];
    for corner in &mut corners[..size] {
        let number = words.integer("a node number")?;
        *corner = lookup(numbers, number, words.place())?;
    }
    if kind == TETRAHEDRON {
        raw.tetrahedra.push(corners);
    } else {
        raw.polygon(&corners[..size]);
    }
    Ok(())
}

fn lookup(numbers: &[(i64, u32)], number: i64, place: Place) -> Result<u32, Failure> {
    numbers
        .binary_search_by(|(n, _)| n.cmp(&number))
        .map(|found| numbers[found].1)
        .map_err(|_| Failure {
            place,
            kind: ReadErrorKind::IndexOutOfRange {
                index: number,
                count: numbers.len(),
            },
        })
}
