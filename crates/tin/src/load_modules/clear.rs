//! Decks put over the ground, which is lowered where its triangles stand above them: beside a higher road, or where no
//! post lies under a bridge.
//!
//! A vertex on the deck is put into such a triangle, as limits leave room. Triangles of features stay, and so do edges
//! along lines, vertices and the sides of the load module.

use terrain::{Decks, LoadModule, ModuleLine, ModuleVertex};

use crate::load_modules::lift::{ADDED_FOR, apart, at, bounds, common, cross, deepest, dot, lift_decks, weights};

/// Quanta above a deck for which a vertex is put in: 0.1 m.
const CLEARED_FOR: f64 = 12.0;

/// Quanta from a vertex and from an edge that stays at which a vertex may be put in, at least: a quarter of a metre.
const APART_MIN: f64 = 32.0;

/// Quanta from an edge within which a vertex is put on it.
const ON_EDGE: f64 = 32.0;

/// A triangle of the ground and its class.
type Soup = Vec<([ModuleVertex; 3], u8)>;

/// A place at which the ground is lowered onto a deck.
struct Lowering {
    above: f64,
    vertex: ModuleVertex,
    /// The triangles that have it, one inside it or two along an edge.
    triangles: Vec<usize>,
}

/// Gives a load module its decks, `drawn`, and lowers natural ground, whose class is none of features, where it stands
/// above them; what then still does, they are raised onto. Both have at most so many triangles together as decks may
/// have; as many of these go to the ground as leave decks least far below it.
pub fn put_decks(
    ground: &mut LoadModule,
    (drawn, bridges): (&Decks, &[ModuleLine]),
    lines: &[ModuleLine],
    is_of_features: impl Fn(u8) -> bool,
    most: usize,
) {
    let spare = most - drawn.triangles.len();
    let mut best: Option<(f64, LoadModule)> = None;
    for room in [spare, spare / 2, 0] {
        let mut cleared = ground.clone();
        let added = clear_decks(&mut cleared, drawn, lines, &is_of_features, room);
        cleared.decks = lift_decks(drawn, bridges, &cleared, most - added);
        let below = deepest(&cleared.decks, &cleared);
        if best.as_ref().is_none_or(|(least, _)| below < *least) {
            best = Some((below, cleared));
        }
        if below <= ADDED_FOR || added == 0 {
            break;
        }
    }
    *ground = best.expect("one at least is tried").1;
}

/// Puts vertices into natural triangles of the ground where these stand above decks, by at most so many triangles more.
/// Returns how many.
fn clear_decks(
    ground: &mut LoadModule,
    decks: &Decks,
    lines: &[ModuleLine],
    is_of_features: impl Fn(u8) -> bool,
    most: usize,
) -> usize {
    let corners = |triangle: &[u16; 3]| triangle.map(|corner| ground.vertices[usize::from(corner)]);
    let mut soup: Soup = ground.triangles.iter().map(corners).zip(ground.classes.iter().copied()).collect();
    let before = soup.len();
    let lines: Vec<&ModuleLine> = lines.iter().filter(|line| line.is_in_ground).collect();
    let is_natural = |class: u8| !is_of_features(class);
    while soup.len() + 2 <= before + most {
        let found = (0..soup.len()).filter(|&at| is_natural(soup[at].1)).filter_map(|number| {
            let all = decks.triangles.iter().map(|deck| deck.map(|corner| decks.vertices[usize::from(corner)]));
            let lowerings = all.filter_map(|deck| lowering(&soup, number, deck, (&lines, &is_natural, ground.side)));
            lowerings.max_by(|one, other| one.above.total_cmp(&other.above))
        });
        let Some(Lowering { vertex, triangles, .. }) = found.max_by(|one, other| one.above.total_cmp(&other.above))
        else {
            break;
        };
        split(&mut soup, vertex, &triangles);
    }
    let added = soup.len() - before;
    if 0 < added {
        ground.polygon_count += added as u32;
        // One mesh is in order as another.
        let Decks { vertices, triangles, classes } = Decks::of_triangles(soup);
        (ground.vertices, ground.triangles, ground.classes) = (vertices, triangles, classes);
    }
    added
}

