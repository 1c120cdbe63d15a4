//! Puts one block of ground together: lie of the land, drainage, alluvium, playas.

use terrain::Spacing;

use crate::drainage::{Blend, Crest, FLANKS, OCTAVES, Octave, Posts, WAVELENGTHS_M, octaves};
use crate::playa::Playa;
use crate::region::{Lie, Region};

/// Side of a block of ground in metres. Every place belongs to one block, whatever window asks for it, so numbers
/// may be kept local to a block and single precision is enough.
pub(crate) const BLOCK_M: f64 = 3_200.0;
/// Metres between nodes of the lattice on which the region is evaluated.
const NODE_M: f64 = 400.0;
/// Nodes a side beyond its cells: one before and one after for the cubic spline, one for its far border.
const NODES_BEYOND: usize = 3;
/// Depth in metres of the washes that each octave cuts into fans where incision is full.
const WASHES_M: [f32; OCTAVES] = [0.0, 4.5, 3.5, 1.2];
/// Height in metres of fan lobes at canyon mouths.
const LOBE_M: f32 = 14.0;
/// Octaves of rough ground: those that posts 100 m apart can show.
const ROUGH_OCTAVES: usize = 2;

/// No ground is lower than this, in metres.
pub(crate) const LOWEST_M: f32 = 300.0;
/// No ground is higher than this, in metres.
pub(crate) const HIGHEST_M: f32 = 2_500.0;

/// One block of ground, ready to be sampled.
#[derive(Debug)]
pub(crate) struct Block {
    corner_m: (f64, f64),
    nodes: Vec<Lie>,
    octaves: Vec<Octave>,
    playas: Vec<Playa>,
}

impl Block {
    /// The block whose south-west corner is given in metres; `playas` are those that touch it.
    pub(crate) fn new(seed: u64, region: &Region, corner_m: (f64, f64), playas: Vec<Playa>) -> Self {
        let octaves = octaves(seed, region, corner_m, BLOCK_M, OCTAVES);
        Self { corner_m, nodes: nodes(region, corner_m, BLOCK_M), octaves, playas }
    }

    /// A wider square of ground without playas and without its finer drainage: what features are laid out on.
    pub(crate) fn rough(seed: u64, region: &Region, corner_m: (f64, f64), side_m: f64) -> Self {
        let octaves = octaves(seed, region, corner_m, side_m, ROUGH_OCTAVES);
        Self { corner_m, nodes: nodes(region, corner_m, side_m), octaves, playas: Vec::new() }
    }

    /// Heights in metres at the posts of a patch, row-major.
    pub(crate) fn heights_m(&self, posts: Posts<'_>) -> Vec<f32> {
        let mut ground: Vec<PostGround> = lie(&self.nodes, posts).iter().map(PostGround::new).collect();
        let mut blend = Blend::of_size(posts.count());
        for (number, octave) in self.octaves.iter().enumerate() {
            octave.blend(posts, &mut blend);
            for (place, crest) in ground.iter_mut().zip(blend.crests()) {
                place.cut(number, crest);
            }
        }
        let mut heights_m: Vec<f32> = ground.iter().map(PostGround::height_m).collect();
        for playa in &self.playas {
            playa.fill(self.corner_m, posts, &mut heights_m);
        }
        heights_m
    }
}

/// The lie of the land at the nodes of a square's lattice.
pub(crate) fn nodes(region: &Region, corner_m: (f64, f64), side_m: f64) -> Vec<Lie> {
    let wide = (side_m / NODE_M) as usize + NODES_BEYOND;
    let place_m = |corner_m: f64, node: usize| corner_m + (node as f64 - 1.0) * NODE_M;
    let places = (0..wide).flat_map(|row| (0..wide).map(move |col| (row, col)));
    places.map(|(row, col)| region.lie(place_m(corner_m.0, col), place_m(corner_m.1, row))).collect()
}

/// The lie of the land at the posts of a patch, row-major: a cubic spline through the square's nodes.
pub(crate) fn lie(nodes: &[Lie], posts: Posts<'_>) -> Vec<Lie> {
    let wide = nodes.len().isqrt();
    let mut lies = Vec::with_capacity(posts.count());
    let cols: Vec<(usize, [f32; 4])> = posts.east_m.iter().map(|&east_m| spline(east_m, wide)).collect();
    for &north_m in posts.north_m {
        let (row, up) = spline(north_m, wide);
        let column = |col: usize| [0, 1, 2, 3].map(|up| &nodes[(row + up) * wide + col]);
        let line: Vec<Lie> = (0..wide).map(|col| Lie::weighed(column(col), up)).collect();
        for &(col, right) in &cols {
            lies.push(Lie::weighed([0, 1, 2, 3].map(|east| &line[col + east]), right));
        }
    }
    lies
}

