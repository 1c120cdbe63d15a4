//! Rasters of other coordinate systems and several rasters on one working grid.

use std::path::{Path, PathBuf};

use source_files::{Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Patch, Reading, SourceError, Standing};
use terrain::{GridFrame, Post, PostRect, Resampling};

use crate::support::{Folder, Tiff, Values, grid};

pub const PLAIN: MosaicRules = MosaicRules {
    resampling: Resampling::Bilinear,
    feather_m: 0.0,
    voids: MosaicVoids { next_source: false, fill_within: 0 },
};

pub fn utm() -> Crs {
    Crs::from_epsg(32611).unwrap()
}

pub fn mosaic(files: &[DemFile], rules: MosaicRules, grid: &GridFrame, rect: PostRect) -> Result<Mosaic, SourceError> {
    let reaching = files.iter().filter_map(|file| Some((file, file.window_reaching(&utm(), grid, rect)?)));
    let rasters = reaching.map(|(file, window)| file.read(window)).collect::<Result<_, _>>()?;
    Mosaic::new(rasters, rules, &utm(), grid, rect)
}

pub fn open(path: &Path) -> DemFile {
    DemFile::open(path, &Reading { crs: None, ..Reading::AS_IT_SAYS }).unwrap()
}

// Registration: hills that are a function of place, written in every format, come back where they were.

/// Hills some 900 m across, 300 m high, on a slope.
fn hills(lon: f64, lat: f64) -> f64 {
    let wave = |degrees: f64, period: f64| (degrees / period * std::f64::consts::TAU).sin();
    600.0 + 150.0 * wave(lon, 0.0103) * wave(lat, 0.0081) + 4000.0 * (lat - 35.5)
}

/// Heights in decimetres of a raster whose north-west post lies at `first`, the northern row first.
fn heights(crs: &Crs, first: [f64; 2], step: [f64; 2], (cols, rows): (u32, u32)) -> Vec<f64> {
    let places = (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col)));
    let place = |(row, col): (u32, u32)| {
        let at = [first[0] + f64::from(col) * step[0], first[1] - f64::from(row) * step[1]];
        crs.to(&Crs::wgs84(), at).unwrap()
    };
    places.map(place).map(|[lon, lat]| hills(lon, lat)).collect()
}

fn whole(heights: &[f64]) -> Vec<i16> {
    heights.iter().map(|height| height.round() as i16).collect()
}

/// Of a raster of one degree, its lower left corner at 117 W, 35 N.
fn in_degrees(seconds: f64, posts: u32) -> Vec<f64> {
    heights(&Crs::wgs84(), [-117.0, 36.0], [seconds / 3600.0; 2], (posts, posts))
}

pub fn write_hgt(folder: &Folder) -> PathBuf {
    let heights = whole(&in_degrees(3.0, 1201));
    folder.write("N35W117.hgt", &heights.iter().flat_map(|height| height.to_be_bytes()).collect::<Vec<u8>>())
}

pub fn write_dted(folder: &Folder) -> PathBuf {
    let heights = whole(&in_degrees(3.0, 1201));
    let mut bytes = b"UHL11170000W0350000N003000300005U  DT1         120112010".to_vec();
    bytes.resize(3428, b' ');
    bytes[80 + 144..80 + 149].copy_from_slice(b"WGS84");
    for col in 0..1201_usize {
        let mut record = vec![0xaa, 0, 0, 0, (col >> 8) as u8, col as u8, 0, 0];
        record.extend((0..1201).rev().flat_map(|row| heights[row * 1201 + col].to_be_bytes()));
        let sum: u32 = record.iter().map(|&byte| u32::from(byte)).sum();
        record.extend(sum.to_be_bytes());
        bytes.append(&mut record);
    }
    folder.write("n35.dt1", &bytes)
}

/// A text or raw header for a raster of 301 x 241 posts in UTM zone 11 at 30 m.
const HEADER: &str = "ncols 301\nnrows 241\nxllcenter 532000\nyllcenter 3929000\ncellsize 30\nNODATA_value -9999\n";

fn in_metres() -> Vec<f64> {
    heights(&utm(), [532_000.0, 3_929_000.0 + 240.0 * 30.0], [30.0; 2], (301, 241))
}

