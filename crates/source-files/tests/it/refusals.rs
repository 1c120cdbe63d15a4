//! Every kind of file that is not read has an error of its own, with what was found and a hint.

use source_files::SourceError;

use crate::support::{Folder, Tiff, UTM, Values, read, read_tiff};

fn tiff() -> Tiff {
    Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]])
}

#[track_caller]
fn check(tiff: Tiff, expected: &str) {
    let error = read_tiff(&tiff).expect_err("this file is refused");
    let message = error.to_string();
    assert!(message.contains(expected), "{message}");
    assert!(message.contains("dem.tif: "), "names the file: {message}");
    assert!(error.hint().is_some());
}

#[test]
fn files_that_lie_nowhere_are_refused() {
    check(tiff().without(34735), "no coordinate reference system");
    check(tiff().with_keys(&[(1024, 2), (2048, 4326)]), "malformed: the place of the raster is from 500005");
    let in_degrees = tiff().with(33550, Values::Double(vec![0.1, 0.1, 0.0]));
    let in_degrees = in_degrees.with(33922, Values::Double(vec![0.0, 0.0, 0.0, -117.0, 36.0, 0.0]));
    check(in_degrees.clone().with_keys(&[(1024, 2), (2048, 4326)]), "geographic (EPSG:4326)");
    check(in_degrees.with_keys(&[(2048, 4269)]), "geographic (EPSG:4269)");
    check(tiff().with_keys(&[(1024, 3)]), "geocentric");
    check(tiff().with_keys(&[(1024, 1), (3072, 32767)]), "defined by the file");
    check(tiff().with_keys(&[(1024, 1), (3072, 2229), (3076, 9003)]), "coordinates are in US survey feet");
    check(tiff().with_keys(&[(1024, 1), (3072, 32611), (4099, 9030)]), "heights are in units of code 9030");
    check(tiff().without(33550).without(33922), "no position");
    check(tiff().without(33550), "placed by 1 control points");
    check(tiff().with(33922, Values::Double(vec![0.0; 24])), "placed by 4 control points");
}

#[test]
fn places_that_are_none_are_malformed() {
    check(tiff().with(33550, Values::Double(vec![10.0, -10.0, 0.0])), "malformed: the pixel scale is 10 x -10");
    check(tiff().with(33550, Values::Double(vec![f64::NAN, 10.0, 0.0])), "malformed: the pixel scale");
    check(tiff().with(33922, Values::Double(vec![0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0])), "malformed: the place");
    check(tiff().with(33922, Values::Double(vec![0.0; 5])), "3 and 5 numbers");
    let rotated = [10.0, 2.0, 0.0, 0.0, 2.0, -10.0, 0.0, 0.0];
    let matrix = Values::Double([rotated, [0.0; 8]].concat());
    check(tiff().without(33550).without(33922).with(34264, matrix), "rotated or sheared (terms 10 2 2 -10)");
}

#[test]
fn samples_of_other_kinds_are_refused_by_name() {
    check(tiff().with(258, Values::Short(vec![12])), "samples are 12-bit signed");
    check(tiff().with(339, Values::Short(vec![3])), "samples are 16-bit floating point");
    check(tiff().with(277, Values::Short(vec![3])), "3 bands, expected 1");
    check(tiff().with(262, Values::Short(vec![3])), "a palette");
    check(tiff().with(262, Values::Short(vec![0])), "white is zero");
    check(tiff().with(266, Values::Short(vec![2])), "stored in reverse");
    check(tiff().with(254, Values::Long(vec![1])), "an overview or a mask");
    for (code, name) in [(34887, "LERC"), (7, "JPEG"), (34925, "LZMA"), (777, "777")] {
        check(tiff().with(259, Values::Short(vec![code])), &format!("compression {name}"));
    }
}

#[test]
fn files_that_ask_for_too_much_are_too_large_before_anything_is_allocated() {
    check(tiff().with(256, Values::Long(vec![u32::MAX])), "too large: 4294967295 posts a side");
    let sides = tiff().with(256, Values::Long(vec![1 << 20])).with(257, Values::Long(vec![1 << 20]));
    check(sides, "too large: 1099511627776 posts");
    let strip = tiff().with(256, Values::Long(vec![1 << 15])).with(257, Values::Long(vec![1 << 15]));
    check(strip.with(278, Values::Long(vec![u32::MAX])), "bytes in a strip or tile");
    let tiles = tiff().with(256, Values::Long(vec![1 << 12])).with(257, Values::Long(vec![1 << 12]));
    check(tiles.with(322, Values::Long(vec![1])).with(323, Values::Long(vec![1])), "strips or tiles");
}

#[test]
fn what_contradicts_itself_is_malformed() {
    check(tiff().with(256, Values::Long(vec![0])), "malformed: the width is 0");
    check(tiff().without(257), "malformed: the height is missing");
    check(tiff().with(278, Values::Long(vec![1])), "malformed");
    check(tiff().with(279, Values::Long(vec![11])), "malformed: the length of strip or tile 0 is 11, expected 12");
    check(tiff().with(273, Values::Long(vec![u32::MAX])), "truncated: strip or tile 0 of 1 ends at byte 4294967307");
    check(tiff().with(42113, Values::Text("none at all")), "malformed: the nodata tag is `none at all`");
    check(tiff().with(317, Values::Short(vec![2])), "malformed: the predictor");
    check(tiff().with(34735, Values::Short(UTM[..3].to_vec())), "no coordinate reference system");
}

#[test]
fn heights_that_are_none_are_refused_with_their_place() {
    let infinite = Tiff::of_floats(&[&[1.0, 2.0], &[3.0, f32::NEG_INFINITY]]);
    check(infinite, "an infinite height at 500015.0, 3999985.0 m");
    check(Tiff::of_floats(&[&[1.0, 2.0e6]]), "a height of 2000000 m, expected at most 131071 m");
}

#[test]
fn files_that_are_no_tiff_are_told_from_broken_ones() {
    let folder = Folder::new();
    let message = |bytes: &[u8]| read(&folder.write("x.tif", bytes)).unwrap_err().to_string();
    assert!(message(b"<html>").contains("not a TIFF: it begins with 3c 68 74 6d"));
    assert!(message(b"").contains("0 bytes in all"));
    assert!(message(b"II\x2a\0\x08\0\0\0").contains("truncated: the first directory"));
    assert!(matches!(read(&folder.path("missing.tif")), Err(SourceError::Open { .. })));
}

#[test]
fn another_coordinate_system_than_the_areas_is_refused() {
    let raster = read_tiff(&tiff()).unwrap();
    assert!(raster.frame().require_epsg(32611).is_ok());
    let error = raster.frame().require_epsg(32612).unwrap_err();
    assert!(error.to_string().contains("EPSG:32611, expected the area's EPSG:32612"), "{error}");
}
