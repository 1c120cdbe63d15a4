//! About how large an export becomes, before it is written.

use terrain::{ModuleId, ModuleRect};

use crate::detail::{Step, steps};
use crate::objects::{Facet, things_in};
use crate::openflight::square_side;
use crate::ribbons::Ribbons;
use crate::tiles3d::TEXELS_TO_ERROR;
use crate::{Carries, ExportError, LEFT_OUT, Product};

/// Load modules whose ribbons and objects are counted, at most: the others have as many on average.
const COUNTED_MAX: usize = 1024;
/// 2^64 over the golden ratio: multiples of it modulo 2^64 are spread evenly, whatever is counted by them.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// About what an export of meshes takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Triangles of all sheets and levels.
    pub triangles: u64,
    /// Bytes of all files.
    pub bytes: u64,
    /// Bytes of these that are textures.
    pub texture_bytes: u64,
}

impl Forecast {
    /// That of a product in a format; `None` where the format is no mesh, and its size follows from other things.
    ///
    /// # Errors
    /// When an orthophoto has changed, or part of it cannot be decoded.
    pub fn of(product: &Product, format: &Carries) -> Result<Option<Self>, ExportError> {
        if format.triangle_bytes == 0.0 {
            return Ok(None);
        }
        let ground = product.modules.iter().chain(product.coarser.iter().flatten());
        let ground: f64 = ground.map(|module| f64::from(module.counts().triangles)).sum();
        let triangles = ground + (1.0 + product.coarser.len() as f64) * above_ground(product);
        let texture_bytes = match format.textures {
            LEFT_OUT => 0.0,
            _ => texture_bytes(product, format)?,
        };
        let bytes = triangles * format.triangle_bytes + texture_bytes;
        Ok(Some(Self { triangles: triangles as u64, bytes: bytes as u64, texture_bytes: texture_bytes as u64 }))
    }
}

/// Triangles of ribbons and objects of one level.
fn above_ground(product: &Product) -> f64 {
    let ribbons = Ribbons::of(product).filter(|_| product.has_ribbons);
    let triangles = |facets: &[Facet]| -> usize {
        facets.iter().flat_map(|facet| &facet.polygons).map(|polygon| polygon.len().saturating_sub(2)).sum()
    };
    let all = product.rect.count();
    let of = |id| {
        let of_ribbons = ribbons.as_ref().map_or(0, |ribbons| triangles(&ribbons.in_module(product, id)));
        of_ribbons + things_in(product, id).iter().map(|(_, facets)| triangles(facets)).sum::<usize>()
    };
    if all <= COUNTED_MAX {
        return product.rect.iter().map(of).sum::<usize>() as f64;
    }
    let cols = product.rect.cols() as usize;
    let drawn = (1..=COUNTED_MAX as u64).map(|nth| (u128::from(nth.wrapping_mul(GOLDEN)) * all as u128) >> 64);
    let ids = drawn.map(|at| ModuleId {
        row: product.rect.south + (at as usize / cols) as u32,
        col: product.rect.west + (at as usize % cols) as u32,
    });
    ids.map(of).sum::<usize>() as f64 * all as f64 / COUNTED_MAX as f64
}

/// Bytes of textures, as many for each load module as for that in the middle, and for coarser levels as many fewer as
/// their texels are larger there.
fn texture_bytes(product: &Product, format: &Carries) -> Result<f64, ExportError> {
    let rect = product.rect;
    let (row, col) = (rect.south.midpoint(rect.north), rect.west.midpoint(rect.east));
    let middle = ModuleRect { south: row, west: col, north: row + 1, east: col + 1 };
    let (Some(texture), Some(textures)) = (product.texture(middle, 0.0)?, &product.textures) else { return Ok(0.0) };
    let side_m = product.side_m();
    // One texture for all has fewer texels.
    let of = |modules: u32| textures.texel_m(side_m, f64::from(modules) * side_m, 0.0);
    let modules_together = if format.is_one_file() { rect.rows().max(rect.cols()) } else { 1 };
    let mut finer = (of(1) / of(modules_together)).powi(2);
    if format.has_textures_of_levels() {
        let levels: Vec<Product> = product.levels().collect();
        let square_m = f64::from(square_side(product)) * side_m;
        let of_level = |step: &Step| textures.texel_m(side_m, square_m, TEXELS_TO_ERROR * step.error_m);
        finer += steps(&levels, middle).iter().skip(1).map(|step| (of(1) / of_level(step)).powi(2)).sum::<f64>();
    }
    Ok(texture.bytes.len() as f64 * rect.count() as f64 * finer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{with_bridge, with_levels, with_objects};
    use crate::{CARRIES, Mesh};

    #[test]
    fn triangles_are_those_of_the_mesh_and_of_its_levels() {
        let mut bent = with_objects();
        bent.has_ribbons = false;
        for product in [with_objects(), bent, with_bridge(), with_levels()] {
            let levels: usize = product.levels().map(|level| Mesh::of(&level).triangles.len()).sum();
            for format in CARRIES.iter().filter(|format| format.triangle_bytes != 0.0) {
                let found = Forecast::of(&product, format).unwrap().unwrap();
                let bytes = (levels as f64 * format.triangle_bytes) as u64;
                assert_eq!(found, Forecast { triangles: levels as u64, bytes, texture_bytes: 0 });
            }
        }
        assert_eq!(Forecast::of(&with_objects(), crate::Format::Geotiff.carries()).unwrap(), None);
    }
}
