//! The class of each triangle: that of the feature it belongs to, else of the ground under it.

use terrain::geometry::Facet;
use terrain::geometry::owned::{OwnedRows, PostGrid};
use terrain::{Importance, LoadModule};

use crate::load_modules::{Faces, Layout};

/// The class of the face that each triangle lies in; of the others, the class of the ground.
pub(crate) fn of_triangles(module: &LoadModule, layout: &Layout, mask: &Importance, faces: Option<&Faces>) -> Vec<u8> {
    let mut classes = of_ground(module, layout, mask);
    let Some(faces) = faces else { return classes };
    let origin = [module.id.row, module.id.col].map(|line| i64::from(line) * i64::from(module.side));
    let corner = |v: u16| {
        let vertex = module.vertices[usize::from(v)];
        [origin[0] + i64::from(vertex.y), origin[1] + i64::from(vertex.x)]
    };
    for (class, triangle) in classes.iter_mut().zip(&module.triangles) {
        let heights = triangle.map(|v| module.vertices[usize::from(v)].z);
        if let Some(of_face) = faces.class_at(triangle.map(corner), heights, layout.spacing.quanta_per_post()) {
            *class = of_face;
        }
    }
    classes
}

/// Asks again for the classes of triangles that belong to no feature: parts of a split one may lie in another than it.
pub fn classify_natural(
    module: &mut LoadModule,
    layout: &Layout,
    mask: &Importance,
    faces: Option<&Faces>,
    is_of_features: impl Fn(u8) -> bool,
) {
    let found = of_triangles(module, layout, mask, faces);
    let natural = module.classes.iter_mut().zip(found).filter(|(class, _)| !is_of_features(**class));
    natural.for_each(|(class, found)| *class = found);
}

/// The class of most of the posts that each triangle owns, the smaller one where two have as many.
///
/// A triangle that owns no post takes the class of the post nearest to its centroid.
fn of_ground(module: &LoadModule, layout: &Layout, mask: &Importance) -> Vec<u8> {
    let rect = layout.grid.posts_of(module.id);
    if mask.classes_of_row(mask.rect().south).is_none() {
        return vec![0; module.triangles.len()];
    }
    assert!(mask.rect().contains_rect(&rect), "the mask window holds load module {}", module.id);
    let posts = PostGrid::of_module(layout.grid, module.id, layout.spacing);
    let offset = (rect.west - mask.rect().west) as usize;
    let facets = module.triangles.iter().map(|triangle| {
        let corners = triangle.map(|v| module.vertices[usize::from(v)]);
        Facet::new(corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)), corners.map(|v| v.z))
    });
    facets.map(|facet| most_common(&facet, &posts, mask, offset)).collect()
}

fn most_common(facet: &Facet, posts: &PostGrid, mask: &Importance, offset: usize) -> u8 {
    let mut counts = [0_u32; 256];
    let classes_of = |row: i32| mask.classes_of_row(posts.origin.row + row).unwrap_or(&[]);
    for (row, cols) in OwnedRows::new(posts, facet) {
        let classes = &classes_of(row)[offset + cols.start as usize..offset + cols.end as usize];
        classes.iter().for_each(|&class| counts[usize::from(class)] += 1);
    }
    let largest = counts.iter().copied().max().unwrap_or(0);
    if 0 < largest {
        return counts.iter().position(|&count| count == largest).unwrap_or(0) as u8;
    }
    // Half a post up, then down: the nearest post of the centroid.
    let nearest = |v: [i32; 3]| {
        let (sum, whole) = (v.iter().map(|&v| i64::from(v)).sum::<i64>(), 3 * i64::from(posts.units_per_post));
        ((2 * sum + whole) / (2 * whole)) as i32
    };
    classes_of(nearest(facet.y))[offset + nearest(facet.x) as usize]
}

#[cfg(test)]
mod tests {
    use terrain::{ModuleGrid, ModuleId, ModuleVertex, PostRect, Spacing};

    use super::*;

    /// The south-eastern and north-western half of a load module of 4 x 4 cells; 9 and 6 owned posts, and a
    /// post more in each on the area's far borders.
    #[track_caller]
    fn check(classes: [[u8; 5]; 5], expected: [u8; 2]) {
        let grid = ModuleGrid { rows: 1, cols: 1, side_cells: 4 };
        let layout = Layout { grid, modules: grid.all(), spacing: Spacing::from_sixteenths(16).unwrap() };
        let vertex = |y, x| ModuleVertex { y, x, z: 0 };
        let module = LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: 512,
            vertices: vec![vertex(0, 0), vertex(0, 512), vertex(512, 0), vertex(512, 512)],
            triangles: vec![[0, 1, 3], [0, 3, 2]],
            classes: vec![0, 0],
            polygon_count: 2,
            ..LoadModule::default()
        };
        let mask = Importance::new(PostRect::of_size(5, 5), vec![1000; 25], classes.concat());
        assert_eq!(of_triangles(&module, &layout, &mask, None), expected);
    }

    #[test]
    fn a_triangle_has_the_class_of_most_of_its_posts() {
        check([[1, 1, 1, 1, 1], [2, 1, 1, 1, 1], [2, 2, 1, 1, 1], [2, 2, 2, 1, 1], [2, 2, 2, 2, 1]], [1, 2]);
        check([[3, 3, 3, 3, 3], [2, 3, 3, 3, 3], [2, 2, 3, 3, 3], [2, 2, 2, 3, 3], [0, 0, 0, 0, 3]], [3, 2]);
    }

    #[test]
    fn a_triangle_between_posts_has_the_class_of_the_nearest() {
        let posts = PostGrid { origin: terrain::Post::new(0, 0), units_per_post: 100, far_row: None, far_col: None };
        let mask = Importance::new(PostRect::of_size(2, 2), vec![1; 4], vec![0, 1, 2, 3]);
        let facet = Facet::new([10, 90, 70], [60, 60, 70], [0, 0, 0]);
        assert_eq!(most_common(&facet, &posts, &mask, 0), 3);
        let facet = Facet::new([10, 40, 20], [60, 60, 70], [0, 0, 0]);
        assert_eq!(most_common(&facet, &posts, &mask, 0), 2);
    }
}
