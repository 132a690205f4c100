//! Criterion benches of `phyxel-integrate`.

fn main() {}
