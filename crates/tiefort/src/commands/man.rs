//! `tiefort man`: the manual pages, made of the help texts.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, Command, CommandFactory};
use clap_mangen::Man;

use crate::failure::{Failure, Outcome};
use crate::{Cli, files, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort man build | man -l -
  tiefort man --out ~/.local/share/man/man1      then: man tiefort-build

Pages are those of --help: tiefort(1) and tiefort-COMMAND(1).";

/// Arguments of `man`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// The command whose page to print [default: the page of tiefort itself]
    #[arg(value_name = "COMMAND")]
    command: Option<String>,
    /// Folder to write all pages to, made where it is not there yet; pages of that name are replaced
    #[arg(long, value_name = "DIR", conflicts_with = "command")]
    out: Option<PathBuf>,
}

/// Prints one page, or writes all.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let mut program = Cli::command();
    // Sets the full name of every command.
    program.build();
    let Some(folder) = &arguments.out else {
        terminal::print(&String::from_utf8_lossy(&page(named(&program, arguments.command.as_deref())?)?))?;
        return Ok(Outcome::Sound);
    };
    files::make_folder(folder)?;
    let pages: Vec<&Command> = std::iter::once(&program).chain(commands(&program)).collect();
    for command in &pages {
        let path = folder.join(format!("{}.1", full_name(command)));
        let page = page(command)?;
        files::write_whole(&path, |out| out.write_all(&page))?;
    }
    terminal::tell(&format!("{} pages written to {}", pages.len(), files::shown(folder).display()));
    Ok(Outcome::Sound)
}

/// The command of that name, or the program itself.
fn named<'a>(program: &'a Command, name: Option<&str>) -> Result<&'a Command, Failure> {
    let Some(name) = name else { return Ok(program) };
    commands(program).find(|command| command.get_name() == name).ok_or_else(|| {
        let known: Vec<&str> = commands(program).map(Command::get_name).collect();
        Failure::new(format!("found no command {name:?}, expected one of {}", known.join(", ")), "see tiefort --help")
    })
}

/// All commands but `help`, which has no page of its own.
fn commands(program: &Command) -> impl Iterator<Item = &Command> {
    program.get_subcommands().filter(|command| command.get_name() != "help")
}

fn full_name(command: &Command) -> &str {
    command.get_display_name().unwrap_or(command.get_name())
}

fn page(command: &Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    let rendered = sections(command, &mut page);
    rendered.map_err(|error| Failure::new(format!("the page cannot be made: {error}"), "report this"))?;
    Ok(page)
}

fn sections(command: &Command, page: &mut Vec<u8>) -> io::Result<()> {
    let man =
        Man::new(command.clone()).title(full_name(command)).source(concat!("tiefort ", env!("CARGO_PKG_VERSION")));
    man.render_title(page)?;
    man.render_name_section(page)?;
    man.render_synopsis_section(page)?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    if commands(command).next().is_some() {
        man.render_subcommands_section(page)?;
    }
    let after_help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    page.write_all(examples(&after_help).as_bytes())
}

/// What follows the help of a command, as a section: lines that are set in stay lines of their own.
fn examples(after_help: &str) -> String {
    let Some(rest) = after_help.strip_prefix("Examples:\n") else { return String::new() };
    let mut text = ".SH EXAMPLES\n".to_owned();
    for line in rest.lines() {
        let escaped = line.replace('\\', "\\e").replace('-', "\\-");
        text += &match line {
            "" => ".PP\n".to_owned(),
            _ if line.starts_with(' ') => format!(".nf\n{escaped}\n.fi\n"),
            // A line that begins with these would be a request.
            _ if line.starts_with(['.', '\'']) => format!("\\&{escaped}\n"),
            _ => format!("{escaped}\n"),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_stay_lines_of_their_own_and_no_line_is_taken_for_a_request() {
        let text = examples("Examples:\n  a --b > c.py \\\n      && d\n\n.hidden files\nflow.");
        let examples = ".nf\n  a \\-\\-b > c.py \\e\n.fi\n.nf\n      && d\n.fi\n";
        assert_eq!(text, format!(".SH EXAMPLES\n{examples}.PP\n\\&.hidden files\nflow.\n"));
    }
}
