//! What roads, rivers and lakes move: cut and fill along them, how far they lie from the ground, and why.
//!
//! Only what is in the ground counts, inside the area. Volumes are those of a way of its width with slopes on both
//! sides: `(width d + 1.75 d d)` cubic metres a metre where it lies `d` metres off the ground.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashSet};

use terrain::{Earthwork, OffCause, QUANTA_PER_METRE, Role, metres_of_quanta};

use crate::sweep::Pin;
use crate::{FallOptions, FeatureId, GradeOptions, Graded, Histogram, Lake, Outline, Place, Site, Strand};

/// Metres off the ground beyond which lengths are told.
pub const OFF_M: [i32; 4] = [3, 5, 10, 20];

/// Metres that a slope beside a way runs for each metre of height; the two of them are triangles.
const SLOPES: f64 = 1.75;

/// Stations along which the cause of a cut is looked for.
const CAUSE_STATIONS_MAX: usize = 5000;

/// A place where a feature lies more than 3 m off the ground: the worst of it in its load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FarOff {
    /// The class.
    pub class: u16,
    /// The feature.
    pub id: FeatureId,
    /// Where.
    pub place: Place,
    /// Quanta above the ground; below it less than 0.
    pub off: i32,
    /// Why.
    pub cause: OffCause,
}

/// What a piece of a way from one station to the next moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// The feature.
    pub id: FeatureId,
    /// Its class.
    pub class: u16,
    /// Both stations.
    pub ends: [Place; 2],
    /// Cubic metres cut and filled.
    pub moved_m3: [f64; 2],
}

/// What all features move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Earthworks {
    /// By class.
    pub classes: BTreeMap<u16, Earthwork>,
    /// Places that lie far off, the farthest first.
    pub far_off: Vec<FarOff>,
    /// Cubic metres cut and filled in each load module (row, column), by class.
    pub modules: BTreeMap<((i32, i32), u16), [f64; 2]>,
    /// Every piece that moves something, in the order of ways.
    pub pieces: Vec<Moved>,
}

/// Roads, rivers and lakes with their heights, and the ground that they are measured against.
#[derive(Clone, Copy)]
pub(crate) struct Laid<'a> {
    /// The height of the ground inside the area.
    pub ground: &'a dyn Fn(Place) -> Option<i32>,
    /// Whether that is the ground at a station of a way, and not what closes a hole.
    pub is_known: &'a dyn Fn(Place) -> bool,
    pub site: &'a Site,
    /// Roads, with what is granted to each.
    pub roads: Graded<'a>,
    /// Heights of roads that are pinned.
    pub pins: &'a [Pin],
    /// Heights of roads that are those of lakes.
    pub afloat: &'a [Pin],
    /// Channels and shores.
    pub strands: &'a [Strand],
    /// The width of each feature, in quanta.
    pub width: &'a dyn Fn(FeatureId) -> i32,
    /// Where rivers lie level.
    pub level: &'a HashSet<Place>,
    pub outlines: &'a [Outline],
    pub lakes: &'a [Lake],
    /// Heights of the posts inside each outline.
    pub inside: &'a [Histogram],
    pub limits: (GradeOptions, FallOptions),
}

/// A piece of a way from one station to the next.
struct Piece {
    class: u16,
    id: FeatureId,
    width: i32,
    ends: [Place; 2],
    heights: [i32; 2],
    limits: [i32; 2],
    /// Its nodes, where it is a road.
    nodes: Option<[u32; 2]>,
}

/// Adds up what features move.
pub(crate) fn earthworks(laid: &Laid) -> Earthworks {
    let mut sums = Sums { laid, found: Earthworks::default(), worst: BTreeMap::new() };
    sums.roads();
    sums.channels();
    sums.lakes();
    let Sums { found, worst, .. } = sums;
    let mut far_off: Vec<FarOff> = worst
        .into_values()
        .map(|(mut far, node)| {
            far.cause = node.map_or(far.cause, |node| laid.cause(node, far.off));
            far
        })
        .collect();
    far_off.sort_by_key(|far| (Reverse(far.off.abs()), far.place, far.id));
    Earthworks { far_off, ..found }
}

/// The farthest of each feature in each load module, with its node where it is a road's.
type Worst = BTreeMap<(FeatureId, (i32, i32)), (FarOff, Option<u32>)>;

/// What was found so far.
struct Sums<'a> {
    laid: &'a Laid<'a>,
    found: Earthworks,
    worst: Worst,
}

