//! The ground of a job from every side: by tile, by window, whole; with water, slopes and other datums.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use source_files::write_heights;
use tempfile::TempDir;
use terrain::{Post, Spacing};

use super::*;

/// 6 x 6 load modules of 500 m in 2 x 2 tiles, every 12.5 m.
fn job(folder: &Path, dem: &str, importance: &str) -> Job {
    let text = format!(
        "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [505000, 3875000]\nsize_m = [3000, 3000]\n\
         spacing_m = 12.5\n[dem]\n{dem}\n[importance]\n{importance}\n[tiles]\nrows = 2\ncolumns = 2\n"
    );
    Job::from_text(&text, &folder.join("job.toml")).unwrap()
}

/// A raster of the sample terrain every 25 m, 500 m larger than the area on each side.
fn write_raster(folder: &Path) {
    let spacing = Spacing::from_metres(25.0).unwrap();
    let frame = GridFrame { origin_east_m: 504_500.0, origin_north_m: 3_874_500.0, spacing };
    let rect = PostRect::of_size(161, 161);
    let heights = |band| sample_terrain::heights(1, band, spacing);
    write_heights(&mut std::fs::File::create(folder.join("dem.tif")).unwrap(), &frame, rect, 32611, heights).unwrap();
}

fn open(job: &Job, whole_bytes_max: u64) -> Result<(GamingArea, Ground), GroundError> {
    let area = GamingArea::new(job).unwrap();
    let ground = Ground::open_within(job, &area, (&Workers::new(2), &AtomicBool::new(false)), whole_bytes_max)?;
    Ok((area, ground))
}

fn message(result: Result<(GamingArea, Ground), GroundError>) -> String {
    match result {
        Ok(_) => panic!("this job is refused"),
        Err(error) => format!("{error}; hint: {}", error.hint().unwrap_or_default()),
    }
}

/// Every post of every tile against the same post of the whole area.
fn check_tiles(area: &GamingArea, ground: &Ground) -> Window {
    let whole = ground.window(area.rect).unwrap();
    for &tile in &area.tiles {
        let part = ground.window(area.tiling.rect(tile)).unwrap();
        let rect = part.dem.rect();
        for row in rect.south..=rect.north {
            assert_eq!(part.dem.row(row), &whole.dem.row(row)[rect.west as usize..=rect.east as usize], "row {row}");
            for post in (rect.west..=rect.east).map(|col| Post::new(row, col)) {
                let of = |window: &Window| (window.importance.weight(post), window.importance.class(post));
                assert_eq!(of(&part), of(&whole), "tile {tile} at {post}");
            }
        }
    }
    whole
}

#[test]
fn a_raster_read_by_window_is_the_same_ground_as_one_read_whole() {
    let folder = TempDir::new().unwrap();
    write_raster(folder.path());
    let job = job(folder.path(), "sources = [\"dem.tif\"]", "");
    let (area, whole) = open(&job, u64::MAX).unwrap();
    let (_, by_window) = open(&job, 0).unwrap();
    assert!(matches!(whole.relief.source, Source::Raster(_)) && matches!(by_window.relief.source, Source::Window(_)));
    assert_eq!(check_tiles(&area, &by_window).dem, check_tiles(&area, &whole).dem);
    assert_eq!(by_window.warnings, whole.warnings);
}

#[test]
fn heights_beside_the_area_are_none_of_the_sources_under_it() {
    let folder = TempDir::new().unwrap();
    let spacing = Spacing::from_metres(25.0).unwrap();
    let frame = GridFrame { origin_east_m: 504_500.0, origin_north_m: 3_874_500.0, spacing };
    // The area's first post is (20, 20), its last (140, 140); cubic resampling reaches two posts beyond.
    let metres = |post: Post| match [post.row, post.col] {
        [17, 50] => 900,
        [140, 80] => 700,
        _ => 500,
    };
    let heights = |band| Dem::from_fn(band, |post| Some(128 * metres(post)));
    let mut file = std::fs::File::create(folder.path().join("dem.tif")).unwrap();
    write_heights(&mut file, &frame, PostRect::of_size(161, 161), 32611, heights).unwrap();
    let job = job(folder.path(), "sources = [\"dem.tif\"]\nresampling = \"cubic\"", "");
    for whole_bytes_max in [u64::MAX, 0] {
        let ground = open(&job, whole_bytes_max).unwrap().1;
        let highest_m = |bounds: Option<Bounds>| bounds.unwrap().metres().1.floor();
        assert_eq!([ground.relief.bounds, ground.bounds()].map(highest_m), [900.0, 700.0]);
    }
}

