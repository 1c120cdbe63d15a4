//! Levels of detail: neighbours at any two of them fit, counts and figures are true, with any number of workers.

use build::Built;
use job::Method;
use store::Folder;
use terrain::{LoadModule, ModuleGrid, Side, TileId};

use crate::scene::{Scene, Words, assert_same, options, sample_dem, tile};

const SHARES: [f64; 2] = [0.5, 0.2];

/// 4 x 4 load modules of mountains and plains in 2 x 2 tiles, with three levels.
fn words(tin: &str, modules: &str, border: &str) -> Words {
    let lod = "[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]";
    Words {
        size: (4, 4),
        tiles: (2, 2),
        importance: "default = 8\nareas = [{ sample = \"mountains\", class = \"mountains\", weight = 1 }]".into(),
        modules: modules.into(),
        limits: "mean_per_load_module = 60\nper_load_module = 200".into(),
        tin: format!("{tin}\n{lod}\nborder = \"{border}\""),
        ..Words::sample()
    }
}

const PAPER: &str = "method = \"paper\"\npoints = 300\nproximity = false\nresidual_quantum_m = 0.125";
const CLIP: &str = "edges = \"clip\"";

fn kinds() -> [(&'static str, &'static str); 4] {
    [("", ""), (PAPER, ""), (PAPER, CLIP), ("method = \"greedy\"", "")]
}

/// All load modules at each level, row by row.
fn levels_of(scene: &Scene, folder: &str) -> Vec<Vec<LoadModule>> {
    let mut levels: Vec<Vec<LoadModule>> = vec![Vec::new(); 1 + SHARES.len()];
    for row in 0..2 {
        for col in 0..2 {
            let folder = Folder::new(scene.path(folder));
            let (_, own) = folder.read_levels(&folder.manifest().unwrap(), tile(row, col)).unwrap();
            assert_eq!(own.len(), levels.len());
            levels.iter_mut().zip(own).for_each(|(level, own)| level.extend(own));
        }
    }
    levels.iter_mut().for_each(|level| level.sort_by_key(|module| module.id));
    levels
}

/// Places along a side and heights, bit for bit.
fn side(module: &LoadModule, side: Side) -> Vec<(u16, i32)> {
    let along = |v: u16| {
        let vertex = module.vertices[usize::from(v)];
        (if matches!(side, Side::South | Side::North) { vertex.x } else { vertex.y }, vertex.z)
    };
    module.side_vertices(side).into_iter().map(along).collect()
}

/// Every side that two load modules of these levels share.
#[track_caller]
fn check_sides(grid: ModuleGrid, here: &[LoadModule], there: &[LoadModule], what: &str) {
    let cols = grid.cols as usize;
    for (index, module) in here.iter().enumerate() {
        if (index + 1) % cols != 0 {
            assert_eq!(side(module, Side::East), side(&there[index + 1], Side::West), "{what}: {}", module.id);
        }
        if let Some(north) = there.get(index + cols) {
            assert_eq!(side(module, Side::North), side(north, Side::South), "{what}: {}", module.id);
        }
    }
}

fn inner_count(module: &LoadModule) -> usize {
    module.vertices.len() - module.border_vertex_count()
}

/// Every load module of every level is sound, has its share of vertices, and is no larger than the level before.
#[track_caller]
fn check_each(levels: &[Vec<LoadModule>], what: &str) {
    for (level, share) in levels[1..].iter().zip(SHARES) {
        for (fine, coarse) in levels[0].iter().zip(level) {
            assert_eq!((coarse.check(), coarse.id), (Ok(()), fine.id), "{what}");
            let expected = (inner_count(fine) as f64 * share).round() as usize;
            assert_eq!(inner_count(coarse), expected, "{what}: {}", fine.id);
            assert_eq!(coarse.residual.posts, fine.residual.posts, "{what}: the same posts at every level");
        }
    }
}

