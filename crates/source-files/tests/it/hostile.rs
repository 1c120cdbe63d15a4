//! Damaged files: every truncation is an error, and no byte whatever makes the reader panic.

use proptest::prelude::*;
use source_files::{GeoTiff, VoidPolicy, read_polygons, write_heights};
use terrain::{Dem, PostRect};

use crate::support::{Folder, Tiff, Values, grid};

fn plain() -> Vec<u8> {
    Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]).with(42113, Values::Text("-9999")).bytes()
}

fn deflated(folder: &Folder) -> Vec<u8> {
    let rect = PostRect::of_size(9, 7);
    let path = folder.path("good.tif");
    let heights = |band| Dem::from_fn(band, |post| Some(post.row * 1000 + post.col * 77));
    write_heights(&path, &grid(500_000.0, 4_000_000.0, 25.0), rect, 32611, heights).unwrap();
    std::fs::read(path).unwrap()
}

/// Everything a job would do with the file; whether it is an error does not matter, only that it ends.
fn use_up(folder: &Folder, bytes: &[u8]) -> bool {
    let path = folder.write("bad.tif", bytes);
    let Ok(file) = GeoTiff::open(&path, None) else { return false };
    let Ok(mut raster) = file.read(file.rect()) else { return false };
    let settled = raster.settle_voids(VoidPolicy::Hole).is_ok();
    let grid = grid(500_000.0, 4_000_000.0, 25.0);
    settled && raster.resample(&grid, PostRect::of_size(2, 2)).is_ok()
}

#[test]
fn every_truncation_is_an_error() {
    let folder = Folder::new();
    for whole in [plain(), deflated(&folder)] {
        let path = folder.write("whole.tif", &whole);
        let file = GeoTiff::open(&path, None).unwrap();
        assert!(file.read(file.rect()).is_ok());
        for length in 0..whole.len() {
            let path = folder.write("short.tif", &whole[..length]);
            let read = GeoTiff::open(&path, None).and_then(|file| file.read(file.rect()));
            assert!(read.is_err(), "the first {length} of {} bytes were read as if whole", whole.len());
        }
    }
}

#[test]
fn no_single_byte_makes_the_reader_panic() {
    let folder = Folder::new();
    for whole in [plain(), deflated(&folder)] {
        for place in 0..whole.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[place] ^= flip;
                use_up(&folder, &bytes);
            }
        }
    }
}

proptest! {
    #[test]
    fn no_handful_of_bytes_makes_the_reader_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        compressed: bool,
    ) {
        let folder = Folder::new();
        let mut bytes = if compressed { deflated(&folder) } else { plain() };
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        use_up(&folder, &bytes);
    }

    #[test]
    fn no_text_makes_the_polygon_reader_panic(text in "[{}\\[\\]\",:0-9a-zA-Z .e-]{0,80}") {
        let folder = Folder::new();
        prop_assert!(read_polygons(&folder.write("a.geojson", text.as_bytes()), 32611).is_err());
    }
}
