//! What a build does again after a change, what it says of it, and that the bytes are those of a fresh build.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use build::{Event, Progress, Stage};
use job::Job;
use terrain::{Dem, Post, TileId};

use crate::features::{Drawn, geojson, line, polygon};
use crate::product::Product;
use crate::scene::{Scene, Words, assert_same, sample_dem, tile};

/// Keeps what was told.
#[derive(Default)]
struct Heard {
    because: Vec<(TileId, String)>,
    profiled: Vec<TileId>,
    surveyed: usize,
    assembled: usize,
    notes: Vec<String>,
    entered: Vec<Stage>,
}

impl Progress for Heard {
    fn tell(&mut self, event: Event) {
        match event {
            Event::Because(Stage::Refine, tile, why) => self.because.push((tile, why)),
            Event::Done(Stage::Profile, tile) => self.profiled.push(tile),
            Event::Done(Stage::Survey, _) => self.surveyed += 1,
            Event::Done(Stage::Assemble, _) => self.assembled += 1,
            Event::Note(text) => self.notes.push(text),
            Event::Enter(stage, _) => self.entered.push(stage),
            _ => {}
        }
    }
}

/// Builds `area` again, and gives what was told and the tiles that were refined, which a fresh build then equals.
#[track_caller]
fn rebuilt(scene: &Scene, what: &str) -> (Heard, BTreeSet<TileId>) {
    let mut heard = Heard::default();
    let built = scene.build_watched("area", 2, &false.into(), &mut heard).unwrap_or_else(|error| panic!("{error}"));
    let refined: BTreeSet<TileId> = heard.because.iter().map(|(tile, _)| *tile).collect();
    assert_eq!(built.rebuilt, refined.len(), "{what}: not every tile that was refined says why: {:?}", heard.because);
    drop(built);
    fs::remove_dir_all(scene.path("fresh")).ok();
    drop(scene.build("fresh", 2));
    assert_same(&scene.product("fresh"), &scene.product("area"), what);
    (heard, refined)
}

fn words() -> Words {
    // Nothing is shared out over the whole area, so a change stays where borders lead it.
    Words { tin: "method = \"greedy\"\nallocation = \"equal\"".into(), ..Words::raster() }
}

fn with_block(dem: &Dem, low: Post, high: Post) -> Dem {
    let inside = |post: Post| (low.row..=high.row).contains(&post.row) && (low.col..=high.col).contains(&post.col);
    Dem::from_fn(dem.rect(), |post| {
        Some(dem.height(post) + if inside(post) { 128 * ((post.row * post.col) % 37) } else { 0 })
    })
}

#[test]
fn nothing_changed_means_nothing_done_and_no_stage_but_reading() {
    for words in [words(), Words::raster()] {
        let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
        let built = scene.build("area", 2);
        let report = built.report.clone();
        drop(built);
        let before = crate::scene::tree(&scene.path("area"));
        let mut heard = Heard::default();
        let again = scene.build_watched("area", 2, &false.into(), &mut heard).unwrap();
        assert!(again.is_unchanged && again.report == report);
        assert_eq!((again.kept, again.rebuilt, heard.entered), (9, 0, vec![Stage::Read]));
        drop(again);
        assert!(before == crate::scene::tree(&scene.path("area")), "a build that does nothing changed a file");
    }
}

#[test]
fn without_its_report_a_finished_database_is_walked_through_again() {
    let scene = Scene::new(&Words::sample());
    drop(scene.build("area", 2));
    scene.forget_report("area");
    let again = scene.build("area", 2);
    assert_eq!((again.is_unchanged, again.kept, again.rebuilt), (false, 9, 0));
}

