//! Rasters in degrees that lie together only once longitudes come around.

use source_files::{
    Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Patch, Raster, Standing, WideMosaic, Windows, edge_steps,
};
use terrain::{GridFrame, PostRect, Resampling};

use crate::mosaics::open;
use crate::support::{Folder, Tiff, Values, grid};

const RULES: MosaicRules = MosaicRules {
    resampling: Resampling::Bilinear,
    feather_m: 0.0,
    voids: MosaicVoids { next_source: true, fill_within: 0 },
};
/// The southern row of every raster here.
const SOUTH: f64 = -16.55;
/// Every three seconds.
const STEP: f64 = 1.0 / 1200.0;

/// Hills that are the same a turn on.
fn hills(longitude: f64, latitude: f64) -> f64 {
    300.0 + 200.0 * (longitude.to_radians() * 5000.0).sin() + 4000.0 * (latitude - SOUTH)
}

/// A raster in degrees whose south-west post lies at `west`; its heights are those of hills and `more` metres.
fn raster(folder: &Folder, name: &str, (west, step): (f64, f64), (cols, rows): (u32, u32), more: f64) -> DemFile {
    let row = |row: u32| -> Vec<f32> {
        let height = |col: u32| hills(west + f64::from(col) * step, SOUTH + f64::from(row) * step) + more;
        (0..cols).map(|col| height(col) as f32).collect()
    };
    let rows: Vec<Vec<f32>> = (0..rows).rev().map(row).collect();
    let tie = vec![0.0, 0.0, 0.0, west, SOUTH + (rows.len() - 1) as f64 * step, 0.0];
    let tiff = Tiff::of_floats(&rows.iter().map(Vec::as_slice).collect::<Vec<_>>())
        .with_keys(&[(1024, 2), (1025, 2), (2048, 4326)])
        .with(33922, Values::Double(tie))
        .with(33550, Values::Double(vec![step, step, 0.0]));
    open(&folder.write(name, &tiff.bytes()))
}

/// Three kilometres by 1500 m, every 25 m, with a meridian through the middle.
fn area(epsg: u32, longitude: f64) -> (Crs, GridFrame, PostRect) {
    let crs = Crs::from_epsg(epsg).unwrap();
    let [east, north] = Crs::wgs84().to(&crs, [longitude, SOUTH + 0.015]).unwrap().map(f64::round);
    (crs, grid(east - 1500.0, north - 750.0, 25.0), PostRect::of_size(61, 121))
}

fn read(files: &[DemFile], (crs, grid, rect): &(Crs, GridFrame, PostRect)) -> Vec<Raster> {
    files.iter().map(|file| file.read(file.window_reaching(crs, grid, *rect).unwrap()).unwrap()).collect()
}

/// What files are as one ground, held whole; and the same read by window, tile by tile, with what headers tell of it.
fn patch(files: &[DemFile], area: &(Crs, GridFrame, PostRect)) -> Patch {
    let (crs, grid, rect) = area;
    let patch = Mosaic::new(read(files, area), RULES, crs, grid, *rect).unwrap().resample(*rect);
    let used: Vec<(usize, f64)> = (0..files.len()).map(|file| (file, 0.0)).collect();
    let windows = Windows::new(files.to_vec(), 1 << 20);
    let wide = WideMosaic::new(windows, &used, RULES, (crs, grid, *rect)).unwrap();
    for (west, east) in [(0, 50), (50, 75), (75, 120)] {
        let part = PostRect { west, east, ..*rect };
        let (by_window, reached) = (wide.resample(part).unwrap(), wide.reached(part));
        for post in part.posts() {
            let (at, of_all) = (part.index(post), rect.index(post));
            assert_eq!(by_window.heights[at], patch.heights[of_all], "{post}");
            assert_eq!([by_window.standings[at], reached.standings[at]], [Standing::Height; 2], "{post}");
        }
    }
    patch
}

/// Two rasters that share the posts of a meridian, which the eastern one has at `east`, against one across it.
#[track_caller]
fn check(epsg: u32, meridian: f64, east: f64) {
    let folder = Folder::new();
    let files = |more: f64| {
        [
            raster(&folder, "west.tif", (meridian - 40.0 * STEP, STEP), (41, 41), 0.0),
            raster(&folder, "east.tif", (east, STEP), (41, 41), more),
        ]
    };
    let area = area(epsg, meridian);
    let across = [raster(&folder, "all.tif", (meridian - 40.0 * STEP, STEP), (81, 41), 0.0)];
    let expected = patch(&across, &area);
    let [west, east] = files(0.0);
    assert_eq!(patch(&[west.clone(), east.clone()], &area), expected);
    let found = patch(&[east, west], &area);
    let apart = found.heights.iter().zip(&expected.heights).map(|(found, expected)| found.abs_diff(*expected)).max();
    assert!(apart <= Some(1), "{apart:?} quanta from the other order");
    let steps = edge_steps(&read(&files(50.0), &area), (&area.0, &area.1, area.2), false);
    let [step] = &steps[..] else { panic!("one step is seen: {steps:?}") };
    assert!((step.height_m - 50.0).abs() < 1.0, "{step:?}");
}

#[test]
fn rasters_on_both_sides_of_a_meridian_are_one_however_their_longitudes_count() {
    check(32760, 180.0, -180.0);
    check(32701, 180.0, 180.0);
    check(32701, -180.0, 180.0);
    check(32731, 360.0, 0.0);
    check(32711, 242.0, -118.0);
    check(32711, -118.0, 242.0);
}

#[test]
fn ground_where_a_raster_of_the_whole_earth_begins_and_ends_is_that_of_its_ends() {
    let folder = Folder::new();
    let (crs, grid, rect) = area(32760, 180.0);
    let far = GridFrame { origin_east_m: grid.origin_east_m - 5000.0, ..grid };
    // A post every half a degree, with the first meridian once more at the end.
    let earth = [raster(&folder, "earth.tif", (-180.0, 0.5), (721, 3), 0.0)];
    let across = [raster(&folder, "across.tif", (179.0, 0.5), (5, 3), 0.0)];
    for grid in [grid, far] {
        let area = (crs.clone(), grid, rect);
        let (found, expected) = (patch(&earth, &area), patch(&across, &area));
        let apart =
            found.heights.iter().zip(&expected.heights).map(|(found, expected)| found.abs_diff(*expected)).max();
        assert!(apart <= Some(1), "{apart:?} quanta");
    }
}
