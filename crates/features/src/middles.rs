//! The middle lines of ways, whole: of what is in the ground, of bridges and tunnels, and of what is left out.
//!
//! They are what a map draws and what a simulator drives along. Where a line crosses one between load modules it has a
//! station, so that its parts in both meet there.

use std::collections::{BTreeMap, HashMap, HashSet};

use terrain::{LineForm, LineKind, LineStorey, LineTraits, Vertex};

use crate::decks::between;
use crate::exact::Segment;
use crate::pieces::Piece;
use crate::rings::{encloses, height_in};
use crate::room::Squares;
use crate::strips::{Face, Room, Wide};
use crate::thin::{Station, Tolerance, thin};
use crate::{FeatureId, Graded, Network, Place, Role, Site, Storey, Strand, Traits};

/// The middle line of a way, or of a part of it in which nothing changes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Middle {
    /// Its class.
    pub class: u16,
    /// What else is known of it, but its width: that is its feature's.
    pub traits: LineTraits,
    /// Which feature it comes from.
    pub id: FeatureId,
    /// Its places with their heights in quanta, in order, those of a channel downstream.
    pub stations: Vec<(Place, i32)>,
}

/// What lines are thinned with that are no edges.
const TOLERANCE_OUT: Tolerance = Tolerance::ALL[1];

/// A line inside another way's strip has its own height where the strip lies no farther off than so many quanta
/// (0.25 m): rounding moves either.
const OFF_MAX: i32 = 32;

/// The middle lines of a network that was cut into `pieces`, of which `wide` are strips, and of all strands, of which
/// `thinned` are in the ground, whose heights were decided at `points` and on `faces`. Decks come down, or up, to where
/// a line that they go on in is laid.
pub(crate) fn middles(
    graded: &Graded,
    (pieces, wide): (&[Piece], &[Wide]),
    (strands, thinned): (&[Strand], &[Strand]),
    (points, faces, decks): (&[(Place, i32)], &[Face], &mut [Face]),
    site: &Site,
) -> Vec<Middle> {
    let mut middles = of_pieces(graded, pieces, wide);
    middles.extend(beside_pieces(graded, site));
    let is_line = |strand: &&Strand| matches!(strand.role, Role::Channel | Role::Breakline);
    middles.extend(thinned.iter().filter(is_line).map(|strand| of_strand(strand.clone(), true)));
    let mut kept: BTreeMap<(Role, u16, FeatureId), Vec<&Strand>> = BTreeMap::new();
    for strand in thinned.iter().filter(is_line) {
        kept.entry((strand.role, strand.class, strand.id)).or_default().push(strand);
    }
    for strand in strands.iter().filter(is_line) {
        let kept = kept.get(&(strand.role, strand.class, strand.id)).map_or(&[][..], Vec::as_slice);
        middles.extend(left_out(strand, kept, site).into_iter().map(|strand| of_strand(strand, false)));
    }
    middles.iter_mut().for_each(|middle| cross_lines(&mut middle.stations, site));
    let laid = lay(&mut middles, points, (faces, site));
    let station = |node: u32| (graded.network.nodes[node as usize].place, graded.heights[node as usize]);
    lay_decks(decks, &station, &laid);
    let mut middles: Vec<Middle> = middles.into_iter().flat_map(|middle| in_culverts(middle, points)).collect();
    middles.retain(|middle| 2 <= middle.stations.len());
    middles.sort();
    middles
}

/// Of what is formed: parts of one form.
fn of_pieces(graded: &Graded, pieces: &[Piece], wide: &[Wide]) -> Vec<Middle> {
    let Graded { network, heights, .. } = *graded;
    let mut strips: Vec<Vec<bool>> = pieces.iter().map(|piece| vec![false; piece.strips.len()]).collect();
    for of in wide.iter().filter(|of| of.room != Room::None) {
        strips[of.piece as usize][of.segment as usize] = true;
    }
    let mut middles = Vec::new();
    for (piece, strips) in pieces.iter().zip(&strips) {
        let mut from = 0;
        for same in strips.chunk_by(|a, b| a == b) {
            let to = from + same.len();
            let form = match (same[0], piece.bench) {
                (false, _) => LineForm::Line,
                (true, false) => LineForm::Strip,
                (true, true) => LineForm::Bench,
            };
            let traits = LineTraits { form, is_in_ground: !piece.is_deck(), ..travelled(&piece.traits) };
            let stations = stations(network, heights, &piece.nodes[from..=to]);
            middles.push(Middle { class: piece.traits.class, traits, id: piece.id(network, from), stations });
            from = to;
        }
    }
    middles
}

