//! Criterion benches of `phyxel-mls`.

fn main() {}
