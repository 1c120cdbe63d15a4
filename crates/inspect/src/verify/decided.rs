//! What features of the area came to, against what they put into each tile: the same lines at the same heights, and
//! what must hold of them, counted anew.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use build::ground::GamingArea;
use store::{AreaLevel, FeatureLine, ReportFeatureChecks};
use terrain::Role;
use terrain::{LatticePoint, ModuleId, QUANTA_PER_METRE, SurfaceGround, TileFeatures, Vertex};

use tin::load_modules::SPARE_MAX;

use super::laid::place_text;

/// A ring with its class, its corners in ascending order.
type Ring = (u8, Vec<(LatticePoint, i32)>);

/// What features put into all tiles together.
pub(crate) struct Decided<'a> {
    area: &'a GamingArea,
    steps: i32,
    heights: HashMap<LatticePoint, i32>,
    edges: HashSet<[LatticePoint; 2]>,
    decks: BTreeSet<Ring>,
    /// Pieces of strips that nothing cuts: the corners of the end, then those of the beginning, each piece once.
    strips: BTreeSet<(u8, Vec<(LatticePoint, i32)>)>,
}

impl<'a> Decided<'a> {
    pub fn new(area: &'a GamingArea) -> Self {
        let (heights, edges) = (HashMap::new(), HashSet::new());
        Self { area, steps: 0, heights, edges, decks: BTreeSet::new(), strips: BTreeSet::new() }
    }

    /// Adds those of a tile; returns what two tiles do not agree on.
    pub fn add(&mut self, features: &TileFeatures) -> Option<String> {
        let kept = &features.kept;
        self.steps = kept.steps_per_post;
        let mut differs = None;
        for vertex in &kept.vertices {
            let height = *self.heights.entry(vertex.at).or_insert(vertex.height);
            if height != vertex.height {
                differs = differs.or(Some(vertex.at));
            }
        }
        for &[a, b] in &kept.edges {
            let [a, b] = [a, b].map(|end| kept.vertices[end as usize].at);
            self.edges.insert([a.min(b), a.max(b)]);
        }
        self.decks.extend(features.decks.iter().map(|deck| {
            let corners = deck.ring.iter().map(|vertex| (vertex.at, vertex.height));
            ring(deck.class, corners)
        }));
        let roads = features.surfaces.iter().filter(|surface| surface.ground == SurfaceGround::Strip);
        let corners = |ring: &[Vertex]| ring.iter().map(|vertex| (vertex.at, vertex.height)).collect();
        self.strips.extend(roads.map(|road| (road.class, corners(&road.ring))));
        let place = self.text(differs?);
        Some(format!("survey/{}.lines: a vertex has another height than in the tile beside it, {place}", features.tile))
    }

    /// What is wrong with `level`, where load modules have so many triangles of decks, and, where a report lists them,
    /// with figures that follow from it.
    pub fn problems(
        &self,
        level: &AreaLevel,
        decks: &BTreeMap<ModuleId, u32>,
        listed: Option<&ReportFeatureChecks>,
    ) -> Vec<String> {
        let mut problems = Vec::new();
        problems.extend(self.differing_lines(level));
        problems.extend(self.differing_decks(level));
        problems.extend(level.lines.iter().filter_map(|line| self.rising(line)));
        problems.extend(self.differing_cost(level));
        problems.extend(self.differing_reserved(level, decks));
        problems.extend(self.differing_strips(level));
        problems.extend(listed.into_iter().flat_map(|listed| self.differing_checks(level, listed)));
        problems
    }

    fn text(&self, at: LatticePoint) -> String {
        let step = self.step();
        place_text(self.area, (i64::from(at.row) * step, i64::from(at.col) * step))
    }

    /// Quanta of a step.
    fn step(&self) -> i64 {
        i64::from(self.area.frame.spacing.quanta_per_post()) / i64::from(self.steps.max(1))
    }

