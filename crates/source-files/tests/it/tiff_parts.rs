//! Parts of TIFFs: a copied window is that window of the whole file, in whatever order of bytes and kind of TIFF.

use std::fs::{self, File};
use std::io::Cursor;
use std::path::Path;

use source_files::{DemFile, SourceError, TiffLevels};
use terrain::{Post, PostRect};

use crate::mosaics::open;
use crate::support::{Folder, Tiff, data};

/// A file of `level` of `whole` with the chunks under `window` only.
fn copied(whole: &Path, folder: &Folder, level: usize, window: impl Fn(&DemFile) -> PostRect) -> DemFile {
    let bytes = fs::read(whole).unwrap();
    let levels = TiffLevels::read(&mut Cursor::new(&bytes), bytes.len() as u64, whole).unwrap();
    let path = folder.path("part.tif");
    levels.write(level, &[], &mut File::create(&path).unwrap(), |_| unreachable!("nothing is wanted")).unwrap();
    let empty = open(&path);
    let chunks = empty.chunks_of(window(&empty));
    let data = |chunk| {
        let (start, len) = levels.chunk(level, chunk);
        Ok(bytes[start as usize..(start + len) as usize].to_vec())
    };
    levels.write(level, &chunks, &mut File::create(&path).unwrap(), data).unwrap();
    open(&path)
}

#[test]
fn a_copied_window_holds_the_posts_of_the_whole() {
    const FOLDER: &str = "formats/geotiff/variants";
    for name in [
        "cog_i16_deflate_overviews.tif",
        "bigtiff_tile128_i16_lzw.tif",
        "strip16_i16_none_bigendian.tif",
        "tile64_f32_deflate_pred3.tif",
        "pixelispoint_i16_deflate.tif",
        "geographic_nad83_f32_nodata-9999.tif",
        "u16_scale0.1_offset1000.tif",
        "sparse_tile128_i16_nodata.tif",
    ] {
        let Some(path) = data(&format!("{FOLDER}/{name}")) else { return };
        let (folder, whole) = (Folder::new(), open(&path));
        let part = PostRect::new(Post::new(150, 170), Post::new(220, 240));
        let copy = copied(&path, &folder, 0, |_| part);
        // What is left out of a window of floats is no ground.
        let nodata = copy.nodata().filter(|nodata| !nodata.is_nan());
        assert_eq!(
            (copy.frame().south_west, copy.frame().spacing, copy.rect(), nodata, copy.vertical_datum()),
            (whole.frame().south_west, whole.frame().spacing, whole.rect(), whole.nodata(), whole.vertical_datum()),
            "{name}"
        );
        let (own, of_whole) = (copy.read(part).unwrap(), whole.read(part).unwrap());
        for post in (part.south..=part.north).flat_map(|row| (part.west..=part.east).map(move |col| (row, col))) {
            let post = Post::new(post.0, post.1);
            assert_eq!(
                (own.sample(post), own.height_m(post)),
                (of_whole.sample(post), of_whole.height_m(post)),
                "{name}"
            );
        }
    }
}

#[test]
fn an_overview_covers_the_same_ground() {
    let Some(path) = data("formats/geotiff/variants/cog_i16_deflate_overviews.tif") else { return };
    let bytes = fs::read(&path).unwrap();
    let levels = TiffLevels::read(&mut Cursor::new(&bytes), bytes.len() as u64, &path).unwrap();
    assert!(1 < levels.count(), "{} levels", levels.count());
    let (folder, whole) = (Folder::new(), open(&path));
    let copy = copied(&path, &folder, 1, DemFile::rect);
    let corners = |file: &DemFile| {
        let frame = file.frame();
        let half = |axis: usize| frame.south_west[axis] - frame.spacing[axis] / 2.0;
        [half(0), half(1), half(0) + f64::from(frame.cols) * frame.spacing[0], frame.spacing[0]]
    };
    let (own, of_whole) = (corners(&copy), corners(&whole));
    assert!((0..3).all(|at| (own[at] - of_whole[at]).abs() < 1.0e-6), "{own:?} {of_whole:?}");
    assert_eq!(own[3], 2.0 * of_whole[3]);
    // A height in the middle is about that of the whole.
    let middle = Post::new(copy.rect().north / 2, copy.rect().east / 2);
    let place = copy.frame().place(middle.row as u32, middle.col as u32);
    let at = |axis: usize| ((place[axis] - whole.frame().south_west[axis]) / whole.frame().spacing[axis]) as i32;
    let height = |file: &DemFile, post| file.read(PostRect::new(post, post)).unwrap().height_m(post).unwrap();
    let (own, of_whole) = (height(&copy, middle), height(&whole, Post::new(at(1), at(0))));
    assert!((own - of_whole).abs() < 30.0, "{own} {of_whole}");
}

#[test]
fn directories_that_lie_are_refused_and_none_is_a_panic() {
    let bytes = Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]).bytes();
    let read = |bytes: &[u8]| TiffLevels::read(&mut Cursor::new(bytes), bytes.len() as u64, Path::new("a.tif"));
    assert_eq!(read(&bytes).unwrap().count(), 1);
    for len in 0..bytes.len() {
        let _ = read(&bytes[..len]);
    }
    for at in 0..bytes.len() {
        for flip in [1, 0x80, 0xff] {
            let mut changed = bytes.clone();
            changed[at] ^= flip;
            if let Ok(levels) = read(&changed) {
                let _ = levels.write(0, &[], &mut Vec::new(), |_| Ok(Vec::new()));
            }
        }
    }
    assert!(matches!(read(b"PK\x03\x04....").unwrap_err(), SourceError::NotTiff { .. }));
}
