//! PLY: text and binary of both byte orders; vertices' x, y, z, nx, ny, nz and faces' index lists.

use glam::DVec3;

use super::text::{ByteOrder, Scalar, Text, unexpected};
use super::{
    RawMesh, ReadError, ReadErrorKind, TextPlace, is_padding, nothing, point, vertex_index,
};

fn scalar(word: &[u8]) -> Option<Scalar> {
    const NAMES: &str = "char int8|uchar uint8|short int16|ushort uint16|int int32|uint uint32|||\
                         float float32|double float64";
    Scalar::named(word, NAMES)
}

struct Property {
    /// Type of the count, for lists.
    list: Option<Scalar>,
    value: Scalar,
    role: Role,
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    /// x, y and z, then those of the normal.
    Coordinate(usize),
    Corners,
    Other,
}

struct Element {
    role: ElementRole,
    count: i64,
    place: TextPlace,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq)]
enum ElementRole {
    Vertex,
    Face,
    Other,
}

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut text = Text::new(bytes);
    let elements = header(&mut text)?;
    let vertices = elements.iter().filter(|e| e.role == ElementRole::Vertex);
    let has = |axis| {
        let is = |p: &Property| p.role == Role::Coordinate(axis);
        vertices.clone().all(|e| e.properties.iter().any(is))
    };
    if !(0..3).all(has) {
        return Err(nothing("properties x, y and z of its vertices"));
    }
    let normals = (3..6).all(has);
    // Faces may stand before the vertices, so it is the header that says how many there are.
    let vertices: i64 = vertices.map(|e| e.count).fold(0, i64::saturating_add);
    let vertices = usize::try_from(vertices).unwrap_or(0);
    for element in &elements {
        read_element(element, vertices, &mut text, &mut raw)?;
    }
    if text.order.is_none() {
        text.end()?;
    } else if !is_padding(text.rest()) {
        let bytes = text.rest().len();
        return Err(ReadErrorKind::Trailing { bytes }.at(text.place()));
    }
    if !normals {
        raw.normals.clear();
    }
    Ok(raw)
}

fn header(text: &mut Text<'_>) -> Result<Vec<Element>, ReadError> {
    let mut order = None;
    let mut elements: Vec<Element> = Vec::new();
    text.full_line("`ply`")?;
    loop {
        let Some(mut words) = text.line() else {
            return Err(text.truncated("`end_header`"));
        };
        let place = words.place();
        match words.next() {
            Some(b"format") => {
                let word = words.next().unwrap_or_default();
                order = Some(match word {
                    b"ascii" => None,
                    b"binary_little_endian" => Some(ByteOrder::Little),
                    b"binary_big_endian" => Some(ByteOrder::Big),
                    _ => return Err(unexpected("a PLY format", word, place)),
                });
            }
            Some(b"element") => {
                let role = match words.next() {
                    Some(b"vertex") => ElementRole::Vertex,
                    Some(b"face") => ElementRole::Face,
                    _ => ElementRole::Other,
                };
                elements.push(Element {
                    role,
                    count: words.integer("a count")?,
                    place,
                    properties: Vec::new(),
                });
            }
            Some(b"property") => {
                let property = property(&mut words)?;
                match elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return Err(unexpected("`element` first", b"property", place)),
                }
            }
            Some(b"end_header") => break,
            Some(b"comment" | b"obj_info") | None => {}
            Some(other) => return Err(unexpected("a PLY header line", other, place)),
        }
    }
    text.order = order.ok_or_else(|| text.truncated("a format line"))?;
    Ok(elements)
}

fn property(words: &mut super::text::Words<'_>) -> Result<Property, ReadError> {
    let place = words.place();
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        scalar(word).ok_or_else(|| unexpected("a PLY type", word, place))
    };
    let (list, value) = match words.next() {
        Some(b"list") => (Some(scalar(words.next())?), scalar(words.next())?),
        first => (None, scalar(first)?),
    };
    let role = match (words.next(), list.is_some()) {
        (Some(b"x"), false) => Role::Coordinate(0),
        (Some(b"y"), false) => Role::Coordinate(1),
        (Some(b"z"), false) => Role::Coordinate(2),
        (Some(b"nx"), false) => Role::Coordinate(3),
        (Some(b"ny"), false) => Role::Coordinate(4),
        (Some(b"nz"), false) => Role::Coordinate(5),
        (Some(b"vertex_indices" | b"vertex_index"), true) => Role::Corners,
        _ => Role::Other,
    };
    Ok(Property { list, value, role })
}

/// An index or count.
#[allow(
    clippy::cast_possible_truncation,
    reason = "indices written as floats are rounded down and then checked"
)]
fn integer(text: &mut Text<'_>, kind: Scalar) -> Result<i64, ReadError> {
    if text.order.is_none() && !kind.is_float() {
        text.integer("an integer")
    } else {
        Ok(text.number(kind, "a value")? as i64)
    }
}

fn read_element(
    element: &Element,
    vertices: usize,
    text: &mut Text<'_>,
    raw: &mut RawMesh,
) -> Result<(), ReadError> {
    let properties = element.properties.iter();
    let least = match text.order {
        None => 2 * properties.len(),
        Some(_) => properties.map(|p| p.list.unwrap_or(p.value).size()).sum(),
    };
    let count = text.checked(element.count, "elements", least, element.place)?;
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut corners = Vec::new();
    for _ in 0..count {
        let place = text.place();
        let mut values = [f64::NAN; 6];
        for property in &element.properties {
            if let Some(list) = property.list {
                let size = integer(text, list)?;
                let size = text.checked(size, "list entries", 1, place)?;
                let is_corners =
                    property.role == Role::Corners && element.role == ElementRole::Face;
                if is_corners {
                    corners.clear();
                }
                for _ in 0..size {
                    let v = integer(text, property.value)?;
                    if is_corners {
                        corners.push(vertex_index(v, vertices, place)?);
                    }
                }
                if is_corners {
                    raw.polygon(&corners, place)?;
                }
            } else {
                let value = text.number(property.value, "a value")?;
                if let Role::Coordinate(axis) = property.role {
                    values[axis] = value;
                }
            }
        }
        if element.role == ElementRole::Vertex {
            let [x, y, z, nx, ny, nz] = values;
            raw.vertices.push(point([x, y, z], place)?);
            raw.normals.push(DVec3::new(nx, ny, nz));
        }
    }
    Ok(())
}
