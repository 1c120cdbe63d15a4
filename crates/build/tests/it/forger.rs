//! The forger: a database is taken apart, one thing in it altered, and everything else made right again: checksums,
//! stamps, sums that follow from it. `verify` has to tell each alteration in a sentence, but for those of the last
//! table, which nothing that a database holds can show.

mod features;

use std::fs;
use std::path::Path;

use store::{FileStamp, Fingerprint, Folder, Manifest, Measured, Report, Stamp, TileModules, TileState, files};
use terrain::{Decks, Dem, LoadModule, ModuleVertex, Post, Side, TileTin};

use crate::scene::{Scene, Words, tile};

/// A database in parts, tile by tile.
#[derive(Clone)]
struct Forged {
    manifest: Manifest,
    report: Report,
    tins: Vec<(Stamp, TileTin)>,
    modules: Vec<(TileModules, Vec<Vec<LoadModule>>)>,
    measured: Vec<(Stamp, Measured)>,
    /// What features came to, in jobs with some.
    features: Option<features::Parts>,
}

impl Forged {
    fn open(dir: &Path) -> Self {
        let folder = Folder::new(dir);
        let manifest = folder.manifest().unwrap();
        let tiles: Vec<_> = manifest.tiles.iter().map(store::TileRecord::tile).collect();
        Self {
            report: folder.report().unwrap(),
            tins: tiles.iter().map(|&tile| folder.read_tile(tile).unwrap()).collect(),
            modules: tiles.iter().map(|&tile| folder.read_levels(&manifest, tile).unwrap()).collect(),
            measured: tiles
                .iter()
                .map(|&tile| folder.read_measured(tile).unwrap())
                .map(|(stamp, _, measured)| (stamp, measured))
                .collect(),
            features: manifest.files.contains_key(files::LEVEL).then(|| features::Parts::open(&folder, &tiles)),
            manifest,
        }
    }

    /// Makes what follows from load modules right: numbers in `measured/`, totals, the report's counts.
    fn follow(&mut self) {
        for ((_, measured), (_, levels)) in self.measured.iter_mut().zip(&self.modules) {
            for (numbers, module) in measured.modules.iter_mut().zip(levels.iter().flatten()) {
                (numbers.triangles, numbers.polygons) = (module.counts().triangles, module.counts().polygons);
                (numbers.posts, numbers.largest) = (module.residual.posts, module.residual.largest);
                (numbers.sum_abs, numbers.sum_squared) = (module.residual.sum_abs, module.residual.sum_squared);
            }
        }
        let finest = || self.modules.iter().flat_map(|(_, levels)| &levels[0]);
        let totals = &mut self.manifest.totals;
        totals.triangles = finest().map(|module| u64::from(module.counts().triangles)).sum();
        totals.polygons = finest().map(|module| u64::from(module.counts().polygons)).sum();
        totals.residual_posts = finest().map(|module| u64::from(module.residual.posts)).sum();
        totals.residual_largest = finest().map(|module| u64::from(module.residual.largest)).max().unwrap();
        totals.residual_sum_abs = finest().fold(0, |sum, module| sum.wrapping_add(module.residual.sum_abs));
        totals.residual_sum_squared = finest().fold(0, |sum, module| sum.wrapping_add(module.residual.sum_squared));
        (self.report.triangles, self.report.polygons) = (totals.triangles, totals.polygons);
    }