#[test]
fn a_changed_block_of_the_dem_reaches_its_tile_and_what_its_borders_lead_to() {
    for order in ["colour", "raster"] {
        let words = Words { order: format!("order = \"{order}\""), ..words() };
        let ground = sample_dem(words.grid(), 1);
        let scene = Scene::on(&words, &ground);
        drop(scene.build("area", 2));
        for (low, high, within) in
            [(Post::new(20, 20), Post::new(40, 50), tile(0, 0)), (Post::new(80, 100), Post::new(100, 120), tile(1, 1))]
        {
            scene.replace_dem(&with_block(&ground, low, high));
            let (heard, refined) = rebuilt(&scene, order);
            let why =
                |tile: TileId| heard.because.iter().find(|(other, _)| *other == tile).map(|(_, why)| why.as_str());
            assert!(why(within).unwrap().contains("its heights changed"), "{order}: {:?}", heard.because);
            assert!(refined.len() < 9, "{order}: {within} reached every tile");
            for (other, why) in heard.because.iter().filter(|(other, _)| *other != within) {
                let is_expected = why.contains("border") || why.contains("heights");
                assert!(is_expected, "{order}: {other} was refined again: {why}");
            }
            assert!(heard.notes.iter().any(|note| note.contains("refined again")), "{:?}", heard.notes);
            assert_eq!(heard.assembled, refined.len(), "{order}: load modules of tiles that were kept were made again");
        }
    }
}

#[test]
fn a_changed_mask_reaches_the_tiles_it_weighs() {
    let polygon = |east: f64| {
        let corner = |e: f64, n: f64| format!("[{}, {}]", 505_000.0 + e, 3_875_000.0 + n);
        let ring = [(200.0, 200.0), (east, 200.0), (east, 900.0), (200.0, 900.0), (200.0, 200.0)];
        let ring: Vec<String> = ring.iter().map(|&(e, n)| corner(e, n)).collect();
        format!(
            "{{\"type\":\"FeatureCollection\",\"crs\":{{\"type\":\"name\",\"properties\":{{\"name\":\"EPSG:32611\"}}}},\
             \"features\":[{{\"type\":\"Feature\",\"properties\":{{}},\"geometry\":{{\"type\":\"Polygon\",\
             \"coordinates\":[[{}]]}}}}]}}",
            ring.join(",")
        )
    };
    let importance = "default = 8\nareas = [{ file = \"m.geojson\", class = \"m\", weight = 1 }]".to_owned();
    let words = Words { importance, ..words() };
    let ground = sample_dem(words.grid(), 1);
    let scene = Scene::with_files(&words, |folder: &Path| {
        crate::scene::write_dem(&folder.join("dem.tif"), &ground);
        fs::write(folder.join("m.geojson"), polygon(1200.0)).unwrap();
    });
    drop(scene.build("area", 2));
    fs::write(scene.path("m.geojson"), polygon(900.0)).unwrap();
    let (heard, refined) = rebuilt(&scene, "mask");
    assert!(refined.contains(&tile(0, 0)) && refined.len() < 9, "{refined:?}");
    assert!(heard.because.iter().any(|(at, why)| *at == tile(0, 0) && why.contains("its weights changed")));
}

/// A road along the south, a stream through the middle, a lake in the west, and a track in the north-east that ends at
/// so many metres east.
fn features(track_to: f64) -> String {
    let drawn = [
        line("highway=primary", &[(-100.0, 300.0), (2000.0, 500.0), (5200.0, 400.0)]),
        line("waterway=stream", &[(2300.0, 4700.0), (2500.0, 2000.0), (2400.0, -100.0)]),
        polygon("natural=water", &[(300.0, 2000.0), (900.0, 2050.0), (850.0, 2500.0), (320.0, 2400.0)]),
        line("highway=track", &[(3600.0, 3500.0), (4000.0, 4200.0), (track_to, 4000.0)]),
    ];
    geojson(&drawn)
}

