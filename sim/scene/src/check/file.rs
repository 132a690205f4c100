//! Files that a scene names, and rigid surfaces from them.

use std::path::Path;

use super::Checks;
use crate::RigidMesh;

/// Hint for the scale of a file.
pub(super) const UNIT: &str = " (metres per unit of the file), such as 0.001 for millimetres";

pub(super) fn existing_file(checks: &mut Checks, file: &Path, what: &str) {
    let must = match std::fs::metadata(file) {
        Ok(metadata) if metadata.is_file() => return,
        Ok(metadata) => {
            let is = match metadata.is_dir() {
                true => "a folder",
                false => "a pipe or a device",
            };
            format!("it must name {what}, and this is {is}")
        }
        Err(error) => {
            format!("the file cannot be read ({error}); relative paths start at the scene's folder")
        }
    };
    checks.require(false, "file", format_args!("'{}'", file.display()), must);
}

/// A rigid surface that is only drawn.
pub(super) fn rigid(checks: &mut Checks, mesh: &RigidMesh) {
    existing_file(checks, &mesh.file, "a mesh file");
    checks.positive("scale", mesh.scale, UNIT);
    checks.finite("position", mesh.position);
    checks.finite("rotation", mesh.rotation);
    checks.color("color", mesh.color);
}
