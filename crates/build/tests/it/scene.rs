//! A folder with a job and a DEM in it, builds in it, and the bytes they leave.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use build::{Built, CompileError, Event, Options, Progress, Rebuilt};
use job::Job;
use store::engine::Clock;
use tempfile::TempDir;
use terrain::{Dem, GridFrame, ModuleGrid, Spacing, TileId};

pub const EPSG: u16 = 32_611;
pub const ORIGIN_M: [f64; 2] = [505_000.0, 3_875_000.0];
/// Cells along a side of a load module: 500 m at 25 m.
pub const SIDE_CELLS: i32 = 20;

/// A job in words; sections that are left empty have their defaults.
#[derive(Clone, Debug)]
pub struct Words {
    /// Load modules, south to north and west to east.
    pub size: (u32, u32),
    /// Rows and columns of tiles.
    pub tiles: (u32, u32),
    pub dem: String,
    pub importance: String,
    pub order: String,
    pub modules: String,
    pub limits: String,
    pub tin: String,
    /// The whole section; none where it is empty.
    pub features: String,
    /// A section with its head, or nothing.
    pub objects: String,
}

impl Words {
    /// 9 x 10 load modules of the sample terrain in 3 x 3 tiles, everything else as it is by default.
    pub fn sample() -> Self {
        let empty = String::new;
        Self {
            size: (9, 10),
            tiles: (3, 3),
            dem: "source = \"sample\"\nseed = 1".into(),
            importance: empty(),
            order: empty(),
            modules: empty(),
            limits: empty(),
            tin: empty(),
            features: empty(),
            objects: empty(),
        }
    }

    /// The same from `dem.tif` beside the job.
    pub fn raster() -> Self {
        Self { dem: "sources = [\"dem.tif\"]".into(), ..Self::sample() }
    }

    pub fn grid(&self) -> ModuleGrid {
        ModuleGrid { rows: self.size.0, cols: self.size.1, side_cells: SIDE_CELLS }
    }

    pub fn text(&self) -> String {
        let Self { size: (rows, cols), tiles, dem, importance, order, modules, limits, tin, features, objects } = self;
        let [east, north] = ORIGIN_M;
        format!(
            "[area]\nname = \"small\"\ncrs = \"EPSG:{EPSG}\"\norigin_m = [{east}, {north}]\nsize_m = [{}, {}]\n\
             spacing_m = 25\n[dem]\n{dem}\n[importance]\n{importance}\n[tiles]\nrows = {}\ncolumns = {}\n{order}\n\
             [load_modules]\n{modules}\n[limits]\n{limits}\n[tin]\n{tin}\n{}{objects}\n",
            cols * 500,
            rows * 500,
            tiles.0,
            tiles.1,
            if features.is_empty() { String::new() } else { format!("[features]\n{features}\n") },
        )
    }
}

/// What a file tree holds, by path from its root.
pub type Tree = BTreeMap<PathBuf, Vec<u8>>;

/// A temporary folder with a job in it.
pub struct Scene {
    folder: TempDir,
    pub job: Job,
}

impl Scene {
    #[track_caller]
    pub fn new(words: &Words) -> Self {
        Self::with_files(words, |_| ())
    }

    /// A scene with `dem` as `dem.tif`.
    #[track_caller]
    pub fn on(words: &Words, dem: &Dem) -> Self {
        Self::with_files(words, |folder| write_dem(&folder.join("dem.tif"), dem))
    }

    /// A scene in whose folder `write` leaves the files the job names.
    #[track_caller]
    pub fn with_files(words: &Words, write: impl FnOnce(&Path)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path());
        let text = words.text();
        let job = Job::from_text(&text, &folder.path().join("job.toml"));
        let job = job.unwrap_or_else(|error| panic!("{error}\n{text}"));
        Self { folder, job }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts another DEM in the place of the first.
    pub fn replace_dem(&self, dem: &Dem) {
        write_dem(&self.path("dem.tif"), dem);
    }

    pub fn try_build(&self, folder: &str, workers: usize) -> Result<Built, CompileError> {
        self.build_watched(folder, workers, &AtomicBool::new(false), &mut Silent)
    }

    pub fn build_watched(
        &self,
        folder: &str,
        workers: usize,
        stop: &AtomicBool,
        progress: &mut dyn Progress,
    ) -> Result<Built, CompileError> {
        build::build(&self.job, &self.path(folder), &options(workers, stop), progress)
    }

    /// Builds, and gives what was found; the database is unlocked.
    #[track_caller]
    pub fn build(&self, folder: &str, workers: usize) -> Built {
        self.try_build(folder, workers).unwrap_or_else(|error| panic!("{error}"))
    }

