//! What is altered of roads, rivers and lakes.

use std::collections::BTreeSet;
use std::fs;

use store::{
    AreaLevel, FeatureLine, FileStamp, Folder, Manifest, Profile, Stamp, decode_lines, encode_level, encode_lines,
    encode_profile, files,
};
use terrain::Role;
use terrain::{LatticePoint, QUANTA_PER_METRE, SurfaceGround, TileFeatures, TileId, Vertex};

use super::{Alter, Forged, forged, nothing};
use crate::features::{geojson, line, polygon};
use crate::scene::{ORIGIN_M, SIDE_CELLS, Scene, Words};

/// What features of a database came to.
#[derive(Clone)]
pub struct Parts {
    profiles: Vec<(Stamp, Profile)>,
    lines: Vec<(Stamp, TileFeatures)>,
    level: (Stamp, AreaLevel),
    /// `features.geojson`.
    remarks: String,
}

impl Parts {
    pub fn open(folder: &Folder, tiles: &[TileId]) -> Self {
        let lines = |&tile: &TileId| {
            let path = folder.lines_path(tile);
            decode_lines(&path, &fs::read(&path).unwrap()).unwrap()
        };
        let profile = |&tile: &TileId| folder.read_profile(tile).map(|(stamp, _, profile)| (stamp, profile)).unwrap();
        let (stamp, _, level) = folder.read_level().unwrap();
        Self {
            profiles: tiles.iter().map(profile).collect(),
            lines: tiles.iter().map(lines).collect(),
            level: (stamp, level),
            remarks: folder.read_text(files::FEATURES).unwrap(),
        }
    }

    /// Writes all of it, with checksums where they are listed.
    pub fn seal(&mut self, folder: &Folder, manifest: &mut Manifest) {
        let write = |path: std::path::PathBuf, bytes: Vec<u8>| {
            fs::write(path, &bytes).unwrap();
            FileStamp::of(&bytes)
        };
        for (index, (stamp, lines)) in self.lines.iter().enumerate() {
            let stamp = write(folder.lines_path(lines.tile), encode_lines(stamp, lines));
            self.level.1.tiles[index] = stamp;
            manifest.tiles[index].lines = Some(stamp);
        }
        for ((stamp, profile), record) in self.profiles.iter().zip(&mut manifest.tiles) {
            record.profile = Some(write(folder.profile_path(profile.tile), encode_profile(stamp, profile)));
        }
        let (stamp, level) = &self.level;
        manifest.files.insert(files::LEVEL.into(), write(folder.path(files::LEVEL), encode_level(stamp, level)));
        fs::write(folder.path(files::FEATURES), &self.remarks).unwrap();
    }
}

impl Forged {
    fn of_features(&mut self) -> &mut Parts {
        self.features.as_mut().unwrap()
    }

    fn level(&mut self) -> &mut AreaLevel {
        &mut self.of_features().level.1
    }

    fn listed(&mut self) -> &mut store::ReportFeatures {
        self.report.features.as_mut().unwrap()
    }

    /// Steps of the features' lattice between posts, and quanta of a step.
    fn steps(&self) -> (i32, i32) {
        let steps = self.features.as_ref().unwrap().lines[0].1.kept.steps_per_post;
        (steps, 25 * QUANTA_PER_METRE / steps)
    }

    /// Lifts a vertex of load modules and TINs.
    fn lift_ground(&mut self, at: LatticePoint, by: i32) {
        let (steps, quanta) = self.steps();
        for (_, tin) in &mut self.tins {
            let scale = tin.tin.steps_per_post;
            for vertex in &mut tin.tin.vertices {
                let same =
                    |one: i32, other: i32| i64::from(one) * i64::from(steps) == i64::from(other) * i64::from(scale);
                if same(vertex.at.row, at.row) && same(vertex.at.col, at.col) {
                    vertex.height += by;
                }
            }
        }
        for module in self.modules.iter_mut().flat_map(|(_, levels)| levels).flatten() {
            let side = SIDE_CELLS * steps;
            let [y, x] =
                [at.row - module.id.row as i32 * side, at.col - module.id.col as i32 * side].map(|v| v * quanta);
            for vertex in module.vertices.iter_mut().filter(|v| (i32::from(v.y), i32::from(v.x)) == (y, x)) {
                vertex.z += by;
            }
        }
    }