    /// Writes every part with its checksum, and every stamp where it is listed.
    fn seal(&mut self, scene: &Scene, name: &str) {
        let area = Folder::new(scene.path(name)).manifest().unwrap().area;
        let (database, _) = store::Database::create_or_open(&scene.path(name), &area).unwrap();
        let folder = Folder::new(scene.path(name));
        for (index, record) in self.manifest.tiles.iter_mut().enumerate() {
            let at = tile(index as u32 / area.tile_cols, index as u32 % area.tile_cols);
            let write = |path: std::path::PathBuf, bytes: Vec<u8>| {
                fs::write(path, &bytes).unwrap();
                Some(FileStamp::of(&bytes))
            };
            let (header, levels) = &self.modules[index];
            record.slm = write(folder.modules_path(at), store::encode_levels(header, levels));
            let (stamp, tin) = &self.tins[index];
            record.tin = write(folder.tile_path(at), store::encode_tile(stamp, tin));
            let (stamp, measured) = &mut self.measured[index];
            measured.modules_file = record.slm.unwrap();
            record.measured = write(folder.measured_path(at), store::encode_measured(stamp, measured));
        }
        if let Some(features) = &mut self.features {
            features.seal(&folder, &mut self.manifest);
        }
        for (name, stamp) in &mut self.report.files {
            *stamp = folder.stamp_file(&folder.path(name)).unwrap();
        }
        database.write_report(&mut self.report, &self.manifest).unwrap();
        database.finish(&self.manifest).unwrap();
    }

    /// The first load module of the finest level.
    fn module(&mut self) -> &mut LoadModule {
        &mut self.modules[0].1[0][0]
    }
}

/// What is altered.
type Alter = fn(&mut Forged);

/// A database with its report beside it.
fn scene(kind: &str) -> Scene {
    let small = Words { size: (4, 6), tiles: (2, 2), ..Words::sample() };
    let importance = "default = 8\nareas = [{ sample = \"mountains\", class = \"mountains\", weight = 1 }]".to_owned();
    let words = match kind {
        "constrained" => Words { importance, ..small },
        // No removal can meet these limits: every one of them is exceeded.
        "clip" => Words {
            modules: "edges = \"clip\"".into(),
            limits: "count = \"polygons\"\nper_load_module = 8\nmean_per_load_module = 3.3\nper_4km_square = 192"
                .into(),
            tin: "method = \"paper\"\npoints = 800".into(),
            ..Words::sample()
        },
        "other" => Words { tin: "method = \"paper\"\npoints = 150".into(), ..small },
        _ => panic!("no such job: {kind}"),
    };
    let scene = Scene::new(&words);
    let built = scene.build("area", 2);
    built.database.write_json(files::REPORT, &built.report).unwrap();
    scene
}

/// Alters a database, follows, alters what `after` says, and seals; returns what `verify` says.
fn forged(scene: &Scene, parts: &Forged, alter: Alter, after: Alter) -> Vec<String> {
    let mut parts = parts.clone();
    alter(&mut parts);
    parts.follow();
    after(&mut parts);
    parts.seal(scene, "area");
    inspect::verify(&scene.path("area"), None).unwrap().problems
}

fn nothing(_: &mut Forged) {}

/// What is altered, how, after what follows from load modules was made right, and what `verify` says of it.
#[track_caller]
fn check(kind: &str, table: &[(&str, Alter, Alter, &str)]) {
    let scene = scene(kind);
    let parts = Forged::open(&scene.path("area"));
    assert_eq!(forged(&scene, &parts, nothing, nothing), [""; 0], "{kind}: honest");
    for (what, alter, after, expected) in table {
        let problems = forged(&scene, &parts, *alter, *after);
        assert!(problems.iter().any(|problem| problem.contains(expected)), "{kind}: {what}: {problems:#?}");
        let is_rust = |problem: &String| ["Some(", " { ", "East side", "Id("].iter().any(|rust| problem.contains(rust));
        assert!(!problems.iter().any(is_rust), "{kind}: {what}: {problems:#?}");
    }
}

