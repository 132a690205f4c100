//! Files that a scene names, and rigid surfaces from them.

use std::path::Path;

use super::Checks;
use crate::RigidMesh;

pub(super) fn scale(checks: &mut Checks, path: &str, scale: f64) {
    let hint = " (metres per unit of the file), such as 0.001 for millimetres";
    checks.positive(path, scale, hint);
}

pub(super) fn existing_file(checks: &mut Checks, path: &str, file: &Path, what: &str) {
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
    checks.require(false, path, format_args!("'{}'", file.display()), must);
}

/// A rigid surface that is only drawn.
pub(super) fn rigid(checks: &mut Checks, path: &str, mesh: &RigidMesh) {
    let of = |field: &str| format!("{path}.{field}");
    existing_file(checks, &of("file"), &mesh.file, "a mesh file");
    scale(checks, &of("scale"), mesh.scale);
    checks.finite(of("position"), mesh.position);
    checks.finite(of("rotation"), mesh.rotation);
    checks.color(&of("color"), mesh.color);
}
