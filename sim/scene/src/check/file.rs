//! Files that a scene names.

use std::path::Path;

use super::Checks;

pub(super) fn scale(checks: &mut Checks, path: &str, scale: f64) {
    checks.positive(
        path,
        scale,
        " (metres per unit of the file), such as 0.001 for millimetres",
    );
}

pub(super) fn existing_file(checks: &mut Checks, path: &str, file: &Path, what: &str) {
    let must = match std::fs::metadata(file) {
        Ok(metadata) if metadata.is_file() => return,
        Ok(metadata) => format!("it must name {what}, and this is {}", kind_of(&metadata)),
        Err(error) => {
            format!("the file cannot be read ({error}); relative paths start at the scene's folder")
        }
    };
    checks.require(false, path, format_args!("'{}'", file.display()), must);
}

fn kind_of(metadata: &std::fs::Metadata) -> &'static str {
    if metadata.is_dir() {
        "a folder"
    } else {
        "a pipe or a device"
    }
}
