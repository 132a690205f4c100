//! Criterion benches of `phyxel-splat`.

fn main() {}
