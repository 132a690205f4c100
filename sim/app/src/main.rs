//! The `phyxel` command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    phyxel_cli::cli::main()
}
