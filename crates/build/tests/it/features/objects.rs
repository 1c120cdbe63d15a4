//! Buildings, walls and woods stand on the ground of load modules, and change nothing of it.

use std::fs;
use std::sync::atomic::AtomicBool;

use build::Options;
use load_module_reader::{Area, Block, Curvature, Hider, Keep, LoadedGround, ObjectKind, PastObjects, Sight, SlmFile};
use store::{Folder, files};

use super::drawing::{Drawing, Drawn, line, polygon};
use crate::scene::{Scene, Silent, Still, Tree, Words, assert_same, tile, tree};

fn hills(east: f64, north: f64) -> f64 {
    500.0 + 30.0 * ((east * 0.004).sin() + (north * 0.006).cos())
}

fn house(tags: &str, [east, north]: [f64; 2], [wide, high]: [f64; 2]) -> Drawn {
    polygon(tags, &[(east, north), (east + wide, north), (east + wide, north + high), (east, north + high)])
}

/// On a slope, over the corner of four load modules and of four tiles, on a line, beyond the area, over and under a
/// bridge's road, in and beside woods.
fn drawn() -> Vec<Drawn> {
    vec![
        line("highway=primary", &[(-100.0, 300.0), (900.0, 700.0), (2100.0, 1500.0)]),
        house("building=yes", [100.0, 100.0], [20.0, 30.0]),
        house("building=church height=31.5", [990.0, 985.0], [25.0, 40.0]),
        house("building=yes building:levels=9", [700.0, 995.0], [15.0, 10.0]),
        house("building=yes", [480.0, 1480.0], [40.0, 40.0]),
        house("building=roof height=8 min_height=5", [1200.0, 300.0], [30.0, 12.0]),
        house("building=yes", [-10.0, 400.0], [20.0, 20.0]),
        house("building=yes", [-80.0, 100.0], [20.0, 30.0]),
        house("building=no", [400.0, 100.0], [20.0, 30.0]),
        house("building=yes", [880.0, 690.0], [30.0, 30.0]),
        house("man_made=chimney height=60", [1600.0, 1600.0], [6.0, 6.0]),
        house("natural=wood", [900.0, 1100.0], [400.0, 350.0]),
        house("landuse=forest height=15", [1200.0, 1300.0], [300.0, 200.0]),
        line("natural=tree_row", &[(200.0, 700.0), (300.0, 900.0), (700.0, 900.0)]),
        line("barrier=city_wall", &[(1500.0, 200.0), (1500.0, 520.0), (1800.0, 600.0)]),
    ]
}

const OBJECTS: &str = "[objects]\narea_min_m2 = 20";

fn drawing(objects: &str) -> Drawing {
    let mut words = Drawing::words();
    words.objects = objects.into();
    Drawing::of(words, hills, &drawn())
}

fn loaded(scene: &Scene) -> LoadedGround {
    let area = Area::open(scene.path("area.tdb"), Keep::InMemory).unwrap();
    area.load(Block { south: 0, west: 0, north: 4, east: 4 }).unwrap()
}

/// Every prism of the area with the south-west corner of its load module, in metres.
fn prisms(ground: &LoadedGround) -> Vec<([f64; 2], load_module_reader::Prism)> {
    let frame = ground.frame();
    let corner = |row: u32, col: u32| {
        [frame.origin_m[0] + f64::from(col) * frame.side_m(), frame.origin_m[1] + f64::from(row) * frame.side_m()]
    };
    let modules = ground.modules().iter().map(|module| module.module());
    let all = modules.flat_map(|module| module.objects.prisms.iter().map(move |prism| (module, prism)));
    all.map(|(module, prism)| (corner(module.row, module.col), prism.clone())).collect()
}

#[test]
fn walls_reach_the_ground_and_one_roof_stands_over_all_of_it() {
    let drawing = drawing(OBJECTS);
    drawing.built();
    let ground = loaded(&drawing.scene);
    let all = prisms(&ground);
    let report = drawing.scene.build("area.tdb", 1).report.objects.unwrap();
    let kind = |name: &str| report.kinds.iter().find(|sums| sums.kind == name).map(|sums| (sums.kept, sums.wanted));
    assert_eq!(kind("building"), Some((7, 7)), "one lies beyond the area, one is none");
    assert_eq!((kind("tower"), report.left_out), (Some((1, 1)), 0));
    let mut roofs = std::collections::BTreeMap::new();
    for (corner, prism) in &all {
        assert_eq!(*roofs.entry(prism.id).or_insert(prism.roof), prism.roof, "one roof for all pieces");
        let hangs = prism.roof - prism.base == 3 * 128;
        let ring: Vec<[f64; 2]> = prism.rings[0].iter().map(|at| [at.x, at.y].map(|q| f64::from(q) / 128.0)).collect();
        // Places on the walls and inside, from corner to corner.
        for (a, b) in ring.iter().flat_map(|a| ring.iter().map(move |b| (a, b))) {
            for step in 0..=8 {
                let at = [0, 1].map(|axis| corner[axis] + a[axis] + f64::from(step) / 8.0 * (b[axis] - a[axis]));
                let height = ground.height_m(at).unwrap() * 128.0;
                assert!(hangs || f64::from(prism.base) <= height + 1e-6, "a wall ends in the air at {at:?}");
                assert!(height + 128.0 < f64::from(prism.roof), "ground through a roof at {at:?}");
            }
        }
    }
    assert_eq!(all.iter().filter(|(_, prism)| prism.roof == roofs[&prism.id]).count(), all.len());
    let church: Vec<_> = all.iter().filter(|(_, prism)| prism.rings[0].iter().any(|at| !at.has_wall)).collect();
    assert!(4 <= church.len(), "what is cut has no wall there");
}

