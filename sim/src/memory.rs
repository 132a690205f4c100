//! Memory that is asked for before it is taken: a system that has none left ends a program without a word.

use std::fs;

/// Bytes of a node with its neighbours, stencil and model, and what building and running them takes: twice the 2.9 kB
/// that the peaks of runs of the liver with 20,000 and 80,000 nodes differ by (2.0 kB for `check`).
pub(crate) const NODE: f64 = 6e3;

/// Something takes more memory than there is.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("it takes about {:.1} GB of memory and {:.1} GB are free", 1e-9 * bytes, 1e-9 * free)]
pub struct MemoryShortage {
    /// Bytes asked for.
    pub bytes: f64,
    /// Bytes that the system can give.
    pub free: f64,
}

/// Asks whether so many bytes can be taken; where the system does not say, they can.
///
/// # Errors
/// [`MemoryShortage`].
pub fn ask_memory(bytes: f64) -> Result<(), MemoryShortage> {
    match free() {
        Some(free) if bytes > free => Err(MemoryShortage { bytes, free }),
        _ => Ok(()),
    }
}

/// Bytes that the system can give: of Linux, what is available, no more than a control group's limit.
fn free() -> Option<f64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let mut lines = text.lines();
    let available = lines.find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: f64 = available.split_whitespace().next()?.parse().ok()?;
    let limit = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let limit = limit.and_then(|text| text.trim().parse::<f64>().ok());
    Some((1024.0 * kibibytes).min(limit.unwrap_or(f64::INFINITY)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_there_is_is_refused() {
        assert_eq!(ask_memory(1.0), Ok(()));
        if free().is_some() {
            let text = ask_memory(1e18).unwrap_err().to_string();
            assert!(text.starts_with("it takes about 1000000000.0 GB"), "{text}");
        }
    }
}
