//! Attributes: the table beside a Shapefile (`.dbf`), and tags that GDAL packs into one column.

use std::collections::HashSet;
use std::sync::Arc;

use super::model::Tags;
use super::value::Value;
use crate::SourceError;
use crate::limits::Allowance;
use crate::store::Store;

/// The rows of a table: each the name and the text of every column that holds something.
pub(super) struct Table {
    columns: Vec<Column>,
    row_bytes: usize,
    rows: Vec<u8>,
    is_utf8: bool,
    /// How it says that its texts are written, where that is no way that is read and some text is beyond ASCII.
    pub unread: Option<String>,
}

struct Column {
    name: String,
    /// Its type, as the table has it: a letter.
    kind: u8,
    bytes: std::ops::Range<usize>,
}

impl Table {
    /// Reads the table in `bytes`; `encoding` is what a `.cpg` beside it says.
    pub(super) fn read(store: &Store, bytes: Vec<u8>, encoding: Option<&str>) -> Result<Self, SourceError> {
        let short = |what: &str, expected: usize| SourceError::Truncated {
            path: store.path().into(),
            what: what.into(),
            expected: expected as u64,
            found: bytes.len() as u64,
        };
        let head = bytes.get(..32).ok_or_else(|| short("the head of the table", 32))?;
        let row_count = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        let rows_at = usize::from(u16::from_le_bytes([head[8], head[9]]));
        let row_bytes = usize::from(u16::from_le_bytes([head[10], head[11]]));
        // GDAL writes UTF-8 without a mark in the table itself.
        let (is_utf8, unread) = encoding_of(encoding, head[29]);
        let (mut columns, mut at) = (Vec::new(), 1);
        let described = bytes.get(32..rows_at).ok_or_else(|| short("the columns of the table", rows_at))?;
        for field in described.chunks_exact(32).take_while(|field| field[0] != 0x0d) {
            let name = field[..11].split(|&byte| byte == 0).next().unwrap_or_default();
            let name = decoded(name, is_utf8);
            let end = at + usize::from(field[16]);
            columns.push(Column { name, kind: field[11], bytes: at..end });
            at = end;
        }
        if row_bytes < at {
            let found = format!("columns of {at} bytes in rows of {row_bytes}");
            return Err(store.malformed("the table", found, "columns that fit into a row"));
        }
        let end = rows_at.saturating_add(row_count.saturating_mul(row_bytes));
        let rows = bytes.get(rows_at..end).ok_or_else(|| short("the rows of the table", end))?.to_vec();
        let is_beyond_ascii = !rows.is_ascii() || columns.iter().any(|column| !column.name.is_ascii());
        let unread = unread.filter(|_| is_beyond_ascii);
        Ok(Self { columns, row_bytes, rows, is_utf8, unread })
    }

    /// The columns of a row that hold something, and whether the row is marked as deleted; `None` beyond the last.
    pub(super) fn row(&self, index: usize) -> Option<(Vec<(&str, String)>, bool)> {
        let row = self.rows.get(index.checked_mul(self.row_bytes)?..)?.get(..self.row_bytes)?;
        let text = |column: &Column| {
            let bytes = &row[column.bytes.clone()];
            let bytes = bytes.split(|&byte| byte == 0).next().unwrap_or_default();
            let text = decoded(bytes, self.is_utf8);
            let text = if column.kind == b'C' { text.trim_end() } else { text.trim() };
            let value = match (column.kind, text) {
                (_, "") => return None,
                (b'C', text) => Value::Text(text.to_owned()),
                (b'L', "T" | "t" | "Y" | "y") => Value::Truth(true),
                (b'L', "F" | "f" | "N" | "n") => Value::Truth(false),
                (b'L', _) => return None,
                (b'D', text) => Value::Day(text.to_owned()),
                // Stars fill a number that its column had no room for.
                (_, text) if text.starts_with('*') => return None,
                (b'N' | b'F', text) => Value::written(text),
                (_, text) => Value::Text(text.to_owned()),
            };
            value.text()
        };
        let columns = self.columns.iter().filter_map(|column| Some((column.name.as_str(), text(column)?)));
        Some((columns.collect(), row[0] == b'*'))
    }
}

