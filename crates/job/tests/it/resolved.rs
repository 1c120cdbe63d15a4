//! What a job becomes: defaults, units, the canonical text, and the job files of the project.

use std::path::{Path, PathBuf};

use job::{
    Allocation, AreaShape, Budget, ClipHeights, Count, DemSource, Edges, Effort, ErrorKey, HeightFit, Job, LastBatch,
    Lattice, LodBorder, Method, Optimising, Proximity, SampleClass, Sight, TileOrder, Voids, WindowLimit,
    deciding_lines,
};
use terrain::ModuleGrid;

const SHORTEST: &str = r#"
[area]
name = "small"
crs = "EPSG:32611"
origin_m = [-500.5, 3875000]
size_m = [3000, 2500]
spacing_m = 12.5
[dem]
source = "sample"
"#;

fn job(text: &str) -> Job {
    Job::from_text(text, Path::new("jobs/x.toml")).unwrap()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_shortest_job_has_the_documented_defaults() {
    let job = job(SHORTEST);
    assert_eq!(job.area.grid, ModuleGrid { rows: 5, cols: 6, side_cells: 40 });
    assert_eq!((job.area.size_m(), job.area.spacing.sixteenths()), ([3000.0, 2500.0], 200));
    assert_eq!(job.dem.source, DemSource::Sample { seed: 1 });
    assert_eq!((job.dem.voids, job.importance.default_weight), (Voids::Fail, 1000));
    assert_eq!((job.tiles.rows, job.tiles.columns, job.tiles.order), (2, 3, TileOrder::Color));
    assert_eq!((job.modules.side_quanta, job.modules.border_step_cells), (64_000, 10));
    assert_eq!((job.modules.edges, job.limits.count), (Edges::Constrained, Count::Triangles));
    assert_eq!((job.limits.per_load_module, job.limits.pool), (100, 0));
    assert_eq!(job.limits.area_budget(&job.area.grid), 32 * 30);
    assert_eq!(job.limits.window, WindowLimit { limit: 4096, rows: 5, cols: 6 });
    let usual = Optimising {
        effort: Effort::Normal,
        height_fit: HeightFit::Squares,
        lattice: Lattice::Eighth,
        sight: Some(Sight { eyes_quanta: [128, 1280], range_quanta: 128_000 }),
    };
    assert_eq!(job.tin.method, Method::Optimised(usual));
    assert_eq!((job.tin.key, job.tin.budget), (ErrorKey::Sse, Budget::Limits));
    assert_eq!((job.tin.allocation, job.tin.residual_quantum), (Allocation::Global, 1));
}

#[test]
fn materials_are_called_as_the_job_says_and_nothing_that_is_built_depends_on_it() {
    let with = |materials: &str| format!("{SHORTEST}[exports.materials]\n{materials}\n");
    let named = job(&with("wood_top = \"leaves\"\nbuilding_wall = { name = \"plaster\", surface_code = 12 }"));
    let wall = &named.materials[0];
    assert_eq!((wall.of.as_str(), wall.name.as_str(), wall.surface_code), ("building_wall", "plaster", Some(12)));
    assert_eq!((named.materials[1].name.as_str(), named.materials[1].feature_id), ("leaves", None));
    let text = named.canonical_text();
    assert_eq!(job(&text).materials, named.materials, "{text}");
    assert!(deciding_lines(&text).eq(deciding_lines(&job(SHORTEST).canonical_text())));
    for (materials, expected) in [
        ("wood_tip = \"leaves\"", ["exports.materials.wood_tip", "did you mean \"wood_top\"?"]),
        ("wood_top = \"a b\"", ["exports.materials.wood_top: found \"a b\"", "no other names"]),
        ("wood_top = 3", ["exports.materials.wood_top: found the whole number 3", "for example"]),
        (
            "wood_top = { name = \"a\", code = 3 }",
            ["exports.materials.wood_top.code", "name, surface_code, feature_id"],
        ),
        ("wood_top = { surface_code = 3 }", ["exports.materials.wood_top.name", "found nothing"]),
        ("wood_top = { name = \"a\", feature_id = 40000 }", ["feature_id: found 40000", "0 to 32767"]),
    ] {
        let told = Job::from_text(&with(materials), Path::new("x.toml")).unwrap_err();
        let told = format!("{told} {}", told.hint());
        assert!(expected.iter().all(|part| told.contains(part)), "{materials}: {told}");
    }
}

#[test]
fn a_title_is_listed_and_kept_where_it_is_given_and_nowhere_else() {
    let plain = job(SHORTEST);
    assert_eq!(plain.area.title, None);
    assert!(!plain.canonical_text().contains("title"));
    let titled = job(&SHORTEST.replace("[area]", "[area]\ntitle = \"Fort \\\"Irwin\\\", west – 2026\""));
    assert_eq!(titled.area.title.as_deref(), Some("Fort \"Irwin\", west – 2026"));
    assert!(titled.describe().iter().any(|setting| setting.key == "area.title"));
    assert_eq!(job(&titled.canonical_text()).area, titled.area);
}

#[test]
fn the_window_covers_four_kilometres() {
    let sized = |side: u32, step: u32| {
        let size = side * 60;
        let text = SHORTEST.replace("[3000, 2500]", &format!("[{size}, {size}]")).replace("12.5", "6.25");
        job(&format!("{text}[load_modules]\nside_m = {side}\nborder_step_m = {step}")).limits.window
    };
    assert_eq!(sized(500, 125), WindowLimit { limit: 4096, rows: 8, cols: 8 });
    assert_eq!(sized(250, 125), WindowLimit { limit: 4096, rows: 16, cols: 16 });
    // 4 km is 10.67 load modules of 375 m: the window that covers it is 11 wide.
    assert_eq!(sized(375, 125), WindowLimit { limit: 4096, rows: 11, cols: 11 });
}

#[test]
fn weights_and_classes_become_small_integers() {
    let areas = r#"
[importance]
default = 8
areas = [
    { file = "a.geojson", class = "rough", weight = 0.125 },
    { raster = "c.tif", value = -3, class = "lake", weight = 0 },
    { sample = "mountains", class = "rough", weight = 65.535 },
    { file = "b.geojson", class = "default", weight = 2 },
]
"#;
    let importance = job(&format!("{SHORTEST}{areas}")).importance;
    assert_eq!(importance.classes, ["default", "rough", "lake"]);
    let parts: Vec<_> = importance.areas.iter().map(|area| (area.class, area.weight)).collect();
    assert_eq!((importance.default_weight, parts), (8000, vec![(1, 125), (2, 0), (1, 65_535), (0, 2000)]));
    let AreaShape::RasterValue { file, value } = &importance.areas[1].shape else { panic!("a raster") };
    assert_eq!((file.path.as_path(), file.written.as_str(), *value), (Path::new("jobs/c.tif"), "c.tif", -3));
}

#[test]
fn clipped_edges_and_batches_carry_their_own_keys() {
    let paper = "[load_modules]\nedges = \"clip\"\n[tin]\nmethod = \"paper\"\npoints = 76_500\n";
    let usual = job(&format!("{SHORTEST}{paper}"));
    assert_eq!(usual.modules.edges, Edges::Clip(ClipHeights::Coplanar));
    let proximity = Some(Proximity { horizontal_m: 300.0, vertical_m: 20.0 });
    assert_eq!(usual.tin.method, Method::Paper { proximity, last_batch: LastBatch::Truncate });
    assert_eq!((usual.tin.budget, usual.tin.key), (Budget::Points(76_500), ErrorKey::Max));
    assert_eq!((usual.tin.allocation, usual.tin.residual_quantum), (Allocation::Equal, 128));
    let other = job(&format!("{SHORTEST}{paper}proximity = false\nlast_batch = \"finish\"\nkey = \"sse\""));
    assert_eq!(other.tin.method, Method::Paper { proximity: None, last_batch: LastBatch::Finish });
    assert_eq!(other.tin.key, ErrorKey::Sse);
}

#[test]
fn every_word_of_the_optimised_method_is_read_and_written_back() {
    let optimising = |line: String| {
        let job = job(&format!("{SHORTEST}[tin]\n{line}\n"));
        check_canonical(&job);
        assert!(job.canonical_text().contains(&line), "{line}");
        let Method::Optimised(optimising) = job.tin.method else { panic!("the default method") };
        optimising
    };
    for (word, effort) in [("fast", Effort::Fast), ("normal", Effort::Normal), ("best", Effort::Best)] {
        let sight = (effort != Effort::Fast).then(Sight::default);
        let expected = Optimising { effort, sight, ..Optimising::default() };
        assert_eq!(optimising(format!("effort = \"{word}\"")), expected);
    }
    for (word, height_fit) in [("l2", HeightFit::Squares), ("off", HeightFit::Off)] {
        let expected = Optimising { height_fit, ..Optimising::default() };
        assert_eq!(optimising(format!("height_fit = \"{word}\"")), expected);
    }
    for (sight, expected) in [("true", Some(Sight::default())), ("false", None)] {
        assert_eq!(optimising(format!("sight = {sight}")).sight, expected);
    }
    let far = optimising("sight_eyes_m = [2.5, 2.5]\nsight_range_m = 500".into()).sight;
    assert_eq!(far, Some(Sight { eyes_quanta: [320, 320], range_quanta: 64_000 }));
    for (word, lattice) in [("eighth", Lattice::Eighth), ("post", Lattice::Post)] {
        let expected = Optimising { lattice, ..Optimising::default() };
        assert_eq!(optimising(format!("lattice = \"{word}\"")), expected);
    }
}

#[test]
fn levels_are_shares_of_the_finest() {
    let finest = job(SHORTEST);
    assert_eq!(finest.lod.level_count(), 1);
    assert_eq!(job(&format!("{SHORTEST}[lod]\nlevels = []\n")).canonical_text(), finest.canonical_text());
    let three = job(&format!("{SHORTEST}[lod]\nlevels = [{{ inner_share = 0.5 }}, {{ inner_share = 2e-1 }}]\n"));
    assert_eq!((three.lod.inner_shares.as_slice(), three.lod.border), ([0.5, 0.2].as_slice(), LodBorder::Full));
    let described: Vec<String> = three.describe().into_iter().map(|s| format!("{} = {}", s.key, s.value)).collect();
    let levels = "lod.levels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]";
    assert_eq!(described[described.len() - 2..], [levels, r#"lod.border = "full""#]);
    check_canonical(&three);
    let own = job(&format!("{SHORTEST}[lod]\nlevels = [{{ inner_share = 0.125 }}]\nborder = \"own\"\n"));
    assert_eq!((own.lod.level_count(), own.lod.border), (2, LodBorder::Own));
    check_canonical(&own);
}

/// The canonical text of a job reads back as the same settings, and is its own canonical text.
#[track_caller]
fn check_canonical(job: &Job) {
    let text = job.canonical_text();
    let again = Job::from_text(&text, &job.path).unwrap();
    assert_eq!(again.canonical_text(), text);
    assert_eq!((again.area, again.importance, again.tiles), (job.area.clone(), job.importance.clone(), job.tiles));
    assert_eq!((again.modules, again.limits, again.tin), (job.modules, job.limits, job.tin.clone()));
    assert_eq!(again.lod, job.lod);
}

#[test]
fn the_canonical_text_is_the_same_job() {
    let variants = [
        "",
        "voids = { fill_within_posts = 8 }\nvertical_datum = \"EGM \\\"96\\\"\"\n",
        "[tin]\nmethod = \"greedy\"\nkey = \"sse\"\nresidual_quantum_m = 0.5\nmax_residual_m = 0\n",
        "[tin]\ntarget_rms_m = 1.25\nallocation = \"equal\"\n[load_modules]\nside_m = 250\n",
        "[tin]\nmethod = \"paper\"\npoints = 9\nproximity = false\n[load_modules]\nedges = \"clip\"\n",
        "[limits]\nmean_per_load_module = 31.7\npool = 12\n[tiles]\norder = \"raster\"\ncolumns = 1\n",
        "[importance]\ndefault = 0.001\nareas = [{ sample = \"mountains\", class = \"m \\\\ n\", weight = 3 }]\n",
    ];
    let ground = "water = { file = \"w.gpkg\", level_m = -0.5, class = \"sea\", weight = 0 }\n\
        geoids = [{ datum = \"EGM96\", file = \"g.gtx\" }]\n[importance]\n\
        areas = [{ slope_above_percent = 12.5, smooth_m = 400, class = \"sea\", weight = 1 }]\n";
    check_canonical(&job(&format!("{SHORTEST}{ground}")));
    check_canonical(&job(&format!("{SHORTEST}water = \"w.shp\"\n")));
    let voids = ["\"hole\"", "\"next_source\"", "{ hole = true, next_source = true }"];
    let voids = voids.map(|voids| format!("voids = {voids}\n"));
    let all = "voids = { next_source = true, fill_within_posts = 3, hole = true }\nresampling = \"cubic\"\n\
        feather_m = 250.5\n";
    for variant in variants.into_iter().chain(voids.iter().map(String::as_str)).chain([all]) {
        check_canonical(&job(&format!("{SHORTEST}{variant}")));
    }
    let no = |voids: &str| job(&format!("{SHORTEST}voids = {voids}\n")).dem.voids;
    assert_eq!(no("{ hole = false }"), no("\"fail\""), "a table that says no");
    let sources = r#"sources = ["a.tif", { file = "b.hgt", crs = "EPSG:4326", corner = [35, -117], nodata = -9999,
        height_unit_m = 0.3048, vertical_datum = "EGM96", attribution = "NASA" }]
feather_m = 5"#;
    let several = job(&SHORTEST.replace("source = \"sample\"", sources));
    check_canonical(&several);
    let again = Job::from_text(&several.canonical_text(), &several.path).unwrap();
    assert_eq!(again.dem, several.dem);
    let sample = AreaShape::Sample(SampleClass::Mountains);
    assert_eq!(job(&format!("{SHORTEST}{}", variants[6])).importance.areas[0].shape, sample);
}

#[test]
fn the_canonical_text_does_not_depend_on_layout_order_or_place() {
    let other = r#"dem = { seed = 0x1, source = 'sample' } # inline
area.spacing_m = 12.50
area.size_m = [3e3, 2_500]
area.origin_m = [-5005e-1, 3875000.0]
area.crs = "EPSG:32611"
area.name = "small"
"#;
    let other = Job::from_text(other, Path::new("/somewhere/else.toml")).unwrap();
    assert_eq!(other.canonical_text(), job(SHORTEST).canonical_text());
}

#[test]
fn every_setting_is_described_with_value_and_meaning() {
    let described: Vec<String> =
        job(SHORTEST).describe().into_iter().map(|s| format!("{} = {}: {}", s.key, s.value, s.meaning)).collect();
    assert_eq!(
        described,
        [
            r#"area.name = "small": name of the area and of its database"#,
            r#"area.crs = "EPSG:32611": projected coordinate system"#,
            "area.origin_m = [-500.5, 3875000]: east and north of the south-west post",
            "area.size_m = [3000, 2500]: size of the area, west to east and south to north: 6 x 5 load modules",
            "area.spacing_m = 12.5: distance between posts of the working grid: 241 x 201 posts",
            r#"dem.source = "sample": the built-in basin-and-range terrain"#,
            "dem.seed = 1: which one of its terrains",
            r#"dem.voids = "fail": a post without a height is an error"#,
            "importance.default = 1: weight of every post that no area holds",
            "importance.areas = []: all ground matters the same",
            r#"importance.smooth = "binomial-7": weights are softened across 7 x 7 posts"#,
            "tiles.columns = 3: tiles west to east, each 2 load modules wide",
            "tiles.rows = 2: tiles south to north, each 2 or 3 load modules high",
            r#"tiles.order = "colour": four colours: most tiles at once"#,
            r#"tiles.borders = "inherit": a tile takes over the border points of its lower-ranked neighbours"#,
            "load_modules.side_m = 500: a side of a load module, a multiple of its border step: 40 cells",
            concat!(
                "load_modules.border_step_m = 125: between points on a fixed outer border, a multiple ",
                "of the spacing: 10 cells"
            ),
            concat!(
                r#"load_modules.outer_border = "refined": points on the outer border are chosen as "#,
                "others are, within the limits"
            ),
            r#"load_modules.edges = "constrained": module lines are edges of the TIN from the start"#,
            r#"limits.count = "triangles": limits count triangles, clipped pieces fanned"#,
            "limits.per_load_module = 100: at most in one load module",
            "limits.pool = 0: at most above that in the whole area together",
            "limits.mean_per_load_module = 32: at most on average over all load modules: 960 in the whole area",
            concat!(
                "limits.per_4km_square = 4096: at most in every window of load modules that covers 4 ",
                "km: 5 x 6 of them (2500 m x 3000 m)"
            ),
            r#"tin.method = "optimised": lowest RMS residual under the limits"#,
            r#"tin.key = "sse": a triangle is worth its weighted squared residuals"#,
            r#"tin.allocation = "global": tiles share by what a survey says they gain"#,
            concat!(
                r#"tin.effort = "normal": more still, thinned by true cost, deep flips: 16 % less RMS "#,
                "residual than fast; 24 s of a core for a million triangles"
            ),
            r#"tin.height_fit = "l2": vertices stand where squared residuals are least"#,
            r#"tin.lattice = "eighth": vertices stand on eighths of a post, those on lines between tiles on posts"#,
            "tin.sight = true: whether ground that decides what is seen from elsewhere counts more than other ground",
            concat!(
                "tin.sight_eyes_m = [1, 10]: how high above the ground eyes are, and what they look at: the lowest ",
                "and the highest"
            ),
            "tin.sight_range_m = 1000: how far they look; at most 160 posts",
        ]
    );
}

#[test]
fn the_project_s_own_jobs_are_sound() {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(root().join("configs")).unwrap() {
        let path = entry.unwrap().path();
        let job = Job::from_text(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
        check_canonical(&job);
        assert_eq!(path.file_stem().unwrap().to_str(), Some(job.area.name.as_str()), "a job is named as its file");
        names.push((job.area.name.clone(), job.area.grid.rows, job.area.grid.cols, job.tiles.rows * job.tiles.columns));
    }
    names.sort();
    let expected = [("ntc", 100, 100, 36), ("paper", 100, 100, 36)];
    assert_eq!(names, expected.map(|(name, rows, cols, tiles)| (name.to_owned(), rows, cols, tiles)));
}

#[test]
fn jobs_on_real_terrain_find_it() {
    for name in ["desert.toml", "alps.toml"] {
        let path = root().join("tests/jobs").join(name);
        let named = Job::from_text(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
        let DemSource::Files { files, .. } = &named.dem.source else { panic!("the job names files") };
        if !files[0].path.exists() {
            eprintln!("skipped: {} is not here", files[0].path.display());
            continue;
        }
        assert_eq!(Job::load(&path).unwrap(), named);
    }
}
