//! What a page says besides its tables: whether limits are met, what is in the ground, what to change, and what all of
//! it was made from.

use maud::{Markup, html};
use store::{Manifest, Report, ReportFeatures};

use super::advise;
use crate::parts::{is_thin, kept};
use crate::section::Section;
use crate::table::{Cell, Table, grouped};

/// One setting of a job, as the page lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageSetting {
    /// The key with its section.
    pub key: String,
    /// The value as the job file writes it.
    pub value: String,
    /// What it means.
    pub meaning: String,
}

pub(super) fn verdict(report: &Report) -> Markup {
    let breaches = report.breaches.len() as u64;
    let is_short = 0 < breaches || !report.warnings.is_empty();
    html! {
        div.verdict.breached[is_short] {
            @if 0 < breaches {
                p {
                    b { (grouped(breaches)) } @if breaches == 1 { " limit is" } @else { " limits are" }
                    " not met: see " a href="#breaches" { "breaches" } "."
                }
            }
            @for warning in &report.warnings { p { b { "Warning: " } (warning) } }
            @if breaches == 0 { p { "Every limit is met." } }
        }
    }
}

/// How much of every class is in the ground, in a line; too little of one stands out.
pub(super) fn in_the_ground(features: &ReportFeatures) -> Markup {
    let told: Vec<_> = features.classes.iter().filter_map(|class| Some((class, kept(class)?))).collect();
    html! {
        @if !told.is_empty() {
            p.kept { "In the ground: "
                @for (at, (class, kept)) in told.iter().enumerate() {
                    @if 0 < at { ", " }
                    span.thin[is_thin(class)] {
                        (class.name) " " (format!("{:.1} %", 100.0 * kept))
                        @if 0.0 < class.wanted_km { (format!(" of {:.1} km", class.wanted_km)) }
                        @else { " of " (grouped(class.lakes_wanted)) " lakes of a hectare" }
                    }
                }
                "."
            }
        }
    }
}

pub(super) fn advice(report: &Report) -> Markup {
    let advice = advise(report);
    html! {
        h3 { "What to change" }
        @if advice.is_empty() { p { "Nothing binds: more would need finer ground, not other limits." } }
        @for advice in advice {
            div.advice {
                p { b { (advice.policy) } ": " (advice.found) }
                p { code { (advice.change) } }
                p { (advice.effect) }
            }
        }
    }
}

/// What was built from which sources, and with which settings.
pub(super) fn made_from(manifest: &Manifest, settings: &[PageSetting]) -> [Section; 2] {
    let mut sources = Table::default().words(["Source", "BLAKE3 of its content", "Attribution"]);
    for source in &manifest.sources {
        let attribution = source.attribution.clone().unwrap_or_default();
        sources.row([Cell::Code(source.path.clone()), Cell::Code(source.blake3.to_string()), attribution.into()]);
    }
    let (revision, format) = (manifest.algorithm_revision, manifest.format_version);
    let notes = vec![format!("Algorithm revision {revision}, database format {format}.")];
    let mut table = Table::default().words(["Key", "Value", "Meaning"]);
    for PageSetting { key, value, meaning } in settings {
        table.row([Cell::Code(key.clone()), Cell::Code(value.clone()), meaning.into()]);
    }
    let sources = Section { table: sources, notes, ..Section::default() };
    [sources, Section { title: "Settings".into(), table, ..Section::default() }]
}