/// Of edges that no piece has: tunnels, and what is left out.
fn beside_pieces(graded: &Graded, site: &Site) -> Vec<Middle> {
    let Graded { network, heights, grants, .. } = *graded;
    let way = |edge: u32| network.edges[edge as usize].way as usize;
    let is_out: Vec<bool> = (0..network.edges.len() as u32).map(|edge| grants.of_edge(edge).out).collect();
    let is_tunnel = |edge: u32| network.traits(edge).storey.is_tunnel();
    let picked = |edge: u32| is_out[edge as usize] || is_tunnel(edge);
    let follows = |node: u32| match network.beside(node) {
        [(_, one), (_, other)] => {
            let same =
                network.traits(*one) == network.traits(*other) && is_out[*one as usize] == is_out[*other as usize];
            same && picked(*one) && picked(*other)
        }
        _ => false,
    };
    let runs = network.runs(&picked, &follows).into_iter();
    runs.map(|(nodes, edges)| {
        let of = network.traits(edges[0]);
        let traits = LineTraits { is_kept: !is_out[edges[0] as usize], ..travelled(of) };
        let stations = thinned_out(stations(network, heights, &nodes), site);
        Middle { class: of.class, traits, id: network.ways[way(edges[0])].id, stations }
    })
    .collect()
}

/// What is travelled, kept, and in the ground nothing yet.
fn travelled(of: &Traits) -> LineTraits {
    let storey = match of.storey {
        Storey::Ground => LineStorey::Ground,
        Storey::Deck(_) => LineStorey::Bridge,
        Storey::Tunnel(_) => LineStorey::Tunnel,
    };
    let (kind, form) = (LineKind::Travelled, LineForm::Nothing);
    LineTraits { kind, form, storey, is_kept: true, is_in_ground: false, width: 0 }
}

fn stations(network: &Network, heights: &[i32], nodes: &[u32]) -> Vec<(Place, i32)> {
    nodes.iter().map(|&node| (network.nodes[node as usize].place, heights[node as usize])).collect()
}

fn of_strand(strand: Strand, is_kept: bool) -> Middle {
    let Strand { role, class, id, stations } = strand;
    let kind = if role == Role::Channel { LineKind::Channel } else { LineKind::Breakline };
    let form = if is_kept { LineForm::Line } else { LineForm::Nothing };
    let traits = LineTraits { kind, form, storey: LineStorey::Ground, is_kept, is_in_ground: is_kept, width: 0 };
    Middle { class, traits, id, stations }
}

/// The parts of a strand that are left out: those along which none of what is kept of its feature runs.
fn left_out(strand: &Strand, kept: &[&Strand], site: &Site) -> Vec<Strand> {
    let mut is_out = vec![true; strand.stations.len().saturating_sub(1)];
    for kept in kept {
        let at = |station: Option<&(Place, i32)>| {
            let place = station?.0;
            strand.stations.iter().position(|(other, _)| *other == place)
        };
        match (at(kept.stations.first()), at(kept.stations.last())) {
            (Some(_), Some(_)) if kept.is_closed() => is_out.fill(false),
            (Some(from), Some(to)) if from < to => is_out[from..to].fill(false),
            _ => {}
        }
    }
    let mut parts = Vec::new();
    let mut from = 0;
    for same in is_out.chunk_by(|a, b| a == b) {
        let to = from + same.len();
        if same[0] {
            let stations = thinned_out(strand.stations[from..=to].to_vec(), site);
            parts.push(Strand { stations, ..*strand });
        }
        from = to;
    }
    parts
}

