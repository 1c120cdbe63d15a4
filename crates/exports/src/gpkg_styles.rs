//! How QGIS draws the layers of a GeoPackage when it opens them: the table `layer_styles`, one style for each layer.

use std::collections::BTreeMap;

use rusqlite::{Connection, params};
use terrain::HOLE_CLASS;

use crate::classes;

/// The table as QGIS makes it, listed as one without geometry.
const TABLE: &str = "
CREATE TABLE layer_styles (
    id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
    f_table_catalog TEXT(256), f_table_schema TEXT(256), f_table_name TEXT(256), f_geometry_column TEXT(256),
    styleName TEXT(30), styleQML TEXT, styleSLD TEXT, useAsDefault BOOLEAN, description TEXT, owner TEXT(30),
    ui TEXT(30), update_time DATETIME DEFAULT '1970-01-01T00:00:00.000Z'
);
INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)
    VALUES ('layer_styles', 'attributes', 'layer_styles', '', '1970-01-01T00:00:00.000Z');";

/// How a layer is drawn.
pub(crate) enum Style<'a> {
    /// Outlines of one colour over what lies below.
    Outlined(&'a str),
    /// Polygons of one colour.
    Filled([u8; 3]),
    /// A mark at each point.
    Marked([u8; 3]),
    /// Polygons by the numbers of their classes, which have these names; holes are hatched.
    ByClass(&'a BTreeMap<u8, String>),
    /// Lines likewise.
    LinesByClass(&'a BTreeMap<u8, String>),
}

/// Adds the style of each layer.
pub(crate) fn add(connection: &Connection, styles: &[(&str, Style)]) -> rusqlite::Result<()> {
    connection.execute_batch(TABLE)?;
    let mut add = connection.prepare(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName,
         styleQML, styleSLD, useAsDefault, description, owner) VALUES ('', '', ?1, 'geom', ?1, ?2, '', 1, '', '')",
    )?;
    for (layer, style) in styles {
        add.execute(params![layer, document(&renderer(style))])?;
    }
    Ok(())
}

fn renderer(style: &Style) -> String {
    const THIN: &str = "60,60,60";
    let single =
        |symbol: String| format!("<renderer-v2 type=\"singleSymbol\"><symbols>{symbol}</symbols></renderer-v2>");
    let opaque = |[red, green, blue]: [u8; 3]| format!("{red},{green},{blue},255");
    match style {
        Style::Outlined(color) => single(fill("0", "no", "0,0,0,0", color)),
        Style::Filled(color) => single(fill("0", "solid", &opaque(*color), THIN)),
        Style::Marked(color) => {
            let color = opaque(*color);
            let options = [("name", "circle"), ("color", color.as_str()), ("size", "2"), ("size_unit", "MM")];
            single(symbol("0", ["marker", "SimpleMarker"], &options))
        }
        Style::ByClass(of) => by_class(of, |index, class, color| match class {
            HOLE_CLASS => fill(index, "b_diagonal", "150,150,150,255", "150,150,150"),
            _ => fill(index, "solid", &opaque(color), THIN),
        }),
        Style::LinesByClass(of) => by_class(of, |index, _, color| {
            let color = opaque(color);
            let options = [("line_color", color.as_str()), ("line_width", "0.6"), ("line_width_unit", "MM")];
            symbol(index, ["line", "SimpleLine"], &options)
        }),
    }
}

/// A symbol for each class, by its index, number and colour.
fn by_class(of: &BTreeMap<u8, String>, symbol: impl Fn(&str, u8, [u8; 3]) -> String) -> String {
    let (mut categories, mut symbols) = (String::new(), String::new());
    for (index, (class, name)) in of.iter().enumerate() {
        symbols += &symbol(&index.to_string(), *class, classes::color(name, *class));
        let name = escaped(name);
        categories += &format!("<category render=\"true\" symbol=\"{index}\" value=\"{class}\" label=\"{name}\"/>");
    }
    format!(
        "<renderer-v2 type=\"categorizedSymbol\" attr=\"class\"><categories>{categories}</categories>\
         <symbols>{symbols}</symbols></renderer-v2>"
    )
}

fn document(renderer: &str) -> String {
    format!("<qgis version=\"3.22.0\" styleCategories=\"Symbology\">{renderer}</qgis>")
}

fn fill(name: &str, style: &str, color: &str, outline: &str) -> String {
    let outline = format!("{outline},255");
    let options = [
        ("color", color),
        ("style", style),
        ("outline_color", outline.as_str()),
        ("outline_style", "solid"),
        ("outline_width", "0.1"),
        ("outline_width_unit", "MM"),
    ];
    symbol(name, ["fill", "SimpleFill"], &options)
}

/// A symbol of a kind, drawn by one layer.
fn symbol(name: &str, [kind, layer]: [&str; 2], options: &[(&str, &str)]) -> String {
    let options: String = options
        .iter()
        .map(|(name, value)| format!("<Option type=\"QString\" name=\"{name}\" value=\"{value}\"/>"))
        .collect();
    format!(
        "<symbol type=\"{kind}\" name=\"{name}\" alpha=\"1\"><layer class=\"{layer}\" enabled=\"1\" pass=\"0\">\
         <Option type=\"Map\">{options}</Option></layer></symbol>"
    )
}

/// A text inside XML.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_a_style_and_holes_are_hatched() {
        let classes = BTreeMap::from([(0, "a \"<b>&".to_owned()), (HOLE_CLASS, "hole".to_owned())]);
        let style = renderer(&Style::ByClass(&classes));
        assert!(style.contains("label=\"a &quot;&lt;b&gt;&amp;\""), "{style}");
        assert!(style.contains("value=\"255\" label=\"hole\"") && style.contains("b_diagonal"), "{style}");
    }
}
