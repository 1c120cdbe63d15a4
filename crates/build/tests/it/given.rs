//! Points that a job gives: what tiles start from, and pins.

use std::collections::BTreeSet;
use std::path::Path;

use store::Folder;
use terrain::{LatticePoint, Post, TileTin, Vertex};

use crate::product::{Edges, Product};
use crate::scene::{Draw, ORIGIN_M, SIDE_CELLS, Scene, Words, differing, sample_dem, tile};

const CONSTRAINED: &str = "method = \"greedy\"";
const PAPER: &str = "method = \"paper\"\npoints = 900";

fn words(tin: &str) -> Words {
    let mean = "mean_per_load_module = 32";
    let edges = if tin.contains("paper") { "edges = \"clip\"" } else { "" };
    Words { tin: tin.into(), limits: mean.into(), modules: edges.into(), ..Words::sample() }
}

fn tins(scene: &Scene, folder: &str) -> Vec<TileTin> {
    let folder = Folder::new(scene.path(folder));
    (0..9).map(|i| folder.read_tile(tile(i / 3, i % 3)).unwrap().1).collect()
}

/// All vertices of an area that stand on posts, each once.
fn vertices(scene: &Scene, folder: &str) -> BTreeSet<(Post, i32)> {
    let all = tins(scene, folder);
    let on_posts =
        all.iter().flat_map(|tile| &tile.tin.vertices).filter_map(|v: &Vertex| Some((v.at.post()?, v.height)));
    on_posts.collect()
}

/// Writes pins; each is (pin, row, col, more properties).
pub fn write_pins(path: &Path, pins: &[(&str, i32, i32, &str)]) {
    let feature = |&(pin, row, col, more): &(&str, i32, i32, &str)| {
        let at = [ORIGIN_M[0] + f64::from(col) * 25.0, ORIGIN_M[1] + f64::from(row) * 25.0];
        format!(
            r#"{{"type":"Feature","geometry":{{"type":"Point","coordinates":[{},{}]}},
                "properties":{{"pin":"{pin}"{more}}}}}"#,
            at[0], at[1]
        )
    };
    let all: Vec<String> = pins.iter().map(feature).collect();
    std::fs::write(path, format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, all.join(","))).unwrap();
}

fn pinned(tin: &str, pins: &[(&str, i32, i32, &str)]) -> Scene {
    Scene::with_files(&words(&format!("{tin}\npins = \"pins.geojson\"")), |folder| {
        write_pins(&folder.join("pins.geojson"), pins);
    })
}

#[track_caller]
fn check_refused(scene: &Scene, expected: &str) {
    let error = scene.try_build("a.tdb", 1).unwrap_err().to_string();
    assert!(error.ends_with(expected), "{error}");
}

#[test]
fn tiles_start_from_what_another_method_chooses_within_all_limits() {
    for (start, tin) in [("vip", CONSTRAINED), ("lattice", CONSTRAINED), ("vip", PAPER), ("contour", PAPER)] {
        let start = format!("{tin}\nstart = {{ method = \"{start}\", points = 450 }}");
        let scene = Scene::new(&words(&start));
        scene.build("a.tdb", 2);
        scene.verify("a.tdb");
        let edges = if tin == PAPER { Edges::Clipped } else { Edges::Constrained };
        Product::read(&scene.path("a.tdb")).check(edges);
        let without = Scene::new(&words(tin));
        without.build("a.tdb", 2);
        let count = |scene: &Scene| tins(scene, "a.tdb").iter().map(|tile| tile.initial_count).sum::<u32>();
        let more = count(&scene) - count(&without);
        assert!((200..700).contains(&more), "{start}: {more} points more to start from");
        // What the same job builds again is the same, and one worker builds what two do.
        scene.build("b.tdb", 1);
        assert_eq!(differing(&scene.product("a.tdb"), &scene.product("b.tdb")), Vec::<String>::new());
    }
}

