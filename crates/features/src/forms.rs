//! What features are in the TIN: points with heights, edges to keep, faces with a class, and decks above.
//!
//! Strips, lines, outlines and channels are rounded to the lattice once more, together, so that any two of them touch
//! at shared points or not at all; where two had different heights at a point, the higher class keeps its own.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use terrain::{Each, gather};

use crate::clean::Notes;
use crate::culverts::{Bank, Culvert, culvert, enter_culverts, in_banks, is_near};
use crate::decks::between;
use crate::exact::Segment;
use crate::inside::{Inside, LINES_AT_ONCE};
use crate::middles::{Middle, middles};
use crate::pieces::{Piece, is_narrow, pieces};
use crate::room::{Sharing, Squares, by_corners, remark_rooms};
use crate::snap::snap_round;
use crate::strand::{Graded, Role, Strand};
use crate::strips::{Face, Room, Wide, has_room};
use crate::thin::{Station, Tolerance, thin};
use crate::toes::toes;
use crate::{FeatureId, Flaw, Form, Grant, Grants, Network, Place, Remark, Remedy, Site};

/// A line inside a strip is worth a remark from this length on, in quanta: below it, it only ends at the strip's edge.
const CUT_LENGTH_MIN: i64 = 30 * 128;

/// A side of a strip may rise by so many quanta (0.25 m) more than the grade of its centreline lets it: the inner sides
/// of bends do, and what rounding moves.
const SIDE_BEYOND_MAX: i32 = 32;

/// An edge the TIN has to keep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FormedEdge {
    /// Its lesser end, in [`Formed::points`].
    pub a: u32,
    /// Its other end.
    pub b: u32,
    /// What it is.
    pub role: Role,
    /// Its class.
    pub class: u16,
    /// Which feature it comes from.
    pub id: FeatureId,
    /// Whether its line runs from `b` to `a`: a channel runs downstream.
    pub backwards: bool,
}

/// A ring of edges of the TIN, or of what a higher class left of it, around ground of its class: a part of a strip,
/// a shore, or a bank. Rings of one feature and role inside one another are its holes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Surface {
    /// Its class.
    pub class: u16,
    /// Side, shore or bank.
    pub role: Role,
    /// Its places with their heights in quanta; the first is not repeated.
    pub ring: Vec<(Place, i32)>,
    /// Which feature it comes from.
    pub id: FeatureId,
}

/// All that features put into the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Formed {
    /// Points with their heights in quanta, by place.
    pub points: Vec<(Place, i32)>,
    /// Edges between them, by their ends: no two cross, and no point lies inside one.
    pub edges: Vec<FormedEdge>,
    /// Strips and junctions on the ground, by class.
    pub faces: Vec<Face>,
    /// What edges of the TIN enclose and a class of its own covers, by class.
    pub surfaces: Vec<Surface>,
    /// Ground that a class of its own covers without being in the TIN: what there was no room for.
    pub shaped: Vec<Surface>,
    /// Edges of roads that there was no room for, beside which the ground slopes to the natural one.
    pub shaped_slopes: Vec<[(Place, i32); 2]>,
    /// The surfaces of decks.
    pub decks: Vec<Face>,
    /// The middle lines of all ways, in the ground or not.
    pub middles: Vec<Middle>,
    /// What was changed.
    pub remarks: Vec<Remark>,
}

/// Forms a network and all other strands together; `each` runs what falls into pieces, and `between` is what the rounds
/// between the first and the last look at. Without it the first is all: about what features put into the ground, before
/// strips give way to what would tilt them.
pub(crate) fn form(graded: &Graded, strands: &[Strand], site: &Site, each: Each, between: Option<Scope>) -> Formed {
    let Graded { network, heights, grants, .. } = *graded;
    let mut remarks = Vec::new();
    let shared = shared_places(network, strands, grants);
    let stays = |place: Place| shared.contains(&place);
    let pieces = pieces(network, heights, site, &stays, grants);
    remark_narrow(network, &pieces, &mut remarks);
    let thinned = |(number, strand): (usize, &Strand)| thinned(strand, grants.of_strand(number), site, &stays);
    let thinned = strands.iter().enumerate().filter_map(thinned).collect();
    let sharing = Sharing::of(network, &pieces, heights);
    let mut forming = Forming { graded, pieces: &pieces, sharing, thinned, faces: Vec::new(), site, each };
    let (mut formed, culverts) = forming.round_together(Scope::Whole);
    if enter_culverts(&mut forming.thinned, culverts) {
        formed = forming.round_together(Scope::Whole).0;
    }
    let Some(between) = between else { return formed };
    // Each round takes the room of a strip or lowers a lake, so that there is a last one. A strip that gives way
    // changes only what is near it, and only that is looked at until none does; the last round is one of all again.
    let mut scope = Scope::Whole;
    loop {
        let mut narrowed = tilted(&formed, network, &forming.sharing);
        narrowed.extend(forming.sharing.alone().into_iter().map(|number| (number, Room::None)));
        let uneven = if scope == Scope::Whole { uneven(&formed) } else { BTreeMap::new() };
        if narrowed.is_empty() && uneven.is_empty() && scope == Scope::Whole {
            break;
        }
        scope = if narrowed.is_empty() || !uneven.is_empty() { Scope::Whole } else { between };
        for (lake, place) in uneven {
            lower(&mut forming.thinned, &lake);
            let mut notes = Notes { id: lake.id, lattice: site.lattice, remarks: &mut remarks };
            notes.write_at(place, Flaw::LevelsDisagree, Remedy::Levelled);
        }
        narrowed.into_iter().for_each(|(number, room)| forming.sharing.narrow(number, room));
        formed = forming.round_together(scope).0;
    }
    let Forming { sharing, thinned, .. } = forming;
    let points = within(&formed, site);
    let decided = (&points[..], &formed.faces[..], &mut formed.decks[..]);
    formed.middles = middles(graded, (&pieces, &sharing.wide), (strands, &thinned), decided, site);
    remark_rooms(network, &pieces, &sharing.wide, &mut remarks);
    formed.remarks.append(&mut remarks);
    Remark::sort(&mut formed.remarks);
    formed
}

