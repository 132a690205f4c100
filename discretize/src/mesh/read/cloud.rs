//! Points with normals.

use std::path::Path;

use glam::DVec3;

use super::text::{self, Text};
use super::{ReadError, ReadErrorKind, TextPlace, checked, nothing, point, read_file};
use crate::mesh::SurfaceSamples;

/// Reads a point cloud: the vertices of a PLY file with their nx, ny and nz, or text with `x y z nx ny nz` per line
/// and `#` comments. Areas are 0: the file has none (see [`SurfaceSamples::areas`]). Normals are made unit
/// length; there are none where the vertices of a PLY file have none.
///
/// # Errors
/// [`ReadError`] with the file, the line or byte and the reason.
pub fn read_point_cloud(path: impl AsRef<Path>) -> Result<SurfaceSamples, ReadError> {
    read_file(path.as_ref(), parse_cloud)
}

fn parse_cloud(bytes: &[u8]) -> Result<SurfaceSamples, ReadError> {
    let bytes = checked(bytes)?;
    if bytes.starts_with(b"ply") {
        return ply_cloud(bytes);
    }
    let mut text = Text::new(bytes);
    let mut surfels = SurfaceSamples::default();
    while let Some(mut words) = text.line() {
        let place = words.place();
        let Some(first) = words.next() else { continue };
        if first.starts_with(b"#") {
            continue;
        }
        let mut values = [text::float(first, place)?, 0.0, 0.0, 0.0, 0.0, 0.0];
        for value in &mut values[1..] {
            *value = words.float("six numbers: x y z nx ny nz")?;
        }
        let [x, y, z, nx, ny, nz] = values;
        surfels.positions.push(point([x, y, z], place)?);
        let normal = point([nx, ny, nz], place)?;
        surfels.normals.push(unit(normal, place)?);
    }
    if surfels.positions.is_empty() {
        return Err(nothing("points"));
    }
    surfels.areas = vec![0.0; surfels.positions.len()];
    Ok(surfels)
}

fn ply_cloud(bytes: &[u8]) -> Result<SurfaceSamples, ReadError> {
    let raw = super::ply::parse(bytes)?;
    if raw.vertices.is_empty() {
        return Err(nothing("vertices"));
    }
    let normals = raw
        .normals
        .iter()
        .map(|&normal| unit(normal, TextPlace::File));
    Ok(SurfaceSamples {
        normals: normals.collect::<Result<_, _>>()?,
        areas: vec![0.0; raw.vertices.len()],
        positions: raw.vertices,
    })
}

fn unit(normal: DVec3, place: TextPlace) -> Result<DVec3, ReadError> {
    let unit = normal.try_normalize();
    unit.ok_or_else(|| ReadErrorKind::NotFinite.at(place))
}