    fn vertex(&self, [east, north, height]: [f64; 3]) -> (LatticePoint, i32) {
        let frame = self.area.frame;
        let step_m = frame.spacing.metres() / f64::from(self.steps.max(1));
        let steps = |at: f64, origin: f64| ((at - origin) / step_m).round() as i32;
        let place = LatticePoint::new(steps(north, frame.origin_north_m), steps(east, frame.origin_east_m));
        (place, (height * f64::from(QUANTA_PER_METRE)).round() as i32)
    }

    fn is_inside(&self, at: LatticePoint) -> bool {
        let (rect, steps) = (self.area.rect, self.steps);
        (rect.south * steps..=rect.north * steps).contains(&at.row)
            && (rect.west * steps..=rect.east * steps).contains(&at.col)
    }

    /// The edges of a line that lie in the area, in its direction.
    fn edges_of(&self, line: &FeatureLine) -> Vec<[(LatticePoint, i32); 2]> {
        let vertices: Vec<(LatticePoint, i32)> = line.vertices.iter().map(|vertex| self.vertex(*vertex)).collect();
        let pairs = vertices.windows(2).map(|pair| [pair[0], pair[1]]);
        pairs.filter(|pair| pair.iter().all(|(at, _)| self.is_inside(*at))).collect()
    }

    /// Lines that are not those of the tiles.
    fn differing_lines(&self, level: &AreaLevel) -> Vec<String> {
        let mut problems = Vec::new();
        let mut left = self.edges.clone();
        for line in &level.lines {
            let edges = self.edges_of(line);
            let name = format!("survey/features.level: {} of {}", line.role.name(), line.feature);
            let moved = edges.iter().flatten().find(|(at, height)| self.heights.get(at) != Some(height));
            if let Some(&(at, height)) = moved {
                let (metres, place) = (terrain::metres_of_quanta(height), self.text(at));
                problems.push(format!("{name} lies at {metres} m {place}, and no file of a tile says so"));
            }
            let keys = edges.iter().map(|[(a, _), (b, _)]| [*a.min(b), *a.max(b)]);
            let missing = keys.filter(|key| !self.edges.contains(key) || !left.remove(key)).count();
            if 0 < missing && moved.is_none() {
                problems.push(format!("{name} has {missing} edges that no file of a tile has, or that it has twice"));
            }
        }
        if !left.is_empty() && problems.is_empty() {
            problems.push(format!("survey/features.level: lacks {} edges that files of tiles have", left.len()));
        }
        problems
    }

    /// Decks over the area that are not those of the tiles.
    fn differing_decks(&self, level: &AreaLevel) -> Option<String> {
        let rings = level.decks.iter().map(|deck| ring(deck.class, deck.ring.iter().map(|at| self.vertex(*at))));
        let near = |(_, corners): &Ring| {
            let (rect, steps) = (self.area.rect, self.steps);
            let reaches = |of: fn(&LatticePoint) -> i32, low: i32, high: i32| {
                let all = || corners.iter().map(|(at, _)| of(at));
                low * steps < all().max().unwrap_or(i32::MIN) && all().min().unwrap_or(i32::MAX) < high * steps
            };
            reaches(|at| at.row, rect.south, rect.north) && reaches(|at| at.col, rect.west, rect.east)
        };
        let found: BTreeSet<Ring> = rings.filter(near).collect();
        let expected: BTreeSet<&Ring> = self.decks.iter().filter(|ring| near(ring)).collect();
        let differs = found.iter().collect::<BTreeSet<_>>() != expected;
        differs.then(|| "survey/features.level: its decks are not those that files of tiles have".to_owned())
    }

    /// The first edge of a channel that rises downstream.
    fn rising(&self, line: &FeatureLine) -> Option<String> {
        let edges = self.edges_of(line);
        let is_channel = line.role == Role::Channel;
        let [(at, from), (_, to)] = edges.into_iter().find(|[from, to]| is_channel && from.1 < to.1)?;
        let ([from, to], place) = ([from, to].map(terrain::metres_of_quanta), self.text(at));
        Some(format!("survey/features.level: {} rises downstream from {from} m to {to} m {place}", line.feature))
    }

