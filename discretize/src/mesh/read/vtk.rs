//! VTK legacy files: polydata and unstructured grids, text and binary.

use super::text::{Scalar, Text, check_count, unexpected};
use super::{Failure, Raw, ReadErrorKind, TextPlace, point, vertex_index};

/// VTK's cell types.
const TRIANGLE: i64 = 5;
const STRIP: i64 = 6;
const POLYGON: i64 = 7;
const QUAD: i64 = 9;
const TETRAHEDRON: i64 = 10;

struct Reader<'a> {
    text: Text<'a>,
    binary: bool,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, Failure> {
    let mut text = Text::new(bytes);
    text.line();
    text.line();
    let mut words = text.full_line("ASCII or BINARY")?;
    let word = words.next().unwrap_or_default();
    let binary = match word {
        w if w.eq_ignore_ascii_case(b"ASCII") => false,
        w if w.eq_ignore_ascii_case(b"BINARY") => true,
        w => return Err(unexpected("ASCII or BINARY", w, words.place())),
    };
    let mut reader = Reader { text, binary };
    let mut raw = Raw::default();
    let mut cells: Vec<Vec<i64>> = Vec::new();
    let mut types: Vec<i64> = Vec::new();
    while let Some(mut words) = reader.text.line() {
        let place = words.place();
        let Some(word) = words.next() else { continue };
        let keyword = word.to_ascii_uppercase();
        match keyword.as_slice() {
            b"DATASET" => {
                let kind = words.next().unwrap_or_default();
                if !kind.eq_ignore_ascii_case(b"POLYDATA")
                    && !kind.eq_ignore_ascii_case(b"UNSTRUCTURED_GRID")
                {
                    return Err(unexpected("POLYDATA or UNSTRUCTURED_GRID", kind, place));
                }
            }
            b"POINTS" => {
                let count = words.integer("a number of points")?;
                let kind = words.next().unwrap_or_default();
                let count = reader.checked(count, "points", 3, place)?;
                raw.vertices.reserve(count);
                for _ in 0..count {
                    let at = reader.place();
                    let xyz = [
                        reader.float(kind)?,
                        reader.float(kind)?,
                        reader.float(kind)?,
                    ];
                    raw.vertices.push(point(xyz, at)?);
                }
            }
            b"POLYGONS" | b"TRIANGLE_STRIPS" | b"CELLS" | b"LINES" | b"VERTICES" => {
                let count = words.integer("a number of cells")?;
                let size = words.integer("a number of values")?;
                let lists = reader.lists(count, size, place)?;
                match keyword.as_slice() {
                    b"POLYGONS" => add(&mut raw, lists.iter().map(|l| (POLYGON, l)), place)?,
                    b"TRIANGLE_STRIPS" => add(&mut raw, lists.iter().map(|l| (STRIP, l)), place)?,
                    b"CELLS" => cells = lists,
                    _ => {}
                }
            }
            b"CELL_TYPES" => {
                let count = words.integer("a number of cells")?;
                let count = reader.checked(count, "cell types", 1, place)?;
                for _ in 0..count {
                    types.push(reader.integer(b"int")?);
                }
            }
            b"FIELD" => {
                words.next();
                let arrays = words.integer("a number of arrays")?;
                reader.skip_field(arrays, place)?;
            }
            b"METADATA" => while reader.text.line().is_some_and(|mut w| w.next().is_some()) {},
            b"POINT_DATA" | b"CELL_DATA" => break,
            _ => return Err(unexpected("a VTK section", word, place)),
        }
    }
    if cells.len() != types.len() {
        return Err(reader.text.truncated("a type for every cell"));
    }
    let place = TextPlace::File;
    add(&mut raw, types.into_iter().zip(&cells), place)?;
    Ok(raw)
}

/// Vertices and lines, with their quadratic ones.
const WITHOUT_FACE: [i64; 5] = [1, 2, 3, 4, 21];

/// Adds cells of the known kinds; others are skipped, and noted where they have faces.
pub(super) fn add<'a>(
    raw: &mut Raw,
    cells: impl Iterator<Item = (i64, &'a Vec<i64>)>,
    place: TextPlace,
) -> Result<(), Failure> {
    let count = raw.vertices.len();
    let mut corners = Vec::new();
    for (kind, list) in cells {
        if !matches!(kind, TRIANGLE | STRIP | POLYGON | QUAD | TETRAHEDRON) {
            raw.skipped |= !WITHOUT_FACE.contains(&kind);
            continue;
        }
        corners.clear();
        for &v in list {
            corners.push(vertex_index(v, count, place)?);
        }
        match (kind, corners.as_slice()) {
            (TETRAHEDRON, &[a, b, c, d]) => raw.tetrahedra.push([a, b, c, d]),
            (TETRAHEDRON, _) => {
                let shown = corners.len().to_string();
                return Err(unexpected(
                    "four corners of a tetrahedron",
                    shown.as_bytes(),
                    place,
                ));
            }
            (STRIP, strip) => {
                for (k, t) in strip.windows(3).enumerate() {
                    let turned = if k % 2 == 0 {
                        [t[0], t[1], t[2]]
                    } else {
                        [t[1], t[0], t[2]]
                    };
                    raw.triangles.push(turned);
                }
            }
            (_, polygon) => raw.polygon(polygon, place)?,
        }
    }
    Ok(())
}

