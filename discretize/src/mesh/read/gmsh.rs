//! Gmsh MSH: versions 1 (text), 2 and 4.1 (text and binary).

use super::text::{Order, Scalar, Text, Words, unexpected_number};
use super::{Raw, ReadError, TextPlace, out_of_range, point, unsupported};
use crate::mesh::index;

/// Gmsh's element types.
const TRIANGLE: i64 = 2;
const QUAD: i64 = 3;
const TETRAHEDRON: i64 = 4;
/// Points and lines.
const WITHOUT_FACE: [i64; 3] = [1, 8, 15];
/// Nodes of the element types from 1 on (Gmsh reference manual, section "MSH file format").
const NODES_OF: [usize; 19] = [
    2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13,
];

#[derive(Clone, Copy, PartialEq)]
enum Version {
    One,
    Two,
    Four,
}

/// Numbers of a file, from words or bytes.
struct Source<'a> {
    text: Text<'a>,
    version: Version,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, ReadError> {
    let mut raw = Raw::default();
    let mut source = Source {
        text: Text::new(bytes),
        version: Version::One,
    };
    // Node numbers are sparse: (number, index), sorted once all are read.
    let mut numbers: Vec<(i64, u32)> = Vec::new();
    while let Some(mut words) = source.text.line() {
        match words.next() {
            Some(b"$MeshFormat") => source.header()?,
            Some(b"$NOD" | b"$Nodes") => {
                source.nodes(&mut raw, &mut numbers)?;
                numbers.sort_unstable();
            }
            Some(b"$ELM" | b"$Elements") => source.elements(&mut raw, &numbers)?,
            _ => {}
        }
    }
    Ok(raw)
}

