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

/// Adds the styles; `with_classes` are the layers whose features have a class, `classes` the numbers and names of
/// these.
pub(crate) fn add(
    connection: &Connection,
    with_classes: &[&str],
    classes: &BTreeMap<u8, String>,
) -> rusqlite::Result<()> {
    connection.execute_batch(TABLE)?;
    let mut add = connection.prepare(
        "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleName,
         styleQML, styleSLD, useAsDefault, description, owner) VALUES ('', '', ?1, 'geom', ?1, ?2, '', 1, '', '')",
    )?;
    for (layer, outline) in [("load_modules", "70,70,70"), ("tiles", "0,70,160"), ("breaches", "200,40,20")] {
        add.execute(params![layer, outlined(outline)])?;
    }
    for layer in with_classes {
        add.execute(params![layer, by_class(classes)])?;
    }
    Ok(())
}

/// Outlines of one colour over what lies below.
fn outlined(color: &str) -> String {
    document(&format!(
        "<renderer-v2 type=\"singleSymbol\"><symbols>{}</symbols></renderer-v2>",
        symbol("0", "no", "0,0,0,0", color)
    ))
}

/// Triangles filled by class, holes hatched.
fn by_class(of: &BTreeMap<u8, String>) -> String {
    let (mut categories, mut symbols) = (String::new(), String::new());
    for (index, (class, name)) in of.iter().enumerate() {
        let [red, green, blue] = classes::color(name, *class);
        let name = escaped(name);
        categories += &format!("<category render=\"true\" symbol=\"{index}\" value=\"{class}\" label=\"{name}\"/>");
        symbols += &match *class {
            HOLE_CLASS => symbol(&index.to_string(), "b_diagonal", "150,150,150,255", "150,150,150"),
            _ => symbol(&index.to_string(), "solid", &format!("{red},{green},{blue},255"), "60,60,60"),
        };
    }
    document(&format!(
        "<renderer-v2 type=\"categorizedSymbol\" attr=\"class\"><categories>{categories}</categories>\
         <symbols>{symbols}</symbols></renderer-v2>"
    ))
}

fn document(renderer: &str) -> String {
    format!("<qgis version=\"3.22.0\" styleCategories=\"Symbology\">{renderer}</qgis>")
}

fn symbol(name: &str, fill: &str, color: &str, outline: &str) -> String {
    let outline = format!("{outline},255");
    let options = [
        ("color", color),
        ("style", fill),
        ("outline_color", outline.as_str()),
        ("outline_style", "solid"),
        ("outline_width", "0.1"),
        ("outline_width_unit", "MM"),
    ];
    let options: String = options
        .iter()
        .map(|(name, value)| format!("<Option type=\"QString\" name=\"{name}\" value=\"{value}\"/>"))
        .collect();
    format!(
        "<symbol type=\"fill\" name=\"{name}\" alpha=\"1\"><layer class=\"SimpleFill\" enabled=\"1\" pass=\"0\">\
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
        let style = by_class(&classes);
        assert!(style.contains("label=\"a &quot;&lt;b&gt;&amp;\""), "{style}");
        assert!(style.contains("value=\"255\" label=\"hole\"") && style.contains("b_diagonal"), "{style}");
    }
}
