//! Keys and words that no job has, that are missing, or of the wrong kind.

use super::{check, check_part};

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
            "a/b.toml:6: area.spacing: found a key that no job has, expected one of name, title, crs,",
            "origin_m, size_m, around, cover, spacing_m",
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
            "[importance], [features], [objects], [tiles], [load_modules], [limits], [tin], [lod], [exports]",
            "hint: did you mean [importance]?",
        ],
    );
    check_part("[importance]", "[roads]", "hint: [features] names files of roads, rivers and lakes");
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
            "effort, height_fit, lattice, sight, sight_eyes_m, sight_range_m, start, pins",
            "hint: configs/ntc.toml shows the usual keys with what they mean",
        ],
    );
    check(
        "[area]",
        "workers = 2\n[area]",
        &[
            "a/b.toml:1: workers: found a section or key that no job has, expected one of [area], [dem],",
            "[importance], [features], [objects], [tiles], [load_modules], [limits], [tin], [lod], [exports]",
            "hint: give it on the command line: --workers",
        ],
    );
    check(
        "[dem]",
        "[sample]\nseed = 2\n[dem]",
        &[
            "a/b.toml:7: sample: found a section or key that no job has, expected one of [area], [dem],",
            "[importance], [features], [objects], [tiles], [load_modules], [limits], [tin], [lod], [exports]",
            r#"hint: the sample terrain is chosen by source = "sample" and seed in [dem]"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ file = "m.geojson", clas = "m", weight = 1 }]"#,
        &[
            "a/b.toml:10: importance.areas[0].clas: found a key that no job has, expected one of file, raster,",
            "value, slope_above_percent, smooth_m, level_m, sample, class, weight",
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
            r#""EPSG:32611", or "auto" with around or cover"#,
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
            "raster, a whole number",
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
            "a/b.toml:10: importance.areas[0].weight: found nothing, expected a weight from 0 to 65.535,",
            "in whole thousandths",
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
            r#"a/b.toml:8: dem.sources: found the text "dem.tif", expected a list of 1 to 65536 paths and"#,
            "patterns of rasters",
            r#"hint: for example sources = ["dem/*.tif"]"#,
        ],
    );
    check(
        "default",
        r#"areas = { sample = "mountains" }"#,
        &[
            r#"a/b.toml:10: importance.areas: found the table { sample = "mountains" }, expected a list of at most"#,
            "1000 areas, each { file = … } or { raster = …, value = … } or { sample = … } or",
            "{ slope_above_percent = … } or { level_m = … }",
            r#"hint: for example areas = [{ file = "mountains.geojson", class = "mountains", weight = 1 }]"#,
        ],
    );
    check(
        "default",
        "areas = [3]",
        &[
            "a/b.toml:10: importance.areas[0]: found the whole number 3, expected a table of file, raster,",
            "value, slope_above_percent, smooth_m, level_m, sample, class, weight",
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
        &[r#"a/b.toml:18: tin.height_fit: found "l3", expected "l2" or "off""#, r#"hint: did you mean "l2"?"#],
    );
    check(
        "method",
        r#"height_fit = "l2_keep_crests""#,
        &[
            r#"a/b.toml:18: tin.height_fit: found "l2_keep_crests", expected "l2" or "off""#,
            "hint: crests are kept by sight = true, at less RMS residual: leave the key out",
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
