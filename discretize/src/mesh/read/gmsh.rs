//! Gmsh MSH: versions 1 (text), 2 and 4.1 (text and binary).

use super::text::{ByteOrder, Scalar, Text, Words, unexpected_number};
use super::{RawMesh, ReadError, TextPlace, out_of_range, point, unsupported};
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

/// Numbers of a file: words of a line for each node and element, or bytes.
struct NumberSource<'a> {
    text: Text<'a>,
    version: Version,
    /// What is left of the present line, where numbers are words.
    words: Words<'a>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut source = NumberSource {
        text: Text::new(bytes),
        version: Version::One,
        words: Words::default(),
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

impl NumberSource<'_> {
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
            let place = self.text.place();
            self.text.order = Some(ByteOrder::Little);
            self.text.order = Some(match self.int("the number 1")? {
                1 => ByteOrder::Little,
                0x0100_0000 => ByteOrder::Big,
                other => return Err(unexpected_number("the number 1", &other, place)),
            });
        }
        Ok(())
    }

    fn in_words(&self) -> bool {
        self.text.order.is_none()
    }

    fn place(&self) -> TextPlace {
        if self.in_words() {
            self.words.place()
        } else {
            self.text.place()
        }
    }

    /// Begins the line of a node, an element or a block of them, where numbers are words.
    fn record(&mut self, expected: &'static str) -> Result<(), ReadError> {
        if self.in_words() {
            self.words = self.text.full_line(expected)?;
        }
        Ok(())
    }

    fn whole(&mut self, kind: Scalar, expected: &'static str) -> Result<i64, ReadError> {
        if self.in_words() {
            self.words.integer(expected)
        } else {
            self.text.whole(kind, expected)
        }
    }

    /// A number of four bytes, or a word.
    fn int(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        self.whole(Scalar::I32, expected)
    }

    /// A count or number of eight bytes, or a word.
    fn long(&mut self, expected: &'static str) -> Result<i64, ReadError> {
        self.whole(Scalar::I64, expected)
    }

    /// A count of things of at least so many bytes each of what follows, as words and as bytes.
    fn checked(
        &self,
        value: i64,
        what: &'static str,
        [word, byte]: [usize; 2],
    ) -> Result<usize, ReadError> {
        let least = if self.in_words() { word } else { byte };
        self.text.checked(value, what, least, self.place())
    }

    fn point(&mut self, raw: &mut RawMesh) -> Result<(), ReadError> {
        let place = self.place();
        raw.vertices.push(if self.in_words() {
            self.words.point()?
        } else {
            let mut xyz = [0.0; 3];
            for x in &mut xyz {
                *x = self.text.number(Scalar::F64, "three coordinates")?;
            }
            point(xyz, place)?
        });
        Ok(())
    }

    fn nodes(&mut self, raw: &mut RawMesh, numbers: &mut Vec<(i64, u32)>) -> Result<(), ReadError> {
        if self.version == Version::Four {
            return self.node_blocks(raw, numbers);
        }
        let count = self.text.count("nodes", 8)?;
        if !self.in_words() {
            self.text.end_line();
        }
        for _ in 0..count {
            self.record("a node")?;
            numbers.push((self.int("a node number")?, index(raw.vertices.len())));
            self.point(raw)?;
        }
        Ok(())
    }

    /// Number of the blocks of version 4; words and bytes call them differently.
    fn blocks(
        &mut self,
        (word, least): (&'static str, usize),
        [byte, ends]: [&'static str; 2],
    ) -> Result<usize, ReadError> {
        if self.in_words() {
            let blocks = self.text.count(word, least)?;
            let _ = self.text.line();
            return Ok(blocks);
        }
        let blocks = self.long("a number of blocks")?;
        let blocks = self.checked(blocks, byte, [least, 20])?;
        for _ in 0..3 {
            self.long(ends)?;
        }
        Ok(blocks)
    }

    fn node_blocks(
        &mut self,
        raw: &mut RawMesh,
        numbers: &mut Vec<(i64, u32)>,
    ) -> Result<(), ReadError> {
        let ends = "the nodes' number, least and greatest";
        let blocks = self.blocks(("blocks of nodes", 2), ["blocks of nodes", ends])?;
        let head = if self.in_words() {
            ["dimension, entity and parametric flag"; 3]
        } else {
            ["a dimension", "an entity", "a parametric flag"]
        };
        for _ in 0..blocks {
            self.record("a block of nodes")?;
            let dimension = self.int(head[0])?;
            self.int(head[1])?;
            let parametric = self.int(head[2])? != 0;
            let size = self.long("a number of nodes")?;
            let size = self.checked(size, "nodes", [8, 32])?;
            for k in 0..size {
                self.record("a node number")?;
                let vertex = index(raw.vertices.len() + k);
                numbers.push((self.long("a node number")?, vertex));
            }
            for _ in 0..size {
                self.record("a node")?;
                self.point(raw)?;
                if parametric && !self.in_words() {
                    for _ in 0..dimension {
                        self.long("a parametric coordinate")?;
                    }
                }
            }
        }
        Ok(())
    }

    fn elements(&mut self, raw: &mut RawMesh, numbers: &[(i64, u32)]) -> Result<(), ReadError> {
        if self.version == Version::Four {
            let ends = "the elements' number, least and greatest";
            let blocks = self.blocks(("elements or blocks", 4), ["blocks of elements", ends])?;
            for _ in 0..blocks {
                self.record("a block of elements")?;
                self.int("a dimension")?;
                self.int("an entity")?;
                let kind = self.int("an element type")?;
                let size = self.long("a number of elements")?;
                let size = self.checked(size, "elements", [4, 8])?;
                for _ in 0..size {
                    self.record("an element")?;
                    self.long("an element number")?;
                    self.element(kind, raw, numbers)?;
                }
            }
            return Ok(());
        }
        if self.in_words() {
            return self.lines_of_elements(raw, numbers);
        }
        let mut left = self.text.count("elements", 4)?;
        self.text.end_line();
        while left > 0 {
            let kind = self.int("an element type")?;
            let size = self.int("a number of elements")?;
            let size = self.checked(size, "elements", [4; 2])?;
            let tags = self.int("a number of tags")?;
            let tags = self.checked(tags, "tags", [4; 2])?;
            if size == 0 || size > left {
                let place = self.place();
                return Err(unexpected_number("a number of elements", &size, place));
            }
            for _ in 0..size {
                for _ in 0..=tags {
                    self.int("an element number and tags")?;
                }
                self.element(kind, raw, numbers)?;
            }
            left -= size;
        }
        Ok(())
    }

    /// Elements of versions 1 and 2 as words.
    fn lines_of_elements(
        &mut self,
        raw: &mut RawMesh,
        numbers: &[(i64, u32)],
    ) -> Result<(), ReadError> {
        for _ in 0..self.text.count("elements or blocks", 4)? {
            self.record("an element")?;
            self.int("an element number")?;
            let kind = self.int("an element type")?;
            // Version 1: two regions and the number of nodes; version 2: a list of tags.
            let skip = match self.version {
                Version::One => 3,
                _ => self.int("a number of tags")?,
            };
            if !(0..1024).contains(&skip) {
                return Err(unexpected_number("a number of tags", &skip, self.place()));
            }
            for _ in 0..skip {
                self.int("a tag")?;
            }
            self.element(kind, raw, numbers)?;
        }
        Ok(())
    }

    /// Adds a triangle, quad or tetrahedron; other elements are skipped.
    fn element(
        &mut self,
        kind: i64,
        raw: &mut RawMesh,
        numbers: &[(i64, u32)],
    ) -> Result<(), ReadError> {
        let place = self.place();
        let is_read = matches!(kind, TRIANGLE | QUAD | TETRAHEDRON);
        raw.skipped |= !is_read && !WITHOUT_FACE.contains(&kind);
        if !is_read && self.in_words() {
            return Ok(());
        }
        let size = usize::try_from(kind - 1)
            .ok()
            .and_then(|k| NODES_OF.get(k).copied());
        let Some(size) = size else {
            let expected = "an element type from 1 to 19";
            return Err(unexpected_number(expected, &kind, place));
        };
        let mut nodes = [0; 27];
        for node in &mut nodes[..size] {
            *node = match self.version {
                Version::Four => self.long("a node number")?,
                _ => self.int("a node number")?,
            };
        }
        if !is_read {
            return Ok(());
        }
        let mut corners = [0; 4];
        for (corner, number) in corners.iter_mut().zip(&nodes[..size]) {
            *corner = numbers
                .binary_search_by(|(n, _)| n.cmp(number))
                .map(|found| numbers[found].1)
                .map_err(|_| out_of_range(*number, numbers.len(), place))?;
        }
        if kind == TETRAHEDRON {
            raw.tetrahedra.push(corners);
            return Ok(());
        }
        raw.polygon(&corners[..size], place)
    }
}
