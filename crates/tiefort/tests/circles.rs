//! No file of a crate imports another in a circle: what a file needs can be read before it.
//!
//! An import is a `use` or a path into the same crate, followed through what a file exports for others, down to the
//! file that says it. Tests at the end of a file are not looked at, and neither is the root, which only lists.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Rooms of a crate, each with the others that it may import.
type Rooms = &'static [(&'static str, &'static [&'static str])];

/// Folders of a crate that keep to themselves, and which of the crate's others each may import; the crate's own name is
/// that of the files beside its root. Stages name no other stage, and what lies below knows nothing of what lies above.
const ROOMS: [(&str, Rooms); 4] = [
    (
        "terrain",
        &[
            ("terrain", &[]),
            ("geometry", &["terrain"]),
            ("limits", &["terrain"]),
            ("mask", &["terrain"]),
            ("mesh", &["terrain", "geometry"]),
        ],
    ),
    ("tin", &[("tin", &[]), ("optimiser", &[]), ("tiling", &[]), ("load_modules", &[]), ("methods", &[])]),
    ("store", &[("engine", &[]), ("store", &["engine"])]),
    (
        "build",
        &[
            ("ground", &[]),
            ("product", &["ground"]),
            ("build", &["ground", "product"]),
            ("workbench", &["ground", "build"]),
        ],
    ),
];

/// Names of files in the sources of a crate, without ending: `scan` for `scan.rs` and `scan/mod.rs`, nothing for the
/// root.
type Files = BTreeMap<String, String>;

fn read(folder: &Path, prefix: &str, files: &mut Files) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            read(&path, &format!("{prefix}{name}/"), files);
        } else if path.extension().is_some_and(|ending| ending == "rs") && name != "tests" && name != "samples" {
            let module = match name.as_str() {
                "mod" => prefix.trim_end_matches('/').to_owned(),
                "lib" | "main" if prefix.is_empty() => String::new(),
                name => format!("{prefix}{name}"),
            };
            files.insert(module, program(&fs::read_to_string(path).unwrap()));
        }
    }
}

/// The text without comments and without the tests at its end.
fn program(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let tests = |pair: &[&str]| pair[0] == "#[cfg(test)]" && pair[1].starts_with("mod ") && pair[1].ends_with('{');
    let end = lines.windows(2).position(tests).unwrap_or(lines.len());
    let without_comment = |line: &&str| line.split("//").next().unwrap().to_owned();
    lines[..end].iter().map(without_comment).collect::<Vec<_>>().join("\n")
}

/// The paths of a tree of imports: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expand(prefix: &str, tree: &str, paths: &mut Vec<Vec<String>>) {
    let (mut depth, mut first) = (0, 0);
    for (at, sign) in tree.char_indices().chain([(tree.len(), ',')]) {
        match sign {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = tree[first..at].trim();
                first = at + 1;
                match part.split_once('{') {
                    Some((head, inner)) => {
                        expand(&format!("{prefix}{head}"), inner.rsplit_once('}').unwrap().0, paths);
                    }
                    None if part.is_empty() => {}
                    None => {
                        let path = format!("{prefix}{part}");
                        let named = path.split(" as ").next().unwrap();
                        paths.push(named.split("::").map(|name| name.trim().to_owned()).collect());
                    }
                }
            }
            _ => {}
        }
    }
}

/// What a text imports, or of that only what it exports again.
fn imports(text: &str, only_exported: bool) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for statement in text.split(';') {
        let is_import = |line: &&str| {
            let line = line.trim_start();
            line.starts_with("pub") && line.contains(" use ") || !only_exported && line.starts_with("use ")
        };
        if let Some(line) = statement.lines().find(is_import) {
            let start = statement.find(line).unwrap() + line.find("use ").unwrap() + "use ".len();
            expand("", &statement[start..], &mut paths);
        }
    }
    paths
}

/// Paths that begin at the crate, beside the file, or at a name, which may be that of a file below this one.
fn inline(text: &str) -> Vec<Vec<String>> {
    let is_name = |sign: char| sign.is_alphanumeric() || sign == '_' || sign == ':';
    let paths = text
        .split(|sign: char| !is_name(sign))
        .filter(|path| path.starts_with(char::is_lowercase) && path.contains("::") && !path.ends_with(':'));
    paths.map(|path| path.split("::").map(str::to_owned).collect()).collect()
}

/// A path from the root of the crate, as a file has it; `None` where it leads out of the crate.
fn from_root(files: &Files, file: &str, path: &[String]) -> Option<Vec<String>> {
    let mut here: Vec<String> = file.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
    let mut rest = path;
    match path[0].as_str() {
        "crate" => {
            here.clear();
            rest = &rest[1..];
        }
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|part| part == "super") {
                here.pop();
                rest = &rest[1..];
            }
        }
        first => {
            let child = here.iter().map(String::as_str).chain([first]).collect::<Vec<_>>().join("/");
            if !files.contains_key(&child) {
                return None;
            }
        }
    }
    here.extend_from_slice(rest);
    Some(here)
}