#[test]
fn sight_ends_at_buildings_and_dims_in_woods() {
    let drawing = drawing(OBJECTS);
    drawing.built();
    let ground = loaded(&drawing.scene);
    let origin = ground.frame().origin_m;
    let at = |east: f64, north: f64, up: f64| {
        let place = [origin[0] + east, origin[1] + north];
        [place[0], place[1], ground.height_m(place).unwrap() + up]
    };
    let past = PastObjects::all(Curvature::NONE);
    let (from, to) = (at(985.0, 1005.0, 5.0), at(1020.0, 1005.0, 5.0));
    assert_eq!(ground.sight(from, to), Sight::Free);
    let church = ground.sight_past(from, to, &past);
    assert_eq!(church.by, Some(Hider::Building), "{church:?}");
    let wood = ground.sight_past(at(890.0, 1300.0, 3.0), at(915.0, 1300.0, 3.0), &past);
    assert!((wood.wood_m - 15.0).abs() < 0.5 && wood.transmission < 0.05, "{wood:?}");
    assert_eq!(wood.by, Some(Hider::Wood));
}

#[test]
fn objects_change_no_ground_and_bytes_do_not_depend_on_who_builds() {
    let (with, without) = (drawing(OBJECTS), drawing(""));
    with.built();
    without.built();
    let ground = |scene: &Scene, row: u32, col: u32| {
        let path = Folder::new(scene.path("area.tdb")).modules_path(tile(row, col));
        let modules = SlmFile::open(path).unwrap().modules().to_vec();
        modules.into_iter().map(|module| (module.vertices, module.triangles, module.decks)).collect::<Vec<_>>()
    };
    for (row, col) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        assert_eq!(ground(&with.scene, row, col), ground(&without.scene, row, col));
    }
    check_other_ways_of_building(&with.scene);
}

/// Many workers, unit by unit, and each tile again alone.
fn check_other_ways_of_building(scene: &Scene) {
    let product = scene.product("area.tdb");
    for workers in [1, 8] {
        let name = format!("again-{workers}");
        drop(scene.build(&name, workers));
        assert_same(&product, &scene.product(&name), &name);
    }
    let area = build::ground::GamingArea::new(&scene.job).unwrap();
    for unit in build::ORDER.into_iter().flat_map(|stage| build::units(stage, &scene.job, &area)) {
        crate::shared::perform(scene, &[unit]).unwrap();
    }
    assert_same(&product, &scene.product("area"), "unit by unit");
    for place in [tile(0, 0), tile(1, 1), tile(0, 1), tile(1, 0)] {
        scene.tile("area", place, false);
        assert_same(&product, &scene.product("area"), &format!("{place} again"));
    }
}

