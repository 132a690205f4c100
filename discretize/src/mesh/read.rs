//! Reading surface and tetrahedra files. Content decides the format, not the name.
//!
//! The readers are small and of our own because every error has to name line or byte, because no
//! allocation may follow a count in a header that the file's length does not justify, and because
//! the libraries at hand stop short of it: `mshio` reads MSH 4.1 only and panics on a large integer,
//! `vtkio` allocates by header, none reads OFF.

mod cloud;
mod gmsh;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;
mod text;
mod vtk;
mod vtu;

use std::fmt;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::mesh::{Mesh, boundary_triangles, tetrahedron_volume};
pub use cloud::read_point_cloud;
use text::Text;

/// File formats that are recognised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ.
    Obj,
    /// STL as text.
    StlAscii,
    /// STL, binary.
    StlBinary,
    /// PLY (text, binary of both byte orders).
    Ply,
    /// Object File Format.
    Off,
    /// VTK legacy (text or binary): polydata or tetrahedra.
    Vtk,
    /// VTK XML (ascii, base64 or raw, plain or zlib): polydata or unstructured grid.
    VtkXml,
    /// Gmsh MSH 1, 2.2 or 4.1 as text.
    Gmsh,
}

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MeshFile {
    /// The format found.
    pub format: Format,
    /// Surface: the triangles of the file (polygons cut into triangles), or the boundary of its
    /// tetrahedra if there are any. Vertices as in the file, used or not.
    pub mesh: Mesh,
    /// Tetrahedra over the same vertices, turned to positive volume.
    pub tetrahedra: Vec<[u32; 4]>,
}

/// Where in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextPlace {
    /// The file as a whole.
    File,
    /// Line, counted from 1.
    Line(usize),
    /// Byte, counted from 0.
    Byte(usize),
}

/// Why a file could not be read, with file and position.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ReadError {
    /// The file; empty when bytes were read.
    pub path: PathBuf,
    /// Where.
    pub place: TextPlace,
    /// What.
    pub kind: ReadErrorKind,
}

/// Why a file could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadErrorKind {
    /// The operating system refused.
    #[error("cannot read the file: {0}")]
    Io(std::io::ErrorKind),
    /// No format matches the content.
    #[error("not a mesh in a known format (OBJ, STL, PLY, OFF, VTK, Gmsh)")]
    UnknownFormat,
    /// A variant that is not read.
    #[error("{what} are not read: {fix}")]
    Unsupported {
        /// What was met.
        what: &'static str,
        /// What to do.
        fix: &'static str,
    },
    /// The file ends too early.
    #[error("the line or the file ends where {expected} should follow")]
    Truncated {
        /// What should follow.
        expected: &'static str,
    },
    /// Something follows where the file should end.
    #[error(
        "{bytes} bytes follow after the end of the mesh: if they are another mesh, write each into a \
         file of its own"
    )]
    Trailing {
        /// Number of bytes.
        bytes: usize,
    },
    /// Nothing is in the file.
    #[error("the file is empty")]
    Empty,
    /// A folder, a pipe or a device.
    #[error("not a regular file: write the mesh into a file first")]
    NotAFile,
    /// Something else stands there.
    #[error("expected {expected}, found `{found}`")]
    Unexpected {
        /// What should stand there.
        expected: &'static str,
        /// The first bytes found.
        found: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// A face names a vertex that does not exist.
    #[error("vertex {index} does not exist, the file has {count}")]
    IndexOutOfRange {
        /// The index as written.
        index: i64,
        /// Number of vertices.
        count: usize,
    },
    /// A count in a header is larger than the file can hold.
    #[error("the header promises {count} {what}, more than the file can hold")]
    Count {
        /// What is counted.
        what: &'static str,
        /// The count.
        count: u64,
    },
    /// No vertices or no faces.
    #[error("the file has no {what}")]
    Nothing {
        /// What is missing.
        what: &'static str,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.path.as_os_str().is_empty() {
            write!(f, "{}: ", self.path.display())?;
        }
        match self.place {
            TextPlace::File => {}
            TextPlace::Line(line) => write!(f, "line {line}: ")?,
            TextPlace::Byte(byte) => write!(f, "byte {byte}: ")?,
        }
        self.kind.fmt(f)
    }
}