    /// Lifts a vertex of what was decided for tiles.
    fn lift_lines(&mut self, at: LatticePoint, by: i32) {
        for (_, features) in &mut self.of_features().lines {
            let rings = features.surfaces.iter_mut().chain(&mut features.decks).flat_map(|surface| &mut surface.ring);
            let slopes = features.slopes.iter_mut().flat_map(|slope| &mut slope.ends);
            for vertex in features.kept.vertices.iter_mut().chain(rings).chain(slopes).filter(|vertex| vertex.at == at)
            {
                vertex.height += by;
            }
        }
    }

    /// Lifts a vertex of what was decided for the area.
    fn lift_level(&mut self, at: LatticePoint, by: i32) {
        let (steps, _) = self.steps();
        for line in &mut self.level().lines {
            for vertex in line.vertices.iter_mut().filter(|vertex| place(vertex, steps) == at) {
                vertex[2] += f64::from(by) / f64::from(QUANTA_PER_METRE);
            }
        }
    }

    /// Lifts a vertex wherever it stands.
    fn lift(&mut self, at: LatticePoint, by: i32) {
        self.lift_ground(at, by);
        self.lift_lines(at, by);
        self.lift_level(at, by);
    }

    /// A vertex in the middle of a line of a role, inside a load module and on no other line, after the one before it.
    fn middle(&mut self, role: Role) -> [Vertex; 2] {
        let (steps, _) = self.steps();
        let lines = self.level().lines.clone();
        let uses = |at: LatticePoint| {
            let all = lines.iter().flat_map(|line| &line.vertices);
            all.filter(|vertex| place(vertex, steps) == at).count()
        };
        let side = SIDE_CELLS * steps;
        let is_inner = |vertex: &[f64; 3]| {
            let at = place(vertex, steps);
            let inside = |v: i32| 0 < v && v < 4 * side && v % side != 0;
            inside(at.row) && inside(at.col) && uses(at) == 1
        };
        let of_role = |line: &&FeatureLine| line.role == role;
        let mut triples = lines.iter().filter(of_role).flat_map(|line| line.vertices.windows(3));
        let pair = triples.find(|triple| is_inner(&triple[1])).unwrap();
        let vertex = |of: &[f64; 3]| Vertex {
            at: place(of, steps),
            height: (of[2] * f64::from(QUANTA_PER_METRE)).round() as i32,
        };
        [vertex(&pair[0]), vertex(&pair[1])]
    }
}

fn place(vertex: &[f64; 3], steps: i32) -> LatticePoint {
    let of = |at: f64, origin: f64| ((at - origin) * f64::from(steps) / 25.0).round() as i32;
    LatticePoint::new(of(vertex[1], ORIGIN_M[1]), of(vertex[0], ORIGIN_M[0]))
}

/// A road over a stream by a bridge, a track, a lake, and a track drawn twice, on 4 x 4 load modules in 2 x 2 tiles.
fn scene() -> Scene {
    let track = line("highway=track", &[(300.0, 1800.0), (700.0, 1500.0), (650.0, 1200.0)]);
    let drawn = [
        line("highway=primary", &[(-300.0, 700.0), (800.0, 810.0), (1010.0, 830.0)]),
        line("highway=primary bridge=yes", &[(1010.0, 830.0), (1090.0, 835.0)]),
        line("highway=primary", &[(1090.0, 835.0), (2300.0, 900.0)]),
        line("waterway=stream", &[(1000.0, 2100.0), (1050.0, 900.0), (900.0, -100.0)]),
        polygon("natural=water", &[(1150.0, 1150.0), (1650.0, 1200.0), (1600.0, 1650.0), (1200.0, 1550.0)]),
        track.clone(),
        track,
    ];
    let features = "sources = [\"features.geojson\"]".into();
    let words = Words { size: (4, 4), tiles: (2, 2), features, ..Words::sample() };
    let scene =
        Scene::with_files(&words, |folder| fs::write(folder.join("features.geojson"), geojson(&drawn)).unwrap());
    let built = scene.build("area", 2);
    built.database.write_json(files::REPORT, &built.report).unwrap();
    scene
}

/// What is altered, how, after what follows from load modules was made right, and what `verify` says of it.
#[track_caller]
fn check(table: &[(&str, Alter, Alter, &str)]) {
    let scene = scene();
    let parts = Forged::open(&scene.path("area"));
    assert_eq!(forged(&scene, &parts, nothing, nothing), [""; 0], "honest");
    for (what, alter, after, expected) in table {
        let problems = forged(&scene, &parts, *alter, *after);
        assert!(problems.iter().any(|problem| problem.contains(expected)), "{what}: {problems:#?}");
        let is_rust = |problem: &String| ["Some(", " { ", "Id("].iter().any(|rust| problem.contains(rust));
        assert!(!problems.iter().any(is_rust), "{what}: {problems:#?}");
    }
}