/// The points at which edges in the area end: one on its border may end such as lie beyond it alone.
fn within(formed: &Formed, site: &Site) -> Vec<(Place, i32)> {
    let mut is_within = vec![false; formed.points.len()];
    for ends in formed.edges.iter().map(|edge| [edge.a, edge.b].map(|point| point as usize)) {
        let [a, b] = ends.map(|point| formed.points[point].0);
        ends.into_iter().for_each(|point| is_within[point] |= site.holds_middle(a, b));
    }
    let points = formed.points.iter().zip(is_within);
    points.filter(|((place, _), is_within)| *is_within || !site.on_border(*place)).map(|(point, _)| *point).collect()
}

/// How much is rounded together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    Whole,
    /// Lines near strips that lie otherwise than in the round before.
    NearChanged,
}

/// Strips and lines while strips give way.
struct Forming<'a> {
    graded: &'a Graded<'a>,
    pieces: &'a [Piece],
    sharing: Sharing<'a>,
    thinned: Vec<Strand>,
    /// Strips on the ground in the round before, by class and corners.
    faces: Vec<Face>,
    site: &'a Site,
    each: Each<'a>,
}

impl Forming<'_> {
    /// Rounds strips that have room, and all other lines, together; and where channels are to have stations more.
    fn round_together(&mut self, scope: Scope) -> (Formed, Vec<Culvert>) {
        let Self { graded, pieces, site, .. } = *self;
        let all = self.sharing.share_out();
        let wide = &self.sharing.wide;
        let mut lines = toes(graded, pieces, wide, &all);
        let (mut decks, mut faces): (Vec<Face>, Vec<Face>) = all.into_iter().partition(|face| face.is_deck);
        faces.sort_by(by_corners);
        decks.sort_by(by_corners);
        let before = std::mem::replace(&mut self.faces, faces.clone());
        lines.extend(centrelines(graded.network, pieces, wide, graded.heights));
        lines.extend(self.thinned.iter().cloned());
        if scope == Scope::NearChanged {
            lines.extend(outlines(&faces));
            // What changed bends lines that reach it, and they may tilt strips where they lead to; those are judged
            // right beside all that they meet.
            let reach = |squares: &Squares| {
                let edges = lines.iter().flat_map(|line| line.stations.windows(2));
                Squares::around(edges.filter(|ends| squares.have(ends)), site.lattice)
            };
            let bent = reach(&Squares::of_changed(&before, &faces, site.lattice));
            faces.retain(|face| bent.have(&face.corners));
            let judged = Squares::around(faces.iter().map(|face| &face.corners[..]), site.lattice);
            let met = reach(&judged);
            lines.retain(|line| line.stations.windows(2).any(|ends| met.have(ends)));
        } else {
            lines.extend(outlines(&faces));
        }
        lines.sort_by(|a, b| (a.class, a.role, &a.stations, a.id).cmp(&(b.class, b.role, &b.stations, b.id)));
        let mut remarks = Vec::new();
        let (mut formed, culverts) = assemble(lines, site, &mut remarks, self.each);
        (formed.faces, formed.decks, formed.remarks) = (faces, decks, remarks);
        (formed, culverts)
    }
}

/// A lake that meets water of a lower level, which is its level from now on.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Uneven {
    id: FeatureId,
    level: i32,
    to: i32,
}

/// Lakes whose shores cross lower ones, each with a place where they do: what a dam left on both of its sides may meet
/// in a sharp corner. What is travelled keeps its height where it crosses a shore.
fn uneven(formed: &Formed) -> BTreeMap<Uneven, Place> {
    let mut travelled: HashSet<u32> = HashSet::new();
    for edge in formed.edges.iter().filter(|edge| edge.role <= Role::Centre) {
        travelled.extend([edge.a, edge.b]);
    }
    // The height that was decided for a place where nothing is travelled.
    let decided = |(place, _): &(Place, i32)| {
        let found = formed.points.binary_search_by_key(place, |(other, _)| *other).ok()?;
        (!travelled.contains(&(found as u32))).then_some((formed.points[found].1, *place))
    };
    let mut uneven = BTreeMap::new();
    for lake in formed.surfaces.iter().filter(|surface| surface.role == Role::Shore) {
        let level = lake.ring.iter().map(|(_, height)| *height).max();
        if let (Some(level), Some((to, place))) = (level, lake.ring.iter().filter_map(decided).min())
            && to < level
        {
            uneven.insert(Uneven { id: lake.id, level, to }, place);
        }
    }
    uneven
}