fn decoded(bytes: &[u8], is_utf8: bool) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) if is_utf8 || text.is_ascii() => text.to_owned(),
        _ if is_utf8 => String::from_utf8_lossy(bytes).into_owned(),
        _ => bytes.iter().map(|&byte| western(byte)).collect(),
    }
}

/// A character of Windows-1252, which writers take for ISO 8859-1 and the other way round; both differ in these only.
fn western(byte: u8) -> char {
    const FROM_128: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    usize::from(byte).checked_sub(128).and_then(|at| FROM_128.get(at)).copied().unwrap_or(byte.into())
}

/// Whether texts are UTF-8, by what a `.cpg` says, else by the mark of the table itself; and what that is where it is
/// neither UTF-8 nor Western European.
fn encoding_of(cpg: Option<&str>, mark: u8) -> (bool, Option<String>) {
    const UTF_8: [&str; 2] = ["UTF8", "65001"];
    const WESTERN: [&str; 9] =
        ["ISO88591", "88591", "LATIN1", "CP1252", "1252", "WINDOWS1252", "ANSI1252", "ASCII", "USASCII"];
    // Those of Windows-1252, of "ANSI", and none.
    const WESTERN_MARKS: [u8; 5] = [0x00, 0x03, 0x57, 0x58, 0x59];
    match cpg.map(str::trim).filter(|name| !name.is_empty()) {
        Some(name) => {
            let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
            let is_one_of = |names: &[&str]| names.contains(&plain.to_ascii_uppercase().as_str());
            let is_read = is_one_of(&UTF_8) || is_one_of(&WESTERN);
            (is_one_of(&UTF_8), (!is_read).then(|| format!("the .cpg beside it says {name}")))
        }
        None if WESTERN_MARKS.contains(&mark) => (false, None),
        None => {
            let page = match mark {
                0x01 => "CP437".to_owned(),
                0x02 => "CP850".to_owned(),
                mark => format!("code page mark {mark}"),
            };
            (false, Some(format!("its table (.dbf) says {page}")))
        }
    }
}

/// GDAL gives the tags of OpenStreetMap that have no column of their own as one text, `"bridge"=>"yes","layer"=>"1"`.
/// They are tags like the others.
const PACKED_TAGS: &str = "other_tags";

/// Attributes with the tags that one of them packs, unless the text is something else.
pub(super) fn with_packed_tags<'t>(all: impl IntoIterator<Item = (&'t str, &'t str)>) -> Vec<(&'t str, &'t str)> {
    let mut tags = Vec::new();
    for (key, value) in all {
        match (key == PACKED_TAGS).then(|| packed(value)).flatten() {
            Some(mut unpacked) => tags.append(&mut unpacked),
            None => tags.push((key, value)),
        }
    }
    tags
}

fn packed(text: &str) -> Option<Vec<(&str, &str)>> {
    let inner = text.trim().strip_prefix('"')?.strip_suffix('"')?;
    inner.split("\",\"").map(|pair| pair.split_once("\"=>\"")).collect()
}

/// Texts that are the same, kept once.
#[derive(Debug, Default)]
pub(super) struct Texts {
    kept: HashSet<Arc<str>>,
    /// Bytes kept since they were last asked for.
    bytes: usize,
}

impl Texts {
    pub(super) fn keep(&mut self, text: &str) -> Arc<str> {
        if let Some(kept) = self.kept.get(text) {
            return kept.clone();
        }
        let kept: Arc<str> = text.into();
        self.kept.insert(kept.clone());
        self.bytes += text.len() + 64;
        kept
    }

    /// Counts what was kept since this was last called.
    pub(super) fn count(&mut self, allowance: &Allowance) {
        allowance.count(std::mem::take(&mut self.bytes));
    }

    /// Tags in the order that features have them.
    pub(super) fn tags<'t>(&mut self, all: impl IntoIterator<Item = (&'t str, &'t str)>) -> Tags {
        let mut tags: Tags = all.into_iter().map(|(key, value)| (self.keep(key), self.keep(value))).collect();
        tags.sort();
        tags
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_that_are_packed_into_one_text_are_tags_of_their_own() {
        let tags = [("name", "a"), ("other_tags", r#""bridge"=>"yes","layer"=>"1""#)];
        assert_eq!(with_packed_tags(tags), [("name", "a"), ("bridge", "yes"), ("layer", "1")]);
        assert_eq!(with_packed_tags([("other_tags", "none")]), [("other_tags", "none")]);
    }
}
