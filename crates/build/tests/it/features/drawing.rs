//! A ground that is a function, features drawn on it in metres from its south-west corner, and what came of them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::sync::atomic::AtomicBool;

use build::ground::{GamingArea, Ground, Window};
use features::Kind;
use load_module_reader::{Area, Block, Keep, LoadedGround, Module, SlmFile};
use schedule::Workers;
use store::{AreaLevel, Folder};
use terrain::Role;
use terrain::{Dem, LatticePoint, TileFeatures, TileId, Tin, quanta_of_metres};

use crate::scene::{EPSG, ORIGIN_M, SIDE_CELLS, Scene, Words};

/// Metres east and north of the area's south-west corner.
pub type At = (f64, f64);

/// One feature: tags, and a line or (closed by itself) a polygon.
#[derive(Clone)]
pub struct Drawn {
    tags: String,
    places: Vec<At>,
    is_polygon: bool,
}

pub fn line(tags: &str, places: &[At]) -> Drawn {
    Drawn { tags: tags.into(), places: places.to_vec(), is_polygon: false }
}

pub fn polygon(tags: &str, places: &[At]) -> Drawn {
    Drawn { tags: tags.into(), places: places.to_vec(), is_polygon: true }
}

/// Features as a GeoJSON file holds them.
pub fn geojson(drawn: &[Drawn]) -> String {
    let feature = |of: &Drawn| {
        let tags = of.tags.split(' ').filter_map(|tag| tag.split_once('='));
        let tags: Vec<String> = tags.map(|(key, value)| format!("\"{key}\": \"{value}\"")).collect();
        let place = |(east, north): &At| format!("[{}, {}]", ORIGIN_M[0] + east, ORIGIN_M[1] + north);
        let mut places: Vec<String> = of.places.iter().map(place).collect();
        let (kind, places) = if of.is_polygon {
            places.push(places[0].clone());
            ("Polygon", format!("[[{}]]", places.join(", ")))
        } else {
            ("LineString", format!("[{}]", places.join(", ")))
        };
        format!(
            "{{\"type\": \"Feature\", \"properties\": {{{}}}, \"geometry\": {{\"type\": \"{kind}\", \"coordinates\": \
             {places}}}}}",
            tags.join(", ")
        )
    };
    let features: Vec<String> = drawn.iter().map(feature).collect();
    format!(
        "{{\"type\": \"FeatureCollection\", \"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \
         \"urn:ogc:def:crs:EPSG::{EPSG}\"}}}}, \"features\": [{}]}}",
        features.join(",\n")
    )
}

/// An area of 4 x 4 load modules in 2 x 2 tiles on a ground that is a function of metres.
pub struct Drawing {
    pub scene: Scene,
}

impl Drawing {
    #[track_caller]
    pub fn new(ground: impl Fn(f64, f64) -> f64, drawn: &[Drawn]) -> Self {
        Self::of(Self::words(), ground, drawn)
    }

    pub fn words() -> Words {
        let features = "sources = [\"features.geojson\"]".into();
        Words { size: (4, 4), tiles: (2, 2), features, ..Words::raster() }
    }

    #[track_caller]
    pub fn of(words: Words, ground: impl Fn(f64, f64) -> f64, drawn: &[Drawn]) -> Self {
        let rect = words.grid().area();
        let dem =
            Dem::from_fn(rect, |post| quanta_of_metres(ground(f64::from(post.col) * 25.0, f64::from(post.row) * 25.0)));
        let scene = Scene::with_files(&words, |folder| {
            crate::scene::write_dem(&folder.join("dem.tif"), &dem);
            fs::write(folder.join("features.geojson"), geojson(drawn)).unwrap();
        });
        Self { scene }
    }

    /// Builds, verifies, and checks what must hold of any features.
    #[track_caller]
    pub fn built(&self) -> Laid {
        let report = self.scene.build("area.tdb", 2).report;
        assert!(report.breaches.is_empty(), "{:?}", report.breaches);
        self.scene.verify_on_dem("area.tdb");
        check_ground(&self.scene);
        let laid = Laid::open(&self.scene);
        laid.check();
        laid
    }
}

/// What features came to in a finished database.
pub struct Laid {
    pub level: AreaLevel,
    pub tiles: Vec<(TileFeatures, Tin)>,
    pub ground: LoadedGround,
    /// Load modules at their finest level, as the reader for simulators has them.
    modules: Vec<Module>,
    classes: Vec<String>,
}

impl Laid {
    pub fn open(scene: &Scene) -> Self {
        let folder = Folder::new(scene.path("area.tdb"));
        let area = GamingArea::new(&scene.job).unwrap();
        let of = |&tile: &TileId| (folder.read_lines(tile).unwrap().1, folder.read_tile(tile).unwrap().1.tin);
        let read = Area::open(folder.dir(), Keep::InMemory).unwrap();
        let grid = area.grid;
        let ground = read.load(Block { south: 0, west: 0, north: grid.rows, east: grid.cols }).unwrap();
        let (_, _, level) = folder.read_level().unwrap();
        let file = |&tile: &TileId| SlmFile::open(folder.modules_path(tile)).unwrap().modules().to_vec();
        let modules = area.tiles.iter().flat_map(file).collect();
        Self { modules, level, tiles: area.tiles.iter().map(of).collect(), ground, classes: scene.job.class_names() }
    }

    /// The height of the load modules at a place, in metres.
    #[track_caller]
    pub fn height(&self, (east, north): At) -> f64 {
        self.ground.height_m([ORIGIN_M[0] + east, ORIGIN_M[1] + north]).unwrap()
    }

    /// The class of the load modules at a place.
    #[track_caller]
    pub fn class(&self, (east, north): At) -> &str {
        let sample = self.ground.sample([ORIGIN_M[0] + east, ORIGIN_M[1] + north]).unwrap();
        &self.classes[usize::from(sample.class)]
    }

