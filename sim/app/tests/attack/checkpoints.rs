//! Checkpoints damaged with and without a checksum that fits.

use std::path::Path;

use crate::watch;
use phyxel_cli::output::CHECKPOINT_MAGIC;
use testkit::broken::broken;
use testkit::cloud::Random;

const SCENE: &str = include_str!("kept.ron");

/// A checkpoint to damage.
pub(crate) struct Kept(Vec<u8>);

impl Kept {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.ron"), SCENE).unwrap();
        let ended = watch::run(folder.path(), "run scene.ron --out out --quiet");
        assert!(ended.status.success(), "{}", ended.stderr);
        Self(std::fs::read(folder.path().join("out/state.checkpoint")).unwrap())
    }

    pub(crate) fn case(&self, folder: &Path, random: &mut Random) -> Option<String> {
        let damaged = match random.below(4) {
            0 => broken(self.0.clone(), random),
            1 => sealed(broken(self.0[..self.0.len() - 4].to_vec(), random)),
            _ => self.with_another_state(random),
        };
        let same = damaged == self.0;
        std::fs::write(folder.join("state.checkpoint"), &damaged).unwrap();
        let line = "run --resume state.checkpoint --out out --threads 1 --quiet --json \
                    --set integration.duration=0.0065";
        let ended = watch::run(folder, line);
        let sealed = seal(&damaged[..damaged.len().saturating_sub(4)]);
        let fits = damaged.ends_with(&sealed);
        ended.fault().or_else(|| {
            (ended.status.success() && !fits && !same).then(|| "its damage was not seen".to_owned())
        })
    }

    /// The same with a state that is broken and whose length and checksum fit.
    fn with_another_state(&self, random: &mut Random) -> Vec<u8> {
        let mut at = CHECKPOINT_MAGIC.len();
        let mut parts = Vec::new();
        for _ in 0..3 {
            let length = u64::from_le_bytes(self.0[at..at + 8].try_into().unwrap()) as usize;
            parts.push(self.0[at + 8..at + 8 + length].to_vec());
            at += 8 + length;
        }
        parts[2] = match random.below(3) {
            // Numbers among the state's own.
            0 => {
                let mut state = parts[2].clone();
                for _ in 0..=random.below(3) {
                    let odd = [f64::NAN, f64::INFINITY, 0.0, -1e300, 1e300, 1e-300, -1.0];
                    let place = random.below(state.len() - 8);
                    state[place..place + 8].copy_from_slice(&random.pick(&odd).to_le_bytes());
                }
                state
            }
            1 => {
                let mut state = parts[2].clone();
                let place = random.below(state.len().min(2000));
                state[place] = random.bits() as u8;
                state
            }
            _ => broken(parts[2].clone(), random),
        };
        let mut out = CHECKPOINT_MAGIC.to_vec();
        for part in parts {
            out.extend((part.len() as u64).to_le_bytes());
            out.extend(part);
        }
        sealed(out)
    }
}

fn seal(content: &[u8]) -> [u8; 4] {
    crc32fast::hash(content).to_le_bytes()
}

fn sealed(mut content: Vec<u8>) -> Vec<u8> {
    let seal = seal(&content);
    content.extend(seal);
    content
}
