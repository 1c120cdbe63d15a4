//! What the fuzzers share: a file that holds what the engine made up, and everything a job would do with it.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use source_files::{Crs, DemFile, Reading, VoidPolicy, Windows};
use terrain::{GridFrame, PostRect, Spacing};

/// Rasters larger than this are opened and not decoded: the engine is to try many files, not to wait for one.
const POSTS_MAX: usize = 1 << 18;

/// A folder of this process alone, in memory where there is such a place.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let memory = Path::new("/dev/shm");
        let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let folder = parent.join(format!("tiefort-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder can be made");
        folder
    })
}

/// A file with some content.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    std::fs::write(&path, bytes).expect("a file can be written");
    path
}

/// Opens, reads whole and by window, fills and resamples; whether it is an error does not matter, only that it ends.
pub fn use_up(path: &Path) {
    let reading = Reading { corner: Some([-117.0, 35.0]), crs: None, ..Reading::AS_IT_SAYS };
    let named = Reading { crs: Some(Crs::wgs84()), ..reading.clone() };
    let Ok(file) = DemFile::open(path, &reading).or_else(|_| DemFile::open(path, &named)) else { return };
    let rect = file.rect();
    if POSTS_MAX < rect.post_count() {
        return;
    }
    let _ = file.look(rect, None, &file.chunks_of(rect));
    let windows = Windows::new(vec![file.clone()], 1 << 16);
    let middle = PostRect { south: rect.north / 3, west: rect.east / 3, north: rect.north / 2, east: rect.east / 2 };
    let part = windows.read(0, middle);
    let Ok(mut whole) = file.read(rect) else { return };
    let part = part.expect("what can be read whole can be read in part");
    for row in middle.south..=middle.north {
        let post = terrain::Post::new(row, middle.west);
        assert_eq!(part.sample(post), whole.sample(post), "a window holds what the whole raster does");
    }
    let spacing = Spacing::from_metres(25.0).expect("25 m is a spacing");
    let grid = GridFrame { origin_east_m: 505_000.0, origin_north_m: 3_875_000.0, spacing };
    let area = Crs::from_epsg(32611).expect("UTM is known");
    if let Some(window) = file.window_reaching(&area, &grid, PostRect::of_size(40, 40)) {
        assert!(rect.contains_rect(&window));
    }
    let _ = whole.settle_voids(VoidPolicy::FillWithin(3));
}