    /// Triangles that the vertices of features and the corners of decks come to in each load module.
    fn differing_cost(&self, level: &AreaLevel) -> Option<String> {
        let grid = self.area.grid;
        let mut expected = self.of_vertices(level);
        let side = self.steps * grid.side_cells;
        for deck in &level.decks {
            let places: Vec<LatticePoint> = deck.ring.iter().map(|at| self.vertex(*at).0).collect();
            let span = |of: fn(&LatticePoint) -> i32| {
                let all = || places.iter().map(|at| of(at).div_euclid(side));
                all().min().unwrap_or(0)..=all().max().unwrap_or(-1)
            };
            for row in span(|at| at.row) {
                for col in span(|at| at.col) {
                    *expected.entry((row, col)).or_default() += places.len() as u32;
                }
            }
        }
        let mut found: BTreeMap<(i32, i32), u32> = BTreeMap::new();
        for &(place, _, triangles) in &level.cost {
            let at = (place / grid.cols, place % grid.cols);
            *found.entry((at.0 as i32, at.1 as i32)).or_default() += triangles;
        }
        let is_of_area =
            |(row, col): (i32, i32)| (0..grid.rows as i32).contains(&row) && (0..grid.cols as i32).contains(&col);
        expected.retain(|at, triangles| is_of_area(*at) && 0 < *triangles);
        found.retain(|_, triangles| 0 < *triangles);
        let (row, col) = expected.keys().chain(found.keys()).copied().find(|at| expected.get(at) != found.get(at))?;
        let [found, expected] = [&found, &expected].map(|of| of.get(&(row, col)).copied().unwrap_or(0));
        Some(format!(
            "survey/features.level: features cost {found} triangles of load module {row},{col}, their vertices and \
             decks come to {expected}"
        ))
    }

    /// Pieces of strips that lie in the area with all corners: they are counted, and as uneven as they are.
    fn differing_strips(&self, level: &AreaLevel) -> Option<String> {
        let mut own: BTreeMap<u8, (u64, u32)> = BTreeMap::new();
        for (class, ring) in &self.strips {
            let [right_to, left_to, left_from, right_from] = ring[..] else { continue };
            if ring.iter().all(|(at, height)| self.is_inside(*at) && self.heights.get(at) == Some(height)) {
                let fall = right_to.1.abs_diff(left_to.1).max(left_from.1.abs_diff(right_from.1));
                let (pieces, most) = own.entry(*class).or_default();
                (*pieces, *most) = (*pieces + 1, fall.max(*most));
            }
        }
        let listed = |class: u8| level.strips.iter().find(|strips| strips.class == class).copied().unwrap_or_default();
        let less = own.iter().find(|(class, (pieces, fall))| {
            let listed = listed(**class);
            listed.pieces < *pieces || listed.fall_max < *fall
        });
        let (class, (pieces, fall)) = less?;
        let found = listed(*class);
        Some(format!(
            "survey/features.level: class {class} has {} pieces of strips that fall across by {} quanta at most, the \
             files of tiles have {pieces} and {fall}",
            found.pieces, found.fall_max
        ))
    }

    /// Two triangles for each vertex inside a load module, one for each on its side.
    fn of_vertices(&self, level: &AreaLevel) -> BTreeMap<(i32, i32), u32> {
        let side = self.steps * self.area.grid.side_cells;
        let mut triangles: BTreeMap<(i32, i32), u32> = BTreeMap::new();
        let vertices = level.lines.iter().flat_map(|line| &line.vertices);
        let places: HashSet<LatticePoint> = vertices.map(|vertex| self.vertex(*vertex).0).collect();
        for at in &places {
            let (row, col) = (at.row.div_euclid(side), at.col.div_euclid(side));
            let of: &[((i32, i32), u32)] = match (at.row.rem_euclid(side), at.col.rem_euclid(side)) {
                (0, 0) => &[],
                (0, _) => &[((row, col), 1), ((row - 1, col), 1)],
                (_, 0) => &[((row, col), 1), ((row, col - 1), 1)],
                _ => &[((row, col), 2)],
            };
            of.iter().for_each(|(module, count)| *triangles.entry(*module).or_default() += count);
        }
        triangles
    }