#[test]
fn altered_load_modules_are_told() {
    let table: [(&str, Alter, Alter, &str); 10] = [
        ("a height inside", |f| raise_inner(f.module()), nothing, "are not those of its tile's TIN"),
        ("a height on a side", raise_side, nothing, "a crack"),
        ("a class", |f| f.module().classes[0] = 7, nothing, "has class 7, the job has 2"),
        ("a deck's class", |f| hang(f.module(), 1, 7), nothing, "triangle of decks 0 has class 7, the job has 2"),
        ("decks past the limit", |f| hang(f.module(), 5000, 1), nothing, "against limits.per_load_module"),
        ("posts", |f| f.module().residual.posts += 1, nothing, "do not add up"),
        ("posts beyond any", |f| f.module().residual.posts = 70_000, nothing, "no residuals have the sums"),
        ("squares that wrap", |f| f.module().residual.sum_squared = u64::MAX, nothing, "no residuals have the sums"),
        ("largest", |f| f.module().residual.largest = 0, nothing, "no residuals have the sums"),
        ("polygons", |f| f.module().polygon_count -= 1, nothing, "polygons, and each of its"),
    ];
    check("constrained", &table);
}

/// Hangs so many triangles of one class over a load module, each above the one before.
fn hang(module: &mut LoadModule, count: i32, class: u8) {
    let corners = |z| [(0, 0), (0, 640), (640, 0)].map(|(y, x)| ModuleVertex { y, x, z });
    module.decks = Decks::of_triangles((0..count).map(|i| (corners(1_000_000 + 640 * i), class)));
}

fn raise_inner(module: &mut LoadModule) {
    let side = module.side;
    let inner = module.vertices.iter_mut().find(|v| 0 < v.x && v.x < side && 0 < v.y && v.y < side);
    inner.unwrap().z += 64;
}

fn raise_side(forged: &mut Forged) {
    let module = forged.module();
    let corner = *module.side_vertices(Side::East).last().unwrap();
    module.vertices[usize::from(corner)].z += 64;
}

#[test]
fn altered_headers_are_told() {
    let table: [(&str, Alter, Alter, &str); 6] = [
        ("origin", |f| f.modules[1].0.frame.origin_east_m += 500.0, nothing, "its header says origin 505500 m east"),
        ("crs", |f| f.modules[1].0.crs = "EPSG:32610".into(), nothing, "its header says crs \"EPSG:32610\""),
        ("datum", |f| f.modules[1].0.vertical_datum = "x".into(), nothing, "its header says vertical datum \"x\""),
        ("area", |f| f.modules[1].0.grid.rows += 1, nothing, "its header says area rows 5, the job 4"),
        ("tile", |f| f.modules[1].0.tile = tile(1, 1), nothing, "its header says tile row 1, the job 0"),
        ("fingerprint", |f| f.modules[1].0.fingerprint = Fingerprint([7; 32]), nothing, "its fingerprint is not that"),
    ];
    check("constrained", &table);
}

#[test]
fn altered_manifests_are_told() {
    let table: [(&str, Alter, Alter, &str); 12] = [
        ("name", nothing, |f| f.manifest.area.name = "x".into(), "its area says name x, its job small"),
        ("origin", nothing, |f| f.manifest.area.origin_m[0] += 1.0, "its area says origin_m"),
        ("size", nothing, |f| f.manifest.area.size_m[1] += 500.0, "its area says size_m"),
        ("rows", nothing, |f| f.manifest.area.module_rows += 1, "its area says module_rows 5, its job 4"),
        ("points", nothing, |f| f.manifest.totals.points += 1, "points: "),
        ("triangles", nothing, |f| f.manifest.totals.triangles += 1, "triangles: "),
        ("over", nothing, |f| f.manifest.totals.modules_over += 1, "load modules above the limit: "),
        ("breaches", nothing, |f| f.manifest.totals.breaches += 1, "limits exceeded: 0 in the files, 1 in"),
        ("refused", nothing, |f| f.manifest.totals.refused += 1, "refused posts: "),
        ("state", nothing, |f| f.manifest.tiles[0].state = TileState::OverLimit, "is listed as over_limit"),
        ("missing", nothing, |f| f.manifest.tiles[0].state = TileState::Missing, "is listed as missing"),
        ("fingerprint", nothing, |f| f.manifest.tiles[0].fingerprint = Some(Fingerprint([1; 32])), "its fingerprint"),
    ];
    check("constrained", &table);
    let scene = scene("constrained");
    let outside = scene.path("outside.json");
    fs::write(&outside, "{}").unwrap();
    let mut parts = Forged::open(&scene.path("area"));
    parts.manifest.files.insert("../outside.json".into(), FileStamp::of(b"{}"));
    parts.seal(&scene, "area");
    let problems = inspect::verify(&scene.path("area"), None).unwrap().problems;
    assert_eq!(problems, ["database.json: lists a file \"../outside.json\", which leads out of the folder"]);
}

