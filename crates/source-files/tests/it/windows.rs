//! Rasters read by window: the same posts as read whole, each chunk decoded once while there is room.

use source_files::{Crs, DemFile, MosaicRules, MosaicVoids, Standing, WideMosaic, Windows};
use terrain::{GridFrame, Post, PostRect, Resampling};

use crate::mosaics::{PLAIN, mosaic, open, raster, utm, write_ascii, write_dted, write_hgt, write_raw, write_tiff};
use crate::support::{Folder, grid};

/// Windows of a raster that begin and end in the middle of chunks.
fn parts(rect: PostRect) -> Vec<PostRect> {
    let inner = |share: f64, of: i32| (f64::from(of) * share) as i32;
    let part = |[south, west, north, east]: [f64; 4]| {
        PostRect::new(
            Post::new(inner(south, rect.north), inner(west, rect.east)),
            Post::new(inner(north, rect.north), inner(east, rect.east)),
        )
    };
    [[0.0, 0.0, 1.0, 1.0], [0.2, 0.3, 0.21, 0.9], [0.0, 0.5, 1.0, 0.5], [0.99, 0.0, 1.0, 0.1]].map(part).to_vec()
}

#[test]
fn a_window_of_every_format_holds_the_posts_of_the_whole() {
    let write_degrees = |folder: &Folder| write_tiff(folder, &Crs::wgs84(), &[(1024, 2), (2048, 4326)], false);
    for write in [write_hgt, write_dted, write_ascii, write_raw, write_degrees] {
        let folder = Folder::new();
        let file = open(&write(&folder));
        let whole = file.read(file.rect()).unwrap();
        let windows = Windows::new(vec![file], 1 << 20);
        for part in parts(whole.window()) {
            let read = windows.read(0, part).unwrap();
            for post in (part.south..=part.north).flat_map(|row| (part.west..=part.east).map(move |c| (row, c))) {
                let post = Post::new(post.0, post.1);
                assert_eq!(read.sample(post), whole.sample(post), "{} at {post}", whole.frame().path.display());
            }
        }
    }
}

#[test]
fn a_chunk_is_decoded_once_while_there_is_room_and_again_when_there_is_none() {
    let folder = Folder::new();
    let file = open(&write_dted(&folder));
    let band = |north: i32| PostRect { south: north - 100, west: 0, north, east: 1200 };
    let decoded = |bytes_max: u64| {
        let windows = Windows::new(vec![file.clone()], bytes_max);
        for north in [100, 150, 900] {
            windows.read(0, band(north)).unwrap();
        }
        windows.decoded()
    };
    // 1201 columns, 64 to a chunk.
    assert_eq!(decoded(4 << 20), 19);
    assert_eq!(decoded(1 << 20), 3 * 19);
}

#[test]
fn a_chunk_that_several_threads_ask_for_is_decoded_once() {
    let folder = Folder::new();
    let windows = Windows::new(vec![open(&write_hgt(&folder))], 8 << 20);
    let rect = windows.files()[0].rect();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| windows.read(0, rect).unwrap());
        }
    });
    assert_eq!(windows.decoded(), windows.files()[0].chunks_of(rect).len() as u64);
}

#[test]
fn a_look_at_the_chunks_tells_what_the_whole_raster_would() {
    let folder = Folder::new();
    let file = raster(&folder, "a.tif", [500_000.0, 4.0e6], (40, 30), |row, col| {
        if row == 7 && col < 5 { -1 } else { (row * 40 + col) as i16 }
    });
    let window = PostRect::new(Post::new(5, 2), Post::new(20, 30));
    let reach = file.reach(&utm(), &grid(500_050.0, 4_000_080.0, 10.0), PostRect::of_size(9, 12));
    let look = file.look(window, Some(&reach), &file.chunks_of(window)).unwrap();
    let whole = file.read(window).unwrap();
    assert!(look.reached_m.is_some() && look.reached_m == whole.range_within_m(&reach));
    assert_eq!((look.posts, look.voids, look.range_m), (window.post_count(), 3, whole.range_m()));
    assert_eq!(look.first_void.as_deref(), Some("500020.0, 4000070.0 m"));
}

