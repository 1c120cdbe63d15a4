//! The form of the mesh itself: how sharp its triangles are, and whether they cover the ground once and without a gap.
//!
//! Angles are those of triangles seen from above. Gaps are asked with whole numbers: an edge inside the area with a
//! triangle on one side only is a crack, one that has a vertex between its ends a T-junction, and vertices at one
//! place but at different heights are torn. The triangles of each load module (of the whole area, for a plain mesh)
//! add up to its area.

use std::collections::BTreeMap;

use serde::Serialize;
use terrain::PostRect;

use crate::Triangles;
use crate::edges::{Edges, OpenEdge};

/// Angle below which a triangle counts as a sliver, in degrees.
pub const SLIVER_DEGREES: f64 = 5.0;
/// Bins in a degree: how fine a percentile of angles is told.
const BINS_PER_DEGREE: f64 = 100.0;
/// No triangle has a larger smallest angle.
const DEGREES_MAX: f64 = 60.0;

/// What is known of a mesh without its ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeshForm {
    /// How many there are.
    pub triangles: u64,
    /// The smallest angle of all triangles, in degrees.
    pub angle_min_degrees: f64,
    /// The smallest angle that 5 % of the triangles do not exceed, in degrees, at most 0.01 too large.
    pub angle_p5_degrees: f64,
    /// The median of the triangles' smallest angles, in degrees, at most 0.01 too large.
    pub angle_median_degrees: f64,
    /// Triangles with an angle below 5 degrees.
    #[serde(skip)]
    pub slivers: u64,
    /// Edges inside the area with a triangle on one side only.
    pub cracks: u64,
    /// Those of them with a vertex between their ends.
    pub t_junctions: u64,
    /// Places where vertices stand at different heights.
    pub torn: u64,
    /// Load modules whose triangles do not add up to their area; for a plain mesh, whether it is so.
    pub wrong_areas: u64,
}

impl MeshForm {
    /// Share of triangles with an angle below 5 degrees.
    pub fn sliver_share(&self) -> f64 {
        if self.triangles == 0 { 0.0 } else { self.slivers as f64 / self.triangles as f64 }
    }

    /// Whether the mesh covers its ground once, without gaps.
    pub fn is_sound(&self) -> bool {
        self.cracks + self.t_junctions + self.torn + self.wrong_areas == 0
    }
}

/// Examines triangles; with `module_cells`, areas are added up for each load module of so many cells a side.
pub fn mesh_form(triangles: &Triangles, module_cells: Option<i32>) -> MeshForm {
    form_with(triangles, module_cells, &Edges::of(triangles))
}

pub(crate) fn form_with(triangles: &Triangles, module_cells: Option<i32>, edges: &Edges) -> MeshForm {
    let inside: Vec<&OpenEdge> = edges.open.iter().filter(|edge| !is_on_border(triangles, edge.ends)).collect();
    let mut form = MeshForm {
        cracks: inside.len() as u64,
        t_junctions: inside.iter().filter(|edge| has_vertex_between(triangles, &inside, edge.ends)).count() as u64,
        torn: edges.torn,
        wrong_areas: wrong_areas(triangles, module_cells),
        ..MeshForm::default()
    };
    measure_angles(triangles, &mut form);
    form
}

fn measure_angles(triangles: &Triangles, form: &mut MeshForm) {
    let mut bins = vec![0_u64; (DEGREES_MAX * BINS_PER_DEGREE) as usize + 2];
    form.triangles = triangles.count() as u64;
    form.angle_min_degrees = DEGREES_MAX;
    for triangle in 0..form.triangles as u32 {
        let angle = smallest_angle(triangles.corners_of(triangle));
        form.angle_min_degrees = form.angle_min_degrees.min(angle);
        form.slivers += u64::from(angle < SLIVER_DEGREES);
        let last = bins.len() - 1;
        bins[((angle * BINS_PER_DEGREE).ceil() as usize).min(last)] += 1;
    }
    let triangles = form.triangles;
    let percentile = |percent: u64| {
        let rank = (triangles * percent).div_ceil(100).max(1);
        let mut below = 0;
        let reached = bins.iter().position(|&count| {
            below += count;
            rank <= below
        });
        (reached.unwrap_or(0) as f64 / BINS_PER_DEGREE).min(DEGREES_MAX)
    };
    (form.angle_p5_degrees, form.angle_median_degrees) = (percentile(5), percentile(50));
}

