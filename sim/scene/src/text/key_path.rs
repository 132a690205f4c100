//! Key paths: which value of a scene is meant.

use std::fmt;

/// One step of a key path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Segment {
    /// A key of a group.
    Key(String),
    /// An entry of a list, from 0.
    Index(usize),
}

/// A key path: `bodies[0].material.density`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyPath(pub Vec<Segment>);

impl KeyPath {
    /// Reads a path; nothing where it is not one.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let mut segments = Vec::new();
        for part in text.split('.') {
            let (key, indices) = part
                .split_once('[')
                .map_or((part, None), |(key, rest)| (key, Some(rest)));
            if is_identifier(key) {
                segments.push(Segment::Key(key.to_owned()));
            } else {
                return None;
            }
            if let Some(rest) = indices {
                for index in rest.strip_suffix(']')?.split("][") {
                    segments.push(Segment::Index(index.trim().parse().ok()?));
                }
            }
        }
        Some(Self(segments))
    }

    /// Whether `self` is `other` or lies above it.
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        other.0.starts_with(&self.0)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, segment) in self.0.iter().enumerate() {
            match segment {
                Segment::Key(key) if at == 0 => f.write_str(key)?,
                Segment::Key(key) => write!(f, ".{key}")?,
                Segment::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

pub(crate) fn is_identifier(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests {
    use super::KeyPath;

    #[test]
    fn paths_round_trip_and_reject_noise() {
        for path in ["a", "a.b", "a[3].b[0][1].c_2"] {
            assert_eq!(KeyPath::parse(path).expect("a path").to_string(), path);
        }
        for path in ["", "a.", ".a", "a[", "a[x]", "a[1", "a b", "a[1]b", "1"] {
            assert_eq!(KeyPath::parse(path), None, "{path}");
        }
    }
}