#[test]
fn objects_that_count_jointly_leave_the_ground_what_they_do_not_take() {
    // By load module, by the square of 4 km (which is the area), and by the mean of the area.
    for (limits, what_binds) in [
        ("per_load_module = 60\nmean_per_load_module = 60", 0),
        ("per_load_module = 200\nper_4km_square = 700\nmean_per_load_module = 60", 1),
        ("per_load_module = 200\nmean_per_load_module = 50", 2),
    ] {
        let mut words = Drawing::words();
        words.limits = limits.into();
        let built = |joint: &str| {
            let words = Words { objects: format!("[objects]\nlimits = {{ joint = {joint} }}"), ..words.clone() };
            let drawing = Drawing::of(words, hills, &drawn());
            drawing.built();
            let report = Folder::new(drawing.scene.path("area.tdb")).report().unwrap();
            (drawing, report)
        };
        let ((joint, report), (_, apart)) = (built("true"), built("false"));
        let (objects, kinds) = report.objects.as_ref().map(|of| (of.polygons, &of.kinds)).unwrap();
        let job = &joint.scene.job;
        let features = build::Budgets::open(job, 2).unwrap();
        let foreseen = build::ObjectBudgets::open(job, features.as_ref(), 2).unwrap().unwrap();
        for (foreseen, built) in foreseen.of(job.objects.as_ref().unwrap().per_load_module).kinds.iter().zip(kinds) {
            let off_m2 = (foreseen.kept_m2 - built.kept_m2).abs();
            assert!(off_m2 <= 0.1 * built.wanted_m2, "{limits}: {foreseen:?}, {built:?}");
        }
        assert!(0 < objects && report.breaches.is_empty(), "{limits}: {objects}, {:?}", report.breaches);
        assert!(report.triangles < apart.triangles, "{limits}: the ground has less");
        let counted = (report.per_load_module.mean * 16.0).round() as u64;
        assert_eq!(counted, report.triangles + objects, "{limits}");
        assert_eq!([&report.count, &apart.count], ["triangles and objects", "triangles"]);
        let area = (16.0 * report.per_load_module.mean_limit) as u64;
        let full = [
            (report.per_load_module.max, report.per_load_module.limit),
            (report.per_4km.max, report.per_4km.limit),
            (counted, area),
        ];
        full.iter().for_each(|(count, limit)| assert!(count <= limit, "{limits}: {full:?}"));
        let (count, limit) = full[what_binds];
        assert!(limit - limit / 20 <= count, "{limits}: {full:?}");
        joint.scene.verify("area.tdb");
        check_other_ways_of_building(&joint.scene);
    }
}

#[test]
fn what_had_no_room_is_told_and_what_no_job_wants_is_gone() {
    let mut drawing = drawing("[objects]\nlimits = { per_load_module = 30, per_4km_square = 60 }");
    drawing.built();
    let folder = Folder::new(drawing.scene.path("area.tdb"));
    let report = folder.report().unwrap();
    let is_told =
        |kind: &str| report.warnings.iter().any(|told| told.contains(&format!("objects of kind {kind} hide")));
    assert!(is_told("building"), "{:?}", report.warnings);
    let report = report.objects.unwrap();
    assert!(report.per_load_module.max <= 30 && report.per_4km.max <= 60 && 0 < report.left_out, "{report:?}");
    let told = fs::read_to_string(folder.path(files::OBJECTS)).unwrap();
    assert!(told.contains("is full of what hides more than"), "{told}");
    let mut damaged = fs::read(folder.path(files::OUTLINES)).unwrap();
    *damaged.last_mut().unwrap() ^= 1;
    fs::write(folder.path(files::OUTLINES), damaged).unwrap();
    let found = inspect::verify(folder.dir(), None).unwrap().problems.join("\n");
    assert!(found.contains("objects.outlines"), "{found}");
    drawing.scene.job.objects = None;
    drawing.built();
    assert!(!folder.path(files::OUTLINES).exists() && !folder.path(files::OBJECTS).exists());
    assert_eq!(folder.report().unwrap().objects, None);
}

#[test]
fn a_wood_and_a_house_alone_make_a_file_of_version_3() {
    let mut words = Words { features: String::new(), ..Drawing::words() };
    words.objects =
        "[objects]\nsources = [\"features.geojson\"]\nrules = [{ where = { building = \"roof\" }, kind = \"none\" }]"
            .into();
    let drawing = Drawing::of(words, hills, &drawn());
    drop(drawing.scene.build("area.tdb", 2));
    drawing.scene.verify("area.tdb");
    let folder = Folder::new(drawing.scene.path("area.tdb"));
    let file = SlmFile::open(folder.modules_path(tile(0, 0))).unwrap();
    assert_eq!(file.header().version, 3);
    let kinds: Vec<ObjectKind> =
        file.modules().iter().flat_map(|module| &module.objects.prisms).map(|prism| prism.kind).collect();
    assert!(kinds.contains(&ObjectKind::Building));
    assert!(file.modules().iter().any(|module| !module.objects.canopies.is_empty()));
}

/// Leaves of 14 m over a square, of 7 m beside it, a void in the middle, on posts of 5 m.
fn leaves() -> String {
    let (posts, [west, south]) = (200, crate::scene::ORIGIN_M);
    let height = |row: i32, col: i32| match (row, col) {
        (45..=49, 45..=49) => "-9",
        (20..=79, 20..=79) => "14",
        (20..=79, 80..=119) => "7",
        _ => "0",
    };
    let line = |row: i32| (0..posts).map(|col| height(row, col)).collect::<Vec<_>>().join(" ");
    let lines: Vec<String> = (0..posts).rev().map(line).collect();
    let head = format!("ncols {posts}\nnrows {posts}\nxllcenter {west}\nyllcenter {south}\ncellsize 5\n");
    format!("{head}NODATA_value -9\n{}\n", lines.join("\n"))
}

