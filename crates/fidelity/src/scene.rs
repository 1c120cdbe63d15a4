//! Ground for tests: random TINs, load modules cut from them, and slow, obvious answers.

use terrain::{Dem, LatticePoint, LoadModule, ModuleGrid, ModuleId, ModuleVertex, Post, PostRect};
use terrain::{Spacing, Tin, Vertex};

use crate::sight::Draw;

/// Whole numbers below a bound.
pub struct Dice(Draw);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(Draw::new(seed, 77))
    }

    pub fn below(&mut self, bound: i32) -> i32 {
        (self.0.unit() * f64::from(bound)) as i32
    }
}

/// A TIN over `rect` with about `count` vertices anywhere on the lattice, some on its border.
pub fn random_tin(rect: PostRect, count: usize, height: impl Fn(LatticePoint, &mut Dice) -> i32, seed: u64) -> Tin {
    let dice = &mut Dice::new(seed);
    let [low, .., _] = rect.corners().map(LatticePoint::from);
    let (high, wide) = (rect.cells_high() as i32 * 8, rect.cells_wide() as i32 * 8);
    let mut places: Vec<Post> = rect.corners().map(|post| Post::new(post.row * 8, post.col * 8)).to_vec();
    for i in 0..count {
        let (row, col) = (dice.below(high + 1), dice.below(wide + 1));
        let (row, col) = match i % 8 {
            0 => (0, col),
            1 => (row, wide),
            // Whole posts, so that some edges run through posts and along rows.
            2 | 3 => (row / 8 * 8, col / 8 * 8),
            _ => (row, col),
        };
        places.push(Post::new(low.row + row, low.col + col));
    }
    places.sort_unstable();
    places.dedup();
    let triangles = terrain::mesh::delaunay(&places);
    let vertices = places
        .iter()
        .map(|place| {
            let at = LatticePoint::new(place.row, place.col);
            Vertex { at, height: height(at, dice) }
        })
        .collect();
    let tin = Tin::new(rect, vertices, triangles);
    tin.check().expect("a random TIN is sound");
    tin
}

/// The TIN through every post of a DEM.
pub fn full_tin(dem: &Dem) -> Tin {
    let rect = dem.rect();
    let (wide, high) = (rect.posts_wide() as u32, rect.posts_high() as u32);
    let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    let vertices = posts.map(|post| Vertex { at: post.into(), height: dem.height(post) }).collect();
    let cells = (0..high - 1).flat_map(|row| (0..wide - 1).map(move |col| row * wide + col));
    let triangles = cells.flat_map(|v| [[v, v + 1, v + wide + 1], [v, v + wide + 1, v + wide]]).collect();
    Tin::new(rect, vertices, triangles)
}

/// One load module of 20 x 20 cells that holds a TIN of 21 x 21 posts, moved to its place.
pub fn module_of(tin: &Tin, id: ModuleId, spacing: Spacing) -> LoadModule {
    let step = spacing.quanta_per_lattice_step();
    let mut order: Vec<usize> = (0..tin.vertices.len()).collect();
    order.sort_by_key(|&index| tin.vertices[index].at);
    let mut places = vec![0_u16; order.len()];
    order.iter().enumerate().for_each(|(place, &index)| places[index] = place as u16);
    let vertices = order
        .iter()
        .map(|&index| {
            let Vertex { at, height } = tin.vertices[index];
            ModuleVertex { y: (at.row * step) as u16, x: (at.col * step) as u16, z: height }
        })
        .collect();
    let mut triangles: Vec<[u16; 3]> = tin.triangles.iter().map(|t| t.map(|v| places[v as usize])).collect();
    for triangle in &mut triangles {
        let smallest = (0..3).min_by_key(|&i| triangle[i]).expect("a triangle has three corners");
        triangle.rotate_left(smallest);
    }
    triangles.sort_unstable();
    LoadModule {
        id,
        side: (tin.rect.cells_wide() as i32 * spacing.quanta_per_post()) as u16,
        vertices,
        classes: vec![0; triangles.len()],
        polygon_count: triangles.len() as u32,
        triangles,
        ..LoadModule::default()
    }
}

/// A grid of `rows` x `cols` load modules as [`module_of`] makes them.
pub fn grid(rows: u32, cols: u32) -> ModuleGrid {
    ModuleGrid { rows, cols, side_cells: 20 }
}

/// Height of a TIN at a place: every triangle is asked, and the first one that holds the place answers.
pub fn height_by_search(tin: &Tin, [x, y]: [f64; 2]) -> f64 {
    const ON_EDGE: f64 = 1e-12;
    let holding = tin.triangles.iter().find_map(|triangle| {
        let [a, b, c] = triangle.map(|v| {
            let Vertex { at, height } = tin.vertices[v as usize];
            [f64::from(at.col) / 8.0, f64::from(at.row) / 8.0, f64::from(height)]
        });
        // Solve place = a + u (b - a) + v (c - a).
        let det = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / det;
        let v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / det;
        (-ON_EDGE <= u && -ON_EDGE <= v && u + v <= 1.0 + ON_EDGE).then(|| a[2] * (1.0 - u - v) + b[2] * u + c[2] * v)
    });
    holding.expect("some triangle holds every place inside")
}
