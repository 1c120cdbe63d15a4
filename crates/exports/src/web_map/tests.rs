//! Whole files, read by other means than they were written with.

use std::io::Cursor;

use rusqlite::Connection;

use super::*;
use crate::samples;

const MAP: WebMap = WebMap { encoding: HeightEncoding::Mapbox, pixels: 256 };

/// Red, green and blue of each pixel.
fn pixels(bytes: &[u8]) -> Vec<[u8; 3]> {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut colors = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut colors).unwrap();
    colors.chunks(3).map(|color| color.try_into().unwrap()).collect()
}

#[test]
fn a_pixel_has_the_height_of_the_triangle_under_its_middle_or_that_of_outside() {
    for product in [samples::product(), samples::with_hole()] {
        let tiles = samples::with_work(|work| Pyramid::of(&product, MAP).unwrap().tiles(work)).unwrap();
        let earth = Earth::new(&product, None).unwrap();
        let (mut of_ground, mut outside) = (0, 0);
        for (square, bytes) in &tiles {
            let count = f64::from(1_u32 << square.level);
            for (number, [red, green, blue]) in pixels(bytes).into_iter().enumerate() {
                let (line, col) = (number / 256, number % 256);
                let at = [(square.col, col), (square.row, line)]
                    .map(|(tile, pixel)| (f64::from(tile) + (pixel as f64 + 0.5) / 256.0) / count);
                let found_m =
                    -10_000.0 + 0.1 * (65_536.0 * f64::from(red) + 256.0 * f64::from(green) + f64::from(blue));
                let ground = TriangleIndex::new(&product).at(earth.place_m(lon_lat(at)).unwrap());
                let expected_m = ground.filter(|ground| ground.class != HOLE_CLASS).map(|ground| ground.height_m);
                assert!((found_m - expected_m.unwrap_or(0.0)).abs() <= 0.05 + 1e-9, "{square:?} {line} {col}");
                match expected_m {
                    Some(_) => of_ground += 1,
                    None => outside += 1,
                }
            }
        }
        assert!(500 < of_ground && 500 < outside, "{of_ground} {outside}");
    }
}

#[test]
fn mbtiles_count_rows_from_the_south_and_say_how_heights_are_encoded() {
    let product = samples::product();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mbtiles");
    samples::with_work(|work| write_web_mbtiles(&path, &product, MAP, work)).unwrap();
    let tiles = samples::with_work(|work| Pyramid::of(&product, MAP).unwrap().tiles(work)).unwrap();
    let connection = Connection::open(&path).unwrap();
    let count: i64 = connection.query_row("SELECT count(*) FROM tiles", [], |row| row.get(0)).unwrap();
    assert_eq!(count as usize, tiles.len());
    for (square, bytes) in &tiles {
        let asked = "SELECT tile_data FROM tiles WHERE zoom_level = ?1 AND tile_column = ?2 AND tile_row = ?3";
        let row = (1 << square.level) - 1 - square.row;
        let found: Vec<u8> = connection.query_row(asked, [square.level, square.col, row], |row| row.get(0)).unwrap();
        assert_eq!(&found, bytes);
    }
    let said = |name: &str| -> String {
        connection.query_row("SELECT value FROM metadata WHERE name = ?1", [name], |row| row.get(0)).unwrap()
    };
    assert_eq!((said("format"), said("encoding"), said("tile_size")), ("png".into(), "mapbox".into(), "256".into()));
    assert_eq!(said("bounds").split(',').count(), 4);
    assert_eq!(said("minzoom").parse::<u32>().unwrap(), tiles[0].0.level);
}

#[test]
fn an_archive_has_a_header_its_tiles_in_order_and_the_same_bytes_every_time() {
    let product = samples::product();
    let archive = || {
        let mut out = Cursor::new(Vec::new());
        samples::with_work(|work| write_pmtiles(&mut out, &product, MAP, work)).unwrap();
        out.into_inner()
    };
    let bytes = archive();
    assert_eq!(bytes, archive());
    let tiles = samples::with_work(|work| Pyramid::of(&product, MAP).unwrap().tiles(work)).unwrap();
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    // Version 3, tiles in order, of PNG.
    assert_eq!((&bytes[..7], bytes[7], bytes[96], bytes[99]), (&b"PMTiles"[..], 3, 1, 2));
    assert_eq!((bytes[100], bytes[101]), (tiles[0].0.level as u8, tiles[tiles.len() - 1].0.level as u8));
    assert_eq!(number(72), tiles.len() as u64, "tiles that are addressed");
    // They lie one behind the other.
    let mut at = number(56) as usize;
    for (_, tile) in &tiles {
        assert_eq!(&bytes[at..at + tile.len()], tile.as_slice());
        at += tile.len();
    }
}

#[test]
fn ground_beyond_the_end_of_web_mercator_is_refused() {
    let mut product = samples::product();
    product.manifest.area.crs = "EPSG:3413".into();
    product.manifest.area.origin_m = [100_000.0, -300_000.0];
    let error = Pyramid::of(&product, MAP).err().unwrap();
    assert!(error.to_string().contains("where web mercator ends"), "{error}");
    let error = Pyramid::of(&samples::product(), WebMap { pixels: 300, ..MAP }).err().unwrap();
    assert!(error.to_string().contains("found 300 pixels, expected 256 or 512"), "{error}");
}

#[test]
fn the_world_is_a_square_and_places_come_back() {
    assert_eq!(on_map([-180.0, 0.0]), [0.0, 0.5]);
    assert!(on_map([0.0, LATITUDE_MAX])[1].abs() < 1e-12);
    let back = lon_lat(on_map([-116.5, 35.25]));
    assert!((back[0] + 116.5).abs() < 1e-12 && (back[1] - 35.25).abs() < 1e-12);
}

#[test]
fn levels_go_from_one_tile_to_pixels_no_larger_than_posts() {
    let extent = Extent::of(&[[-116.9, 35.0], [-116.4, 35.4]]);
    let finest = extent.finest_level(512, 25.0);
    assert_eq!((extent.coarsest_level(finest), finest), (9, 12));
    let [cols, rows] = extent.tiles(9);
    assert!(cols.count() <= 2 && rows.count() <= 2);
    // Smaller than a pixel is still in some tile.
    let dot = Extent::of(&[[10.0, 10.0], [10.000_001, 10.000_001]]);
    assert_eq!(dot.coarsest_level(dot.finest_level(256, 25.0)), 13);
}

#[test]
fn a_colour_is_within_half_a_step_of_its_height() {
    assert_eq!(HeightEncoding::Mapbox.color(0.0), [1, 134, 160]);
    assert_eq!(HeightEncoding::Terrarium.color(0.0), [128, 0, 0]);
    for height_m in [-430.5, -0.04, 0.0, 0.051, 1234.5678, 8848.86] {
        let [red, green, blue] = HeightEncoding::Mapbox.color(height_m).map(f64::from);
        let back = -10_000.0 + 0.1 * (65_536.0 * red + 256.0 * green + blue);
        assert!((back - height_m).abs() <= 0.05 + 1e-9, "{height_m}: {back}");
        let [red, green, blue] = HeightEncoding::Terrarium.color(height_m).map(f64::from);
        let back = 256.0 * red + green + blue / 256.0 - 32_768.0;
        assert!((back - height_m).abs() <= 0.5 / 256.0 + 1e-9, "{height_m}: {back}");
    }
}