/// A square lake of 800 m over the middle of the area, where four tiles meet.
fn write_lake(folder: &Path) {
    let [west, south] = [506_100.0, 3_876_100.0];
    let [east, north] = [west + 800.0, south + 800.0];
    let ring = format!("[[{west},{south}],[{east},{south}],[{east},{north}],[{west},{north}],[{west},{south}]]");
    std::fs::write(folder.join("lake.json"), format!(r#"{{"type":"Polygon","coordinates":[{ring}]}}"#)).unwrap();
}

#[test]
fn water_over_four_tiles_lies_at_one_level_and_is_a_class_of_its_own() {
    let folder = TempDir::new().unwrap();
    write_lake(folder.path());
    let dry = open(&job(folder.path(), "source = \"sample\"", "smooth = \"none\""), 0).unwrap().1;
    let wet = |water: &str| {
        let (area, ground) = open(&job(folder.path(), water, "default = 8\nsmooth = \"none\""), 0).unwrap();
        check_tiles(&area, &ground)
    };
    let found = wet("source = \"sample\"\nwater = \"lake.json\"");
    // West and south of the area's origin by 1100 m: posts 88 to 151 each way lie inside.
    let inside = |post: Post| (88..152).contains(&post.row) && (88..152).contains(&post.col);
    let before = dry.window(found.dem.rect()).unwrap().dem;
    let mut depths: Vec<i32> = Vec::new();
    for post in (0..=240).flat_map(|row| (0..=240).map(move |col| Post::new(row, col))) {
        let is_water = found.importance.class(post) == 1;
        assert_eq!(is_water, inside(post), "{post}");
        if is_water {
            depths.push(before.height(post));
            assert_eq!(found.importance.weight(post), u16::MAX, "as heavy as can be, beside ground of weight 8");
        } else {
            assert_eq!(found.dem.height(post), before.height(post), "{post}");
        }
    }
    depths.sort_unstable();
    let level = depths[(depths.len() - 1) / 2];
    assert!((88..152).all(|row| found.dem.row(row)[88..152].iter().all(|&height| height == level)));
    let stated = wet("source = \"sample\"\nwater = { file = \"lake.json\", level_m = 12.5, weight = 0 }");
    assert_eq!(stated.dem.height(Post::new(100, 100)), 1600);
    assert_eq!(stated.importance.weight(Post::new(100, 100)), u16::MAX, "level, whatever it weighs");
}

/// A raster of one height in metres from an easting on, 500 m higher and deeper than the area.
fn write_flat(folder: &Path, name: &str, height_m: i32, (origin_east_m, cols): (f64, usize)) {
    let spacing = Spacing::from_metres(25.0).unwrap();
    let frame = GridFrame { origin_east_m, origin_north_m: 3_874_500.0, spacing };
    let heights = |band| Dem::from_fn(band, |_| Some(128 * height_m));
    let mut file = std::fs::File::create(folder.join(name)).unwrap();
    write_heights(&mut file, &frame, PostRect::of_size(161, cols), 32611, heights).unwrap();
}

#[test]
fn water_far_off_its_level_is_told() {
    let folder = TempDir::new().unwrap();
    write_lake(folder.path());
    write_flat(folder.path(), "dem.tif", 100, (504_500.0, 161));
    let told = |level: &str| {
        let dem = format!("sources = [\"dem.tif\"]\nwater = {{ file = \"lake.json\"{level} }}");
        open(&job(folder.path(), &dem, ""), u64::MAX).unwrap().1.warnings
    };
    assert_eq!([told(""), told(", level_m = 95")], [Vec::<String>::new(), Vec::new()]);
    let [told] = &told(", level_m = 85")[..] else { panic!("one is told") };
    assert!(told.contains("1 of 1 bodies") && told.contains("4096 posts, 15 m"), "{told}");
}

#[test]
fn a_step_where_a_raster_ends_over_another_is_told() {
    for bytes in [u64::MAX, 0] {
        let folder = TempDir::new().unwrap();
        write_flat(folder.path(), "west.tif", 100, (504_500.0, 81));
        let told = |(height_m, west_m, cols): (i32, f64, usize), feather: &str| {
            write_flat(folder.path(), "east.tif", height_m, (west_m, cols));
            let dem = format!("sources = [\"west.tif\", \"east.tif\"]\n{feather}");
            open(&job(folder.path(), &dem, ""), bytes).unwrap().1.warnings
        };
        let over = |height_m: i32| (height_m, 506_000.0, 101);
        let found = told(over(120), "");
        let [step] = &found[..] else { panic!("one is told: {found:?}, {bytes} bytes") };
        assert!(step.contains("west.tif ends in a step of 20.0 m,"), "{step}");
        let silent = [told(over(104), ""), told(over(120), "feather_m = 300")];
        assert_eq!(silent, [Vec::<String>::new(), Vec::new()], "{bytes} bytes");
        // One that begins a post later has nothing to fade into.
        let abutting = |height_m: i32| told((height_m, 506_525.0, 80), "feather_m = 300").len();
        assert_eq!([abutting(102), abutting(120)], [0, 1], "{bytes} bytes");
    }
}

#[test]
fn rasters_of_one_grid_fade_into_each_other_where_they_overlap() {
    let folder = TempDir::new().unwrap();
    write_flat(folder.path(), "west.tif", 100, (504_500.0, 81));
    write_flat(folder.path(), "east.tif", 120, (506_000.0, 101));
    let dem = "sources = [\"west.tif\", \"east.tif\"]\nfeather_m = 400";
    for bytes in [u64::MAX, 0] {
        let (area, ground) = open(&job(folder.path(), dem, ""), bytes).unwrap();
        let row = ground.window(area.rect).unwrap().dem.row(100).to_vec();
        let steepest = row.windows(2).map(|pair| pair[0].abs_diff(pair[1])).max();
        assert!(steepest < Some(3 * 128), "{steepest:?} quanta from post to post, {bytes} bytes");
    }
}

#[test]
fn steep_ground_is_the_same_from_every_tile_and_matches_a_plain_count() {
    let folder = TempDir::new().unwrap();
    let steep =
        "smooth = \"none\"\nareas = [{ slope_above_percent = 15, smooth_m = 50, class = \"steep\", weight = 2 }]";
    let (area, ground) = open(&job(folder.path(), "source = \"sample\"", steep), 0).unwrap();
    let whole = check_tiles(&area, &ground);
    let metres = |row: i32, col: i32| f64::from(whole.dem.height(Post::new(row, col))) / 128.0;
    let percent = |row: i32, col: i32| {
        let ends = |at: i32| ((at - 1).max(0), (at + 1).min(240));
        let ((south, north), (west, east)) = (ends(row), ends(col));
        let across = (metres(row, east) - metres(row, west)) / (12.5 * f64::from(east - west));
        let along = (metres(north, col) - metres(south, col)) / (12.5 * f64::from(north - south));
        100.0 * across.hypot(along)
    };
    let mut counts = [0, 0];
    for (row, col) in (0..=240).step_by(3).flat_map(|row| (0..=240).step_by(3).map(move |col| (row, col))) {
        let near = |at: i32| (at - 4).max(0)..=(at + 4).min(240);
        let slopes: Vec<f64> =
            near(row).flat_map(|r| near(col).map(move |c| (r, c))).map(|(r, c)| percent(r, c)).collect();
        let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
        let class = whole.importance.class(Post::new(row, col));
        counts[usize::from(class)] += 1;
        assert!((mean - 15.0).abs() < 0.01 || (15.0 < mean) == (class == 1), "{row},{col}: {mean} %");
    }
    assert!(counts.iter().all(|&count| 20 < count), "{counts:?} posts of each class");
}

/// A worldwide grid of half degrees that says `height_m` everywhere.
fn write_geoid(path: &Path, height_m: f32) {
    let mut bytes: Vec<u8> = [-90.0, -180.0, 0.5, 0.5_f64].iter().flat_map(|number| number.to_be_bytes()).collect();
    bytes.extend([361_i32, 720].iter().flat_map(|count| count.to_be_bytes()));
    bytes.extend((0..361 * 720).flat_map(|_| height_m.to_be_bytes()));
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn heights_come_to_another_datum_by_the_grids_that_the_job_names_and_not_without() {
    let folder = TempDir::new().unwrap();
    write_raster(folder.path());
    write_geoid(&folder.path().join("egm96.gtx"), -30.5);
    write_geoid(&folder.path().join("egm2008.gtx"), -31.25);
    let dem = |wanted: &str, geoids: &str| {
        let sources = "sources = [{ file = \"dem.tif\", vertical_datum = \"EGM96\" }]";
        let dem = format!("{sources}\nvertical_datum = \"{wanted}\"\ngeoids = [{geoids}]");
        open(&job(folder.path(), &dem, ""), u64::MAX)
    };
    let (egm96, egm2008) =
        ("{ datum = \"EGM 96\", file = \"egm96.gtx\" }", "{ datum = \"EGM2008\", file = \"egm2008.gtx\" }");
    let heights = |found: (GamingArea, Ground)| check_tiles(&found.0, &found.1).dem.row(77).to_vec();
    let as_they_are = heights(dem("EGM96", "").unwrap());
    let off = |metres: f64| -> Vec<i32> { as_they_are.iter().map(|height| height + (metres * 128.0) as i32).collect() };
    assert_eq!(heights(dem("ellipsoid", egm96).unwrap()), off(-30.5));
    assert_eq!(heights(dem("EGM2008", &format!("{egm96}, {egm2008}")).unwrap()), off(0.75));
    let refused = message(dem("EGM2008", egm2008));
    assert!(refused.contains("heights of dem.tif above EGM96, where EGM2008 is wanted"), "{refused}");
    assert!(refused.contains("a geoid grid of EGM96 to convert with"), "{refused}");
}

#[test]
fn a_datum_is_one_whatever_its_unit_and_another_is_refused() {
    let folder = TempDir::new().unwrap();
    write_raster(folder.path());
    let open = |said: &str| {
        let dem =
            format!("sources = [{{ file = \"dem.tif\", vertical_datum = \"{said}\" }}]\nvertical_datum = \"NAVD88\"");
        open(&job(folder.path(), &dem, ""), u64::MAX)
    };
    for said in ["EPSG:5703", "EPSG:6360", "EPSG:8228"] {
        assert_eq!(open(said).unwrap().1.warnings, Vec::<String>::new(), "{said}");
    }
    for said in ["EPSG:5702", "EPSG:7837", "EPSG:5760"] {
        let refused = message(open(said));
        assert!(refused.contains(&format!("above {said}, where NAVD88 is wanted")), "{refused}");
    }
}

#[test]
fn tiles_on_both_sides_of_the_180th_meridian_are_one_ground() {
    let folder = TempDir::new().unwrap();
    let bytes = 100_i16.to_be_bytes().repeat(1201 * 1201);
    for name in ["S17E179.hgt", "S17W180.hgt"] {
        std::fs::write(folder.path().join(name), &bytes).unwrap();
    }
    let text = "[area]\nname = \"a\"\ncrs = \"EPSG:32760\"\norigin_m = [818000, 8172000]\nsize_m = [5000, 2000]\n\
                spacing_m = 25\n[dem]\nsources = [\"S17E179.hgt\", \"S17W180.hgt\"]\n";
    let job = Job::from_text(text, &folder.path().join("job.toml")).unwrap();
    for bytes in [u64::MAX, 0] {
        let (area, ground) = open(&job, bytes).unwrap();
        assert_eq!(ground.warnings, Vec::<String>::new());
        let dem = ground.window(area.rect).unwrap().dem;
        assert!(area.rect.posts().all(|post| !dem.is_void(post) && dem.height(post) == 12_800));
    }
    assert_eq!(crate::ground::foresee(&job, &GamingArea::new(&job).unwrap()).unwrap(), Vec::<String>::new());
}
