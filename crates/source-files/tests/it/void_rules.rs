//! Every rule for voids on voids of every width: what marks a void never becomes a height, nor part of one.

use source_files::{DemFile, MosaicRules, MosaicVoids, Patch, Raster, SourceError, Standing, VoidPolicy, window_under};
use terrain::{GridFrame, PostRect, Resampling};

use crate::mosaics::{PLAIN, mosaic, open};
use crate::support::{Folder, Tiff, Values, grid};
use crate::windows::wide;

const COLS: i32 = 96;
const ROWS: i32 = 64;
const MARK: i16 = i16::MIN;
/// Between what the heights of every raster here lie, in quanta of 1/128 m.
const LOWEST: i32 = 100 * 128;
const HIGHEST: i32 = 197 * 128;

/// Rough ground with a void `width` posts wide from row 8 up, off the middle.
fn holed(width: i32) -> impl Fn(i32, i32) -> i16 {
    move |row, col| match (8..8 + width).contains(&row) && (30..30 + width).contains(&col) {
        true => MARK,
        false => 100 + ((row * 7 + col * 13) % 98).min(97) as i16,
    }
}

/// A raster with its south-west post at (`east`, 4000000), and -32768 as the mark of a void.
fn write(folder: &Folder, name: &str, east: f64, as_float: bool, height: impl Fn(i32, i32) -> i16) -> DemFile {
    let rows: Vec<Vec<i16>> =
        (0..ROWS).rev().map(|row| (0..COLS).map(|col| height(row, col)).collect::<Vec<i16>>()).collect();
    let north = 4.0e6 + f64::from(ROWS - 1) * 10.0 + 5.0;
    let tie = Values::Double(vec![0.0, 0.0, 0.0, east - 5.0, north, 0.0]);
    let tiff = match as_float {
        false => {
            let rows: Vec<&[i16]> = rows.iter().map(Vec::as_slice).collect();
            Tiff::of_heights(&rows).with(42113, Values::Text("-32768"))
        }
        true => {
            let number = |height: &i16| if *height == MARK { -3.4e38 } else { f32::from(*height) };
            let rows: Vec<Vec<f32>> = rows.iter().map(|row| row.iter().map(number).collect()).collect();
            let rows: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
            Tiff::of_floats(&rows).with(42113, Values::Text("-3.4e38"))
        }
    };
    open(&folder.write(name, &tiff.with(33922, tie).bytes()))
}

#[track_caller]
fn check_patch(patch: &Patch, told: &str) {
    let dem = patch.dem();
    assert!(LOWEST <= dem.range().0 && dem.range().1 <= HIGHEST, "{told}: {:?} quanta", dem.range());
}

/// Every rule of a mosaic.
fn all_rules() -> impl Iterator<Item = MosaicRules> {
    let voids = [false, true]
        .into_iter()
        .flat_map(|next_source| [0, 1, 2, 5, 8, 40].map(|fill_within| MosaicVoids { next_source, fill_within }));
    voids.flat_map(|voids| {
        [Resampling::Bilinear, Resampling::Cubic]
            .into_iter()
            .flat_map(move |resampling| [0.0, 150.0].map(|feather_m| MosaicRules { resampling, feather_m, voids }))
    })
}

fn check_files(files: &[DemFile], told: &str) {
    // Off the posts of the files, and beyond their eastern edge.
    let frames = [grid(500_000.0, 4.0e6, 10.0), grid(500_003.0, 4_000_004.0, 12.5)];
    for (rules, frame) in all_rules().flat_map(|rules| frames.map(|frame| (rules, frame))) {
        let rect = PostRect::of_size(40, 80);
        let told = format!("{told}, {rules:?}, {frame:?}");
        check_patch(&mosaic(files, rules, &frame, rect).unwrap().resample(rect), &told);
        check_patch(&wide(files, rules, &frame, rect).resample(rect).unwrap(), &format!("{told}, by window"));
    }
}

