//! Small networks for tests: lines of posts over a ground that is a function of the place.

use terrain::{Post, PostRect, Spacing};

use crate::{
    FeatureId, Network, Numbering, Place, Position, Remark, Rounded, Shape, Site, Source, mend, round, sort_out,
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
    round(mend(sort_out(sources, &[]).features, &site()), &site())
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
