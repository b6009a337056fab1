//! The command `treewright`.

use std::process::ExitCode;

fn main() -> ExitCode {
    treewright::cli::run()
}