#[test]
fn leaves_of_a_raster_are_woods_by_height() {
    let crs = format!("crs = \"EPSG:{}\"", crate::scene::EPSG);
    let scene = |more: &str| {
        let objects = format!("[objects]\nsources = [{{ file = \"leaves.asc\", {crs}{more} }}]");
        let words = Words { size: (4, 4), tiles: (2, 2), objects, ..Words::raster() };
        let dem = terrain::Dem::from_fn(words.grid().area(), |post| Some(64_000 + post.col));
        Scene::with_files(&words, |folder| {
            crate::scene::write_dem(&folder.join("dem.tif"), &dem);
            fs::write(folder.join("leaves.asc"), leaves()).unwrap();
        })
    };
    let tall = scene("");
    tall.build("area.tdb", 2);
    tall.verify("area.tdb");
    let ground = loaded(&tall);
    let up = |east: f64, north: f64| {
        let place = [0, 1].map(|axis| crate::scene::ORIGIN_M[axis] + [east, north][axis]);
        (100.0 * (ground.top(place).unwrap().height_m - ground.height_m(place).unwrap())).round() / 100.0
    };
    assert_eq!([up(200.0, 200.0), up(500.0, 250.0), up(700.0, 250.0), up(235.0, 235.0)], [13.5, 7.5, 0.0, 0.0]);
    let report = scene(", least_m = 10, kind = \"scrub\"").build("area.tdb", 1).report.objects.unwrap();
    assert_eq!(report.kinds.iter().map(|sums| (sums.kind.as_str(), sums.kept)).collect::<Vec<_>>(), [("scrub", 1)]);
}

/// Builds with a page.
fn build_all(scene: &Scene, folder: &str) -> build::Built {
    let stop = AtomicBool::new(false);
    build::build(&scene.job, &scene.path(folder), &Options::new(2, &stop, &Still), &mut Silent).unwrap()
}

/// Every file but the report and its page, which tell what a run did.
fn beside(scene: &Scene, folder: &str) -> Tree {
    let is_told = |name: &std::path::Path| name.to_string_lossy().starts_with("report.");
    tree(&scene.path(folder)).into_iter().filter(|(name, _)| !is_told(name)).collect()
}

#[test]
fn what_a_build_leaves_beside_its_tiles_is_named_when_it_is_gone_and_made_again() {
    let drawing = drawing("[objects]\nlimits = { per_load_module = 30, per_4km_square = 60 }");
    let (scene, folder) = (&drawing.scene, Folder::new(drawing.scene.path("area.tdb")));
    drop(build_all(scene, "area.tdb"));
    let sound = beside(scene, "area.tdb");
    for name in files::BESIDE_REPORT.into_iter().chain([files::REPORT]) {
        for damaged in [None, Some("xx")] {
            let path = folder.path(name);
            damaged.map_or_else(|| fs::remove_file(&path), |text| fs::write(&path, text)).unwrap();
            let problems = inspect::verify(folder.dir(), None).unwrap().problems;
            assert!(problems.iter().any(|problem| problem.contains(name)), "{name}, {damaged:?}: {problems:?}");
            let built = build_all(scene, "area.tdb");
            assert!(!built.is_unchanged && (built.kept, built.rebuilt) == (4, 0), "{name}, {damaged:?}");
            drop(built);
            assert_same(&sound, &beside(scene, "area.tdb"), name);
            scene.verify("area.tdb");
        }
    }
    assert!(build_all(scene, "area.tdb").is_unchanged);
}

#[test]
fn the_report_of_another_build_is_refused_and_made_again() {
    let mut drawing = drawing("[objects]\nlimits = { per_load_module = 30, per_4km_square = 60 }");
    let (path, other) = (drawing.scene.path("area.tdb/report.json"), drawing.scene.path("other.tdb/report.json"));
    drop(build_all(&drawing.scene, "area.tdb"));
    let job = drawing.scene.job.clone();
    drawing.scene.job.objects = None;
    drop(build_all(&drawing.scene, "other.tdb"));
    drawing.scene.job = job;
    fs::copy(other, path).unwrap();
    let folder = Folder::new(drawing.scene.path("area.tdb"));
    let error = folder.report().unwrap_err();
    assert!(error.to_string().contains("report.json") && error.hint().is_some(), "{error}");
    let problems = inspect::verify(folder.dir(), None).unwrap().problems;
    assert!(problems.iter().any(|problem| problem.contains("report.json")), "{problems:?}");
    assert!(!build_all(&drawing.scene, "area.tdb").is_unchanged);
    assert!(folder.report().unwrap().objects.is_some());
    drawing.scene.verify("area.tdb");
}