#[test]
fn a_pin_is_a_vertex_on_both_sides_of_a_line_with_the_height_it_says() {
    // Inside a tile, on a line between tiles, on the outer border; row 60 is where tiles meet.
    let pins = [("add", 31, 33, ""), ("height", 60, 27, r#","height_m":1234.5"#), ("add", 0, 33, r#","height_m":900"#)];
    for tin in [CONSTRAINED, PAPER, "method = \"optimised\""] {
        let scene = pinned(tin, &pins);
        scene.build("a.tdb", 2);
        scene.verify("a.tdb");
        let all = vertices(&scene, "a.tdb");
        assert!(all.iter().any(|&(post, _)| post == Post::new(31, 33)), "{tin}");
        assert!(all.contains(&(Post::new(60, 27), 1234 * 128 + 64)), "{tin}");
        assert!(all.contains(&(Post::new(0, 33), 900 * 128)), "{tin}");
        assert_eq!(all.iter().filter(|(post, _)| *post == Post::new(60, 27)).count(), 1);
        let edges = if tin == PAPER { Edges::Clipped } else { Edges::Constrained };
        Product::read(&scene.path("a.tdb")).check(edges);
    }
}

#[test]
fn a_forbidden_post_is_left_out_and_pins_count_towards_the_points() {
    let first = pinned(PAPER, &[("add", 31, 33, "")]);
    let report = first.build("a.tdb", 2).report;
    assert!(report.points.selected <= 900, "{:?}", report.points);
    let selected = |tins: &[TileTin]| -> Vec<Post> {
        let own = &tins[4];
        let chosen = &own.tin.vertices[own.initial_count as usize..];
        chosen.iter().filter_map(|vertex| vertex.at.post()).filter(|post| post.row % SIDE_CELLS != 0).collect()
    };
    let inside = selected(&tins(&first, "a.tdb"));
    let post = inside[inside.len() / 2];
    let second = pinned(PAPER, &[("add", 31, 33, ""), ("forbid", post.row, post.col, "")]);
    second.build("a.tdb", 2);
    assert!(vertices(&first, "a.tdb").iter().any(|(at, _)| *at == post));
    assert!(!vertices(&second, "a.tdb").iter().any(|(at, _)| *at == post));
}

#[test]
fn no_vertex_moves_to_where_a_forbidden_post_is_nearest() {
    let free = Scene::new(&words("method = \"optimised\""));
    free.build("a.tdb", 2);
    let nearest = |at: LatticePoint| Post::new((at.row + 4).div_euclid(8), (at.col + 4).div_euclid(8));
    // Inside a tile, and on a line between tiles and a line between load modules.
    let stands = |post: Post, scene: &Scene, folder: &str| {
        tins(scene, folder).iter().flat_map(|tile| &tile.tin.vertices).any(|v| nearest(v.at) == post)
    };
    let all = tins(&free, "a.tdb");
    let inside = all[4].tin.vertices.iter().map(|v| nearest(v.at)).filter(|post| {
        let (row, col) = (post.row % SIDE_CELLS, post.col % SIDE_CELLS);
        (row == 0) != (col == 0) || (row == 9 && 0 < col)
    });
    let posts: Vec<Post> = inside.collect();
    assert!(8 <= posts.len(), "{posts:?}");
    let pins: Vec<_> = posts.iter().map(|post| ("forbid", post.row, post.col, "")).collect();
    let scene = pinned("method = \"optimised\"", &pins);
    scene.build("a.tdb", 2);
    scene.verify("a.tdb");
    for &post in &posts {
        assert!(stands(post, &free, "a.tdb") && !stands(post, &scene, "a.tdb"), "{post}");
    }
}

#[test]
fn a_tile_with_a_new_pin_is_run_again_alone_and_made_whole_by_the_next_build() {
    // On the line that tile 0,0 gives to its neighbour, and inside it.
    let (outside, inside) = (("height", 60, 27, r#","height_m":1234.5"#), ("add", 31, 33, ""));
    for tin in [CONSTRAINED, "method = \"optimised\""] {
        let scene = pinned(tin, &[("add", 100, 100, "")]);
        scene.build("area", 2);
        write_pins(&scene.path("pins.geojson"), &[("add", 100, 100, ""), outside, inside]);
        let (refined, is_frozen) = scene.tile("area", tile(0, 0), false);
        assert!(refined == [tile(0, 0)] && is_frozen, "{tin}: {refined:?}");
        let now = vertices(&scene, "area");
        assert!(now.iter().any(|&(post, _)| post == Post::new(31, 33)), "{tin}");
        assert!(!now.contains(&(Post::new(60, 27), 1234 * 128 + 64)), "{tin}: a frozen side has taken a pin");
        scene.verify("area");
        scene.build("area", 2);
        assert!(vertices(&scene, "area").contains(&(Post::new(60, 27), 1234 * 128 + 64)), "{tin}");
        scene.build("fresh", 2);
        assert_eq!(differing(&scene.product("area"), &scene.product("fresh")), Vec::<String>::new(), "{tin}");
    }
}

#[test]
fn only_tiles_that_a_pin_reaches_are_built_again() {
    let scene = pinned(PAPER, &[("add", 31, 33, "")]);
    scene.build("a.tdb", 2);
    let before = scene.product("a.tdb");
    // Far inside the north-eastern tile.
    write_pins(&scene.path("pins.geojson"), &[("add", 31, 33, ""), ("add", 153, 171, "")]);
    scene.build("a.tdb", 2);
    let changed = differing(&before, &scene.product("a.tdb"));
    // What clipped limits take out is decided over the whole area, but no other tile is refined again.
    let refined: Vec<&String> = changed.iter().filter(|name| name.ends_with(".tin")).collect();
    assert_eq!(refined, ["tiles/r02c02.tin"]);
    scene.build("fresh.tdb", 2);
    assert_eq!(differing(&scene.product("a.tdb"), &scene.product("fresh.tdb")), Vec::<String>::new());
}

#[test]
fn a_polygon_of_importance_draws_points_and_an_excluded_one_has_none() {
    let ring = |low: i32, high: i32| {
        let at = |row: i32, col: i32| {
            format!("[{},{}]", ORIGIN_M[0] + f64::from(col) * 25.0, ORIGIN_M[1] + f64::from(row) * 25.0)
        };
        let corners = [at(low, low), at(low, high), at(high, high), at(high, low), at(low, low)];
        format!(r#"{{"type":"Polygon","coordinates":[[{}]]}}"#, corners.join(","))
    };
    let build = |said: &str| {
        let text = format!(r#"{{"type":"Feature","geometry":{},"properties":{{{said}}}}}"#, ring(65, 115));
        let tin = format!("{PAPER}\nallocation = \"equal\"\npins = \"pins.geojson\"");
        let scene = Scene::with_files(&words(&tin), |folder| {
            std::fs::write(folder.join("pins.geojson"), text).unwrap();
        });
        scene.build("a.tdb", 2);
        let inside = |post: &Post| (66..115).contains(&post.row) && (66..115).contains(&post.col);
        let is_corner = |post: &Post| post.row % SIDE_CELLS == 0 && post.col % SIDE_CELLS == 0;
        vertices(&scene, "a.tdb").iter().filter(|(post, _)| inside(post) && !is_corner(post)).count()
    };
    let (none, usual, many) = (
        build(r#""pin":"exclude""#),
        build(r#""pin":"importance","factor":1"#),
        build(r#""pin":"importance","factor":30"#),
    );
    assert!(none == 0 && usual < many, "{none}, {usual}, {many}");
}

/// Whether a place lies inside a ring, all in posts.
fn is_within(ring: &[[f64; 2]], [col, row]: [f64; 2]) -> bool {
    let next = ring.iter().cycle().skip(1);
    let crosses = |(a, b): (&[f64; 2], &[f64; 2])| {
        (a[1] <= row) != (b[1] <= row) && col < a[0] + (row - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    ring.iter().zip(next).filter(|&edge| crosses(edge)).count() % 2 == 1
}

#[test]
fn an_excluded_polygon_has_no_vertex_whatever_the_method_and_the_points_to_start_from() {
    let methods =
        ["", "effort = \"fast\"", CONSTRAINED, "lattice = \"post\"", "start = { method = \"vip\", points = 300 }"];
    for seed in 0..15_u64 {
        let draw = &mut Draw(seed);
        let middle = [draw.within(20, 60), draw.within(20, 60)].map(f64::from);
        let corner = |turn: f64, reach: f64| [middle[0] + reach * turn.cos(), middle[1] + reach * turn.sin()];
        let count = draw.within(3, 7);
        let mut reach = || f64::from(draw.within(30, 250)) / 10.0;
        let ring: Vec<[f64; 2]> =
            (0..count).map(|at| corner(f64::from(at) / f64::from(count) * std::f64::consts::TAU, reach())).collect();
        let place = |&[col, row]: &[f64; 2]| format!("[{},{}]", ORIGIN_M[0] + col * 25.0, ORIGIN_M[1] + row * 25.0);
        let corners: Vec<String> = ring.iter().chain(&ring[..1]).map(place).collect();
        let geometry = format!(r#"{{"type":"Polygon","coordinates":[[{}]]}}"#, corners.join(","));
        let pin = format!(r#"{{"type":"Feature","properties":{{"pin":"exclude"}},"geometry":{geometry}}}"#);
        let method = methods[seed as usize % methods.len()];
        let tin = format!("{method}\npins = \"pins.geojson\"");
        let small = Words { size: (4, 4), tiles: (2, 2), limits: String::new(), ..words(&tin) };
        let scene = Scene::with_files(&small, |folder| std::fs::write(folder.join("pins.geojson"), pin).unwrap());
        scene.build("a.tdb", 2);
        let folder = Folder::new(scene.path("a.tdb"));
        for index in 0..4 {
            let tin = folder.read_tile(tile(index / 2, index % 2)).unwrap().1.tin;
            let steps = f64::from(tin.steps_per_post);
            let side = SIDE_CELLS * tin.steps_per_post;
            for LatticePoint { row, col } in tin.vertices.iter().map(|vertex| vertex.at) {
                let is_corner = row % side == 0 && col % side == 0;
                let place = [f64::from(col) / steps, f64::from(row) / steps];
                assert!(is_corner || !is_within(&ring, place), "seed {seed}: {method:?}: a vertex at {place:?}");
            }
        }
    }
}

#[test]
fn what_no_pin_may_be_is_told_with_its_place_in_the_file() {
    check_refused(
        &pinned(CONSTRAINED, &[("add", 31, 33, ""), ("add", -3, 5, "")]),
        "points inside the area, its border included",
    );
    check_refused(
        &pinned(CONSTRAINED, &[("forbid", 40, 60, "")]),
        "that is a corner of load modules, expected another",
    );
    check_refused(&pinned(PAPER, &[("forbid", 0, 65, "")]), "that is a point of the outer border, expected another");
    check_refused(
        &pinned(CONSTRAINED, &[("height", 31, 33, "")]),
        "a height pin without height_m, expected height_m in metres",
    );
    check_refused(
        &pinned(CONSTRAINED, &[("add", 7, 7, ""), ("forbid", 7, 7, "")]),
        "at post 7,7, expected one of the two",
    );
    let other = [("height", 7, 7, r#","height_m":600"#), ("add", 9, 9, ""), ("height", 7, 7, r#","height_m":700"#)];
    let scene = pinned(CONSTRAINED, &other);
    let file = scene.path("pins.geojson");
    check_refused(&scene, "feature 0 has 600.00 m, expected one height for a post");
    let error = scene.try_build("a.tdb", 1).unwrap_err().to_string();
    assert!(
        error.starts_with(&format!("{}: feature 2: a height of 700.00 m at post 7,7, where", file.display())),
        "{error}"
    );
}

#[test]
fn pins_at_one_post_agree_where_they_say_the_same_or_only_one_says_a_height() {
    let height = ("height", 31, 33, r#","height_m":900"#);
    let scene = pinned(CONSTRAINED, &[("add", 31, 33, ""), height, height]);
    scene.build("a.tdb", 2);
    assert!(vertices(&scene, "a.tdb").contains(&(Post::new(31, 33), 900 * 128)));
}

#[test]
fn a_pin_far_off_the_ground_is_a_warning_that_names_it() {
    let words = Words { dem: "sources = [\"dem.tif\"]".into(), ..words("pins = \"pins.geojson\"") };
    let dem = sample_dem(words.grid(), 1);
    let ground_m = terrain::metres_of_quanta(dem.height(Post::new(31, 33)));
    let warnings = |height_m: f64| {
        let scene = Scene::on(&words, &dem);
        let said = format!(r#","height_m":{height_m}"#);
        write_pins(&scene.path("pins.geojson"), &[("add", 7, 7, ""), ("height", 31, 33, &said)]);
        let report = scene.build("a.tdb", 2).report;
        let [low_m, high_m] = report.heights.unwrap().sources_m.unwrap();
        assert!(low_m < ground_m && high_m < 7120.0, "a pin is no source");
        report.warnings
    };
    assert_eq!(warnings(ground_m + 5.0), Vec::<String>::new());
    let [beyond, far] = &warnings(7120.0)[..] else { panic!("expected two warnings") };
    let (beyond, far) = if far.contains("feature 1") { (beyond, far) } else { (far, beyond) };
    assert!(beyond.contains("beyond the heights of the sources"), "{beyond}");
    let off =
        format!("pins.geojson: feature 1: a height of 7120.00 m, {:.2} m above the ground there", 7120.0 - ground_m);
    assert!(far.ends_with(&off), "{far}");
}

#[test]
fn a_file_of_points_starts_tiles_and_fixes_the_border() {
    let tin = format!("{CONSTRAINED}\nstart = \"points.csv\"");
    let scene = Scene::with_files(&words(&tin), |folder| {
        let at = |row: i32, col: i32| (ORIGIN_M[0] + f64::from(col) * 25.0, ORIGIN_M[1] + f64::from(row) * 25.0);
        let (inner, border) = (at(31, 33), at(0, 47));
        let text = format!("east,north,height_m\n{},{},\n{},{},777\n", inner.0, inner.1, border.0, border.1);
        std::fs::write(folder.join("points.csv"), text).unwrap();
    });
    scene.build("a.tdb", 2);
    scene.verify("a.tdb");
    let all = vertices(&scene, "a.tdb");
    assert!(all.contains(&(Post::new(0, 47), 777 * 128)));
    assert!(all.iter().any(|(post, _)| *post == Post::new(31, 33)));
}

#[test]
fn points_on_a_fixed_outer_border_count_in_the_limits() {
    for tin in ["start = \"points.csv\"", "effort = \"fast\"\nstart = \"points.csv\""] {
        let fixed = Words { modules: "outer_border = \"fixed\"".into(), ..words(tin) };
        let scene = Scene::with_files(&fixed, |folder| {
            let places = (1..20).map(|step| [0, step * 7]).chain((1..20).map(|step| [step * 9, 200]));
            let lines = places.map(|[row, col]| {
                format!("{},{},\n", ORIGIN_M[0] + f64::from(col) * 25.0, ORIGIN_M[1] + f64::from(row) * 25.0)
            });
            std::fs::write(folder.join("points.csv"), format!("east,north,height_m\n{}", lines.collect::<String>()))
                .unwrap();
        });
        let report = scene.build("a.tdb", 2).report;
        assert!(report.breaches.is_empty(), "{tin}: {:?}", report.breaches);
        scene.verify("a.tdb");
        let count = vertices(&scene, "a.tdb").iter().filter(|(post, _)| post.row == 0 && post.col % 7 == 0).count();
        assert!(19 <= count, "{count} of 19 points on the border are there");
    }
}

#[test]
fn crowded_pins_leave_the_limits_whole_where_there_is_room_for_them() {
    // In the first tile a pin on every second post of each second row: together three fifths of the area's triangles.
    let places = |side: i32| (1..side).step_by(2).flat_map(move |row| (1..side).step_by(2).map(move |col| (row, col)));
    let pins: Vec<(&str, i32, i32, &str)> = places(3 * SIDE_CELLS).map(|(row, col)| ("add", row, col, "")).collect();
    let limits = "mean_per_load_module = 32\nper_load_module = 600\nper_4km_square = 40000";
    for tin in [CONSTRAINED, "effort = \"fast\"", "effort = \"normal\""] {
        let crowded = Words { limits: limits.into(), ..words(&format!("{tin}\npins = \"pins.geojson\"")) };
        let scene = Scene::with_files(&crowded, |folder| write_pins(&folder.join("pins.geojson"), &pins));
        let report = scene.build("a.tdb", 2).report;
        assert!(report.breaches.is_empty(), "{tin}: {:?}", report.breaches);
        let at: BTreeSet<Post> = vertices(&scene, "a.tdb").into_iter().map(|(post, _)| post).collect();
        assert!(pins.iter().all(|&(_, row, col, _)| at.contains(&Post::new(row, col))), "{tin}: a pin is gone");
        scene.verify("a.tdb");
    }
}
