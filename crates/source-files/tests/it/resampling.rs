//! From the raster's posts to the working grid's, and what becomes of voids.

use source_files::{GeoTiff, Raster, SourceError, VoidPolicy, VoidSummary, window_under};
use terrain::{Post, PostRect, Side};

use crate::support::{Folder, Tiff, Values, grid, read_tiff};

/// 12 x 9 posts at 10 m whose south-west post lies at (500005, 3999915); `height(row, col)` from the south.
fn tiff_of(height: impl Fn(i32, i32) -> i16) -> Tiff {
    let rows: Vec<Vec<i16>> = (0..9).rev().map(|row| (0..12).map(|col| height(row, col)).collect()).collect();
    let rows: Vec<&[i16]> = rows.iter().map(Vec::as_slice).collect();
    Tiff::of_heights(&rows).with(42113, Values::Text("-1"))
}

const SOUTH_WEST: (f64, f64) = (500_005.0, 3_999_915.0);

fn raster(height: impl Fn(i32, i32) -> i16) -> Raster {
    read_tiff(&tiff_of(height)).unwrap()
}

fn bumpy(row: i32, col: i32) -> i16 {
    ((row * 31 + col * 17) % 23 * 40) as i16
}

#[test]
fn posts_that_coincide_are_copied_exactly_wherever_the_grid_begins() {
    let raster = raster(bumpy);
    // A millimetre off is floating-point noise of arithmetic, not a place of its own.
    for noise_m in [0.0, 1.0e-5, -1.0e-5] {
        let grid = grid(SOUTH_WEST.0 - 20.0 + noise_m, SOUTH_WEST.1 + 10.0, 10.0);
        let rect = PostRect::new(Post::new(0, 2), Post::new(7, 13));
        let dem = raster.resample(&grid, rect).unwrap();
        for row in 0..=7 {
            for col in 2..=13 {
                assert_eq!(dem.height(Post::new(row, col)), i32::from(bumpy(row + 1, col - 2)) * 128);
            }
        }
    }
}

#[test]
fn a_sloping_plane_stays_the_same_plane() {
    let raster = raster(|row, col| (100 + row * 20 - col * 10) as i16);
    let grid = grid(SOUTH_WEST.0 + 1.25, SOUTH_WEST.1 + 2.5, 6.25);
    let dem = raster.resample(&grid, PostRect::of_size(12, 16)).unwrap();
    for row in 0..12 {
        for col in 0..16 {
            let (north, east) = (f64::from(row) * 0.625 + 0.25, f64::from(col) * 0.625 + 0.125);
            let expected = ((100.0 + north * 20.0 - east * 10.0) * 128.0_f64).round() as i32;
            // Places are rounded to 1/65536 of a post, so a tie may fall on either side.
            assert!((dem.height(Post::new(row, col)) - expected).abs() <= 1, "{row},{col}");
        }
    }
}

#[test]
fn a_window_of_the_grid_equals_the_same_posts_of_the_whole() {
    let folder = Folder::new();
    let path =
        folder.write("dem.tif", &tiff_of(|row, col| if col == 6 && row < 5 { -1 } else { bumpy(row, col) }).bytes());
    let file = GeoTiff::open(&path, None).unwrap();
    let mut raster = file.read(file.rect()).unwrap();
    raster.settle_voids(VoidPolicy::Hole).unwrap();
    let grid = grid(SOUTH_WEST.0 + 3.0, SOUTH_WEST.1 + 1.0, 7.5);
    let whole = raster.resample(&grid, PostRect::of_size(10, 14)).unwrap();
    for (south, west, north, east) in [(0, 0, 3, 3), (2, 5, 9, 13), (4, 4, 4, 4)] {
        let rect = PostRect::new(Post::new(south, west), Post::new(north, east));
        assert_eq!(raster.resample(&grid, rect).unwrap(), whole.window(rect));
        let needed = window_under(file.frame(), &grid, rect).unwrap();
        let mut part = file.read(needed).unwrap();
        if part.void_count() == 0 {
            part.settle_voids(VoidPolicy::Fail).unwrap();
            assert_eq!(part.resample(&grid, rect).unwrap(), whole.window(rect));
        }
    }
}