/// Lowers the shores of a lake, those of its islands too.
fn lower(strands: &mut [Strand], lake: &Uneven) {
    let is_its = |strand: &&mut Strand| strand.role == Role::Shore && strand.id == lake.id;
    for (_, height) in strands.iter_mut().filter(is_its).flat_map(|strand| &mut strand.stations) {
        *height = if *height == lake.level { lake.to } else { *height };
    }
}

/// Strips that another line would tilt, or that would make one too steep, each with the room it is left: those of which
/// a corner has the height of a line that passes through it, those at the side of which a line begins that is steeper
/// than it may be, and those that have such a side, because another line touches it: half the width may part the two.
fn tilted(formed: &Formed, network: &Network, sharing: &Sharing) -> BTreeMap<u32, Room> {
    let grades: HashMap<FeatureId, u32> =
        network.ways.iter().map(|way| (way.id, way.traits.grade_most_ppm())).collect();
    let (mut steep, mut sides): (HashSet<Place>, HashMap<FeatureId, Vec<[Place; 2]>>) = Default::default();
    for edge in formed.edges.iter().filter(|edge| matches!(edge.role, Role::Centre | Role::Side)) {
        let [a, b] = [edge.a, edge.b].map(|point| formed.points[point as usize]);
        let grade_ppm = grades.get(&edge.id).copied().unwrap_or(0);
        let beyond = (a.1 - b.1).abs() - network.lattice.rise_max(a.0, b.0, grade_ppm, 0);
        if 0 < grade_ppm && edge.role == Role::Centre && 1 < beyond {
            steep.extend([a.0, b.0]);
        } else if 0 < grade_ppm && edge.role == Role::Side && SIDE_BEYOND_MAX < beyond {
            sides.entry(edge.id).or_default().push([a.0, b.0]);
        }
    }
    let has_other_height = |&(place, height): &(Place, i32)| {
        let found = formed.points.binary_search_by_key(&place, |(other, _)| *other);
        found.is_ok_and(|found| formed.points[found].1 != height)
    };
    let is_beside = |face: &Face, place: &Place| is_on_outline(face, *place);
    let gives_way =
        |face: &Face| face.corners.iter().any(has_other_height) || steep.iter().any(|place| is_beside(face, place));
    let has_steep_side = |face: &Face| {
        let sides = sides.get(&face.id).into_iter().flatten();
        sides.into_iter().any(|ends| ends.iter().all(|place| is_beside(face, place)))
    };
    let mut rooms = BTreeMap::new();
    for face in &formed.faces {
        let wide = || sharing.at_nodes.wide_of(face, &sharing.wide);
        if gives_way(face) || has_steep_side(face) {
            rooms.extend(wide().into_iter().map(|number| (number, sharing.wide[number as usize].room.less())));
        }
    }
    rooms
}

/// Whether a place lies within a step of the outline of a face.
fn is_on_outline(face: &Face, place: Place) -> bool {
    let ends = face.corners.iter().zip(face.corners.iter().cycle().skip(1));
    ends.map(|(a, b)| (a.0, b.0)).any(|(a, b)| is_near(a, b, place))
}

/// Places that two strands in the ground have, or a strand and the network: thinning leaves them to both.
pub(crate) fn shared_places(network: &Network, strands: &[Strand], grants: &Grants) -> HashSet<Place> {
    let edges = network.edges.iter().enumerate().filter(|(number, _)| !grants.of_edge(*number as u32).out);
    let mut seen: HashSet<Place> =
        edges.flat_map(|(_, edge)| [edge.a, edge.b].map(|node| network.nodes[node as usize].place)).collect();
    let mut shared = HashSet::new();
    for (_, strand) in strands.iter().enumerate().filter(|(number, _)| !grants.of_strand(*number).out) {
        shared.extend(
            strand.stations[usize::from(strand.is_closed())..]
                .iter()
                .map(|(place, _)| *place)
                .filter(|place| !seen.insert(*place)),
        );
    }
    shared
}

/// A strand with the stations it needs; none where it is left out.
fn thinned(strand: &Strand, grant: Grant, site: &Site, shared: &dyn Fn(Place) -> bool) -> Option<Strand> {
    let kept = (!grant.out).then(|| needed(strand, grant.tolerance(), site, shared))?;
    Some(Strand { stations: kept.into_iter().map(|at| strand.stations[at as usize]).collect(), ..*strand })
}

/// The numbers of the stations that a strand needs. A channel keeps the stations beside a shared place too: where it
/// passes below a road, only what lies between them is missing.
fn needed(strand: &Strand, tolerance: Tolerance, site: &Site, shared: &dyn Fn(Place) -> bool) -> Vec<u32> {
    thin(&stations(strand, site, shared), tolerance, 0, site.lattice)
}

