//! What is read from sound files, and that what is written comes back.

use std::fs::File;

use source_files::{GeoTiff, VoidPolicy, write_classes, write_heights};
use terrain::{Dem, Post, PostRect};

use crate::support::{Folder, Tiff, Values, grid, read, read_tiff};

const ROWS: [&[i16]; 3] = [&[31, 32, 33, 34], &[21, 22, 23, 24], &[11, 12, 13, -14]];

fn samples(tiff: &Tiff) -> Vec<Vec<f64>> {
    let raster = read_tiff(tiff).unwrap();
    let rect = raster.window();
    let row = |row| (rect.west..=rect.east).map(|col| raster.sample(Post::new(row, col)).unwrap()).collect();
    (rect.south..=rect.north).map(row).collect()
}

#[test]
fn rows_are_turned_so_that_the_southern_one_comes_first() {
    let found = samples(&Tiff::of_heights(&ROWS));
    assert_eq!(found, [[11.0, 12.0, 13.0, -14.0], [21.0, 22.0, 23.0, 24.0], [31.0, 32.0, 33.0, 34.0]]);
}

#[test]
fn both_byte_orders_give_the_same_heights() {
    let mut big = Tiff::of_heights(&ROWS);
    big.big_endian = true;
    big.samples.chunks_mut(2).for_each(<[u8]>::reverse);
    assert_eq!(samples(&big), samples(&Tiff::of_heights(&ROWS)));
}

#[track_caller]
fn check_south_west(tiff: Tiff, expected_m: [f64; 2], spacing_m: [f64; 2]) {
    let raster = read_tiff(&tiff).unwrap();
    assert_eq!((raster.frame().south_west, raster.frame().spacing), (expected_m, spacing_m));
}

#[test]
fn a_post_is_the_centre_of_its_pixel_whatever_the_registration() {
    let area = Tiff::of_heights(&ROWS);
    check_south_west(area.clone(), [500_005.0, 3_999_975.0], [10.0, 10.0]);
    let keys = [(1024, 1), (1025, 2), (3072, 32611)];
    check_south_west(area.clone().with_keys(&keys), [500_000.0, 3_999_980.0], [10.0, 10.0]);
    let tie = vec![1.0, 2.0, 0.0, 500_010.0, 3_999_980.0, 0.0];
    check_south_west(area.with(33922, Values::Double(tie)), [500_005.0, 3_999_975.0], [10.0, 10.0]);
}

#[test]
fn a_transformation_along_the_axes_places_the_raster_and_may_begin_in_the_south() {
    let matrix = |north_step: f64| {
        let mut matrix = vec![0.0; 16];
        (matrix[0], matrix[3], matrix[5], matrix[7], matrix[15]) = (12.5, 1000.0, north_step, 2000.0, 1.0);
        Values::Double(matrix)
    };
    let tiff = Tiff::of_heights(&ROWS).without(33550).without(33922);
    check_south_west(tiff.clone().with(34264, matrix(-8.0)), [1006.25, 1980.0], [12.5, 8.0]);
    let south_first = tiff.with(34264, matrix(8.0));
    check_south_west(south_first.clone(), [1006.25, 2004.0], [12.5, 8.0]);
    assert_eq!(samples(&south_first)[0], [31.0, 32.0, 33.0, 34.0]);
}

#[test]
fn feet_scales_and_the_callers_unit_become_metres() {
    let range = |tiff: &Tiff| read_tiff(tiff).unwrap().range_m().unwrap();
    let tiff = Tiff::of_heights(&[&[100, 200]]);
    assert_eq!(range(&tiff), (100.0, 200.0));
    let feet = tiff.clone().with_keys(&[(1024, 1), (3072, 32611), (4099, 9002)]);
    assert_eq!(range(&feet), (100.0 * 0.3048, 200.0 * 0.3048));
    let xml = "<GDALMetadata><Item name=\"OFFSET\" sample=\"0\" role=\"offset\">1000</Item>\
               <Item name=\"SCALE\" sample=\"0\" role=\"scale\">0.5</Item></GDALMetadata>";
    assert_eq!(range(&tiff.clone().with(42112, Values::Text(xml))), (1050.0, 1100.0));
    let folder = Folder::new();
    let file = GeoTiff::open(&folder.write("dem.tif", &feet.bytes()), Some(0.1)).unwrap();
    assert_eq!(file.read(file.rect()).unwrap().range_m(), Some((10.0, 20.0)));
}

