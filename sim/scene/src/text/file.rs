//! Files with texts.

use std::fs;
use std::io;
use std::path::Path;

/// The text of a file, without a byte-order mark.
///
/// # Errors
/// What the system says, and an error that says what a file holds instead of UTF-8.
pub fn read_text(file: &Path) -> io::Result<String> {
    let bytes = read_file(file)?;
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let problem = match bytes {
        [] => "it is empty",
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "it is in UTF-16; save it as UTF-8",
        [0x1f, 0x8b, ..] => "it is packed by gzip; unpack it first",
        [b'P', b'K', 3, 4, ..] => "it is a zip archive; unpack it first",
        _ => {
            return String::from_utf8(bytes.to_vec())
                .map_err(|error| invalid(error.utf8_error().to_string()));
        }
    };
    Err(invalid(problem.to_owned()))
}

/// The content of a regular file: a pipe or a device may never end.
///
/// # Errors
/// What the system says, and an error of kind `InvalidInput` for anything but a file.
pub fn read_file(file: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(file)?.is_file() {
        let problem = "not a regular file; write it into a file first";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    fs::read(file)
}

fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}
