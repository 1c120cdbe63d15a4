//! What the compiler cannot check: who may use whom, sizes, headers, leftovers, links.
//!
//! It reads the project as text, and trusts rustfmt: a function ends at the brace below the line it begins on.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Lines of a function, its head and closing brace included.
const FUNCTION_LINES_MAX: usize = 70;
/// Lines of a file, its tests not counted.
const FILE_LINES_MAX: usize = 500;
/// Lines of a file with its tests.
const FILE_LINES_WITH_TESTS_MAX: usize = 800;
/// Characters of a line of code.
const COLUMNS_MAX: usize = 120;

/// Crates whose integration tests use one that lies above them, to read back what they made.
const TESTS_READ_BACK: [(&str, &str); 1] = [("build", "inspect")];

/// Libraries that would break a promise elsewhere: threads, serialisation, arguments, the terminal, the clock.
const OWNED_LIBRARIES: [(&str, &[&str]); 11] = [
    ("rayon", &["schedule"]),
    ("crossbeam", &["schedule"]),
    // Bodies of requests are read as what they should be, so that a large one takes no more room than its numbers.
    ("serde", &["terrain", "store", "fidelity", "inspect", "tiefort"]),
    ("bincode", &["store"]),
    ("serde_json", &["source-files", "store", "build", "inspect", "views", "exports", "tiefort"]),
    ("clap", &["tiefort"]),
    ("indicatif", &["tiefort"]),
    ("cpu-time", &["tiefort"]),
    ("signal-hook", &["tiefort"]),
    ("axum", &["tiefort"]),
    ("tokio", &["tiefort"]),
];

/// What no file may hold, split so that this one does not: unfinished work, and places of the machine it was made on.
const BANNED_ANYWHERE: [&str; 7] = [
    concat!("TO", "DO"),
    concat!("FIX", "ME"),
    concat!("/wo", "rk/"),
    concat!("/tmp/", "bash"),
    concat!("/tmp/", "target"),
    concat!("crates", ".io"),
    concat!("pypi", ".org"),
];

/// Words that stand for a noun which a stranger would like to read.
const VAGUE_WORDS: [&str; 5] = ["whoever", "nobody", "somebody", "anybody", "whomever"];

/// What no program text outside tests may hold.
const BANNED_IN_PROGRAMS: [&str; 6] =
    [concat!("to", "do!("), concat!("unimpl", "emented!("), concat!("db", "g!("), ".unwrap()", "#[ignore", "unsafe {"];

/// The one crate where `unsafe` may be, so that its lints are its own: the C interface.
const UNSAFE_CRATE: &str = "load-module-reader-c";

/// What only the crates named may hold, outside tests.
const OWNED_WORDS: [(&str, &[&str]); 10] = [
    ("println!(", &["tiefort"]),
    ("print!(", &["tiefort"]),
    ("stdout()", &["tiefort"]),
    ("stderr()", &["tiefort"]),
    ("Instant::", &["tiefort"]),
    ("SystemTime", &["tiefort"]),
    ("std::env::", &["tiefort"]),
    ("thread::spawn", &["schedule", "tiefort"]),
    ("thread::scope", &["schedule"]),
    ("std::fs", &["tiefort", "store", "source-files", "job", "load-module-reader", "load-module-reader-c"]),
];

/// Where functions are tables of cases, longer than code may be: a row for every message of the job reader.
const LONG_TABLES: &str = "crates/job/tests/it/errors";

/// Folders that are not ours to check: built, fetched, or made by a run.
const SKIPPED_FOLDERS: [&str; 6] = ["target", ".git", "scratch", "__pycache__", "node_modules", "dist"];

/// A text file of the project.
struct Text {
    path: PathBuf,
    lines: Vec<String>,
}