#[test]
fn a_road_more_or_less_changes_heights_of_what_it_hangs_together_with_only() {
    // There is room for all of it, so that none is thinned to let another in.
    let words = Words { features: "sources = [\"features.geojson\"]\nshare_max = 0.9".into(), ..words() };
    let dem = sample_dem(words.grid(), 1);
    let network = |more: &[Drawn]| {
        let roads = [
            line("highway=primary", &[(-100.0, 300.0), (2000.0, 500.0), (5200.0, 400.0)]),
            line("highway=track", &[(700.0, 100.0), (900.0, 1500.0)]),
            line("waterway=stream", &[(2300.0, 4700.0), (2500.0, 2000.0), (2400.0, -100.0)]),
            line("highway=track", &[(3900.0, 3900.0), (4000.0, 4200.0), (4600.0, 4000.0)]),
        ];
        geojson(&[&roads, more].concat())
    };
    // A road that closes a loop of tracks.
    let more = [line("highway=residential", &[(3900.0, 3900.0), (4300.0, 3800.0), (4600.0, 4000.0)])];
    let scene = Scene::with_files(&words, |folder: &Path| {
        crate::scene::write_dem(&folder.join("dem.tif"), &dem);
        fs::write(folder.join("features.geojson"), network(&[])).unwrap();
    });
    drop(scene.build("area", 2));
    let folder = store::Folder::new(scene.path("area"));
    let all = || (0..3).flat_map(|row| (0..3).map(move |col| tile(row, col)));
    let lines = || -> Vec<_> { all().map(|tile| folder.read_lines(tile).unwrap().1).collect() };
    let alone = lines();
    for more in [&more[..], &[]] {
        fs::write(scene.path("features.geojson"), network(more)).unwrap();
        let (heard, _) = rebuilt(&scene, "a road more or less");
        assert_eq!(heard.profiled, [tile(2, 2)], "the ground is asked anew where the road is");
        for (at, why) in &heard.because {
            // Elsewhere only the triangles that the road leaves are others.
            let is_its = *at == tile(2, 2);
            assert_eq!(why.contains("roads, rivers or lakes in it changed"), is_its, "{at}: {why}");
            assert_eq!(why.contains("heights"), is_its, "{at}: {why}");
        }
        for ((at, before), after) in all().zip(&alone).zip(&lines()) {
            assert_eq!(before == after, at != tile(2, 2) || more.is_empty(), "what is in the ground of {at}");
        }
    }
}

#[test]
fn a_moved_road_rebuilds_only_tiles_that_it_reaches_each_with_its_cause() {
    let words = Words { features: "sources = [\"features.geojson\"]".into(), ..words() };
    let dem = sample_dem(words.grid(), 1);
    let scene = Scene::with_files(&words, |folder: &Path| {
        crate::scene::write_dem(&folder.join("dem.tif"), &dem);
        fs::write(folder.join("features.geojson"), features(4600.0)).unwrap();
    });
    drop(scene.build("area", 2));
    // As many triangles as before, so that no threshold moves.
    fs::write(scene.path("features.geojson"), features(4599.0)).unwrap();
    let (heard, refined) = rebuilt(&scene, "a moved road");
    assert_eq!(heard.profiled, [tile(2, 2)], "the ground is asked anew where the road was moved");
    assert!(refined.contains(&tile(2, 2)) && refined.len() < 9, "{refined:?}");
    assert!((0..3).all(|col| !refined.contains(&tile(0, col))), "{refined:?}");
    for (at, why) in &heard.because {
        let expected = if *at == tile(2, 2) { "roads, rivers or lakes in it changed" } else { "border" };
        assert!(why.contains(expected), "{at}: {why}");
    }
    assert_eq!(heard.assembled, refined.len(), "load modules of tiles that were kept were made again");
    // One tile by name, and what it holds its neighbours by is as it was.
    fs::write(scene.path("features.geojson"), features(4500.0)).unwrap();
    let (again, _) = scene.tile("area", tile(2, 2), false);
    assert_eq!(again, [tile(2, 2)]);
    rebuilt(&scene, "after one tile with a moved road");
}

