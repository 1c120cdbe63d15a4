//! Keys that do not go together, and sections with rules of their own.

use super::check;

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
            "a/b.toml:8: dem.sources: found [], expected a list of 1 to 65536 paths and patterns of rasters",
            r#"hint: for example sources = ["dem/*.tif"]"#,
        ],
    );
    check(
        "default",
        r#"areas = [{ file = "m.geojson", raster = "c.tif", class = "m", weight = 1 }]"#,
        &[
            r#"a/b.toml:10: importance.areas[0]: found { file = "m.geojson", raster = "c.tif", class = "m","#,
            r#"weight …, expected exactly one of file = "x.geojson", raster = "x.tif" with value, sample ="#,
            r#""mountains", slope_above_percent = 20, level_m = 0"#,
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
            r#"= "x.geojson", raster = "x.tif" with value, sample = "mountains", slope_above_percent = 20,"#,
            "level_m = 0",
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
            r#"a/b.toml:18: tin.height_fit: found the truth value false, expected "l2" or "off""#,
            r#"hint: for example height_fit = "l2""#,
        ],
    );
    check(
        "method",
        "sight = false\nsight_range_m = 500",
        &[
            "a/b.toml:19: tin.sight_range_m: found 500 beside sight = false, expected no such key, since no lines of",
            "sight count",
            "hint: remove one of the two",
        ],
    );
    check(
        "method",
        "effort = \"fast\"\nsight_range_m = 500",
        &[
            "a/b.toml:19: tin.sight_range_m: found 500 beside effort = \"fast\", expected no such key, since no",
            "lines of sight count",
            "hint: add sight = true, or remove it",
        ],
    );
    check(
        "method",
        "sight_eyes_m = [10, 1]",
        &[
            "a/b.toml:18: tin.sight_eyes_m: found [10, 1], expected [lowest, highest] in metres, 0.5 to 100",
            "hint: for example sight_eyes_m = [1, 10]",
        ],
    );
    check(
        "method",
        "sight_range_m = 5",
        &[
            "a/b.toml:18: tin.sight_range_m: found 5, expected metres from 100 to 10000",
            "hint: for example sight_range_m = 1000",
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
            "metres, neither negative nor above 131071",
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
            "a/b.toml:17: lod.levels[0]: found the number 0.5, expected a table of inner_share, leave_out",
            "hint: for example levels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]",
        ],
    );
    check(
        "pool",
        "[lod]\nlevels = [{ share = 0.5 }]",
        &[
            "a/b.toml:17: lod.levels[0].share: found a key that no job has, expected one of inner_share, leave_out",
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
