//! `tiefort completions`: what makes a shell complete commands, flags and their values.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::failure::{Failure, Outcome};
use crate::{Cli, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort completions bash > ~/.local/share/bash-completion/completions/tiefort
  tiefort completions zsh > ~/.zfunc/_tiefort  # fpath+=~/.zfunc in .zshrc
  tiefort completions fish > ~/.config/fish/completions/tiefort.fish

A shell reads them when it starts.";

/// Arguments of `completions`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// For which shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Prints them.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Cli::command(), "tiefort", &mut script);
    terminal::print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Sound)
}