/// The stations of a strand, whatever it is thinned with.
pub(crate) fn stations(strand: &Strand, site: &Site, shared: &dyn Fn(Place) -> bool) -> Vec<Station> {
    let keeps = |at: usize| strand.stations.get(at).is_some_and(|(place, _)| shared(*place));
    let station = |(at, &(place, height)): (usize, &(Place, i32))| {
        let beside = strand.role == Role::Channel && (keeps(at + 1) || (0 < at && keeps(at - 1)));
        Station { place, height, stays: site.on_line(place) || shared(place) || beside, flat: [0; 2] }
    };
    strand.stations.iter().enumerate().map(station).collect()
}

fn remark_narrow(network: &Network, pieces: &[Piece], remarks: &mut Vec<Remark>) {
    for piece in pieces {
        let asks = matches!(piece.traits.form, Form::Strip | Form::StripAlways | Form::Bench);
        if asks && is_narrow(&piece.traits, network) {
            let place = network.nodes[piece.nodes[0] as usize].place;
            let mut notes = Notes { id: piece.id(network, 0), lattice: network.lattice, remarks };
            notes.write_at(place, Flaw::TooNarrow, Remedy::BecameLine);
        }
    }
    // A feature in many pieces is told once.
    let mut told = BTreeSet::new();
    remarks.retain(|remark| remark.flaw != Flaw::TooNarrow || told.insert(remark.id));
}

fn outlines(faces: &[Face]) -> Vec<Strand> {
    let outline = |face: &Face| Strand {
        role: Role::Side,
        class: face.class,
        id: face.id,
        stations: face.corners.iter().chain(face.corners.first()).copied().collect(),
    };
    faces.iter().map(outline).collect()
}

/// The centrelines of what is no strip, as long as it goes.
fn centrelines(network: &Network, pieces: &[Piece], wide: &[Wide], heights: &[i32]) -> Vec<Strand> {
    let mut lines: Vec<Strand> = Vec::new();
    for (number, piece) in pieces.iter().enumerate().filter(|(_, piece)| !piece.is_deck()) {
        let mut open = false;
        for (segment, nodes) in piece.nodes.windows(2).enumerate() {
            let is_line = !has_room(wide, number as u32, segment as u32);
            let [a, b] = [nodes[0], nodes[1]].map(|node| (network.nodes[node as usize].place, heights[node as usize]));
            let id = piece.id(network, segment);
            let goes_on = open && lines.last().is_some_and(|line| line.id == id);
            if is_line && !goes_on {
                lines.push(Strand { role: Role::Centre, class: piece.traits.class, id, stations: vec![a] });
            }
            if let Some(line) = lines.last_mut().filter(|_| is_line) {
                line.stations.push(b);
            }
            open = is_line;
        }
    }
    lines
}

/// Whose height a place has: the least of rank, class, role and height.
type Decided = HashMap<Place, (Role, u16, Role, i32)>;

/// What an edge belongs to: class, role and feature, and whether its line runs from the greater end to the lesser.
type OfEdge = (u16, Role, FeatureId, bool);

/// Rounds all lines together, decides the height of each point, and leaves out what lies in a strip of higher class.
fn assemble(lines: Vec<Strand>, site: &Site, remarks: &mut Vec<Remark>, each: Each) -> (Formed, Vec<Culvert>) {
    let mut rounded: Vec<Vec<Place>> =
        lines.iter().map(|line| line.stations.iter().map(|(place, _)| *place).collect()).collect();
    let mut hot = Vec::new();
    for ends in rounded.iter().flat_map(|line| line.windows(2)) {
        site.crossings(Segment { a: ends[0], b: ends[1] }, &mut |place| hot.push(place));
    }
    snap_round(&mut rounded, &hot, each);
    let own: Vec<Vec<i32>> = lines.iter().zip(&rounded).map(|(line, places)| heights_along(line, places)).collect();
    let mut heights: Decided = HashMap::with_capacity(rounded.iter().map(Vec::len).sum());
    for ((line, places), own) in lines.iter().zip(&rounded).zip(&own) {
        for (&place, &height) in places.iter().zip(own) {
            let mine = (line.role.max(Role::Centre), line.class, line.role, height);
            heights.entry(place).and_modify(|height| *height = mine.min(*height)).or_insert(mine);
        }
    }
    let inside = Inside::new(&lines, &rounded);
    let covered = gather(each, lines.len().div_ceil(LINES_AT_ONCE), |piece| inside.covered(piece, &rounded)).concat();
    let mut covered = covered.into_iter();
    let mut edges: Vec<((Place, Place), OfEdge)> = Vec::new();
    let mut culverts = Vec::new();
    for (number, (line, places)) in lines.iter().zip(&rounded).enumerate() {
        let mut cut = 0;
        let passes = |at: usize| line.role == Role::Channel && heights[&places[at]].3 != own[number][at];
        let passed = |at: usize| passes(at).then(|| heights[&places[at]].3);
        let road = |at: usize| passed(at).filter(|_| heights[&places[at]].2 <= Role::Centre);
        let banks = in_banks(places, &own[number], road, site);
        let bank = |at: usize| banks[at].or_else(|| passed(at).map(Bank::at));
        for (at, ends) in places.windows(2).enumerate() {
            if covered.next().expect("of every edge whether it is covered") {
                cut += site.lattice.length(ends[0], ends[1]);
            } else if bank(at).or(bank(at + 1)).is_none() {
                let key = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                let mine = (line.class, line.role, line.id, ends[1] < ends[0]);
                edges.push((key, mine));
            } else if bank(at).is_none() || bank(at + 1).is_none() {
                let (ends, bank) = bank(at).map_or(([at + 1, at], bank(at + 1)), |bank| ([at, at + 1], Some(bank)));
                let ends = ends.map(|at| (places[at], own[number][at]));
                culverts.extend(bank.and_then(|bank| culvert(line, ends, bank, site)));
            }
            let above = passes(at) && (at == 0 || !passes(at - 1));
            if above {
                let (flaw, remedy) = if road(at).is_some() {
                    (Flaw::RoadOverRiver, Remedy::Culvert)
                } else {
                    (Flaw::Overlap, Remedy::Cut)
                };
                Notes { id: line.id, lattice: site.lattice, remarks }.write_at(places[at], flaw, remedy);
            }
        }
        if line.role == Role::Centre && CUT_LENGTH_MIN < cut {
            let mut notes = Notes { id: line.id, lattice: site.lattice, remarks };
            notes.write_at(places[0], Flaw::Overlap, Remedy::Cut);
        }
    }
    let mut formed = collect(&heights, edges);
    formed.surfaces = surfaces(&lines, &rounded, &heights);
    (formed, culverts)
}