/// Where a triangle of the ground stands highest above one of decks, and can be lowered.
fn lowering(
    soup: &Soup,
    number: usize,
    deck: [ModuleVertex; 3],
    (lines, is_natural, side): (&[&ModuleLine], &dyn Fn(u8) -> bool, u16),
) -> Option<Lowering> {
    let (ground, _) = soup[number];
    let [deck_box, ground_box] = [deck, ground].map(|corners| bounds(&[0, 1, 2], &corners));
    let [west, east, south, north] = deck_box;
    if ground_box[1] <= west || east <= ground_box[0] || ground_box[3] <= south || north <= ground_box[2] {
        return None;
    }
    let height = |of: [ModuleVertex; 3], place: [f64; 2]| dot(of.map(|vertex| f64::from(vertex.z)), weights(of, place));
    let above = |place: [f64; 2]| height(ground, place) - height(deck, place);
    let shape = common(deck, ground);
    if !shape.iter().any(|place| CLEARED_FOR < above(*place)) {
        return None;
    }
    // Corners of what both have in common, drawn in so far that they are clear of what stays.
    let middle = [0, 1].map(|axis| shape.iter().map(|place| place[axis]).sum::<f64>() / shape.len() as f64);
    let drawn_in = |place: [f64; 2]| [0.0, 0.125, 0.25, 0.5, 1.0].map(|part| mixed(place, middle, part));
    let edges = [[ground[0], ground[1]], [ground[1], ground[2]], [ground[2], ground[0]]];
    let stays = edges.map(|edge| across(soup, edge, is_natural).is_none() || is_along(edge, lines));
    let at_place = |place: [f64; 2]| {
        let near = |edge: &[ModuleVertex; 2]| cross(at(edge[0]), at(edge[1]), place) / apart(at(edge[0]), at(edge[1]));
        let is_clear = (0..3).all(|edge| APART_MIN <= near(&edges[edge]) || !stays[edge])
            && ground.iter().all(|vertex| APART_MIN <= apart(at(*vertex), place));
        let on = (0..3).find(|&edge| near(&edges[edge]) < ON_EDGE);
        let above = above(place);
        if !is_clear || above <= CLEARED_FOR {
            return None;
        }
        let [x, y] = place.map(|along| along.round() as u16);
        let vertex = ModuleVertex { y, x, z: height(deck, [x, y].map(f64::from)).floor() as i32 };
        let triangles = match on {
            None => vec![number],
            Some(edge) => vec![number, across(soup, edges[edge], is_natural)?],
        };
        let fits = 0 < x && x < side && 0 < y && y < side && stays_whole(soup, vertex, &triangles);
        fits.then_some(Lowering { above, vertex, triangles })
    };
    let found = shape.iter().filter_map(|&corner| drawn_in(corner).into_iter().find_map(at_place));
    found.max_by(|one, other| one.above.total_cmp(&other.above))
}

fn mixed(from: [f64; 2], to: [f64; 2], part: f64) -> [f64; 2] {
    [0, 1].map(|axis| from[axis] + (to[axis] - from[axis]) * part)
}

/// The natural triangle on the other side of an edge.
fn across(soup: &Soup, [from, to]: [ModuleVertex; 2], is_natural: &dyn Fn(u8) -> bool) -> Option<usize> {
    let has = |corners: &[ModuleVertex; 3]| (0..3).any(|at| corners[at] == to && corners[(at + 1) % 3] == from);
    soup.iter().position(|(corners, class)| has(corners) && is_natural(*class))
}

/// Whether an edge runs along a line.
fn is_along(edge: [ModuleVertex; 2], lines: &[&ModuleLine]) -> bool {
    const NEAR: f64 = 3.0;
    let is_on = |ends: &[ModuleVertex]| {
        let [from, to] = [ends[0], ends[1]].map(at);
        let length = apart(from, to);
        edge.iter().all(|vertex| {
            let along = dot2(from, to, at(*vertex)) / length.max(1.0);
            cross(from, to, at(*vertex)).abs() <= NEAR * length && (-NEAR..=length + NEAR).contains(&along)
        })
    };
    lines.iter().flat_map(|line| line.vertices.windows(2)).any(is_on)
}

fn dot2(from: [f64; 2], to: [f64; 2], place: [f64; 2]) -> f64 {
    (0..2).map(|axis| (to[axis] - from[axis]) * (place[axis] - from[axis])).sum()
}

/// The edges around triangles that share one, or around one.
fn rim(soup: &Soup, triangles: &[usize]) -> Vec<([ModuleVertex; 2], u8)> {
    let edges = |&number: &usize| {
        let ([a, b, c], class) = soup[number];
        [[a, b], [b, c], [c, a]].map(|edge| (edge, class))
    };
    let all: Vec<_> = triangles.iter().flat_map(edges).collect();
    let is_inside = |[from, to]: [ModuleVertex; 2]| all.iter().any(|(edge, _)| *edge == [to, from]);
    all.iter().copied().filter(|(edge, _)| !is_inside(*edge)).collect()
}

/// Whether triangles from a vertex to the edges around these are all counter-clockwise.
fn stays_whole(soup: &Soup, vertex: ModuleVertex, triangles: &[usize]) -> bool {
    rim(soup, triangles).iter().all(|([from, to], _)| 0.0 < cross(at(*from), at(*to), at(vertex)))
}

