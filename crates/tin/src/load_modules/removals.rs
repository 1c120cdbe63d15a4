//! Which points of a tile could go, for clipped load modules that hold too much: what each would cost and free.

use terrain::geometry::Facet;
use terrain::geometry::owned::{PostGrid, visit_residuals};
use terrain::{Dem, Importance, LatticePoint, ModuleId, Post, Vertex};

use crate::load_modules::Layout;
use crate::load_modules::clip::points_around;
use crate::load_modules::hole::fill;
use crate::load_modules::outline::{Mark, outline, reach};

/// What removals are judged by.
#[derive(Clone, Copy, Debug)]
pub struct RemovalGround<'a> {
    /// Heights of the tile's posts and of those within [`halo_posts`](super::halo_posts) around it, cut to the area.
    pub dem: &'a Dem,
    /// Weights of the same posts.
    pub mask: &'a Importance,
    /// Points that must stay, in ascending order.
    pub pins: &'a [Post],
    /// Load modules that hold too much, anywhere in the area, in ascending order.
    pub over: &'a [ModuleId],
}

/// A point that could be removed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Removal {
    /// The point.
    pub post: Post,
    /// What the sum of squared weighted residuals gains, in (thousandths of weight x quanta) squared; may be negative.
    pub sse_increase: i128,
    /// What the load modules around it gain or lose, in ascending order; those that stay as they are are left out.
    pub freed: Vec<Freed>,
    /// The points around it, in ascending order. Removing two neighbours at once makes both forecasts estimates.
    pub ring: Vec<Post>,
}

/// What removing a point frees in one load module; negative where it costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Freed {
    /// The load module.
    pub module: ModuleId,
    /// Triangles fewer, with pieces fanned.
    pub triangles: i32,
    /// Polygons fewer.
    pub polygons: i32,
}

/// Points of the tile whose removal would free something in a load module that holds too much, cheapest first.
///
/// Each point of the area is proposed by one tile: that which holds it, its southern and western sides included.
/// Corners of load modules, points on the area's outer border and pins stay. The forecast is exact for one removal
/// (but for crossings that round to one quantum); tiles are independent of each other.
pub fn propose_removals(points: &[Vertex], layout: &Layout, ground: &RemovalGround) -> Vec<Removal> {
    if !is_near_one_over(layout, ground.over) {
        return Vec::new();
    }
    let points = points_around(points, layout);
    let places: Vec<_> = points.iter().map(|vertex| vertex.at).collect();
    let triangles = terrain::mesh::delaunay(&places);
    let stars = Stars::of(&triangles, points.len());
    let mut counts = Counts { layout, marks: Vec::new() };
    let candidates = (0..points.len() as u32).filter(|&v| may_go(points[v as usize].at, layout, ground.pins));
    let mut proposals: Vec<_> = candidates
        .filter_map(|v| {
            let ring: Vec<_> = stars.ring(&triangles, v).into_iter().map(|u| points[u as usize]).collect();
            propose(points[v as usize], &ring, &mut counts, ground)
        })
        .collect();
    proposals.sort_by_key(|removal| (removal.sse_increase, removal.post));
    proposals
}

/// Whether a star centred in the tile may reach a load module that holds too much: stars end within the halo,
/// which is less than two load modules wide.
fn is_near_one_over(layout: &Layout, over: &[ModuleId]) -> bool {
    let tile = layout.modules;
    let near = |v: u32, low: u32, high: u32| low.saturating_sub(2) <= v && v < high + 2;
    over.iter().any(|id| near(id.row, tile.south, tile.north) && near(id.col, tile.west, tile.east))
}

/// Whether a point belongs to the tile and nothing holds it in place.
fn may_go(at: LatticePoint, layout: &Layout, pins: &[Post]) -> bool {
    let side = layout.side_lattice();
    let belongs = layout.slot(at.row.div_euclid(side), at.col.div_euclid(side)).is_some();
    let is_corner = at.row % side == 0 && at.col % side == 0;
    let area = layout.grid.area();
    let is_pin = |post: Post| pins.binary_search(&post).is_ok();
    let on_border =
        |post: Post| post.row == area.south || post.row == area.north || post.col == area.west || post.col == area.east;
    belongs && !is_corner && at.post().is_some_and(|post| !is_pin(post) && !on_border(post))
}

fn propose(point: Vertex, ring: &[Vertex], counts: &mut Counts, ground: &RemovalGround) -> Option<Removal> {
    let places: Vec<_> = ring.iter().map(|vertex| vertex.at).collect();
    let star = || (0..ring.len()).map(|i| [point, ring[i], ring[(i + 1) % ring.len()]]);
    let is_over = |module: ModuleId| ground.over.binary_search(&module).is_ok();
    if !star().any(|triangle| counts.reaches(triangle.map(|v| v.at), is_over)) {
        return None;
    }
    let filling: Vec<_> = fill(&places).into_iter().map(|triangle| triangle.map(|i| ring[i])).collect();
    let mut changes = Vec::new();
    star().for_each(|triangle| counts.add(triangle, 1, &mut changes));
    filling.iter().for_each(|&triangle| counts.add(triangle, -1, &mut changes));
    let freed = summed(changes);
    if !freed.iter().any(|freed| is_over(freed.module) && (0 < freed.triangles || 0 < freed.polygons)) {
        return None;
    }
    let post = point.at.post()?;
    let squares = |triangle: [Vertex; 3]| squared_residuals(triangle, post, ground);
    let before: u128 = star().map(squares).sum();
    let after: u128 = filling.iter().map(|&triangle| squares(triangle)).sum();
    let mut ring: Vec<_> = places.iter().filter_map(|place| place.post()).collect();
    ring.sort_unstable();
    Some(Removal { post, sse_increase: after as i128 - before as i128, freed, ring })
}

