//! Constrained edges: a tile's TIN told apart into the load modules it consists of.

use terrain::{Importance, LatticePoint, LoadModule, Tin};

use crate::load_modules::pieces::{Corner, Pieces};
use crate::load_modules::{Faces, Layout};

/// The load modules of a tile whose TIN has every module line among its edges, row by row.
///
/// `mask` gives the classes of the tile's posts; triangles that lie in `faces` take theirs. Residuals are left empty.
///
/// # Panics
/// When the TIN is not that of the tile, or a triangle crosses a module line.
pub fn concatenate(tin: &Tin, layout: &Layout, mask: &Importance, faces: Option<&Faces>) -> Vec<LoadModule> {
    assert_eq!(tin.rect, layout.grid.posts_of_rect(layout.modules), "the TIN covers the load modules of its tile");
    let side = layout.grid.side_cells * tin.steps_per_post;
    let quanta_per_post = layout.spacing.quanta_per_post();
    assert_eq!(quanta_per_post % tin.steps_per_post, 0, "a step of the TIN's lattice is a whole number of quanta");
    let step = i64::from(quanta_per_post / tin.steps_per_post);
    let mut pieces = vec![Pieces::default(); layout.modules.count()];
    for triangle in &tin.triangles {
        let corners = triangle.map(|v| tin.vertices[v as usize]);
        let thirds = |v: [i32; 3]| v.into_iter().map(i64::from).sum::<i64>().div_euclid(3 * i64::from(side)) as i32;
        let (row, col) = (thirds(corners.map(|v| v.at.row)), thirds(corners.map(|v| v.at.col)));
        let slot = layout.slot(row, col).expect("triangles lie inside the tile");
        let inside = |v: i32, module: i32| (0..=side).contains(&(v - module * side));
        let whole = |at: LatticePoint| inside(at.row, row) && inside(at.col, col);
        assert!(corners.iter().all(|v| whole(v.at)), "no triangle crosses a side of load module {row},{col}");
        let local = |v: i32, module: i32| i64::from(v - module * side) * step;
        pieces[slot].push(corners.map(|v| Corner::new(local(v.at.row, row), local(v.at.col, col), v.height, false)));
    }
    let modules = layout.modules.iter().zip(&pieces);
    modules.map(|(id, pieces)| pieces.load_module(id, layout, mask, faces)).collect()
}

#[cfg(test)]
mod tests {
    use terrain::{LATTICE_PER_POST, ModuleGrid, ModuleRect, Side, Spacing, Vertex};

    use super::*;
    use crate::load_modules::Face;
    use crate::load_modules::sheets::{assert_sides_are_shared, constrained};

    fn layout() -> Layout {
        let grid = ModuleGrid { rows: 4, cols: 6, side_cells: 20 };
        let modules = ModuleRect { south: 1, west: 2, north: 3, east: 5 };
        Layout { grid, modules, spacing: Spacing::from_metres(25.0).unwrap() }
    }

    #[test]
    fn every_triangle_lands_in_its_load_module_at_its_place() {
        for seed in 0..20 {
            let layout = layout();
            let tin = constrained(&layout, seed);
            tin.check().unwrap();
            let mask = Importance::uniform(tin.rect, 1000);
            let modules = concatenate(&tin, &layout, &mask, None);
            modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
            assert_eq!(modules.iter().map(|module| module.triangles.len()).sum::<usize>(), tin.triangles.len());
            assert!(modules.iter().all(|module| module.polygon_count as usize == module.triangles.len()));
            assert_sides_are_shared(&modules, layout.modules);
            for module in &modules {
                let corner = LatticePoint::from(layout.grid.posts_of(module.id).south_west());
                for v in &module.vertices {
                    let at = LatticePoint::new(corner.row + i32::from(v.y) / 400, corner.col + i32::from(v.x) / 400);
                    assert!(tin.vertices.contains(&Vertex { at, height: v.z }));
                }
            }
        }
    }

    #[test]
    fn triangles_in_a_face_take_its_class_in_whichever_load_module_they_lie() {
        for seed in 0..10 {
            let layout = layout();
            let tin = constrained(&layout, seed);
            let places = |triangle: &[u32; 3]| triangle.map(|v| tin.vertices[v as usize].at).to_vec();
            let wet: Vec<usize> = (0..tin.triangles.len()).step_by(3).collect();
            let given = wet.iter().map(|&t| Face { class: 7, level: None, rings: vec![places(&tin.triangles[t])] });
            let faces = Faces::new(&given.collect::<Vec<_>>(), LATTICE_PER_POST);
            let of_tin = faces.of_triangles(&tin);
            assert!((0..of_tin.len()).all(|t| of_tin[t] == wet.binary_search(&t).is_ok().then_some(7)));
            // Of the mask's classes none is that of the faces.
            let classes = tin.rect.posts().map(|post| (post.row + 3 * post.col) as u8 % 5).collect();
            let mask = Importance::new(tin.rect, vec![1000; tin.rect.post_count()], classes);
            let (bare, modules) =
                (concatenate(&tin, &layout, &mask, None), concatenate(&tin, &layout, &mask, Some(&faces)));
            let mut count = 0;
            for (bare, module) in bare.iter().zip(&modules) {
                let changed = bare.classes.iter().zip(&module.classes).filter(|(bare, class)| bare != class);
                assert!(changed.clone().all(|(_, class)| *class == 7));
                count += changed.count();
                assert_eq!(LoadModule { classes: bare.classes.clone(), ..module.clone() }, *bare);
            }
            assert_eq!(count, wet.len());
        }
    }

    #[test]
    fn the_order_of_vertices_and_triangles_does_not_show() {
        let layout = layout();
        let tin = constrained(&layout, 3);
        let mask = Importance::uniform(tin.rect, 1000);
        let mut other = tin.clone();
        other.vertices.reverse();
        other.triangles.reverse();
        let last = tin.vertices.len() as u32 - 1;
        for triangle in &mut other.triangles {
            *triangle = [last - triangle[2], last - triangle[0], last - triangle[1]];
        }
        other.check().unwrap();
        assert_eq!(concatenate(&tin, &layout, &mask, None), concatenate(&other, &layout, &mask, None));
    }

    #[test]
    #[should_panic(expected = "no triangle crosses a side")]
    fn a_triangle_across_a_module_line_is_refused() {
        let layout = layout();
        let rect = layout.grid.posts_of_rect(layout.modules);
        let vertices = rect.corners().map(|post| Vertex { at: post.into(), height: 0 }).to_vec();
        let tin = Tin::new(rect, vertices, vec![[0, 1, 2], [0, 2, 3]]);
        concatenate(&tin, &layout, &Importance::uniform(rect, 1000), None);
    }

    #[test]
    fn side_lists_run_along_the_side() {
        let layout = layout();
        let tin = constrained(&layout, 5);
        let modules = concatenate(&tin, &layout, &Importance::uniform(tin.rect, 1000), None);
        for module in &modules {
            for side in Side::ALL {
                let list = module.side_vertices(side);
                assert!(list.is_sorted() && 2 <= list.len());
            }
        }
    }
}
