//! What a job says of its sources.

use super::{check, check_part};

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
