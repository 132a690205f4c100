//! VTK XML: unstructured grids and polydata; arrays as text, base64 or raw bytes, plain or zlib.

use std::collections::HashMap;

use super::text::{ByteOrder, Scalar, Text, check_count, unexpected};
use super::vtk::{self, POLYGON, STRIP};
use super::{RawMesh, ReadError, TextPlace, out_of_range, point, truncated, unsupported};

/// Most bytes that a byte of zlib data can become (a deflate block of one repeated match).
const LARGEST_RATIO: usize = 1100;
/// Types of arrays.
const NAMES: &str = "Int8|UInt8|Int16|UInt16|Int32|UInt32|Int64|UInt64|Float32|Float64";

/// An opening tag with its attributes.
struct Tag<'a> {
    name: &'a [u8],
    attributes: &'a [u8],
    /// Where it starts, and where what it holds starts.
    at: usize,
    content: usize,
}

impl<'a> Tag<'a> {
    fn get(&self, name: &str) -> Option<&'a [u8]> {
        let mut rest = self.attributes;
        loop {
            let equals = rest.iter().position(|b| *b == b'=')?;
            let key = rest[..equals].trim_ascii();
            let value = rest[equals + 1..].trim_ascii_start();
            let quote = *value.first()?;
            let end = value[1..].iter().position(|b| *b == quote)?;
            if key == name.as_bytes() {
                return Some(&value[1..=end]);
            }
            rest = &value[end + 2..];
        }
    }

    fn place(&self) -> TextPlace {
        TextPlace::Byte(self.at)
    }

    fn need(&self, name: &'static str) -> Result<&'a [u8], ReadError> {
        self.get(name).ok_or_else(|| truncated(name, self.place()))
    }
}

/// How the values of the file are written.
struct ValueReader<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
    /// Type of the sizes before a block.
    header: Scalar,
    zlib: bool,
    /// Start of the appended data and whether it is base64.
    appended: Option<(usize, bool)>,
}

/// The arrays of a section by their names.
type Lists<'a> = HashMap<&'a [u8], Tag<'a>>;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::default();
    let mut reader = ValueReader {
        bytes,
        order: ByteOrder::Little,
        header: Scalar::U32,
        zlib: false,
        appended: None,
    };
    let tags = tags(bytes);
    for tag in &tags {
        match tag.name {
            b"VTKFile" => reader.open(tag)?,
            b"AppendedData" => {
                let start = bytes[tag.content..].iter().position(|b| *b == b'_');
                let base64 = tag.get("encoding") != Some(b"raw");
                reader.appended = start.map(|s| (tag.content + s + 1, base64));
            }
            _ => {}
        }
    }
    let mut section: &[u8] = b"";
    let mut first = 0;
    let mut lists = Lists::new();
    for tag in tags {
        match tag.name {
            b"Piece" => first = raw.vertices.len(),
            b"Points" | b"Cells" | b"Polys" | b"Strips" | b"Verts" | b"Lines" | b"PointData"
            | b"CellData" | b"FieldData" => {
                section = tag.name;
                lists.clear();
            }
            b"DataArray" => match (section, tag.get("Name").unwrap_or_default()) {
                (b"Points", _) => reader.points(&tag, &mut raw)?,
                (b"Cells" | b"Polys" | b"Strips", name) => {
                    lists.insert(name, tag);
                    reader.cells(section, &mut lists, first, &mut raw)?;
                }
                _ => {}
            },
            _ => {}
        }
    }
    Ok(raw)
}

/// All opening tags up to the appended data, whose bytes may look like tags.
fn tags(bytes: &[u8]) -> Vec<Tag<'_>> {
    let mut out: Vec<Tag<'_>> = Vec::new();
    let mut at = 0;
    while let Some(start) = bytes[at..].iter().position(|b| *b == b'<') {
        let start = at + start;
        // A `>` in quotes does not close the tag.
        let mut quote = None;
        let end = bytes[start..].iter().position(|b| {
            match quote {
                Some(q) if *b == q => quote = None,
                None if matches!(b, b'"' | b'\'') => quote = Some(*b),
                _ => {}
            }
            *b == b'>' && quote.is_none()
        });
        let Some(end) = end else { break };
        let inner = &bytes[start + 1..start + end];
        at = start + end + 1;
        let name = inner
            .split(|b| b.is_ascii_whitespace() || *b == b'/')
            .next()
            .unwrap_or_default();
        if name.first().is_some_and(u8::is_ascii_alphabetic) {
            out.push(Tag {
                name,
                attributes: &inner[name.len()..],
                at: start,
                content: at,
            });
            if name == b"AppendedData" {
                break;
            }
        }
    }
    out
}

