//! The output folder.

use std::ffi::OsStr;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A result that cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder cannot be made, is something else, or nothing can be written into it.
    #[error(
        "output folder {}: {source}; name another with --out",
        folder.display()
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another run writes into the folder.
    #[error(
        "output folder {}: {holder} is writing into it; wait for its end or name another with --out",
        folder.display()
    )]
    InUse {
        /// The folder.
        folder: PathBuf,
        /// Who holds it.
        holder: String,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// A folder for results.
///
/// Files are written under a temporary name beside their place and renamed when they are complete,
/// so a name that is there is a whole file, whatever ends the program. A folder that was made for
/// the run and is still empty when the value is dropped is removed again.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// The folders made on the way, innermost first.
    made: Vec<PathBuf>,
    /// Held from [`OutputFolder::claim`] on.
    lock: Option<File>,
}

/// Name of the file that the writer of a folder holds locked.
const LOCK: &str = ".phyxel.lock";

impl OutputFolder {
    /// Makes the folder, if it is not there, and makes sure that files can be written into it.
    ///
    /// # Errors
    /// [`OutputError::Folder`] if it cannot be made, or no file in it.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |source| OutputError::Folder {
            folder: path.to_owned(),
            source,
        };
        let missing: Vec<PathBuf> = path
            .ancestors()
            .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists())
            .map(Path::to_owned)
            .collect();
        fs::create_dir_all(path).map_err(failed)?;
        let folder = Self {
            path: path.to_owned(),
            made: missing,
            lock: None,
        };
        let probe = folder.temporary().and_then(|mut file| {
            file.write_all(b"probe")?;
            file.close()
        });
        probe.map_err(failed)?;
        Ok(folder)
    }

    /// As [`OutputFolder::create`], for one writer at a time: until the value is dropped, or the program
    /// ends in whatever way, no other can claim the folder. Parts of files that a killed program left
    /// are removed. Where the file system knows no locks there is none.
    ///
    /// # Errors
    /// [`OutputError::InUse`], and as [`OutputFolder::create`].
    pub fn claim(path: &Path) -> Result<Self, OutputError> {
        let mut folder = Self::create(path)?;
        folder.lock = folder.take_lock()?;
        folder.sweep();
        Ok(folder)
    }

    fn take_lock(&self) -> Result<Option<File>, OutputError> {
        let place = self.path.join(LOCK);
        loop {
            let opened = File::options()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&place);
            let mut file = opened.map_err(|source| OutputError::Folder {
                folder: self.path.clone(),
                source,
            })?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut text = String::new();
                    // What cannot be read names nobody.
                    let _ = file.take(100).read_to_string(&mut text);
                    let number = text.trim().parse::<u32>();
                    return Err(OutputError::InUse {
                        folder: self.path.clone(),
                        holder: number.map_or_else(
                            |_| "another program".to_owned(),
                            |number| format!("process {number}"),
                        ),
                    });
                }
                Err(TryLockError::Error(_)) => {
                    let _ = fs::remove_file(&place);
                    return Ok(None);
                }
            }
            // Whoever held it before may have removed the file between opening and locking.
            let number = std::process::id().to_string();
            let named = file
                .set_len(0)
                .and_then(|()| file.write_all(number.as_bytes()));
            if named.is_ok() && fs::read(&place).is_ok_and(|text| text == number.as_bytes()) {
                return Ok(Some(file));
            }
        }
    }

    /// Removes the parts of files that a program left which did not come to its end.
    fn sweep(&self) {
        for entry in fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with('.') && name.ends_with(".part") {
                // What cannot be removed does no harm.
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// [`OutputError::File`]; what had the name before is then untouched.
    pub fn write(&self, name: impl AsRef<OsStr>, content: &[u8]) -> Result<(), OutputError> {
        let source = |source| OutputError::File {
            file: self.path.join(name.as_ref()),
            source,
        };
        self.fill(name.as_ref(), |file| {
            file.write_all(content).map_err(source)
        })
    }

    /// Writes a file by a function; it takes its name when it is complete.
    ///
    /// # Errors
    /// Those of the function, and [`OutputError::File`]; what had the name before is then untouched.
    pub fn fill<E: From<OutputError>>(
        &self,
        name: impl AsRef<OsStr>,
        fill: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<(), E> {
        let target = self.path.join(name.as_ref());
        let failed = |source| OutputError::File {
            file: target.clone(),
            source,
        };
        let mut writer = BufWriter::new(self.temporary().map_err(failed)?);
        fill(&mut writer)?;
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error);
        let whole = file.and_then(|file| {
            file.as_file().sync_data()?;
            Ok(file.persist(&target)?)
        });
        whole.map_err(failed)?;
        Ok(())
    }

    /// Removes a file, if it is there.
    pub(crate) fn remove(&self, name: &str) -> Result<(), OutputError> {
        let file = self.path.join(name);
        match fs::remove_file(&file) {
            Err(source) if source.kind() != io::ErrorKind::NotFound => {
                Err(OutputError::File { file, source })
            }
            _ => Ok(()),
        }
    }

    /// A folder inside, without the files of an earlier run: those whose names begin with `prefix`
    /// and end with `suffix` are removed, but for those in `kept`; others stay.
    pub(crate) fn fresh_subfolder(
        &self,
        name: &str,
        prefix: &str,
        suffix: &str,
        kept: &[String],
    ) -> Result<Self, OutputError> {
        let folder = Self::create(&self.path.join(name))?;
        folder.sweep();
        folder.remove_named(prefix, suffix, kept)?;
        Ok(folder)
    }

    /// Removes the files whose names begin with `prefix` and end with `suffix`, but for those in `kept`.
    pub(crate) fn remove_named(
        &self,
        prefix: &str,
        suffix: &str,
        kept: &[String],
    ) -> Result<(), OutputError> {
        let entries = fs::read_dir(&self.path).map_err(|source| OutputError::Folder {
            folder: self.path.clone(),
            source,
        })?;
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let ours = name.starts_with(prefix) && name.ends_with(suffix);
            if ours && !kept.iter().any(|kept| *kept == name) {
                let file = entry.path();
                fs::remove_file(&file).map_err(|source| OutputError::File { file, source })?;
            }
        }
        Ok(())
    }

    /// A file without a name of its own yet; it goes if it is dropped.
    fn temporary(&self) -> io::Result<NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".part");
        // As any other file: for others to read where the system's mask lets them.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(&self.path).map_err(|error| {
            // Without the file's name, which nobody chose.
            let inner = error.get_ref().and_then(|outer| outer.source());
            let inner = inner.and_then(|inner| inner.downcast_ref::<io::Error>());
            let code = inner.and_then(io::Error::raw_os_error);
            code.map_or(error, io::Error::from_raw_os_error)
        })
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if let Some(lock) = self.lock.take() {
            // While it is locked nobody else has it.
            let _ = fs::remove_file(self.path.join(LOCK));
            drop(lock);
        }
        for folder in &self.made {
            // Removes empty folders only, which is what is wanted.
            if fs::remove_dir(folder).is_err() {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .expect("the folder is there")
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_whole_or_not_at_all() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = OutputFolder::create(&root.path().join("a/b")).expect("it can be made");
        folder.write("x.txt", b"one").expect("it can be written");
        let file = folder.path().join("x.txt");
        let failed = folder.fill("x.txt", |growing| {
            growing.write_all(b"two").expect("it can be written");
            growing.flush().expect("it can be written");
            assert_eq!(fs::read(&file).unwrap(), b"one");
            Err(OutputError::File {
                file: file.clone(),
                source: io::ErrorKind::Other.into(),
            })
        });
        assert!(failed.is_err());
        assert_eq!(names(folder.path()), ["x.txt"]);
        folder.write("x.txt", b"three").expect("it can be renamed");
        assert_eq!(fs::read(&file).unwrap(), b"three");
        assert_eq!(names(folder.path()), ["x.txt"]);
    }

    #[test]
    fn an_earlier_runs_frames_go_and_the_rest_stays() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = OutputFolder::create(root.path()).expect("it is there");
        let fresh = |kept: &[String]| {
            let frames = folder.fresh_subfolder("frames", "frame-", ".png", kept);
            frames.expect("it can be made")
        };
        let frames = fresh(&[]);
        for name in ["frame-0001.png", "frame-0002.png", "mine.png"] {
            frames.write(name, b"old").expect("written");
        }
        let kept = fresh(&["frame-0001.png".to_owned()]);
        assert_eq!(names(kept.path()), ["frame-0001.png", "mine.png"]);
        assert_eq!(names(fresh(&[]).path()), ["mine.png"]);
    }

    #[test]
    fn a_folder_has_one_writer_at_a_time() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let path = root.path().join("out");
        fs::create_dir(&path).expect("it can be made");
        fs::write(path.join(".x.txt.1.part"), b"left by a kill").expect("it can be written");
        fs::write(path.join(LOCK), b"left by a kill").expect("it can be written");
        let first = OutputFolder::claim(&path).expect("nobody has it");
        assert_eq!(names(&path), [LOCK]);
        let error = OutputFolder::claim(&path).expect_err("the first has it");
        let holder = format!("process {}", std::process::id());
        assert!(error.to_string().contains(&holder), "{error}");
        first.write("x.txt", b"one").expect("it can be written");
        drop(first);
        assert_eq!(names(&path), ["x.txt"]);
        OutputFolder::claim(&path).expect("it is free again");
    }
}