/// The file that says what a path from the root names.
fn resolve(files: &Files, path: &[String], depth: usize) -> String {
    let (count, file) = (0..=path.len())
        .rev()
        .map(|count| (count, path[..count].join("/")))
        .find(|(_, file)| files.contains_key(file))
        .unwrap_or_default();
    let Some(name) = path.get(count).filter(|_| depth < 5) else { return file };
    let Some(text) = files.get(&file) else { return file };
    let exported = imports(text, true).into_iter().find(|export| export.last() == Some(name));
    match exported.and_then(|export| from_root(files, &file, &export)) {
        Some(further) => resolve(files, &further, depth + 1),
        None => file,
    }
}

/// Which files each file imports.
fn edges(files: &Files) -> BTreeMap<&str, BTreeSet<String>> {
    let of_file = |(file, text): (&'_ String, &String)| {
        let paths = imports(text, false).into_iter().chain(inline(text));
        let targets = paths.filter_map(|path| from_root(files, file, &path)).map(|path| resolve(files, &path, 0));
        targets.filter(|target| target != file && !target.is_empty()).collect()
    };
    files
        .iter()
        .filter(|(file, _)| !file.is_empty())
        .map(|(file, text)| (file.as_str(), of_file((file, text))))
        .collect()
}

/// Files that reach each other, each circle once.
fn circles(edges: &BTreeMap<&str, BTreeSet<String>>) -> BTreeSet<String> {
    let reached = |from: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(file) = open.pop() {
            for target in &edges[file] {
                if seen.insert(target.as_str()) {
                    open.push(target);
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&str, BTreeSet<&str>> = edges.keys().map(|&file| (file, reached(file))).collect();
    let circle = |&file: &&str| {
        let both = reach[file].iter().filter(|other| reach[*other].contains(file));
        both.copied().collect::<Vec<_>>().join(" ")
    };
    edges.keys().map(circle).filter(|circle| !circle.is_empty()).collect()
}

/// The sources of each crate, by its name.
fn crates() -> BTreeMap<String, Files> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = fs::read_dir(crates).unwrap().map(|entry| entry.unwrap().path());
    let sources = folders.filter(|folder| folder.join("src").is_dir()).map(|folder| {
        let mut files = Files::new();
        read(&folder.join("src"), "", &mut files);
        (folder.file_name().unwrap().to_string_lossy().into_owned(), files)
    });
    sources.collect()
}

#[test]
fn no_file_imports_another_in_a_circle() {
    let circles = |(name, files): (String, Files)| (name, circles(&edges(&files)));
    let found: Vec<_> = crates().into_iter().map(circles).filter(|(_, found)| !found.is_empty()).collect();
    assert!(found.is_empty(), "circles: {found:#?}");
}

#[test]
fn a_room_of_a_crate_imports_only_what_it_may() {
    let crates = crates();
    let mut faults = Vec::new();
    for (name, rooms) in ROOMS {
        let room = |file: &str| {
            let first = file.split('/').next().unwrap();
            rooms.iter().find(|(room, _)| *room == first && first != name).map_or(name, |(room, _)| room)
        };
        for (file, targets) in edges(&crates[name]) {
            let from = room(file);
            let (_, allowed) = rooms.iter().find(|(room, _)| *room == from).unwrap();
            let strange = targets.iter().filter(|to| room(to) != from && !allowed.contains(&room(to)));
            faults.extend(strange.map(|to| format!("{name}: {file} imports {to}")));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn a_circle_is_found_through_what_a_file_exports() {
    let files: Files = [
        ("", "mod a; mod b; mod c; pub use b::Thing;"),
        ("a", "use crate::{Thing, c};\nfn f() {}"),
        ("b", "use std::fs;\npub struct Thing;\nfn g() -> super::a::Other { super::a::Other }"),
        ("c", "fn h() {}"),
    ]
    .map(|(file, text)| (file.to_owned(), text.to_owned()))
    .into();
    assert_eq!(circles(&edges(&files)), BTreeSet::from(["a b".to_owned()]));
}

#[test]
fn a_circle_of_a_file_and_one_below_it_is_found() {
    let files: Files = [
        ("", "mod a;"),
        ("a", "mod b;\nfn f() -> u8 { b::g() }\nconst ONE: u8 = 1;"),
        ("a/b", "pub(super) fn g() -> u8 { super::ONE }"),
    ]
    .map(|(file, text)| (file.to_owned(), text.to_owned()))
    .into();
    assert_eq!(circles(&edges(&files)), BTreeSet::from(["a a/b".to_owned()]));
}