/// Changes per load module, those that cancel out left away.
fn summed(mut changes: Vec<Freed>) -> Vec<Freed> {
    changes.sort_unstable();
    let mut freed: Vec<Freed> = Vec::new();
    for change in changes {
        match freed.last_mut() {
            Some(last) if last.module == change.module => {
                last.triangles += change.triangles;
                last.polygons += change.polygons;
            }
            _ => freed.push(change),
        }
    }
    freed.retain(|freed| freed.triangles != 0 || freed.polygons != 0);
    freed
}

/// Squared weighted residuals of the posts a triangle owns, voids left out.
fn squared_residuals(triangle: [Vertex; 3], near: Post, ground: &RemovalGround) -> u128 {
    // Coordinates from a corner of the star keep products small.
    let corner = LatticePoint::from(near);
    let cells = |v: i32, from: i32| (v - from) / terrain::LATTICE_PER_POST;
    let facet = Facet::new(
        triangle.map(|v| cells(v.at.col, corner.col)),
        triangle.map(|v| cells(v.at.row, corner.row)),
        triangle.map(|v| v.height),
    );
    let grid = PostGrid { origin: near, units_per_post: 1, far_row: None, far_col: None };
    let mut sum = 0;
    visit_residuals(&grid, &facet, ground.dem, |post, residual| {
        if !ground.dem.is_void(post) {
            let weighted = u64::from(ground.mask.weight(post)) * u64::from(residual.unsigned_abs());
            sum += u128::from(weighted) * u128::from(weighted);
        }
    });
    sum
}

/// Counts the pieces of triangles per load module.
struct Counts<'a> {
    layout: &'a Layout,
    marks: Vec<Mark>,
}

impl Counts<'_> {
    /// Whether a triangle has a piece in a load module that `wanted` names.
    fn reaches(&mut self, triangle: [LatticePoint; 3], wanted: impl Fn(ModuleId) -> bool) -> bool {
        let (rows, cols) = reach(triangle, self.layout.side_lattice());
        let mut all = (rows.0..=rows.1).flat_map(|row| (cols.0..=cols.1).map(move |col| (row, col)));
        all.any(|(row, col)| wanted(ModuleId { row: row as u32, col: col as u32 }))
    }

    /// Adds `sign` times the pieces of a triangle to `changes`.
    fn add(&mut self, triangle: [Vertex; 3], sign: i32, changes: &mut Vec<Freed>) {
        let (corners, side) = (triangle.map(|v| v.at), self.layout.side_lattice());
        outline(corners, side, &mut self.marks);
        let (rows, cols) = reach(corners, side);
        for row in rows.0..=rows.1 {
            for col in cols.0..=cols.1 {
                let sides = self.marks.iter().filter(|mark| mark.lies_in(row, col)).count() as i32;
                if 3 <= sides {
                    let module = ModuleId { row: row as u32, col: col as u32 };
                    changes.push(Freed { module, triangles: sign * (sides - 2), polygons: sign });
                }
            }
        }
    }
}

