//! Every measure of whole databases, and the ground they are measured against.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use build::CompileError;
use fidelity::{DemGround, Triangles};
use inspect::{DatabaseFidelity, MeshForm, Sights};
use store::Folder;
use terrain::{Dem, LatticePoint, Metres, Post, Tin, Vertex};

use crate::scene::{Scene, Words, sample_dem, tile, write_dem};

const SIGHTS: Sights = Sights { pairs: 3000, seed: 5 };

fn words() -> Words {
    Words { size: (6, 8), tiles: (2, 2), ..Words::raster() }
}

/// A database of `words` on a raster of the sample terrain.
fn built(words: &Words) -> (Scene, Dem) {
    let dem = sample_dem(words.grid(), 1);
    let scene = Scene::on(words, &dem);
    drop(scene.build("area", 2));
    (scene, dem)
}

fn measured(scene: &Scene, against: Option<&str>) -> Result<DatabaseFidelity, CompileError> {
    measured_against(scene, against.as_slice())
}

fn measured_against(scene: &Scene, rasters: &[&str]) -> Result<DatabaseFidelity, CompileError> {
    let rasters: Vec<PathBuf> = rasters.iter().map(|name| scene.path(name)).collect();
    inspect::fidelity(&scene.path("area"), &rasters, SIGHTS)
}