#[test]
fn one_tile_again_takes_others_with_it_in_which_roads_have_changed() {
    let words = Words { features: "sources = [\"features.geojson\"]".into(), ..words() };
    let dem = sample_dem(words.grid(), 1);
    let drawn = |track: &[(f64, f64)]| geojson(&[line("highway=track", track)]);
    let scene = Scene::with_files(&words, |folder: &Path| {
        crate::scene::write_dem(&folder.join("dem.tif"), &dem);
        fs::write(folder.join("features.geojson"), drawn(&[(2300.0, 2200.0), (2700.0, 2400.0)])).unwrap();
    });
    drop(scene.build("area", 2));
    let leaving = [(2300.0, 2200.0), (4000.0, 2400.0), (4100.0, 400.0)];
    fs::write(scene.path("features.geojson"), drawn(&leaving)).unwrap();
    let (again, is_frozen) = scene.tile("area", tile(1, 1), false);
    assert!(!is_frozen && [tile(1, 1), tile(1, 2), tile(0, 2)].iter().all(|tile| again.contains(tile)), "{again:?}");
    scene.verify("area");
    Product::read(&scene.path("area")).check_cracks();
    // Back to where it was: two tiles have no features any more.
    fs::write(scene.path("features.geojson"), drawn(&[(2300.0, 2200.0), (2700.0, 2400.0)])).unwrap();
    let (again, _) = scene.tile("area", tile(1, 1), false);
    assert!([tile(1, 1), tile(1, 2), tile(0, 2)].iter().all(|tile| again.contains(tile)), "{again:?}");
    scene.verify("area");
    Product::read(&scene.path("area")).check_cracks();
    drop(scene.build("area", 2));
    drop(scene.build("fresh", 2));
    assert_same(&scene.product("fresh"), &scene.product("area"), "one tile, then a build");
}

#[test]
fn one_tile_of_an_area_with_a_lake_on_other_ground_is_sound() {
    let words = Words { features: "sources = [\"features.geojson\"]".into(), ..words() };
    let dem = sample_dem(words.grid(), 1);
    let scene = Scene::with_files(&words, |folder: &Path| {
        crate::scene::write_dem(&folder.join("dem.tif"), &dem);
        let lake = [(300.0, 2000.0), (900.0, 2050.0), (850.0, 2500.0), (320.0, 2400.0)];
        fs::write(folder.join("features.geojson"), geojson(&[polygon("natural=water", &lake)])).unwrap();
    });
    drop(scene.build("area", 2));
    let raised = |post: Post| if 100 < post.col { post.row % 7 * 300 } else { 0 };
    scene.replace_dem(&Dem::from_fn(dem.rect(), |post| Some(dem.height(post) + raised(post))));
    drop(scene.tile("area", tile(0, 0), false));
    scene.verify("area");
    drop(scene.build("area", 2));
    scene.verify("area");
}

#[test]
fn a_changed_pin_reaches_its_tile_and_what_its_borders_lead_to() {
    let pin = |east: f64| {
        let at = [crate::scene::ORIGIN_M[0] + east, crate::scene::ORIGIN_M[1] + 425.0];
        format!(
            "{{\"type\":\"FeatureCollection\",\"features\":[{{\"type\":\"Feature\",\"properties\":{{\"pin\":\"add\"}},\
             \"geometry\":{{\"type\":\"Point\",\"coordinates\":[{},{}]}}}}]}}",
            at[0], at[1]
        )
    };
    let tin = format!("{}\npins = \"pins.geojson\"", words().tin);
    let scene = Scene::with_files(&Words { tin, ..Words::sample() }, |folder: &Path| {
        fs::write(folder.join("pins.geojson"), pin(425.0)).unwrap();
    });
    drop(scene.build("area", 2));
    fs::write(scene.path("pins.geojson"), pin(475.0)).unwrap();
    let (heard, refined) = rebuilt(&scene, "pins");
    assert!(refined.contains(&tile(0, 0)) && refined.len() < 9, "{refined:?}");
    let of_pin = |(at, why): &(TileId, String)| *at == tile(0, 0) && why.contains("points given for it changed");
    assert!(heard.because.iter().any(of_pin), "{:?}", heard.because);
}

#[test]
fn a_changed_limit_moves_allowances_and_keeps_surveys_that_it_does_not_reach() {
    let ground = sample_dem(Words::raster().grid(), 1);
    let mut scene = Scene::on(&Words::raster(), &ground);
    drop(scene.build("area", 2));
    let text = Words { limits: "mean_per_load_module = 30".into(), ..Words::raster() }.text();
    scene.job = Job::from_text(&text, &scene.path("job.toml")).unwrap();
    let (heard, refined) = rebuilt(&scene, "limit");
    assert!(!refined.is_empty());
    assert!(heard.because.iter().any(|(_, why)| why.contains("its allowance moved")), "{:?}", heard.because);
}

