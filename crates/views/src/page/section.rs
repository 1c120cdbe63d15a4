//! Sections as a page shows them.

use maud::{Markup, html};

use super::marks::Marks;
use crate::section::Section;
use crate::table::{Align, Cell, Table};

/// What stands in a section, below its title.
pub(crate) fn body(section: &Section, marks: &Marks) -> Markup {
    html! {
        @for sentence in &section.sentences { p { (sentence) } }
        @if !section.table.is_empty() { (table(&section.table, marks)) }
        @for sentence in section.notes.iter().chain(&section.explained) { p.quiet { (sentence) } }
    }
}

/// A table that scrolls by itself where it is wider than the screen, and repeats its head where it goes on on paper.
fn table(table: &Table, marks: &Marks) -> Markup {
    let columns = &table.columns;
    let (rows, rest) = table.of_page();
    html! {
        div.wide tabindex="0" {
            table {
                thead { tr { @for column in columns { th.n[column.align == Align::Right] { (column.head) } } } }
                tbody {
                    @for row in rows {
                        tr { @for (cell, column) in row.iter().zip(columns) { (cell_of(cell, column.align, marks)) } }
                    }
                }
            }
        }
        @if let Some(rest) = rest { p.quiet { (rest) "." } }
    }
}

fn cell_of(cell: &Cell, align: Align, marks: &Marks) -> Markup {
    html! {
        @match cell {
            Cell::Plain(text) => td.n[align == Align::Right] { (text) },
            Cell::Code(text) => td { code { (text) } },
            Cell::Keyed(words, key) => td { (words) " " code.quiet { (key) } },
            Cell::Thin(text) => td.thin { (text) },
            Cell::Place(place) => td { (marks.link(*place)) },
            Cell::Share(text, share) => td.n.share {
                span.bar style=(format!("width:{:.1}%", 80.0 * share)) {} (text)
            },
        }
    }
}
