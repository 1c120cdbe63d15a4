//! The two streams: data to stdout, everything else to stderr.

use std::borrow::Cow;
use std::io::{self, ErrorKind, IsTerminal, Write, stderr, stdout};

use serde_json::Value;
use views::fold;

/// How far a line goes on to the right of where it began.
const HANG: usize = 2;

/// Why data did not go to stdout.
#[derive(Debug)]
pub struct NotPrinted(pub io::Error);

/// Prints data to stdout. A reader that has gone away (`| head`) has seen enough, so that is no failure.
///
/// # Errors
/// When stdout cannot be written to for another reason, such as a full disk.
pub fn print(text: &str) -> Result<(), NotPrinted> {
    let mut out = stdout().lock();
    match out.write_all(plain(text).as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(NotPrinted(error)),
        _ => Ok(()),
    }
}

/// Tells a person something, in whole lines on stderr, as wide as a terminal. If stderr is closed, the work goes on all
/// the same.
pub fn tell(text: &str) {
    let line_end = if text.ends_with('\n') { "" } else { "\n" };
    let _ = stderr().lock().write_all(format!("{}{line_end}", fold(&plain(text), HANG)).as_bytes());
}

/// Tells a program something, in one line on stderr.
pub fn tell_json(value: &Value) {
    let _ = stderr().lock().write_all(format!("{value}\n").as_bytes());
}

/// `text` with control characters written out, as `\u{1b}`: what files and jobs say is data, and a terminal would obey
/// it. Line ends and tabs stay.
pub fn plain(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| (c.is_control() && !matches!(c, '\n' | '\t')) || is_turning(c);
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let written = |c: char| if obeyed(c) { c.escape_unicode().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(written).collect())
}

/// Whether a character turns the direction of what follows it, so that a line reads otherwise than it is.
fn is_turning(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Characters of a line that a message shows whole: a path and a sentence.
const LINE_MAX: usize = 800;
/// Of a longer one, how many from its beginning and its end; what was expected stands at the end.
const LINE_KEPT: (usize, usize) = (400, 200);
/// Lines that a message shows whole: the largest map of gaps has about 50.
const LINES_MAX: usize = 80;
/// Of more, how many from its beginning and its end.
const LINES_KEPT: (usize, usize) = (20, 5);

/// `text` short enough to be read: a value from a file may be as long as the file it stands in.
pub fn short(text: &str) -> String {
    let lines: Vec<String> = text.lines().map(short_line).collect();
    if lines.len() <= LINES_MAX {
        return lines.join("\n");
    }
    let (head, tail) = LINES_KEPT;
    let left_out = format!("… {} lines left out …", lines.len() - head - tail);
    [&lines[..head], &[left_out], &lines[lines.len() - tail..]].concat().join("\n")
}

fn short_line(line: &str) -> String {
    let count = line.chars().count();
    if count <= LINE_MAX {
        return line.to_owned();
    }
    let (head, tail) = LINE_KEPT;
    let start: String = line.chars().take(head).collect();
    let end: String = line.chars().skip(count - tail).collect();
    format!("{start} … {} characters left out … {end}", count - head - tail)
}

/// Ends a line that bars may have left half-drawn.
pub fn clear_line() {
    if is_watched() {
        tell("");
    }
}

/// Whether a person sees stderr as it is written.
pub fn is_watched() -> bool {
    stderr().is_terminal() && std::env::var_os("TERM").is_none_or(|kind| kind != "dumb")
}

/// Whether colours are welcome (<https://no-color.org>).
pub fn wants_color() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_written_out_and_line_ends_stay() {
        assert_eq!(plain("a\tb\nc"), "a\tb\nc");
        assert_eq!(plain("\u{1b}[31mred\u{7}\r\u{9b}"), "\\u{1b}[31mred\\u{7}\\u{d}\\u{9b}");
        assert_eq!(plain("a\u{202e}b"), "a\\u{202e}b");
        assert_eq!(plain("Größe, 山"), "Größe, 山");
    }

    #[test]
    fn a_long_value_is_cut_in_its_middle_so_that_what_was_expected_stays() {
        let long = format!("job.toml:1: area.name: found {:?}, expected a name", "ä".repeat(16_000));
        let cut = short(&long);
        assert!(cut.starts_with("job.toml:1: area.name: found \"ä") && cut.ends_with("\", expected a name"), "{cut}");
        assert!(cut.chars().count() < LINE_MAX && cut.contains(" characters left out "), "{cut}");
        assert_eq!(short(&"x\n".repeat(16_000)).lines().count(), 26);
        let whole = "y".repeat(LINE_MAX);
        assert_eq!(short(&whole), whole);
    }
}