fn raise_vertex(forged: &mut Forged) {
    let [_, vertex] = forged.middle(Role::Centre);
    forged.lift_ground(vertex.at, 64);
}

/// Lifts a vertex of a channel above the one before it.
fn raise_river(forged: &mut Forged, lift: fn(&mut Forged, LatticePoint, i32)) {
    let [before, vertex] = forged.middle(Role::Channel);
    lift(forged, vertex.at, before.height - vertex.height + 128);
}

/// Turns a channel round, so that all of it rises.
fn turn_river(forged: &mut Forged) {
    let channel = forged.level().lines.iter_mut().find(|line| line.role == Role::Channel).unwrap();
    channel.vertices.reverse();
}

fn tilt_lake(forged: &mut Forged, lift: fn(&mut Forged, LatticePoint, i32)) {
    let [_, vertex] = forged.middle(Role::Shore);
    lift(forged, vertex.at, 128);
}

/// Lifts what lies in a lake and is no vertex of its shore.
fn raise_lake_inside(forged: &mut Forged) {
    let ([shore, _], (steps, quanta)) = (forged.middle(Role::Shore), forged.steps());
    let lake = forged.job_class("lake");
    let kept: BTreeSet<LatticePoint> =
        forged.of_features().lines.iter().flat_map(|(_, lines)| &lines.kept.vertices).map(|vertex| vertex.at).collect();
    let mut inside = BTreeSet::new();
    for module in forged.modules.iter().flat_map(|(_, levels)| &levels[0]) {
        let triangles = module.triangles.iter().zip(&module.classes).filter(|(_, class)| **class == lake);
        for v in triangles.flat_map(|(triangle, _)| *triangle) {
            let vertex = module.vertices[usize::from(v)];
            let [row, col] = [(module.id.row, vertex.y), (module.id.col, vertex.x)]
                .map(|(line, at)| line as i32 * SIDE_CELLS * steps + i32::from(at) / quanta);
            let at = LatticePoint::new(row, col);
            inside.extend((vertex.z == shore.height && !kept.contains(&at)).then_some(at));
        }
    }
    assert!(!inside.is_empty(), "the lake has vertices inside");
    inside.into_iter().for_each(|at| forged.lift_ground(at, 64));
}

impl Forged {
    fn job_class(&self, name: &str) -> u8 {
        let at = self.report.classes.iter().position(|class| class.name == name);
        u8::try_from(at.unwrap()).unwrap()
    }

    fn with_decks(&mut self) -> &mut terrain::LoadModule {
        let modules = self.modules.iter_mut().flat_map(|(_, levels)| &mut levels[0]);
        modules.max_by_key(|module| module.decks.triangles.len()).unwrap()
    }
}

fn remove_decks(forged: &mut Forged) {
    forged.with_decks().decks = terrain::Decks::default();
}

fn remove_decks_everywhere(forged: &mut Forged) {
    for module in forged.modules.iter_mut().flat_map(|(_, levels)| levels).flatten() {
        module.decks = terrain::Decks::default();
    }
    forged.of_features().lines.iter_mut().for_each(|(_, lines)| lines.decks.clear());
}

fn move_deck(forged: &mut Forged) {
    let decks = &mut forged.with_decks().decks;
    let corners = |triangle: &[u16; 3]| {
        triangle.map(|v| {
            let vertex = decks.vertices[usize::from(v)];
            terrain::ModuleVertex { z: vertex.z + 128, ..vertex }
        })
    };
    let lifted: Vec<_> = decks.triangles.iter().map(corners).zip(decks.classes.clone()).collect();
    *decks = terrain::Decks::of_triangles(lifted);
}

fn lose_part_of_deck(forged: &mut Forged) {
    let decks = &mut forged.with_decks().decks;
    let corners = |triangle: &[u16; 3]| triangle.map(|v| decks.vertices[usize::from(v)]);
    let left: Vec<_> = decks.triangles.iter().skip(1).map(corners).zip(decks.classes[1..].to_vec()).collect();
    *decks = terrain::Decks::of_triangles(left);
}

fn change_class(forged: &mut Forged) {
    let lake = forged.job_class("lake");
    let modules = forged.modules.iter_mut().flat_map(|(_, levels)| &mut levels[0]);
    for class in modules.flat_map(|module| &mut module.classes).filter(|class| **class == lake).take(1) {
        *class = 0;
    }
}

fn give_class(forged: &mut Forged) {
    let lake = forged.job_class("lake");
    let class = forged.module().classes.iter_mut().find(|class| **class == 0).unwrap();
    *class = lake;
}