/// First node and weights of the cubic B-spline at a place in a square of `wide` nodes a side.
fn spline(place_m: f32, wide: usize) -> (usize, [f32; 4]) {
    let node = place_m / NODE_M as f32;
    let first = (node as usize).min(wide - 4);
    let t = node - first as f32;
    let r = 1.0 - t;
    let weights = [
        r * r * r / 6.0,
        (t * t * (3.0 * t - 6.0) + 4.0) / 6.0,
        (r * r * (3.0 * r - 6.0) + 4.0) / 6.0,
        t * t * t / 6.0,
    ];
    (first, weights)
}

/// The ground at one post while drainage is being cut into it.
#[derive(Clone, Copy, Debug)]
struct PostGround {
    /// Alluvial surface, in metres.
    alluvium_m: f32,
    /// Bedrock above the alluvial surface, in metres; below 0 on fans and in basins.
    bedrock_m: f32,
    /// 1 in the mountains, 0 on fans.
    mountain: f32,
    /// How much of a wash this place may have, 0..1.
    wash: f32,
    /// How much room the next octave has: little on crests and in valley lines of the ones before.
    room: f32,
}

impl PostGround {
    fn new(lie: &Lie) -> Self {
        Self {
            alluvium_m: lie.alluvium_m(),
            bedrock_m: lie.bedrock_m(),
            mountain: lie.mountain(),
            wash: lie.wash(),
            room: 1.0,
        }
    }

    /// Cuts one octave's wave into bedrock and alluvium.
    fn cut(&mut self, number: usize, crest: Crest) {
        self.bedrock_m += 0.25 * WAVELENGTHS_M[number] * FLANKS[number] * self.room * self.mountain * crest.relief;
        self.room *= 1.0 - 0.6 * crest.relief * crest.relief;
        let channel = ((-crest.line - 0.62) * 4.0).clamp(0.0, 1.0);
        self.alluvium_m -= WASHES_M[number] * self.wash * channel;
        if number == 0 {
            // A valley's mouth is the apex of a fan.
            self.alluvium_m -= LOBE_M * self.wash * crest.relief;
        }
    }

    fn height_m(&self) -> f32 {
        (self.alluvium_m + self.bedrock_m.max(0.0)).clamp(LOWEST_M, HIGHEST_M)
    }
}

/// Posts a side of a patch: few enough that a patch's sums stay in a near cache.
const PATCH_POSTS: usize = 64;

/// Neighbouring rows (or columns) of a window that lie in one row (or column) of blocks.
#[derive(Debug)]
pub(crate) struct Run {
    /// Where the block begins, in metres from post (0, 0).
    pub(crate) corner_m: f64,
    /// Index, in the window, of the first one.
    pub(crate) start: usize,
    /// Metres from the block's border. A sixteenth of a metre within a block is exact in single precision.
    pub(crate) places_m: Vec<f32>,
}

/// The runs of rows (or columns) `first..=last`, ascending.
pub(crate) fn runs(first: i32, last: i32, spacing: Spacing) -> Vec<Run> {
    let side = BLOCK_M as i64 * 16;
    let mut runs: Vec<Run> = Vec::new();
    for post in first..=last {
        let sixteenths = i64::from(post) * i64::from(spacing.sixteenths());
        let corner_m = sixteenths.div_euclid(side) as f64 * BLOCK_M;
        let place_m = sixteenths.rem_euclid(side) as f32 / 16.0;
        match runs.last_mut() {
            Some(run) if run.corner_m == corner_m && run.places_m.len() < PATCH_POSTS => run.places_m.push(place_m),
            _ => runs.push(Run {
                corner_m,
                start: (i64::from(post) - i64::from(first)) as usize,
                places_m: vec![place_m],
            }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_hold_every_row_once_and_never_cross_a_block() {
        for (first, last, metres) in
            [(-300, 300, 25.0), (-5, 5, 5_000.0), (100, 100, 1.0), (i32::MAX - 9, i32::MAX, 31.25)]
        {
            let spacing = Spacing::from_metres(metres).expect("a multiple of a sixteenth");
            let mut post = i64::from(first);
            for run in runs(first, last, spacing) {
                assert_eq!(run.start as i64, post - i64::from(first));
                for &place_m in &run.places_m {
                    assert!((0.0..BLOCK_M as f32).contains(&place_m));
                    assert_eq!(run.corner_m + f64::from(place_m), post as f64 * metres);
                    post += 1;
                }
            }
            assert_eq!(post, i64::from(last) + 1);
        }
    }
}
