//! Texture coordinates of a mesh, and the images that they point into.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3};

use super::text::{Text, Words, float, unexpected};
use super::{Failure, Format, ReadError, ReadErrorKind, TextPlace, collect, nothing, read_bytes};
use crate::hierarchy::Hierarchy;
use crate::mesh::{Mesh, index};

/// A corner without texture coordinates, a face without a material.
pub(super) const NONE: u32 = u32::MAX;

/// What a reader collects of textures.
#[derive(Default)]
pub(super) struct RawTexture {
    pub(super) coordinates: Vec<DVec2>,
    /// Coordinates of each triangle's corners.
    corners: Vec<[u32; 3]>,
    /// Material of each triangle, or the number of its image.
    materials: Vec<u32>,
    /// Coordinates of the corners of polygons that are more than triangles.
    fans: Vec<Vec<u32>>,
    /// Materials, by number.
    names: Vec<String>,
    numbers: HashMap<String, u32>,
    pub(super) libraries: Vec<(String, TextPlace)>,
    /// Images that the file names itself.
    pub(super) images: Vec<String>,
    /// One entry of `coordinates` for each vertex.
    pub(super) by_vertex: bool,
}

impl RawTexture {
    /// The number of a material.
    pub(super) fn material(&mut self, name: &str) -> u32 {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = index(self.names.len());
        self.names.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        number
    }

    /// Adds a polygon as a fan; `places` are numbers of coordinates from 1, 0 where a corner has none.
    pub(super) fn polygon(
        &mut self,
        places: &[i64],
        material: u32,
        place: TextPlace,
    ) -> Result<(), Failure> {
        let count = self.coordinates.len();
        let numbers = places
            .iter()
            .map(|&number| match u32::try_from(number - 1) {
                _ if number == 0 => Ok(NONE),
                Ok(at) if (at as usize) < count => Ok(at),
                _ => Err(Failure {
                    place,
                    kind: ReadErrorKind::TextureOutOfRange {
                        index: number,
                        count,
                    },
                }),
            });
        let numbers = numbers.collect::<Result<Vec<u32>, _>>()?;
        self.fan(numbers, material);
        Ok(())
    }

    /// Adds a face of a PLY file: of `places`, two for each of its `corners`, or by its vertices.
    pub(super) fn ply_polygon(
        &mut self,
        corners: &[u32],
        places: &[f64],
        image: u32,
        place: TextPlace,
    ) -> Result<(), Failure> {
        if places.is_empty() && self.by_vertex {
            self.fan(corners.to_vec(), image);
            return Ok(());
        }
        if places.is_empty() {
            self.fan(vec![NONE; corners.len()], image);
            return Ok(());
        }
        if places.len() != 2 * corners.len() {
            let found = places.len().to_string();
            let expected = "two texture coordinates for each corner";
            return Err(unexpected(expected, found.as_bytes(), place));
        }
        if places.iter().any(|x| !x.is_finite()) {
            let kind = ReadErrorKind::NotFinite;
            return Err(Failure { place, kind });
        }
        let first = index(self.coordinates.len());
        let pairs = places.chunks_exact(2).map(|p| DVec2::new(p[0], p[1]));
        self.coordinates.extend(pairs);
        self.fan((first..index(self.coordinates.len())).collect(), image);
        Ok(())
    }

    fn fan(&mut self, mut corners: Vec<u32>, material: u32) {
        if corners.contains(&NONE) {
            corners.fill(NONE);
        }
        for pair in corners.windows(2).skip(1) {
            self.corners.push([corners[0], pair[0], pair[1]]);
            self.materials.push(material);
        }
        if corners.len() > 3 {
            self.fans.push(corners);
        }
    }

    /// A triangle of a polygon of which the fan did not do; `corners` counts those of the polygon.
    pub(super) fn cut_anew(&mut self, fan: usize, triangle: usize, corners: [usize; 3]) {
        if let (Some(own), Some(to)) = (self.fans.get(fan), self.corners.get_mut(triangle)) {
            *to = corners.map(|corner| own[corner]);
        }
    }
}

