//! Checkpoints: a scene and the state of its world in one file.
//!
//! Layout, numbers little-endian: the line [`CHECKPOINT_MAGIC`]; the program's version, the scene as RON and the state, each as a length in 8 bytes and its bytes; CRC-32 of all before in 4 bytes.
//! The state is written by postcard, which stores each `f64` as its 8 bytes: what is read back is
//! bitwise equal.

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use phyxel::scene::Scene;
use phyxel_scene::{Override, TextError, read_file};

use super::folder::{OutputError, OutputFolder};
use CheckpointFault as Fault;

/// First line of a checkpoint, with the number of its format.
pub const CHECKPOINT_MAGIC: &[u8] = b"phyxel checkpoint 16\n";
/// How a checkpoint of any format begins.
const FAMILY: &[u8] = b"phyxel checkpoint ";
/// Version of the program, that of all its crates, which a checkpoint belongs to: another may compute other bits.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");
/// Bytes of a length.
const LENGTH: usize = 8;
/// Bytes of the checksum.
const CHECKSUM: usize = 4;

/// What is wrong with the file of a checkpoint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointFault {
    /// It cannot be read.
    #[error("cannot read the checkpoint: {0}")]
    Read(io::Error),
    /// It is something else.
    #[error("not a checkpoint")]
    NotACheckpoint,
    /// A checkpoint of another format, whose state is laid out otherwise.
    #[error("a checkpoint of another format; resume with the phyxel that wrote it")]
    OtherFormat,
    /// It is cut short or changed.
    #[error("the checkpoint is damaged: its checksum does not fit; take an earlier one")]
    Damaged,
    /// Another version of the program, this one, wrote it.
    #[error("written by phyxel {0}, this is {PROGRAM}; resume with the version that wrote it")]
    OtherProgram(String),
    /// The state does not have the form that this program gives it.
    #[error("the state cannot be decoded: {0}")]
    State(postcard::Error),
}

/// A checkpoint that cannot be resumed from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file is at fault.
    #[error("{}: {fault}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        fault: CheckpointFault,
    },
    /// The scene inside is not valid (any more): its mesh may have gone.
    #[error(transparent)]
    Scene(#[from] TextError),
}

/// Writes a checkpoint as the file `name` of `folder`; the one before stays until this is whole.
pub(crate) fn write_checkpoint<S: Serialize>(
    folder: &OutputFolder,
    name: &str,
    scene: &Scene,
    state: &S,
) -> Result<(), OutputError> {
    let state = postcard::to_stdvec(state).map_err(|error| OutputError::File {
        file: folder.path().join(name),
        source: io::Error::new(io::ErrorKind::InvalidData, error),
    })?;
    folder.write(name, &encode(&phyxel_scene::to_ron(scene), &state))
}

/// Reads a checkpoint: the scene, with `overrides` applied, and the state of its world.
///
/// # Errors
/// [`CheckpointError`] if the file cannot be read, is no checkpoint, is damaged, comes from another version of the
/// program or holds a scene that is no longer valid.
pub fn read_checkpoint<S: DeserializeOwned>(
    file: &Path,
    overrides: &[Override],
) -> Result<(Scene, S), CheckpointError> {
    let at_fault = |fault| CheckpointError::File {
        file: file.to_owned(),
        fault,
    };
    let bytes = read_file(file).map_err(|error| at_fault(Fault::Read(error)))?;
    let [program, text, state] = decode(&bytes).map_err(at_fault)?;
    if program != PROGRAM.as_bytes() {
        let found = String::from_utf8_lossy(program).into_owned();
        return Err(at_fault(Fault::OtherProgram(found)));
    }
    let state = postcard::from_bytes(state).map_err(|error| at_fault(Fault::State(error)))?;
    let origin = format!("scene of {}", file.display());
    let text = String::from_utf8_lossy(text);
    let scene = phyxel_scene::from_text(&text, &origin, "", overrides)?;
    Ok((scene, state))
}

