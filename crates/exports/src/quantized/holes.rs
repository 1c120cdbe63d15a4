//! Where tiles are closed over ground that no source has a height for, as GeoJSON: a globe can draw it or cut it out.

use serde_json::{Value, json};
use terrain::HOLE_CLASS;

use crate::globe::Globe;
use crate::mesh::Mesh;

/// The triangles over holes, as longitudes and latitudes; `None` without any.
pub(crate) fn holes(mesh: &Mesh, globe: &Globe) -> Option<Value> {
    let triangles = mesh.triangles.iter().zip(&mesh.classes).filter(|(_, class)| **class == HOLE_CLASS);
    let polygons: Vec<Value> = triangles
        .map(|(&[a, b, c], _)| {
            let ring = [a, b, c, a].map(|v| globe.lon_lat[v as usize]);
            json!([ring])
        })
        .collect();
    let geometry = || json!({ "type": "MultiPolygon", "coordinates": polygons });
    (!polygons.is_empty()).then(|| {
        json!({
            "type": "FeatureCollection",
            "features": [{ "type": "Feature", "properties": { "class": "hole" }, "geometry": geometry() }],
        })
    })
}
