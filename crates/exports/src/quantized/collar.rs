//! Ground around what is exported, so that tiles are covered to their borders: it goes straight out from the border.

use crate::earth::{Earth, directions};
use crate::globe::Globe;
use crate::mesh::Mesh;
use crate::{ExportError, Product};

/// Triangles over vertices on the globe.
#[derive(Clone, Debug, Default)]
pub(crate) struct GlobeMesh {
    /// Longitude and latitude in degrees.
    pub lon_lat: Vec<[f64; 2]>,
    /// Metres above the ellipsoid.
    pub height_m: Vec<f64>,
    /// Directions along the Earth's own axes.
    pub normal: Vec<[f64; 3]>,
    /// Corners, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh on the globe with `collar_m` metres of ground around it; `outer_m` gives the height of its outer edge beside
/// a border of some height.
///
/// # Errors
/// When the collar leaves the coordinate system.
pub(crate) fn with_collar(
    product: &Product,
    mesh: &Mesh,
    globe: &Globe,
    earth: &Earth,
    collar_m: f64,
    outer_m: impl Fn(f64) -> f64,
) -> Result<GlobeMesh, ExportError> {
    let mut sheet = GlobeMesh {
        lon_lat: globe.lon_lat.clone(),
        height_m: globe.height_m.clone(),
        normal: globe.normal.clone(),
        triangles: mesh.triangles.clone(),
    };
    let border = border(product, mesh);
    let [west, south] = product.corner_m(product.rect.south, product.rect.west);
    let mut outer = |v: u32, out: [f64; 2]| -> Result<u32, ExportError> {
        let [x, y, _] =
            mesh.vertices[v as usize].map(|quanta| f64::from(quanta) / f64::from(terrain::QUANTA_PER_METRE));
        let lon_lat = earth.lon_lat([west + x + out[0] * collar_m, south + y + out[1] * collar_m])?;
        sheet.lon_lat.push(lon_lat);
        sheet.height_m.push(outer_m(globe.height_m[v as usize]));
        sheet.normal.push(directions(lon_lat)[2]);
        Ok(sheet.lon_lat.len() as u32 - 1)
    };
    let mut triangles = Vec::new();
    // Once around, counter-clockwise: each side with its outward direction, each corner between two of them.
    for (side, out) in border.iter().zip(OUTWARD) {
        let beyond = side.iter().map(|&v| outer(v, out)).collect::<Result<Vec<u32>, ExportError>>()?;
        for (inner, outer) in side.windows(2).zip(beyond.windows(2)) {
            triangles.extend([[outer[0], outer[1], inner[1]], [outer[0], inner[1], inner[0]]]);
        }
        let (Some(&first), Some(&beyond_first)) = (side.first(), beyond.first()) else { continue };
        // The corner at the beginning of the side, and the side before it.
        let before = [out[1], -out[0]];
        let corner = outer(first, [out[0] + before[0], out[1] + before[1]])?;
        let beside = outer(first, before)?;
        triangles.extend([[corner, beyond_first, first], [corner, first, beside]]);
    }
    sheet.triangles.extend(triangles);
    Ok(sheet)
}

/// Outward from the southern, eastern, northern and western side.
const OUTWARD: [[f64; 2]; 4] = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];

/// The vertices of each side, once around counter-clockwise from the south-west.
fn border(product: &Product, mesh: &Mesh) -> [Vec<u32>; 4] {
    let (wide, high) = (product.rect.cols() as i32 * product.side(), product.rect.rows() as i32 * product.side());
    let along = |key: &dyn Fn([i32; 3]) -> Option<i32>| {
        let mut side: Vec<(i32, u32)> =
            (0..).zip(&mesh.vertices).filter_map(|(index, &vertex)| Some((key(vertex)?, index))).collect();
        side.sort_unstable();
        side.into_iter().map(|(_, index)| index).collect()
    };
    [
        along(&|[x, y, _]| (y == 0).then_some(x)),
        along(&|[x, y, _]| (x == wide).then_some(y)),
        along(&|[x, y, _]| (y == high).then_some(-x)),
        along(&|[x, y, _]| (x == 0).then_some(-y)),
    ]
}