#[test]
fn altered_roads_and_water_in_load_modules_are_told() {
    let table: [(&str, Alter, Alter, &str); 7] = [
        ("a vertex of a road", raise_vertex, nothing, "vertices of roads or water are not as decided"),
        ("a lake inside", raise_lake_inside, nothing, "a lake in it is not level"),
        ("decks removed", remove_decks, nothing, "corners of decks of bridges"),
        ("a deck moved", move_deck, nothing, "a corner of decks is that of no bridge"),
        ("a part of a deck", lose_part_of_deck, nothing, "decks"),
        ("a class", change_class, nothing, "have not the class of the road or water under them"),
        ("a class beside", give_class, nothing, "have not the class of the road or water under them"),
    ];
    check(&table);
}

#[test]
fn altered_decisions_on_roads_and_water_are_told() {
    let table: [(&str, Alter, Alter, &str); 17] = [
        ("a river, in its file", |f| raise_river(f, Forged::lift_lines), nothing, "are not as decided"),
        ("a river, everywhere", |f| raise_river(f, Forged::lift), nothing, "rises downstream from"),
        ("a river turned round", turn_river, nothing, "rises downstream from"),
        ("a river in the list", |f| raise_river(f, Forged::lift_level), nothing, "and no file of a tile says so"),
        ("a lake, in its file", |f| tilt_lake(f, Forged::lift_lines), nothing, "a lake is not level"),
        ("a lake, everywhere", |f| tilt_lake(f, Forged::lift), nothing, "a lake is not level"),
        ("decks everywhere", remove_decks_everywhere, nothing, "its decks are not those"),
        ("a deck in the list", |f| f.level().decks[0].ring[0][2] += 1.0, nothing, "its decks are not those"),
        ("an edge", lose_edge, nothing, "edges that no file of a tile has"),
        ("a line", |f| drop(f.level().lines.pop()), nothing, "edges that files of tiles have"),
        ("a surface", lose_surface, nothing, "have not the class of the road or water under them"),
        ("features that a TIN has", lose_surface, nothing, "its fingerprint is not that of its TIN"),
        ("costs", |f| f.level().cost[0].2 -= 1, nothing, "features cost"),
        ("reservations", |f| f.level().reserved.iter_mut().for_each(|of| of.1 /= 2), nothing, "are reserved"),
        ("strips", |f| f.level().strips[0].pieces = 0, nothing, "pieces of strips"),
        ("a profile", raise_profile, nothing, "was not made from the ground along roads and water"),
        ("a short profile", shorten_profile, nothing, "was not made from the ground along roads and water"),
    ];
    check(&table);
}

fn lose_edge(forged: &mut Forged) {
    forged.of_features().lines[0].1.kept.edges.pop().unwrap();
}

fn lose_surface(forged: &mut Forged) {
    for (_, lines) in &mut forged.of_features().lines {
        lines.surfaces.retain(|surface| surface.ground != SurfaceGround::Lake);
    }
}

fn raise_profile(forged: &mut Forged) {
    let heights = &mut forged.of_features().profiles[0].1.heights;
    let height = heights.iter_mut().flatten().next().unwrap();
    *height += 128;
}

fn shorten_profile(forged: &mut Forged) {
    forged.of_features().profiles[0].1.heights.pop();
}

#[test]
fn altered_reports_of_roads_and_water_are_told() {
    let table: [(&str, Alter, Alter, &str); 11] = [
        ("edges", nothing, |f| f.listed().checks.edges -= 1, "report.json: features.checks.edges is"),
        ("missing", nothing, |f| f.listed().checks.edges_missing += 1, "features.checks.edges_missing is"),
        ("stations", nothing, |f| f.listed().checks.stations += 1, "features.checks.stations is"),
        ("rivers", nothing, |f| f.listed().checks.river_edges -= 1, "features.checks.river_edges is"),
        ("shores", nothing, |f| f.listed().checks.shore_posts_below += 1, "features.checks.shore_posts_below is"),
        ("outside", nothing, |f| f.listed().checks.outside_rms_m *= 0.9, "features.checks.outside_rms_m is"),
        ("cost", nothing, |f| f.listed().all.triangles -= 1, "report.json: features.all.triangles is"),
        ("a class", nothing, |f| f.listed().classes[0].line_km -= 0.1, "features.classes[0].line_km is"),
        ("remarks", nothing, |f| f.listed().remarks.left_out = 0, "features.remarks.left_out is"),
        ("all of it", nothing, |f| f.report.features = None, "tells nothing of roads and water"),
        ("the list", nothing, |f| f.of_features().remarks = "{}".into(), "features.geojson: is not what"),
    ];
    check(&table);
}