/// Lays lines in the ground onto it where another way has it: at places that lie as high as that way, and inside its
/// strip. What another line has there at the same height moves with them, so that parts of a way still meet. Returns
/// the heights of places where they are laid, by what they were.
fn lay(middles: &mut [Middle], points: &[(Place, i32)], (faces, site): (&[Face], &Site)) -> HashMap<(Place, i32), i32> {
    let (mut ground, mut inside) = (HashMap::new(), Vec::new());
    for Middle { traits, stations, .. } in middles.iter().filter(|of| is_laid(&of.traits) && of.traits.is_in_ground) {
        for &(place, height) in stations {
            if let Ok(at) = points.binary_search_by_key(&place, |(other, _)| *other) {
                ground.insert((place, height), points[at].1);
            } else if traits.form == LineForm::Line {
                // A strip lies under its own middle.
                inside.push((place, height));
            }
        }
    }
    let near = Squares::around(inside.iter().map(std::slice::from_ref), site.lattice);
    let ring = |face: &Face| -> (Vec<Place>, Vec<Vertex>) {
        face.corners.iter().map(|&(place, height)| (place, Vertex { at: place.into(), height })).unzip()
    };
    let rings: Vec<_> = faces.iter().filter(|face| near.have(&face.corners)).map(ring).collect();
    for (place, height) in inside {
        let Some((_, ring)) = rings.iter().find(|(places, _)| encloses(places, place)) else { continue };
        let there = height_in(&[ring], place.into());
        if OFF_MAX < (there - height).abs() {
            ground.insert((place, height), there);
        }
    }
    for station in middles.iter_mut().filter(|middle| is_laid(&middle.traits)).flat_map(|of| &mut of.stations) {
        station.1 = ground.get(station).copied().unwrap_or(station.1);
    }
    ground
}

/// Moves the ends of decks as the stations of lines were.
fn lay_decks(decks: &mut [Face], station: &dyn Fn(u32) -> (Place, i32), laid: &HashMap<(Place, i32), i32>) {
    for Face { corners, nodes, .. } in decks {
        let ends: Vec<(Place, i32)> = nodes.iter().map(|&node| station(node)).collect();
        for corner in corners {
            let nearest = ends.iter().filter(|end| end.1 == corner.1).min_by_key(|end| end.0.squared_to(corner.0));
            corner.1 = nearest.and_then(|end| laid.get(end)).copied().unwrap_or(corner.1);
        }
    }
}

/// Whether a line follows ground that another way has; channels pass below.
fn is_laid(traits: &LineTraits) -> bool {
    traits.kind != LineKind::Channel
}

/// A channel in parts: where the ground has another height than it, as on a road, or a strip covers it, it passes below
/// in a culvert.
fn in_culverts(middle: Middle, points: &[(Place, i32)]) -> Vec<Middle> {
    let Middle { class, traits, id, stations } = middle;
    if traits.kind != LineKind::Channel || !traits.is_in_ground {
        return vec![Middle { class, traits, id, stations }];
    }
    let passes = |(place, height): &(Place, i32)| {
        let found = points.binary_search_by_key(place, |(other, _)| *other);
        found.is_err() || found.is_ok_and(|found| points[found].1 != *height)
    };
    let is_below: Vec<bool> = stations.windows(2).map(|ends| ends.iter().any(passes)).collect();
    let mut from = 0;
    let parts = is_below.chunk_by(|a, b| a == b).map(|same| {
        let stations = stations[from..=from + same.len()].to_vec();
        from += same.len();
        let culvert = LineTraits { form: LineForm::Nothing, storey: LineStorey::Tunnel, is_in_ground: false, ..traits };
        Middle { class, traits: if same[0] { culvert } else { traits }, id, stations }
    });
    parts.collect()
}

/// Places at which the middle of what is kept ends although its way goes on, with its class and its feature. `family`
/// says of classes what hangs together. Ways that thinning made the same line are one, as they are in load modules.
pub(crate) fn loose_ends(middles: &[Middle], family: &BTreeMap<u16, u8>, site: &Site) -> Vec<(Place, u16, FeatureId)> {
    #[derive(Default)]
    struct Meeting {
        ends: Vec<(u16, FeatureId)>,
        is_passed: bool,
        goes_on: bool,
    }
    let (mut meetings, mut seen) = (BTreeMap::<_, Meeting>::new(), HashSet::new());
    let is_inside = |stations: &[(Place, i32)]| stations.windows(2).any(|ends| site.holds_middle(ends[0].0, ends[1].0));
    for Middle { class, traits, id, stations } in middles {
        let is_way = traits.kind != LineKind::Breakline && is_inside(stations);
        if !is_way || !seen.insert((class, traits.is_kept, &stations[..])) {
            continue;
        }
        let last = stations.len() - 1;
        for (number, &(place, _)) in stations.iter().enumerate() {
            let is_end = number == 0 || number == last;
            let key = (traits.kind == LineKind::Channel, place, family.get(class).copied());
            let meeting = meetings.entry(key).or_default();
            match (traits.is_kept, is_end) {
                (true, true) if traits.storey == LineStorey::Tunnel => meeting.is_passed = true,
                (true, true) => meeting.ends.push((*class, *id)),
                (true, false) => meeting.is_passed = true,
                // What passes on a bridge or in a tunnel does not meet what ends below or above it.
                (false, _) => meeting.goes_on |= is_end || traits.storey == LineStorey::Ground,
            }
        }
    }
    let is_loose = |of: &Meeting| of.ends.len() == 1 && !of.is_passed && of.goes_on;
    let found = meetings.into_iter().filter(|((_, place, _), of)| is_loose(of) && !site.on_border(*place));
    found.flat_map(|((_, place, _), of)| of.ends.into_iter().map(move |(class, id)| (place, class, id))).collect()
}