    /// What is reserved in each load module: what vertices come to, but for those on posts of the outer border that are
    /// there anyway, and the decks that it has.
    fn differing_reserved(&self, level: &AreaLevel, decks: &BTreeMap<ModuleId, u32>) -> Option<String> {
        let (grid, rect) = (self.area.grid, self.area.rect);
        let side = self.steps * grid.side_cells;
        let mut anyway: BTreeMap<(i32, i32), u32> = BTreeMap::new();
        for at in self.heights.keys() {
            let on = |v: i32, low: i32, high: i32| v == low * self.steps || v == high * self.steps;
            if on(at.row, rect.south, rect.north) || on(at.col, rect.west, rect.east) {
                let within = |v: i32, count: u32| v.div_euclid(side).min(count as i32 - 1);
                *anyway.entry((within(at.row, grid.rows), within(at.col, grid.cols))).or_default() += 1;
            }
        }
        let (triangles, reserved) = (self.of_vertices(level), level.reserved_of(grid.count()));
        let is_wrong = |id: &ModuleId| {
            let at = (id.row as i32, id.col as i32);
            let decks = decks.get(id).copied().unwrap_or(0);
            let all = triangles.get(&at).copied().unwrap_or(0) + decks;
            let least = all - anyway.get(&at).copied().unwrap_or(0).min(all);
            // Decks may have more where ground stands above them.
            let most = if decks == 0 { all } else { all + SPARE_MAX as u32 };
            !(least..=most).contains(&reserved[grid.index(*id)])
        };
        let id = grid.all().iter().find(is_wrong)?;
        let found = reserved[grid.index(id)];
        Some(format!(
            "survey/features.level: {found} triangles of load module {id} are reserved, which is not what features \
             come to"
        ))
    }

    /// Figures of the report that are not those of the tiles' files.
    fn differing_checks(&self, level: &AreaLevel, listed: &ReportFeatureChecks) -> Vec<String> {
        let of = |role: Role| level.lines.iter().filter(move |line| line.role == role);
        let edges = |role: Role| of(role).map(|line| self.edges_of(line).len() as u64).sum::<u64>();
        let rising = |line: &FeatureLine| self.edges_of(line).iter().filter(|[from, to]| from.1 < to.1).count() as u64;
        let pieces: u64 = level.strips.iter().map(|strips| strips.pieces).sum();
        let pairs = [
            ("edges", self.edges.len() as u64, listed.edges),
            ("stations", edges(Role::Centre) + pieces, listed.stations),
            ("river_edges", edges(Role::Channel), listed.river_edges),
            ("river_edges_rising", of(Role::Channel).map(rising).sum(), listed.river_edges_rising),
        ];
        let wrong = pairs.into_iter().filter(|(_, found, listed)| found != listed);
        let mut problems: Vec<String> = wrong
            .map(|(key, found, listed)| {
                format!("report.json: features.checks.{key} is {listed}, the files of tiles say {found}")
            })
            .collect();
        let steep: u64 = of(Role::Centre).map(|line| self.steeper(line)).sum();
        if listed.stations_steeper < steep {
            let listed = listed.stations_steeper;
            problems
                .push(format!("report.json: features.checks.stations_steeper is {listed}, {steep} centrelines are"));
        }
        problems
    }

    /// Edges that rise by more than a grade lets them and a quantum.
    fn steeper(&self, line: &FeatureLine) -> u64 {
        let step = self.step() as f64;
        let is_steeper = |[(a, low), (b, high)]: &[(LatticePoint, i32); 2]| {
            let run = f64::from(b.col - a.col).hypot(f64::from(b.row - a.row)) * step;
            run * f64::from(line.grade_most_ppm) / 1e6 + 1.001 < f64::from(low.abs_diff(*high))
        };
        if line.grade_most_ppm == 0 {
            0
        } else {
            self.edges_of(line).iter().filter(|edge| is_steeper(edge)).count() as u64
        }
    }
}

fn ring(class: u8, corners: impl Iterator<Item = (LatticePoint, i32)>) -> Ring {
    let mut corners: Vec<(LatticePoint, i32)> = corners.collect();
    corners.sort_unstable();
    (class, corners)
}