fn surfaces(lines: &[Strand], rounded: &[Vec<Place>], heights: &Decided) -> Vec<Surface> {
    let is_surface = |(line, places): &(&Strand, &Vec<Place>)| {
        matches!(line.role, Role::Side | Role::Shore | Role::Bank)
            && 3 < places.len()
            && places.first() == places.last()
    };
    let surface = |(line, places): (&Strand, &Vec<Place>)| {
        // Water is level, also where a road crosses its shore at another height.
        let level = line.stations.first().filter(|_| line.role == Role::Shore).map(|(_, level)| *level);
        let ring = places[1..].iter().map(|place| (*place, level.unwrap_or(heights[place].3))).collect();
        Surface { class: line.class, role: line.role, ring, id: line.id }
    };
    let mut surfaces: Vec<Surface> = lines.iter().zip(rounded).filter(is_surface).map(surface).collect();
    surfaces.sort();
    surfaces
}

/// Numbers the points that edges use; of several edges between two points the least is kept.
fn collect(heights: &Decided, mut edges: Vec<((Place, Place), OfEdge)>) -> Formed {
    edges.sort_unstable();
    edges.dedup_by_key(|(ends, _)| *ends);
    let mut used: Vec<Place> = edges.iter().flat_map(|((a, b), _)| [*a, *b]).collect();
    used.sort_unstable();
    used.dedup();
    let points: Vec<(Place, i32)> = used.iter().map(|place| (*place, heights[place].3)).collect();
    let number = |place: Place| points.partition_point(|(other, _)| *other < place) as u32;
    let edges = edges
        .into_iter()
        .map(|((a, b), (class, role, id, backwards))| {
            let (a, b) = (number(a), number(b));
            FormedEdge { a, b, role, class, id, backwards }
        })
        .collect();
    let (faces, surfaces, shaped, shaped_slopes, decks, middles, remarks) = Default::default();
    Formed { points, edges, faces, surfaces, shaped, shaped_slopes, decks, middles, remarks }
}