/// The report's figures are those of the files, and coarser levels lie further from the ground.
#[track_caller]
fn check_figures(built: &Built, levels: &[Vec<LoadModule>], what: &str) {
    assert_eq!(built.report.levels.len(), levels.len(), "{what}");
    for (told, level) in built.report.levels.iter().zip(levels) {
        assert_eq!(told.triangles, level.iter().map(|module| module.triangles.len() as u64).sum::<u64>(), "{what}");
        let squares: u64 = level.iter().map(|module| module.residual.sum_squared).sum();
        let posts: u64 = level.iter().map(|module| u64::from(module.residual.posts)).sum();
        assert!((told.rms_m - (squares as f64 / posts as f64).sqrt() / 128.0).abs() < 1e-9, "{what}: {told:?}");
    }
    assert!((built.report.residual.rms_m - built.report.levels[0].rms_m).abs() < 1e-9, "{what}");
    for pair in built.report.levels.windows(2) {
        assert!(pair[1].triangles <= pair[0].triangles, "{what}: {pair:?}");
        // A level of DEM heights may lie a little further from the ground than the next one, whose heights are fitted.
        assert!(0.98 * pair[0].rms_m < pair[1].rms_m, "{what}: {pair:?}");
    }
}

#[test]
fn load_modules_of_any_two_levels_fit_together() {
    for (tin, modules) in kinds() {
        let scene = Scene::new(&words(tin, modules, "full"));
        let built = scene.build("area", 2);
        let levels = levels_of(&scene, "area");
        let what = format!("{tin} {modules}");
        check_each(&levels, &what);
        check_figures(&built, &levels, &what);
        for here in &levels {
            for there in &levels {
                check_sides(scene.job.area.grid, here, there, &what);
            }
        }
        drop(built);
        scene.verify("area");
    }
}

#[test]
fn thinned_sides_fit_together_at_equal_levels() {
    for (tin, modules) in kinds() {
        let scene = Scene::new(&words(tin, modules, "own"));
        let built = scene.build("area", 2);
        let levels = levels_of(&scene, "area");
        let what = format!("{tin} {modules}");
        check_each(&levels, &what);
        check_figures(&built, &levels, &what);
        for level in &levels {
            check_sides(scene.job.area.grid, level, level, &what);
        }
        let on_sides = |level: &[LoadModule]| level.iter().map(LoadModule::border_vertex_count).sum::<usize>();
        assert!(on_sides(&levels[2]) < on_sides(&levels[1]) && on_sides(&levels[1]) < on_sides(&levels[0]), "{what}");
        drop(built);
        scene.verify("area");
    }
}

#[test]
fn residuals_of_every_level_are_those_against_the_ground() {
    let scene = Scene::on(
        &Words { dem: "sources = [\"dem.tif\"]".into(), importance: String::new(), ..words("", "", "full") },
        &ground(),
    );
    drop(scene.build("area", 2));
    let verdict = inspect::verify(&scene.path("area"), Some(&scene.path("dem.tif"))).unwrap();
    assert_eq!(verdict.problems, [""; 0]);
    // Against other ground all levels differ.
    let mut other = ground();
    other = terrain::Dem::from_fn(other.rect(), |post| Some(other.height(post) + post.row % 3));
    scene.replace_dem(&other);
    let verdict = inspect::verify(&scene.path("area"), Some(&scene.path("dem.tif"))).unwrap();
    for level in ["load module 2,2: its residuals", "level 1: load module 2,2: its", "level 2: load module 2,2: its"] {
        assert!(verdict.problems.iter().any(|problem| problem.starts_with(level)), "{level}: {:?}", verdict.problems);
    }
}

fn ground() -> terrain::Dem {
    sample_dem(ModuleGrid { rows: 4, cols: 4, side_cells: 20 }, 5)
}

