//! Damaged files: every truncation is an error, and no byte whatever makes the reader panic.

use std::io::Write;

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};
use proptest::prelude::*;
use source_files::{DemFile, GeoTiff, Geoid, Reading, SourceError, VoidPolicy, read_polygons, write_heights};
use terrain::{Dem, PostRect};

use crate::support::{Folder, Tiff, Values, grid};

fn plain() -> Vec<u8> {
    Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]).with(42113, Values::Text("-9999")).bytes()
}

fn deflated(folder: &Folder) -> Vec<u8> {
    let rect = PostRect::of_size(9, 7);
    let path = folder.path("good.tif");
    let heights = |band| Dem::from_fn(band, |post| Some(post.row * 1000 + post.col * 77));
    write_heights(
        &mut std::fs::File::create(&path).unwrap(),
        &grid(500_000.0, 4_000_000.0, 25.0),
        rect,
        32611,
        heights,
    )
    .unwrap();
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

/// A file whose directory is followed by another one at `next`.
fn with_next(tiff: &Tiff, next: impl Fn(u32) -> u32, more: &[u8]) -> Vec<u8> {
    let (mut bytes, directory) = (tiff.bytes(), 8 + tiff.samples.len() as u32);
    let at = directory as usize + 2 + 12 * tiff.tags.len();
    let end = bytes.len() as u32;
    bytes[at..at + 4].copy_from_slice(&next(end).to_le_bytes());
    bytes.extend(more);
    bytes
}

#[test]
fn directories_that_go_in_a_circle_end() {
    let (folder, tiff) = (Folder::new(), Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]));
    let itself = 8 + tiff.samples.len() as u32;
    let path = folder.write("circle.tif", &with_next(&tiff, |_| itself, &[]));
    // Whether it is read or refused, it ends.
    let _ = GeoTiff::open(&path, None).and_then(|file| file.read(file.rect()));
}

#[test]
fn an_internal_mask_is_refused_by_name() {
    let (folder, tiff) = (Folder::new(), Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]));
    let mask = [1, 0, 254, 0, 4, 0, 1, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0];
    let error = GeoTiff::open(&folder.write("mask.tif", &with_next(&tiff, |end| end, &mask)), None).unwrap_err();
    assert!(error.to_string().contains("voids are given by an internal mask, expected a nodata tag"), "{error}");
}

/// Six heights of 16 bits in one strip that is packed so.
fn packed(packing: u16, strip: Vec<u8>) -> Vec<u8> {
    let mut tiff = Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]);
    tiff.samples = strip;
    let size = tiff.samples.len() as u32;
    tiff.with(259, Values::Short(vec![packing])).with(279, Values::Long(vec![size])).bytes()
}

#[track_caller]
fn check_strip(packing: u16, strip: Vec<u8>, expected: &str) {
    let folder = Folder::new();
    let path = folder.write("strip.tif", &packed(packing, strip));
    let error = GeoTiff::open(&path, None).and_then(|file| file.read(file.rect())).unwrap_err().to_string();
    assert!(error.contains("strip or tile 0 of 1 cannot be decoded") && error.contains(expected), "{error}");
}

#[test]
fn a_strip_that_unpacks_far_beyond_its_rows_is_refused_and_not_unpacked() {
    const DEFLATE: u16 = 8;
    const LZW: u16 = 5;
    const ZSTD: u16 = 50000;
    let zeroes = vec![0; 64 << 20];
    let mut deflate = ZlibEncoder::new(Vec::new(), Compression::fast());
    deflate.write_all(&zeroes).unwrap();
    check_strip(DEFLATE, deflate.finish().unwrap(), "more than the 12 bytes that its rows have");
    let lzw = weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(&zeroes).unwrap();
    check_strip(LZW, lzw, "more than the 12 bytes that its rows have");
    check_strip(ZSTD, zstd::encode_all(&zeroes[..], 1).unwrap(), "more than the 12 bytes that its rows have");
}

#[test]
fn a_strip_of_far_more_bytes_than_its_file_is_refused_before_anything_is_decoded() {
    let folder = Folder::new();
    let of_side = |side: u32| {
        let tiff = Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]).with(256, Values::Long(vec![side]));
        let tiff = tiff.with(257, Values::Long(vec![side])).with(278, Values::Long(vec![side]));
        let bytes = tiff.with(259, Values::Short(vec![8])).bytes();
        GeoTiff::open(&folder.write("wide.tif", &bytes), None).map(|file| file.rect().posts_wide())
    };
    assert_eq!(of_side(5700).unwrap(), 5700);
    let error = of_side(8192).unwrap_err().to_string();
    assert!(error.contains("too large: 134217728 bytes in a strip or tile, at most 671"), "{error}");
}