/// The stations that a line needs which is no edge.
fn thinned_out(stations: Vec<(Place, i32)>, site: &Site) -> Vec<(Place, i32)> {
    let station = |&(place, height): &(Place, i32)| Station { place, height, stays: site.on_line(place), flat: [0; 2] };
    let all: Vec<Station> = stations.iter().map(station).collect();
    let kept = thin(&all, TOLERANCE_OUT, 0, site.lattice);
    kept.into_iter().map(|at| stations[at as usize]).collect()
}

/// Adds the stations at which a line crosses one between load modules, where it has none yet, and takes away those
/// that repeat a place.
fn cross_lines(stations: &mut Vec<(Place, i32)>, site: &Site) {
    let mut all: Vec<(Place, i32)> = Vec::with_capacity(stations.len());
    for ends in stations.windows(2) {
        let (a, b) = (ends[0], ends[1]);
        all.push(a);
        let mut crossed = Vec::new();
        site.crossings(Segment { a: a.0, b: b.0 }, &mut |place| crossed.push(place));
        crossed.sort_by_key(|place| a.0.squared_to(*place));
        all.extend(crossed.into_iter().map(|place| (place, between([a.0, b.0], [a.1, b.1], place))));
    }
    all.extend(stations.last());
    all.dedup_by_key(|(place, _)| *place);
    *stations = all;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{formed, formed_as, site, way};
    use crate::{Form, Formed, Numbering};

    fn of_number(formed: &Formed, number: i64) -> Vec<&Middle> {
        formed.middles.iter().filter(|middle| middle.id.number == number).collect()
    }

    #[test]
    fn a_road_with_a_bridge_and_a_tunnel_is_one_line_from_end_to_end() {
        let sources = vec![
            way(1, "highway=primary", &[(10.0, 20.0), (20.0, 20.0)]),
            way(2, "highway=primary bridge=yes", &[(20.0, 20.0), (40.0, 20.0)]),
            way(3, "highway=primary", &[(40.0, 20.0), (60.0, 20.0)]),
            way(4, "highway=primary tunnel=yes", &[(60.0, 20.0), (120.0, 20.0)]),
        ];
        let formed = formed_as(sources, |_, north| 0.2 * north, Form::StripAlways);
        let all = [1, 2, 3, 4].map(|number| of_number(&formed, number));
        let told = all.clone().map(|parts| {
            assert_eq!(parts.len(), 1, "{parts:?}");
            let LineTraits { form, storey, is_kept, is_in_ground, .. } = parts[0].traits;
            (form, storey, is_kept, is_in_ground)
        });
        assert_eq!(told[0], (LineForm::Strip, LineStorey::Ground, true, true));
        assert_eq!((told[1], told[2]), ((LineForm::Strip, LineStorey::Bridge, true, false), told[0]));
        assert_eq!(told[3], (LineForm::Nothing, LineStorey::Tunnel, true, false));
        let ends = all.map(|parts| [parts[0].stations[0], parts[0].stations[parts[0].stations.len() - 1]]);
        assert!(ends.windows(2).all(|pair| pair[0][1] == pair[1][0]), "{ends:?}");
    }

    #[test]
    fn lines_have_a_station_on_every_line_between_load_modules() {
        let sources = vec![
            way(1, "highway=track", &[(10.0, 20.0), (180.0, 90.0)]),
            way(2, "waterway=stream", &[(10.0, 120.0), (180.0, 30.0)]),
        ];
        let formed = formed(sources, |east, north| east + 0.1 * north);
        assert!(formed.middles.iter().any(|middle| middle.traits.kind == LineKind::Channel));
        for ends in formed.middles.iter().flat_map(|middle| middle.stations.windows(2)) {
            let mut crossed = Vec::new();
            site().crossings(Segment { a: ends[0].0, b: ends[1].0 }, &mut |place| crossed.push(place));
            assert!(crossed.is_empty() && ends[0].0 != ends[1].0);
        }
    }

    #[test]
    fn a_stream_below_a_road_is_in_a_culvert() {
        let sources = vec![way(2, "waterway=stream", &[(20.0, 40.0), (20.0, 5.0)])];
        let formed = formed(sources, |_, north| north * 0.01);
        let middle = Middle {
            stations: (0..5).map(|at| (Place::new(0, at), 100 - 10 * at)).collect(),
            ..of_number(&formed, 2)[0].clone()
        };
        let ground = |at: i32, height| (Place::new(0, at), height);
        let points = [0, 1, 2, 3, 4].map(|at| ground(at, 100 - 10 * at));
        assert_eq!(in_culverts(middle.clone(), &points), std::slice::from_ref(&middle));
        // A road at the third station, or a strip around it: the pieces before and behind it pass below.
        let road = [points[0], points[1], ground(2, 400), points[3], points[4]];
        for points in [&road[..], &[points[0], points[1], points[3], points[4]]] {
            let parts = in_culverts(middle.clone(), points);
            let told: Vec<_> = parts.iter().map(|part| (part.stations.len(), part.traits.is_in_ground)).collect();
            assert_eq!(told, [(2, true), (3, false), (2, true)]);
            assert!(parts.iter().all(|part| part.traits.is_kept && part.traits.fit()));
            assert_eq!(parts[1].traits.storey, LineStorey::Tunnel);
        }
    }

    #[test]
    fn the_end_of_a_deck_moves_with_its_station_and_the_other_one_stays() {
        let station = |node: u32| (Place::new(0, 100 * node as i32), 700 + node as i32);
        let corner = |row, node: u32| (Place::new(row, 100 * node as i32), station(node).1);
        let deck = Face {
            class: 1,
            id: FeatureId { source: 0, numbering: Numbering::Way, number: 1 },
            corners: vec![corner(-4, 0), corner(-4, 1), corner(4, 1), corner(4, 0)],
            is_deck: true,
            centreline: None,
            nodes: vec![0, 1],
            wide: None,
        };
        let mut decks = [deck.clone()];
        lay_decks(&mut decks, &station, &HashMap::from([(station(1), 500)]));
        assert_eq!(decks[0].corners.iter().map(|corner| corner.1).collect::<Vec<_>>(), [700, 500, 500, 700]);
        lay_decks(&mut decks, &station, &HashMap::from([(station(1), 900)]));
        assert_eq!(decks[0].corners[0], deck.corners[0]);
    }

    #[test]
    fn what_is_left_out_has_its_line_too() {
        let sources: Vec<_> = (0..100)
            .map(|number| {
                let north = 1.0 + number as f64 * 0.48;
                way(number, "highway=track", &[(5.0, north), (45.0, north)])
            })
            .collect();
        let levelled = crate::samples::levelled(sources, |_, _| 0.0, &crate::Shares::each([8, 8], 40));
        let middles = &levelled.reserved.formed.middles;
        let (kept, out): (Vec<&Middle>, Vec<&Middle>) = middles.iter().partition(|middle| middle.traits.is_kept);
        assert!(!kept.is_empty() && !out.is_empty());
        assert_eq!(kept.len() + out.len(), 100);
        assert!(middles.iter().all(|middle| middle.traits.fit()));
    }

    #[test]
    fn what_ends_where_its_way_goes_on_ends_there_also_where_thinning_made_two_ways_one() {
        let sources = vec![
            way(1, "highway=track", &[(10.0, 20.0), (20.0, 20.0)]),
            way(2, "highway=primary", &[(20.0, 20.0), (30.0, 30.0)]),
        ];
        let formed = formed(sources, |_, _| 0.0);
        let [kept, next] = [1, 2].map(|number| of_number(&formed, number)[0].clone());
        let out = Middle { traits: LineTraits { is_kept: false, ..next.traits }, ..next.clone() };
        let twin = Middle { id: FeatureId { number: 9, ..kept.id }, ..kept.clone() };
        let end = (out.stations[0].0, kept.class, kept.id);
        let family = BTreeMap::from([(kept.class, 0), (next.class, 0)]);
        let found = |middles: &[&Middle]| {
            loose_ends(&middles.iter().copied().cloned().collect::<Vec<Middle>>(), &family, &site())
        };
        assert_eq!(found(&[&kept, &out]), [end]);
        assert_eq!(found(&[&kept, &twin, &out]), [end]);
        assert_eq!(found(&[&kept, &next]), []);
        assert_eq!(found(&[&kept]), []);
        let below = Middle { traits: LineTraits { storey: LineStorey::Tunnel, ..kept.traits }, ..kept.clone() };
        assert_eq!(found(&[&below, &out]), [], "a portal is no end");
    }
}