#[test]
fn sections_taken_out_of_a_job_and_put_back_leave_nothing_of_the_build_before() {
    let plain = Words { size: (4, 4), tiles: (2, 2), ..Words::sample() };
    let drawn = [
        line("highway=primary", &[(-100.0, 300.0), (2100.0, 500.0)]),
        polygon("natural=water", &[(300.0, 1000.0), (900.0, 1050.0), (850.0, 1500.0), (320.0, 1400.0)]),
        polygon("building=yes", &[(1500.0, 1500.0), (1540.0, 1500.0), (1540.0, 1530.0)]),
    ];
    let features = "sources = [\"features.geojson\"]\nbuildings = true".to_owned();
    let tin = |tin: &str| Words { tin: tin.into(), ..plain.clone() };
    let greedy = "method = \"greedy\"\npoints = 100";
    let clipped = Words { modules: "edges = \"clip\"".into(), ..tin(greedy) };
    let equal = tin("allocation = \"equal\"");
    let levels = tin("[lod]\nlevels = [{ inner_share = 0.5 }]");
    let mut scene = Scene::with_files(&Words { features, ..plain.clone() }, |folder: &Path| {
        fs::write(folder.join("features.geojson"), geojson(&drawn)).unwrap();
    });
    let with_features = scene.job.clone();
    let path = scene.path("job.toml");
    let of = |words: &Words| Job::from_text(&words.text(), &path).unwrap();
    let jobs = [&plain, &levels, &clipped, &equal].map(of);
    drop(scene.build("area", 2));
    for job in jobs.into_iter().flat_map(|job| [job, with_features.clone()]) {
        let what = job.canonical_text();
        scene.job = job;
        drop(scene.build("area", 2));
        fs::remove_dir_all(scene.path("fresh")).ok();
        drop(scene.build("fresh", 2));
        assert_same(&scene.product("fresh"), &scene.product("area"), &what);
        scene.verify("area");
    }
}

#[test]
fn features_that_miss_every_tile_leave_the_bytes_of_a_job_without_any() {
    let plain = Words { size: (2, 2), tiles: (1, 1), ..Words::sample() };
    let features = "sources = [\"features.geojson\"]".to_owned();
    let mut scene = Scene::with_files(&Words { features, ..plain.clone() }, |folder: &Path| {
        let beside = [line("railway=rail", &[(1010.0, -10.0), (1010.0, 1010.0)])];
        fs::write(folder.join("features.geojson"), geojson(&beside)).unwrap();
    });
    drop(scene.build("area", 2));
    scene.job = Job::from_text(&plain.text(), &scene.path("job.toml")).unwrap();
    rebuilt(&scene, "without features");
}

#[test]
fn a_small_edit_of_an_optimised_area_moves_few_tiles() {
    let words = Words { size: (12, 12), tiles: (4, 4), ..Words::raster() };
    let ground = sample_dem(words.grid(), 1);
    let scene = Scene::on(&words, &ground);
    drop(scene.build("area", 2));
    let edited =
        Dem::from_fn(ground.rect(), |post| Some(ground.height(post) + i32::from(post == Post::new(25, 25)) * 64));
    scene.replace_dem(&edited);
    let (heard, refined) = rebuilt(&scene, "small edit");
    assert_eq!(heard.surveyed, 1);
    assert!(refined.contains(&tile(0, 0)) && refined.len() < 16, "{refined:?}: {:?}", heard.because);
}

