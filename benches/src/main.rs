//! `cargo run --release -p benches -- NAME [--quick] [--out DIR]`: see `benches::main`.

use std::process::ExitCode;

fn main() -> ExitCode {
    benches::main()
}
