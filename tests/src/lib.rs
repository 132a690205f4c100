//! Test helpers for every crate of the workspace: tolerances that reject NaN, point clouds from
//! fixed seeds, derivative checks. Depends on none of the crates it helps to test.
#![allow(
    clippy::missing_panics_doc,
    reason = "helpers of tests fail by panicking"
)]

pub mod block;
pub mod broken;
pub mod cloud;
pub mod derivative;
pub mod kuhn;
pub mod picture;
pub mod solve;
pub mod strategies;
pub mod tol;

/// Fails unless a value is as a pattern says, and shows it then.
#[macro_export]
macro_rules! assert_matches {
    ($value:expr, $($pattern:tt)+) => {{
        let value = &$value;
        assert!(matches!(value, $($pattern)+), "{value:?}");
    }};
}

/// What a function gives in a pool of so many threads.
pub fn on_threads<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    pool(threads).install(run)
}

/// A pool of so many threads.
#[must_use]
pub fn pool(threads: usize) -> rayon::ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.expect("a few threads")
}
