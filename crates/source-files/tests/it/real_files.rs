//! Real files, where the folder of shared terrain exists.

use source_files::{Crs, DemFile, GeoTiff, Reading, SourceError};
use terrain::{Post, PostRect};

use crate::support::{data, read};

#[test]
fn every_way_of_storing_the_same_crop_gives_the_same_posts() {
    let Some(plain) = data("formats/geotiff/variants/strip1_i16_none.tif") else { return };
    let expected = read(&plain).unwrap();
    let names = [
        "strip16_i16_none_bigendian",
        "onestrip_i16_none",
        "strip_i16_lzw_pred2",
        "strip_i16_packbits",
        "tile256_i16_deflate_pred2",
        "tile512_i16_lzw",
        "bigtiff_tile128_i16_lzw",
        "pixelispoint_i16_deflate",
        "cog_i16_deflate_overviews",
    ];
    for name in names {
        let found = read(&plain.with_file_name(format!("{name}.tif"))).unwrap();
        assert_eq!(found.frame().south_west, expected.frame().south_west, "{name}");
        for row in 0..376 {
            for post in (0..460).map(|col| Post::new(row, col)) {
                assert_eq!(found.sample(post), expected.sample(post), "{name} at {post}");
            }
        }
    }
}

#[test]
fn tiles_left_out_of_a_sparse_file_are_void() {
    let Some(path) = data("formats/geotiff/variants/sparse_tile128_i16_nodata.tif") else { return };
    assert_eq!(read(&path).unwrap().void_count(), 875_616);
}

#[test]
fn the_alpine_raster_has_the_range_its_description_states() {
    let Some(path) = data("ntc_standin/bavarian_alps_50km_1979x1979_utm32n.tif") else { return };
    let raster = read(&path).unwrap();
    assert_eq!((raster.range_m(), raster.void_count()), (Some((524.0, 2079.0)), 0));
    assert_eq!((raster.frame().crs.epsg().unwrap(), raster.frame().cols, raster.frame().rows), (32632, 1979, 1979));
}

#[test]
fn geographic_rasters_and_those_that_lie_nowhere_are_refused_by_name() {
    let Some(path) = data("formats/geotiff/native/zh_dem_25.tif") else { return };
    assert!(matches!(GeoTiff::open(&path, None), Err(SourceError::NoCrs { .. })));
    let rainier = path.with_file_name("mt_rainier_1201x1201_3arcsec.tif");
    assert!(matches!(GeoTiff::open(&rainier, None), Err(SourceError::Geographic { .. })));
}

/// Range in metres, voids, size, and the place of the south-west post.
#[track_caller]
fn check(file: &str, range_m: (f64, f64), voids: usize, size: (u32, u32), south_west: [f64; 2]) {
    let Some(path) = data(file) else { return };
    let opened = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap();
    let raster = opened.read(opened.rect()).unwrap();
    assert_eq!((raster.range_m(), raster.void_count()), (Some(range_m), voids), "{file}");
    let frame = raster.frame();
    assert_eq!((frame.cols, frame.rows), size, "{file}");
    let off = (0..2).map(|axis| (frame.south_west[axis] - south_west[axis]).abs()).fold(0.0, f64::max);
    assert!(off < 1.0e-9, "{file} begins at {:?}", frame.south_west);
    assert_eq!(raster.notes(), [""; 0], "{file}");
    // A part read alone equals the same part of the whole.
    let part = PostRect::new(Post::new(7, 11), Post::new(60, 70));
    let alone = opened.read(part).unwrap();
    for row in part.south..=part.north {
        for post in (part.west..=part.east).map(|col| Post::new(row, col)) {
            assert_eq!(alone.sample(post), raster.sample(post), "{file} at {post}");
        }
    }
}

#[test]
fn each_format_has_the_range_voids_and_place_its_description_states() {
    check("formats/dted/w121/n36.dt1", (17.0, 1593.0), 55, (1201, 1201), [-121.0, 36.0]);
    check("formats/dted/e006/n00_e006_3arc_v2.dt1", (-7.0, 1979.0), 4072, (1201, 1201), [6.0, 0.0]);
    check("formats/dted/level0/w122/n36.dt0", (0.0, 1668.0), 0, (121, 121), [-122.0, 36.0]);
    check("formats/dted/e015/n42.dt2.gz", (-4.0, 114.0), 0, (3601, 3601), [15.0, 42.0]);
    check("formats/hgt/N44E005.hgt.gz", (32.0, 2757.0), 4822, (1201, 1201), [5.0, 44.0]);
    check("formats/hgt/N38W029.SRTMGL3.hgt.zip", (-4.0, 2304.0), 0, (1201, 1201), [-29.0, 38.0]);
    let rainier = "formats/geotiff/native/mt_rainier_1201x1201_3arcsec.tif";
    check(rainier, (263.0, 4371.0), 9033, (1201, 1201), [-122.0, 46.0]);
}

#[test]
fn a_dted_cell_states_its_datum_and_accuracy() {
    let Some(path) = data("formats/dted/w121/n36.dt1") else { return };
    let file = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap();
    assert_eq!((file.accuracy_m(), file.vertical_datum(), file.format()), (Some(5.0), Some("EGM96"), "DTED"));
}

#[test]
fn text_and_raw_copies_of_the_crop_hold_its_posts() {
    let Some(whole) = data("formats/geotiff/variants/strip1_i16_none.tif") else { return };
    let whole = read(&whole).unwrap();
    // The raw copies are of the crop before it was rounded to whole metres.
    let exact = read(&data("formats/geotiff/variants/strip_f32_lzw_nopred.tif").unwrap()).unwrap();
    let crs = Some(Crs::from_epsg(32612).unwrap());
    for name in ["formats/asciigrid/mackay_460x376.asc", "formats/raw/mackay_lsb.flt", "formats/raw/mackay_lsb.hdr"] {
        let path = data(name).unwrap();
        assert!(matches!(DemFile::open(&path, &Reading::AS_IT_SAYS), Err(SourceError::NoCrs { .. })), "{name}");
        let file = DemFile::open(&path, &Reading { crs: crs.clone(), ..Reading::AS_IT_SAYS }).unwrap();
        let found = file.read(file.rect()).unwrap();
        let expected = if name.ends_with(".asc") { &whole } else { &exact };
        assert_eq!(found.frame().south_west, expected.frame().south_west, "{name}");
        for row in 0..376 {
            for post in (0..460).map(|col| Post::new(row, col)) {
                assert_eq!(found.sample(post), expected.sample(post), "{name} at {post}");
            }
        }
    }
}

#[test]
fn a_format_that_is_not_read_is_named() {
    let Some(path) = data("formats/usgsdem/SainteHelens.dem.gz") else { return };
    let error = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap_err();
    assert!(error.to_string().contains("a USGS DEM, which is not read"), "{error}");
}