impl std::error::Error for ReadError {}

impl ReadErrorKind {
    /// The error at a place of a file that [`read_file`] names.
    fn at(self, place: TextPlace) -> ReadError {
        let (path, kind) = (PathBuf::new(), self);
        ReadError { path, place, kind }
    }
}

/// What a reader collects.
#[derive(Default)]
struct RawMesh {
    vertices: Vec<DVec3>,
    /// Of vertices, as the file has them; empty where it has none or they are not read.
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    tetrahedra: Vec<[u32; 4]>,
    /// Whether cells with faces were met that are not read.
    skipped: bool,
    /// Polygons of more than three corners: the first triangle of each fan, and the corners.
    fans: Vec<(usize, Vec<u32>, TextPlace)>,
}

impl RawMesh {
    /// Adds a polygon as a fan; [`polygon::mend`] looks at it when all vertices are known.
    fn polygon(&mut self, corners: &[u32], place: TextPlace) -> Result<(), ReadError> {
        if corners.len() < 3 {
            let expected = "a face of three or more corners";
            return Err(text::unexpected_number(expected, &corners.len(), place));
        }
        if corners.len() > 3 {
            let first = self.triangles.len();
            self.fans.push((first, corners.to_vec(), place));
        }
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
        Ok(())
    }
}

/// Checks an index of a face against the number of vertices.
fn vertex_index(value: i64, count: usize, place: TextPlace) -> Result<u32, ReadError> {
    match u32::try_from(value) {
        Ok(v) if (v as usize) < count => Ok(v),
        _ => Err(out_of_range(value, count, place)),
    }
}

/// An index, as the file writes it, that names no vertex.
fn out_of_range(index: i64, count: usize, place: TextPlace) -> ReadError {
    ReadErrorKind::IndexOutOfRange { index, count }.at(place)
}

fn unsupported(what: &'static str, fix: &'static str, place: TextPlace) -> ReadError {
    ReadErrorKind::Unsupported { what, fix }.at(place)
}

fn truncated(expected: &'static str, place: TextPlace) -> ReadError {
    ReadErrorKind::Truncated { expected }.at(place)
}

/// Something that a file lacks.
fn nothing(what: &'static str) -> ReadError {
    ReadErrorKind::Nothing { what }.at(TextPlace::File)
}

/// Checks a coordinate.
fn point(coordinates: [f64; 3], place: TextPlace) -> Result<DVec3, ReadError> {
    let p = DVec3::from_array(coordinates);
    if p.is_finite() {
        Ok(p)
    } else {
        Err(ReadErrorKind::NotFinite.at(place))
    }
}

/// Reads a mesh file.
///
/// # Errors
/// [`ReadError`] with the file, the line or byte and the reason.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<MeshFile, ReadError> {
    read_file(path.as_ref(), parse_mesh)
}

fn read_file<T>(
    path: &Path,
    parse: impl Fn(&[u8]) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let io = |error: std::io::Error| ReadErrorKind::Io(error.kind()).at(TextPlace::File);
    let read = || {
        // A pipe or device may never end.
        if !std::fs::metadata(path).map_err(io)?.is_file() {
            return Err(ReadErrorKind::NotAFile.at(TextPlace::File));
        }
        parse(&std::fs::read(path).map_err(io)?)
    };
    read().map_err(|error| ReadError {
        path: path.to_owned(),
        ..error
    })
}

/// Whether nothing but zeros and white space is left of a binary file.
fn is_padding(bytes: &[u8]) -> bool {
    bytes.iter().all(|b| *b == 0 || b.is_ascii_whitespace())
}

/// The file without a byte order mark; names what no text or mesh can begin with.
fn checked(bytes: &[u8]) -> Result<&[u8], ReadError> {
    let (what, fix) = match bytes {
        [] => return Err(ReadErrorKind::Empty.at(TextPlace::File)),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => ("files in UTF-16", "save it as UTF-8 or ASCII"),
        [0x1f, 0x8b, ..] => ("files packed by gzip", "unpack it first"),
        [b'P', b'K', 3, 4, ..] => ("zip archives", "unpack it first"),
        _ => return Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)),
    };
    Err(unsupported(what, fix, TextPlace::File))
}

