//! The program `tiefort`; all of it is in the library beside this file.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(tiefort::command_line(std::env::args_os(), None))
}