/// In degrees, seen from above.
fn smallest_angle(corners: [[f64; 3]; 3]) -> f64 {
    let angle = |i: usize| {
        let [at, a, b] = [corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]];
        let (ax, ay, bx, by) = (a[0] - at[0], a[1] - at[1], b[0] - at[0], b[1] - at[1]);
        (ax * by - ay * bx).atan2(ax * bx + ay * by).to_degrees()
    };
    angle(0).min(angle(1)).min(angle(2))
}

fn is_on_border(triangles: &Triangles, ends: [u32; 2]) -> bool {
    let (places, units) = triangles.places();
    let PostRect { south, west, north, east } = triangles.rect();
    let [[ax, ay], [bx, by]] = ends.map(|v| places[v as usize]);
    let is_line =
        |a: i64, b: i64, low: i32, high: i32| a == b && (a == i64::from(low) * units || a == i64::from(high) * units);
    is_line(ax, bx, west, east) || is_line(ay, by, south, north)
}

/// Whether an end of another open edge lies between the ends of this one: a vertex inside an edge leaves its two halves
/// open as well.
fn has_vertex_between(triangles: &Triangles, open: &[&OpenEdge], ends: [u32; 2]) -> bool {
    let (places, _) = triangles.places();
    let [a, b] = ends.map(|v| places[v as usize]);
    let is_between = |c: [i64; 2]| {
        let (ahead, length) = ((b[0] - a[0], b[1] - a[1]), (c[0] - a[0], c[1] - a[1]));
        let cross = i128::from(ahead.0) * i128::from(length.1) - i128::from(ahead.1) * i128::from(length.0);
        let dot = i128::from(ahead.0) * i128::from(length.0) + i128::from(ahead.1) * i128::from(length.1);
        let whole = i128::from(ahead.0) * i128::from(ahead.0) + i128::from(ahead.1) * i128::from(ahead.1);
        cross == 0 && 0 < dot && dot < whole
    };
    open.iter().any(|edge| edge.ends.iter().any(|&v| is_between(places[v as usize])))
}

