//! From rasters to a job that works: `init`, and areas that are found instead of stated.

use std::fs;

use crate::scene::{Scene, hills};

/// An ASCII grid of 81 x 81 posts at 25 m, its south-west post `east` m from 506000 E; `row` counts from the north.
fn grid(east: usize, height: impl Fn(usize, usize) -> String) -> String {
    let head = format!("ncols 81\nnrows 81\nxllcenter {}\nyllcenter 3876000\ncellsize 25\n", 506_000 + east);
    let row = |row: usize| (0..81).map(|col| height(row, col) + " ").collect::<String>() + "\n";
    head + &(0..81).map(row).collect::<String>()
}

#[test]
fn a_warning_fails_a_strict_build_only_and_what_it_built_is_whole_all_the_same() {
    let scene = Scene::new();
    fs::write(scene.path("here.asc"), grid(0, hills)).unwrap();
    fs::write(scene.path("away.asc"), grid(90_000, hills)).unwrap();
    scene.run_to(0, &["init", "here.asc", "--crs", "EPSG:32611", "--out", "job.toml"]);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let here = "{ file = \"here.asc\", crs = \"EPSG:32611\" }";
    assert!(job.contains(here), "{job}");
    scene.run_to(0, &["build", "job.toml", "--out", "calm.tdb", "--strict"]);
    let both = format!("{here}, {}", here.replace("here", "away"));
    fs::write(scene.path("job.toml"), job.replace(here, &both)).unwrap();
    let said = scene.run_to(0, &["build", "job.toml", "--out", "warned.tdb"]);
    assert!(said.stderr.contains("away.asc: it lies outside the area and is not used"), "{}", said.stderr);
    scene.run_to(2, &["build", "job.toml", "--out", "strict.tdb", "--strict"]);
    // Nothing has to be done again, and the warning is still there.
    scene.run_to(2, &["build", "job.toml", "--out", "warned.tdb", "--strict"]);
    for name in ["warned.tdb", "strict.tdb"] {
        scene.run_to(0, &["verify", name]);
        let slm = |name: &str| fs::read(scene.path(&format!("{name}/modules/r00c00.slm"))).unwrap();
        assert_eq!(slm(name), slm("calm.tdb"), "{name}");
    }
}

#[test]
fn a_job_that_init_writes_builds_at_once() {
    let scene = Scene::new();
    fs::write(scene.path("west.asc"), grid(0, hills)).unwrap();
    let holed = |row, col| if (20..23).contains(&row) && col == 40 { "-9999".into() } else { hills(row, col) };
    fs::write(scene.path("east.asc"), grid(2025, holed)).unwrap();
    let files = ["init", "west.asc", "east.asc", "--crs", "EPSG:32611", "--out", "here.toml"];
    let said = scene.run_to(0, &files);
    assert!(said.stdout.contains("here.toml is written"), "{}", said.stdout);
    let job = fs::read_to_string(scene.path("here.toml")).unwrap();
    for line in [
        "name = \"here\"",
        "crs = \"EPSG:32611\"",
        "origin_m = [506000, 3876000]",
        "size_m = [4000, 2000]",
        "{ file = \"east.asc\", crs = \"EPSG:32611\" },",
        "# Esri ASCII grid, EPSG:32611, 81 x 81 posts, 25 x 25 m, 700 to 796 m, 3\n",
        "    # void, heights above an unknown datum\n",
        "voids = { next_source = true, fill_within_posts = 8, hole = true }",
    ] {
        assert!(job.contains(line), "{line} is not in:\n{job}");
    }
    scene.run_to(0, &["build", "here.toml", "--workers", "1"]);
    scene.run_to(0, &["verify", "here.tdb"]);
    scene.run_to(0, &["build", "here.toml", "--workers", "3", "--out", "other.tdb"]);
    let manifest = |folder: &str| fs::read(scene.path(folder).join("database.json")).unwrap();
    assert!(manifest("here.tdb") == manifest("other.tdb"), "any number of workers makes the same of a mosaic");
    scene.refuses(&files, &["here.toml", "found a file"]);
}