impl Text {
    fn is_rust(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension == "rs")
    }

    /// The crate it belongs to, if any.
    fn crate_name(&self) -> Option<String> {
        let mut parts = self.path.iter().map(|part| part.to_string_lossy().into_owned());
        parts.find(|part| part == "crates")?;
        parts.next()
    }

    /// Whether all of it is code for developers: tests, benches, examples.
    fn is_test(&self) -> bool {
        let named = ["tests", "tests.rs", "samples.rs", "benches", "examples"];
        self.path.iter().any(|part| named.contains(&&*part.to_string_lossy()))
    }

    /// The lines before the tests at the end of the file.
    fn program(&self) -> &[String] {
        if self.is_test() {
            return &[];
        }
        let starts_tests = |pair: &[String]| {
            let (attribute, module) = (pair[0].trim(), pair[1].trim());
            attribute == "#[cfg(test)]" && module.contains("mod ") && module.ends_with('{')
        };
        let end = self.lines.windows(2).position(starts_tests).unwrap_or(self.lines.len());
        &self.lines[..end]
    }

    /// Whether it holds long tables.
    fn has_long_tables(&self) -> bool {
        self.path.starts_with(LONG_TABLES)
    }

    fn at(&self, line: usize, what: impl std::fmt::Display) -> String {
        format!("{}:{}: {what}", self.path.display(), line + 1)
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// Every text file of the project, by path from its root.
fn texts() -> Vec<Text> {
    let kinds = ["rs", "toml", "py", "sh", "md", "txt", "run"];
    let mut texts = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root().join(&folder)).unwrap() {
            let name = entry.unwrap().file_name();
            let path = folder.join(&name);
            let full = root().join(&path);
            if full.is_dir() {
                if !SKIPPED_FOLDERS.contains(&&*name.to_string_lossy()) {
                    folders.push(path);
                }
            } else if kinds.contains(&&*path.extension().unwrap_or(&name).to_string_lossy()) {
                let text = fs::read_to_string(full).unwrap();
                texts.push(Text { path, lines: text.lines().map(str::to_owned).collect() });
            }
        }
    }
    texts.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(100 < texts.len(), "the project was not found");
    texts
}