    pub fn try_tile(&self, folder: &str, tile: TileId, release_borders: bool) -> Result<Rebuilt, CompileError> {
        let stop = AtomicBool::new(false);
        build::rebuild_tile(&self.job, &self.path(folder), tile, release_borders, &options(2, &stop), &mut Silent)
    }

    /// Runs one tile again, and gives which tiles were refined and whether it is frozen.
    #[track_caller]
    pub fn tile(&self, folder: &str, tile: TileId, release_borders: bool) -> (Vec<TileId>, bool) {
        let done = self.try_tile(folder, tile, release_borders).unwrap_or_else(|error| panic!("{tile}: {error}"));
        (done.rebuilt, done.frozen)
    }

    /// The files that must not depend on who made them: all but reports and the lock.
    pub fn product(&self, folder: &str) -> Tree {
        tree(&self.path(folder))
            .into_iter()
            .filter(|(path, _)| {
                let name = path.to_string_lossy();
                !name.starts_with("report.") && name != "breaches.geojson" && name != "lock"
            })
            .collect()
    }

    /// Takes the report away, so that the next build walks through every stage, whatever has changed.
    #[track_caller]
    pub fn forget_report(&self, folder: &str) {
        fs::remove_file(self.path(folder).join(store::files::REPORT)).unwrap();
    }

    #[track_caller]
    pub fn verify(&self, folder: &str) {
        self.verify_against(folder, None);
    }

    /// The same with the raster that it was built from, in a scene that has one.
    #[track_caller]
    pub fn verify_on_dem(&self, folder: &str) {
        self.verify_against(folder, Some(&self.path("dem.tif")));
    }

    #[track_caller]
    fn verify_against(&self, folder: &str, dem: Option<&Path>) {
        let verdict = inspect::verify(&self.path(folder), dem).unwrap();
        assert!(verdict.problems.is_empty(), "{}", verdict.problems.join("\n"));
    }
}

/// Every file below a folder.
pub fn tree(root: &Path) -> Tree {
    let mut found = Tree::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false => {
                    let bytes = fs::read(&path).unwrap();
                    found.insert(path.strip_prefix(root).unwrap().to_owned(), bytes);
                }
            }
        }
    }
    found
}

/// The files that are not the same in both, by name.
pub fn differing(one: &Tree, other: &Tree) -> Vec<String> {
    let names: std::collections::BTreeSet<&PathBuf> = one.keys().chain(other.keys()).collect();
    names.into_iter().filter(|name| one.get(*name) != other.get(*name)).map(|name| name.display().to_string()).collect()
}

#[track_caller]
pub fn assert_same(one: &Tree, other: &Tree, what: &str) {
    let differing = differing(one, other);
    assert!(differing.is_empty(), "{what}: {} files differ: {differing:?}", differing.len());
    assert!(one.len() > 4, "{what}: there is nothing to compare");
}

pub fn spacing() -> Spacing {
    Spacing::from_metres(25.0).unwrap()
}

pub fn frame() -> GridFrame {
    GridFrame { origin_east_m: ORIGIN_M[0], origin_north_m: ORIGIN_M[1], spacing: spacing() }
}

pub fn write_dem(path: &Path, dem: &Dem) {
    let mut file = std::fs::File::create(path).unwrap();
    source_files::write_heights(&mut file, &frame(), dem.rect(), EPSG, |band| dem.window(band)).unwrap();
}

/// The sample terrain of a grid.
pub fn sample_dem(grid: ModuleGrid, seed: u64) -> Dem {
    sample_terrain::heights(seed, grid.area(), spacing())
}

/// A run without a page and without times: drawing takes longer than most of these builds.
pub fn options(workers: usize, stop: &AtomicBool) -> Options<'_> {
    Options { page: false, ..Options::new(workers, stop, &Still) }
}

/// A clock that stands still.
pub struct Still;

impl Clock for Still {
    fn wall(&self) -> Duration {
        Duration::ZERO
    }

    fn wait(&self, time: Duration) {
        std::thread::sleep(time);
    }
}

/// A clock that a test sets.
pub struct SetBy<F>(pub F);

impl<F: Fn() -> Duration + Sync> Clock for SetBy<F> {
    fn wall(&self) -> Duration {
        self.0()
    }

    fn wait(&self, time: Duration) {
        std::thread::sleep(time);
    }
}

/// Listens to nothing.
pub struct Silent;

impl Progress for Silent {
    fn tell(&mut self, _event: Event) {}
}

pub fn tile(row: u32, col: u32) -> TileId {
    TileId { row, col }
}

/// A small linear congruential generator: what is drawn is the same in every run.
pub struct Draw(pub u64);

impl Draw {
    /// A number below `count`.
    pub fn below(&mut self, count: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(count)) as u32
    }

    /// A number from `low` to `high`, both included.
    pub fn within(&mut self, low: u32, high: u32) -> u32 {
        low + self.below(high - low + 1)
    }

    pub fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u32) as usize]
    }
}