#[test]
fn the_sea_of_a_raster_is_water_in_the_job_that_init_writes() {
    let scene = Scene::new();
    let coast = |row: usize, col: usize| if col < 50 { "0".into() } else { (3 * (col - 49) + row % 7).to_string() };
    fs::write(scene.path("coast.asc"), grid(0, coast)).unwrap();
    scene.run_to(0, &["init", "coast.asc", "--crs", "EPSG:32611", "--out", "job.toml"]);
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    let (said, area) =
        ("The sea: 62 % of the posts lie level at 0 m", "{ level_m = 0, class = \"water\", weight = 1 }");
    assert!(job.contains(said) && job.contains(area), "{job}");
    scene.run_to(0, &["build", "job.toml", "--out", "a.tdb", "--strict"]);
    scene.run_to(0, &["verify", "a.tdb"]);
    scene.run_to(0, &["export", "a.tdb", "--format", "obj", "--out", "a.obj"]);
    let text = fs::read_to_string(scene.path("a.obj")).unwrap();
    let (mut heights, mut material, mut wet) = (Vec::new(), "", Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words[0] {
            "v" => heights.push(words[3].parse::<f64>().unwrap()),
            "usemtl" => material = words[1],
            "f" if material.contains("water") => {
                let corner = |word: &&str| word.split('/').next().unwrap().parse::<usize>().unwrap();
                wet.push(words[1..].iter().map(corner).map(|at| heights[at - 1]).fold(0.0, f64::max));
            }
            _ => {}
        }
    }
    let level = wet.iter().filter(|height| **height < 0.1).count();
    assert!(!wet.is_empty() && wet.len() <= 2 * level, "{level} of {} triangles of water lie level", wet.len());
    let nowhere = job.replace("level_m = 0", "level_m = -7.5");
    fs::write(scene.path("nowhere.toml"), nowhere).unwrap();
    let said = scene.run_to(0, &["build", "nowhere.toml"]).stderr;
    assert!(said.contains("importance.areas[0] matches nothing: nowhere in the area"), "{said}");
}

#[test]
fn init_says_what_a_file_lacks() {
    let scene = Scene::new();
    fs::write(scene.path("a.asc"), grid(0, hills)).unwrap();
    scene.refuses(&["init", "a.asc"], &["a.asc", "no coordinate reference system"]);
    scene.refuses(&["init", "a.asc", "--crs", "EPSG:4267"], &["--crs", "needs a grid of shifts"]);
    let small = grid(0, hills).replace("cellsize 25", "cellsize 5");
    fs::write(scene.path("small.asc"), small).unwrap();
    scene.refuses(&["init", "small.asc", "--crs", "EPSG:32611"], &["no", "load module"]);
    scene.refuses(&["init", "none.tif"], &["none.tif"]);
}

#[test]
fn an_area_is_found_around_a_place_and_over_the_sources() {
    let scene = Scene::new();
    fs::write(scene.path("a.asc"), grid(0, hills)).unwrap();
    let job = |area: &str, dem: &str| {
        let area = format!("[area]\nname = \"a\"\ncrs = \"auto\"\n{area}\nspacing_m = 25\n");
        format!("{area}[dem]\n{dem}\n[tin]\nmethod = \"optimised\"\n")
    };
    let sources = "sources = [{ file = \"a.asc\", crs = \"EPSG:32611\" }]";
    fs::write(scene.path("cover.toml"), job("cover = \"dem\"", sources)).unwrap();
    let plan = scene.run_to(0, &["plan", "cover.toml"]).stdout;
    assert!(plan.contains("[506000, 3876000]") && plan.contains("[2000, 2000]"), "{plan}");
    scene.run_to(0, &["build", "cover.toml"]);
    let around = "around = { lat = 35.3, lon = -116.6, size_km = [4, 2.2] }";
    fs::write(scene.path("around.toml"), job(around, "source = \"sample\"")).unwrap();
    let plan = scene.run_to(0, &["plan", "around.toml", "--out", "b.tdb"]).stdout;
    // The middle is 536367 E, 3906386 N; 2.2 km are five load modules.
    assert!(plan.contains("EPSG:32611") && plan.contains("[4000, 2500]"), "{plan}");
    assert!(plan.contains("534375.00  3905125.00") && plan.contains("35.28"), "corners in both systems: {plan}");
    fs::write(scene.path("none.toml"), job("cover = \"dem\"", "source = \"sample\"")).unwrap();
    scene.refuses(&["plan", "none.toml"], &["area.cover", "no raster"]);
}

