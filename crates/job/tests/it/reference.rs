//! The reference of job files in `docs/reference/job-keys.md`, made from what the reader itself knows.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use job::{Choice, Effort, Key, KeyTable, MethodName, Usual, Values, key_tables};

const HEAD: &str = "\
# Keys of a job file

<!-- Made from crates/job/src/sections.rs and choice.rs: UPDATE_GOLDEN=1 cargo test -p job --test it reference -->

A job is a TOML file; `tiefort init` writes one for the rasters you have, and `tiefort plan JOB.toml` lists every \
setting of it with its value and meaning.
Paths are relative to the job file.
A key that is not listed here is an error.

Costs were measured on the desert of `tests/jobs/desert.toml` (1021 x 1021 posts, 83,000 triangles), those given as a \
range on several areas; a residual is compared with that of the word that holds where the key is left out.
Residuals of the efforts and of the paper's method are those of the second table that `scripts/bench.py fidelity \
--quick --book` writes, which [Figures](../figures/README.md#how-near-to-the-ground-at-equal-triangles) shows.
What each effort costs and gains on other areas, in residual, lines of sight, thin triangles and processor time, is in \
[Figures](../figures/README.md#what-each-effort-costs-and-gains).
Seconds of an effort are what `tiefort plan` forecasts by, on one core; reading, surveying and writing come on top \
of them.
";

/// A cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn values(key: &Key) -> String {
    match &key.values {
        Values::Words(words) => words().iter().map(|[name, ..]| format!("`\"{name}\"`")).collect::<Vec<_>>().join(", "),
        _ => key.expected(),
    }
}

fn usual(key: &Key) -> String {
    let usual = match (key.usual, &key.values) {
        (Usual::Needed, _) => "(needed)".to_owned(),
        (Usual::Is(word), Values::Words(_)) => format!("`\"{word}\"`"),
        (Usual::Is(value), _) => format!("`{value}`"),
        (Usual::Otherwise(what), _) => what.to_owned(),
    };
    match key.methods {
        [] => usual,
        methods => {
            let names: Vec<String> = methods.iter().map(|method| format!("`\"{}\"`", method.name())).collect();
            format!("{usual}; with method {} only", names.join(" or "))
        }
    }
}

fn table(table: &KeyTable) -> String {
    let title = match table.place.contains('.') {
        true => format!("### `{}`", table.place),
        false => format!("## `[{}]`", table.place),
    };
    let mut text = format!("\n{title}\n\n{}\n\n", table.meaning);
    text += "| key | values | where left out | meaning | example |\n| - | - | - | - | - |\n";
    for key in table.keys {
        let row = [values(key), usual(key), key.meaning.to_owned()].map(|text| cell(&text)).join(" | ");
        writeln!(text, "| `{}` | {row} | `{}` |", key.name, key.example_text()).unwrap();
    }
    for key in table.keys {
        let Values::Words(words) = &key.values else { continue };
        let has_costs = words().iter().any(|[.., cost]| !cost.is_empty());
        let head = if has_costs { "| word | meaning | cost |\n| - | - | - |" } else { "| word | meaning |\n| - | - |" };
        write!(text, "\n`{}`, {}:\n\n{head}\n", key.name, key.meaning).unwrap();
        for [name, meaning, cost] in words() {
            let cost = if has_costs { format!(" {} |", cell(&cost)) } else { String::new() };
            writeln!(text, "| `\"{name}\"` | {} |{cost}", cell(&meaning)).unwrap();
        }
    }
    text
}

#[test]
fn the_reference_of_job_files_is_current() {
    let text: String = std::iter::once(HEAD.to_owned()).chain(key_tables().iter().map(table)).collect();
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/job-keys.md");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&page, &text).unwrap();
    }
    let found = std::fs::read_to_string(&page).unwrap();
    assert!(found == text, "UPDATE_GOLDEN=1 cargo test -p job --test it reference writes {} again", page.display());
}

/// RMS residuals of the rows of the book's table of the whole desert, by the words that a row begins with.
fn rms_of_figures(row: &str) -> f64 {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/figures/README.md");
    let figures = std::fs::read_to_string(page).unwrap();
    let table = &figures[figures.find("| the whole desert").unwrap()..];
    let line = table.lines().find(|line| line.starts_with(&format!("| {row}"))).unwrap();
    line.split('|').nth(2).unwrap().trim().parse().unwrap()
}

#[test]
fn the_figures_measure_what_efforts_and_methods_are_said_to_gain() {
    let rms = ["the paper's method", "`fast`", "`normal`", "`best`"].map(rms_of_figures);
    for (effort, pair) in [Effort::Fast, Effort::Normal, Effort::Best].iter().zip(rms.windows(2)) {
        let less = format!("{:.0} % less RMS residual", 100.0 * (1.0 - pair[1] / pair[0]));
        assert!(effort.word().meaning.contains(&less), "{}: {less}", effort.name());
    }
    let paper = MethodName::Paper.word().cost.text();
    assert!(paper.starts_with(&format!("{:.1} times", rms[0] / rms[2])), "{paper}");
}

#[test]
fn what_holds_where_a_key_is_left_out_is_one_of_its_values() {
    let mut seen = BTreeSet::new();
    for table in key_tables() {
        for key in table.keys {
            let name = format!("{}.{}", table.place, key.name);
            assert!(seen.insert(name.clone()), "{name} stands twice");
            assert!(!key.meaning.is_empty() && !key.expected().is_empty(), "{name} says nothing");
            let Usual::Is(usual) = key.usual else { continue };
            let fits = match &key.values {
                Values::Words(words) => words().iter().any(|[word, ..]| word == usual),
                Values::Whole(_, range) => range.contains(&usual.parse().unwrap()),
                Values::Number(_, range) => range.contains(&usual.parse().unwrap()),
                Values::Flag => usual.parse::<bool>().is_ok(),
                Values::Line(..) | Values::Form(_) | Values::Bounded(_) => true,
            };
            assert!(fits, "{name}: {usual} is none of {}", key.expected());
        }
    }
}