/// Load modules, or the whole area, whose triangles do not add up to its area.
fn wrong_areas(triangles: &Triangles, module_cells: Option<i32>) -> u64 {
    let (places, units) = triangles.places();
    let rect = triangles.rect();
    let module_units = module_cells.map(|cells| i64::from(cells) * units);
    let mut doubled_areas: BTreeMap<[i64; 2], i128> = BTreeMap::new();
    for corners in triangles.corners() {
        let [a, b, c] = corners.map(|v| places[v as usize]);
        let doubled =
            i128::from(b[0] - a[0]) * i128::from(c[1] - a[1]) - i128::from(b[1] - a[1]) * i128::from(c[0] - a[0]);
        // No triangle reaches over a side of its load module, so its middle tells which one it is.
        let module = module_units.map_or([0, 0], |side| [0, 1].map(|k| (a[k] + b[k] + c[k]).div_euclid(3 * side)));
        *doubled_areas.entry(module).or_default() += doubled;
    }
    let cells = |cells: usize| cells as i128 * i128::from(units);
    let (expected, count) = match module_units {
        Some(side) => {
            let modules = rect.cells_wide() as i64 * rect.cells_high() as i64 * units * units / (side * side);
            (2 * i128::from(side) * i128::from(side), modules)
        }
        None => (2 * cells(rect.cells_wide()) * cells(rect.cells_high()), 1),
    };
    let right = doubled_areas.values().filter(|&&doubled| doubled == expected).count();
    (count as u64).saturating_sub(right as u64)
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, LatticePoint, ModuleId, Post, Spacing, Tin, Vertex};

    use super::*;
    use crate::scene::{full_tin, grid, module_of, random_tin};

    fn form(tin: &Tin) -> MeshForm {
        mesh_form(&Triangles::of_tin(tin), None)
    }

    #[test]
    fn half_squares_have_angles_of_45_degrees() {
        let found = form(&full_tin(&Dem::from_fn(PostRect::of_size(6, 9), |_| Some(0))));
        assert!(found.is_sound());
        assert_eq!((found.triangles, found.slivers, found.angle_median_degrees), (80, 0, 45.0));
        assert!((found.angle_min_degrees - 45.0).abs() < 1e-9);
    }

    #[test]
    fn slivers_are_counted() {
        // Two triangles across 1 x 12 cells: atan(1/12) is 4.76 degrees.
        let rect = PostRect::of_size(2, 13);
        let vertices = rect.corners().map(|post| Vertex { at: post.into(), height: 0 }).to_vec();
        let found = form(&Tin::new(rect, vertices, vec![[0, 1, 2], [0, 2, 3]]));
        assert_eq!((found.slivers, found.sliver_share()), (2, 1.0));
        assert!((found.angle_min_degrees - (1.0_f64 / 12.0).atan().to_degrees()).abs() < 1e-9);
        assert!((found.angle_p5_degrees - 4.77).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_sound_tin_has_no_gap() {
        for seed in 0..4 {
            let tin = random_tin(PostRect::new(Post::new(-4, 7), Post::new(30, 50)), 300, |_, d| d.below(99), seed);
            let found = form(&tin);
            assert!(found.is_sound(), "{found:?}");
            assert_eq!(found.triangles as usize, tin.triangles.len());
        }
    }

    #[test]
    fn a_vertex_inside_an_edge_is_a_t_junction_and_a_missing_triangle_a_crack() {
        let rect = PostRect::of_size(3, 3);
        let mut vertices = rect.corners().map(|post| Vertex { at: post.into(), height: 0 }).to_vec();
        vertices.push(Vertex { at: Post::new(1, 1).into(), height: 0 });
        let junction = Tin::new(rect, vertices, vec![[0, 1, 4], [1, 2, 4], [0, 2, 3]]);
        let found = form(&junction);
        assert_eq!((found.cracks, found.t_junctions, found.wrong_areas), (3, 1, 0));
        let mut hole = junction.clone();
        hole.triangles = vec![[0, 1, 4], [1, 2, 4], [2, 3, 4]];
        let found = form(&hole);
        assert_eq!((found.cracks, found.t_junctions, found.wrong_areas), (2, 0, 1));
    }

    #[test]
    fn load_modules_that_disagree_on_a_side_are_told_apart() {
        let spacing = Spacing::from_metres(25.0).unwrap();
        let ids = [ModuleId { row: 0, col: 0 }, ModuleId { row: 0, col: 1 }];
        // One vertex inside each, and where wanted one on a side.
        let module = |id: ModuleId, height: i32, on_side: Option<LatticePoint>| {
            let rect = PostRect::of_size(21, 21);
            let mut places: Vec<Post> = rect.corners().map(|post| Post::new(post.row * 8, post.col * 8)).to_vec();
            places.push(Post::new(83, 71));
            places.extend(on_side.map(|at| Post::new(at.row, at.col)));
            places.sort_unstable();
            let triangles = terrain::mesh::delaunay(&places);
            let at = |place: &Post| LatticePoint::new(place.row, place.col);
            let vertices = places.iter().map(|place| Vertex { at: at(place), height }).collect();
            module_of(&Tin::new(rect, vertices, triangles), id, spacing)
        };
        let found = |west: Option<LatticePoint>, east: Option<LatticePoint>, step: i32| {
            let modules = [module(ids[0], 0, west), module(ids[1], step, east)];
            mesh_form(&Triangles::of_modules(&modules, grid(1, 2), spacing), Some(20))
        };
        let (in_west, in_east) = (Some(LatticePoint::new(77, 160)), Some(LatticePoint::new(77, 0)));
        assert!(found(in_west, in_east, 0).is_sound() && found(None, None, 0).is_sound());
        let junction = found(in_west, None, 0);
        assert_eq!((junction.cracks, junction.t_junctions, junction.torn, junction.wrong_areas), (3, 1, 0, 0));
        let torn = found(in_west, in_east, 64);
        assert_eq!((torn.cracks, torn.torn, torn.wrong_areas), (0, 3, 0));
        let lost = mesh_form(&Triangles::of_modules(&[module(ids[0], 0, None)], grid(1, 2), spacing), Some(20));
        assert_eq!((lost.cracks, lost.wrong_areas), (1, 1));
    }
}