#[test]
fn no_rule_of_a_mosaic_lets_the_mark_of_a_void_into_a_height() {
    for width in [1, 2, 3, 4, 7, 8, 9, 16, 17, 18, 25, 40] {
        let folder = Folder::new();
        let as_float = width % 2 == 0;
        let first = write(&folder, "a.tif", 500_000.0, as_float, holed(width));
        // Continues the grid of the first; then one of another grid.
        let next = write(&folder, "b.tif", 500_000.0 + 10.0 * f64::from(COLS), as_float, holed(width));
        let other = write(&folder, "c.tif", 500_203.5, !as_float, holed(width / 2));
        check_files(std::slice::from_ref(&first), &format!("one source, {width} wide"));
        check_files(&[first.clone(), next], &format!("two of one grid, {width} wide"));
        check_files(&[first, other], &format!("two grids, {width} wide"));
    }
}

/// The raster under a working grid, its voids settled by a policy.
fn settled(file: &DemFile, frame: &GridFrame, rect: PostRect, policy: VoidPolicy) -> Result<Raster, SourceError> {
    let mut raster = file.read(window_under(file.frame(), frame, rect)?)?;
    raster.settle_voids(policy).map(|_| raster)
}

#[test]
fn no_policy_for_one_raster_lets_the_mark_of_a_void_into_a_height() {
    for width in 1..=40 {
        let folder = Folder::new();
        let file = write(&folder, "a.tif", 500_000.0, width % 2 == 0, holed(width));
        let frame = grid(500_003.0, 4_000_004.0, 12.5);
        let rect = PostRect::of_size(40, 70);
        let limits = [1, 2, 5, 8, 19, 20, 40].map(VoidPolicy::FillWithin);
        for policy in limits.into_iter().chain([VoidPolicy::Fail, VoidPolicy::Hole]) {
            match (settled(&file, &frame, rect, policy), policy) {
                (Ok(raster), _) => {
                    let range = raster.resample(&frame, rect).unwrap().range();
                    assert!(LOWEST <= range.0 && range.1 <= HIGHEST, "{policy:?}, {width} wide: {range:?}");
                }
                (Err(SourceError::Voids { .. }), VoidPolicy::Fail) => {}
                (Err(SourceError::VoidsTooFar { .. }), VoidPolicy::FillWithin(posts)) => {
                    assert!(2 * (posts as i32) < width, "{posts} posts reach the middle of {width}");
                }
                (Err(error), _) => panic!("{policy:?}, {width} wide: {error}"),
            }
        }
    }
}

#[test]
fn a_filling_that_ends_inside_a_void_lies_between_the_heights_of_its_rim() {
    let folder = Folder::new();
    let plain = |row: i32, col: i32| if holed(30)(row, col) == MARK { MARK } else { 150 };
    let file = write(&folder, "a.tif", 500_000.0, false, plain);
    let (frame, rect) = (grid(500_000.0, 4.0e6, 10.0), PostRect::of_size(60, 90));
    let rules = MosaicRules { voids: MosaicVoids { next_source: false, fill_within: 8 }, ..PLAIN };
    let patch = mosaic(&[file], rules, &frame, rect).unwrap().resample(rect);
    assert!(patch.standings.contains(&Standing::Filled) && patch.standings.contains(&Standing::Void));
    assert!(patch.heights.iter().all(|&height| height == 150 * 128), "level ground stays level in and around a void");
}

#[test]
fn a_smooth_surface_beside_a_cliff_is_never_higher_or_lower_than_the_posts_around_it() {
    let folder = Folder::new();
    let file = write(&folder, "a.tif", 500_000.0, false, |row, col| if row + col < 60 { 100 } else { 197 });
    let (frame, rect) = (grid(500_021.3, 4_000_023.1, 3.0), PostRect::of_size(150, 250));
    let rules = MosaicRules { resampling: Resampling::Cubic, ..PLAIN };
    check_patch(&mosaic(&[file], rules, &frame, rect).unwrap().resample(rect), "a cliff");
}
