//! Points with normals.

use std::path::Path;

use super::text::{self, Text};
use super::{Failure, ReadError, ReadErrorKind, check_encoding, nothing, point, read_bytes};
use crate::mesh::cloud::SurfaceSamples;

/// Reads a point cloud with normals: `x y z nx ny nz` per line, `#` comments. Areas are 0: the file
/// has none (see [`SurfaceSamples::areas`]). Normals are made unit length.
///
/// # Errors
/// [`ReadError`] with the file, the line and the reason.
pub fn read_point_cloud(path: &Path) -> Result<SurfaceSamples, ReadError> {
    let bytes = read_bytes(path)?;
    parse_cloud(&bytes).map_err(|failure| ReadError {
        path: path.to_owned(),
        place: failure.place,
        kind: failure.kind,
    })
}

fn parse_cloud(bytes: &[u8]) -> Result<SurfaceSamples, Failure> {
    check_encoding(bytes)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
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
        surfels.normals.push(normal.try_normalize().ok_or(Failure {
            place,
            kind: ReadErrorKind::NotFinite,
        })?);
    }
    if surfels.positions.is_empty() {
        return Err(nothing("points"));
    }
    surfels.areas = vec![0.0; surfels.positions.len()];
    Ok(surfels)
}
