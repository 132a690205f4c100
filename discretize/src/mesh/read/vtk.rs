//! VTK legacy files: polydata and unstructured grids, text and binary.

use super::text::{ByteOrder, Scalar, Text, Words, unexpected, unexpected_number};
use super::{RawMesh, ReadError, TextPlace, out_of_range, point, vertex_index};

/// VTK's cell types.
const TRIANGLE: i64 = 5;
pub(super) const STRIP: i64 = 6;
pub(super) const POLYGON: i64 = 7;
const QUAD: i64 = 9;
const TETRAHEDRON: i64 = 10;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut text = Text::new(bytes);
    text.line();
    text.line();
    let mut words = text.full_line("ASCII or BINARY")?;
    let word = words.next().unwrap_or_default();
    text.order = match word {
        w if w.eq_ignore_ascii_case(b"ASCII") => None,
        w if w.eq_ignore_ascii_case(b"BINARY") => Some(ByteOrder::Big),
        w => return Err(unexpected("ASCII or BINARY", w, words.place())),
    };
    let mut raw = RawMesh::default();
    let mut cells: Vec<Vec<i64>> = Vec::new();
    let mut types: Vec<i64> = Vec::new();
    while let Some(mut words) = text.line() {
        let place = words.place();
        let Some(word) = words.next() else { continue };
        let keyword = word.to_ascii_uppercase();
        match keyword.as_slice() {
            b"DATASET" => {
                let kind = words.next().unwrap_or_default();
                let known: [&[u8]; 2] = [b"POLYDATA", b"UNSTRUCTURED_GRID"];
                if !known.iter().any(|k| kind.eq_ignore_ascii_case(k)) {
                    return Err(unexpected("POLYDATA or UNSTRUCTURED_GRID", kind, place));
                }
            }
            b"POINTS" => points(&mut text, words, &mut raw)?,
            b"POLYGONS" | b"TRIANGLE_STRIPS" | b"CELLS" | b"LINES" | b"VERTICES" => {
                let count = words.integer("a number of cells")?;
                let size = words.integer("a number of values")?;
                let lists = lists(&mut text, count, size, place)?;
                match keyword.as_slice() {
                    b"POLYGONS" => add(&mut raw, lists.iter().map(|l| (POLYGON, l)), place)?,
                    b"TRIANGLE_STRIPS" => add(&mut raw, lists.iter().map(|l| (STRIP, l)), place)?,
                    b"CELLS" => cells = lists,
                    _ => {}
                }
            }
            b"CELL_TYPES" => {
                let count = words.integer("a number of cells")?;
                let count = checked(&text, count, "cell types", 1, place)?;
                for _ in 0..count {
                    types.push(integer(&mut text, Scalar::I32)?);
                }
            }
            b"FIELD" => {
                words.next();
                skip_field(&mut text, words.integer("a number of arrays")?, place)?;
            }
            b"METADATA" => while text.line().is_some_and(|mut w| w.next().is_some()) {},
            b"POINT_DATA" | b"CELL_DATA" => break,
            _ => return Err(unexpected("a VTK section", word, place)),
        }
    }
    if cells.len() != types.len() {
        return Err(text.truncated("a type for every cell"));
    }
    add(&mut raw, types.into_iter().zip(&cells), TextPlace::File)?;
    Ok(raw)
}

fn points(text: &mut Text<'_>, mut words: Words<'_>, raw: &mut RawMesh) -> Result<(), ReadError> {
    let place = words.place();
    let count = words.integer("a number of points")?;
    let name = words.next().unwrap_or_default();
    let count = checked(text, count, "points", 3, place)?;
    let kind = kind_of(text, name, count)?;
    if !kind.is_float() {
        return Err(unexpected("float or double", name, text.place()));
    }
    raw.vertices.reserve(count);
    let expected = text.order.map_or("a number", |_| "a value");
    for _ in 0..count {
        let at = text.place();
        let mut xyz = [0.0; 3];
        for x in &mut xyz {
            *x = text.number(kind, expected)?;
        }
        raw.vertices.push(point(xyz, at)?);
    }
    Ok(())
}

/// Vertices and lines, with their quadratic ones.
const WITHOUT_FACE: [i64; 5] = [1, 2, 3, 4, 21];

/// Adds cells of the known kinds; others are skipped, and noted where they have faces.
pub(super) fn add<'a>(
    raw: &mut RawMesh,
    cells: impl Iterator<Item = (i64, &'a Vec<i64>)>,
    place: TextPlace,
) -> Result<(), ReadError> {
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
                let expected = "four corners of a tetrahedron";
                return Err(unexpected_number(expected, &corners.len(), place));
            }
            (STRIP, strip) => {
                for (k, t) in strip.windows(3).enumerate() {
                    // Every other one is turned.
                    let (a, b) = (k % 2, 1 - k % 2);
                    raw.triangles.push([t[a], t[b], t[2]]);
                }
            }
            (_, polygon) => raw.polygon(polygon, place)?,
        }
    }
    Ok(())
}