impl ValueReader<'_> {
    fn open(&mut self, tag: &Tag<'_>) -> Result<(), ReadError> {
        let kind = tag.need("type")?;
        if kind != b"UnstructuredGrid" && kind != b"PolyData" {
            let expected = "UnstructuredGrid or PolyData";
            return Err(unexpected(expected, kind, tag.place()));
        }
        if tag.get("byte_order") == Some(b"BigEndian") {
            self.order = ByteOrder::Big;
        }
        if tag.get("header_type") == Some(b"UInt64") {
            self.header = Scalar::U64;
        }
        self.zlib = match tag.get("compressor") {
            None => false,
            Some(b"vtkZLibDataCompressor") => true,
            Some(_) => {
                let what = "VTK XML files compressed by LZ4 or LZMA";
                let fix = "write them with zlib or without compression";
                return Err(unsupported(what, fix, tag.place()));
            }
        };
        Ok(())
    }

    fn points(&self, tag: &Tag<'_>, raw: &mut RawMesh) -> Result<(), ReadError> {
        let kind = tag.need("type")?;
        if kind != b"Float32" && kind != b"Float64" {
            return Err(unexpected("Float32 or Float64", kind, tag.place()));
        }
        let values = self.values(tag)?;
        for &xyz in values.as_chunks::<3>().0 {
            raw.vertices.push(point(xyz, tag.place())?);
        }
        Ok(())
    }

    /// Adds the cells of a section once all its arrays are known.
    fn cells(
        &self,
        section: &[u8],
        lists: &mut Lists<'_>,
        first: usize,
        raw: &mut RawMesh,
    ) -> Result<(), ReadError> {
        let kind = match section {
            b"Polys" => Some(POLYGON),
            b"Strips" => Some(STRIP),
            _ => None,
        };
        let [connectivity, offsets, types] =
            ["connectivity", "offsets", "types"].map(|name| lists.get(name.as_bytes()));
        let (Some(connectivity), Some(offsets)) = (connectivity, offsets) else {
            return Ok(());
        };
        if kind.is_none() && types.is_none() {
            return Ok(());
        }
        let place = connectivity.place();
        let corners = self.integers(connectivity)?;
        let ends = self.integers(offsets)?;
        let types = match (types, kind) {
            (Some(tag), None) => self.integers(tag)?,
            (_, kind) => vec![kind.unwrap_or(POLYGON); ends.len()],
        };
        if types.len() != ends.len() {
            return Err(truncated("a type for every cell", place));
        }
        let shift = i64::try_from(first).unwrap_or(i64::MAX);
        let mut cells = Vec::with_capacity(ends.len());
        let mut begin = 0;
        for end in ends {
            let range = usize::try_from(end)
                .ok()
                .and_then(|e| corners.get(begin..e));
            let own = range.ok_or_else(|| out_of_range(end, corners.len(), place))?;
            // A negative corner stays negative and is refused with the others out of range.
            let moved = |v: &i64| if *v < 0 { *v } else { v.saturating_add(shift) };
            cells.push(own.iter().map(moved).collect::<Vec<i64>>());
            begin += own.len();
        }
        lists.clear();
        vtk::add(raw, types.into_iter().zip(&cells), place)
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "whole numbers up to 2^53; larger ones are out of range anyway"
    )]
    fn integers(&self, tag: &Tag<'_>) -> Result<Vec<i64>, ReadError> {
        let values = self.values(tag)?;
        Ok(values.into_iter().map(|v| v as i64).collect())
    }

    /// The values of an array.
    fn values(&self, tag: &Tag<'_>) -> Result<Vec<f64>, ReadError> {
        let content = &self.bytes[tag.content..];
        let end = content.iter().position(|b| *b == b'<');
        let inline = &content[..end.unwrap_or(content.len())];
        match tag.need("format")? {
            b"ascii" => {
                let mut text = Text::new(inline);
                let mut values = Vec::new();
                while let Some(word) = text.word() {
                    values.push(super::text::float(word, tag.place())?);
                }
                Ok(values)
            }
            b"binary" => self.decode(tag, &unbase64(inline, tag.place())?),
            b"appended" => {
                let word = tag.need("offset")?;
                let offset = super::text::integer(word, tag.place(), "an offset")?;
                let start = self.appended;
                let (start, base64) =
                    start.ok_or_else(|| truncated("AppendedData", tag.place()))?;
                let left = self.bytes.len() - start;
                let offset = check_count(offset, "bytes", 1, left, tag.place())?;
                let data = self.bytes.get(start + offset..).unwrap_or_default();
                if base64 {
                    let end = data.iter().position(|b| *b == b'<').unwrap_or(data.len());
                    self.decode(tag, &unbase64(&data[..end], tag.place())?)
                } else {
                    self.decode(tag, data)
                }
            }
            other => Err(unexpected("ascii, binary or appended", other, tag.place())),
        }
    }

    /// Values of a block of bytes with its header of sizes.
    fn decode(&self, tag: &Tag<'_>, data: &[u8]) -> Result<Vec<f64>, ReadError> {
        let place = tag.place();
        let kind = self.header;
        let mut at = 0;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a size; beyond 2^53 more than any file holds"
        )]
        let mut header = || -> Result<usize, ReadError> {
            let value = data.get(at..).and_then(|b| kind.read(b, self.order));
            at += kind.size();
            let value = value.ok_or_else(|| truncated("the size of an array", place))?;
            Ok(value as usize)
        };
        if !self.zlib {
            let size = header()?;
            let end = at.checked_add(size);
            let own = end.and_then(|end| data.get(at..end));
            let own = own.ok_or_else(|| truncated("the bytes of an array", place))?;
            return self.numbers(tag, own);
        }
        let blocks = header()?;
        let full = header()?;
        let last = header()?;
        let count = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        check_count(count(blocks), "blocks", 1, data.len(), place)?;
        let packed: Vec<usize> = (0..blocks).map(|_| header()).collect::<Result<_, _>>()?;
        let mut out = Vec::new();
        for (k, packed) in packed.into_iter().enumerate() {
            let size = if k + 1 == blocks && last > 0 {
                last
            } else {
                full
            };
            let own = at.checked_add(packed).and_then(|end| data.get(at..end));
            let own = own.ok_or_else(|| truncated("the bytes of an array", place))?;
            at += packed;
            let room = own.len().saturating_mul(LARGEST_RATIO);
            check_count(count(size), "bytes in a block", 1, room, place)?;
            let block = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(own, size)
                .map_err(|_| unexpected("a zlib block", b"", place))?;
            out.extend(block);
        }
        self.numbers(tag, &out)
    }

    fn numbers(&self, tag: &Tag<'_>, bytes: &[u8]) -> Result<Vec<f64>, ReadError> {
        let kind = tag.need("type")?;
        let scalar = Scalar::named(kind, NAMES);
        let scalar = scalar.ok_or_else(|| unexpected("a VTK type", kind, tag.place()))?;
        let values = bytes.chunks_exact(scalar.size());
        Ok(values.filter_map(|b| scalar.read(b, self.order)).collect())
    }
}

/// Bytes of base64 text. Padding may end any group of four, as where a header and data were
/// written one after the other.
fn unbase64(text: &[u8], place: TextPlace) -> Result<Vec<u8>, ReadError> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count, mut padding) = (0_u32, 0, 0);
    for &byte in text.iter().filter(|b| !b.is_ascii_whitespace()) {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                padding += 1;
                0
            }
            _ => return Err(unexpected("base64", &[byte], place)),
        };
        bits = bits << 6 | u32::from(value);
        count += 1;
        if count == 4 {
            let [_, a, b, c] = bits.to_be_bytes();
            out.extend(&[a, b, c][..3_usize.saturating_sub(padding)]);
            (bits, count, padding) = (0, 0, 0);
        }
    }
    Ok(out)
}
