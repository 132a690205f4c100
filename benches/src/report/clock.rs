//! Measured time, and the machine it was measured on.

use std::hint::black_box;
use std::time::Instant;

/// Result of the last of `times` runs of `work` and their median wall time (s).
///
/// # Panics
/// If `times` is 0.
pub(crate) fn median_time<T>(times: usize, mut work: impl FnMut() -> T) -> (T, f64) {
    let mut seconds = Vec::with_capacity(times);
    let mut last = None;
    for _ in 0..times {
        let start = Instant::now();
        last = Some(black_box(work()));
        seconds.push(start.elapsed().as_secs_f64());
    }
    let measured = last.zip(median(&seconds));
    measured.expect("something must be measured")
}

/// The upper median; None of nothing.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// Threads in use, the processor where the system names it, and version, in a line.
pub(crate) fn machine() -> String {
    let about = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = about.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| format!(" of {}", value.trim()))
    });
    format!(
        "{} threads{}, phyxel {}, {} build",
        rayon::current_num_threads(),
        model.unwrap_or_default(),
        env!("CARGO_PKG_VERSION"),
        if cfg!(debug_assertions) {
            "checked"
        } else {
            "release"
        }
    )
}