impl Source<'_> {
    fn header(&mut self) -> Result<(), ReadError> {
        let mut words = self.text.full_line("the version")?;
        let place = words.place();
        let version = words.float("the version")?;
        let binary = words.integer("0 for text, 1 for binary")? != 0;
        let size = words.integer("the size of a float")?;
        self.version = if (2.0..3.0).contains(&version) {
            Version::Two
        } else if (4.1..5.0).contains(&version) {
            Version::Four
        } else {
            let what = "MSH versions other than 1, 2 and 4.1";
            return Err(unsupported(what, "save as version 2.2 or 4.1", place));
        };
        if binary {
            if size != 8 {
                let what = "binary MSH files with floats or indices of other than 8 bytes";
                return Err(unsupported(what, "save with 8 bytes or as text", place));
            }
            let place = self.place();
            self.text.order = self.text.order.or(Some(Order::Little));
            self.text.order = Some(match self.int("the number 1")? {
                1 => Order::Little,
                0x0100_0000 => Order::Big,
                other => return Err(unexpected_number("the number 1", &other, place)),
            });
        }
        Ok(())
    }

    fn place(&self) -> TextPlace {
        self.text.place()
    }

    /// A four-byte integer.
    fn int(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        self.text.whole(Scalar::I32, expected)
    }

    /// An eight-byte count or number.
    fn long(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        self.text.whole(Scalar::I64, expected)
    }

    /// A count of things of at least `least` bytes each of what follows.
    fn checked(&self, value: i64, what: &'static str, least: usize) -> Result<usize, ReadError> {
        self.text.checked(value, what, least, self.place())
    }

    fn binary_point(&mut self, raw: &mut Raw) -> Result<(), ReadError> {
        let place = self.place();
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            *x = self.text.number(Scalar::F64, "three coordinates")?;
        }
        raw.vertices.push(point(xyz, place)?);
        Ok(())
    }

    fn nodes(&mut self, raw: &mut Raw, numbers: &mut Vec<(i64, u32)>) -> Result<(), ReadError> {
        match (self.version, self.text.order) {
            (Version::Four, None) => self.text_blocks(raw, numbers),
            (Version::Four, Some(_)) => self.binary_blocks(raw, numbers),
            (_, binary) => {
                let count = self.text.count("nodes", 8)?;
                if binary.is_some() {
                    self.text.end_line();
                }
                for _ in 0..count {
                    let vertex = index(raw.vertices.len());
                    if binary.is_some() {
                        numbers.push((self.int("a node number")?, vertex));
                        self.binary_point(raw)?;
                    } else {
                        let mut words = self.text.full_line("a node")?;
                        numbers.push((words.integer("a node number")?, vertex));
                        raw.vertices.push(words.point()?);
                    }
                }
                Ok(())
            }
        }
    }

    fn text_blocks(
        &mut self,
        raw: &mut Raw,
        numbers: &mut Vec<(i64, u32)>,
    ) -> Result<(), ReadError> {
        let blocks = self.text.count("blocks of nodes", 2)?;
        let _ = self.text.line();
        for _ in 0..blocks {
            let mut words = self.text.full_line("a block of nodes")?;
            for _ in 0..3 {
                words.integer("dimension, entity and parametric flag")?;
            }
            let size = words.integer("a number of nodes")?;
            let size = self.text.checked(size, "nodes", 8, words.place())?;
            let first = numbers.len();
            for _ in 0..size {
                let mut words = self.text.full_line("a node number")?;
                numbers.push((words.integer("a node number")?, 0));
            }
            for number in &mut numbers[first..] {
                let mut words = self.text.full_line("a node")?;
                number.1 = index(raw.vertices.len());
                raw.vertices.push(words.point()?);
            }
        }
        Ok(())
    }

    fn binary_blocks(
        &mut self,
        raw: &mut Raw,
        numbers: &mut Vec<(i64, u32)>,
    ) -> Result<(), ReadError> {
        let blocks = self.long("a number of blocks")?;
        let blocks = self.checked(blocks, "blocks of nodes", 20)?;
        for _ in 0..3 {
            self.long("the nodes' number, least and greatest")?;
        }
        for _ in 0..blocks {
            let dimension = self.int("a dimension")?;
            self.int("an entity")?;
            let parametric = self.int("a parametric flag")? != 0;
            let size = self.long("a number of nodes")?;
            let size = self.checked(size, "nodes", 32)?;
            let first = numbers.len();
            for k in 0..size {
                let vertex = index(raw.vertices.len() + k);
                numbers.push((self.long("a node number")?, vertex));
            }
            for _ in first..numbers.len() {
                self.binary_point(raw)?;
                if parametric {
                    for _ in 0..dimension {
                        self.long("a parametric coordinate")?;
                    }
                }
            }
        }
        Ok(())
    }

    fn elements(&mut self, raw: &mut Raw, numbers: &[(i64, u32)]) -> Result<(), ReadError> {
        match (self.version, self.text.order) {
            (Version::Four, Some(_)) => {
                let blocks = self.long("a number of blocks")?;
                let blocks = self.checked(blocks, "blocks of elements", 20)?;
                for _ in 0..3 {
                    self.long("the elements' number, least and greatest")?;
                }
                for _ in 0..blocks {
                    self.int("a dimension")?;
                    self.int("an entity")?;
                    let kind = self.int("an element type")?;
                    let size = self.long("a number of elements")?;
                    let size = self.checked(size, "elements", 8)?;
                    for _ in 0..size {
                        self.long("an element number")?;
                        self.binary_element(kind, raw, numbers)?;
                    }
                }
                Ok(())
            }
            (_, Some(_)) => {
                let mut left = self.text.count("elements", 4)?;
                self.text.end_line();
                while left > 0 {
                    let kind = self.int("an element type")?;
                    let size = self.int("a number of elements")?;
                    let size = self.checked(size, "elements", 4)?;
                    let tags = self.int("a number of tags")?;
                    let tags = self.checked(tags, "tags", 4)?;
                    if size == 0 || size > left {
                        let place = self.place();
                        return Err(unexpected_number("a number of elements", &size, place));
                    }
                    for _ in 0..size {
                        for _ in 0..=tags {
                            self.int("an element number and tags")?;
                        }
                        self.binary_element(kind, raw, numbers)?;
                    }
                    left -= size;
                }
                Ok(())
            }
            (_, None) => self.text_elements(raw, numbers),
        }
    }

    fn binary_element(
        &mut self,
        kind: i64,
        raw: &mut Raw,
        numbers: &[(i64, u32)],
    ) -> Result<(), ReadError> {
        let place = self.place();
        let size = usize::try_from(kind - 1)
            .ok()
            .and_then(|k| NODES_OF.get(k).copied());
        let Some(size) = size else {
            let expected = "an element type from 1 to 19";
            return Err(unexpected_number(expected, &kind, place));
        };
        let mut corners = [0; 27];
        for corner in &mut corners[..size] {
            *corner = match self.version {
                Version::Four => self.long("a node number")?,
                _ => self.int("a node number")?,
            };
        }
        element(kind, &corners[..size], place, raw, numbers)
    }

    fn text_elements(&mut self, raw: &mut Raw, numbers: &[(i64, u32)]) -> Result<(), ReadError> {
        let count = self.text.count("elements or blocks", 4)?;
        if self.version == Version::Four {
            let _ = self.text.line();
            for _ in 0..count {
                let mut words = self.text.full_line("a block of elements")?;
                words.integer("a dimension")?;
                words.integer("an entity")?;
                let kind = words.integer("an element type")?;
                let size = words.integer("a number of elements")?;
                let size = self.text.checked(size, "elements", 4, words.place())?;
                for _ in 0..size {
                    let mut words = self.text.full_line("an element")?;
                    words.integer("an element number")?;
                    text_element(kind, &mut words, raw, numbers)?;
                }
            }
            return Ok(());
        }
        for _ in 0..count {
            let mut words = self.text.full_line("an element")?;
            words.integer("an element number")?;
            let kind = words.integer("an element type")?;
            // Version 1: two regions and the number of nodes; version 2: a list of tags.
            let skip = match self.version {
                Version::One => 3,
                _ => words.integer("a number of tags")?,
            };
            if !(0..1024).contains(&skip) {
                let place = words.place();
                return Err(unexpected_number("a number of tags", &skip, place));
            }
            for _ in 0..skip {
                words.integer("a tag")?;
            }
            text_element(kind, &mut words, raw, numbers)?;
        }
        Ok(())
    }
}