#[test]
fn a_void_spreads_only_as_far_as_its_weight() {
    let mut raster = raster(|row, col| if (row, col) == (4, 4) { -1 } else { 100 });
    assert_eq!(raster.settle_voids(VoidPolicy::Hole).unwrap(), VoidSummary { filled: 0, left: 1 });
    let aligned = raster.resample(&grid(SOUTH_WEST.0, SOUTH_WEST.1, 10.0), PostRect::of_size(9, 12)).unwrap();
    assert_eq!(aligned.void_count(), 1);
    assert!(aligned.is_void(Post::new(4, 4)));
    assert_eq!(aligned.height(Post::new(4, 4)), 12800, "a void is filled so that the mesh stays defined");
    let halves = raster.resample(&grid(SOUTH_WEST.0, SOUTH_WEST.1, 5.0), PostRect::of_size(17, 23)).unwrap();
    assert_eq!(halves.void_count(), 9);
    assert!(halves.is_void(Post::new(7, 9)) && !halves.is_void(Post::new(6, 8)));
}

fn holed(row: i32, col: i32) -> i16 {
    if (2..=5).contains(&row) && (3..=6).contains(&col) { -1 } else { (row * 100) as i16 }
}

#[test]
fn voids_fail_unless_the_job_says_otherwise() {
    let mut raster = raster(holed);
    let error = raster.settle_voids(VoidPolicy::Fail).unwrap_err();
    assert!(matches!(error, SourceError::Voids { found: 16, .. }), "{error}");
}

#[test]
fn voids_near_enough_are_filled_smoothly_and_counted() {
    let mut raster = raster(holed);
    let summary = raster.settle_voids(VoidPolicy::FillWithin(2)).unwrap();
    assert_eq!(summary, VoidSummary { filled: 16, left: 0 });
    let dem = raster.resample(&grid(SOUTH_WEST.0, SOUTH_WEST.1, 10.0), PostRect::of_size(9, 12)).unwrap();
    assert_eq!(dem.void_count(), 0);
    for row in 2..=5 {
        for col in 3..=6 {
            let off_m = f64::from(dem.height(Post::new(row, col))) / 128.0 - f64::from(row * 100);
            assert!(off_m.abs() <= 2.0, "{row},{col} is {off_m} m off the plane around the gap");
        }
    }
}

#[test]
fn voids_too_far_from_any_height_are_an_error() {
    let error = raster(holed).settle_voids(VoidPolicy::FillWithin(1)).unwrap_err();
    assert!(matches!(error, SourceError::VoidsTooFar { found: 4, limit: 1, .. }), "{error}");
}

#[test]
fn nothing_but_voids_is_an_error_under_every_policy() {
    for policy in [VoidPolicy::Fail, VoidPolicy::FillWithin(50), VoidPolicy::Hole] {
        let error = raster(|_, _| -1).settle_voids(policy).unwrap_err();
        assert!(matches!(error, SourceError::AllVoid { found: 108, .. }), "{error}");
    }
}

#[test]
fn an_area_the_raster_does_not_reach_names_the_sides_and_the_metres() {
    let raster = raster(bumpy);
    let check = |east_m: f64, north_m: f64, expected: &[(Side, f64)]| {
        let grid = grid(SOUTH_WEST.0 + east_m, SOUTH_WEST.1 + north_m, 10.0);
        match raster.resample(&grid, PostRect::of_size(9, 12)) {
            Err(SourceError::NotCovered { missing, .. }) => assert_eq!(missing, expected),
            other => panic!("expected a raster that does not reach, got {other:?}"),
        }
    };
    check(30.0, 0.0, &[(Side::East, 30.0)]);
    check(-0.5, -20.0, &[(Side::South, 20.0), (Side::West, 0.5)]);
    check(0.0, 5.0, &[(Side::North, 5.0)]);
    let close = grid(SOUTH_WEST.0 + 0.009, SOUTH_WEST.1 - 0.009, 10.0);
    assert!(raster.resample(&close, PostRect::of_size(9, 12)).is_ok(), "a thousandth of a post is noise");
}
