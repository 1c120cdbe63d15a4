//! `database.json`: what was asked for, what is there, and how each file must look. Knows no time, host or thread.

use std::collections::BTreeMap;
use std::path::Path;

use crate::engine::Parts;
use serde::{Deserialize, Serialize};
use terrain::{ModuleRect, TileId};

use crate::{DatabaseError, Fingerprint, json};

/// Version of the database's format; rises with any change that an older reader would misread.
///
/// 2: what was measured of a tile lies in a file of its own, and every tile says by parts what it was made from.
pub const FORMAT_VERSION: u32 = 2;

/// The content of `database.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT_VERSION`] of the writer.
    pub format_version: u32,
    /// Whether a build is under way (or was broken off).
    pub state: ManifestState,
    /// Rises whenever an algorithm's results may change.
    pub algorithm_revision: u32,
    /// The gaming area.
    pub area: Area,
    /// The resolved job as TOML: paths as written, defaults filled in.
    pub job: String,
    /// What the heights and the mask were made from, in order of priority.
    pub sources: Vec<SourceRecord>,
    /// Every tile, row by row from the south-west.
    pub tiles: Vec<TileRecord>,
    /// Every other file that a build makes alike each time, by its path inside the directory.
    pub files: BTreeMap<String, FileStamp>,
    /// Sums over the area; all zero while incomplete.
    pub totals: Totals,
}

/// Whether the files are those of one finished build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ManifestState {
    /// A build began to change files and has not ended: readers warn or refuse.
    Incomplete,
    /// All files belong together.
    Complete,
}

/// The gaming area. For two builds to share a directory all must agree but its tiles and what heights are above, which
/// may change: then nothing of the earlier one is kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Its name.
    pub name: String,
    /// Projected coordinate reference system, in metres.
    pub crs: String,
    /// What heights are above; empty when unknown.
    pub vertical_datum: String,
    /// East and north of the south-west post, in metres.
    pub origin_m: [f64; 2],
    /// Extent east and north, in metres.
    pub size_m: [f64; 2],
    /// Spacing of the working grid, in metres.
    pub spacing_m: f64,
    /// Side of a load module, in metres.
    pub module_side_m: f64,
    /// Rows of load modules.
    pub module_rows: u32,
    /// Columns of load modules.
    pub module_cols: u32,
    /// Rows of tiles.
    pub tile_rows: u32,
    /// Columns of tiles.
    pub tile_cols: u32,
}

impl Area {
    /// The load modules of a tile; `None` where there is no such tile.
    pub fn modules_of(&self, tile: TileId) -> Option<ModuleRect> {
        let is_there = tile.row < self.tile_rows && tile.col < self.tile_cols;
        let (modules, tiles) = ([self.module_rows, self.module_cols], [self.tile_rows, self.tile_cols]);
        is_there.then(|| ModuleRect::of_tile(tile, modules, tiles))
    }

    /// The first key in which `self` is other ground than `other`, with both values.
    pub fn difference(&self, other: &Area) -> Option<(&'static str, String, String)> {
        let pairs = [
            ("name", self.name.clone(), other.name.clone()),
            ("crs", self.crs.clone(), other.crs.clone()),
            ("origin_m", format!("{:?}", self.origin_m), format!("{:?}", other.origin_m)),
            ("size_m", format!("{:?}", self.size_m), format!("{:?}", other.size_m)),
            ("spacing_m", self.spacing_m.to_string(), other.spacing_m.to_string()),
            ("module_side_m", self.module_side_m.to_string(), other.module_side_m.to_string()),
            ("module_rows", self.module_rows.to_string(), other.module_rows.to_string()),
            ("module_cols", self.module_cols.to_string(), other.module_cols.to_string()),
        ];
        pairs.into_iter().find(|(_, mine, others)| mine != others)
    }
}

/// One file, or the built-in terrain, from which heights or weights came.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceRecord {
    /// As written in the job.
    pub path: String,
    /// Hash of its content.
    pub blake3: Fingerprint,
    /// Whom to thank, where the source says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attribution: Option<String>,
}

/// One tile and its files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TileRecord {
    /// Row of the tile.
    pub row: u32,
    /// Column of the tile.
    pub col: u32,
    /// How it stands.
    pub state: TileState,
    /// Of all that the tile was made from; absent while missing.
    pub fingerprint: Option<Fingerprint>,
    /// The same by parts, so that a later build can say what changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made_from: Option<Parts>,
    /// Its file in `tiles/`.
    pub tin: Option<FileStamp>,
    /// Its list of removals in `tiles/`, in clip mode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub removed: Option<FileStamp>,
    /// Its file in `modules/`.
    pub slm: Option<FileStamp>,
    /// Its file in `measured/`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<FileStamp>,
    /// Its file in `survey/`; absent where nothing is surveyed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<FileStamp>,
    /// What the ground is along features, in `survey/`; absent without features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<FileStamp>,
    /// What features put into it, in `survey/`; absent without features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<FileStamp>,
}

impl TileRecord {
    /// A tile that has no file yet.
    pub fn missing(tile: TileId) -> Self {
        let (state, TileId { row, col }) = (TileState::Missing, tile);
        Self {
            row,
            col,
            state,
            fingerprint: None,
            made_from: None,
            tin: None,
            removed: None,
            slm: None,
            measured: None,
            curve: None,
            profile: None,
            lines: None,
        }
    }

    /// Which tile.
    pub fn tile(&self) -> TileId {
        TileId { row: self.row, col: self.col }
    }
}

/// How a tile stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TileState {
    /// Built as a full build would.
    Done,
    /// Built alone, its sides held as the neighbours have them: a later build makes it whole.
    Frozen,
    /// Its task failed.
    Failed,
    /// Built, with a limit that could not be met.
    OverLimit,
    /// Not built.
    Missing,
}