impl Sums<'_> {
    fn roads(&mut self) {
        let Laid { roads: Graded { network, heights, grants, .. }, limits, .. } = *self.laid;
        for (number, edge) in (0u32..).zip(&network.edges) {
            if !network.is_ground(number) || grants.of_edge(number).out {
                continue;
            }
            let (segment, way, nodes) = (network.segment(number), &network.ways[edge.way as usize], [edge.a, edge.b]);
            self.add(&Piece {
                class: way.traits.class,
                id: way.id,
                width: way.traits.width,
                ends: [segment.a, segment.b],
                heights: nodes.map(|node| heights[node as usize]),
                limits: [limits.0.cut_max, limits.0.fill_max],
                nodes: Some(nodes),
            });
        }
    }

    fn channels(&mut self) {
        let Laid { strands, roads, limits, width, .. } = *self.laid;
        let of_role = strands.iter().enumerate().filter(|(_, strand)| strand.role == Role::Channel);
        for (_, strand) in of_role.filter(|(number, _)| !roads.grants.of_strand(*number).out) {
            for pair in strand.stations.windows(2) {
                self.add(&Piece {
                    class: strand.class,
                    id: strand.id,
                    width: width(strand.id),
                    ends: [pair[0].0, pair[1].0],
                    heights: [pair[0].1, pair[1].1],
                    limits: [limits.1.cut_max, limits.1.fill_max],
                    nodes: None,
                });
            }
        }
    }

    fn add(&mut self, piece: &Piece) {
        let Laid { site, ground, is_known, level, .. } = *self.laid;
        let [Some(a), Some(b)] = piece.ends.map(ground) else { return };
        if !site.holds_middle(piece.ends[0], piece.ends[1]) {
            return;
        }
        let is_known = piece.ends.into_iter().all(is_known);
        let off = if is_known { [piece.heights[0] - a, piece.heights[1] - b] } else { [0, 0] };
        let length = metres_of_quanta(site.lattice.length(piece.ends[0], piece.ends[1]) as i32);
        let work = self.found.classes.entry(piece.class).or_default();
        work.length_m += length;
        work.over_holes_m += if is_known { 0.0 } else { length };
        let mut moved = [0.0; 2];
        for off in off {
            count_off(work, off, length / 2.0, piece.limits);
            let (metres, width) = (metres_of_quanta(off.abs()), metres_of_quanta(piece.width));
            moved[usize::from(0 < off)] += (width * metres + SLOPES * metres * metres) * length / 2.0;
        }
        let module = site.module_under(piece.ends[0], piece.ends[1]);
        self.count_moved(piece.class, module, moved);
        if off != [0, 0] {
            let Piece { id, class, ends, .. } = *piece;
            self.found.pieces.push(Moved { id, class, ends, moved_m3: moved });
        }
        let end = usize::from(off[0].abs() < off[1].abs());
        let place = piece.ends[end];
        let cause = if level.contains(&place) { OffCause::Level } else { OffCause::Falling };
        let far = FarOff { class: piece.class, id: piece.id, place, off: off[end], cause };
        self.tell(module, far, piece.nodes.map(|nodes| nodes[end]));
    }

    /// Lakes: what lies above and below the level inside, and how far the shore does.
    fn lakes(&mut self) {
        let Laid { site, ground, outlines, lakes, strands, roads, inside, limits, .. } = *self.laid;
        let kept: BTreeSet<FeatureId> = strands
            .iter()
            .enumerate()
            .filter(|(number, strand)| strand.role == Role::Shore && !roads.grants.of_strand(*number).out)
            .map(|(_, strand)| strand.id)
            .collect();
        let post = f64::from(site.lattice.steps_per_post()) * site.lattice.metres_per_step();
        for lake in lakes {
            let outline = &outlines[lake.outline as usize];
            let Some(first) = outline.places().min().filter(|_| kept.contains(&outline.id)) else { continue };
            let class = outline.traits.class;
            let mut moved = [0.0; 2];
            for &(height, count) in &inside[lake.outline as usize] {
                let off = lake.level - height;
                moved[usize::from(0 < off)] += metres_of_quanta(off.abs()) * f64::from(count) * post * post;
            }
            self.count_moved(class, site.module_of(first), moved);
            for ring in &outline.rings {
                for (place, next) in ring.places.iter().zip(ring.places.iter().cycle().skip(1)) {
                    let length = metres_of_quanta(site.lattice.length(*place, *next) as i32);
                    let Some(ground) = ground(*place).filter(|_| site.holds_middle(*place, *next)) else { continue };
                    let work = self.found.classes.entry(class).or_default();
                    work.length_m += length;
                    let off = lake.level - ground;
                    count_off(work, off, length, [limits.1.cut_max, limits.1.fill_max]);
                    let far = FarOff { class, id: outline.id, place: *place, off, cause: OffCause::Level };
                    self.tell(site.module_of(*place), far, None);
                }
            }
        }
    }

    fn count_moved(&mut self, class: u16, module: (i32, i32), moved: [f64; 2]) {
        let of_class = &mut self.found.classes.entry(class).or_default().moved_m3;
        let of_module = self.found.modules.entry((module, class)).or_default();
        for ((of_class, of_module), moved) in of_class.iter_mut().zip(of_module).zip(moved) {
            *of_class += moved;
            *of_module += moved;
        }
    }

    fn tell(&mut self, module: (i32, i32), far: FarOff, node: Option<u32>) {
        if far.off.abs() <= OFF_M[0] * QUANTA_PER_METRE {
            return;
        }
        let by = |far: &FarOff| (far.off.abs(), Reverse(far.place));
        let known = self.worst.entry((far.id, module)).or_insert((far, node));
        if by(&known.0) < by(&far) {
            *known = (far, node);
        }
    }
}