/// All load modules welded into one TIN, by equal places.
fn welded(scene: &Scene, words: &Words) -> Tin {
    let lattice_step = crate::scene::spacing().quanta_per_lattice_step();
    let side = words.grid().side_cells * 8;
    let (mut vertices, mut triangles, mut places) = (Vec::new(), Vec::new(), BTreeMap::new());
    let tiles = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(row, col)| tile(row, col));
    let folder = Folder::new(scene.path("area"));
    let manifest = folder.manifest().unwrap();
    let mut modules: Vec<_> = tiles.iter().flat_map(|&tile| folder.read_modules(&manifest, tile).unwrap().1).collect();
    modules.sort_by_key(|module| module.id);
    for module in modules {
        let own: Vec<u32> = module
            .vertices
            .iter()
            .map(|v| {
                let on_lattice = |index: u32, quanta: u16| index as i32 * side + i32::from(quanta) / lattice_step;
                let at = LatticePoint::new(on_lattice(module.id.row, v.y), on_lattice(module.id.col, v.x));
                *places.entry(at).or_insert_with(|| {
                    vertices.push(Vertex { at, height: v.z });
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        triangles.extend(module.triangles.iter().map(|triangle| triangle.map(|v| own[usize::from(v)])));
    }
    Tin::new(words.grid().area(), vertices, triangles)
}

#[test]
fn load_modules_are_measured_as_the_one_tin_they_make_up() {
    let (scene, dem) = built(&words());
    let tin = welded(&scene, &words());
    tin.check().unwrap();
    let found = measured(&scene, None).unwrap();
    let ground = DemGround::new(&dem, tin.rect, Metres(25.0));
    let mut welded = ground.measure(&Triangles::of_tin(&tin), SIGHTS.pairs, SIGHTS.seed, Some(20));
    // Every vertex on a side stands in two load modules.
    welded.hausdorff.tin_to_dem = found.measures.tin.hausdorff.tin_to_dem;
    assert_eq!(found.measures.tin, welded);
    let sight = welded.line_of_sight;
    assert!(sight.pairs() == 3000 && 0.8 < sight.agreement() && sight.agreement() < 1.0, "{sight:?}");
    let built = inspect::verify(&scene.path("area"), Some(&scene.path("dem.tif"))).unwrap().residual.unwrap();
    assert_eq!([found.residual.rms_m, found.residual.max_m], [built.rms_m, built.max_m]);
    let residual = found.measures.tin.residual;
    assert_eq!(
        [residual.rms_m, residual.max_m, residual.mean_abs_m, residual.p95_m, residual.p99_m],
        [built.rms_m, built.max_m, built.mean_abs_m, built.p95_m, built.p99_m]
    );
}

#[test]
fn a_database_is_sound_and_truer_than_the_grid_beside_it() {
    let (scene, _) = built(&words());
    let found = measured(&scene, None).unwrap().measures;
    let gaps = |mesh: &MeshForm| mesh.cracks + mesh.t_junctions + mesh.torn + mesh.wrong_areas;
    assert_eq!((gaps(&found.tin.mesh), gaps(&found.grid.mesh)), (0, 0));
    let (polygons, triangles) = (found.polygons as f64, found.grid.mesh.triangles as f64);
    assert!((0.6..1.6).contains(&(triangles / polygons)), "{polygons} polygons, a grid of {triangles} triangles");
    assert!(found.tin.residual.rms_m < found.grid.residual.rms_m, "{found:?}");
    assert!(found.tin.slope.rms_degrees < found.grid.slope.rms_degrees, "{found:?}");
    let aside = found.tin.registration.unwrap();
    assert!(aside.aside_m() < 2.5 && aside.up_m.abs() < 1.0, "{aside:?}");
    assert!(0 < found.tin.seams.unwrap().edges);
}

#[test]
fn a_raster_that_lies_aside_is_found_by_registration() {
    let (scene, dem) = built(&words());
    let rect = dem.rect();
    let moved = Dem::from_fn(rect, |post| {
        let (row, col) = ((post.row + 2).min(rect.north), (post.col - 3).max(rect.west));
        Some(dem.height(Post::new(row, col)) + 640)
    });
    write_dem(&scene.path("moved.tif"), &moved);
    // The raster lies 3 posts east and 2 south, so the database lies as far west and north; and 5 m below.
    let aside = measured(&scene, Some("moved.tif")).unwrap().measures.tin.registration.unwrap();
    let off = [aside.east_m + 75.0, aside.north_m - 50.0];
    assert!(off.iter().all(|off| off.abs() < 6.0), "{aside:?}");
    assert!(aside.correlation < aside.best_correlation, "{aside:?}");
}

#[test]
fn clipped_load_modules_are_measured_too_and_more_points_are_nearer_to_the_ground() {
    let clip = |points: u32| {
        let tin = format!("method = \"greedy\"\npoints = {points}\nallocation = \"global\"");
        let limits = "mean_per_load_module = 90".into();
        let (scene, _) = built(&Words { modules: "edges = \"clip\"".into(), tin, limits, ..words() });
        measured(&scene, None).unwrap().measures.tin
    };
    let (few, many) = (clip(60), clip(1200));
    assert!(few.line_of_sight.agreement() < many.line_of_sight.agreement(), "{few:?} {many:?}");
    assert!(many.slope.rms_degrees < few.slope.rms_degrees, "{few:?} {many:?}");
}

#[test]
fn the_ground_of_the_build_is_found_by_its_content() {
    let (scene, dem) = built(&words());
    let found = measured(&scene, None).unwrap();
    assert_eq!(found.measures, measured(&scene, Some("dem.tif")).unwrap().measures);
    // The same raster under another name has to be named.
    fs::rename(scene.path("dem.tif"), scene.path("moved.tif")).unwrap();
    let error = measured(&scene, None).unwrap_err();
    assert!(error.to_string().contains("\"dem.tif\", which is neither"), "{error}");
    assert!(error.hint().unwrap().contains("--against FILE"));
    assert_eq!(found.measures, measured(&scene, Some("moved.tif")).unwrap().measures);
    // Another raster under the same name is not the ground of the build.
    write_dem(&scene.path("dem.tif"), &Dem::from_fn(dem.rect(), |post| Some(dem.height(post) + 128 * (post.col % 2))));
    let error = measured(&scene, None).unwrap_err();
    assert!(error.to_string().contains("has changed since the build"), "{error}");
    assert!(measured(&scene, Some("dem.tif")).unwrap().measures != found.measures);
}

#[test]
fn several_rasters_are_joined_and_one_of_them_says_what_share_it_covers() {
    let (scene, dem) = built(&words());
    let whole = measured(&scene, None).unwrap();
    assert_eq!(whole.covered, 1.0);
    let rect = dem.rect();
    let middle = i32::midpoint(rect.west, rect.east);
    let parts = [("west.tif", rect.west, middle + 1), ("east.tif", middle, rect.east)];
    for (name, west, east) in parts {
        let inside = |post: Post| (west <= post.col && post.col <= east).then(|| dem.height(post));
        write_dem(&scene.path(name), &Dem::from_fn(rect, inside));
    }
    let joined = measured_against(&scene, &["west.tif", "east.tif"]).unwrap();
    assert_eq!((joined.against.ends_with("east.tif"), joined.covered), (true, 1.0));
    assert_eq!(joined.measures.tin.residual, whole.measures.tin.residual);
    let half = measured_against(&scene, &["west.tif"]).unwrap();
    assert!((0.5..0.55).contains(&half.covered), "{}", half.covered);
}

#[test]
fn the_sample_terrain_needs_no_file_and_voids_of_another_raster_are_left_out() {
    let words = Words { dem: "source = \"sample\"\nseed = 1".into(), ..words() };
    let scene = Scene::new(&words);
    drop(scene.build("area", 2));
    let sample = measured(&scene, None).unwrap();
    assert_eq!(sample.against, "the sample terrain, seed 1");
    let dem = sample_dem(words.grid(), 1);
    write_dem(&scene.path("whole.tif"), &dem);
    assert_eq!(measured(&scene, Some("whole.tif")).unwrap().measures, sample.measures);
    let hole = Post::new(60, 80);
    write_dem(&scene.path("holed.tif"), &Dem::from_fn(dem.rect(), |post| (post != hole).then(|| dem.height(post))));
    let holed = measured(&scene, Some("holed.tif")).unwrap().measures.tin;
    assert!(0 < holed.line_of_sight.left_out, "{holed:?}");
    assert_eq!(holed.slope.posts, sample.measures.tin.slope.posts - 5);
    assert_eq!(holed.residual.posts, sample.measures.tin.residual.posts - 1);
}
