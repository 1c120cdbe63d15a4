//! The compiled surface, and how far the ground lies above it, at every post of the working grid.
//!
//! Heights are those that residuals are measured with: at a post between vertices, rounded to 1/128 m. A raster has one
//! height at a place: that of the ground, whatever decks hang above it.

use std::io::Write;

use terrain::geometry::Facet;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, HOLE_CLASS, LoadModule, ModuleId, Post, PostRect, metres_of_quanta};

use crate::blocks::{BLOCK, Blocks, Raster, blocks, overviews};
use crate::geotiff;
use crate::{ExportError, Product, Work};

/// Heights of the ground that a database was built from, for the posts of a rectangle.
pub type GroundHeights<'a> = dyn Fn(PostRect) -> Result<Dem, ExportError> + Sync + 'a;

/// Writes the height of the compiled surface at every post as a GeoTIFF; under holes it is NaN.
///
/// # Errors
/// When it cannot be written, or the coordinate system has no EPSG code.
pub fn write_surface(out: &mut impl Write, product: &Product, work: &Work) -> Result<(), ExportError> {
    let level = |rect: PostRect| Ok(Dem::from_fn(rect, |_| Some(0)));
    write(out, product, work, "surface", &level, |residual| -residual)
}

/// Writes, as a GeoTIFF, how far `ground` lies above the compiled surface at every post; voids are NaN.
///
/// # Errors
/// When it cannot be written, the ground cannot be read, or the coordinate system has no EPSG code.
pub fn write_residual(
    out: &mut impl Write,
    product: &Product,
    ground: &GroundHeights,
    work: &Work,
) -> Result<(), ExportError> {
    write(out, product, work, "residual", ground, |residual| residual)
}

fn write(
    out: &mut impl Write,
    product: &Product,
    work: &Work,
    layer: &'static str,
    ground: &GroundHeights,
    value: impl Fn(i32) -> i32 + Sync,
) -> Result<(), ExportError> {
    let rect = product.grid.posts_of_rect(product.rect);
    // A residual knows by itself where there is no ground.
    let leaves_holes = layer == "surface";
    let (wide, high) = (rect.posts_wide(), rect.posts_high());
    let bands: Vec<i32> = (0..high.div_ceil(BLOCK) as i32).collect();
    let made = work.each("bands of rows", &bands, |&band| {
        let north = rect.north - band * BLOCK as i32;
        let posts = PostRect { south: rect.south.max(north + 1 - BLOCK as i32), north, ..rect };
        let raster = Raster { wide, metres: values(product, posts, ground, leaves_holes, &value)? };
        // A band has an even number of rows, so its halves are those of the whole.
        Ok((blocks(&raster), raster.halved().metres))
    })?;
    let (finest, halves): (Vec<_>, Vec<_>) = made.into_iter().unzip();
    let mut images = vec![Blocks { wide, high, blocks: finest.concat() }];
    if BLOCK < wide.max(high) {
        images.extend(overviews(Raster { wide: wide.div_ceil(2), metres: halves.concat() }, work)?);
    }
    geotiff::write(out, product, rect, layer, images)
}

/// Values in metres at `posts`, row by row from the north.
fn values(
    product: &Product,
    posts: PostRect,
    ground: &GroundHeights,
    leaves_holes: bool,
    value: &impl Fn(i32) -> i32,
) -> Result<Vec<f32>, ExportError> {
    let wide = posts.posts_wide();
    let mut metres = vec![f32::NAN; posts.post_count()];
    let rows = module_rows(product, posts);
    let low = ModuleId { row: *rows.start(), col: product.rect.west };
    let high = ModuleId { row: *rows.end(), col: product.rect.east - 1 };
    let south_west = product.grid.posts_of(low).south_west();
    let dem = ground(PostRect::new(south_west, product.grid.posts_of(high).north_east()))?;
    let columns = product.rect.west..product.rect.east;
    for id in rows.flat_map(|row| columns.clone().map(move |col| ModuleId { row, col })) {
        let Some(module) = product.module(id) else { continue };
        visit(product, module, &dem, leaves_holes, |post, residual| {
            if posts.contains(post) && !dem.is_void(post) {
                let at = (posts.north - post.row) as usize * wide + (post.col - posts.west) as usize;
                metres[at] = metres_of_quanta(value(residual)) as f32;
            }
        });
    }
    Ok(metres)
}

/// Rows of load modules that own a post of `posts`.
fn module_rows(product: &Product, posts: PostRect) -> std::ops::RangeInclusive<u32> {
    let row = |post_row: i32| ((post_row / product.grid.side_cells) as u32).min(product.rect.north - 1);
    row(posts.south)..=row(posts.north)
}

/// Every post that a load module owns, with its residual; on the far sides of what is exported, those on the line too.
fn visit(product: &Product, module: &LoadModule, dem: &Dem, leaves_holes: bool, mut each: impl FnMut(Post, i32)) {
    let far = |is_last: bool| is_last.then_some(product.grid.side_cells);
    let posts = PostGrid {
        origin: product.grid.posts_of(module.id).south_west(),
        units_per_post: product.frame.spacing.quanta_per_post(),
        far_row: far(module.id.row + 1 == product.rect.north),
        far_col: far(module.id.col + 1 == product.rect.east),
    };
    for (&triangle, &class) in module.triangles.iter().zip(&module.classes) {
        if leaves_holes && class == HOLE_CLASS {
            continue;
        }
        let corners = triangle.map(|v| module.vertices[usize::from(v)]);
        let facet = Facet::new(corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)), corners.map(|v| v.z));
        visit_residuals(&posts, &facet, dem, &mut each);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn every_post_has_the_height_of_the_triangles_there() {
        for product in [samples::product(), samples::eastern()] {
            let rect = product.grid.posts_of_rect(product.rect);
            let level = |rect: PostRect| Ok(Dem::from_fn(rect, |_| Some(0)));
            let metres = values(&product, rect, &level, true, &|residual| -residual).unwrap();
            assert_eq!(metres.len(), rect.post_count());
            assert!(metres.iter().all(|metres| metres.is_finite()));
            // North-west first, south-east last.
            let corner = if product.rect.west == 0 { 128_128 } else { 128_512 };
            assert_eq!(metres[0], corner as f32 / 128.0);
            assert_eq!(metres[metres.len() - 1], 1000.0);
        }
    }

    #[test]
    fn posts_under_holes_have_no_height_and_all_others_have() {
        let product = samples::with_hole();
        let rect = product.grid.area();
        let level = |rect: PostRect| Ok(Dem::from_fn(rect, |_| Some(0)));
        let metres = values(&product, rect, &level, true, &|residual| -residual).unwrap();
        let wide = rect.posts_wide();
        // Row 8 from the south is that of the pit at column 30: ground to its west, a hole to its east.
        let row = &metres[12 * wide..13 * wide];
        assert!(row[..30].iter().all(|metres| metres.is_finite()), "{row:?}");
        assert!(row[31..].iter().all(|metres| metres.is_nan()), "{row:?}");
    }

    #[test]
    fn a_void_has_no_residual_and_other_posts_have_theirs() {
        let product = samples::product();
        let rect = product.grid.area();
        let ground = |rect: PostRect| Ok(Dem::from_fn(rect, |post| (post.col != 3).then_some(128_640)));
        let metres = values(&product, rect, &ground, false, &|residual| residual).unwrap();
        assert_eq!(metres.iter().filter(|metres| metres.is_nan()).count(), 21);
        assert_eq!(metres[20 * 41], 5.0);
    }
}
