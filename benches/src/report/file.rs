//! Tables that an example writes.

use std::fs;
use std::path::{Path, PathBuf};

use crate::StudyError;

/// Folder of an example's results, made if it is not there: the first argument, or
/// `target/studies/NAME`.
///
/// # Errors
/// [`StudyError::Folder`] if it cannot be made.
pub fn folder_of(name: &str) -> Result<PathBuf, StudyError> {
    let folder = std::env::args().nth(1);
    let folder = folder.map_or_else(|| Path::new("target/studies").join(name), PathBuf::from);
    fs::create_dir_all(&folder).map_err(|source| StudyError::Folder {
        path: folder.clone(),
        source,
    })?;
    Ok(folder)
}

/// Writes a table with a header as CSV.
///
/// # Errors
/// [`StudyError::Write`] if it cannot be written.
pub fn write_csv<const N: usize>(
    file: &Path,
    header: [&str; N],
    rows: &[[String; N]],
) -> Result<(), StudyError> {
    let write = || {
        let mut writer = csv::Writer::from_path(file)?;
        writer.write_record(header)?;
        for row in rows {
            writer.write_record(row)?;
        }
        Ok(writer.flush()?)
    };
    write().map_err(|source| StudyError::Write {
        file: file.to_owned(),
        source,
    })
}
