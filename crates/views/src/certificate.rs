//! A certificate: what was compared, by which plan, what was found, and whether that is accepted, as text or as a page
//! for a reader who does not know the program.

use std::fmt::Write;

use maud::{Markup, PreEscaped, html};
use serde_json::Value;

use crate::page::{Marks, body, document};
use crate::picture::palette;
use crate::section::Section;
use crate::table::fold;

/// What a certificate says.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// What stands above it.
    pub title: String,
    /// The result in a sentence, and whether it is a good one.
    pub verdict: (bool, String),
    /// Its parts, in the order of reading.
    pub sections: Vec<Section>,
    /// Where two surfaces differ.
    pub map: Option<CertificateMap>,
}

/// Values over squares of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct CertificateMap {
    /// What it shows.
    pub title: String,
    /// Rows of squares, from the south.
    pub rows: usize,
    /// Columns of squares, from the west.
    pub cols: usize,
    /// Extent of the area east and north, in metres.
    pub size_m: [f64; 2],
    /// A value of each square in metres, row by row; `None` where there is none.
    pub values_m: Vec<Option<f64>>,
    /// The value, either way, that has the full colour.
    pub scale_m: f64,
}

/// The certificate for a terminal.
pub fn certificate_text(certificate: &Certificate) -> String {
    let sections: String = certificate.sections.iter().map(|section| format!("\n{}", section.text())).collect();
    fold(&format!("{}\n{sections}", certificate.verdict.1), 2)
}

/// The certificate as a page: one file that loads nothing and runs nothing.
pub fn certificate_html(certificate: &Certificate) -> String {
    let Certificate { title, verdict: (is_good, verdict), sections, map } = certificate;
    let found = html! {
        div.verdict.breached[!is_good] { p { b { (verdict) } } }
        main {
            @for section in sections { section { h2 { (section.title) } (body(section, &Marks::default())) } }
            @if let Some(map) = map { section { h2 { (map.title) } (picture(map)) } }
        }
    };
    document(title, &found)
}

/// Squares in the colours of residuals, north up.
fn picture(map: &CertificateMap) -> Markup {
    const LONGER: f64 = 560.0;
    let scale = LONGER / map.size_m[0].max(map.size_m[1]);
    let [wide, high] = map.size_m.map(|metres| metres * scale);
    let (step_x, step_y) = (wide / map.cols as f64, high / map.rows as f64);
    let all = palette();
    let colors: Vec<&str> = all["residuals"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let color = |value_m: f64| {
        let share = (0.5 + 0.5 * value_m / map.scale_m).clamp(0.0, 1.0);
        colors[(share * (colors.len() - 1) as f64).round() as usize]
    };
    let mut svg =
        format!("<svg viewBox=\"0 0 {wide:.0} {high:.0}\" width=\"{wide:.0}\" height=\"{high:.0}\" role=\"img\">");
    for (index, value_m) in map.values_m.iter().enumerate() {
        let Some(value_m) = value_m else { continue };
        let (x, y) = ((index % map.cols) as f64 * step_x, high - (index / map.cols + 1) as f64 * step_y);
        let _ = write!(
            svg,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{step_x:.1}\" height=\"{step_y:.1}\" fill=\"{}\">\
             <title>{value_m:+.2} m</title></rect>",
            color(*value_m)
        );
    }
    svg += "</svg>";
    let ends = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|share| share * map.scale_m);
    html! {
        figure {
            div.map style={ "max-width:" (format!("{wide:.0}")) "px" } { (PreEscaped(svg)) }
            div.legend { @for metres in ends {
                span.key { i style={ "background:" (color(metres)) } {} (format!("{metres:+.2} m")) }
            } }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    fn certificate() -> Certificate {
        let mut table = Table::default().words(["figure"]).figures(["m"]);
        table.row(["RMS", "1.25"]);
        let section = Section {
            title: "Heights".into(),
            sentences: vec!["Of <b> less A.".into()],
            table,
            explained: vec!["The smaller, the better.".into()],
            ..Section::default()
        };
        let map = CertificateMap {
            title: "Where they differ".into(),
            rows: 1,
            cols: 2,
            size_m: [200.0, 100.0],
            values_m: vec![Some(-2.0), None],
            scale_m: 2.0,
        };
        let verdict = (false, "Not accepted: B lies 3 m above A.".into());
        Certificate { title: "Certificate".into(), verdict, sections: vec![section], map: Some(map) }
    }

    #[test]
    fn a_text_begins_with_the_verdict_and_leaves_out_how_figures_are_read() {
        let text = certificate_text(&certificate());
        let expected =
            "Not accepted: B lies 3 m above A.\n\nHeights\n  Of <b> less A.\n  figure     m\n  RMS     1.25\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_page_escapes_names_loads_nothing_and_draws_squares_that_have_a_value() {
        let page = certificate_html(&certificate());
        assert!(page.contains("Of &lt;b&gt; less A.") && page.contains("The smaller, the better."), "{page}");
        assert!(!page.contains("<script") && !page.contains("http") && !page.contains("src="), "{page}");
        assert_eq!(page.matches("<rect").count(), 1);
        assert!(page.contains("class=\"verdict breached\"") && page.contains("<title>-2.00 m</title>"));
    }
}