#[test]
fn voids_are_what_equals_the_tag_and_what_is_no_number() {
    let tagged = Tiff::of_heights(&[&[5, -9999, 7]]).with(42113, Values::Text("-9999"));
    assert_eq!(read_tiff(&tagged).unwrap().void_count(), 1);
    let beyond = Tiff::of_heights(&[&[5, -9999, 7]]).with(42113, Values::Text("-99999"));
    assert_eq!(read_tiff(&beyond).unwrap().void_count(), 0);
    let lowest = Tiff::of_floats(&[&[1.0, f32::MIN, f32::NAN]]).with(42113, Values::Text("-3.40282347e+38"));
    assert_eq!(read_tiff(&lowest).unwrap().void_count(), 2);
    let nan = Tiff::of_floats(&[&[1.0, f32::NAN]]).with(42113, Values::Text("nan"));
    assert_eq!(read_tiff(&nan).unwrap().range_m(), Some((1.0, 1.0)));
}

/// Heights of every sort, voids among them when asked for.
fn rough(rect: PostRect, voids: bool) -> Dem {
    Dem::from_fn(rect, |post| {
        let mixed = (post.row * 7919 + post.col * 104_729) ^ (post.row * post.col);
        (!voids || mixed % 11 != 0).then_some(mixed.rem_euclid(33_000_000) - 16_500_000)
    })
}

#[test]
fn heights_written_come_back_to_the_quantum() {
    let folder = Folder::new();
    let path = folder.path("dem.tif");
    // Wide enough for three strips of it.
    let rect = PostRect::new(Post::new(-3, 5), Post::new(500, 1400));
    let (grid, whole) = (grid(500_000.0, 4_000_000.0, 31.25), rough(rect, false));
    write_heights(&mut File::create(&path).unwrap(), &grid, rect, 32611, |band| whole.window(band)).unwrap();
    let raster = read(&path).unwrap();
    assert_eq!(raster.frame().crs.epsg().unwrap(), 32611);
    assert_eq!(raster.frame().south_west, grid.place_m(rect.south_west()));
    assert_eq!(raster.resample(&grid, rect).unwrap(), whole);
}

#[test]
fn voids_written_come_back_as_voids() {
    let folder = Folder::new();
    let (rect, grid) = (PostRect::of_size(40, 50), grid(0.0, 0.0, 25.0));
    let whole = rough(rect, true);
    write_heights(&mut File::create(folder.path("dem.tif")).unwrap(), &grid, rect, 32611, |band| whole.window(band))
        .unwrap();
    let mut raster = read(&folder.path("dem.tif")).unwrap();
    assert_eq!(raster.settle_voids(VoidPolicy::Hole).unwrap().left, whole.void_count());
    let dem = raster.resample(&grid, rect).unwrap();
    for row in 0..40 {
        for post in (0..50).map(|col| Post::new(row, col)) {
            assert_eq!(dem.is_void(post), whole.is_void(post));
            assert!(dem.is_void(post) || dem.height(post) == whole.height(post));
        }
    }
}

#[test]
fn classes_written_come_back() {
    let folder = Folder::new();
    let (rect, grid) = (PostRect::of_size(30, 20), grid(500_000.0, 4_000_000.0, 25.0));
    let class = |post: Post| (post.row * 3 + post.col) as u8;
    let classes = |band: PostRect| {
        (band.south..=band.north)
            .flat_map(|row| (band.west..=band.east).map(move |col| class(Post::new(row, col))))
            .collect()
    };
    write_classes(&mut File::create(folder.path("class.tif")).unwrap(), &grid, rect, 32611, classes).unwrap();
    let raster = read(&folder.path("class.tif")).unwrap();
    assert_eq!(raster.sample(Post::new(29, 19)), Some(f64::from(class(Post::new(29, 19)))));
    assert_eq!(raster.sample(Post::new(0, 7)), Some(7.0));
}
