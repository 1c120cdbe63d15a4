//! What a report or a certificate says, in sections that a terminal and a page show alike.

use crate::table::Table;

/// A part of a report or a certificate, in the order of reading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// What stands above it; nothing where the head of its table says it.
    pub title: String,
    /// Sentences before its table.
    pub sentences: Vec<String>,
    /// Its table, if that has rows.
    pub table: Table,
    /// Sentences after its table.
    pub notes: Vec<String>,
    /// Sentences for a page alone: how the figures are read.
    pub explained: Vec<String>,
}

impl Section {
    /// The section for a terminal: whole lines, all but the first of them two columns to the right.
    pub(crate) fn text(&self) -> String {
        let lines =
            |sentences: &[String]| sentences.iter().map(|sentence| format!("  {sentence}\n")).collect::<String>();
        let title = if self.title.is_empty() { String::new() } else { format!("{}\n", self.title) };
        let table = match (self.table.is_empty(), self.title.is_empty()) {
            (true, _) => String::new(),
            (false, true) => self.table.text_below_head(),
            (false, false) => self.table.text(2),
        };
        title + &lines(&self.sentences) + &table + &lines(&self.notes)
    }
}
