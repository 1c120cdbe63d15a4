//! The reference of `report.json` in `docs/reference/report-keys.md`, made from the definition of the report itself.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use store::Report;
use syn::{Attribute, Expr, ExprLit, Fields, GenericArgument, Item, Lit, Meta, PathArguments, Type};

const HEAD: &str = "\
# Keys of report.json

<!-- Made from crates/store/src/report.rs: UPDATE_GOLDEN=1 cargo test -p store --test it reference -->

`report.json` is what a build found; `tiefort report DATABASE --format json` prints it.
Lengths are in metres, times in seconds.
Rows and columns count from the south-west corner, row first.
A key that *may be absent* is left out where there is nothing to say.
";

/// A key of a part of the report.
struct Key {
    name: String,
    of: Type,
    meaning: String,
    may_be_absent: bool,
}

/// The keys of each structure of the report, and the words of its one enumeration, as the sources define them.
struct Definition {
    keys: BTreeMap<String, Vec<Key>>,
    places: Vec<(String, bool, String)>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn meaning(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    lines.collect::<Vec<_>>().join(" ")
}

/// What `#[serde(…)]` says, as text.
fn serde_words(attributes: &[Attribute]) -> String {
    let lists = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("serde") => Some(list.tokens.to_string()),
        _ => None,
    });
    lists.collect()
}

fn key(field: &syn::Field) -> Key {
    let words = serde_words(&field.attrs);
    let renamed = words.split("rename = \"").nth(1).and_then(|rest| rest.split('"').next());
    let name = renamed.map_or_else(|| field.ident.as_ref().unwrap().to_string(), str::to_owned);
    let may_be_absent = words.contains("skip_serializing_if");
    Key { name, of: field.ty.clone(), meaning: meaning(&field.attrs), may_be_absent }
}

fn definition() -> Definition {
    let mut found = Definition { keys: BTreeMap::new(), places: Vec::new() };
    for file in ["report.rs", "report_features.rs", "manifest.rs"] {
        let text = std::fs::read_to_string(root().join("crates/store/src").join(file)).unwrap();
        for item in syn::parse_file(&text).unwrap().items {
            match item {
                Item::Struct(part) => {
                    if let Fields::Named(fields) = &part.fields {
                        found.keys.insert(part.ident.to_string(), fields.named.iter().map(key).collect());
                    }
                }
                Item::Enum(part) if part.ident == "ReportPlace" => {
                    found.places.extend(part.variants.iter().map(|variant| {
                        let name = variant.ident.to_string().to_lowercase();
                        (name, !variant.fields.is_empty(), meaning(&variant.attrs))
                    }));
                }
                _ => {}
            }
        }
    }
    found
}

/// The name of a type, and those in its angle brackets.
fn parts(of: &Type) -> (String, Vec<Type>) {
    let Type::Path(path) = of else { return ("array".into(), Vec::new()) };
    let last = path.path.segments.last().unwrap();
    let inner = match &last.arguments {
        PathArguments::AngleBracketed(list) => list.args.iter().filter_map(|argument| match argument {
            GenericArgument::Type(inner) => Some(inner.clone()),
            _ => None,
        }),
        _ => return (last.ident.to_string(), Vec::new()),
    };
    (last.ident.to_string(), inner.collect())
}

impl Definition {
    /// What a value of a type is called, and the structure that it is or holds.
    fn value(&self, of: &Type) -> (String, Option<String>) {
        let (name, inner) = parts(of);
        match (name.as_str(), inner.as_slice()) {
            ("String", _) => ("text".into(), None),
            ("Fingerprint", _) => ("64 hexadecimal digits".into(), None),
            ("bool", _) => ("true or false".into(), None),
            ("f64", _) => ("number".into(), None),
            ("u32" | "u64", _) => ("whole number".into(), None),
            ("array", _) => ("two numbers".into(), None),
            ("ReportPlace", _) => ("a [place](#places)".into(), None),
            ("Option", [inner]) => self.value(inner),
            ("Vec", [inner]) => {
                let (text, part) = self.value(inner);
                (format!("list, each: {text}"), part)
            }
            ("BTreeMap", [_, inner]) => {
                let (text, part) = self.value(inner);
                (format!("by name, each: {text}"), part)
            }
            _ => {
                assert!(self.keys.contains_key(&name), "{name} is not known");
                ("a table".into(), Some(name))
            }
        }
    }

