//! Real files, where the folder of shared terrain exists.

use std::path::PathBuf;

use source_files::{GeoTiff, SourceError};
use terrain::Post;

use crate::support::read;

fn data(file: &str) -> Option<PathBuf> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data").to_string();
    let path = PathBuf::from(std::env::var("TIEFORT_DATA").unwrap_or(default)).join(file);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}

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
        assert_eq!(found.frame().south_west_m, expected.frame().south_west_m, "{name}");
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
    assert_eq!((raster.frame().epsg, raster.frame().cols, raster.frame().rows), (32632, 1979, 1979));
}

#[test]
fn geographic_rasters_and_those_that_lie_nowhere_are_refused_by_name() {
    let Some(path) = data("formats/geotiff/native/zh_dem_25.tif") else { return };
    assert!(matches!(GeoTiff::open(&path, None), Err(SourceError::NoCrs { .. })));
    let rainier = path.with_file_name("mt_rainier_1201x1201_3arcsec.tif");
    assert!(matches!(GeoTiff::open(&rainier, None), Err(SourceError::Geographic { .. })));
}
