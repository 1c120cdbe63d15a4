//! The arguments of all commands, and their reference in `docs/reference/commands.md`.

use std::fmt::Write;
use std::path::Path;

use clap::{Arg, Command, CommandFactory};
use job::Job;

use crate::Cli;

const HEAD: &str = "\
# Commands

<!-- Made from crates/tiefort/src/commands: UPDATE_GOLDEN=1 cargo test -p tiefort reference -->

`tiefort COMMAND --help` says the same, and `tiefort man` as manual pages.
";

#[test]
fn the_arguments_of_all_commands_are_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn help_says_of_an_effort_what_a_plan_says() {
    let program = Cli::command();
    let tin = program.find_subcommand("tin").unwrap();
    let effort = tin.get_arguments().find(|argument| argument.get_id() == "effort").unwrap();
    for value in effort.get_possible_values() {
        let job = format!(
            "area = {{ name = \"a\", crs = \"EPSG:32611\", origin_m = [0,0], size_m = [1000, 1000], spacing_m = 5 }}\n\
             dem.source = \"sample\"\ntin.effort = \"{}\"",
            value.get_name()
        );
        let settings = Job::from_text(&job, Path::new("a.toml")).unwrap().describe();
        let planned = settings.into_iter().find(|setting| setting.key == "tin.effort").unwrap();
        assert_eq!(value.get_help().unwrap().to_string(), planned.meaning);
    }
}

/// One argument as a row: how it is written, and all that help says of it.
fn row(argument: &Arg) -> String {
    let short = argument.get_short().map_or(String::new(), |short| format!("-{short}, "));
    let mut text = argument.get_help().map(ToString::to_string).unwrap_or_default();
    let usual: Vec<String> = argument.get_default_values().iter().map(|value| value.to_string_lossy().into()).collect();
    if !usual.is_empty() && argument.get_action().takes_values() {
        write!(text, " [default: {}]", usual.join(", ")).unwrap();
    }
    for value in argument.get_possible_values().iter().filter(|_| argument.get_action().takes_values()) {
        let help = value.get_help().map_or(String::new(), |help| format!(": {help}"));
        write!(text, "<br>`{}`{help}", value.get_name()).unwrap();
    }
    format!("| `{}` | {} |\n", format!("{short}{argument}").replace('|', "\\|"), text.replace('|', "\\|"))
}

fn section(command: &Command) -> String {
    let name = command.get_display_name().unwrap_or(command.get_name()).replace('-', " ");
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let mut text = format!("\n## {name}\n\n{about}.\n\n```text\n{}\n```\n", usage.trim_start_matches("Usage: "));
    let rows: String = command.get_arguments().filter(|argument| argument.get_id() != "help").map(row).collect();
    if !rows.is_empty() {
        text += &format!("\n| argument | meaning |\n| - | - |\n{rows}");
    }
    if let Some(after) = command.get_after_help() {
        text += &format!("\n```text\n{after}\n```\n");
    }
    text
}

#[test]
fn the_reference_of_commands_is_current() {
    let mut program = Cli::command();
    program.build();
    let commands = program.get_subcommands().filter(|command| command.get_name() != "help");
    let text: String = std::iter::once(HEAD.to_owned()).chain(commands.map(section)).collect();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/commands.md");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&page, &text).unwrap();
    }
    let found = std::fs::read_to_string(&page).unwrap();
    assert!(found == text, "UPDATE_GOLDEN=1 cargo test -p tiefort reference writes {} again", page.display());
}