    /// The structures below one, outer before inner, with the keys under which they stand.
    fn sections(&self, part: &str, at: &str, found: &mut Vec<(String, Vec<String>)>) {
        match found.iter_mut().find(|(name, _)| name == part) {
            Some((_, places)) => places.push(at.to_owned()),
            None => found.push((part.to_owned(), vec![at.to_owned()])),
        }
        for key in &self.keys[part] {
            if let (text, Some(inner)) = self.value(&key.of) {
                let many = if text.starts_with("list") { "[]" } else { "" };
                let dot = if at.is_empty() { "" } else { "." };
                self.sections(&inner, &format!("{at}{dot}{}{many}", key.name), found);
            }
        }
    }

    fn page(&self) -> String {
        let mut sections = Vec::new();
        self.sections("Report", "", &mut sections);
        let mut text = HEAD.to_owned();
        for (part, places) in sections {
            let title = places.iter().map(|place| format!("`{place}`")).collect::<Vec<_>>().join(", ");
            let title = if part == "Report" { "All of it".to_owned() } else { title };
            write!(text, "\n## {title}\n\n| key | value | meaning |\n| - | - | - |\n").unwrap();
            for key in &self.keys[&part] {
                assert!(!key.meaning.is_empty(), "{part}.{} says nothing", key.name);
                let absent = if key.may_be_absent { "; may be absent" } else { "" };
                let null = if !key.may_be_absent && parts(&key.of).0 == "Option" { " or null" } else { "" };
                let value = self.value(&key.of).0;
                writeln!(text, "| `{}` | {value}{null}{absent} | {} |", key.name, key.meaning).unwrap();
            }
        }
        text += "\n## Places\n\n| place | meaning |\n| - | - |\n";
        for (name, has_numbers, meaning) in &self.places {
            let shape = if *has_numbers { format!("`{{ \"{name}\": [ROW, COL] }}`") } else { format!("`\"{name}\"`") };
            writeln!(text, "| {shape} | {meaning} |").unwrap();
        }
        text
    }

    /// A report with every key that the page lists.
    fn example(&self, of: &Type) -> Value {
        let (name, inner) = parts(of);
        match (name.as_str(), inner.as_slice()) {
            ("String", _) => json!("text"),
            ("Fingerprint", _) => json!("0".repeat(64)),
            ("bool", _) => json!(true),
            ("f64", _) => json!(0.5),
            ("u32" | "u64", _) => json!(7),
            ("array", _) => json!([1, 2]),
            ("ReportPlace", _) => json!({ "module": [1, 2] }),
            ("Option", [inner]) => self.example(inner),
            ("Vec", [inner]) => json!([self.example(inner)]),
            ("BTreeMap", [_, inner]) => json!({ "name": self.example(inner) }),
            _ => Value::Object(
                self.keys[&name].iter().map(|key| (key.name.clone(), self.example(&key.of))).collect::<Map<_, _>>(),
            ),
        }
    }
}

#[test]
fn the_reference_of_the_report_is_current() {
    let text = definition().page();
    let page = root().join("docs/reference/report-keys.md");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&page, &text).unwrap();
    }
    let found = std::fs::read_to_string(&page).unwrap();
    assert!(found == text, "UPDATE_GOLDEN=1 cargo test -p store --test it reference writes {} again", page.display());
}

#[test]
fn a_report_has_every_key_of_the_reference_and_no_other() {
    let example = definition().example(&syn::parse_str("Report").unwrap());
    let report: Report = serde_json::from_value(example.clone()).unwrap();
    let written = serde_json::to_value(&report).unwrap();
    // Pairs of numbers of either kind are written as their own kind is.
    let text = |value: &Value| value.to_string().replace("[1.0,2.0]", "[1,2]");
    assert_eq!(text(&written), text(&example));
}
