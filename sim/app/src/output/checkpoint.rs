//! Checkpoints: a scene and the state of its world in one file.

use std::path::Path;

use phyxel_output::{OutputError, OutputFolder};
use serde::Serialize;
use serde::de::DeserializeOwned;

use phyxel::scene::{Override, Scene, SceneError};

/// A checkpoint that cannot be gone on from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// The file is not as it must be.
    #[error(transparent)]
    File(#[from] phyxel_output::CheckpointError),
    /// The scene inside is not valid (any more): its mesh may have gone.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Writes a checkpoint as the file `name` of `folder`; the one before stays until this is whole.
///
/// # Errors
/// [`OutputError::File`].
pub fn write_checkpoint<S: Serialize>(
    folder: &OutputFolder,
    name: &str,
    scene: &Scene,
    state: &S,
) -> Result<(), OutputError> {
    phyxel_output::write_checkpoint(folder, name, &scene.to_ron(), state)
}

/// Reads a checkpoint: the scene, with `overrides` applied, and the state of its world.
///
/// # Errors
/// [`ResumeError`] if the file cannot be read, is no checkpoint, is damaged, comes from
/// another version of the program or holds a scene that is no longer valid.
pub fn read_checkpoint<S: DeserializeOwned>(
    file: &Path,
    overrides: &[Override],
) -> Result<(Scene, S), ResumeError> {
    let (text, state) = phyxel_output::read_checkpoint(file)?;
    let origin = format!("scene of {}", file.display());
    let scene = Scene::from_text(&text, &origin, Path::new(""), overrides)?;
    Ok((scene, state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_comes_back_and_what_is_none_is_refused() {
        let root = tempfile::tempdir().expect("a temporary folder");
        let file = root.path().join("state");
        let folder = OutputFolder::create(root.path()).expect("it is there");
        let scene = Scene::embedded("liver", &[]).expect("it is valid");
        write_checkpoint(&folder, "state", &scene, &[0.1]).expect("it can be written");
        let (again, state): (_, [f64; 1]) = read_checkpoint(&file, &[]).expect("it can be read");
        assert_eq!((again, state[0].to_bits()), (scene, 0.1_f64.to_bits()));
        phyxel_output::write_checkpoint(&folder, "state", "(version: 1, bodies: [])", &[0.1])
            .expect("it can be written");
        let error = read_checkpoint::<[f64; 1]>(&file, &[]).expect_err("no bodies");
        assert!(matches!(error, ResumeError::Scene(_)), "{error}");
    }
}
