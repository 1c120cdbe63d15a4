//! Names and numbers outside what is possible.

use super::{check, told_of};

#[test]
fn a_title_is_a_line_of_text() {
    for title in [r#""""#, r#""  ""#, r#""a\nb""#] {
        let told = told_of("name", &format!("name = \"ntc\"\ntitle = {title}"));
        let expected = "expected a line of text, 1 to 200 characters hint: for example title = \"National Training \
                        Center, west\"";
        assert!(told.starts_with("a/b.toml:3: area.title: found") && told.ends_with(expected), "{told}");
    }
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
            r#"system in metres, as "EPSG:32611", or "auto" with around or cover"#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "crs",
        r#"crs = "UTM 11N""#,
        &[
            r#"a/b.toml:3: area.crs: found "UTM 11N", expected a projected coordinate system in metres, as"#,
            r#""EPSG:32611", or "auto" with around or cover"#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "crs",
        r#"crs = "EPSG:99""#,
        &[
            r#"a/b.toml:3: area.crs: found "EPSG:99", expected a projected coordinate system in metres, as"#,
            r#""EPSG:32611", or "auto" with around or cover"#,
            "hint: UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632",
        ],
    );
    check(
        "source",
        r#"source = "sample"
vertical_datum = " ""#,
        &[
            r#"a/b.toml:9: dem.vertical_datum: found " ", expected a name such as "EGM96", 1 to 64 characters"#,
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
            "metres, at most 65535/128",
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
            "a/b.toml:14: load_modules.side_m: found 0, expected a positive number of metres, at most 65535/128",
            "hint: for example side_m = 500",
        ],
    );
    check(
        "side_m",
        "side_m = -500",
        &[
            "a/b.toml:14: load_modules.side_m: found -500, expected a positive number of metres, at most 65535/128",
            "hint: for example side_m = 500",
        ],
    );
    check(
        "side_m",
        "border_step_m = 0",
        &[
            "a/b.toml:14: load_modules.border_step_m: found 0, expected a positive number of metres, at most 65535/128",
            "hint: for example border_step_m = 125",
        ],
    );
    check(
        "side_m",
        "side_m = 1000",
        &[
            "a/b.toml:14: load_modules.side_m: found 1000, expected a positive number of metres, at most 65535/128",
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
        "spacing_m = 400",
        &[
            "a/b.toml:6: area.spacing_m: found 400, expected a spacing that divides load_modules.border_step_m,",
            "125 m",
            "hint: 125 m is the step itself; the DEM is resampled to it",
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
        "border_step_m = 90",
        &[
            "a/b.toml:14: load_modules.border_step_m: found 90, expected a multiple of area.spacing_m, 25 m",
            "hint: the usual one is border_step_m = 125",
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
