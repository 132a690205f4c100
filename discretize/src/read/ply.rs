//! PLY: text and binary of both byte orders; vertices' x, y, z and faces' index lists.

use super::text::{Text, check_count, unexpected};
use super::texture::NONE;
use super::{Failure, Raw, ReadErrorKind, TextPlace, is_padding, point, vertex_index};

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

struct Property {
    /// Type of the count, for lists.
    list: Option<Scalar>,
    value: Scalar,
    role: Role,
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate(usize),
    Corners,
    /// Texture coordinates: of a vertex, or two for each corner of a face.
    Texture(usize),
    TextureList,
    /// Which of the file's images.
    TextureNumber,
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

/// Into an empty `raw`.
pub(super) fn parse(bytes: &[u8], mut raw: Raw) -> Result<Raw, Failure> {
    let mut text = Text::new(bytes);
    let (encoding, elements, images) = header(&mut text)?;
    if let Some(texture) = &mut raw.texture {
        texture.images = images;
        texture.by_vertex = elements.iter().any(|element| {
            let mut properties = element.properties.iter();
            element.role == ElementRole::Vertex
                && properties.any(|property| matches!(property.role, Role::Texture(_)))
        });
    }
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
    Ok(raw)
}

/// Encoding, elements, and the names of images.
fn header(text: &mut Text<'_>) -> Result<(Encoding, Vec<Element>, Vec<String>), Failure> {
    let mut images = Vec::new();
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
            Some(b"comment") if words.clone().next() == Some(b"TextureFile") => {
                words.next();
                images.push(words.text().into_owned());
            }
            Some(b"comment" | b"obj_info") | None => {}
            Some(other) => return Err(unexpected("a PLY header line", other, place)),
        }
    }
    let encoding = encoding.ok_or_else(|| text.truncated("a format line"))?;
    Ok((encoding, elements, images))
}

fn property(words: &mut super::text::Words<'_>) -> Result<Property, Failure> {
    let place = words.place();
    let scalar = |word: Option<&[u8]>| {
        let word = word.unwrap_or_default();
        Scalar::parse(word).ok_or_else(|| unexpected("a PLY type", word, place))
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
        (Some(b"vertex_indices" | b"vertex_index"), true) => Role::Corners,
        (Some(b"s" | b"u" | b"texture_u" | b"texture_s"), false) => Role::Texture(0),
        (Some(b"t" | b"v" | b"texture_v" | b"texture_t"), false) => Role::Texture(1),
        (Some(b"texcoord"), true) => Role::TextureList,
        (Some(b"texnumber"), false) => Role::TextureNumber,
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
        if self.encoding == Encoding::Ascii && !matches!(kind, Scalar::F32 | Scalar::F64) {
            self.text.integer("an integer")
        } else {
            Ok(self.float(kind)? as i64)
        }
    }

    fn float(&mut self, kind: Scalar) -> Result<f64, Failure> {
        if self.encoding == Encoding::Ascii {
            return self.text.float("a value");
        }
        let size = kind.size();
        let mut bytes = [0; 8];
        match self.text.rest().get(..size) {
            Some(found) => bytes[..size].copy_from_slice(found),
            None => {
                return Err(Failure {
                    place: self.place(),
                    kind: ReadErrorKind::Truncated {
                        expected: "a value",
                    },
                });
            }
        }
        self.text.skip(size);
        if self.encoding == Encoding::Big {
            bytes[..size].reverse();
        }
        let [a, b, c, d, ..] = bytes;
        Ok(match kind {
            Scalar::I8 => f64::from(i8::from_le_bytes([a])),
            Scalar::U8 => f64::from(a),
            Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
            Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
            Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Scalar::F64 => f64::from_le_bytes(bytes),
        })
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
    let (mut uv, mut places) = ([0.0; 2], Vec::new());
    for _ in 0..count {
        let place = source.place();
        let mut xyz = [f64::NAN; 3];
        let mut faces = 0;
        let mut image = NONE;
        places.clear();
        for property in &element.properties {
            if let Some(list) = property.list {
                let size = source.integer(list)?;
                let left = source.text.rest().len();
                let size = check_count(size, "list entries", 1, left, place)?;
                let of_face = element.role == ElementRole::Face;
                if property.role == Role::TextureList && of_face && raw.texture.is_some() {
                    for _ in 0..size {
                        places.push(source.float(property.value)?);
                    }
                    continue;
                }
                let is_corners = property.role == Role::Corners && of_face;
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
                    faces += 1;
                }
            } else {
                let value = source.float(property.value)?;
                match property.role {
                    Role::Coordinate(axis) => xyz[axis] = value,
                    Role::Texture(axis) => uv[axis] = value,
                    Role::TextureNumber => image = number_of(value),
                    _ => {}
                }
            }
        }
        if let Some(texture) = &mut raw.texture {
            if element.role == ElementRole::Vertex && texture.by_vertex {
                texture.coordinates.push(uv.into());
            }
            if faces == 1 {
                texture.ply_polygon(&corners, &places, image, place)?;
            }
        }
        if element.role == ElementRole::Vertex {
            raw.vertices.push(point(xyz, place)?);
        }
    }
    Ok(())
}

/// The number of an image as a file writes it.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "what is no such number names no image, and is told of where the image is sought"
)]
fn number_of(value: f64) -> u32 {
    value as u32
}