/// A surface with the images that colour it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TexturedMesh {
    /// The surface, in the file's own unit.
    pub mesh: Mesh,
    /// Texture coordinates of the corners of each triangle: u to the right and v up, 1 an image's whole
    /// width and height.
    pub coordinates: Vec<[DVec2; 3]>,
    /// Which of `images` lies on each triangle, if any does.
    pub image: Vec<Option<u16>>,
    /// Image files.
    pub images: Vec<PathBuf>,
}

/// Where a point of a surface lies in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlace {
    /// Which image.
    pub image: u16,
    /// Place in it, u to the right and v up.
    pub at: DVec2,
    /// Change of the place along two directions (1/m).
    pub along: [DVec2; 2],
}

impl TexturedMesh {
    /// Where the point of the surface that is nearest to `x` (m) lies in an image, and how that place changes
    /// along two directions, by the linear map of the nearest triangle; `None` where no image lies.
    ///
    /// `hierarchy` is that of the mesh. At a seam, where neighbouring triangles lie in different parts of an
    /// image, the map goes on beyond the triangle as if there were none.
    #[must_use]
    pub fn place(&self, hierarchy: &Hierarchy, x: DVec3, along: [DVec3; 2]) -> Option<ImagePlace> {
        let closest = hierarchy.closest(x)?;
        let triangle = closest.triangle as usize;
        let image = self.image[triangle]?;
        let [a, b, c] = self.mesh.corners(triangle);
        let [at, at_b, at_c] = self.coordinates[triangle];
        let (u, v) = (b - a, c - a);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let determinant = uu * vv - uv * uv;
        let map = |d: DVec3| {
            if determinant <= 0.0 {
                return DVec2::ZERO;
            }
            let (p, q) = (u.dot(d), v.dot(d));
            let (s, t) = (vv * p - uv * q, uu * q - uv * p);
            ((at_b - at) * s + (at_c - at) * t) / determinant
        };
        Some(ImagePlace {
            image,
            at: at + map(closest.point - a),
            along: along.map(map),
        })
    }
}

/// Reads a surface with its texture coordinates: of OBJ `vt`, with the images that `map_Kd` names in the
/// libraries (`mtllib`) beside it, material by material (`usemtl`); of PLY `s` and `t` (or `u` and `v`) of
/// vertices or `texcoord` of faces, with the images of `comment TextureFile`. Names of files start at
/// the folder of the file that names them. Images are not opened.
///
/// # Errors
/// [`ReadError`] with the file, the line or byte and the reason; also if there are no coordinates or no image.
pub fn read_textured_mesh(path: &Path) -> Result<TexturedMesh, ReadError> {
    let bytes = read_bytes(path)?;
    let failed = |failure: Failure| ReadError {
        path: path.to_owned(),
        place: failure.place,
        kind: failure.kind,
    };
    let (format, raw) = collect(&bytes, Some(RawTexture::default())).map_err(failed)?;
    let unsupported = |what, fix| {
        failed(Failure {
            place: TextPlace::File,
            kind: ReadErrorKind::Unsupported { what, fix },
        })
    };
    let fix = "save the mesh as OBJ or PLY";
    if !matches!(format, Format::Obj | Format::Ply) {
        return Err(unsupported("texture coordinates of this format", fix));
    }
    let texture = raw.texture.unwrap_or_default();
    if texture.corners.len() != raw.triangles.len() {
        return Err(unsupported("faces with two lists of corners", fix));
    }
    if texture.corners.iter().all(|corners| corners[0] == NONE) {
        return Err(failed(nothing("texture coordinates")));
    }
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    let named = match format {
        Format::Obj => of_materials(&texture, folder, path)?,
        _ => texture
            .images
            .iter()
            .map(|name| Some(folder.join(name)))
            .collect(),
    };
    // Of a PLY file without numbers the first image is that of all faces.
    let unnumbered = (format == Format::Ply).then_some(0);
    let mut out = TexturedMesh {
        mesh: Mesh {
            vertices: raw.vertices,
            triangles: raw.triangles,
        },
        ..TexturedMesh::default()
    };
    for (corners, material) in texture.corners.iter().zip(&texture.materials) {
        let number = Some(*material).filter(|m| *m != NONE).or(unnumbered);
        let file = match number.map(|number| named.get(number as usize)) {
            Some(None) if !named.is_empty() => {
                let found = material.to_string();
                let expected = "the number of a TextureFile, from 0";
                return Err(failed(unexpected(
                    expected,
                    found.as_bytes(),
                    TextPlace::File,
                )));
            }
            Some(Some(Some(file))) if corners[0] != NONE => Some(file),
            _ => None,
        };
        let image = file.map(|file| {
            let known = out.images.iter().position(|known| known == file);
            known.unwrap_or_else(|| {
                out.images.push(file.clone());
                out.images.len() - 1
            })
        });
        let image = image.map(u16::try_from).transpose();
        let many = "textures of more than 65,536 images";
        out.image
            .push(image.map_err(|_| unsupported(many, "join images into fewer"))?);
        out.coordinates.push(match image {
            _ if corners[0] == NONE => [DVec2::ZERO; 3],
            _ => corners.map(|corner| texture.coordinates[corner as usize]),
        });
    }
    if out.images.is_empty() {
        let what = "image for its texture coordinates (OBJ: `map_Kd` of a material, PLY: `comment TextureFile`)";
        return Err(failed(nothing(what)));
    }
    Ok(out)
}