#[test]
fn ground_that_no_source_reaches_is_shown_on_a_map_unless_it_may_be_a_hole() {
    let scene = Scene::new();
    fs::write(scene.path("a.asc"), grid(0, hills)).unwrap();
    let job = |voids: &str| {
        format!(
            "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [505000, 3876000]\nsize_m = [3000, 2000]\n\
             spacing_m = 25\n[dem]\nresampling = \"cubic\"\nvoids = \"{voids}\"\n\
             sources = [{{ file = \"a.asc\", crs = \"EPSG:32611\" }}]\n[tin]\nmethod = \"optimised\"\n"
        )
    };
    fs::write(scene.path("job.toml"), job("fail")).unwrap();
    scene.refuses(&["build", "job.toml"], &["no source reaches 3240 of 9801 posts"]);
    let map = scene.run_to(2, &["build", "job.toml"]).stderr;
    assert!(map.contains("...............+#####") && map.contains("hint: add a source"), "{map}");
    fs::write(scene.path("job.toml"), job("hole")).unwrap();
    scene.run_to(0, &["build", "job.toml"]);
    let report = scene.run_to(0, &["report", "a.tdb"]).stdout;
    assert!(report.contains("3,240"), "{report}");
}

#[test]
fn heights_above_different_datums_are_not_mixed_and_unknown_ones_are_told() {
    let scene = Scene::new();
    fs::write(scene.path("a.asc"), grid(0, hills)).unwrap();
    let job = |dem: &str, said: &str| {
        format!(
            "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [506000, 3876000]\nsize_m = [2000, 2000]\n\
             spacing_m = 25\n[dem]\n{dem}\nsources = [{{ file = \"a.asc\", crs = \"EPSG:32611\"{said}]\n\
             [tin]\nmethod = \"optimised\"\n"
        )
    };
    let above = "vertical_datum = \"EGM96\"";
    fs::write(scene.path("job.toml"), job(above, ", vertical_datum = \"ellipsoid\" }")).unwrap();
    scene.refuses(&["build", "job.toml"], &["dem.vertical_datum", "ellipsoid", "EGM96", "geoid"]);
    fs::write(scene.path("job.toml"), job(above, ", vertical_datum = \"egm 96\" }")).unwrap();
    scene.run_to(0, &["build", "job.toml"]);
    // The job speaks for sources of which none says anything, and for none beside one that does.
    fs::write(scene.path("job.toml"), job(above, " }")).unwrap();
    scene.run_to(0, &["build", "job.toml", "--strict"]);
    fs::copy(scene.path("a.asc"), scene.path("b.asc")).unwrap();
    let beside = " }, { file = \"b.asc\", crs = \"EPSG:32611\", vertical_datum = \"EGM96\" }";
    fs::write(scene.path("job.toml"), job(above, beside)).unwrap();
    let said = scene.run_to(0, &["build", "job.toml"]).stderr;
    assert!(said.contains("does not say what its heights are measured from"), "{said}");
}

#[test]
fn a_file_beside_a_source_that_changes_between_two_builds_is_noticed() {
    let scene = Scene::new();
    fs::write(scene.path("a.asc"), grid(0, hills)).unwrap();
    let system = |zone: u32| fs::write(scene.path("a.prj"), format!("PROJCS[\"x\",AUTHORITY[\"EPSG\",\"326{zone}\"]]"));
    system(11).unwrap();
    scene.run_to(0, &["init", "a.asc", "--out", "job.toml"]);
    scene.run_to(0, &["build", "job.toml"]);
    let again = scene.run_to(0, &["build", "job.toml"]).stderr;
    assert!(again.contains("nothing changed"), "{again}");
    system(12).unwrap();
    let moved = scene.run_to(2, &["build", "job.toml"]).stderr;
    assert!(moved.contains("a.asc: it lies outside the area"), "{moved}");
}