/// Reads a mesh from the bytes of a file.
///
/// # Errors
/// [`ReadError`] without a path.
pub fn parse_mesh(bytes: &[u8]) -> Result<MeshFile, ReadError> {
    let bytes = checked(bytes)?;
    let format = detect(bytes)?;
    let mut raw = match format {
        Format::Obj => obj::parse(bytes),
        Format::StlAscii => stl::parse_ascii(bytes),
        Format::StlBinary => stl::parse_binary(bytes),
        Format::Ply => ply::parse(bytes),
        Format::Off => off::parse(bytes),
        Format::Vtk => vtk::parse(bytes),
        Format::VtkXml => vtu::parse(bytes),
        Format::Gmsh => gmsh::parse(bytes),
    }?;
    if raw.vertices.is_empty() {
        return Err(nothing("vertices"));
    }
    let most = raw.vertices.len().max(raw.triangles.len());
    if u32::try_from(most.saturating_mul(4)).is_err() {
        let what = "meshes of more than a billion vertices";
        return Err(unsupported(what, "simplify the mesh", TextPlace::File));
    }
    polygon::mend(&mut raw)?;
    if !raw.tetrahedra.is_empty() {
        for t in &mut raw.tetrahedra {
            if tetrahedron_volume(t.map(|v| raw.vertices[v as usize])) < 0.0 {
                t.swap(2, 3);
            }
        }
        raw.triangles = boundary_triangles(&raw.tetrahedra, |_| true);
    }
    if raw.triangles.is_empty() {
        let what = "cells other than triangles, quadrilaterals, polygons and linear tetrahedra";
        let fix = "save the body's surface, or divide its cells into tetrahedra";
        return Err(if raw.skipped {
            unsupported(what, fix, TextPlace::File)
        } else {
            nothing("faces")
        });
    }
    Ok(MeshFile {
        format,
        mesh: Mesh {
            vertices: raw.vertices,
            triangles: raw.triangles,
        },
        tetrahedra: raw.tetrahedra,
    })
}

/// Recognises a format by its first bytes; a binary STL by its length.
fn detect(bytes: &[u8]) -> Result<Format, ReadError> {
    let unknown = ReadErrorKind::UnknownFormat.at(TextPlace::File);
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace());
    let body = &bytes[start.unwrap_or(0)..];
    let mut lines = body.split(|b| matches!(b, b'\n' | b'\r'));
    let line = lines.next().unwrap_or(body);
    let starts =
        |word: &[u8]| line.len() >= word.len() && line[..word.len()].eq_ignore_ascii_case(word);
    if line.trim_ascii_end() == b"ply" {
        return Ok(Format::Ply);
    }
    if starts(b"# vtk DataFile") {
        return Ok(Format::Vtk);
    }
    if starts(b"$MeshFormat") || starts(b"$NOD") || starts(b"$Comments") || starts(b"$Phys") {
        return Ok(Format::Gmsh);
    }
    if starts(b"<?xml") || starts(b"<VTKFile") {
        return Ok(Format::VtkXml);
    }
    if stl::is_binary(bytes) {
        return Ok(Format::StlBinary);
    }
    if starts(b"solid") {
        return Ok(Format::StlAscii);
    }
    let mut text = Text::new(body);
    let (mut lines, mut seen) = (0, false);
    while let Some(mut words) = text.line() {
        let whole = words.clone();
        match words.next() {
            None => continue,
            // Comments may come before the counts.
            Some(word) if !word.starts_with(b"#") && !seen && off::is_counts(whole) => {
                return Ok(Format::Off);
            }
            Some(word) if off::is_keyword(word) => return Ok(Format::Off),
            Some(b"v" | b"vn" | b"vt" | b"vp") => return Ok(Format::Obj),
            Some(b"f" | b"o" | b"g" | b"s" | b"l" | b"mtllib" | b"usemtl") => {}
            Some(word) if word.starts_with(b"#") => continue,
            Some(_) => return Err(unknown),
        }
        seen = true;
        lines += 1;
        if lines > 10_000 {
            break;
        }
    }
    Err(unknown)
}