fn scalar(kind: &[u8], place: TextPlace) -> Result<Scalar, ReadError> {
    const NAMES: &str = "char|unsigned_char|short|unsigned_short|int|unsigned_int|\
                         long vtktypeint64 vtkidtype|unsigned_long|float|double";
    let known = Scalar::named(&kind.to_ascii_lowercase(), NAMES);
    known.ok_or_else(|| unexpected("a VTK type", kind, place))
}

/// A count of groups of `values` values that the rest of the file can hold.
fn checked(
    text: &Text<'_>,
    count: i64,
    what: &'static str,
    values: usize,
    place: TextPlace,
) -> Result<usize, ReadError> {
    let least = if text.order.is_some() { 1 } else { 2 };
    text.checked(count, what, least * values, place)
}

/// The type by its name of so many binary numbers that follow; any where there are none.
fn kind_of(text: &Text<'_>, name: &[u8], count: usize) -> Result<Scalar, ReadError> {
    if text.order.is_some() && count > 0 {
        scalar(name, text.place())
    } else {
        Ok(Scalar::F64)
    }
}

fn integer(text: &mut Text<'_>, kind: Scalar) -> Result<i64, ReadError> {
    if text.order.is_none() {
        text.integer("an integer")
    } else {
        text.whole(kind, "a value")
    }
}

/// Index lists: counts and indices in one array, or offsets and connectivity (from version 5).
fn lists(
    text: &mut Text<'_>,
    count: i64,
    size: i64,
    place: TextPlace,
) -> Result<Vec<Vec<i64>>, ReadError> {
    if text.rest().trim_ascii_start().starts_with(b"OFFSETS") {
        return offset_lists(text, count, size, place);
    }
    let count = checked(text, count, "cells", 1, place)?;
    let size = checked(text, size, "cell values", 1, place)?;
    let mut lists = Vec::with_capacity(count);
    for _ in 0..count {
        let length = integer(text, Scalar::I32)?;
        let length = checked(text, length, "corners", 1, text.place())?;
        let mut list = Vec::with_capacity(length);
        for _ in 0..length {
            list.push(integer(text, Scalar::I32)?);
        }
        lists.push(list);
    }
    let found: usize = lists.iter().map(|list| list.len() + 1).sum();
    if found != size {
        let expected = "as many values as the cells' own counts say";
        return Err(unexpected_number(expected, &size, place));
    }
    Ok(lists)
}

fn offset_lists(
    text: &mut Text<'_>,
    count: i64,
    size: i64,
    place: TextPlace,
) -> Result<Vec<Vec<i64>>, ReadError> {
    let array = |text: &mut Text<'_>, n: i64, what: &'static str| -> Result<Vec<i64>, ReadError> {
        let mut words = text.full_line(what)?;
        words.next();
        let kind = words.next().unwrap_or_default();
        let n = checked(text, n, what, 1, place)?;
        let kind = kind_of(text, kind, n)?;
        (0..n).map(|_| integer(text, kind)).collect()
    };
    let offsets = array(text, count, "OFFSETS")?;
    if text.order.is_some() {
        // The newline after a binary block.
        let rest = text.rest();
        text.skip(rest.len() - rest.trim_ascii_start().len());
    }
    let values = array(text, size, "CONNECTIVITY")?;
    let mut lists = Vec::with_capacity(offsets.len());
    for pair in offsets.windows(2) {
        let range = usize::try_from(pair[0])
            .ok()
            .zip(usize::try_from(pair[1]).ok());
        let list = range.and_then(|(a, b)| values.get(a..b));
        let list = list.ok_or_else(|| out_of_range(pair[1], values.len(), place))?;
        lists.push(list.to_vec());
    }
    Ok(lists)
}

/// Skips the arrays of a FIELD.
fn skip_field(text: &mut Text<'_>, arrays: i64, place: TextPlace) -> Result<(), ReadError> {
    let arrays = checked(text, arrays, "arrays", 1, place)?;
    for _ in 0..arrays {
        let mut words = text.full_line("an array")?;
        words.next();
        let components = words.integer("a number of components")?;
        let tuples = words.integer("a number of tuples")?;
        let kind = words.next().unwrap_or_default();
        let values = components.saturating_mul(tuples);
        let values = checked(text, values, "values", 1, words.place())?;
        if text.order.is_some() {
            let size = scalar(kind, words.place())?.size();
            text.skip(values.saturating_mul(size));
        } else {
            for _ in 0..values {
                text.need("a value")?;
            }
        }
    }
    Ok(())
}
