//! Every way a job can be wrong, one by one, with the paragraph that is told.

// A test that unwraps says where it failed, which is all a test has to say.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use job::{Job, JobError};

/// A sound job, one key a line so that each can be replaced.
const SOUND: &str = r#"[area]
name = "ntc"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [50000, 50000]
spacing_m = 25
[dem]
source = "sample"
[importance]
default = 8
[tiles]
rows = 6
[load_modules]
side_m = 500
[limits]
pool = 0
[tin]
method = "optimised"
"#;

fn told(error: &JobError) -> String {
    format!("{error} hint: {}", error.hint())
}

/// Puts `new` in the place of the line that begins with `old`, and checks the paragraph and the hint that are told.
#[track_caller]
fn check(old: &str, new: &str, expected: &[&str]) {
    let mut lines: Vec<&str> = SOUND.lines().collect();
    let at = lines.iter().position(|line| line.starts_with(old)).expect("a line to replace");
    lines[at] = new;
    let error = Job::from_text(&lines.join("\n"), Path::new("a/b.toml")).expect_err("this job is wrong");
    assert_eq!(told(&error), expected.join(" "));
}

#[test]
fn the_job_that_the_others_spoil_is_sound() {
    Job::from_text(SOUND, Path::new("a/b.toml")).unwrap();
}

#[test]
fn text_that_is_not_toml_is_told_with_line_and_column() {
    check(
        "name",
        "name = ntc",
        &[
            "a/b.toml:2:8: found text that is not TOML: invalid float, expected `nan`",
            r#"hint: texts are quoted: name = "ntc"; sections are in brackets: [area]"#,
        ],
    );
    check(
        "spacing_m",
        "spacing_m = ",
        &[
            "a/b.toml:6:13: found text that is not TOML: string values must be quoted, expected literal string",
            r#"hint: texts are quoted: name = "ntc"; sections are in brackets: [area]"#,
        ],
    );
    check(
        "crs",
        r#"name = "twice""#,
        &[
            "a/b.toml:3:1: found text that is not TOML: duplicate key",
            r#"hint: texts are quoted: name = "ntc"; sections are in brackets: [area]"#,
        ],
    );
    check(
        "[dem]",
        "[dem",
        &[
            "a/b.toml:7:5: found text that is not TOML: unclosed table, expected `]`",
            r#"hint: texts are quoted: name = "ntc"; sections are in brackets: [area]"#,
        ],
    );
}

#[test]
fn unknown_keys_are_told_with_the_nearest_known_one() {
    check(
        "spacing_m",
        "spacing = 25",
        &[
            "a/b.toml:6: area.spacing: found a key that no job has, expected one of name, crs, origin_m,",
            "size_m, around, cover, spacing_m",
            "hint: did you mean spacing_m?",
        ],
    );
    check(
        "rows",
        "cols = 6",
        &[
            "a/b.toml:12: tiles.cols: found a key that no job has, expected one of columns, rows, order,",
            "borders",
            "hint: did you mean columns?",
        ],
    );
    check(
        "rows",
        "colums = 6",
        &[
            "a/b.toml:12: tiles.colums: found a key that no job has, expected one of columns, rows, order,",
            "borders",
            "hint: did you mean columns?",
        ],
    );
    check(
        "[importance]",
        "[importence]",
        &[
            "a/b.toml:9: importence: found a section or key that no job has, expected one of [area], [dem],",
            "[importance], [tiles], [load_modules], [limits], [tin], [lod]",
            "hint: did you mean [importance]?",
        ],
    );
    check(
        "pool",
        "proximity_m = [300, 20]",
        &[
            "a/b.toml:16: limits.proximity_m: found a key that no job has, expected one of count,",
            "per_load_module, pool, mean_per_load_module, per_4km_square",
            "hint: did you mean proximity_m in [tin]?",
        ],
    );
    check(
        "method",
        "budget = 3",
        &[
            "a/b.toml:18: tin.budget: found a key that no job has, expected one of method, points, key,",
            "allocation, residual_quantum_m, proximity_m, proximity, last_batch, max_residual_m, target_rms_m,",
            "effort, height_fit, lattice, start, pins",
            "hint: configs/ntc.toml shows the usual keys with what they mean",
        ],
    );
    check(
        "[area]",
        "workers = 2\n[area]",
        &[
            "a/b.toml:1: workers: found a section or key that no job has, expected one of [area], [dem],",
            "[importance], [tiles], [load_modules], [limits], [tin], [lod]",
            "hint: give it on the command line: --workers",
        ],
    );
    check(
        "[dem]",
        "[sample]\nseed = 2\n[dem]",
        &[
            "a/b.toml:7: sample: found a section or key that no job has, expected one of [area], [dem],",
            "[importance], [tiles], [load_modules], [limits], [tin], [lod]",
            r#"hint: the sample terrain is chosen by source = "sample" and seed in [dem]"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ file = "m.geojson", clas = "m", weight = 1 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].clas: found a key that no job has, expected one of file, raster,",
            "value, slope_above_percent, smooth_m, sample, class, weight",
            "hint: did you mean class?",
        ],
    );
    check(
        "source",
        r#"source = "sample"
voids = { fill = 8 }"#,
        &[
            "a/b.toml:9: dem.voids.fill: found a key that no job has, expected one of fill_within_posts,",
            "next_source, hole",
            "hint: did you mean fill_within_posts?",
        ],
    );
}

