//! The JSON beside a mesh: where it lies, since most formats of meshes cannot say it.

use serde_json::{Value, json};
use terrain::{QUANTA_PER_METRE, metres_of_quanta};

use crate::{Coordinates, Mesh, Product, Sheet};

/// What a reader of one exported file needs to know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// What to add to east, north and up to come to the coordinate system, in metres.
    pub offset_m: [f64; 3],
    /// How the axes of the file lie.
    pub axes: &'static str,
}

impl Facts {
    /// Those of a file whose x points east, y north and z up.
    pub fn z_up(product: &Product, coordinates: Coordinates) -> Self {
        let [east_m, north_m] = match coordinates {
            Coordinates::Local => product.corner_m(product.rect.south, product.rect.west),
            Coordinates::Map => [0.0, 0.0],
        };
        Self { offset_m: [east_m, north_m, 0.0], axes: "x east, y north, z up" }
    }

    /// Those of a file whose x points east, y up and z south, as in glTF.
    pub fn y_up(product: &Product) -> Self {
        Self { axes: "x east, y up, z south", ..Self::z_up(product, Coordinates::Local) }
    }

    /// The same as lines of a comment; a geographic program takes the system from `crs …`.
    pub(crate) fn comments(&self, product: &Product) -> Vec<String> {
        let [east_m, north_m, up_m] = self.offset_m;
        let datum = match product.vertical_datum() {
            "" => "an unknown vertical datum",
            datum => datum,
        };
        let mut lines = vec![
            format!("{}, in metres; heights above {datum}, in steps of 1/{QUANTA_PER_METRE} m", self.axes),
            format!("load modules {}", modules_text(product)),
        ];
        if 0 < product.level {
            lines.push(format!("level of detail {}, where 0 is the finest", product.level));
        }
        match self.offset_m == [0.0; 3] {
            true => lines.push(format!("crs {}", product.crs())),
            false => lines.push(format!("offset {east_m} {north_m} {up_m} to {}: add it to x, y, z", product.crs())),
        }
        lines.extend(product.attributions().iter().map(|text| format!("source {}", text.replace(['\n', '\r'], " "))));
        lines
    }
}

fn modules_text(product: &Product) -> String {
    let rect = product.rect;
    format!("{},{}..{},{}", rect.south, rect.west, rect.north - 1, rect.east - 1)
}

/// The text of the sidecar.
pub fn sidecar(product: &Product, mesh: &Mesh, facts: &Facts) -> String {
    let area = &product.manifest.area;
    let rect = product.rect;
    let [west, south] = product.corner_m(rect.south, rect.west);
    let [east, north] = product.corner_m(rect.north, rect.east);
    let heights = mesh.vertices.iter().map(|vertex| vertex[2]);
    let range = |quanta: Option<i32>| quanta.map_or(Value::Null, |quanta| json!(metres_of_quanta(quanta)));
    let mut value = json!({
        "area": area.name,
        "crs": area.crs,
        "vertical_datum": if area.vertical_datum.is_empty() { Value::Null } else { json!(area.vertical_datum) },
        "unit": "metre",
        "axes": facts.axes,
        "offset_m": facts.offset_m,
        "offset_is": "east, north and up of the file's origin in crs",
        "bounds_m": { "west": west, "south": south, "east": east, "north": north,
                      "lowest": range(heights.clone().min()), "highest": range(heights.max()) },
        "height_step_m": 1.0 / f64::from(QUANTA_PER_METRE),
        "load_modules": {
            "south_west": [rect.south, rect.west],
            "north_east": [rect.north - 1, rect.east - 1],
            "side_m": product.side_m(),
        },
        "level": product.level,
        "vertices": mesh.vertices.len(),
        "triangles": mesh.triangles.len(),
        "hole_triangles_left_out": product.hole_triangles(),
        "attribution": product.attributions(),
    });
    if 0 < product.over_holes {
        value["objects_over_holes_left_out"] = json!(product.over_holes);
    }
    if 0 < product.deck_triangles() {
        value["deck_triangles"] = json!(product.deck_triangles());
    }
    let objects = mesh.sheet(Sheet::Objects).len();
    if 0 < objects {
        value["object_triangles"] = json!(objects);
    }
    if 1 < product.class_names.len() {
        value["classes"] = json!(product.class_names);
    }
    format!("{value:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn a_sidecar_says_where_the_mesh_lies() {
        let product = samples::eastern();
        let facts = Facts::z_up(&product, Coordinates::Local);
        let text = sidecar(&product, &Mesh::of(&product), &facts);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["offset_m"], json!([505_500.0, 3_875_000.0, 0.0]));
        assert_eq!(value["bounds_m"]["east"], 506_000.0);
        assert_eq!(value["bounds_m"]["highest"], 1004.0);
        assert_eq!((&value["crs"], &value["vertical_datum"]), (&json!("EPSG:32611"), &json!("EGM96")));
        assert_eq!(value["load_modules"]["north_east"], json!([0, 1]));
        assert!(facts.comments(&product)[2].starts_with("offset 505500 3875000 0 to EPSG:32611"));
        assert_eq!(Facts::z_up(&product, Coordinates::Map).comments(&product)[2], "crs EPSG:32611");
    }
}