fn scalar(kind: &[u8]) -> Option<Scalar> {
    Some(match kind.to_ascii_lowercase().as_slice() {
        b"char" => Scalar::I8,
        b"unsigned_char" => Scalar::U8,
        b"short" => Scalar::I16,
        b"unsigned_short" => Scalar::U16,
        b"int" => Scalar::I32,
        b"unsigned_int" => Scalar::U32,
        b"long" | b"vtktypeint64" | b"vtkidtype" => Scalar::I64,
        b"unsigned_long" => Scalar::U64,
        b"float" => Scalar::F32,
        b"double" => Scalar::F64,
        _ => return None,
    })
}

impl Reader<'_> {
    fn place(&self) -> TextPlace {
        if self.binary {
            TextPlace::Byte(self.text.offset())
        } else {
            self.text.place()
        }
    }

    /// A count of groups of `values` values that the rest of the file can hold.
    fn checked(
        &self,
        count: i64,
        what: &'static str,
        values: usize,
        place: TextPlace,
    ) -> Result<usize, Failure> {
        let least = if self.binary { values } else { 2 * values };
        check_count(count, what, least, self.text.rest().len(), place)
    }

    fn scalar(&self, kind: &[u8]) -> Result<Scalar, Failure> {
        scalar(kind).ok_or_else(|| unexpected("a VTK type", kind, self.place()))
    }

    fn float(&mut self, kind: &[u8]) -> Result<f64, Failure> {
        if !self.binary {
            return self.text.float("a number");
        }
        let scalar = self.scalar(kind)?;
        if !scalar.is_float() {
            return Err(unexpected("float or double", kind, self.place()));
        }
        self.text.scalar(scalar, true, "a value")
    }

    fn integer(&mut self, kind: &[u8]) -> Result<i64, Failure> {
        if !self.binary {
            return self.text.integer("an integer");
        }
        let scalar = self.scalar(kind)?;
        self.text.whole(scalar, true, "a value")
    }

    /// Index lists: counts and indices in one array, or offsets and connectivity (from version 5).
    fn lists(&mut self, count: i64, size: i64, place: TextPlace) -> Result<Vec<Vec<i64>>, Failure> {
        if self.text.rest().trim_ascii_start().starts_with(b"OFFSETS") {
            return self.offset_lists(count, size, place);
        }
        let count = self.checked(count, "cells", 1, place)?;
        let size = self.checked(size, "cell values", 1, place)?;
        let mut lists = Vec::with_capacity(count);
        for _ in 0..count {
            let length = self.integer(b"int")?;
            let length = self.checked(length, "corners", 1, self.place())?;
            let mut list = Vec::with_capacity(length);
            for _ in 0..length {
                list.push(self.integer(b"int")?);
            }
            lists.push(list);
        }
        let found: usize = lists.iter().map(|list| list.len() + 1).sum();
        if found != size {
            let expected = "as many values as the cells' own counts say";
            return Err(unexpected(expected, size.to_string().as_bytes(), place));
        }
        Ok(lists)
    }

    fn offset_lists(
        &mut self,
        count: i64,
        size: i64,
        place: TextPlace,
    ) -> Result<Vec<Vec<i64>>, Failure> {
        let array = |reader: &mut Self, n: i64, what: &'static str| -> Result<Vec<i64>, Failure> {
            let mut words = reader.text.full_line(what)?;
            words.next();
            let kind = words.next().unwrap_or_default();
            let n = reader.checked(n, what, 1, place)?;
            (0..n).map(|_| reader.integer(kind)).collect()
        };
        let offsets = array(self, count, "OFFSETS")?;
        if self.binary {
            // The newline after a binary block.
            let rest = self.text.rest();
            self.text.skip(rest.len() - rest.trim_ascii_start().len());
        }
        let values = array(self, size, "CONNECTIVITY")?;
        let mut lists = Vec::with_capacity(offsets.len());
        for pair in offsets.windows(2) {
            let range = usize::try_from(pair[0])
                .ok()
                .zip(usize::try_from(pair[1]).ok());
            let list = range.and_then(|(a, b)| values.get(a..b)).ok_or(Failure {
                place,
                kind: ReadErrorKind::IndexOutOfRange {
                    index: pair[1],
                    count: values.len(),
                },
            })?;
            lists.push(list.to_vec());
        }
        Ok(lists)
    }

    /// Skips the arrays of a FIELD.
    fn skip_field(&mut self, arrays: i64, place: TextPlace) -> Result<(), Failure> {
        let arrays = self.checked(arrays, "arrays", 1, place)?;
        for _ in 0..arrays {
            let mut words = self.text.full_line("an array")?;
            words.next();
            let components = words.integer("a number of components")?;
            let tuples = words.integer("a number of tuples")?;
            let kind = words.next().unwrap_or_default();
            let values = components.saturating_mul(tuples);
            let values = self.checked(values, "values", 1, words.place())?;
            if self.binary {
                let size = scalar(kind)
                    .ok_or_else(|| unexpected("a VTK type", kind, words.place()))?
                    .size();
                self.text.skip(values.saturating_mul(size));
            } else {
                for _ in 0..values {
                    self.text.need("a value")?;
                }
            }
        }
        Ok(())
    }
}