#[test]
fn packbits_whose_rows_are_longer_or_shorter_than_the_rasters_are_refused() {
    const PACKBITS: u16 = 32773;
    let folder = Folder::new();
    let sound = [[5, 1, 0, 2, 0, 3, 0], [5, 4, 0, 5, 0, 6, 0]].concat();
    let path = folder.write("sound.tif", &packed(PACKBITS, sound));
    let file = GeoTiff::open(&path, None).unwrap();
    assert_eq!(file.read(file.rect()).unwrap().range_m(), Some((1.0, 6.0)));
    // As many bytes in all, the first row two bytes longer and the second two shorter.
    check_strip(PACKBITS, [&[7, 1, 0, 2, 0, 3, 0, 4, 0][..], &[3, 5, 0, 6, 0]].concat(), "row 0 unpacks to 8 bytes");
    check_strip(PACKBITS, vec![5, 1, 0, 2, 0, 3, 0], "it unpacks to 6 bytes, expected the 12");
    check_strip(PACKBITS, vec![251, 1, 251, 2, 251, 3], "more than the 12 bytes");
}

#[test]
fn bytes_behind_the_end_of_a_gzip_file_are_told() {
    let folder = Folder::new();
    let mut whole = GzEncoder::new(Vec::new(), Compression::fast());
    whole.write_all(&vec![0; 1201 * 1201 * 2]).unwrap();
    let mut bytes = whole.finish().unwrap();
    let sound = folder.write("N35W117.hgt.gz", &bytes);
    assert!(DemFile::open(&sound, &Reading::AS_IT_SAYS).is_ok());
    bytes.extend(b"more");
    let error = DemFile::open(&folder.write("N35W118.hgt.gz", &bytes), &Reading::AS_IT_SAYS).unwrap_err().to_string();
    assert!(error.contains("the gzip file is more bytes after its end, expected one packed file"), "{error}");
}

#[test]
fn a_scale_of_nothing_is_refused() {
    let xml = "<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">0</Item></GDALMetadata>";
    let folder = Folder::new();
    let tiff = Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]).with(42112, Values::Text(xml));
    let error = GeoTiff::open(&folder.write("flat.tif", &tiff.bytes()), None).unwrap_err().to_string();
    assert!(error.contains("the scale of the samples is 0, expected a number other than 0"), "{error}");
}

#[test]
fn an_archive_that_unpacks_without_end_is_too_large() {
    let folder = Folder::new();
    let mut bomb = GzEncoder::new(Vec::new(), Compression::fast());
    (0..260).for_each(|_| bomb.write_all(&[b' '; 1 << 20]).unwrap());
    let path = folder.write("n00e000.hgt.gz", &bomb.finish().unwrap());
    let error = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap_err();
    assert!(matches!(error, SourceError::TooLarge { limit: 0x1000_0000, .. }), "{error}");
}

#[test]
fn a_name_in_an_archive_leads_nowhere() {
    let folder = Folder::new();
    let path = folder.path("tile.zip");
    let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
    archive.start_file("../../N35W117.hgt", zip::write::SimpleFileOptions::default()).unwrap();
    archive.write_all(&vec![0; 1201 * 1201 * 2]).unwrap();
    archive.finish().unwrap();
    let file = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(file.frame().south_west, [-117.0, 35.0]);
    file.read(file.rect()).unwrap();
    let names: Vec<_> =
        std::fs::read_dir(path.parent().unwrap()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["tile.zip"], "nothing is ever unpacked to the disk");
}

#[test]
fn a_geoid_grid_of_sizes_that_overflow_is_no_grid() {
    let folder = Folder::new();
    // Found by fuzzing: rows times columns times four bytes went past 64 bits.
    let header: Vec<u8> = [-90.0, -180.0, 10.0, 10.0_f64].iter().flat_map(|number| number.to_be_bytes()).collect();
    let bytes = [header, vec![0xf0, 0, 0, 0xc1, 0xf0, 0, 0, 0xc1]].concat();
    assert!(Geoid::read(&folder.write("huge.gtx", &bytes), 34.0, 36.0).is_err());
}

#[test]
fn text_headers_with_numbers_that_are_none_are_refused() {
    let folder = Folder::new();
    let refused = |size: &str, cell: &str| {
        let text = format!("{size}\nxllcorner 500000\nyllcorner 4000000\ncellsize {cell}\n1 2 3 4\n");
        let path = folder.write("a.asc", text.as_bytes());
        folder.write("a.prj", br#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#);
        DemFile::open(&path, &Reading::AS_IT_SAYS).and_then(|file| file.read(file.rect())).unwrap_err().to_string()
    };
    assert!(refused("ncols 2\nnrows 2", "NaN").contains("the place of the raster"));
    assert!(refused("ncols 2\nnrows 2", "-30").contains("the place of the raster"));
    assert!(refused("ncols 2\nnrows 2", "1e400").contains("cellsize"));
    assert!(refused("ncols 4294967295\nnrows 2", "30").contains("posts a side"));
    assert!(refused("ncols 1000000\nnrows 1000000", "30").contains("too large"));
    assert!(refused("ncols 2\nnrows 3", "30").contains("truncated: the last number"));
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