/// How a file must look.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileStamp {
    /// Its bytes.
    pub length: u64,
    /// Hash of its bytes.
    pub blake3: Fingerprint,
}

impl FileStamp {
    /// The stamp of a file with this content.
    pub fn of(bytes: &[u8]) -> Self {
        Self { length: bytes.len() as u64, blake3: Fingerprint::of_bytes(bytes) }
    }
}

/// Sums over the area. Residuals are in quanta of 1/128 m, whole numbers, so that sums do not depend on their order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Totals {
    /// Points of the area, each counted once.
    pub points: u64,
    /// Triangles of all load modules.
    pub triangles: u64,
    /// Polygons of all load modules.
    pub polygons: u64,
    /// Load modules above the limit.
    pub modules_over: u64,
    /// Limits that could not be met.
    pub breaches: u64,
    /// Posts that limits kept out.
    pub refused: u64,
    /// Posts with a residual.
    pub residual_posts: u64,
    /// Largest absolute residual.
    pub residual_largest: u64,
    /// Sum of absolute residuals.
    pub residual_sum_abs: u64,
    /// Sum of squared residuals.
    pub residual_sum_squared: u64,
}

impl Manifest {
    /// Of a build of `area` that has nothing yet: incomplete, every tile missing.
    pub fn new(area: Area, job: String, algorithm_revision: u32) -> Self {
        let tiles = (0..area.tile_rows).flat_map(|row| (0..area.tile_cols).map(move |col| TileId { row, col }));
        Self {
            format_version: FORMAT_VERSION,
            state: ManifestState::Incomplete,
            algorithm_revision,
            tiles: tiles.map(TileRecord::missing).collect(),
            area,
            job,
            sources: Vec::new(),
            files: BTreeMap::new(),
            totals: Totals::default(),
        }
    }

    /// The record of `tile`, if the area has it.
    pub fn tile(&self, tile: TileId) -> Option<&TileRecord> {
        self.tiles.get(self.place(tile)?)
    }

    /// The record of `tile`, to be changed, if the area has it.
    pub fn tile_mut(&mut self, tile: TileId) -> Option<&mut TileRecord> {
        let place = self.place(tile)?;
        self.tiles.get_mut(place)
    }

    /// Where the record of a tile is: they lie row by row.
    fn place(&self, tile: TileId) -> Option<usize> {
        let inside = tile.row < self.area.tile_rows && tile.col < self.area.tile_cols;
        let place = tile.row as usize * self.area.tile_cols as usize + tile.col as usize;
        (inside && self.tiles.get(place)?.tile() == tile).then_some(place)
    }

    /// The text of the file at `path`.
    pub(crate) fn encode(&self, path: &Path) -> Result<String, DatabaseError> {
        json::encode(path, self)
    }

    /// The manifest in the file at `path` that has these bytes.
    pub(crate) fn decode(path: &Path, bytes: &[u8]) -> Result<Self, DatabaseError> {
        #[derive(Deserialize)]
        struct Version {
            format_version: u32,
        }
        let found = json::decode::<Version>(path, bytes)?.format_version;
        if found != FORMAT_VERSION {
            return Err(DatabaseError::OtherVersion { path: path.to_path_buf(), found, expected: FORMAT_VERSION });
        }
        json::decode(path, bytes)
    }

    /// Whether this is a database of `area`.
    ///
    /// # Errors
    /// Naming the first key in which the areas differ.
    pub(crate) fn check_area(&self, path: &Path, area: &Area) -> Result<(), DatabaseError> {
        match self.area.difference(area) {
            None => Ok(()),
            Some((key, found, expected)) => {
                Err(DatabaseError::OtherArea { path: path.to_path_buf(), key, found, expected })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn manifest() -> Manifest {
        let mut manifest = Manifest::new(samples::area(), "[area]\nname = \"sample\"\n".into(), 7);
        manifest.tiles[1].state = TileState::OverLimit;
        manifest.tiles[1].fingerprint = Some(Fingerprint([3; 32]));
        manifest.tiles[1].slm = Some(FileStamp::of(b"slm"));
        manifest.sources =
            vec![SourceRecord { path: "a.tif".into(), blake3: Fingerprint([1; 32]), attribution: Some("© x".into()) }];
        manifest.files.insert("survey/allocation.json".into(), FileStamp::of(b""));
        manifest.totals.residual_sum_squared = u64::MAX;
        manifest
    }

    #[test]
    fn a_manifest_survives_its_file_to_the_byte() {
        let path = Path::new("database.json");
        let text = manifest().encode(path).unwrap();
        let read = Manifest::decode(path, text.as_bytes()).unwrap();
        assert_eq!(read, manifest());
        assert_eq!(read.encode(path).unwrap(), text);
    }

    #[test]
    fn every_damage_is_an_error() {
        let path = Path::new("database.json");
        let mut small = manifest();
        small.tiles.truncate(1);
        let text = small.encode(path).unwrap();
        samples::check_every_damage(text.as_bytes(), |bytes| Manifest::decode(path, bytes).is_err());
    }

    #[test]
    fn another_version_is_told_from_damage() {
        let path = Path::new("database.json");
        let text = json::encode(path, &BTreeMap::from([("format_version", 3)])).unwrap();
        let error = Manifest::decode(path, text.as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "database.json: found format version 3, expected 2");
    }

    #[test]
    fn another_area_is_named_by_its_key() {
        let mut other = samples::area();
        other.spacing_m = 31.25;
        let error = manifest().check_area(Path::new("database.json"), &other).unwrap_err();
        assert_eq!(error.to_string(), "database.json: found area.spacing_m 25, expected 31.25");
        assert!(manifest().check_area(Path::new("database.json"), &samples::area()).is_ok());
    }
}
