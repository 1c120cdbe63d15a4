//! Small networks for tests: lines of posts over a ground that is a function of the place.

use terrain::{Post, PostRect, Spacing, in_turn};

use crate::exact::Segment;
use crate::forms::{Scope, form};
use crate::{
    AreaFeatures, Below, FallOptions, FeatureId, Form, Formed, FormedEdge, GradeOptions, Graded, Grants, Levelled,
    Network, Numbering, Place, Position, Remark, Role, Rounded, Shape, Shares, Site, Sounded, Source, Strand, Way,
    grade, mend, round, sides, sort_out, touch_at_vertices_only,
};

/// An area of 400 x 400 posts of 10 m, load modules of 50 posts, tiles of 200.
pub fn site() -> Site {
    let area = PostRect::new(Post::new(0, 0), Post::new(400, 400));
    Site::new(Spacing::from_metres(10.0).unwrap(), area, 50, 200)
}

/// A way with tags written as `highway=primary bridge=yes`, through positions in posts (east, north).
pub fn way(number: i64, tags: &str, positions: &[(f64, f64)]) -> Source {
    let tags = tags.split(' ').filter_map(|tag| tag.split_once('='));
    let tags = tags.map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
    let shape = Shape::Line(positions.iter().map(|&(east, north)| Position::new(east, north)).collect());
    Source { id: FeatureId { source: 0, numbering: Numbering::Way, number }, tags, kind: None, shape }
}

/// Features from tags to the lattice.
pub fn rounded(sources: Vec<Source>) -> Rounded {
    round(mend(sort_out(sources, &[], 1.5).features, &site()), &site(), &in_turn)
}

/// The network of all ways, and the ground at its nodes; `metres` is a function of posts (east, north).
pub fn network(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64) -> (Network, Vec<Option<i32>>, Vec<Remark>) {
    let rounded = rounded(sources);
    let mut remarks = rounded.remarks;
    let network = Network::of(&rounded.ways, site().lattice, &mut remarks);
    let ground = network.nodes.iter().map(|node| ground_at(node.place, &metres)).collect();
    (network, ground, remarks)
}

/// The ground at a place, in quanta.
pub fn ground_at(place: Place, metres: &impl Fn(f64, f64) -> f64) -> Option<i32> {
    let [east, north] = site().lattice.posts_of(place);
    terrain::quanta_of_metres(metres(east, north))
}

/// All that features come to with the usual options; edges are checked to touch at points only.
#[track_caller]
pub fn levelled(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64, shares: &Shares) -> Levelled {
    let all = AreaFeatures::of(sources, &[], 1.5, site(), &in_turn);
    let ground: Vec<Option<i32>> = all.stations().iter().map(|place| ground_at(*place, &metres)).collect();
    let levelled = level_usual(&all, &ground, shares);
    check(&levelled.reserved.formed);
    levelled
}

/// The same over the ground at each station, with no post inside any outline.
pub fn level_usual(all: &AreaFeatures, ground: &[Option<i32>], shares: &Shares) -> Levelled {
    let inside = vec![Vec::new(); all.outlines().len()];
    let sounded = Sounded { heights: ground, middles: ground, inside: &inside };
    all.level(sounded, (GradeOptions::USUAL, FallOptions::USUAL), shares, &in_turn)
}

/// Roads formed over a ground, and channels that lie on it; all edges are checked to touch at points only.
#[track_caller]
pub fn formed(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64) -> Formed {
    formed_between(rounded(sources), metres, Scope::NearChanged)
}

/// The same with another form than the table's.
#[track_caller]
pub fn formed_as(sources: Vec<Source>, metres: impl Fn(f64, f64) -> f64, form: Form) -> Formed {
    let mut rounded = rounded(sources);
    rounded.ways.iter_mut().for_each(|way| way.traits.form = form);
    formed_between(rounded, metres, Scope::NearChanged)
}

/// The same with what is looked at between the first round and the last.
#[track_caller]
pub fn formed_between(rounded: Rounded, metres: impl Fn(f64, f64) -> f64, between: Scope) -> Formed {
    let Rounded { ways, mut remarks, .. } = rounded;
    let (travelled, flowing): (Vec<Way>, Vec<Way>) = ways.into_iter().partition(|way| way.traits.kind.is_travelled());
    let network = Network::of(&travelled, site().lattice, &mut remarks);
    let ground: Vec<Option<i32>> = network.nodes.iter().map(|node| ground_at(node.place, &metres)).collect();
    let heights = grade(&network, [&ground; 2], &[], Below::WAYS, GradeOptions::USUAL, &mut remarks);
    let beside: Vec<[i32; 2]> =
        sides(&network).iter().map(|sides| sides.map(|place| ground_at(place, &metres).unwrap_or(0))).collect();
    let strand = |way: &Way| Strand {
        role: Role::Channel,
        class: way.traits.class,
        id: way.id,
        stations: way.places.iter().map(|place| (*place, ground_at(*place, &metres).unwrap_or(0))).collect(),
    };
    let strands: Vec<Strand> = flowing.iter().map(strand).collect();
    let grants = Grants::default();
    let graded = Graded { network: &network, heights: &heights, beside: &beside, grants: &grants };
    let mut formed = form(&graded, &strands, &site(), &in_turn, Some(between));
    check(&formed);
    formed.remarks.extend(remarks);
    Remark::sort(&mut formed.remarks);
    formed
}

/// Points are in order and used, and edges touch at points only.
#[track_caller]
pub fn check(formed: &Formed) {
    assert!(formed.points.windows(2).all(|pair| pair[0].0 < pair[1].0), "points are in order");
    let edge = |edge: &FormedEdge| vec![formed.points[edge.a as usize].0, formed.points[edge.b as usize].0];
    assert!(formed.edges.iter().all(|edge| edge.a < edge.b));
    assert!(formed.edges.windows(2).all(|pair| (pair[0].a, pair[0].b) < (pair[1].a, pair[1].b)), "edges are in order");
    let lines: Vec<Vec<Place>> = formed.edges.iter().map(edge).collect();
    assert_eq!(touch_at_vertices_only(&lines), Ok(()));
    for line in &lines {
        let mut crossed = Vec::new();
        site().crossings(Segment { a: line[0], b: line[1] }, &mut |place| crossed.push(place));
        assert!(crossed.is_empty(), "{line:?} crosses a module line");
    }
}
