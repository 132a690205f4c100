//! Rigid surfaces that are only drawn.

use super::Checks;
use super::file::{existing_file, scale};
use crate::RigidMesh;

pub(super) fn rigid(checks: &mut Checks, path: &str, mesh: &RigidMesh) {
    existing_file(checks, &format!("{path}.file"), &mesh.file, "a mesh file");
    scale(checks, &format!("{path}.scale"), mesh.scale);
    checks.finite(format_args!("{path}.position"), mesh.position);
    checks.finite(format_args!("{path}.rotation"), mesh.rotation);
    checks.color(&format!("{path}.color"), mesh.color);
}