pub fn wide(files: &[DemFile], rules: MosaicRules, grid: &GridFrame, rect: PostRect) -> WideMosaic {
    let windows = Windows::new(files.to_vec(), 1 << 20);
    let lowest = |file: &DemFile| file.read(file.rect()).unwrap().range_m().map_or(0.0, |(lowest, _)| lowest);
    let used: Vec<(usize, f64)> = files.iter().map(lowest).enumerate().collect();
    WideMosaic::new(windows, &used, rules, (&utm(), grid, rect)).unwrap()
}

#[test]
fn a_mosaic_read_by_window_equals_one_that_was_read_whole() {
    let folder = Folder::new();
    let bumpy = |row: i32, col: i32| ((row * 7 + col * 13) % 97) as i16;
    let crs = Crs::from_epsg(5070).unwrap();
    let [east, north] = Crs::wgs84().to(&utm(), [-116.65, 35.51]).unwrap().map(|metres| (metres / 10.0).round() * 10.0);
    let files = [
        raster(&folder, "p.tif", [east + 1003.0, north + 807.0], (60, 50), bumpy),
        raster(&folder, "q.tif", [east + 1603.0, north + 807.0], (60, 50), bumpy),
        open(&write_tiff(&folder, &crs, &[(1024, 1), (3072, 5070)], false)),
    ];
    let (grid, rect) = (grid(east, north, 12.5), PostRect::of_size(150, 170));
    let rules = MosaicRules { resampling: Resampling::Cubic, feather_m: 80.0, ..PLAIN };
    let whole = mosaic(&files, rules, &grid, rect).unwrap();
    let wide = wide(&files, rules, &grid, rect);
    for part in parts(rect) {
        assert_eq!(wide.resample(part).unwrap(), whole.resample(part), "{part:?}");
    }
}

#[test]
fn a_void_and_a_gap_come_out_the_same_in_every_window() {
    let folder = Folder::new();
    // A lake of voids over several blocks, with islands of height, and a strip that no file reaches.
    let lake = |row: i32, col: i32| {
        let inside = (200..900).contains(&row) && (100..800).contains(&col) && (row % 300, col % 200) != (7, 9);
        if inside { -1 } else { 100 + ((row / 9 + col / 7) % 50) as i16 }
    };
    let files = [
        raster(&folder, "a.tif", [500_000.0, 4.0e6], (600, 1000), lake),
        raster(&folder, "b.tif", [506_000.0, 4.0e6], (300, 1000), |row, col| lake(row, col + 600)),
    ];
    let (grid, rect) = (grid(500_000.0, 4.0e6, 10.0), PostRect::of_size(1000, 950));
    let rules = MosaicRules { voids: MosaicVoids { next_source: false, fill_within: 6 }, ..PLAIN };
    let wide = wide(&files, rules, &grid, rect);
    let whole = wide.resample(rect).unwrap();
    let read = mosaic(&files, rules, &grid, rect).unwrap().resample(rect);
    assert_eq!(whole.standings, read.standings, "what is near enough to be filled does not hang on blocks");
    let index = |post: Post| post.row as usize * rect.posts_wide() + post.col as usize;
    assert_eq!(whole.standings[index(Post::new(203, 300))], Standing::Filled);
    assert_eq!(whole.standings[index(Post::new(500, 930))], Standing::Gap);
    for part in parts(rect) {
        let patch = wide.resample(part).unwrap();
        let posts = (part.south..=part.north).flat_map(|row| (part.west..=part.east).map(move |col| (row, col)));
        for (at, (row, col)) in posts.enumerate() {
            let whole_at = index(Post::new(row, col));
            assert_eq!(
                (patch.heights[at], patch.standings[at]),
                (whole.heights[whole_at], whole.standings[whole_at]),
                "{row},{col}"
            );
        }
    }
}