/// A line's own heights at the places it has after rounding: what is new lies between its stations.
fn heights_along(line: &Strand, places: &[Place]) -> Vec<i32> {
    let mut heights = Vec::with_capacity(places.len());
    let mut at = 0;
    for &place in places {
        if line.stations.get(at + 1).is_some_and(|(next, _)| *next == place) && !heights.is_empty() {
            at += 1;
        }
        let (here, next) = (line.stations[at], line.stations[(at + 1).min(line.stations.len() - 1)]);
        heights.push(between([here.0, next.0], [here.1, next.1], place));
    }
    heights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{formed, formed_between, rounded, site, way};
    use proptest::prelude::*;
    use proptest::strategy::ValueTree;

    #[test]
    fn a_bench_meets_the_ground_beyond_both_of_its_edges() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (40.0, 10.0)]);
        let ground = |_: f64, north: f64| north * 2.0;
        let formed = crate::samples::formed_as(vec![road], ground, Form::Bench);
        let of_toe =
            |point: u32| formed.edges.iter().any(|edge| edge.role == Role::Toe && (edge.a == point || edge.b == point));
        let toes: Vec<_> = (0..formed.points.len() as u32).filter(|point| of_toe(*point)).collect();
        assert_eq!(toes.len(), 4);
        for point in toes {
            let (place, height) = formed.points[point as usize];
            let ground = crate::samples::ground_at(place, &ground).unwrap();
            assert!((height - ground).abs() < 10, "{height} {ground}");
        }
    }

    #[test]
    fn where_strips_give_way_one_after_another_no_line_is_left_steeper_than_its_grade() {
        let runways = [
            vec![(78.0, 56.0), (48.0, 49.0), (58.0, 49.0), (30.0, 63.0)],
            vec![(48.0, 75.0), (57.0, 52.0), (69.0, 48.0), (25.0, 29.0), (72.0, 49.0)],
            vec![(31.0, 78.0), (25.0, 35.0), (67.0, 51.0), (26.0, 51.0), (70.0, 49.0)],
        ];
        let hills = |east: f64, north: f64| 4.0 * (north / 5.0).sin() + 3.0 * (east / 7.0).cos();
        for runway in runways {
            let formed = formed(vec![way(1, "aeroway=runway width=30", &runway)], hills);
            for edge in formed.edges.iter().filter(|edge| edge.role == Role::Centre) {
                let [a, b] = [edge.a, edge.b].map(|point| formed.points[point as usize]);
                let rise_max = site().lattice.rise_max(a.0, b.0, 20_000, 0);
                assert!((a.1 - b.1).abs() <= rise_max + 1, "{a:?} {b:?}");
            }
        }
    }

    fn roles(formed: &Formed, role: Role) -> usize {
        formed.edges.iter().filter(|edge| edge.role == role).count()
    }

    /// Both corners of a strip at a station have one height.
    #[track_caller]
    fn check_level_across(formed: &Formed) {
        let height = |place: Place| formed.points.iter().find(|(other, _)| *other == place).map(|(_, height)| *height);
        for face in formed.faces.iter().filter(|face| face.wide.is_some() && face.corners.len() == 4) {
            for (one, other) in [(0, 3), (1, 2)] {
                let (one, other) = (face.corners[one], face.corners[other]);
                assert_eq!(one.1, other.1);
                assert_eq!((height(one.0), height(other.0)), (Some(one.1), Some(other.1)));
            }
        }
    }

    /// No side of a strip rises by much more than the grade of its way, whatever touches it.
    #[track_caller]
    fn check_sides(formed: &Formed, ways: &[crate::Way]) {
        for edge in formed.edges.iter().filter(|edge| edge.role == Role::Side) {
            let [a, b] = [edge.a, edge.b].map(|point| formed.points[point as usize]);
            let of = ways.iter().filter(|way| way.id == edge.id).map(|way| way.traits.grade_most_ppm());
            let rise_max = site().lattice.rise_max(a.0, b.0, of.max().unwrap(), 0);
            assert!((a.1 - b.1).abs() <= rise_max + SIDE_BEYOND_MAX, "{a:?} {b:?} {:?}", edge.id);
        }
    }

    /// Every station of a line in the ground lies on what was decided for the ground there: at a point, or in a strip.
    #[track_caller]
    fn check_lines_lie(formed: &Formed) {
        let is_line = |middle: &&Middle| middle.traits.is_in_ground && middle.traits.form == terrain::LineForm::Line;
        for (place, height) in formed.middles.iter().filter(is_line).flat_map(|middle| &middle.stations) {
            if let Ok(at) = formed.points.binary_search_by_key(place, |(other, _)| *other) {
                assert_eq!(formed.points[at].1, *height, "{place:?}");
                continue;
            }
            let off = |face: &Face| {
                let (places, ring): (Vec<Place>, Vec<_>) =
                    face.corners.iter().map(|&(at, height)| (at, terrain::Vertex { at: at.into(), height })).unzip();
                let is_inside = crate::rings::encloses(&places, *place) || is_on_outline(face, *place);
                is_inside.then(|| (crate::rings::height_in(&[&ring], (*place).into()) - height).abs())
            };
            let off = formed.faces.iter().filter_map(off).min();
            assert!(off.is_some_and(|off| off <= 32), "{place:?} lies {off:?} quanta off every strip");
        }
    }

    #[test]
    fn sides_of_two_widths_meet_square_to_the_road_and_inner_sides_of_bends_keep_its_grade() {
        let sources = vec![
            way(1, "highway=primary width=14", &[(10.0, 10.0), (30.0, 10.0)]),
            way(2, "highway=primary width=7", &[(30.0, 10.0), (50.0, 11.2), (52.0, 9.0), (54.0, 11.0), (70.0, 11.0)]),
        ];
        let formed = formed(sources.clone(), |east, _| 3.0 * east);
        check_level_across(&formed);
        check_sides(&formed, &rounded(sources).ways);
        let across = |face: &Face| site().lattice.length(face.corners[1].0, face.corners[2].0);
        let meeting = formed.faces.iter().filter(|face| face.id.number == 1).map(across).next_back();
        assert!(meeting.is_some_and(|across| across < 12 * 128), "{meeting:?}");
    }

    #[test]
    fn a_road_is_a_strip_over_its_whole_length_level_across_whatever_the_ground() {
        let road = way(1, "highway=primary", &[(10.0, 10.0), (90.0, 10.0)]);
        let bumpy = |east: f64, north: f64| if east < 55.0 { 0.0 } else { (east - 54.0).min(30.0) * (north - 10.0) };
        let grounds: [&dyn Fn(f64, f64) -> f64; 3] = [&|_, north| north * 3.0, &|_, _| 7.0, &bumpy];
        for ground in grounds {
            let formed = formed(vec![road.clone()], ground);
            check_level_across(&formed);
            assert_eq!(roles(&formed, Role::Centre), 0);
        }
        // A station at each end and one on the module line between: two faces.
        let flat = formed(vec![road], |_, _| 7.0);
        assert_eq!((flat.faces.len(), flat.points.len()), (2, 6));
    }

    #[test]
    fn a_junction_on_a_slope_is_a_polygon_at_one_height() {
        let sources = vec![
            way(1, "highway=primary", &[(10.0, 20.0), (40.0, 20.0)]),
            way(2, "highway=primary", &[(25.0, 20.0), (25.0, 45.0)]),
        ];
        let formed = formed(sources, |east, north| north + east);
        check_level_across(&formed);
        let junctions: Vec<&Face> = formed.faces.iter().filter(|face| face.wide.is_none()).collect();
        assert_eq!(junctions.len(), 1);
        let height = junctions[0].corners[0].1;
        assert!(junctions[0].corners.iter().all(|corner| corner.1 == height));
    }

    #[test]
    fn a_hairpin_stays_within_its_mitres() {
        let sources =
            vec![way(1, "highway=primary", &[(10.0, 20.0), (30.0, 20.0), (30.3, 20.5), (30.0, 21.0), (10.0, 23.0)])];
        let formed = formed(sources, |east, north| 0.5 * north + 0.2 * east);
        check_level_across(&formed);
        let tip = site().lattice.place_of([30.3, 20.5]).unwrap();
        let farthest = formed.points.iter().map(|(place, _)| place.col - tip.col).max().unwrap();
        assert!(f64::from(farthest) * site().lattice.metres_per_step() < 14.0 + 1.0);
    }

    #[test]
    fn of_two_carriageways_that_overlap_the_lower_class_gives_way() {
        let sources = vec![
            way(1, "highway=motorway", &[(10.0, 20.0), (40.0, 20.0)]),
            way(2, "highway=primary", &[(10.0, 20.8), (40.0, 20.8)]),
        ];
        let formed = formed(sources, |_, north| 2.0 * north);
        check_level_across(&formed);
        let told: Vec<_> = formed.remarks.iter().map(|remark| (remark.id.number, remark.remedy)).collect();
        assert_eq!(told, [(2, Remedy::Narrowed)]);
        let motorway = formed.faces.iter().filter(|face| face.class == 0).count();
        assert_eq!((motorway, formed.faces.len()), (1, 2));
    }

    #[test]
    fn a_stream_passes_below_a_road_in_a_culvert() {
        let sources = vec![
            way(1, "highway=primary", &[(10.0, 20.0), (40.0, 20.0)]),
            way(2, "waterway=stream", &[(25.0, 10.0), (25.0, 30.0)]),
        ];
        let formed =
            formed(sources, |east, north| if (24.0..26.0).contains(&east) { 10.0 } else { 30.0 } + north * 0.1);
        let told: Vec<_> =
            formed.remarks.iter().map(|remark| (remark.id.number, &remark.flaw, remark.remedy)).collect();
        assert_eq!(told, [(2, &Flaw::RoadOverRiver, Remedy::Culvert)]);
        assert!(0 < roles(&formed, Role::Channel));
    }

    #[test]
    fn no_more_of_a_stream_is_missing_than_passes_below_a_road() {
        let sources = vec![
            way(1, "highway=primary", &[(10.0, 20.0), (40.0, 20.0)]),
            way(2, "waterway=stream tunnel=culvert layer=-1", &[(25.0, 10.0), (25.0, 30.0)]),
        ];
        let formed = formed(sources, |_, north| 30.0 + north * 0.1);
        let lattice = site().lattice;
        let rows = |edge: &FormedEdge| [edge.a, edge.b].map(|point| formed.points[point as usize].0.row);
        let channel = formed.edges.iter().filter(|edge| edge.role == Role::Channel).map(rows);
        let mut rows: Vec<[i32; 2]> = channel.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        rows.sort_unstable();
        let gaps = rows.windows(2).map(|pair| f64::from(pair[1][0] - pair[0][1]) * lattice.metres_per_step());
        assert!(rows.len() < 4 || gaps.fold(0.0, f64::max) < 30.0, "{rows:?}");
    }

    #[test]
    fn a_stream_below_a_road_comes_to_light_beyond_the_banks_of_the_road() {
        // The road fills a valley up by 12 m, so that its banks reach 24 m to both sides.
        let valley = |east: f64, _: f64| if (23.0..27.0).contains(&east) { 18.0 } else { 30.0 };
        let stream: Vec<(f64, f64)> = (0..=40).map(|step| (25.0, 10.0 + 0.5 * f64::from(step))).collect();
        let sources =
            vec![way(1, "highway=primary", &[(10.0, 20.0), (40.0, 20.0)]), way(2, "waterway=stream", &stream)];
        let formed = formed(sources, valley);
        let road = |edge: &&FormedEdge| edge.role <= Role::Centre;
        let places = |edge: &FormedEdge| [edge.a, edge.b].map(|point| formed.points[point as usize]);
        let at_stream = |(place, _): &(Place, i32)| (place.col - 25 * site().lattice.steps_per_post()).abs() < 40;
        let heights = formed.edges.iter().filter(road).flat_map(places).filter(at_stream);
        let road_m = heights.map(|(_, height)| f64::from(height) / 128.0).fold(0.0, f64::max);
        assert!(24.0 < road_m, "{road_m}");
        let metres = |row: i32| f64::from(row) * site().lattice.metres_per_step();
        let middle = metres(20 * site().lattice.steps_per_post());
        let channel = formed.edges.iter().filter(|edge| edge.role == Role::Channel).flat_map(places);
        let near = channel.map(|(place, height)| {
            let off_m = road_m - f64::from(height) / 128.0;
            (metres(place.row) - middle).abs() - 2.0 * off_m
        });
        let near = near.fold(f64::INFINITY, f64::min);
        assert!((0.0..20.0).contains(&near), "{near}");
    }

    #[test]
    fn a_deck_is_no_part_of_the_ground() {
        let sources = vec![
            way(1, "highway=primary", &[(10.0, 20.0), (20.0, 20.0)]),
            way(2, "highway=primary bridge=yes", &[(20.0, 20.0), (40.0, 20.0)]),
            way(3, "highway=primary", &[(40.0, 20.0), (45.0, 20.0)]),
            way(4, "highway=primary", &[(30.0, 10.0), (30.0, 30.0)]),
        ];
        let formed = formed(sources, |_, north| 0.2 * north);
        assert!(!formed.decks.is_empty() && formed.decks.iter().all(|deck| deck.id.number == 2));
        assert!(formed.edges.iter().all(|edge| edge.id.number != 2));
    }

    #[test]
    fn a_narrow_way_becomes_a_line_but_its_bridge_keeps_a_deck() {
        let sources = vec![
            way(1, "highway=service", &[(10.0, 20.0), (20.0, 20.0)]),
            way(2, "highway=service bridge=yes", &[(20.0, 20.0), (40.0, 20.0)]),
            way(3, "highway=service", &[(40.0, 20.0), (45.0, 20.0)]),
        ];
        let mut rounded = rounded(sources);
        rounded.ways.iter_mut().for_each(|way| way.traits.width = 3 * site().lattice.quanta_per_step());
        let formed = formed_between(rounded, |_, north| 0.2 * north, Scope::NearChanged);
        assert!(formed.faces.is_empty(), "{:?}", formed.faces);
        let length = formed.decks.iter().map(|deck| {
            let cols = deck.corners.iter().map(|(place, _)| place.col);
            cols.clone().max().unwrap() - cols.min().unwrap()
        });
        assert_eq!(length.sum::<i32>(), 20 * site().lattice.steps_per_post());
        let narrow = formed.remarks.iter().filter(|remark| remark.flaw == Flaw::TooNarrow);
        assert_eq!(narrow.map(|remark| remark.id.number).collect::<Vec<_>>(), [1, 3]);
    }

    type Drawn = (usize, Vec<(i32, i32)>);

    fn network_of(lines: &[Drawn]) -> Vec<crate::Source> {
        let tags = [
            "highway=motorway",
            "highway=primary",
            "highway=service",
            "highway=track",
            "waterway=stream",
            "highway=primary bridge=yes",
            "railway=rail",
        ];
        let way_of = |(number, (tag, line)): (usize, &Drawn)| {
            let line: Vec<(f64, f64)> = line.iter().map(|(x, y)| (f64::from(*x) / 4.0, f64::from(*y) / 4.0)).collect();
            way(number as i64, tags[*tag], &line)
        };
        lines.iter().enumerate().map(way_of).collect()
    }

    fn drawn() -> impl Strategy<Value = Vec<Drawn>> {
        proptest::collection::vec((0usize..7, proptest::collection::vec((40..160i32, 40..160i32), 2..5)), 1..10)
    }

    fn bowl(east: f64, north: f64) -> f64 {
        0.4 * north + 0.03 * (east - 20.0) * (east - 20.0)
    }

    #[test]
    fn a_strip_that_gives_way_changes_only_what_is_near_it() {
        let mut runner = proptest::test_runner::TestRunner::deterministic();
        for _ in 0..300 {
            let lines = drawn().new_tree(&mut runner).unwrap().current();
            let [near, whole] = [Scope::NearChanged, Scope::Whole]
                .map(|between| formed_between(rounded(network_of(&lines)), bowl, between));
            assert_eq!(near, whole, "{lines:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(150))]
        #[test]
        fn whatever_the_network_edges_touch_at_points_only_in_any_order_of_features(lines in drawn()) {
            let sources = network_of(&lines);
            let there = formed(sources.clone(), bowl);
            check_sides(&there, &rounded(sources.clone()).ways);
            check_lines_lie(&there);
            let back = formed(sources.into_iter().rev().collect(), bowl);
            prop_assert_eq!(there, back);
        }
    }
}
