//! A build file for ninja: one host, one process a task.

use std::fmt::Write;
use std::path::Path;

use super::glue::{Glue, shell_word};

/// The build file.
pub fn ninja(glue: &Glue) -> String {
    let (rows, columns) = glue.tiles;
    let mut text = format!(
        "# Gaming area {} in {rows} x {columns} tiles, for ninja: `ninja -f THIS_FILE`.\n\
         # A task leaves a mark beside the database; delete the marks to have every task look again.\n\n",
        glue.area
    );
    let (program, job, out) = (shell_word(&glue.program), shell_word(&glue.job), shell_word(&glue.out));
    let marks = format!("{}.marks", glue.out.display());
    // Breaches are a result: publishing with some of them is a success.
    let commands = [
        ("unit", "$tiefort task $job $words --out $database --workers 1 --quiet && touch $mark"),
        ("publish", "{ $tiefort task $job publish --out $database --quiet || [ $$? -eq 1 ]; } && touch $mark"),
    ];
    for (name, value) in [("tiefort", program), ("job", job), ("database", out)] {
        writeln!(text, "{name} = {}", escaped(&value, false)).expect("a text takes all that is written to it");
    }
    for (rule, command) in commands {
        text += &format!("\nrule {rule}\n  command = {command}\n  description = $words\n");
    }
    let mark = |place: usize| escaped(&format!("{marks}/{}", glue.tasks[place].name()), true);
    let inputs: String =
        [&glue.job].into_iter().chain(&glue.sources).map(|path| format!(" {}", path_of(path))).collect();
    for (place, task) in glue.tasks.iter().enumerate() {
        let after: String = task.after.iter().map(|&other| format!(" {}", mark(other))).collect();
        let rule = if task.stage == "publish" { "publish" } else { "unit" };
        // Ninja makes the folder of an output by itself.
        text += &format!("\nbuild {}: {rule}{after} |{inputs}\n", mark(place));
        text += &format!("  words = {}\n", task.words());
        text += &format!("  mark = {}\n", escaped(&shell_word(Path::new(&format!("{marks}/{}", task.name()))), false));
    }
    text
}

fn path_of(path: &Path) -> String {
    escaped(&path.to_string_lossy(), true)
}

/// Text as ninja wants it; in a list of paths spaces and colons are told apart too.
fn escaped(text: &str, in_list: bool) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        if character == '$' || (in_list && matches!(character, ' ' | ':')) {
            escaped.push('$');
        }
        escaped.push(character);
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dollars_spaces_and_colons_are_told_apart() {
        assert_eq!(escaped("a b:$c", true), "a$ b$:$$c");
        assert_eq!(escaped("a b:$c", false), "a b:$$c");
    }
}