#[test]
fn altered_reports_are_told() {
    let table: [(&str, Alter, Alter, &str); 14] = [
        ("name", nothing, |f| f.report.area = "x".into(), "report.json: area is \"x\""),
        ("count", nothing, |f| f.report.count = "polygons".into(), "report.json: count is"),
        ("triangles", nothing, |f| f.report.triangles += 1, "report.json: triangles is"),
        ("polygons", nothing, |f| f.report.polygons -= 1, "report.json: polygons is"),
        ("points", nothing, |f| f.report.points.selected += 1, "report.json: points.selected is"),
        ("mean", nothing, |f| f.report.per_load_module.mean += 0.5, "report.json: per_load_module.mean is"),
        ("limit", nothing, |f| f.report.per_load_module.limit += 1, "report.json: per_load_module.limit is"),
        ("window", nothing, |f| f.report.per_4km.worst_9x9 -= 1, "report.json: per_4km.worst_9x9 is"),
        ("residual", nothing, |f| f.report.residual.rms_m *= 0.9, "report.json: residual.rms_m is"),
        ("eta", nothing, |f| f.report.limit.as_mut().unwrap().eta = Some(1.0), "report.json: limit.eta is"),
        ("percentile", nothing, |f| f.report.residual.p99_m -= 0.5, "report.json: residual.p99_m is"),
        ("class", nothing, |f| f.report.classes[1].residual.rms_m += 0.1, "report.json: classes[1].residual.rms_m is"),
        ("class posts", nothing, |f| f.report.classes[0].posts += 1, "report.json: classes[0].posts is"),
        ("refusals", nothing, |f| f.report.refusals.count += 1, "report.json: refusals.count is"),
    ];
    check("constrained", &table);
}

#[test]
fn an_altered_class_of_ground_is_told_by_its_raster() {
    let importance = "areas = [{ slope_above_percent = 20, smooth_m = 0, class = \"steep\", weight = 1 }]".into();
    let words = Words { size: (2, 2), tiles: (1, 1), importance, ..Words::raster() };
    let height = |post: Post| 128 * (500 + (post.col - 20).max(0) * 10) + post.row % 3;
    let scene = Scene::on(&words, &Dem::from_fn(words.grid().area(), |post| Some(height(post))));
    let built = scene.build("area", 1);
    built.database.write_json(files::REPORT, &built.report).unwrap();
    drop(built);
    scene.verify_on_dem("area");
    let mut parts = Forged::open(&scene.path("area"));
    let class = parts.module().classes.iter_mut().next().unwrap();
    *class = 1 - *class;
    parts.seal(&scene, "area");
    let problems = inspect::verify(&scene.path("area"), Some(&scene.path("dem.tif"))).unwrap().problems;
    assert!(problems.iter().any(|problem| problem.contains("the ground under it has another")), "{problems:?}");
}

#[test]
fn altered_numbers_of_what_was_measured_are_told() {
    let table: [(&str, Alter, Alter, &str); 5] = [
        ("polygons", nothing, |f| f.measured[0].1.modules[0].polygons -= 1, "its numbers of load modules are not"),
        ("classes", nothing, |f| f.measured[0].1.classes[0].posts += 1, "do not add up"),
        ("histogram", nothing, longer_histogram, "the histogram that it has"),
        ("points", nothing, |f| f.measured[0].1.points[0] += 1, "its points by class do not add up"),
        ("heights", nothing, |f| f.measured[0].1.heights[0] -= 1, "its lowest and highest vertex"),
    ];
    check("constrained", &table);
}

