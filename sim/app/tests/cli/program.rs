//! Runs the program in a folder of its own.

use std::fs;
use std::path::Path;
use std::process::Command;

/// A temporary working folder.
pub(crate) struct Sandbox {
    folder: tempfile::TempDir,
}

/// What a run of the program left on the terminal.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) status: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Sandbox {
    /// An empty folder.
    pub(crate) fn empty() -> Self {
        Self::new::<&str, &str>(&[])
    }

    /// A folder that holds `files` (name and content).
    pub(crate) fn new<N: AsRef<str>, C: AsRef<[u8]>>(files: &[(N, C)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name.as_ref());
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        Self { folder }
    }

    /// The folder.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Runs the program with the words of a line.
    pub(crate) fn run(&self, line: &str) -> Outcome {
        self.run_with(&line.split_whitespace().collect::<Vec<_>>())
    }

    /// Runs the program; in its output the folder is called `FOLDER`.
    pub(crate) fn run_with(&self, arguments: &[impl AsRef<str>]) -> Outcome {
        let output = Command::new(env!("CARGO_BIN_EXE_phyxel"))
            .args(arguments.iter().map(AsRef::as_ref))
            .current_dir(self.path())
            .output()
            .expect("the program starts");
        let folder = fs::canonicalize(self.path()).unwrap();
        let text = |bytes: Vec<u8>| {
            String::from_utf8(bytes)
                .expect("the program writes UTF-8")
                .replace(&folder.display().to_string(), "FOLDER")
        };
        Outcome {
            status: output.status.code().expect("the program was not killed"),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Starts the program with the words of a line and does not wait for it.
    #[cfg(unix)]
    pub(crate) fn start(&self, line: &str) -> std::process::Child {
        Command::new(env!("CARGO_BIN_EXE_phyxel"))
            .args(line.split_whitespace())
            .current_dir(self.path())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("the program starts")
    }

    /// Everything in the folder, as sorted relative paths; folders end in `/`.
    pub(crate) fn files(&self) -> Vec<String> {
        let mut found = Vec::new();
        let mut open = vec![self.path().to_owned()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.strip_prefix(self.path()).unwrap();
                let name = name.display().to_string();
                if path.is_dir() {
                    found.push(format!("{name}/"));
                    open.push(path);
                } else {
                    found.push(name);
                }
            }
        }
        found.sort();
        found
    }
}