fn text_element(
    kind: i64,
    words: &mut Words<'_>,
    raw: &mut Raw,
    numbers: &[(i64, u32)],
) -> Result<(), ReadError> {
    let size = match kind {
        TRIANGLE => 3,
        QUAD | TETRAHEDRON => 4,
        _ => {
            raw.skipped |= !WITHOUT_FACE.contains(&kind);
            return Ok(());
        }
    };
    let mut corners = [0; 4];
    for corner in &mut corners[..size] {
        *corner = words.integer("a node number")?;
    }
    element(kind, &corners[..size], words.place(), raw, numbers)
}

/// Adds a triangle, quad or tetrahedron; other elements are skipped.
fn element(
    kind: i64,
    nodes: &[i64],
    place: TextPlace,
    raw: &mut Raw,
    numbers: &[(i64, u32)],
) -> Result<(), ReadError> {
    if !matches!(kind, TRIANGLE | QUAD | TETRAHEDRON) {
        raw.skipped |= !WITHOUT_FACE.contains(&kind);
        return Ok(());
    }
    let mut corners = [0; 4];
    for (corner, number) in corners.iter_mut().zip(nodes) {
        *corner = numbers
            .binary_search_by(|(n, _)| n.cmp(number))
            .map(|found| numbers[found].1)
            .map_err(|_| out_of_range(*number, numbers.len(), place))?;
    }
    if kind == TETRAHEDRON {
        raw.tetrahedra.push(corners);
        return Ok(());
    }
    raw.polygon(&corners[..nodes.len()], place)
}
