//! The `phyxel` command line.

fn main() {}