fn encode(text: &str, state: &[u8]) -> Vec<u8> {
    packed([PROGRAM.as_bytes(), text.as_bytes(), state])
}

fn packed(parts: [&[u8]; 3]) -> Vec<u8> {
    let mut bytes = CHECKPOINT_MAGIC.to_vec();
    for part in parts {
        bytes.extend((part.len() as u64).to_le_bytes());
        bytes.extend(part);
    }
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// Version, text and state.
fn decode(bytes: &[u8]) -> Result<[&[u8]; 3], Fault> {
    if !bytes.starts_with(CHECKPOINT_MAGIC) {
        return Err(match bytes.starts_with(FAMILY) {
            true => Fault::OtherFormat,
            false => Fault::NotACheckpoint,
        });
    }
    let content = bytes.len().checked_sub(CHECKSUM).ok_or(Fault::Damaged)?;
    let (content, checksum) = bytes.split_at(content);
    if crc32fast::hash(content).to_le_bytes() != checksum {
        return Err(Fault::Damaged);
    }
    let mut rest = content
        .get(CHECKPOINT_MAGIC.len()..)
        .ok_or(Fault::Damaged)?;
    let mut parts = [&[][..]; 3];
    for part in &mut parts {
        let (length, after) = rest.split_first_chunk::<LENGTH>().ok_or(Fault::Damaged)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| Fault::Damaged)?;
        (*part, rest) = after.split_at_checked(length).ok_or(Fault::Damaged)?;
    }
    rest.is_empty().then_some(parts).ok_or(Fault::Damaged)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let folder = OutputFolder::create(root.path()).expect("it is there");
        let scene = phyxel_scene::embedded("liver", &[]).expect("it is valid");
        let subnormal = f64::MIN_POSITIVE / 8.0;
        let state = [0.1, -0.0, subnormal, 1.0 + f64::EPSILON, 1e300];
        write_checkpoint(&folder, "state", &scene, &(7_u64, state)).expect("it can be written");
        let file = root.path().join("state");
        let (again, (seven, read)) =
            read_checkpoint::<(u64, [f64; 5])>(&file, &[]).expect("it can be read");
        assert_eq!((again, seven), (scene, 7));
        assert_eq!(read.map(f64::to_bits), state.map(f64::to_bits));
        fs::write(&file, encode("(version: 1, bodies: [])", &[0])).expect("it can be written");
        let error = read_checkpoint::<[u8; 1]>(&file, &[]).expect_err("no bodies");
        assert!(matches!(error, CheckpointError::Scene(_)), "{error}");
    }

    #[test]
    fn every_cut_and_every_flipped_bit_is_found() {
        let whole = encode("(no scene)", &[7; 40]);
        let parts = decode(&whole).expect("it is whole");
        assert_eq!(parts, [PROGRAM.as_bytes(), b"(no scene)", &[7; 40]]);
        for length in 0..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length} bytes");
        }
        for at in 0..whole.len() * 8 {
            let mut damaged = whole.clone();
            damaged[at / 8] ^= 1 << (at % 8);
            assert!(decode(&damaged).is_err(), "bit {at}");
        }
    }

    #[test]
    fn another_program_or_state_is_refused() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let file = root.path().join("state");
        let text = "(version: 1)";
        fs::write(&file, encode(text, &[3, 1])).expect("it can be written");
        let error = read_checkpoint::<Vec<u64>>(&file, &[]).expect_err("two of three numbers");
        let told = error.to_string();
        assert!(told.contains("the state cannot be decoded"), "{told}");
        let bytes = packed([b"9.9.9", text.as_bytes(), &[]]);
        fs::write(&file, bytes).expect("it can be written");
        let error = read_checkpoint::<Vec<u64>>(&file, &[]).expect_err("another program");
        let told = error.to_string();
        assert!(told.contains("written by phyxel 9.9.9"), "{told}");
    }
}
