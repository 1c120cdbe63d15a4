//! A mesh set on the globe: places and normals counted from the middle of the Earth.

use crate::earth::{Earth, directions, earth_centred};
use crate::mesh::{Mesh, dot, minus, normals};
use crate::{ExportError, Product, Work};

/// Vertices of a mesh on the globe, in the mesh's order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Globe {
    /// Longitude and latitude in degrees.
    pub lon_lat: Vec<[f64; 2]>,
    /// Heights above the ellipsoid, metres.
    pub height_m: Vec<f64>,
    /// Metres from the middle of the Earth.
    pub place: Vec<[f64; 3]>,
    /// The direction the ground faces, along the same axes.
    pub normal: Vec<[f64; 3]>,
}

impl Globe {
    /// Sets all vertices of a product's mesh.
    ///
    /// # Errors
    /// When a vertex lies outside the coordinate system, or the work was asked to stop.
    pub(crate) fn of(product: &Product, mesh: &Mesh, earth: &Earth, work: &Work) -> Result<Self, ExportError> {
        const AT_ONCE: usize = 4096;
        let [east_m, north_m] = product.corner_m(product.rect.south, product.rect.west);
        let metres: Vec<[f64; 3]> = mesh.metres().collect();
        let parts: Vec<&[[f64; 3]]> = metres.chunks(AT_ONCE).collect();
        let set = work.each("groups of vertices set on the globe", &parts, |part| {
            let set = |&[x, y, z]: &[f64; 3]| {
                let lon_lat = earth.lon_lat([east_m + x, north_m + y])?;
                Ok((lon_lat, z + earth.datum_m(lon_lat)))
            };
            part.iter().map(set).collect::<Result<Vec<_>, ExportError>>()
        })?;
        let mut globe = Self::default();
        for (lon_lat, height_m) in set.into_iter().flatten() {
            globe.lon_lat.push(lon_lat);
            globe.height_m.push(height_m);
            globe.place.push(earth_centred(lon_lat, height_m));
        }
        // Around a point on the globe, where differences are exact enough.
        let origin = globe.place.first().copied().unwrap_or_default();
        let near: Vec<[f64; 3]> = globe.place.iter().map(|&place| minus(place, origin)).collect();
        globe.normal = normals(&near, &mesh.triangles);
        Ok(globe)
    }
}

/// A frame on the globe: x east, y north, z up at its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LocalFrame {
    origin: [f64; 3],
    axes: [[f64; 3]; 3],
}

impl LocalFrame {
    /// The frame at a place.
    pub(crate) fn at(lon_lat: [f64; 2], height_m: f64) -> Self {
        Self { origin: earth_centred(lon_lat, height_m), axes: directions(lon_lat) }
    }

    /// A place in the frame.
    pub(crate) fn local(&self, place: [f64; 3]) -> [f64; 3] {
        self.turned(minus(place, self.origin))
    }

    /// A direction in the frame.
    pub(crate) fn turned(&self, direction: [f64; 3]) -> [f64; 3] {
        self.axes.map(|axis| dot(axis, direction))
    }

    /// The matrix that takes places in the frame to the globe, column by column.
    pub(crate) fn matrix(&self) -> [f64; 16] {
        let [east, north, up] = self.axes;
        let column = |v: [f64; 3], last: f64| [v[0], v[1], v[2], last];
        let columns = [column(east, 0.0), column(north, 0.0), column(up, 0.0), column(self.origin, 1.0)];
        std::array::from_fn(|index| columns[index / 4][index % 4])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_takes_a_place_to_itself_and_back() {
        let frame = LocalFrame::at([-116.5, 35.25], 900.0);
        let place = earth_centred([-116.49, 35.26], 1000.0);
        let local = frame.local(place);
        // A hundredth of a degree: 910 m east and 1,110 m north here, less the bulge of the Earth.
        assert!((local[0] - 910.0).abs() < 2.0 && (local[1] - 1109.6).abs() < 2.0, "{local:?}");
        assert!((local[2] - 99.84).abs() < 0.05, "{local:?}");
        let matrix = frame.matrix();
        for axis in 0..3 {
            let back: f64 = (0..3).map(|i| matrix[4 * i + axis] * local[i]).sum::<f64>() + matrix[12 + axis];
            assert!((back - place[axis]).abs() < 1e-6);
        }
    }
}
