//! Ground that is flat, has holes, is excluded, or has fewer posts than points are asked for.

use build::workbench::{TinMethod, TinRequest};
use job::{Effort, ErrorKey, Optimising};
use terrain::{Dem, Post, PostRect, StopReason, TinFault};

use crate::modes::write_polygon;
use crate::product::{Edges, Product};
use crate::scene::{Draw, Scene, Silent, Words, sample_dem, write_dem};
use crate::soundness::check;
use crate::surface::{sums_of_product, sums_of_tin};

fn small() -> Words {
    Words { size: (4, 6), tiles: (2, 3), ..Words::raster() }
}

/// Noise of 400 m: every post is worth selecting.
fn rough(rect: PostRect) -> Dem {
    let mut draw = Draw(5);
    Dem::from_fn(rect, |_| Some(draw.below(50_000) as i32))
}

/// Jobs that choose posts in different ways.
fn ways() -> [(&'static str, Words); 4] {
    let clip = "edges = \"clip\"".to_owned();
    let paper = "method = \"paper\"\npoints = 150".to_owned();
    [
        ("optimised", small()),
        ("paper", Words { tin: paper.clone(), ..small() }),
        ("clip, paper", Words { modules: clip.clone(), tin: paper, ..small() }),
        (
            "clip, greedy",
            Words { modules: clip, tin: "method = \"greedy\"\nkey = \"sse\"\npoints = 150".into(), ..small() },
        ),
    ]
}

/// The outer border is refined unless the paper's method or clipped edges fix it.
fn is_border_fixed(words: &Words) -> bool {
    words.modules.contains("clip") || words.tin.contains("paper")
}

#[test]
fn flat_ground_is_its_initial_points() {
    let area = small().grid().area();
    let dem = Dem::from_fn(area, |_| Some(12_345));
    for (name, words) in ways() {
        let scene = Scene::on(&words, &dem);
        check(&scene, &dem);
        let report = scene.build("area", 1).report;
        assert_eq!(report.points.selected, 0, "{name}");
        // Corners of load modules, and three points along each side that lies on a fixed outer border.
        let fixed = if is_border_fixed(&words) { 3 * 20 } else { 0 };
        assert_eq!((report.points.corner, report.points.border), (5 * 7, fixed), "{name}");
        assert_eq!(report.residual.max_m, 0.0, "{name}");
        if words.modules.is_empty() {
            let start = build::plan(&scene.job).unwrap().start;
            assert_eq!((report.triangles, start), (2 * 24 + fixed, 2 * 24 + fixed), "{name}");
            let folder = store::Folder::new(scene.path("area"));
            for record in folder.manifest().unwrap().tiles {
                assert_eq!(folder.read_tile(record.tile()).unwrap().1.stop, StopReason::Exhausted, "{name}");
            }
        }
    }
}

#[test]
fn a_slope_that_is_a_plane_needs_no_point() {
    let dem = Dem::from_fn(small().grid().area(), |post| Some(7 * post.row - 3 * post.col));
    for (name, words) in ways() {
        let scene = Scene::on(&words, &dem);
        check(&scene, &dem);
        assert_eq!(scene.build("area", 1).report.points.selected, 0, "{name}");
    }
}

#[test]
fn more_points_than_posts_end_exhausted_on_every_post() {
    // Clipped edges: with constrained ones so many points are refused before any work.
    let words = Words {
        size: (2, 4),
        tiles: (1, 2),
        modules: "edges = \"clip\"".into(),
        limits: "per_load_module = 2000\nmean_per_load_module = 2000\nper_4km_square = 100000".into(),
        tin: "method = \"greedy\"\npoints = 50000".into(),
        ..Words::raster()
    };
    let area = words.grid().area();
    let dem = rough(area);
    let scene = Scene::on(&words, &dem);
    check(&scene, &dem);
    let built = scene.build("area", 1);
    let folder = built.database.folder();
    for record in folder.manifest().unwrap().tiles {
        let (_, tile) = folder.read_tile(record.tile()).unwrap();
        assert_eq!(tile.stop, StopReason::Exhausted);
    }
    // Every post but those of the outer border is a vertex; on it every fifth one is.
    let inner = (area.post_count() - 2 * (area.cells_wide() + area.cells_high())) as u64;
    assert_eq!(built.report.points.total, inner + 2 * (80 + 40) / 5);

    let constrained = Words { modules: String::new(), ..words };
    let error = Scene::on(&constrained, &dem).try_build("area", 1).unwrap_err();
    assert!(error.to_string().contains("tin.points: 50000"), "{error}");
}

#[test]
fn a_mesh_of_more_points_than_posts_is_every_post() {
    let folder = tempfile::tempdir().unwrap();
    let rect = PostRect::of_size(31, 42);
    let dem = rough(rect);
    let path = folder.path().join("dem.tif");
    write_dem(&path, &dem);
    for tiles in [(1, 1), (2, 3)] {
        let optimised = TinMethod::Optimised(Optimising::default());
        for method in [TinMethod::Greedy { key: ErrorKey::Max }, TinMethod::Paper, optimised] {
            let request = TinRequest {
                points: Some(10_000),
                tiles: Some(tiles),
                workers: 2,
                ..TinRequest::plain(path.clone(), method)
            };
            let mesh = build::workbench::tin(&request, &false.into(), &mut Silent).unwrap();
            mesh.tin.check().unwrap();
            let sums = sums_of_tin(&mesh.tin, &dem);
            assert_eq!(mesh.stop, StopReason::Exhausted, "{method:?} {tiles:?}");
            // Residuals of less than half a metre are none in the paper's whole metres.
            let none = if method == TinMethod::Paper { 0.5 } else { 0.0 };
            assert!(sums.max_m() <= none && (mesh.residual.max_m - sums.max_m()).abs() < 1e-9, "{method:?} {tiles:?}");
        }
    }
}

#[test]
fn a_tile_in_which_nothing_weighs_keeps_its_initial_points() {
    let areas = "areas = [{ file = \"none.geojson\", class = \"none\", weight = 0 }]\nsmooth = \"none\"";
    for (name, words) in ways() {
        let words = Words { importance: areas.into(), ..words };
        // All of tile 0,0, seams included: two load modules each way.
        let scene = Scene::with_files(&words, |folder| {
            write_dem(&folder.join("dem.tif"), &sample_dem(words.grid(), 1));
            write_polygon(&folder.join("none.geojson"), [-50.0, -50.0, 1010.0, 1010.0]);
        });
        check(&scene, &sample_dem(words.grid(), 1));
        let folder = store::Folder::new(scene.path("area"));
        let (_, tile) = folder.read_tile(crate::scene::tile(0, 0)).unwrap();
        // Nine corners of load modules, and three points on each of four sides of a fixed outer border.
        let fixed = if is_border_fixed(&words) { 12 } else { 0 };
        assert_eq!((tile.residuals.len(), tile.tin.vertices.len()), (0, 9 + fixed), "{name}");
    }
}

#[test]
fn where_nothing_weighs_at_all_the_area_keeps_its_initial_points() {
    for (name, words) in ways() {
        let words = Words { importance: "default = 0".into(), ..words };
        let dem = sample_dem(words.grid(), 1);
        let scene = Scene::on(&words, &dem);
        check(&scene, &dem);
        assert_eq!(scene.build("area", 1).report.points.selected, 0, "{name}");
    }
}

/// The sample terrain with round holes: centre and radius in posts.
fn with_holes(dem: &Dem, holes: &[(Post, i32)]) -> Dem {
    Dem::from_fn(dem.rect(), |post| {
        let inside = |(centre, radius): &(Post, i32)| {
            (post.row - centre.row).pow(2) + (post.col - centre.col).pow(2) <= radius.pow(2)
        };
        (!holes.iter().any(inside)).then(|| dem.height(post))
    })
}

#[test]
fn voids_fail_unless_they_are_to_be_filled() {
    let dem = sample_dem(small().grid(), 1);
    // One on a seam with a load-module corner in it, one on the outer border.
    let holes = [(Post::new(40, 40), 4), (Post::new(0, 90), 3)];
    let holed = with_holes(&dem, &holes);
    let error = Scene::on(&small(), &holed).try_build("area", 2).unwrap_err();
    assert!(error.to_string().contains(&format!("{}", holed.void_count())) && error.hint().is_some(), "{error}");

    for (name, words) in ways() {
        let filled = |posts: u32| {
            let voids = format!("{}\nvoids = {{ fill_within_posts = {posts} }}", words.dem);
            Scene::on(&Words { dem: voids, ..words.clone() }, &holed)
        };
        let error = filled(2).try_build("area", 2).unwrap_err();
        assert!(error.to_string().contains('2') && error.hint().is_some(), "{name}: {error}");
        let scene = filled(8);
        let built = scene.build("area", 2);
        let expected = holed.void_count() as u64;
        assert_eq!((built.report.voids.count, built.report.voids.filled), (expected, expected), "{name}");
        drop(built);
        scene.verify("area");
        let product = Product::read(&scene.path("area"));
        let clipped = !words.modules.is_empty();
        product.check(if clipped { Edges::Clipped } else { Edges::Constrained });
        // Filled heights lie between those around them: no spike, no pit. A vertex that is fitted on the highest post
        // may stand a quarter of a metre above it.
        let fitted = if name == "optimised" { 32 } else { 0 };
        let ends = |heights: &mut dyn Iterator<Item = i32>| {
            heights.fold((i32::MAX, i32::MIN), |(a, b), h| (a.min(h), b.max(h)))
        };
        let posts = || (0..=80).flat_map(|row| (0..=120).map(move |col| Post::new(row, col)));
        let (low, high) = ends(&mut posts().map(|post| dem.height(post)));
        let (lowest, highest) = ends(&mut product.modules.values().flat_map(|m| &m.vertices).map(|v| v.z));
        let is_between = low - fitted <= lowest && highest <= high + fitted;
        assert!(is_between, "{name}: {lowest} to {highest} of {low} to {high}");
        assert!(sums_of_product(&product, &holed).rms_m() < 60.0, "{name}");
    }
}

#[test]
fn a_dem_of_nothing_but_voids_is_refused_whatever_is_asked() {
    let holed = Dem::from_fn(small().grid().area(), |_| None);
    for voids in ["voids = \"fail\"", "voids = { fill_within_posts = 1024 }"] {
        let words = Words { dem: format!("sources = [\"dem.tif\"]\n{voids}"), ..small() };
        let error = Scene::on(&words, &holed).try_build("area", 2).unwrap_err();
        assert!(error.to_string().contains("dem.tif") && error.hint().is_some(), "{error}");
    }
}

#[test]
fn voids_of_a_mesh_are_no_vertices_and_in_no_statistic() {
    let folder = tempfile::tempdir().unwrap();
    let dem = sample_dem(small().grid(), 1);
    let holed = with_holes(&dem, &[(Post::new(30, 30), 9), (Post::new(60, 100), 5)]);
    let path = folder.path().join("dem.tif");
    write_dem(&path, &holed);
    for tiles in [(1, 1), (2, 3)] {
        let method = TinMethod::Greedy { key: ErrorKey::Sse };
        let request =
            TinRequest { points: Some(400), tiles: Some(tiles), workers: 2, ..TinRequest::plain(path.clone(), method) };
        let mesh = build::workbench::tin(&request, &false.into(), &mut Silent).unwrap();
        // Whole but for the voids, over which there is no ground; in doubled squares of steps between posts.
        let Err(TinFault::AreaMissing(found, whole)) = mesh.tin.check() else { panic!("voids are covered") };
        let missing = (whole - found) / (2 * 64);
        let voids = holed.void_count() as i64;
        assert!((voids - missing).abs() < voids / 4, "{missing} cells of {voids} voids");
        assert_eq!(mesh.points, mesh.tin.vertices.len());
        let corners = (tiles.0 + 1) * (tiles.1 + 1);
        let on_voids = mesh.tin.vertices.iter().filter(|v| holed.is_void(v.at.post().unwrap())).count();
        assert!(on_voids <= corners as usize, "{on_voids} vertices stand on voids");
        // Over what is known; of the triangles that are left all but the rims of voids.
        let sums = sums_of_tin(&mesh.tin, &holed);
        let [rms_m, left_m] = [mesh.residual.rms_m, sums.rms_m()];
        assert!((rms_m - left_m).abs() < 0.05 * rms_m, "{rms_m} {left_m}");
        assert!(sums.max_m() <= mesh.residual.max_m + 1e-9);
    }
}

#[test]
fn beside_voids_no_vertex_of_a_mesh_stands_outside_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    let height = |post: Post| {
        let [row, col] = [post.row, post.col].map(f64::from);
        (128.0 * (1000.0 + 80.0 * (row / 10.0).sin() * (col / 15.0).cos())) as i32
    };
    let rect = PostRect::of_size(101, 121);
    let is_void = |post: Post| (51..81).contains(&post.row) && (30..70).contains(&post.col);
    for effort in [Effort::Fast, Effort::Normal, Effort::Best] {
        let residual_of = |dem: &Dem| {
            write_dem(&path, dem);
            let request = TinRequest {
                triangles: Some(500),
                workers: 2,
                ..TinRequest::plain(path.clone(), TinMethod::Optimised(Optimising { effort, ..Optimising::default() }))
            };
            let mesh = build::workbench::tin(&request, &false.into(), &mut Silent).unwrap();
            let mut heights = mesh.tin.vertices.iter().map(|vertex| f64::from(vertex.height) / 128.0);
            assert!(heights.all(|height| (904.0..=1096.0).contains(&height)), "{effort:?}");
            mesh.residual
        };
        let whole = residual_of(&Dem::from_fn(rect, |post| Some(height(post))));
        let holed = residual_of(&Dem::from_fn(rect, |post| (!is_void(post)).then(|| height(post))));
        let is_as_true = holed.rms_m < 1.5 * whole.rms_m && holed.max_m < 5.0 * whole.max_m;
        assert!(is_as_true, "{effort:?}: {holed:?} {whole:?}");
    }
}

#[test]
fn a_raster_that_no_mesh_has_room_for_is_refused_before_its_heights_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("dem.tif");
    // None of them is a height, which nothing tells before they are read.
    write_dem(&path, &Dem::from_fn(PostRect::of_size(3, 17_000), |_| None));
    let request = TinRequest {
        points: Some(400),
        workers: 2,
        ..TinRequest::plain(path, TinMethod::Greedy { key: ErrorKey::Sse })
    };
    let of_one = build::workbench::tin(&request, &false.into(), &mut Silent).unwrap_err().to_string();
    assert!(of_one.contains("tiles of 16999 cells, expected tiles below 16384 cells a side"), "{of_one}");
    let of_levels =
        build::workbench::tin_levels(&request, &[100, 400], &false.into(), &mut Silent).unwrap_err().to_string();
    assert_eq!(of_levels, of_one);
    let cut = TinRequest { tiles: Some((1, 2)), ..request };
    let of_two = build::workbench::tin(&cut, &false.into(), &mut Silent).unwrap_err().to_string();
    assert!(!of_two.contains("--tiles"), "{of_two}");
}