#[test]
fn ground_within_sight_of_a_tile_has_it_refined_again_and_lines_of_sight_can_be_left_out() {
    for (sight, reaches) in [("sight = true\nsight_range_m = 1000", true), ("sight = false", false)] {
        let tin = format!("method = \"optimised\"\nallocation = \"equal\"\neffort = \"fast\"\n{sight}");
        let words = Words { tin, ..Words::raster() };
        let ground = sample_dem(words.grid(), 1);
        let scene = Scene::on(&words, &ground);
        drop(scene.build("area", 2));
        let rect = ground.rect();
        let (low, high) = (Post::new(rect.south + 2, rect.west + 2), Post::new(rect.south + 9, rect.west + 9));
        scene.replace_dem(&with_block(&ground, low, high));
        let (heard, _) = rebuilt(&scene, sight);
        let is_seen = heard.because.iter().any(|(_, why)| why.contains("ground within sight changed"));
        assert_eq!(is_seen, reaches, "{sight}: {:?}", heard.because);
    }
}

#[test]
fn other_tiles_of_the_same_ground_leave_nothing_of_the_ones_before() {
    let mut scene = Scene::new(&Words { tiles: (3, 3), ..Words::sample() });
    drop(scene.build("area", 2));
    let job = Words { tiles: (2, 1), ..Words::sample() }.text();
    scene.job = Job::from_text(&job, &scene.path("job.toml")).unwrap();
    drop((scene.build("area", 2), scene.build("fresh", 2)));
    assert_same(&scene.product("fresh"), &scene.product("area"), "fewer tiles");
    scene.verify("area");
}

#[test]
fn another_area_is_refused_and_nothing_is_touched() {
    let scene = Scene::new(&Words::sample());
    drop(scene.build("area", 2));
    let before = scene.product("area");
    let job = Words { size: (10, 10), ..Words::sample() }.text();
    let job = Job::from_text(&job, &scene.path("job.toml")).unwrap();
    for fresh in [false, true] {
        let stop = false.into();
        let options = build::Options { fresh, ..crate::scene::options(1, &stop) };
        let error = build::build(&job, &scene.path("area"), &options, &mut crate::scene::Silent).unwrap_err();
        assert!(error.to_string().contains("size_m") && error.hint().is_some(), "{error}");
    }
    assert_same(&before, &scene.product("area"), "refused");
}

#[test]
fn another_format_version_is_refused_and_nothing_is_touched() {
    let scene = Scene::new(&Words::sample());
    drop(scene.build("area", 2));
    let path = scene.path("area/database.json");
    let text = fs::read_to_string(&path).unwrap();
    let version = format!("\"format_version\": {}", store::FORMAT_VERSION);
    // As another version would write it, with its own checksum.
    let other: serde_json::Value =
        serde_json::from_str(&text.replacen(&version, "\"format_version\": 999", 1)).unwrap();
    let mut other = other.as_object().unwrap().clone();
    other.remove("checksum");
    let (folder, _) = store::Database::create_or_open(&scene.path("area"), &area_of(&scene)).unwrap();
    folder.write_json("database.json", &other).unwrap();
    drop(folder);
    let before = scene.product("area");
    let error = scene.try_build("area", 1).unwrap_err();
    assert!(error.to_string().contains("999") && error.hint().is_some(), "{error}");
    assert_same(&before, &scene.product("area"), "refused");
}

fn area_of(scene: &Scene) -> store::Area {
    store::Folder::new(scene.path("area")).manifest().unwrap().area
}

#[test]
fn an_older_algorithm_revision_is_built_again_and_said_so() {
    let scene = Scene::new(&Words::sample());
    drop(scene.build("area", 2));
    let wanted = scene.product("area");
    let folder = store::Folder::new(scene.path("area"));
    let manifest = folder.manifest().unwrap();
    let (database, _) = store::Database::create_or_open(&scene.path("area"), &manifest.area).unwrap();
    for record in &manifest.tiles {
        let (stamp, tin) = folder.read_tile(record.tile()).unwrap();
        let older = store::Stamp { algorithm_revision: stamp.algorithm_revision - 1, ..stamp };
        database.write_tile(&older, &tin).unwrap();
    }
    drop(database);
    let (heard, refined) = rebuilt(&scene, "revision");
    assert_eq!(refined.len(), 9);
    assert!(heard.because.iter().all(|(_, why)| why.contains("algorithm revision")), "{:?}", heard.because);
    assert_same(&wanted, &scene.product("area"), "revision");
}
