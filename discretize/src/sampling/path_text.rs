//! File names as text, for `#[serde(with = "phyxel_discretize::path_text")]`: a name that is not UTF-8 keeps its
//! bytes.
//!
//! A byte that is no part of a character is written as the character U+EF00 + byte, and so are the
//! bytes of such characters themselves, so that every name comes back as it was.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer, Serializer};

#[cfg(unix)]
const FIRST: u32 = 0xef00;

/// Writes a file name as text.
///
/// # Errors
/// What the serializer says.
pub fn serialize<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&to_text(path))
}

/// Reads a file name from a text.
///
/// # Errors
/// What the deserializer says; any text is a name.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<PathBuf, D::Error> {
    Ok(to_path(&String::deserialize(deserializer)?))
}

#[cfg(unix)]
fn to_text(path: &Path) -> String {
    use std::os::unix::ffi::OsStrExt;
    let raw = |byte: u8| char::from_u32(FIRST + u32::from(byte)).unwrap_or('?');
    let mut text = String::new();
    for chunk in path.as_os_str().as_bytes().utf8_chunks() {
        for character in chunk.valid().chars() {
            if byte_of(character).is_some() {
                let mut bytes = [0; 4];
                text.extend(character.encode_utf8(&mut bytes).bytes().map(raw));
            } else {
                text.push(character);
            }
        }
        text.extend(chunk.invalid().iter().copied().map(raw));
    }
    text
}

#[cfg(unix)]
fn to_path(text: &str) -> PathBuf {
    use std::os::unix::ffi::OsStringExt;
    let mut bytes = Vec::with_capacity(text.len());
    for character in text.chars() {
        match byte_of(character) {
            Some(byte) => bytes.push(byte),
            None => bytes.extend(character.encode_utf8(&mut [0; 4]).bytes()),
        }
    }
    std::ffi::OsString::from_vec(bytes).into()
}

/// The byte that a character stands for; only bytes beyond ASCII have one.
#[cfg(unix)]
fn byte_of(character: char) -> Option<u8> {
    let byte = u32::from(character).checked_sub(FIRST)?;
    u8::try_from(byte).ok().filter(|byte| *byte >= 0x80)
}

#[cfg(not(unix))]
fn to_text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[cfg(not(unix))]
fn to_path(text: &str) -> PathBuf {
    PathBuf::from(text)
}

#[cfg(all(test, unix))]
mod tests {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    use std::path::Path;

    use super::{to_path, to_text};

    #[test]
    fn every_name_comes_back() {
        let names: [&[u8]; 5] = [
            b"liver.stl",
            "leber_\u{e4}.stl".as_bytes(),
            b"leber_\xe4.stl",
            b"\xff\xfe\x80",
            "private \u{ef80}\u{efff} \u{ef7f}".as_bytes(),
        ];
        for name in names {
            let path = Path::new(OsStr::from_bytes(name));
            assert_eq!(to_path(&to_text(path)), path, "{}", to_text(path));
        }
        assert_eq!(to_text(Path::new("a/b.stl")), "a/b.stl", "as it is");
    }
}
