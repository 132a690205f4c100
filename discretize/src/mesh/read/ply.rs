//! PLY: text and binary of both byte orders; vertices' x, y, z, nx, ny, nz and faces' index lists.

use glam::DVec3;

use super::text::{Scalar, Text, check_count, unexpected};
use super::{Failure, Raw, ReadErrorKind, TextPlace, is_padding, nothing, point, vertex_index};

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

fn scalar(word: &[u8]) -> Option<Scalar> {
    Some(match word {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
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

pub(super) fn parse(bytes: &[u8]) -> Result<Raw, Failure> {
    let mut raw = Raw::default();
    let mut text = Text::new(bytes);
    let (encoding, elements) = header(&mut text)?;
    let has = |axis| {
        let mut vertices = elements.iter().filter(|e| e.role == ElementRole::Vertex);
        vertices.all(|e| {
            e.properties
                .iter()
                .any(|p| p.role == Role::Coordinate(axis))
        })
    };
    if !(0..3).all(has) {
        return Err(nothing("properties x, y and z of its vertices"));
    }
    let normals = (3..6).all(has);
    let mut source = Source { text, encoding };
    // Faces may stand before the vertices, so it is the header that says how many there are.
    let vertices = elements.iter().filter(|e| e.role == ElementRole::Vertex);
    let vertices: i64 = vertices.map(|e| e.count).fold(0, i64::saturating_add);
    let vertices = usize::try_from(vertices).unwrap_or(0);
    for element in &elements {
        read_element(element, vertices, &mut source, &mut raw)?;
    }
    match encoding {
        Encoding::Ascii => source.text.end()?,
        _ if is_padding(source.text.rest()) => {}
        _ => {
            return Err(Failure {
                place: source.place(),
                kind: ReadErrorKind::Trailing {
                    bytes: source.text.rest().len(),
                },
            });
        }
    }
    if !normals {
        raw.normals.clear();
    }
    Ok(raw)
}

fn header(text: &mut Text<'_>) -> Result<(Encoding, Vec<Element>), Failure> {
    let mut encoding = None;
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
                encoding = Some(match word {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
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
    let encoding = encoding.ok_or_else(|| text.truncated("a format line"))?;
    Ok((encoding, elements))
}

fn property(words: &mut super::text::Words<'_>) -> Result<Property, Failure> {
    let place = words.place();
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        scalar(word).ok_or_else(|| unexpected("a PLY type", word, place))
    };
    let first = words.next();
    let list = if first == Some(b"list") {
        Some(scalar(words.next())?)
    } else {
        None
    };
    let value = if list.is_some() {
        scalar(words.next())?
    } else {
        scalar(first)?
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

/// The values after the header.
struct Source<'a> {
    text: Text<'a>,
    encoding: Encoding,
}

impl Source<'_> {
    fn place(&self) -> TextPlace {
        match self.encoding {
            Encoding::Ascii => self.text.place(),
            _ => TextPlace::Byte(self.text.offset()),
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "indices written as floats are rounded down and then checked"
    )]
    fn integer(&mut self, kind: Scalar) -> Result<i64, Failure> {
        if self.encoding == Encoding::Ascii && !kind.is_float() {
            self.text.integer("an integer")
        } else {
            Ok(self.float(kind)? as i64)
        }
    }

    fn float(&mut self, kind: Scalar) -> Result<f64, Failure> {
        if self.encoding == Encoding::Ascii {
            return self.text.float("a value");
        }
        let big = self.encoding == Encoding::Big;
        self.text.scalar(kind, big, "a value")
    }
}

fn read_element(
    element: &Element,
    vertices: usize,
    source: &mut Source<'_>,
    raw: &mut Raw,
) -> Result<(), Failure> {
    let least = match source.encoding {
        Encoding::Ascii => 2 * element.properties.len(),
        _ => element
            .properties
            .iter()
            .map(|p| p.list.unwrap_or(p.value).size())
            .sum(),
    };
    let left = source.text.rest().len();
    let count = check_count(element.count, "elements", least, left, element.place)?;
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut corners = Vec::new();
    for _ in 0..count {
        let place = source.place();
        let mut values = [f64::NAN; 6];
        for property in &element.properties {
            if let Some(list) = property.list {
                let size = source.integer(list)?;
                let left = source.text.rest().len();
                let size = check_count(size, "list entries", 1, left, place)?;
                let is_corners =
                    property.role == Role::Corners && element.role == ElementRole::Face;
                if is_corners {
                    corners.clear();
                }
                for _ in 0..size {
                    let v = source.integer(property.value)?;
                    if is_corners {
                        corners.push(vertex_index(v, vertices, place)?);
                    }
                }
                if is_corners {
                    raw.polygon(&corners, place)?;
                }
            } else {
                let value = source.float(property.value)?;
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