/// Counts a length by how far it lies off the ground, in quanta, and by the limits of cut and fill.
fn count_off(work: &mut Earthwork, off: i32, length: f64, [cut_max, fill_max]: [i32; 2]) {
    for (over, times) in work.over_limit_m.iter_mut().zip([1, 2]) {
        let is_over = off < -times * cut_max || times * fill_max < off;
        *over += if is_over { length } else { 0.0 };
    }
    for (off_m, far_m) in work.off_m.iter_mut().zip(OFF_M) {
        *off_m += if far_m * QUANTA_PER_METRE < off.abs() { length } else { 0.0 };
    }
}

impl Laid<'_> {
    /// Why a road lies off the ground at a node: what holds it along edges as steep as they may be, or its grade.
    fn cause(&self, node: u32, off: i32) -> OffCause {
        let Graded { network, heights, .. } = self.roads;
        let has = |pins: &[Pin], node: u32| {
            pins.binary_search_by_key(&node, |pin| pin.node).is_ok_and(|at| pins[at].height == heights[node as usize])
        };
        let (mut seen, mut front) = (HashSet::from([node]), vec![node]);
        while let Some(node) = front.pop() {
            // Heights of lakes are among the pins.
            if has(self.afloat, node) {
                return OffCause::Level;
            }
            if has(self.pins, node) {
                return OffCause::Pin;
            }
            for &(next, edge) in network.beside(node) {
                // A cut is held down by what lies lower, a fill held up by what lies higher.
                let away = (heights[node as usize] - heights[next as usize]) * -off.signum();
                let is_tight = network.edges[edge as usize].rise_max - 1 <= away;
                if is_tight && seen.len() < CAUSE_STATIONS_MAX && seen.insert(next) {
                    front.push(next);
                }
            }
        }
        OffCause::Grade
    }
}

#[cfg(test)]
mod tests {
    use terrain::in_turn;

    use super::*;
    use crate::samples::{ground_at, network, site, way};
    use crate::{AreaFeatures, Grants, Shares, Sounded, Source};

