//! What the benches share: one line for each thing that is timed.
#![allow(dead_code, reason = "not every bench has both kinds")]

use std::fmt::Display;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId};

/// Times a function under a name, at a size.
pub(crate) fn time<T>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: impl Into<String>,
    size: impl Display,
    mut run: impl FnMut() -> T,
) {
    group.bench_function(BenchmarkId::new(name, size), |b| b.iter(&mut run));
}

/// The same on one thread.
pub(crate) fn time_on_one<T>(
    group: &mut BenchmarkGroup<'_, WallTime>,
    name: impl Into<String>,
    size: impl Display,
    mut run: impl FnMut() -> T + Send,
) {
    let one = testkit::pool(1);
    group.bench_function(BenchmarkId::new(name, size), |b| {
        one.install(|| b.iter(&mut run));
    });
}