#[test]
fn levels_are_the_same_for_any_number_of_workers_and_tile_by_tile() {
    for (tin, modules) in kinds() {
        for border in ["full", "own"] {
            let scene = Scene::new(&words(tin, modules, border));
            drop(scene.build("one", 1));
            let one = scene.product("one");
            drop(scene.build("many", 8));
            assert_same(&one, &scene.product("many"), &format!("{tin} {modules} {border}: 8 workers"));
            for at in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (_, frozen) = scene.tile("many", TileId { row: at.0, col: at.1 }, false);
                assert!(!frozen);
            }
            assert_same(&one, &scene.product("many"), &format!("{tin} {modules} {border}: tile by tile"));
        }
    }
}

#[test]
fn levels_are_added_to_and_taken_from_an_area_without_refining_it() {
    let scene = Scene::new(&words("", "", "full"));
    let mut plain = words("", "", "full");
    plain.tin = String::new();
    let without = Scene::new(&plain);
    drop(without.build("area", 2));
    let before = without.product("area");
    let folder = without.path("area");
    let built = build::build(&scene.job, &folder, &options(2, &false.into()), &mut crate::scene::Silent).unwrap();
    assert!(matches!(scene.job.tin.method, Method::Optimised(_)));
    assert_eq!(built.report.levels.len(), 3);
    drop(built);
    let tins = |tree: &crate::scene::Tree| {
        let tins = tree.iter().filter(|(path, _)| path.starts_with("tiles"));
        tins.map(|(path, bytes)| (path.clone(), bytes.clone())).collect::<Vec<_>>()
    };
    assert_eq!(tins(&without.product("area")), tins(&before));
    drop(scene.build("fresh", 1));
    assert_same(&scene.product("fresh"), &without.product("area"), "levels added");
    // And finest levels are what they were.
    let finest: Vec<LoadModule> = levels_of(&scene, "fresh").swap_remove(0);
    drop(without.build("area", 2));
    assert_same(&before, &without.product("area"), "levels taken away");
    let apart = inspect::difference(&scene.path("fresh"), &without.path("area"), 1).unwrap().changed;
    assert_eq!(apart.len(), 16, "levels are compared, too");
    assert!(apart.iter().all(|module| module.differs == ["level 1", "level 2"] && module.apart_m == 0.0));
    let (mut again, folder) = (Vec::new(), Folder::new(without.path("area")));
    for at in [tile(0, 0), tile(0, 1), tile(1, 0), tile(1, 1)] {
        again.extend(folder.read_modules(&folder.manifest().unwrap(), at).unwrap().1);
    }
    again.sort_by_key(|module| module.id);
    assert_eq!(again, finest);
}

#[test]
fn verify_finds_levels_that_do_not_fit_together_and_those_that_are_not_in_the_job() {
    let scene = Scene::new(&words("", "", "own"));
    let built = scene.build("area", 2);
    let manifest = Folder::new(scene.path("area")).manifest().unwrap();
    let finish = |manifest: &store::Manifest| {
        built.database.write_report(&mut built.report.clone(), manifest).unwrap();
        built.database.finish(manifest).unwrap();
    };
    let problems = |before: &str, after: &str| {
        let mut told = manifest.clone();
        told.job = told.job.replace(before, after);
        assert_ne!(told.job, manifest.job);
        finish(&told);
        inspect::verify(&scene.path("area"), None).unwrap().problems
    };
    let torn = problems("border = \"own\"", "border = \"full\"");
    let crack = "load module 0,0: its edges on the eastern side at level 0 are not its neighbour's at level 2: a crack";
    assert!(torn.iter().any(|problem| problem == crack), "{torn:?}");
    let missing = problems("{ inner_share = 0.2 }", "{ inner_share = 0.2 }, { inner_share = 0.1 }");
    assert_eq!(missing[0], "level 3: load module 0,0: missing");
    let more = problems(", { inner_share = 0.2 }", "");
    assert_eq!(more, ["load modules: 3 levels in a file, the job has 2"]);
    finish(&manifest);
    scene.verify("area");
}
