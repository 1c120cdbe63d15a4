//! Resamples rasters onto a grid, for comparison with GDAL's warp (`scripts/compare.py warp`).
//!
//! `resample_posts bilinear|cubic EPSG EAST NORTH COLS ROWS SPACING FILE…` writes the heights to stdout: 32-bit floats,
//! little-endian, northern row first, NaN where there is none; and the seconds to read and to resample to stderr.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use source_files::{Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Reading, Standing};
use terrain::{GridFrame, Post, PostRect, Resampling, Spacing};

fn main() -> std::io::Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize| words[at].parse::<f64>().expect("a number");
    let resampling = if words[0] == "cubic" { Resampling::Cubic } else { Resampling::Bilinear };
    let crs = Crs::from_epsg(number(1) as u32).expect("a known system");
    let spacing = Spacing::from_metres(number(6)).expect("a multiple of 1/16 m");
    let grid = GridFrame { origin_east_m: number(2), origin_north_m: number(3), spacing };
    let rect = PostRect::of_size(number(5) as usize, number(4) as usize);

    let started = Instant::now();
    let rasters = words[7..].iter().map(|path| {
        let file = DemFile::open(Path::new(path), &Reading::AS_IT_SAYS).expect("a raster");
        let window = file.window_reaching(&crs, &grid, rect).expect("a raster that reaches there");
        file.read(window).expect("a sound raster")
    });
    let rasters: Vec<_> = rasters.collect();
    let read = started.elapsed().as_secs_f64();
    let voids = MosaicVoids { next_source: false, fill_within: 0 };
    let rules = MosaicRules { resampling, feather_m: 0.0, voids };
    let started = Instant::now();
    let mosaic = Mosaic::new(rasters, rules, &crs, &grid, rect).expect("rasters that fit in memory");
    let mut bytes = Vec::with_capacity(rect.post_count() * 4);
    let band = |south: i32, north: i32| PostRect::new(Post::new(south, rect.west), Post::new(north, rect.east));
    let mut north = rect.north;
    while rect.south <= north {
        let south = rect.south.max(north - 255);
        let patch = mosaic.resample(band(south, north));
        for row in (0..patch.rect.posts_high()).rev() {
            for at in row * rect.posts_wide()..(row + 1) * rect.posts_wide() {
                let known = patch.standings[at] == Standing::Height;
                let height = if known { patch.heights[at] as f32 / 128.0 } else { f32::NAN };
                bytes.extend(height.to_le_bytes());
            }
        }
        north = south - 1;
    }
    eprintln!("{read} {}", started.elapsed().as_secs_f64());
    std::io::stdout().write_all(&bytes)
}