/// The triangles around each point: `around[starts[v]..starts[v + 1]]`.
struct Stars {
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Stars {
    fn of(triangles: &[[u32; 3]], points: usize) -> Self {
        let mut starts = vec![0_u32; points + 1];
        triangles.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
        for v in 0..points {
            starts[v + 1] += starts[v];
        }
        let (mut next, mut around) = (starts.clone(), vec![0; 3 * triangles.len()]);
        for (t, triangle) in triangles.iter().enumerate() {
            for &v in triangle {
                around[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Self { starts, around }
    }

    /// The points around an inner point, counter-clockwise.
    fn ring(&self, triangles: &[[u32; 3]], v: u32) -> Vec<u32> {
        let star = &self.around[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize];
        let sides: Vec<_> = star
            .iter()
            .map(|&t| {
                let mut triangle = triangles[t as usize];
                let turn = triangle.iter().position(|&u| u == v).expect("a star's triangles hold its centre");
                triangle.rotate_left(turn);
                (triangle[1], triangle[2])
            })
            .collect();
        let mut ring = vec![sides[0].0];
        while ring.len() < sides.len() {
            let last = ring[ring.len() - 1];
            let side = sides.iter().find(|side| side.0 == last);
            ring.push(side.expect("a point inside the area has triangles all around").1);
        }
        ring
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use std::collections::BTreeSet;

    use terrain::{LoadModule, ModuleGrid, ModuleRect, Spacing};

    use super::*;
    use crate::load_modules::sheets::points;
    use crate::load_modules::{ClipHeights, clip};

    const GRID: ModuleGrid = ModuleGrid { rows: 4, cols: 4, side_cells: 20 };

    fn whole() -> Layout {
        Layout { grid: GRID, modules: GRID.all(), spacing: Spacing::from_metres(25.0).unwrap() }
    }

    fn ground_of(seed: u64) -> (Dem, Importance) {
        let (mut draw, area) = (Rng::with_seed(seed), GRID.area());
        let dem = Dem::from_fn(area, |_| (0 < draw.u32(..40)).then(|| draw.i32(0..60_000)));
        let weights = area.posts().map(|post| if post.row < 30 { 8000 } else { 1000 }).collect();
        (dem, Importance::new(area, weights, vec![0; area.post_count()]))
    }

    fn sse(points: &[Vertex], ground: &RemovalGround) -> i128 {
        let places: Vec<_> = points.iter().map(|v| v.at).collect();
        let triangles = terrain::mesh::delaunay(&places).into_iter().map(|t| t.map(|v| points[v as usize]));
        triangles.map(|t| squared_residuals(t, Post::new(0, 0), ground) as i128).sum()
    }

    fn counts(modules: &[LoadModule]) -> Vec<(i32, i32)> {
        modules.iter().map(|m| (m.triangles.len() as i32, m.polygon_count as i32)).collect()
    }

    #[test]
    fn a_forecast_is_what_removing_the_point_does() {
        for seed in 0..4 {
            let layout = whole();
            let points = points(GRID, 5, 70, seed);
            let (dem, mask) = ground_of(seed);
            let over = [ModuleId { row: 1, col: 2 }, ModuleId { row: 2, col: 2 }];
            let ground = RemovalGround { dem: &dem, mask: &mask, pins: &[], over: &over };
            let before = clip(&points, &layout, ClipHeights::Coplanar, &mask);
            let proposals = propose_removals(&points, &layout, &ground);
            assert!(5 < proposals.len());
            assert!(proposals.is_sorted_by_key(|removal| removal.sse_increase));
            for removal in proposals {
                let without: Vec<_> = points.iter().copied().filter(|v| v.at.post() != Some(removal.post)).collect();
                let after = clip(&without, &layout, ClipHeights::Coplanar, &mask);
                let expected: Vec<_> = GRID
                    .all()
                    .iter()
                    .zip(counts(&before).into_iter().zip(counts(&after)))
                    .map(|(module, (b, a))| Freed { module, triangles: b.0 - a.0, polygons: b.1 - a.1 })
                    .filter(|freed| freed.triangles != 0 || freed.polygons != 0)
                    .collect();
                assert_eq!(removal.freed, expected, "seed {seed}, post {}", removal.post);
                assert_eq!(removal.sse_increase, sse(&without, &ground) - sse(&points, &ground), "seed {seed}");
            }
        }
    }

    #[test]
    fn tiles_propose_what_the_whole_area_proposes_each_point_once() {
        let points = points(GRID, 5, 200, 7);
        let (dem, mask) = ground_of(7);
        let over = [ModuleId { row: 0, col: 0 }, ModuleId { row: 1, col: 1 }, ModuleId { row: 1, col: 2 }];
        let ground = RemovalGround { dem: &dem, mask: &mask, pins: &[], over: &over };
        let mut found = Vec::new();
        for (south, west) in [(0, 0), (0, 2), (2, 0), (2, 2)] {
            let modules = ModuleRect { south, west, north: south + 2, east: west + 2 };
            found.extend(propose_removals(&points, &Layout { modules, ..whole() }, &ground));
        }
        found.sort_by_key(|removal| (removal.sse_increase, removal.post));
        assert_eq!(found, propose_removals(&points, &whole(), &ground));
    }

    #[test]
    fn corners_border_points_and_pins_stay() {
        let points = points(GRID, 5, 100, 3);
        let (dem, mask) = ground_of(3);
        let over: Vec<_> = GRID.all().iter().collect();
        let mut ground = RemovalGround { dem: &dem, mask: &mask, pins: &[], over: &over };
        let all: BTreeSet<_> = propose_removals(&points, &whole(), &ground).iter().map(|r| r.post).collect();
        let inner = |post: &Post| 0 < post.row && post.row < 80 && 0 < post.col && post.col < 80;
        assert!(all.iter().all(|post| inner(post) && (post.row % 20 != 0 || post.col % 20 != 0)));
        let pins: Vec<_> = all.iter().copied().step_by(3).collect();
        ground.pins = &pins;
        let rest = propose_removals(&points, &whole(), &ground);
        assert_eq!(rest.len(), all.len() - pins.len());
        assert!(rest.iter().all(|removal| !pins.contains(&removal.post)));
    }

    #[test]
    fn nothing_is_proposed_where_nothing_is_over() {
        let points = points(GRID, 5, 100, 3);
        let (dem, mask) = ground_of(3);
        let ground = RemovalGround { dem: &dem, mask: &mask, pins: &[], over: &[] };
        assert!(propose_removals(&points, &whole(), &ground).is_empty());
    }
}
