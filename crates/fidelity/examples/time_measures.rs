//! Times every measure on hills of 50 km at 25 m, against a grid of 125 m: `cargo run --release -p fidelity --example
//! time_measures`.

use std::time::Instant;

use fidelity::*;
use terrain::{Dem, Metres, PostRect};

fn main() {
    let spacing = Metres(25.0);
    let dem = Dem::from_fn(PostRect::of_size(2001, 2001), |post| {
        let (x, y) = (f64::from(post.col), f64::from(post.row));
        let large = 300.0 * (x * 0.013).sin() * (y * 0.011).cos();
        let small = 25.0 * (x * 0.19 - y * 0.07).sin() + 12.0 * (y * 0.37).cos() + 5.0 * (x * 1.1 + y * 0.9).sin();
        Some(((large + small) * 128.0).round() as i32)
    });
    let grid = regular_grid(&dem, dem.rect(), 320_000);
    let mut last = Instant::now();
    let mut took = |what: &str| {
        println!("{what:<24} {:6.2} s", last.elapsed().as_secs_f64());
        last = Instant::now();
    };
    let triangles = Triangles::of_tin(&grid.tin);
    took("index of triangles");
    let posts = PostHeights::of_dem(&dem, dem.rect());
    took("heights of the DEM");
    let tin = PostHeights::of_triangles(&triangles, &posts);
    took("heights of triangles");
    residuals_at_posts(&posts, &tin);
    took("residuals");
    line_of_sight(&dem, &triangles, spacing, 20_000, 1);
    took("line of sight");
    slope(&posts, &tin, spacing);
    took("slope");
    slope_classes(&posts, &tin, spacing);
    took("slope classes");
    hausdorff(&posts, &tin, &triangles, spacing);
    took("hausdorff");
    let streams = Streams::of(&tin);
    took("streams");
    drainage(&posts, &streams, &streams);
    took("drainage");
    let defilade = Defilade::of(&tin, spacing);
    took("defilade");
    cover(&posts, &defilade, &defilade);
    took("cover");
    registration(&posts, &tin, spacing);
    took("registration");
    seam_visibility(&triangles, 20, spacing);
    took("seams");
    mesh_form(&triangles, Some(20));
    took("mesh");
}