fn longer_histogram(forged: &mut Forged) {
    let classes = &mut forged.measured[0].1.classes;
    let tally = classes.iter_mut().find(|tally| !tally.bins.is_empty()).unwrap();
    tally.bins[0].1 += 1;
}

#[test]
fn exchanged_files_are_told() {
    let table: [(&str, Alter, Alter, &str); 3] = [
        ("TINs", |f| f.tins.swap(0, 1), nothing, "tiles/r00c00.tin"),
        ("TINs under right names", exchange_tins, nothing, "does not cover the posts of its tile"),
        ("measured", |f| f.measured.swap(0, 1), nothing, "measured/r00c00.sums"),
    ];
    check("constrained", &table);
}

fn exchange_tins(forged: &mut Forged) {
    forged.tins.swap(0, 1);
    for (at, (stamp, tin)) in forged.tins.iter_mut().enumerate() {
        let record = &mut forged.manifest.tiles[at];
        tin.tile = record.tile();
        record.fingerprint = Some(stamp.fingerprint);
    }
}

#[test]
fn all_tiles_of_another_job_are_told() {
    let (scene, other) = (scene("constrained"), scene("other"));
    let own = Forged::open(&scene.path("area"));
    let mut parts = Forged::open(&other.path("area"));
    // All that names the job, and what was surveyed for it, stays.
    parts.manifest.job.clone_from(&own.manifest.job);
    parts.manifest.files.clone_from(&own.manifest.files);
    for (record, own) in parts.manifest.tiles.iter_mut().zip(&own.manifest.tiles) {
        record.curve = own.curve;
    }
    parts.seal(&scene, "area");
    let problems = inspect::verify(&scene.path("area"), None).unwrap().problems;
    let expected = "database.json: tile r00c00 was selected by other rules than those of its job";
    assert!(problems.iter().any(|problem| problem == expected), "{problems:#?}");
}

#[test]
fn understated_polygons_of_clipped_load_modules_are_told() {
    let table: [(&str, Alter, Alter, &str); 2] = [
        ("polygons", |f| f.module().polygon_count -= 1, nothing, "polygons, the TINs of its tiles give"),
        ("all polygons", fewer_polygons, nothing, "polygons, the TINs of its tiles give"),
    ];
    check("clip", &table);
}

#[test]
fn breaches_that_are_left_out_or_altered_are_told() {
    let table: [(&str, Alter, Alter, &str); 3] = [
        ("a breach", nothing, |f| drop(f.report.breaches.pop()), "and report.json lists no such breach"),
        ("its count", nothing, |f| f.report.breaches[0].count += 1, "lists a breach that is not there"),
        ("its excess", nothing, |f| f.report.breaches[0].excess += 1, "which is not their difference"),
    ];
    check("clip", &table);
}

fn fewer_polygons(forged: &mut Forged) {
    for module in forged.modules.iter_mut().flat_map(|(_, levels)| &mut levels[0]) {
        module.polygon_count = module.polygon_count.min(8);
    }
}

#[test]
fn what_nothing_in_a_database_shows_is_not_told() {
    // Each with why no simulator or later build could be misled by it.
    let table: [(&str, Alter); 4] = [
        // Of the run, not of the ground.
        ("seconds and workers", |f| f.report.workers += 1),
        // What a reader is told in words.
        ("a warning", |f| f.report.warnings.push("x".into())),
        // Known from the sources alone.
        ("voids", |f| f.report.voids.count += 1),
        ("the accuracy of the DEM", |f| f.report.dem_accuracy_m = Some(1.0)),
    ];
    let scene = scene("constrained");
    let parts = Forged::open(&scene.path("area"));
    for (what, after) in table {
        assert_eq!(forged(&scene, &parts, nothing, after), [""; 0], "{what}");
    }
}