    fn works(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64, inside: &[(i32, u32)]) -> Earthworks {
        let all = AreaFeatures::of(sources, &[], 1.5, site(), &in_turn);
        let ground: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &metres)).collect();
        let inside = vec![inside.to_vec(); all.outlines().len()];
        let sounded = Sounded { heights: &ground, middles: &ground, inside: &inside };
        let options = (GradeOptions::USUAL, FallOptions::USUAL);
        all.level(sounded, options, &Shares::each([8, 8], 1 << 20), &in_turn).earthworks
    }

    fn only(works: &Earthworks) -> Earthwork {
        assert_eq!(works.classes.len(), 1);
        *works.classes.values().next().unwrap()
    }

    #[test]
    fn a_road_over_a_step_cuts_and_fills_as_far_as_its_grade_asks_for() {
        let road = way(1, "highway=primary width=10", &[(10.0, 10.0), (90.0, 10.0)]);
        let found = works(vec![road], |east, _| if east < 50.0 { 0.0 } else { 15.0 }, &[]);
        let all = only(&found);
        assert!((all.length_m - 800.0).abs() < 0.1, "{all:?}");
        assert!(all.off_m.windows(2).all(|pair| pair[1] <= pair[0]) && 0.0 < all.off_m[0] && all.off_m[3] == 0.0);
        assert_eq!(all.over_limit_m, [0.0; 2]);
        let [worst, ..] = found.far_off[..] else { panic!("it is told") };
        assert_eq!((worst.cause, worst.id.number), (OffCause::Grade, 1));
        for sum in [
            found.pieces.iter().map(|piece| piece.moved_m3).fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]),
            found.modules.values().fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]),
        ] {
            assert!((0..2).all(|at| 100.0 < sum[at] && (sum[at] - all.moved_m3[at]).abs() < 1e-6), "{sum:?} {all:?}");
        }
    }

    #[test]
    fn what_lies_over_a_hole_is_told_and_moves_nothing() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (90.0, 10.0)]);
        let all = AreaFeatures::of(vec![road], &[], 1.5, site(), &in_turn);
        let ground: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &|_, _| 50.0)).collect();
        let east = all.stations().iter().map(|place| ground_at(*place, &|east, _| east));
        let middles: Vec<Option<i32>> = east.map(|east| east.filter(|east| *east < 50 * 128)).collect();
        let sounded = Sounded { heights: &ground, middles: &middles, inside: &[] };
        let options = (GradeOptions::USUAL, FallOptions::USUAL);
        let found = only(&all.level(sounded, options, &Shares::each([8, 8], 1 << 20), &in_turn).earthworks);
        assert!((390.0..420.0).contains(&found.over_holes_m) && found.moved_m3 == [0.0; 2], "{found:?}");
    }

    #[test]
    fn a_road_over_a_cliff_is_over_its_limits() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (90.0, 10.0)]);
        let found = works(vec![road], |east, _| if east < 50.0 { 0.0 } else { 80.0 }, &[]);
        let [over, twice] = only(&found).over_limit_m;
        assert!(100.0 < twice && twice < over);
        assert!(found.far_off.windows(2).all(|pair| pair[1].off.abs() <= pair[0].off.abs()));
    }

    #[test]
    fn a_lake_moves_what_lies_above_and_below_its_level() {
        let ring = [(10.0, 10.0), (20.0, 10.0), (20.0, 20.0), (10.0, 20.0), (10.0, 10.0)];
        // Ten posts 2 m above the level of nine others, and one 1 m below.
        let inside = [(99 * 128, 1), (100 * 128, 30), (102 * 128, 10)];
        let found = works(vec![way(1, "natural=water", &ring)], |_, _| 104.0, &inside);
        let all = only(&found);
        assert_eq!((all.moved_m3, all.length_m, all.off_m), ([2000.0, 100.0], 400.0, [400.0, 0.0, 0.0, 0.0]));
        assert_eq!(found.far_off[0].cause, OffCause::Level);
    }

    #[test]
    fn a_river_that_has_to_fall_says_so_and_one_in_a_circle_lies_level() {
        let river = way(1, "waterway=river", &[(10.0, 10.0), (60.0, 10.0)]);
        let found = works(vec![river], |east, _| if (30.0..34.0).contains(&east) { 180.0 } else { 100.0 - east }, &[]);
        assert_eq!((found.far_off[0].cause, found.far_off[0].off < 0), (OffCause::Falling, true));
        let ring = [(10.0, 10.0), (40.0, 10.0), (40.0, 40.0), (10.0, 40.0), (10.0, 10.0)];
        let found = works(vec![way(1, "waterway=river", &ring)], |east, _| 2.0 * east, &[]);
        assert!(found.far_off.iter().all(|far| far.cause == OffCause::Level) && !found.far_off.is_empty());
    }

    #[test]
    fn what_holds_a_road_off_the_ground_is_found_along_what_is_as_steep_as_it_may_be() {
        let (network, ground, _) = network(vec![way(1, "highway=primary", &[(10.0, 10.0), (30.0, 10.0)])], |_, _| 10.0);
        let mut heights: Vec<i32> = ground.iter().map(|height| height.unwrap()).collect();
        heights[0] += 30 * 128;
        for node in 1..heights.len() {
            heights[node] = heights[node].max(heights[node - 1] - network.edges[node - 1].rise_max);
        }
        let (grants, pin, site) = (Grants::default(), [Pin { node: 0, height: heights[0] }], site());
        let laid = |pins, afloat| {
            Laid {
                ground: &|_| None,
                is_known: &|_| true,
                site: &site,
                roads: Graded { network: &network, heights: &heights, beside: &[], grants: &grants },
                pins,
                afloat,
                strands: &[],
                width: &|_| 0,
                level: &HashSet::new(),
                outlines: &[],
                lakes: &[],
                inside: &[],
                limits: (GradeOptions::USUAL, FallOptions::USUAL),
            }
            .cause(10, 128)
        };
        assert_eq!(
            (laid(&pin, &[]), laid(&pin, &pin), laid(&[], &[])),
            (OffCause::Pin, OffCause::Level, OffCause::Grade)
        );
    }
}