pub fn write_ascii(folder: &Folder) -> PathBuf {
    let numbers: String = in_metres().iter().map(|height| format!("{height:.2} ")).collect();
    folder.write("a.prj", br#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#);
    folder.write("a.asc", (HEADER.to_owned() + &numbers).as_bytes())
}

pub fn write_raw(folder: &Folder) -> PathBuf {
    folder.write("a.prj", br#"PROJCS["x",AUTHORITY["EPSG","32611"]]"#);
    folder.write("a.hdr", (HEADER.to_owned() + "byteorder LSBFIRST\n").as_bytes());
    folder.write("a.flt", &in_metres().iter().flat_map(|&height| (height as f32).to_le_bytes()).collect::<Vec<u8>>())
}

/// A GeoTIFF by its keys, its first post and its steps; pixels are areas or points.
pub fn write_tiff(folder: &Folder, crs: &Crs, keys: &[(u16, u16)], is_point: bool) -> PathBuf {
    let (first, step) = match crs.is_geographic() {
        true => ([-116.70, 35.60], [1.0 / 3600.0; 2]),
        false => (Crs::wgs84().to(crs, [-116.70, 35.60]).unwrap(), [30.0; 2]),
    };
    let heights: Vec<f32> = heights(crs, first, step, (521, 421)).iter().map(|&height| height as f32).collect();
    let rows: Vec<&[f32]> = heights.chunks(521).collect();
    let off = if is_point { 0.0 } else { 0.5 };
    let tie = vec![0.0, 0.0, 0.0, first[0] - off * step[0], first[1] + off * step[1], 0.0];
    let keys = [&[(1025, if is_point { 2 } else { 1 })], keys].concat();
    let tiff = Tiff::of_floats(&rows).with_keys(&keys).with(33922, Values::Double(tie));
    folder.write("a.tif", &tiff.with(33550, Values::Double(vec![step[0], step[1], 0.0])).bytes())
}

/// How far a patch is shifted against the hills, in posts east and north: least squares over its slopes.
fn shift(patch: &Patch, truth: &[f64]) -> [f64; 2] {
    let rect = patch.rect;
    let expected = |row: i32, col: i32| truth[row as usize * rect.posts_wide() + col as usize];
    let (mut a, mut b) = ([[0.0; 2]; 2], [0.0; 2]);
    for row in rect.south + 1..rect.north {
        for col in rect.west + 1..rect.east {
            let index = rect.index(Post::new(row, col));
            assert_eq!(patch.standings[index], Standing::Height, "{row},{col}");
            let slope = [
                (expected(row, col + 1) - expected(row, col - 1)) / 2.0,
                (expected(row + 1, col) - expected(row - 1, col)) / 2.0,
            ];
            let off = expected(row, col) - f64::from(patch.heights[index]) / 128.0;
            for i in 0..2 {
                b[i] += slope[i] * off;
                for j in 0..2 {
                    a[i][j] += slope[i] * slope[j];
                }
            }
        }
    }
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    [(b[0] * a[1][1] - b[1] * a[0][1]) / determinant, (b[1] * a[0][0] - b[0] * a[1][0]) / determinant]
}

#[track_caller]
fn check_registration(path: &Path) {
    let (grid, rect) = (grid(534_500.0, 3_930_000.0, 25.0), PostRect::of_size(181, 201));
    let first = [grid.origin_east_m, grid.north_m(rect.north)];
    let from_north = heights(&utm(), first, [25.0; 2], (201, 181));
    let truth: Vec<f64> = from_north.rchunks(201).flatten().copied().collect();
    for resampling in [Resampling::Bilinear, Resampling::Cubic] {
        let mosaic = mosaic(&[open(path)], MosaicRules { resampling, ..PLAIN }, &grid, rect).unwrap();
        let [east, north] = shift(&mosaic.resample(rect), &truth);
        assert!(east.abs() < 0.02 && north.abs() < 0.02, "{}: {east:.4}, {north:.4}", path.display());
    }
}

#[test]
fn every_format_is_registered_to_a_fiftieth_of_a_post() {
    for write in [write_hgt, write_dted, write_ascii, write_raw] {
        let folder = Folder::new();
        check_registration(&write(&folder));
    }
    let systems: [(Crs, &[(u16, u16)]); 4] = [
        (Crs::wgs84(), &[(1024, 2), (2048, 4326)]),
        (Crs::from_epsg(32612).unwrap(), &[(1024, 1), (3072, 32612)]),
        (Crs::from_epsg(5070).unwrap(), &[(1024, 1), (3072, 5070)]),
        (Crs::from_epsg(3857).unwrap(), &[(1024, 1), (3072, 3857)]),
    ];
    for (crs, keys) in systems {
        for is_point in [false, true] {
            let folder = Folder::new();
            check_registration(&write_tiff(&folder, &crs, keys, is_point));
        }
    }
}

// Several rasters.

/// 16-bit heights in UTM zone 11 at 10 m, its south-west post at `at`; -1 is void.
pub fn raster(
    folder: &Folder,
    name: &str,
    at: [f64; 2],
    size: (i32, i32),
    height: impl Fn(i32, i32) -> i16,
) -> DemFile {
    let rows: Vec<Vec<i16>> = (0..size.1).rev().map(|row| (0..size.0).map(|col| height(row, col)).collect()).collect();
    let rows: Vec<&[i16]> = rows.iter().map(Vec::as_slice).collect();
    let corner = [at[0] - 5.0, at[1] + f64::from(size.1 - 1) * 10.0 + 5.0];
    let tie = Values::Double(vec![0.0, 0.0, 0.0, corner[0], corner[1], 0.0]);
    let tiff = Tiff::of_heights(&rows).with(33922, tie).with(42113, Values::Text("-1"));
    open(&folder.write(name, &tiff.bytes()))
}

pub fn metres(patch: &Patch, row: i32, col: i32) -> (f64, Standing) {
    let index = patch.rect.index(Post::new(row, col));
    (f64::from(patch.heights[index]) / 128.0, patch.standings[index])
}

#[test]
fn neighbours_of_one_grid_are_one_raster_without_a_seam() {
    let folder = Folder::new();
    let height = |row: i32, col: i32| (row * 3 + col * 7) as i16;
    let files = [
        raster(&folder, "a.tif", [500_000.0, 4.0e6], (10, 12), height),
        raster(&folder, "b.tif", [500_100.0, 4.0e6], (10, 12), |row, col| height(row, col + 10)),
    ];
    let grid = grid(500_000.0, 4.0e6, 5.0);
    let rect = PostRect::of_size(23, 39);
    let mosaic = mosaic(&files, PLAIN, &grid, rect).unwrap();
    assert_eq!(mosaic.layer_count(), 1);
    let patch = mosaic.resample(rect);
    for row in 0..23 {
        for col in 0..39 {
            let expected = (f64::from(row) * 1.5 + f64::from(col) * 3.5, Standing::Height);
            assert_eq!(metres(&patch, row, col), expected, "{row},{col}");
        }
    }
}

#[test]
fn the_first_source_wins_and_the_next_gives_what_it_lacks() {
    let folder = Folder::new();
    let files = [
        raster(&folder, "a.tif", [500_000.0, 4.0e6], (10, 10), |row, col| if (row, col) == (4, 4) { -1 } else { 100 }),
        raster(&folder, "b.tif", [500_003.0, 4.0e6 + 3.0], (20, 20), |_, _| 200),
    ];
    let grid = grid(500_000.0, 4.0e6, 10.0);
    let rect = PostRect::of_size(20, 20);
    let patch = |voids| mosaic(&files, MosaicRules { voids, ..PLAIN }, &grid, rect).unwrap().resample(rect);
    let plain = patch(MosaicVoids { next_source: false, fill_within: 0 });
    assert_eq!(metres(&plain, 3, 3), (100.0, Standing::Height));
    assert_eq!(metres(&plain, 12, 12), (200.0, Standing::Height));
    assert_eq!(metres(&plain, 4, 4).1, Standing::Void);
    assert_eq!(metres(&plain, 0, 12).1, Standing::Gap, "the other begins three metres farther north");
    let next = patch(MosaicVoids { next_source: true, fill_within: 0 });
    assert_eq!(metres(&next, 4, 4), (200.0, Standing::Height));
    let filled = patch(MosaicVoids { next_source: false, fill_within: 1 });
    assert_eq!(metres(&filled, 4, 4), (100.0, Standing::Filled));
    let dem = plain.dem();
    assert!(dem.is_void(Post::new(4, 4)) && dem.is_void(Post::new(0, 12)) && !dem.is_void(Post::new(3, 3)));
    assert_eq!(dem.height(Post::new(4, 4)), 12_800, "a void has a height that keeps the mesh defined");
}

#[test]
fn a_feathered_source_fades_into_the_one_below() {
    let folder = Folder::new();
    let files = [
        raster(&folder, "a.tif", [500_000.0, 4.0e6], (41, 41), |_, _| 100),
        raster(&folder, "b.tif", [499_003.0, 3.999e6], (300, 300), |_, _| 200),
    ];
    let grid = grid(500_000.0, 4.0e6, 10.0);
    let rect = PostRect::of_size(41, 41);
    let patch = mosaic(&files, MosaicRules { feather_m: 100.0, ..PLAIN }, &grid, rect).unwrap().resample(rect);
    assert_eq!(metres(&patch, 20, 20).0, 100.0);
    assert_eq!(metres(&patch, 20, 5).0, 150.0);
    assert!(199.0 < metres(&patch, 20, 0).0);
    let alone = mosaic(&files[..1], MosaicRules { feather_m: 100.0, ..PLAIN }, &grid, rect).unwrap().resample(rect);
    assert_eq!(metres(&alone, 20, 0), (100.0, Standing::Height), "with nothing below there is nothing to fade into");
}

#[test]
fn a_window_of_a_mosaic_equals_the_same_posts_of_the_whole() {
    let folder = Folder::new();
    let crs = Crs::from_epsg(5070).unwrap();
    let bumpy =
        |row: i32, col: i32| if (row * 31 + col * 17) % 53 == 0 { -1 } else { ((row * 7 + col * 13) % 97) as i16 };
    let [east, north] = Crs::wgs84().to(&utm(), [-116.65, 35.51]).unwrap().map(|metres| (metres / 10.0).round() * 10.0);
    let files = [
        raster(&folder, "b.tif", [east + 1003.0, north + 807.0], (60, 50), bumpy),
        open(&write_tiff(&folder, &crs, &[(1024, 1), (3072, 5070)], false)),
    ];
    let grid = grid(east, north, 12.5);
    let rect = PostRect::of_size(150, 170);
    let rules = MosaicRules {
        resampling: Resampling::Cubic,
        feather_m: 80.0,
        voids: MosaicVoids { next_source: true, fill_within: 2 },
    };
    let mosaic = mosaic(&files, rules, &grid, rect).unwrap();
    let whole = mosaic.resample(rect);
    for (south, west, north, east) in [(0, 0, 3, 3), (17, 33, 90, 121), (149, 169, 149, 169), (64, 80, 80, 112)] {
        let part = PostRect::new(Post::new(south, west), Post::new(north, east));
        let patch = mosaic.resample(part);
        for row in south..=north {
            for col in west..=east {
                assert_eq!(metres(&patch, row, col), metres(&whole, row, col), "{row},{col}");
            }
        }
    }
}

#[test]
fn areas_have_the_same_heights_where_they_have_the_same_posts() {
    let folder = Folder::new();
    let files = [open(&write_hgt(&folder))];
    let rect = PostRect::of_size(241, 241);
    let patch = |east: f64, north: f64| mosaic(&files, PLAIN, &grid(east, north, 25.0), rect).unwrap().resample(rect);
    // 200 and 111 posts apart, which is no multiple of the posts between projected ones.
    let (one, other) = (patch(510_000.0, 3_900_000.0), patch(515_000.0, 3_902_775.0));
    for (row, col) in (0..=129).flat_map(|row| (0..=40).map(move |col| (row, col))) {
        assert_eq!(metres(&one, row + 111, col + 200), metres(&other, row, col), "{row},{col}");
    }
}

#[test]
fn posts_that_an_area_lies_among_reach_one_post_beyond_it() {
    let folder = Folder::new();
    let file = open(&write_hgt(&folder));
    // Rows run 0.4 degrees off those of the raster.
    let (grid, rect) = (grid(560_000.0, 3_900_000.0, 25.0), PostRect::of_size(401, 321));
    let raster = file.read(file.window_reaching(&utm(), &grid, rect).unwrap()).unwrap();
    let (frame, own) = (raster.frame(), raster.window());
    let range_within = |more_m: f64| {
        let posts = (own.south..=own.north).flat_map(|row| (own.west..=own.east).map(move |col| Post::new(row, col)));
        let is_inside = |post: &Post| {
            let at = [(0, post.col), (1, post.row)]
                .map(|(axis, at)| frame.south_west[axis] + f64::from(at) * frame.spacing[axis]);
            let [east, north] = frame.crs.to(&utm(), at).unwrap();
            let is_within = |off: f64, cells: f64| -more_m <= off && off <= 25.0 * cells + more_m;
            is_within(east - grid.origin_east_m, 320.0) && is_within(north - grid.origin_north_m, 400.0)
        };
        let heights = posts.filter(is_inside).map(|post| raster.height_m(post).unwrap());
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| (low.min(height), high.max(height)))
    };
    let (low, high) = raster.range_within_m(&file.reach(&utm(), &grid, rect)).unwrap();
    // Posts lie 76 and 93 m apart; a post across a corner lies farther off.
    let (least, most) = (range_within(0.0), range_within(125.0));
    assert!(low <= least.0 && least.1 <= high && most.0 <= low && high <= most.1, "{least:?} {low} {high} {most:?}");
    assert!(most != raster.range_m().unwrap() && (low, high) != raster.range_m().unwrap());
}

#[test]
fn a_raster_beyond_the_date_line_or_the_area_is_found_or_not() {
    let grid = grid(500_000.0, 3_929_000.0, 25.0);
    let rect = PostRect::of_size(41, 41);
    let folder = Folder::new();
    let near = open(&write_hgt(&folder));
    assert!(near.window_reaching(&utm(), &grid, rect).is_some());
    let far = Reading { corner: Some([17.0, -35.0]), ..Reading::AS_IT_SAYS };
    let far = DemFile::open(&folder.write("far", &vec![0; 1201 * 1201 * 2]), &far).unwrap();
    assert_eq!(far.window_reaching(&utm(), &grid, rect), None);
}