/// The image of each material that an OBJ file uses.
fn of_materials(
    texture: &RawTexture,
    folder: &Path,
    path: &Path,
) -> Result<Vec<Option<PathBuf>>, ReadError> {
    let mut known: HashMap<String, Option<PathBuf>> = HashMap::new();
    for (library, _) in &texture.libraries {
        let file = folder.join(library);
        let beside = file.parent().unwrap_or_else(|| Path::new(""));
        let materials = read_bytes(&file).and_then(|bytes| {
            parse_library(&bytes).map_err(|failure| ReadError {
                path: file.clone(),
                place: failure.place,
                kind: failure.kind,
            })
        })?;
        for (name, image) in materials {
            known.insert(name, image.map(|image| beside.join(image)));
        }
    }
    let place = texture
        .libraries
        .last()
        .map_or(TextPlace::File, |last| last.1);
    let images = texture.names.iter().map(|name| {
        known.get(name).cloned().ok_or_else(|| ReadError {
            path: path.to_owned(),
            place,
            kind: ReadErrorKind::NoMaterial { name: name.clone() },
        })
    });
    images.collect()
}

/// Materials of a library (MTL) and their images.
fn parse_library(bytes: &[u8]) -> Result<Vec<(String, Option<String>)>, Failure> {
    let mut materials: Vec<(String, Option<String>)> = Vec::new();
    let mut text = Text::new(bytes);
    while let Some(mut words) = text.line() {
        match words.next() {
            Some(b"newmtl") => materials.push((words.text().into_owned(), None)),
            Some(b"map_Kd") => {
                let file = image_file(words)?;
                if let Some((_, image)) = materials.last_mut() {
                    *image = Some(file);
                }
            }
            _ => {}
        }
    }
    Ok(materials)
}

/// The file that a `map_Kd` names behind its options.
fn image_file(mut words: Words<'_>) -> Result<String, Failure> {
    let place = words.place();
    loop {
        let before = words.clone();
        let arguments = match words.next() {
            // These move, stretch or shake the image: their usual values do nothing.
            Some(option @ (b"-o" | b"-s" | b"-t")) => {
                let usual = if option == b"-s" { 1.0 } else { 0.0 };
                let mut after = words.clone();
                for _ in 0..3 {
                    match after.next().map(|word| float(word, place)) {
                        Some(Ok(value)) if (value - usual).abs() <= f64::EPSILON => {}
                        Some(Ok(_)) => {
                            return Err(Failure {
                                place,
                                kind: ReadErrorKind::Unsupported {
                                    what: "images that are moved or stretched (`-o`, `-s`, `-t`)",
                                    fix: "move the texture coordinates instead",
                                },
                            });
                        }
                        _ => break,
                    }
                    words = after.clone();
                }
                0
            }
            Some(b"-mm") => 2,
            Some(
                b"-blendu" | b"-blendv" | b"-bm" | b"-boost" | b"-cc" | b"-clamp" | b"-imfchan"
                | b"-texres" | b"-type",
            ) => 1,
            Some(_) => return Ok(before.text().into_owned()),
            None => {
                return Err(Failure {
                    place,
                    kind: ReadErrorKind::Truncated {
                        expected: "the name of an image",
                    },
                });
            }
        };
        for _ in 0..arguments {
            words.next();
        }
    }
}