    /// Heights in quanta of all vertices of triangles of a kind's class.
    pub fn heights_of(&self, kind: Kind) -> BTreeSet<i32> {
        let class = self.classes.iter().position(|name| name == kind.name()).unwrap() as u8;
        let mut heights = BTreeSet::new();
        for module in &self.modules {
            for (triangle, of) in module.triangles.iter().zip(&module.classes) {
                if *of == class {
                    heights.extend(triangle.map(|v| module.vertices[usize::from(v)].z));
                }
            }
        }
        heights
    }

    /// The topmost of ground and decks not above a ceiling, in metres.
    #[track_caller]
    pub fn height_below(&self, (east, north): At, ceiling: f64) -> f64 {
        self.ground.height_below_m([ORIGIN_M[0] + east, ORIGIN_M[1] + north], ceiling).unwrap()
    }

    /// Lines of a role, of the classes of a kind.
    pub fn lines(&self, kind: Kind, role: Role) -> Vec<&Vec<[f64; 3]>> {
        let of = |line: &&store::FeatureLine| line.role == role && self.classes[usize::from(line.class)] == kind.name();
        self.level.lines.iter().filter(of).map(|line| &line.vertices).collect()
    }

    /// Whether something was said that contains `words`.
    pub fn was_told(&self, words: &str) -> bool {
        self.level.remarks.iter().any(|remark| format!("{}; {}", remark.found, remark.done).contains(words))
    }

    /// What must hold of any features: all edges are there, no grade is exceeded, no river rises, lakes are level.
    #[track_caller]
    pub fn check(&self) {
        for (features, tin) in &self.tiles {
            assert_eq!(missing(features, tin), 0, "edges of features that tile {} has not", features.tile);
        }
        // What is travelled keeps its height where it crosses a shore.
        let travelled = self.level.lines.iter().filter(|line| matches!(line.role, Role::Centre | Role::Side));
        let travelled: BTreeSet<[u64; 2]> =
            travelled.flat_map(|line| &line.vertices).map(|at| [at[0].to_bits(), at[1].to_bits()]).collect();
        for line in &self.level.lines {
            let name = &self.classes[usize::from(line.class)];
            for ends in line.vertices.windows(2) {
                let [run, rise] =
                    [(ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]), (ends[1][2] - ends[0][2]).abs()];
                let greatest = f64::from(line.grade_most_ppm) / 1e6;
                if line.role == Role::Centre && 0.0 < greatest && !self.was_told("grade") {
                    assert!(rise <= greatest * run + 1.0 / 64.0, "{name}: {rise} m on {run} m, {ends:?}");
                }
                let is_crossed = ends.iter().any(|at| travelled.contains(&[at[0].to_bits(), at[1].to_bits()]));
                if line.role == Role::Shore && !is_crossed {
                    assert_eq!(rise, 0.0, "a lake is level: {ends:?}");
                }
            }
        }
    }
}

/// A post has one ground, whichever window asks: that of a tile, that around a tile, or that of the area.
#[track_caller]
pub fn check_ground(scene: &Scene) {
    let area = GamingArea::new(&scene.job).unwrap();
    let folder = Folder::new(scene.path("area.tdb"));
    let ground = Ground::open_built(&scene.job, &area, (&Workers::new(1), &AtomicBool::new(false)), &folder).unwrap();
    let whole = ground.window(area.rect).unwrap();
    for &tile in &area.tiles {
        let (own, around) = (ground.tile(&area, tile).unwrap(), ground.around(&area, tile, 5).unwrap());
        for window in [&*own, &around] {
            for post in window.dem.rect().posts() {
                // Voids are filled from whatever window they are read with.
                let height = |of: &Window| (!of.dem.is_void(post)).then(|| of.dem.height(post));
                let of = |of: &Window| (height(of), of.importance.weight(post), of.importance.class(post));
                assert_eq!(of(window), of(&whole), "{post}, by tile {tile} and by the area");
            }
        }
    }
}

/// Edges of features that are no edges of the TIN, nor made of several.
fn missing(features: &TileFeatures, tin: &Tin) -> usize {
    let scale = tin.steps_per_post / features.kept.steps_per_post;
    let at = |v: u32| {
        let place = features.kept.vertices[v as usize].at;
        LatticePoint::new(place.row * scale, place.col * scale)
    };
    let mut beside: BTreeMap<LatticePoint, BTreeSet<LatticePoint>> = BTreeMap::new();
    for triangle in &tin.triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [a, b].map(|corner: usize| tin.vertices[triangle[corner] as usize].at);
            beside.entry(a).or_default().insert(b);
            beside.entry(b).or_default().insert(a);
        }
    }
    let is_there = |[a, b]: &[u32; 2]| {
        let (mut from, to) = (at(*a), at(*b));
        while from != to {
            let ahead = |other: &&LatticePoint| {
                let [across, along] = [
                    [other.col - from.col, other.row - from.row].map(i64::from),
                    [to.col - from.col, to.row - from.row].map(i64::from),
                ];
                let cross = across[0] * along[1] - across[1] * along[0];
                let dot = across[0] * along[0] + across[1] * along[1];
                cross == 0 && 0 < dot && dot <= along[0] * along[0] + along[1] * along[1]
            };
            match beside.get(&from).and_then(|others| others.iter().find(ahead)) {
                Some(&next) => from = next,
                None => return false,
            }
        }
        true
    };
    features.kept.edges.iter().filter(|edge| !is_there(edge)).count()
}

/// Metres of the area's side.
pub const SIDE_M: f64 = 4.0 * SIDE_CELLS as f64 * 25.0;