#[test]
fn missing_keys_are_told_with_an_example() {
    check(
        "name",
        "",
        &[
            "a/b.toml:1: area.name: found nothing, expected 1 to 100 letters, digits, '-', '_' or '.',",
            "beginning with a letter or digit",
            r#"hint: for example name = "ntc""#,
        ],
    );
    check(
        "crs",
        "",
        &[
            "a/b.toml:1: area.crs: found nothing, expected a projected coordinate system in metres, as",
            r#""EPSG:32611""#,
            r#"hint: for example crs = "EPSG:32611""#,
        ],
    );
    check(
        "origin_m",
        "",
        &[
            "a/b.toml:1: area.origin_m: found nothing, expected [east, north] of the south-west post in metres",
            "hint: for example origin_m = [505000, 3875000]",
        ],
    );
    check(
        "size_m",
        "",
        &[
            "a/b.toml:1: area.size_m: found nothing, expected [width, height] of the area in metres",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "spacing_m",
        "",
        &[
            "a/b.toml:1: area.spacing_m: found nothing, expected metres between posts, a positive multiple of",
            "1/16 m",
            "hint: for example spacing_m = 25",
        ],
    );
    check(
        "source",
        "",
        &[
            r#"a/b.toml:7: dem.sources: found nothing, expected a list of rasters, or source = "sample""#,
            r#"hint: sources = ["dem/*.tif"], relative to the job file; source = "sample" needs no file"#,
        ],
    );
    check(
        "method",
        r#"method = "paper""#,
        &[
            "a/b.toml:17: tin.points: found nothing, expected a number of selected points, which method =",
            r#""paper" stops at"#,
            "hint: the paper's area of 50 km x 50 km has points = 76500; max_residual_m or target_rms_m will do",
            "too",
        ],
    );
    check(
        "default",
        r#"areas = [{ raster = "c.tif", class = "m", weight = 1 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].value: found nothing, expected the value of the class in the",
            "raster",
            r#"hint: for example { raster = "class.tif", value = 3, class = "mountains", weight = 1 }"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ sample = "mountains", weight = 1 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].class: found nothing, expected the name of a class, 1 to 100",
            "characters",
            r#"hint: for example class = "mountains"; reports tell classes apart"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ sample = "mountains", class = "m" }]"#,
        &[
            "a/b.toml:10: importance.areas[0].weight: found nothing, expected a weight from 0 to 65.535",
            "hint: for example weight = 1; 0 excludes posts from selection",
        ],
    );
}

#[test]
fn values_of_the_wrong_type_are_told_as_written() {
    check(
        "name",
        "name = 7",
        &[
            "a/b.toml:2: area.name: found the whole number 7, expected 1 to 100 letters, digits, '-', '_' or",
            "'.', beginning with a letter or digit",
            r#"hint: for example name = "ntc""#,
        ],
    );
    check(
        "spacing_m",
        r#"spacing_m = "25""#,
        &[
            r#"a/b.toml:6: area.spacing_m: found the text "25", expected metres between posts, a positive"#,
            "multiple of 1/16 m",
            "hint: for example spacing_m = 25",
        ],
    );
    check(
        "origin_m",
        "origin_m = 505000",
        &[
            "a/b.toml:4: area.origin_m: found the whole number 505000, expected [east, north] of the south-west",
            "post in metres",
            "hint: for example origin_m = [505000, 3875000]",
        ],
    );
    check(
        "origin_m",
        "origin_m = [1, 2, 3]",
        &[
            "a/b.toml:4: area.origin_m: found the list [1, 2, 3], expected [east, north] of the south-west post",
            "in metres",
            "hint: for example origin_m = [505000, 3875000]",
        ],
    );
    check(
        "size_m",
        r#"size_m = ["wide", "high"]"#,
        &[
            r#"a/b.toml:5: area.size_m[0]: found the text "wide", expected [width, height] of the area in metres"#,
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "rows",
        "rows = 6.0",
        &[
            "a/b.toml:12: tiles.rows: found the number 6.0, expected tiles of 100 load modules, at least two",
            "each, a whole number from 1 to 50",
            "hint: for example rows = 6",
        ],
    );
    check(
        "pool",
        "pool = true",
        &[
            "a/b.toml:16: limits.pool: found the truth value true, expected a number of triangles, a whole",
            "number from 0 to 4294967295",
            "hint: for example pool = 0",
        ],
    );
    check(
        "[area]",
        "lod = 3\n[area]",
        &[
            "a/b.toml:1: lod: found the whole number 3, expected a table of levels, border",
            "hint: configs/ntc.toml shows the usual keys with what they mean",
        ],
    );
    check(
        "source",
        r#"sources = "dem.tif""#,
        &[
            r#"a/b.toml:8: dem.sources: found the text "dem.tif", expected a list of paths and patterns of"#,
            "rasters",
            r#"hint: for example sources = ["dem/*.tif"]"#,
        ],
    );
    check(
        "default",
        r#"areas = { sample = "mountains" }"#,
        &[
            r#"a/b.toml:10: importance.areas: found the table { sample = "mountains" }, expected a list of areas,"#,
            "each { file = … } or { raster = …, value = … } or { sample = … }",
            r#"hint: for example areas = [{ file = "mountains.geojson", class = "mountains", weight = 1 }]"#,
        ],
    );
    check(
        "default",
        "areas = [3]",
        &[
            "a/b.toml:10: importance.areas[0]: found the whole number 3, expected a table of file, raster,",
            "value, slope_above_percent, smooth_m, sample, class, weight",
            r#"hint: for example areas = [{ file = "mountains.geojson", class = "mountains", weight = 1 }]"#,
        ],
    );
    check(
        "source",
        r#"source = "sample"
voids = 8"#,
        &[
            r#"a/b.toml:9: dem.voids: found the whole number 8, expected "fail", "next_source", "hole" or"#,
            "{ fill_within_posts = 8 }",
            r#"hint: for example voids = "fail""#,
        ],
    );
    check(
        "method",
        r#"proximity = 3
method = "paper"
points = 5"#,
        &[
            "a/b.toml:18: tin.proximity: found the whole number 3, expected true or false",
            "hint: for example proximity = false",
        ],
    );
    check(
        "spacing_m",
        "spacing_m = 0x19",
        &[
            "a/b.toml:6: area.spacing_m: found the whole number 0x19, expected metres between posts, a positive",
            "multiple of 1/16 m",
            "hint: for example spacing_m = 25",
        ],
    );
    check(
        "name",
        "name = 2024-05-01",
        &[
            "a/b.toml:2: area.name: found the date 2024-05-01, expected 1 to 100 letters, digits, '-', '_' or",
            "'.', beginning with a letter or digit",
            r#"hint: for example name = "ntc""#,
        ],
    );
}

#[test]
fn words_are_told_with_the_nearest_known_one() {
    check(
        "method",
        r#"method = "papr""#,
        &[
            r#"a/b.toml:18: tin.method: found "papr", expected "optimised" or "paper" or "greedy""#,
            r#"hint: did you mean "paper"?"#,
        ],
    );
    check(
        "method",
        r#"method = "optimized""#,
        &[
            r#"a/b.toml:18: tin.method: found "optimized", expected "optimised" or "paper" or "greedy""#,
            r#"hint: did you mean "optimised"?"#,
        ],
    );
    check(
        "source",
        r#"source = "sampel""#,
        &[r#"a/b.toml:8: dem.source: found "sampel", expected "sample""#, r#"hint: did you mean "sample"?"#],
    );
    check(
        "side_m",
        r#"edges = "clipped""#,
        &[
            r#"a/b.toml:14: load_modules.edges: found "clipped", expected "constrained" or "clip""#,
            r#"hint: did you mean "clip"?"#,
        ],
    );
    check(
        "pool",
        r#"count = "quads""#,
        &[
            r#"a/b.toml:16: limits.count: found "quads", expected "triangles" or "polygons""#,
            r#"hint: for example count = "triangles""#,
        ],
    );
    check(
        "rows",
        r#"order = "color""#,
        &[
            r#"a/b.toml:12: tiles.order: found "color", expected "colour" or "raster""#,
            r#"hint: did you mean "colour"?"#,
        ],
    );
    check(
        "default",
        r#"smooth = "gaussian""#,
        &[
            r#"a/b.toml:10: importance.smooth: found "gaussian", expected "binomial-7" or "none""#,
            r#"hint: for example smooth = "binomial-7""#,
        ],
    );
    check(
        "method",
        r#"height_fit = "l3""#,
        &[
            r#"a/b.toml:18: tin.height_fit: found "l3", expected "l2" or "l2_keep_crests" or "off""#,
            r#"hint: did you mean "l2"?"#,
        ],
    );
    check(
        "method",
        r#"effort = "high""#,
        &[
            r#"a/b.toml:18: tin.effort: found "high", expected "fast" or "normal" or "best""#,
            r#"hint: for example effort = "normal""#,
        ],
    );
    check(
        "method",
        r#"lattice = "posts""#,
        &[r#"a/b.toml:18: tin.lattice: found "posts", expected "eighth" or "post""#, r#"hint: did you mean "post"?"#],
    );
    check(
        "default",
        r#"areas = [{ sample = "plains", class = "p", weight = 1 }]"#,
        &[
            r#"a/b.toml:10: importance.areas[0].sample: found "plains", expected "mountains""#,
            r#"hint: for example { sample = "mountains", class = "mountains", weight = 1 }"#,
        ],
    );
}

#[test]
fn names_and_coordinate_systems_are_checked() {
    check(
        "name",
        r#"name = "../ntc""#,
        &[
            r#"a/b.toml:2: area.name: found "../ntc", expected 1 to 100 letters, digits, '-', '_' or '.',"#,
            "beginning with a letter or digit",
            "hint: the database is named after it: NAME.tdb",
        ],
    );
    check(
        "name",
        r#"name = """#,
        &[
            r#"a/b.toml:2: area.name: found "", expected 1 to 100 letters, digits, '-', '_' or '.', beginning"#,
            "with a letter or digit",
            "hint: the database is named after it: NAME.tdb",
        ],
    );
    check(
        "name",
        r#"name = ".hidden""#,
        &[
            r#"a/b.toml:2: area.name: found ".hidden", expected 1 to 100 letters, digits, '-', '_' or '.',"#,
            "beginning with a letter or digit",
            "hint: the database is named after it: NAME.tdb",
        ],
    );
    check(
        "crs",
        r#"crs = "EPSG:4326""#,
        &[
            r#"a/b.toml:3: area.crs: found "EPSG:4326", which is in degrees, expected a projected coordinate"#,
            r#"system in metres, as "EPSG:32611""#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "crs",
        r#"crs = "UTM 11N""#,
        &[
            r#"a/b.toml:3: area.crs: found "UTM 11N", expected a projected coordinate system in metres, as"#,
            r#""EPSG:32611""#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "crs",
        r#"crs = "EPSG:99""#,
        &[
            r#"a/b.toml:3: area.crs: found "EPSG:99", expected a projected coordinate system in metres, as"#,
            r#""EPSG:32611""#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "source",
        r#"source = "sample"
vertical_datum = " ""#,
        &[
            r#"a/b.toml:9: dem.vertical_datum: found " ", expected a name such as "EGM96", at most 64 characters"#,
            r#"hint: for example vertical_datum = "EGM96""#,
        ],
    );
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    check(
        "spacing_m",
        "spacing_m = nan",
        &[
            "a/b.toml:6: area.spacing_m: found nan, expected a finite number: metres between posts, a positive",
            "multiple of 1/16 m",
            "hint: for example spacing_m = 25",
        ],
    );
    check(
        "size_m",
        "size_m = [inf, 50000]",
        &[
            "a/b.toml:5: area.size_m[0]: found inf, expected a finite number: [width, height] of the area in",
            "metres",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "origin_m",
        "origin_m = [-inf, 0]",
        &[
            "a/b.toml:4: area.origin_m[0]: found -inf, expected a finite number: [east, north] of the",
            "south-west post in metres",
            "hint: for example origin_m = [505000, 3875000]",
        ],
    );
    check(
        "default",
        "default = nan",
        &[
            "a/b.toml:10: importance.default: found nan, expected a finite number: a weight from 0 to 65.535,",
            "in whole thousandths",
            "hint: for example default = 8",
        ],
    );
    check(
        "pool",
        "mean_per_load_module = inf",
        &[
            "a/b.toml:16: limits.mean_per_load_module: found inf, expected a finite number: a number of",
            "triangles from 2 to 65535",
            "hint: for example mean_per_load_module = 32",
        ],
    );
    check(
        "method",
        "target_rms_m = nan",
        &[
            "a/b.toml:18: tin.target_rms_m: found nan, expected a finite number: metres from 0.0001 to 131071",
            "hint: for example target_rms_m = 1.5",
        ],
    );
    check(
        "side_m",
        "side_m = 1e999",
        &[
            "a/b.toml:14: load_modules.side_m: found 1e999, expected a finite number: a positive number of",
            "metres",
            "hint: for example side_m = 500",
        ],
    );
}

#[test]
fn zero_negative_and_huge_sizes_are_refused() {
    check(
        "spacing_m",
        "spacing_m = 0",
        &[
            "a/b.toml:6: area.spacing_m: found 0, expected metres between posts, a positive multiple of 1/16 m",
            "hint: 25 divides the usual border step of 125 m; a DEM of any other spacing is resampled to it",
        ],
    );
    check(
        "spacing_m",
        "spacing_m = -25",
        &[
            "a/b.toml:6: area.spacing_m: found -25, expected metres between posts, a positive multiple of 1/16",
            "m",
            "hint: 25 divides the usual border step of 125 m; a DEM of any other spacing is resampled to it",
        ],
    );
    check(
        "size_m",
        "size_m = [0, 50000]",
        &[
            "a/b.toml:5: area.size_m: found [0, 50000], expected a positive width and height in metres",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "size_m",
        "size_m = [50000, -500]",
        &[
            "a/b.toml:5: area.size_m: found [50000, -500], expected a positive width and height in metres",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "size_m",
        "size_m = [1e9, 1e9]",
        &[
            "a/b.toml:5: area.size_m: found [1e9, 1e9], expected at most 1048576 cells a side, which is",
            "26214400 m at this spacing",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "size_m",
        "size_m = [25000000, 25000000]",
        &[
            "a/b.toml:5: area.size_m: found [25000000, 25000000], expected at most 16777216 load modules",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
    check(
        "origin_m",
        "origin_m = [1e12, 0]",
        &[
            "a/b.toml:4: area.origin_m: found [1e12, 0], expected [east, north] of the south-west post in",
            "metres, each within 1e8 m of 0",
            "hint: for example origin_m = [505000, 3875000]",
        ],
    );
    check(
        "side_m",
        "side_m = 0",
        &[
            "a/b.toml:14: load_modules.side_m: found 0, expected a positive number of metres",
            "hint: for example side_m = 500",
        ],
    );
    check(
        "side_m",
        "side_m = -500",
        &[
            "a/b.toml:14: load_modules.side_m: found -500, expected a positive number of metres",
            "hint: for example side_m = 500",
        ],
    );
    check(
        "side_m",
        "border_step_m = 0",
        &[
            "a/b.toml:14: load_modules.border_step_m: found 0, expected a positive number of metres",
            "hint: for example border_step_m = 125",
        ],
    );
    check(
        "side_m",
        "side_m = 1000",
        &[
            "a/b.toml:14: load_modules.side_m: found 1000, expected at most 65535/128 m",
            "hint: a load module has 16-bit coordinates of 1/128 m: 500 m is 64,000 of them",
        ],
    );
    check(
        "rows",
        "rows = 0",
        &[
            "a/b.toml:12: tiles.rows: found 0, expected tiles of 100 load modules, at least two each, a whole",
            "number from 1 to 50",
            "hint: for example rows = 6",
        ],
    );
    check(
        "rows",
        "rows = -6",
        &[
            "a/b.toml:12: tiles.rows: found -6, expected tiles of 100 load modules, at least two each, a whole",
            "number from 1 to 50",
            "hint: for example rows = 6",
        ],
    );
    check(
        "rows",
        "rows = 99999999999999999999",
        &[
            "a/b.toml:12: tiles.rows: found 99999999999999999999, expected tiles of 100 load modules, at least",
            "two each, a whole number from 1 to 50",
            "hint: for example rows = 6",
        ],
    );
    check(
        "pool",
        "per_load_module = 0",
        &[
            "a/b.toml:16: limits.per_load_module: found 0, expected a number of triangles, a whole number from",
            "2 to 65535",
            "hint: for example per_load_module = 100",
        ],
    );
    check(
        "pool",
        "per_load_module = 100000",
        &[
            "a/b.toml:16: limits.per_load_module: found 100000, expected a number of triangles, a whole number",
            "from 2 to 65535",
            "hint: for example per_load_module = 100",
        ],
    );
    check(
        "pool",
        "pool = -1",
        &[
            "a/b.toml:16: limits.pool: found -1, expected a number of triangles, a whole number from 0 to",
            "4294967295",
            "hint: for example pool = 0",
        ],
    );
    check(
        "pool",
        "per_4km_square = 0",
        &[
            "a/b.toml:16: limits.per_4km_square: found 0, expected a number of triangles, a whole number from 2",
            "to 4294967295",
            "hint: for example per_4km_square = 4096",
        ],
    );
    check(
        "pool",
        "mean_per_load_module = 0",
        &[
            "a/b.toml:16: limits.mean_per_load_module: found 0, expected a number of triangles from 2 to 65535",
            "hint: for example mean_per_load_module = 32",
        ],
    );
}

#[test]
fn lengths_that_do_not_divide_are_refused_with_one_that_does() {
    check(
        "spacing_m",
        "spacing_m = 25.27",
        &[
            "a/b.toml:6: area.spacing_m: found 25.27, expected metres between posts, a positive multiple of",
            "1/16 m",
            "hint: 25 divides the usual border step of 125 m; a DEM of any other spacing is resampled to it",
        ],
    );
    check(
        "spacing_m",
        "spacing_m = 30",
        &[
            "a/b.toml:6: area.spacing_m: found 30, expected a spacing that divides load_modules.border_step_m,",
            "125 m",
            "hint: 31.25 m is 125 m / 4; the DEM is resampled to it",
        ],
    );
    check(
        "spacing_m",
        "spacing_m = 0.3",
        &[
            "a/b.toml:6: area.spacing_m: found 0.3, expected metres between posts, a positive multiple of 1/16",
            "m",
            "hint: 25 divides the usual border step of 125 m; a DEM of any other spacing is resampled to it",
        ],
    );
    check(
        "side_m",
        "side_m = 510",
        &[
            "a/b.toml:14: load_modules.side_m: found 510, expected a side of a load module that is a multiple",
            "of its border step (510 m of 125 m)",
            "hint: the usual ones are side_m = 500 and border_step_m = 125",
        ],
    );
    check(
        "side_m",
        "border_step_m = 150",
        &[
            "a/b.toml:14: load_modules.border_step_m: found 150, expected a side of a load module that is a",
            "multiple of its border step (500 m of 150 m)",
            "hint: the usual ones are side_m = 500 and border_step_m = 125",
        ],
    );
    check(
        "side_m",
        "border_step_m = 200",
        &[
            "a/b.toml:14: load_modules.border_step_m: found 200, expected a side of a load module that is a",
            "multiple of its border step (500 m of 200 m)",
            "hint: the usual ones are side_m = 500 and border_step_m = 125",
        ],
    );
    check(
        "size_m",
        "size_m = [50100, 50000]",
        &[
            "a/b.toml:5: area.size_m: found [50100, 50000], expected whole numbers of load modules of 500 m",
            "hint: [50000, 50000] fits inside",
        ],
    );
    check(
        "size_m",
        "size_m = [300, 300]",
        &[
            "a/b.toml:5: area.size_m: found [300, 300], expected whole numbers of load modules of 500 m",
            "hint: for example size_m = [50000, 50000]",
        ],
    );
}

#[test]
fn tiles_are_at_least_two_load_modules_wide() {
    check(
        "rows",
        "rows = 51",
        &[
            "a/b.toml:12: tiles.rows: found 51, expected tiles of 100 load modules, at least two each, a whole",
            "number from 1 to 50",
            "hint: for example rows = 6",
        ],
    );
    check(
        "rows",
        "columns = 60",
        &[
            "a/b.toml:12: tiles.columns: found 60, expected tiles of 100 load modules, at least two each, a",
            "whole number from 1 to 50",
            "hint: for example columns = 6",
        ],
    );
}

#[test]
fn weights_are_whole_thousandths_of_a_range() {
    check(
        "default",
        "default = -1",
        &[
            "a/b.toml:10: importance.default: found -1, expected a weight from 0 to 65.535, in whole",
            "thousandths",
            "hint: for example default = 8",
        ],
    );
    check(
        "default",
        "default = 65.536",
        &[
            "a/b.toml:10: importance.default: found 65.536, expected a weight from 0 to 65.535, in whole",
            "thousandths",
            "hint: for example default = 8",
        ],
    );
    check(
        "default",
        "default = 0.0005",
        &[
            "a/b.toml:10: importance.default: found 0.0005, expected a weight from 0 to 65.535, in whole",
            "thousandths",
            "hint: for example default = 8",
        ],
    );
    check(
        "default",
        r#"areas = [{ sample = "mountains", class = "m", weight = 100 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].weight: found 100, expected a weight from 0 to 65.535, in whole",
            "thousandths",
            "hint: for example weight = 1; 0 excludes posts from selection",
        ],
    );
    check(
        "default",
        r#"areas = [{ sample = "mountains", class = "", weight = 1 }]"#,
        &[
            r#"a/b.toml:10: importance.areas[0].class: found "", expected the name of a class, 1 to 100"#,
            "characters",
            r#"hint: for example class = "mountains"; reports tell classes apart"#,
        ],
    );
}

#[test]
fn keys_that_do_not_go_together_are_told_apart() {
    check(
        "source",
        r#"source = "sample"
sources = ["a.tif"]"#,
        &[
            r#"a/b.toml:8: dem.source: found "sample" beside sources, expected either source = "sample" or"#,
            "sources = [files]",
            "hint: remove one of the two",
        ],
    );
    check(
        "source",
        r#"sources = ["a.tif"]
seed = 3"#,
        &[
            "a/b.toml:9: dem.seed: found 3 beside sources, expected no seed, since files are read",
            "hint: only the sample has a seed",
        ],
    );
    check(
        "source",
        "seed = 3",
        &[
            r#"a/b.toml:7: dem.sources: found nothing, expected a list of rasters, or source = "sample""#,
            r#"hint: sources = ["dem/*.tif"], relative to the job file; source = "sample" needs no file"#,
        ],
    );
    check(
        "source",
        "sources = []",
        &[
            "a/b.toml:8: dem.sources: found [], expected 1 to 65536 paths or patterns",
            r#"hint: for example sources = ["dem/*.tif"]"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ file = "m.geojson", raster = "c.tif", class = "m", weight = 1 }]"#,
        &[
            r#"a/b.toml:10: importance.areas[0]: found { file = "m.geojson", raster = "c.tif", class = "m","#,
            r#"weight …, expected exactly one of file = "x.geojson", raster = "x.tif" with value, sample ="#,
            r#""mountains", slope_above_percent = 20"#,
            r#"hint: for example areas = [{ file = "mountains.geojson", class = "mountains", weight = 1 }]"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ file = "m.geojson", value = 3, class = "m", weight = 1 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].value: found 3 beside file, expected no value, since polygons",
            "have none",
            "hint: value goes with raster",
        ],
    );
    check(
        "default",
        r#"areas = [{ class = "m", weight = 1 }]"#,
        &[
            r#"a/b.toml:10: importance.areas[0]: found { class = "m", weight = 1 }, expected exactly one of file"#,
            r#"= "x.geojson", raster = "x.tif" with value, sample = "mountains", slope_above_percent = 20"#,
            r#"hint: for example areas = [{ file = "mountains.geojson", class = "mountains", weight = 1 }]"#,
        ],
    );
    check(
        "side_m",
        r#"clip_heights = "dem""#,
        &[
            r#"a/b.toml:14: load_modules.clip_heights: found "dem" beside edges = "constrained", expected no"#,
            "clip_heights, since nothing is clipped",
            r#"hint: remove it, or write edges = "clip""#,
        ],
    );
    check(
        "side_m",
        r#"edges = "clip""#,
        &[
            r#"a/b.toml:18: tin.method: found "optimised" beside edges = "clip", expected constrained edges,"#,
            "since merging and clipping would undo what is optimised",
            r#"hint: write edges = "constrained" in [load_modules], or method = "paper" in [tin]"#,
        ],
    );
    check(
        "method",
        "points = 76500",
        &[
            r#"a/b.toml:18: tin.points: found 76500 beside method = "optimised", expected a job without this key"#,
            r#"hint: the budget of "optimised" is the limits: lower limits.mean_per_load_module, or choose"#,
            r#""greedy" or "paper""#,
        ],
    );
    check(
        "method",
        r#"method = "optimised"
last_batch = "finish""#,
        &[
            r#"a/b.toml:19: tin.last_batch: found "finish" beside method = "optimised", expected a job without"#,
            "this key",
            r#"hint: it belongs to method = "paper""#,
        ],
    );
    check(
        "method",
        r#"key = "max""#,
        &[
            r#"a/b.toml:18: tin.key: found "max" beside method = "optimised", expected "sse", which is what it"#,
            "lowers",
            r#"hint: method = "greedy" takes either key"#,
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 9
effort = "fast""#,
        &[
            r#"a/b.toml:20: tin.effort: found "fast" beside method = "paper", expected a job without this key"#,
            r#"hint: it belongs to method = "optimised"; the paper's vertices stay on posts at DEM height"#,
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 9
lattice = "post""#,
        &[
            r#"a/b.toml:20: tin.lattice: found "post" beside method = "paper", expected a job without this key"#,
            r#"hint: it belongs to method = "optimised"; the paper's vertices stay on posts at DEM height"#,
        ],
    );
    check(
        "method",
        r#"method = "greedy"
height_fit = "off""#,
        &[
            r#"a/b.toml:19: tin.height_fit: found "off" beside method = "greedy", expected a job without this"#,
            "key",
            r#"hint: greedy takes one worst post at a time; batches belong to "paper", fitting to "optimised""#,
        ],
    );
    check(
        "method",
        r#"method = "greedy"
proximity_m = [300, 20]"#,
        &[
            r#"a/b.toml:19: tin.proximity_m: found [300, 20] beside method = "greedy", expected a job without"#,
            "this key",
            r#"hint: greedy takes one worst post at a time; batches belong to "paper", fitting to "optimised""#,
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 9
proximity = false
proximity_m = [300, 20]"#,
        &[
            "a/b.toml:21: tin.proximity_m: found [300, 20] beside proximity = false, expected no distances,",
            "since nothing is left out",
            "hint: remove one of the two",
        ],
    );
}

#[test]
fn values_of_the_tin_section_are_checked() {
    check(
        "method",
        "lattice = 8",
        &[
            r#"a/b.toml:18: tin.lattice: found the whole number 8, expected "eighth" or "post""#,
            r#"hint: for example lattice = "eighth""#,
        ],
    );
    check(
        "method",
        "height_fit = false",
        &[
            r#"a/b.toml:18: tin.height_fit: found the truth value false, expected "l2" or "l2_keep_crests""#,
            r#"or "off""#,
            r#"hint: for example height_fit = "l2_keep_crests""#,
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 0"#,
        &[
            "a/b.toml:19: tin.points: found 0, expected a number of selected points, a whole number from 1 to",
            "4294967295",
            "hint: for example points = 76500",
        ],
    );
    check(
        "method",
        r#"method = "greedy"
points = 5000000000"#,
        &[
            "a/b.toml:19: tin.points: found 5000000000, expected a number of selected points, a whole number",
            "from 1 to 4294967295",
            "hint: for example points = 76500",
        ],
    );
    check(
        "method",
        r#"method = "greedy"
residual_quantum_m = 0.3"#,
        &[
            "a/b.toml:19: tin.residual_quantum_m: found 0.3, expected metres, a positive multiple of 1/128 m up",
            "to 1000",
            "hint: for example residual_quantum_m = 1, the paper's; 0.0078125 compares residuals as they are",
        ],
    );
    check(
        "method",
        r#"method = "greedy"
residual_quantum_m = 0"#,
        &[
            "a/b.toml:19: tin.residual_quantum_m: found 0, expected metres, a positive multiple of 1/128 m up",
            "to 1000",
            "hint: for example residual_quantum_m = 1, the paper's; 0.0078125 compares residuals as they are",
        ],
    );
    check(
        "method",
        "max_residual_m = -1",
        &[
            "a/b.toml:18: tin.max_residual_m: found -1, expected metres from 0 to 131071",
            "hint: for example max_residual_m = 10",
        ],
    );
    check(
        "method",
        "target_rms_m = 0",
        &[
            "a/b.toml:18: tin.target_rms_m: found 0, expected metres from 0.0001 to 131071",
            "hint: for example target_rms_m = 1.5",
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 9
proximity_m = [-1, 20]"#,
        &[
            "a/b.toml:20: tin.proximity_m: found [-1, 20], expected [horizontal, vertical] in metres, neither",
            "negative nor above 131071",
            "hint: for example proximity_m = [300, 20]",
        ],
    );
    check(
        "method",
        r#"method = "paper"
points = 9
proximity_m = false"#,
        &[
            "a/b.toml:20: tin.proximity_m: found the truth value false, expected [horizontal, vertical] in",
            "metres, neither negative",
            "hint: for example proximity_m = [300, 20]",
        ],
    );
    check(
        "source",
        r#"source = "sample"
voids = "ignore""#,
        &[
            r#"a/b.toml:9: dem.voids: found "ignore", expected "fail", "next_source", "hole" or"#,
            "{ fill_within_posts = 8 }",
            r#"hint: for example voids = "fail""#,
        ],
    );
    check(
        "source",
        r#"source = "sample"
voids = { fill_within_posts = 0 }"#,
        &[
            "a/b.toml:9: dem.voids.fill_within_posts: found 0, expected a number of posts, a whole number from",
            "1 to 1024",
            "hint: for example voids = { fill_within_posts = 8 }",
        ],
    );
    check(
        "source",
        r#"source = "sample"
seed = -1"#,
        &[
            "a/b.toml:9: dem.seed: found -1, expected a seed, a whole number from 0 to 9223372036854775807",
            "hint: for example seed = 1",
        ],
    );
}

#[test]
fn a_start_is_a_file_or_a_method_with_a_number_of_points() {
    check(
        "method",
        r#"start = { method = "vpi", points = 5 }"#,
        &[
            r#"a/b.toml:18: tin.start.method: found "vpi", expected "vip" or "highlow" or "lattice""#,
            r#"or "fowler-little" or "hierarchical" or "earlier" or "regular" or "contour""#,
            r#"hint: did you mean "vip"?"#,
        ],
    );
    check(
        "method",
        r#"start = { method = "vip" }"#,
        &[
            "a/b.toml:18: tin.start.points: found nothing, expected a number of points to start from",
            "hint: points = 1000: so many in the whole area",
        ],
    );
    check(
        "method",
        r#"start = { method = "highlow", points = 5 }"#,
        &[
            r#"a/b.toml:18: tin.start.points: found 5 beside method = "highlow", expected no number, which is"#,
            "the ground's choice",
            "hint: it takes all peaks and pits: leave points out",
        ],
    );
}

#[test]
fn levels_are_few_and_go_from_fine_to_coarse() {
    let expected = "the share of inner vertices that the level keeps, above 0 and below 1";
    for share in ["1", "0", "-0.5", "1.5"] {
        let found = format!("a/b.toml:17: lod.levels[0].inner_share: found {share}, expected {expected}");
        let hint = "hint: for example { inner_share = 0.5 }, half of the vertices inside a load module";
        check("pool", &format!("[lod]\nlevels = [{{ inner_share = {share} }}]"), &[&found, hint]);
    }
    check(
        "pool",
        "[lod]\nlevels = [\n{ inner_share = 0.2 },\n{ inner_share = 0.2 },\n]",
        &[
            "a/b.toml:19: lod.levels[1].inner_share: found 0.2, expected less than 0.2, the share of the level before",
            "hint: levels go from fine to coarse",
        ],
    );
    let eight: Vec<String> = (1..=8).rev().map(|tenths| format!("{{ inner_share = 0.{tenths} }}")).collect();
    check(
        "pool",
        &format!("[lod]\nlevels = [{}]", eight.join(", ")),
        &[
            "a/b.toml:17: lod.levels: found [{ inner_share = 0.8 }, { inner_share = 0.7 }, { inner_share…, expected",
            "a list of at most 7 levels, each coarser than the one before",
            "hint: the finest level is always there and is not listed",
        ],
    );
    check(
        "pool",
        "[lod]\nlevels = [0.5]",
        &[
            "a/b.toml:17: lod.levels[0]: found the number 0.5, expected a table of inner_share",
            "hint: for example levels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]",
        ],
    );
    check(
        "pool",
        "[lod]\nlevels = [{ share = 0.5 }]",
        &[
            "a/b.toml:17: lod.levels[0].share: found a key that no job has, expected one of inner_share",
            "hint: configs/ntc.toml shows the usual keys with what they mean",
        ],
    );
}

#[test]
fn what_levels_keep_of_the_sides_is_full_or_own() {
    check(
        "pool",
        "[lod]\nlevels = []\nborder = \"own\"",
        &[
            r#"a/b.toml:18: lod.border: found "own" beside no levels, expected a job without this key"#,
            "hint: it says what coarser levels keep of the sides: add levels, or leave it out",
        ],
    );
    check(
        "pool",
        "[lod]\nlevels = [{ inner_share = 0.5 }]\nborder = \"ful\"",
        &[r#"a/b.toml:18: lod.border: found "ful", expected "full" or "own""#, r#"hint: did you mean "full"?"#],
    );
}

#[test]
fn what_this_version_cannot_do_yet_is_said() {
    check(
        "rows",
        r#"borders = "line""#,
        &[
            r#"a/b.toml:12: tiles.borders: found "line" (not supported yet), expected "inherit" or "regular""#,
            r#"hint: "inherit" is the usual one"#,
        ],
    );
    check(
        "source",
        r#"source = "sample"
height_unit_m = 0.3048"#,
        &[
            r#"a/b.toml:9: dem.height_unit_m: found 0.3048 beside source = "sample", expected no unit, since the"#,
            "sample is in metres",
            "hint: remove it",
        ],
    );
}

#[test]
fn what_a_job_says_about_a_source_is_checked() {
    check(
        "source",
        r#"sources = [{ file = "a.hgt", corner = [95, 5] }]"#,
        &[
            "a/b.toml:8: dem.sources[0].corner: found [95, 5], expected latitude and longitude in degrees,",
            "latitude first",
            "hint: for example corner = [35, -117], latitude and longitude of the south-west post of an HGT tile",
        ],
    );
    check(
        "source",
        r#"sources = [{ crs = "EPSG:4326" }]"#,
        &[
            "a/b.toml:8: dem.sources[0].file: found nothing, expected the path of a raster",
            r#"hint: for example { file = "cell.asc", crs = "EPSG:32611" }"#,
        ],
    );
    check(
        "source",
        r#"sources = ["a.tif"]
feather_m = -1"#,
        &["a/b.toml:9: dem.feather_m: found -1, expected metres from 0 to 100000", "hint: for example feather_m = 500"],
    );
}

#[test]
fn an_area_that_is_to_be_found_needs_no_numbers_and_takes_none() {
    check(
        "origin_m",
        r#"cover = "dem""#,
        &[
            r#"a/b.toml:4: area.cover: found "dem" beside size_m, expected either cover, around, or origin_m and"#,
            "size_m",
            "hint: remove one of the two",
        ],
    );
    check(
        "crs",
        r#"crs = "auto""#,
        &[
            r#"a/b.toml:3: area.crs: found "auto" beside origin_m, expected a system for these metres, as"#,
            r#""EPSG:32611""#,
            r#"hint: "auto" goes with around = { lat = 35.3, lon = -116.6, size_km = 50 } or cover = "dem""#,
        ],
    );
}

#[test]
fn patterns_may_not_leave_their_folder() {
    check(
        "source",
        r#"sources = ["dem/*/../../x.tif"]"#,
        &[
            r#"a/b.toml:8: dem.sources[0]: found "dem/*/../../x.tif", expected a pattern without .. behind its"#,
            "first wildcard",
            r#"hint: name the folder first: sources = ["../other/*.tif"]"#,
        ],
    );
    check(
        "source",
        r#"sources = [""]"#,
        &[
            r#"a/b.toml:8: dem.sources[0]: found "", expected the path of a file, relative to the job file"#,
            r#"hint: for example sources = ["dem/*.tif"]"#,
        ],
    );
}

#[track_caller]
fn check_part(old: &str, new: &str, expected: &str) {
    let mut lines: Vec<&str> = SOUND.lines().collect();
    let at = lines.iter().position(|line| line.starts_with(old)).expect("a line to replace");
    lines[at] = new;
    let error = Job::from_text(&lines.join("\n"), Path::new("a/b.toml")).expect_err("this job is wrong");
    assert!(told(&error).contains(expected), "{}", told(&error));
}

#[test]
fn water_geoids_and_slopes_are_told_what_they_need() {
    let dem = |keys: &str| format!("source = \"sample\"\n{keys}");
    check_part("source", &dem("water = { level_m = 3 }"), "dem.water.file: found nothing");
    let geoids = dem("geoids = [{ datum = \"ellipsoid\", file = \"a.gtx\" }]");
    check_part("source", &geoids, "dem.geoids[0].datum: found \"ellipsoid\", expected a datum other than");
    let area = |keys: &str| format!("areas = [{{ {keys}, class = \"m\", weight = 1 }}]");
    check_part(
        "default",
        &area("slope_above_percent = 20"),
        "smooth_m: found nothing, expected metres from 0 to 10000",
    );
    let level = area("slope_above_percent = 0, smooth_m = 0");
    check_part("default", &level, "slope_above_percent: found 0, expected a slope in percent, above 0");
    let other = area("file = \"m.geojson\", smooth_m = 5");
    check_part("default", &other, "hint: smooth_m goes with slope_above_percent");
}
