//! Criterion benches of `phyxel-enrich`.

fn main() {}
