//! LATTICETIN: a coarse regular grid, then in every pass the worst post of each triangle that fails.

use terrain::{Post, PostRect, QUANTA_PER_METRE, Tin};

use crate::methods::dem_window::{DemWindow, Impossible, TOLERANCE_M, tolerance, within};
use crate::methods::growing::Growing;

/// How the grid is refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeTin {
    /// Posts between the rows and columns of the first grid.
    pub step: i32,
    /// Largest residual that is accepted, in metres. Where none is given but `points` is, it starts at
    /// [`TOLERANCE_M`] and is halved as often as that takes.
    pub tolerance_m: Option<f64>,
    /// Passes at most.
    pub passes: Option<usize>,
    /// Vertices at most; the last pass is cut, worst posts first.
    pub points: Option<usize>,
}

impl LatticeTin {
    /// The usual grid, refined until it has so many vertices.
    pub const fn of_points(points: usize) -> Self {
        Self { step: 16, tolerance_m: None, passes: None, points: Some(points) }
    }
}

/// The refined grid.
///
/// # Errors
/// When the first grid has more points than asked for, or a number is negative.
pub fn lattice_tin(ground: &DemWindow, how: &LatticeTin) -> Result<Tin, Impossible> {
    let rect = ground.dem.rect();
    if how.step < 1 {
        return Err(Impossible::new(format!("a step of {} posts", how.step), "1 or more", "the usual step is 16"));
    }
    let first = lattice(rect, how.step);
    if let Some(points) = how.points {
        within(rect, points)?;
        if points < first.len() {
            let expected = format!("at least the {} points of the first grid", first.len());
            return Err(Impossible::points(points, expected, "a larger step makes a coarser first grid"));
        }
    }
    let mut accepted = quanta(tolerance(how.tolerance_m.unwrap_or(TOLERANCE_M))?);
    let most = how.points.unwrap_or(usize::MAX);
    let mut growing = Growing::new(ground.dem);
    growing.insert_all(first);
    let mut passes = 0;
    while how.passes.is_none_or(|most| passes < most) && growing.len() < most {
        let mut failing = growing.failing(accepted);
        if failing.is_empty() {
            if how.points.is_none() || how.tolerance_m.is_some() || accepted == 0 {
                break;
            }
            accepted /= 2;
            continue;
        }
        failing.truncate(most - growing.len());
        // Neighbours in the mesh are neighbours in the list, so that each is found from the one before.
        failing.sort_unstable();
        growing.insert_all(failing);
        passes += 1;
    }
    Ok(growing.tin())
}

fn quanta(metres: f64) -> u32 {
    (metres * f64::from(QUANTA_PER_METRE)) as u32
}

/// Posts every `step` rows and columns, the last of each included, by row and column.
pub(crate) fn lattice(rect: PostRect, step: i32) -> Vec<Post> {
    let (rows, cols) = (lines(rect.south, rect.north, step), lines(rect.west, rect.east, step));
    rows.iter().flat_map(|&row| cols.iter().map(move |&col| Post::new(row, col))).collect()
}

/// Every `step`-th line from `first` on, and `last`.
pub(crate) fn lines(first: i32, last: i32, step: i32) -> Vec<i32> {
    let mut lines: Vec<i32> = (first..last).step_by(step as usize).collect();
    lines.push(last);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::scene::{self, metres, rms_m};

    #[test]
    fn a_pass_adds_the_worst_post_of_each_triangle_that_fails() {
        let spike = Post::new(5, 9);
        let dem = scene::dem(33, 33, |post| if post == spike { metres(30.0) } else { 0 });
        let how = LatticeTin { step: 16, tolerance_m: Some(10.0), passes: Some(1), points: None };
        let tin = lattice_tin(&scene::ground(&dem), &how).unwrap();
        assert_eq!((tin.vertices.len(), tin.check()), (3 * 3 + 1, Ok(())));
        assert_eq!(tin.vertices[9].at.post(), Some(spike));
        // Around the spike the ground now lies far below the triangles; a second pass mends it.
        let more = lattice_tin(&scene::ground(&dem), &LatticeTin { passes: Some(2), ..how }).unwrap();
        assert!(10 < more.vertices.len());
    }

    #[test]
    fn without_an_end_it_refines_until_no_post_fails() {
        let dem = scene::rough(100, 120);
        let how = LatticeTin { step: 16, tolerance_m: Some(3.0), passes: None, points: None };
        let tin = lattice_tin(&scene::ground(&dem), &how).unwrap();
        let mut growing = Growing::new(&dem);
        growing.insert_all(tin.vertices.iter().map(|vertex| vertex.at.post().unwrap()));
        assert_eq!(growing.failing(quanta(3.0)), []);
    }

    #[test]
    fn a_small_budget_is_wasted_on_the_regular_start() {
        // Hills in the north, a plain in the south that the grid covers as densely.
        let hills = scene::rough(193, 193);
        let dem = scene::dem(193, 193, |post| if post.row < 120 { metres(60.0) } else { hills.height(post) });
        let ground = scene::ground(&dem);
        let regular = lattice_tin(&ground, &LatticeTin::of_points(200)).unwrap();
        let plain = regular.vertices.iter().filter(|vertex| vertex.at.post().unwrap().row < 112).count();
        assert!(7 * 13 <= plain, "{plain} points on the plain");
        let mut iterative = Growing::new(&dem);
        iterative.grow(200, 0);
        assert!(rms_m(&dem, &iterative.tin()) < rms_m(&dem, &regular));
    }

    #[test]
    fn any_number_of_points_from_the_first_grid_on_is_met_exactly() {
        let dem = scene::rough(64, 80);
        let ground = scene::ground(&dem);
        for points in [5 * 6, 100, 1000] {
            let tin = lattice_tin(&ground, &LatticeTin::of_points(points)).unwrap();
            assert_eq!((tin.vertices.len(), tin.check()), (points, Ok(())));
        }
        let refused = lattice_tin(&ground, &LatticeTin::of_points(29)).unwrap_err();
        assert_eq!(refused.to_string(), "29 points, expected at least the 30 points of the first grid");
        let negative = LatticeTin { tolerance_m: Some(-1.0), ..LatticeTin::of_points(100) };
        assert_eq!(lattice_tin(&ground, &negative).unwrap_err().found, "a tolerance of -1 m");
    }
}
