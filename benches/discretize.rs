//! Criterion benches of `phyxel-discretize`.

fn main() {}