fn split(soup: &mut Soup, vertex: ModuleVertex, triangles: &[usize]) {
    let around = rim(soup, triangles);
    let mut gone = triangles.to_vec();
    gone.sort_unstable();
    gone.into_iter().rev().for_each(|number| {
        soup.swap_remove(number);
    });
    soup.extend(around.into_iter().map(|([from, to], class)| ([from, to, vertex], class)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::ModuleId;

    const SIDE: u16 = 12_800;
    const ROAD: u8 = 3;

    fn vertex(x: u16, y: u16, z: i32) -> ModuleVertex {
        ModuleVertex { y, x, z }
    }

    /// A plain at 0 m beside a road, which lies at 10 m along the northern side.
    fn beside_a_road() -> LoadModule {
        let edge = SIDE - 1280;
        let [a, b] = [vertex(0, 0, 0), vertex(SIDE, 0, 0)];
        let [c, d] = [vertex(0, edge, 1280), vertex(SIDE, edge, 1280)];
        let [e, f] = [vertex(0, SIDE, 1280), vertex(SIDE, SIDE, 1280)];
        let soup = [([a, b, d], 0), ([a, d, c], 0), ([c, d, f], ROAD), ([c, f, e], ROAD)];
        let Decks { vertices, triangles, classes } = Decks::of_triangles(soup);
        LoadModule {
            id: ModuleId { row: 0, col: 0 },
            side: SIDE,
            vertices,
            triangles,
            classes,
            polygon_count: 4,
            ..LoadModule::default()
        }
    }

    /// A deck 5 m wide at 4 m, 20 m south of the road.
    fn deck() -> Decks {
        let at = |(x, y)| vertex(x, y, 512);
        let [a, b, c, d] = [(3000, 8000), (9000, 8000), (9000, 8640), (3000, 8640)].map(at);
        Decks::of_triangles([([a, b, c], ROAD), ([a, c, d], ROAD)])
    }

    fn stands_above(ground: &LoadModule, decks: &Decks) -> f64 {
        let of = |all: &[ModuleVertex], triangle: &[u16; 3]| triangle.map(|corner| all[usize::from(corner)]);
        let mut most = 0.0;
        for deck in &decks.triangles {
            let deck = of(&decks.vertices, deck);
            for ground in ground.triangles.iter().map(|triangle| of(&ground.vertices, triangle)) {
                let height =
                    |of: [ModuleVertex; 3], place| dot(of.map(|vertex| f64::from(vertex.z)), weights(of, place));
                for place in common(deck, ground) {
                    most = f64::max(most, height(ground, place) - height(deck, place));
                }
            }
        }
        most
    }

    #[test]
    fn ground_beside_a_higher_road_is_lowered_onto_a_deck() {
        let (mut ground, decks) = (beside_a_road(), deck());
        assert!(400.0 < stands_above(&ground, &decks));
        let added = clear_decks(&mut ground, &decks, &[], |class| class == ROAD, 12);
        assert_eq!(
            (ground.check(), ground.triangles.len(), ground.polygon_count),
            (Ok(()), 4 + added, 4 + added as u32)
        );
        assert!((2..=12).contains(&added) && stands_above(&ground, &decks) < CLEARED_FOR + 1.0);
        let road = ground.classes.iter().filter(|class| **class == ROAD).count();
        assert_eq!(
            (road, ground.side_vertices(terrain::Side::North)),
            (2, [4, 5].map(|at| at + added as u16 / 2).to_vec())
        );
    }

    #[test]
    fn nothing_is_lowered_without_room_in_features_or_along_lines() {
        let whole = beside_a_road();
        for (most, is_of_features) in [(1, false), (12, true)] {
            let mut ground = whole.clone();
            assert_eq!(clear_decks(&mut ground, &deck(), &[], |class| is_of_features || class == ROAD, most), 0);
            assert_eq!(ground, whole);
        }
        // A way from corner to corner, where both natural triangles meet.
        let traits = terrain::LineTraits {
            kind: terrain::LineKind::Travelled,
            form: terrain::LineForm::Line,
            storey: terrain::LineStorey::Ground,
            is_kept: true,
            is_in_ground: true,
            width: 0,
        };
        let way = traits.line(ROAD, vec![vertex(0, 0, 0), vertex(SIDE, SIDE - 1280, 1280)]);
        let mut ground = whole.clone();
        clear_decks(&mut ground, &deck(), &[way], |class| class == ROAD, 12);
        let has = |at: &[u16; 3]| {
            let corners = at.map(|corner| ground.vertices[usize::from(corner)]);
            corners.contains(&whole.vertices[0]) && corners.contains(&vertex(SIDE, SIDE - 1280, 1280))
        };
        assert_eq!((ground.check(), ground.triangles.iter().filter(|at| has(at)).count()), (Ok(()), 2));
    }
}