#[track_caller]
fn expect_none(faults: Vec<String>) {
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

/// The crates of the workspace with their `Cargo.toml`.
fn manifests() -> Vec<(String, toml::Table)> {
    let folders = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut manifests: Vec<_> = folders
        .filter(|folder| folder.join("Cargo.toml").exists())
        .map(|folder| {
            let text = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
            (folder.file_name().unwrap().to_string_lossy().into_owned(), text.parse().unwrap())
        })
        .collect();
    manifests.sort_by(|a, b| a.0.cmp(&b.0));
    manifests
}

fn uses(manifest: &toml::Table, section: &str) -> Vec<String> {
    let table = manifest.get(section).and_then(toml::Value::as_table);
    table.map(|table| table.keys().cloned().collect()).unwrap_or_default()
}

#[test]
fn the_architecture_is_told_in_at_most_1200_words() {
    let text = fs::read_to_string(root().join("crates/ARCHITECTURE.md")).unwrap();
    let words = text.split_whitespace().count();
    assert!(words <= 1200, "{words} words");
}

/// The rows of the table in `crates/ARCHITECTURE.md` below a head: what stands first, and the names beside it.
fn table(head: &str) -> Vec<(String, Vec<String>)> {
    let text = fs::read_to_string(root().join("crates/ARCHITECTURE.md")).unwrap();
    let rows = text.lines().skip_while(|line| *line != head).skip(2).take_while(|line| line.starts_with('|'));
    let row = |line: &str| {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let (first, names) = (cells.next().unwrap(), cells.next().unwrap_or(""));
        let names = names.split(',').map(|name| name.trim().to_owned()).filter(|name| !name.is_empty());
        (first.to_owned(), names.collect())
    };
    let rows: Vec<_> = rows.map(row).collect();
    assert!(!rows.is_empty(), "the table {head} was not found");
    rows
}

/// The layer of each crate, and who uses whom: a crate uses only what lies below it. The drawing and the table of
/// `crates/ARCHITECTURE.md` are the one place that says so.
struct Layers {
    of: BTreeMap<String, usize>,
    arrows: BTreeMap<String, Vec<String>>,
}

impl Layers {
    fn read() -> Self {
        let text = fs::read_to_string(root().join("crates/ARCHITECTURE.md")).unwrap();
        let drawing =
            text.lines().skip_while(|line| *line != "## Layers").skip_while(|line| *line != "```text").skip(1);
        let rows: Vec<&str> = drawing.take_while(|line| *line != "```").collect();
        let layers = rows.into_iter().rev().enumerate();
        let of = layers.flat_map(|(layer, row)| row.split_whitespace().map(move |name| (name.to_owned(), layer)));
        Self { of: of.collect(), arrows: table("| crate | uses |").into_iter().collect() }
    }

    fn layer(&self, name: &str) -> Option<usize> {
        self.of.get(name).copied()
    }

    /// Those of our own crates that a manifest names in a section.
    fn uses(&self, manifest: &toml::Table, section: &str) -> Vec<String> {
        uses(manifest, section).into_iter().filter(|name| self.of.contains_key(name)).collect()
    }
}

#[test]
fn a_crate_uses_only_what_the_table_of_arrows_says() {
    let layers = Layers::read();
    let mut faults = Vec::new();
    for (name, manifest) in manifests() {
        let Some(allowed) = layers.arrows.get(&name) else {
            faults.push(format!("{name}: not in the table of arrows"));
            continue;
        };
        let used = layers.uses(&manifest, "dependencies");
        let surplus = used.iter().filter(|to| !allowed.contains(to));
        faults.extend(surplus.map(|to| format!("{name} uses {to}, which the table does not allow")));
        let unused = allowed.iter().filter(|to| !used.contains(to));
        faults.extend(unused.map(|to| format!("{name} does not use {to}, which the table lists")));
    }
    expect_none(faults);
}

#[test]
fn the_drawing_and_the_table_list_the_crates_of_the_workspace() {
    let layers = Layers::read();
    let crates: Vec<String> = manifests().into_iter().map(|(name, _)| name).collect();
    assert_eq!(layers.of.keys().cloned().collect::<Vec<_>>(), crates);
    assert_eq!(layers.arrows.keys().cloned().collect::<Vec<_>>(), crates);
}

#[test]
fn every_arrow_points_down() {
    let layers = Layers::read();
    let mut faults = Vec::new();
    for (from, targets) in &layers.arrows {
        let lower = |to: &&String| layers.layer(to) < layers.layer(from);
        faults.extend(targets.iter().filter(|to| !lower(to)).map(|to| format!("{from} lies no higher than {to}")));
    }
    for (name, manifest) in manifests() {
        for to in layers.uses(&manifest, "dev-dependencies") {
            let reads_back = (name.as_str(), to.as_str());
            if layers.layer(&name) <= layers.layer(&to) && !TESTS_READ_BACK.contains(&reads_back) {
                faults.push(format!("tests of {name} lie no higher than {to}"));
            }
        }
    }
    expect_none(faults);
}

#[test]
fn libraries_that_would_break_a_promise_stay_where_they_belong() {
    let mut faults = Vec::new();
    for (name, manifest) in manifests() {
        let used = uses(&manifest, "dependencies");
        for (library, owners) in OWNED_LIBRARIES {
            if used.iter().any(|used| used == library) && !owners.contains(&name.as_str()) {
                faults.push(format!("{name} uses {library}, which only {owners:?} may"));
            }
        }
    }
    expect_none(faults);
}

#[test]
fn every_crate_takes_the_lints_and_the_version_of_the_workspace() {
    let inherits = |manifest: &toml::Table, section: &str, key: &str| {
        let value = manifest.get(section).and_then(|section| section.get(key));
        value.map(|value| value.get("workspace").unwrap_or(value)).and_then(toml::Value::as_bool) == Some(true)
    };
    let faulty = |(name, manifest): (String, toml::Table)| {
        let lints = name == UNSAFE_CRATE || inherits(&manifest, "lints", "workspace");
        let sound = lints && inherits(&manifest, "package", "version");
        (!sound).then(|| format!("{name}: its lints or version are not the workspace's"))
    };
    expect_none(manifests().into_iter().filter_map(faulty).collect());
}

#[test]
fn every_dependency_has_its_reason_beside_it() {
    let text = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let lines = text.lines().skip_while(|line| *line != "[workspace.dependencies]").skip(1);
    let mut has_reason = false;
    let mut faults = Vec::new();
    for line in lines.take_while(|line| !line.starts_with('[')) {
        let ours = line.contains("path = \"crates/");
        match line.chars().next() {
            None => has_reason = false,
            Some('#') => has_reason = true,
            Some(_) if !ours && !has_reason => faults.push(line.to_owned()),
            // A reason serves the lines below it up to an empty one.
            Some(_) => {}
        }
    }
    expect_none(faults);
}

#[test]
fn every_file_says_at_its_top_what_it_owns() {
    let headless = |text: &&Text| text.is_rust() && !text.lines.first().is_some_and(|line| line.starts_with("//!"));
    expect_none(texts().iter().filter(headless).map(|text| text.at(0, "no //! header")).collect());
}

#[test]
fn no_file_is_too_long() {
    let mut faults = Vec::new();
    for text in texts().iter().filter(|text| text.is_rust()) {
        let (program, all) = (text.program().len(), text.lines.len());
        if FILE_LINES_MAX < program || FILE_LINES_WITH_TESTS_MAX < all {
            faults.push(text.at(all - 1, format!("{program} lines without tests, {all} with them")));
        }
    }
    expect_none(faults);
}

#[test]
fn no_line_of_code_is_too_long() {
    let mut faults = Vec::new();
    let code =
        |text: &&Text| !["md", "txt"].iter().any(|kind| text.path.extension().is_some_and(|found| found == *kind));
    for text in texts().iter().filter(code) {
        for (place, line) in text.lines.iter().enumerate() {
            let columns = line.chars().count();
            if COLUMNS_MAX < columns {
                faults.push(text.at(place, format!("{columns} columns")));
            }
        }
    }
    expect_none(faults);
}

#[test]
fn no_function_is_too_long() {
    let mut faults = Vec::new();
    for text in texts().iter().filter(|text| text.is_rust() && !text.has_long_tables()) {
        for (place, length) in functions(&text.lines) {
            if FUNCTION_LINES_MAX < length {
                faults.push(text.at(place, format!("a function of {length} lines")));
            }
        }
    }
    expect_none(faults);
}

/// Where each function begins, and how many lines it has.
fn functions(lines: &[String]) -> Vec<(usize, usize)> {
    let starts = lines.iter().enumerate().filter(|(_, line)| is_function_head(line));
    starts.filter_map(|(place, line)| Some((place, function_length(&lines[place..], indent(line))?))).collect()
}

fn is_function_head(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().take_while(|word| *word != "fn").collect();
    let qualifier = |word: &&str| word.starts_with("pub") || ["const", "async", "unsafe", "extern"].contains(word);
    words.len() < line.split_whitespace().count() && words.iter().all(qualifier)
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// Lines up to the closing brace at `depth`; `None` for a function without a body.
fn function_length(lines: &[String], depth: usize) -> Option<usize> {
    if lines[0].ends_with('}') || lines[0].ends_with(';') {
        return lines[0].ends_with('}').then_some(1);
    }
    let ends = |line: &&String| indent(line) == depth && (line.trim_start().starts_with('}') || line.ends_with(';'));
    let end = lines.iter().skip(1).position(|line| ends(&line))? + 1;
    Some(end + 1)
}

#[test]
fn nothing_is_left_over() {
    let mut faults = Vec::new();
    for text in texts() {
        for (place, line) in text.lines.iter().enumerate() {
            faults.extend(BANNED_ANYWHERE.iter().filter(|word| line.contains(*word)).map(|word| text.at(place, word)));
        }
        if !text.is_rust() {
            continue;
        }
        let allowed =
            |word: &str| word.starts_with("unsafe") && text.crate_name().is_some_and(|name| name == UNSAFE_CRATE);
        for (place, line) in text.program().iter().enumerate() {
            let found = BANNED_IN_PROGRAMS.iter().filter(|word| code_of(line).contains(*word) && !allowed(word));
            faults.extend(found.map(|word| text.at(place, word)));
        }
    }
    expect_none(faults);
}

/// Endings of programs that documents name by their paths.
const PROGRAMS: [&str; 6] = [".rs", ".py", ".sh", ".c", ".mjs", ".js"];

/// The lines of a document outside blocks of code, with their places.
fn prose(text: &Text) -> impl Iterator<Item = (usize, &str)> {
    let mut is_code = false;
    let outside = move |(_, line): &(usize, &str)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    };
    text.lines.iter().map(String::as_str).enumerate().filter(outside)
}

/// Where the links of a line lead.
fn links(line: &str) -> impl Iterator<Item = &str> {
    line.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

fn documents() -> Vec<Text> {
    let mut texts = texts();
    texts.retain(|text| text.path.extension().is_some_and(|ending| ending == "md"));
    texts
}

#[test]
fn links_of_documents_lead_to_files_that_exist() {
    let mut faults = Vec::new();
    for text in documents() {
        let folder = root().join(text.path.parent().unwrap());
        for (place, line) in prose(&text) {
            let files = links(line).filter(|link| !link.contains("://") && !link.starts_with('#'));
            let lost = files.filter(|link| !folder.join(link.split('#').next().unwrap()).exists());
            faults.extend(lost.map(|link| text.at(place, format!("{link} is not there"))));
        }
    }
    expect_none(faults);
}

/// The anchors of a document's headings, as GitHub and mdBook make them.
fn anchors(text: &Text) -> Vec<String> {
    let headings =
        prose(text).filter_map(|(_, line)| line.strip_prefix('#')?.trim_start_matches('#').strip_prefix(' '));
    let anchor = |heading: &str| {
        let words = heading.trim().to_lowercase().replace(' ', "-");
        words.chars().filter(|c| c.is_alphanumeric() || ['-', '_'].contains(c)).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn anchors_of_links_are_headings() {
    let documents = documents();
    let anchors: BTreeMap<PathBuf, Vec<String>> =
        documents.iter().map(|text| (root().join(&text.path), anchors(text))).collect();
    let mut faults = Vec::new();
    for text in &documents {
        let folder = root().join(text.path.parent().unwrap());
        for (place, line) in prose(text) {
            for link in links(line).filter(|link| !link.contains("://")) {
                let Some((file, anchor)) = link.split_once('#') else { continue };
                let target = if file.is_empty() { root().join(&text.path) } else { folder.join(file) };
                let target = target.canonicalize().unwrap_or(target);
                if !anchors.get(&target).is_some_and(|found| found.iter().any(|found| found == anchor)) {
                    faults.push(text.at(place, format!("{link} is no heading")));
                }
            }
        }
    }
    expect_none(faults);
}

#[test]
fn links_of_the_book_stay_in_the_book() {
    let mut faults = Vec::new();
    for text in documents().iter().filter(|text| text.path.starts_with("docs")) {
        let depth = text.path.components().count() - 2;
        for (place, line) in prose(text) {
            let leaving = links(line).filter(|link| depth < link.matches("../").count());
            faults.extend(leaving.map(|link| text.at(place, format!("{link} leads out of docs, and the built book"))));
        }
    }
    expect_none(faults);
}

#[test]
fn every_page_of_the_book_stands_in_its_summary() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
    let pages = documents().into_iter().filter_map(|text| Some(text.path.strip_prefix("docs").ok()?.to_owned()));
    let lost =
        pages.filter(|page| page != Path::new("SUMMARY.md") && !summary.contains(&format!("({})", page.display())));
    expect_none(lost.map(|page| format!("docs/SUMMARY.md does not list {}", page.display())).collect());
}

#[test]
fn the_readme_has_at_most_700_words() {
    let words = fs::read_to_string(root().join("README.md")).unwrap().split_whitespace().count();
    assert!(words <= 700, "{words} words");
}

#[test]
fn no_text_speaks_of_whoever() {
    let mut faults = Vec::new();
    for text in texts().iter().filter(|text| !text.path.ends_with("tidy.rs")) {
        for (place, line) in text.lines.iter().enumerate() {
            let lower = line.to_lowercase();
            let words = lower.split(|c: char| !c.is_alphanumeric());
            faults.extend(words.filter(|word| VAGUE_WORDS.contains(word)).map(|word| text.at(place, word)));
        }
    }
    expect_none(faults);
}

#[test]
fn programs_that_documents_name_exist() {
    let mut faults = Vec::new();
    for text in documents() {
        for (place, line) in prose(&text) {
            let quoted = line.split('`').skip(1).step_by(2);
            let named = quoted.filter(|word| word.contains('/') && PROGRAMS.iter().any(|end| word.ends_with(end)));
            let lost = named.filter(|word| !["", "crates"].iter().any(|from| root().join(from).join(word).exists()));
            faults.extend(lost.map(|word| text.at(place, format!("{word} is not there"))));
        }
    }
    expect_none(faults);
}

/// A line without its comment.
fn code_of(line: &str) -> &str {
    line.split("//").next().unwrap_or_default()
}

#[test]
fn only_the_command_line_prints_and_looks_at_the_clock() {
    let mut faults = Vec::new();
    for text in texts().iter().filter(|text| text.is_rust()) {
        let Some(name) = text.crate_name() else { continue };
        for (place, line) in text.program().iter().enumerate() {
            for (word, owners) in OWNED_WORDS {
                if code_of(line).contains(word) && !owners.contains(&name.as_str()) {
                    faults.push(text.at(place, format!("{word} belongs to {owners:?}")));
                }
            }
        }
    }
    expect_none(faults);
}

#[test]
fn the_length_of_a_function_is_counted_to_its_brace() {
    let text =
        "pub fn one() {}\n    pub(crate) const fn two(\n        a: u8,\n    ) -> u8 {\n        a\n    }\nfn three();";
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    assert_eq!(functions(&lines), [(0, 1), (1, 5)]);
}
