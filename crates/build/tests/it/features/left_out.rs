//! Coarser levels of detail that do without classes of features.

use std::collections::BTreeSet;

use features::Kind;
use job::Job;
use terrain::Role;
use terrain::{LoadModule, TileId};

use super::drawing::{Drawing, Laid, line, polygon};
use crate::scene::{ORIGIN_M, SIDE_CELLS, Words};

fn hills(east: f64, north: f64) -> f64 {
    500.0 + 20.0 * ((east * 0.004).sin() + (north * 0.006).cos()) + 0.02 * north
}

fn words(levels: &str, class_of_track: &str) -> Words {
    let words = Drawing::words();
    let tin = format!("{}\n[lod]\n{levels}", words.tin);
    let rule = format!("rules = [{{ where = {{ highway = \"track\" }}, class = \"{class_of_track}\" }}]");
    let features = format!("{}\n{rule}", words.features);
    Words { tin, features, ..words }
}

fn drawing(words: Words) -> Drawing {
    let drawn = [
        line("highway=primary", &[(0.0, 950.0), (1000.0, 1030.0), (2000.0, 940.0)]),
        line("highway=track", &[(130.0, 1900.0), (700.0, 1450.0), (1100.0, 1030.0), (1730.0, 150.0)]),
        polygon("natural=water", &[(300.0, 300.0), (700.0, 350.0), (600.0, 700.0)]),
    ];
    Drawing::of(words, hills, &drawn)
}

/// Places of a level's vertices, in quanta from the area's corner.
fn places(drawing: &Drawing, level: usize) -> BTreeSet<[i64; 2]> {
    let folder = store::Folder::new(drawing.scene.path("area.tdb"));
    let manifest = folder.manifest().unwrap();
    let tiles = (0..2).flat_map(|row| (0..2).map(move |col| TileId { row, col }));
    let modules = tiles.flat_map(|tile| folder.read_levels(&manifest, tile).unwrap().1.swap_remove(level));
    let side = i64::from(SIDE_CELLS) * 25 * 128;
    let place = |module: &LoadModule| -> Vec<[i64; 2]> {
        let [row, col] = [module.id.row, module.id.col].map(|index| i64::from(index) * side);
        module.vertices.iter().map(|v| [col + i64::from(v.x), row + i64::from(v.y)]).collect()
    };
    modules.flat_map(|module| place(&module)).collect()
}

/// Vertices of the centrelines and outlines of a kind, likewise; those on the lines between load modules not counted,
/// which a full border keeps.
fn inside(laid: &Laid, kind: Kind, roles: &[Role]) -> BTreeSet<[i64; 2]> {
    let quanta = |metres: f64| (metres * 128.0).round() as i64;
    let side = i64::from(SIDE_CELLS) * 25 * 128;
    let lines = roles.iter().flat_map(|role| laid.lines(kind, *role)).flatten();
    let all = lines.map(|at| [quanta(at[0] - ORIGIN_M[0]), quanta(at[1] - ORIGIN_M[1])]);
    // The ends of a strip may reach over the side of the area.
    let is_inside = |along: &i64| 0 < *along && *along < 4 * side && along % side != 0;
    all.filter(|at| at.iter().all(is_inside)).collect()
}

const ROAD: [Role; 2] = [Role::Centre, Role::Side];

#[test]
fn a_level_does_without_the_classes_that_it_leaves_out_and_keeps_all_others() {
    for border in ["full", "own"] {
        let levels = format!(
            "levels = [{{ inner_share = 0.5 }}, {{ inner_share = 0.3, leave_out = [\"track\"] }}, \
             {{ inner_share = 0.1, leave_out = [\"lake\"] }}]\nborder = \"{border}\""
        );
        let drawing = drawing(words(&levels, "track"));
        // It verifies what was built: no crack at any level, and fingerprints by what is left out.
        let laid = drawing.built();
        let (primary, track) = (inside(&laid, Kind::Primary, &ROAD), inside(&laid, Kind::Track, &ROAD));
        let lake = inside(&laid, Kind::Lake, &[Role::Shore]);
        let own: BTreeSet<[i64; 2]> = track.difference(&primary).copied().collect();
        assert!(!primary.is_empty() && 5 < own.len() && 2 < lake.len());
        let share = |level: usize, of: &BTreeSet<[i64; 2]>| {
            let there = places(&drawing, level);
            of.iter().filter(|at| there.contains(*at)).count() as f64 / of.len() as f64
        };
        let shares = |of: &BTreeSet<[i64; 2]>| [0, 1, 2, 3].map(|level| share(level, of));
        assert_eq!(shares(&primary), [1.0; 4], "{border}");
        let [finest, first, second, third] = shares(&own);
        assert_eq!([finest, first], [1.0; 2], "{border}");
        assert!(second < 0.8 && third < 0.4 && third <= second, "{border}: {second} {third}");
        let [.., second, third] = shares(&lake);
        assert!(second == 1.0 && third < 0.7, "{border}: {third}");
    }
}

#[test]
fn a_class_that_changed_makes_the_levels_again_that_leave_it_out() {
    let levels = "levels = [{ inner_share = 0.2, leave_out = [\"track\"] }]";
    let (mut before, after) = (drawing(words(levels, "track")), drawing(words(levels, "trail")));
    before.built();
    let text = words(levels, "trail").text();
    before.scene.job = Job::from_text(&text, &before.scene.path("job.toml")).unwrap();
    before.built();
    after.built();
    crate::scene::assert_same(
        &after.scene.product("area.tdb"),
        &before.scene.product("area.tdb"),
        "after a track was called a trail",
    );
}
