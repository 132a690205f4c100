//! Criterion benches of `phyxel-elastic`.

fn main() {}
