//! Makes small TIFF files, tag by tag, so that any of them can be wrong; what is wanted of features, and what is told
//! of them.

use std::path::{Path, PathBuf};

use source_files::{BUILT_IN_KEYS, Extent, FeatureFile, GeoTiff, Raster, SourceError, Wanted};
use tempfile::TempDir;
use terrain::{GridFrame, Spacing};

/// Ten kilometres a side round 117 W, 35 N, in UTM zone 11.
pub const BOUNDS: Extent = Extent { east: [495_000.0, 505_000.0], north: [3_868_000.0, 3_878_000.0] };
/// Lines and polygons there, with the tags that the built-in table asks for.
pub const WANTED: Wanted = Wanted {
    epsg: 32611,
    bounds: BOUNDS,
    layer: None,
    crs: None,
    keys: &BUILT_IN_KEYS,
    buildings: false,
    points: false,
};
pub const ROAD: &[(&str, &str)] = &[("highway", "primary")];
pub const LAKE: &[(&str, &str)] = &[("natural", "water"), ("type", "multipolygon")];

pub fn ids(file: &FeatureFile) -> Vec<&str> {
    file.features.iter().map(|feature| feature.id.as_str()).collect()
}

pub fn remarks(file: &FeatureFile) -> Vec<String> {
    file.remarks.iter().map(|remark| format!("{}: {} ({})", remark.id, remark.found, remark.done)).collect()
}

/// A folder that is gone when the test is.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        std::fs::write(self.path(name), bytes).unwrap();
        self.path(name)
    }
}

/// The values of one tag.
#[derive(Clone)]
pub enum Values {
    Short(Vec<u16>),
    Long(Vec<u32>),
    Double(Vec<f64>),
    Text(&'static str),
}

/// A TIFF of one uncompressed strip.
#[derive(Clone)]
pub struct Tiff {
    pub big_endian: bool,
    pub tags: Vec<(u16, Values)>,
    pub samples: Vec<u8>,
}

pub const UTM: [u16; 20] = [1, 1, 0, 4, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32611, 3076, 0, 1, 9001];

impl Tiff {
    /// 16-bit heights from north to south, at 10 m, with its north-west corner at (500000, 4000000), in UTM zone 11.
    pub fn of_heights(rows: &[&[i16]]) -> Self {
        let samples = rows.concat().iter().flat_map(|height| height.to_le_bytes()).collect();
        Self::new(rows[0].len() as u32, rows.len() as u32, (16, 2), samples)
    }

    pub fn of_floats(rows: &[&[f32]]) -> Self {
        let samples = rows.concat().iter().flat_map(|height| height.to_le_bytes()).collect();
        Self::new(rows[0].len() as u32, rows.len() as u32, (32, 3), samples)
    }

    fn new(cols: u32, rows: u32, (bits, format): (u16, u16), samples: Vec<u8>) -> Self {
        let tags = vec![
            (256, Values::Long(vec![cols])),
            (257, Values::Long(vec![rows])),
            (258, Values::Short(vec![bits])),
            (259, Values::Short(vec![1])),
            (262, Values::Short(vec![1])),
            (273, Values::Long(vec![8])),
            (277, Values::Short(vec![1])),
            (278, Values::Long(vec![rows])),
            (279, Values::Long(vec![samples.len() as u32])),
            (339, Values::Short(vec![format])),
            (33550, Values::Double(vec![10.0, 10.0, 0.0])),
            (33922, Values::Double(vec![0.0, 0.0, 0.0, 500_000.0, 4_000_000.0, 0.0])),
            (34735, Values::Short(UTM.to_vec())),
        ];
        Self { big_endian: false, tags, samples }
    }

    pub fn with(mut self, tag: u16, values: Values) -> Self {
        self.tags.retain(|&(other, _)| other != tag);
        self.tags.push((tag, values));
        self.tags.sort_by_key(|&(tag, _)| tag);
        self
    }

    pub fn without(mut self, tag: u16) -> Self {
        self.tags.retain(|&(other, _)| other != tag);
        self
    }

    /// With these GeoKeys, all held in the directory itself.
    pub fn with_keys(self, keys: &[(u16, u16)]) -> Self {
        let header = [1, 1, 0, keys.len() as u16];
        let entries = keys.iter().flat_map(|&(key, value)| [key, 0, 1, value]);
        self.with(34735, Values::Short(header.into_iter().chain(entries).collect()))
    }

    pub fn bytes(&self) -> Vec<u8> {
        let start = 8 + self.samples.len() as u32;
        let mut bytes = if self.big_endian { b"MM\0\x2a".to_vec() } else { b"II\x2a\0".to_vec() };
        bytes.extend(self.number(start, 4));
        bytes.extend(&self.samples);
        bytes.extend(self.number(self.tags.len() as u32, 2));
        let mut beyond = Vec::new();
        let beyond_at = start + 2 + 12 * self.tags.len() as u32 + 4;
        for (tag, values) in &self.tags {
            let (kind, count, mut value) = self.encode(values);
            bytes.extend([self.number((*tag).into(), 2), self.number(kind, 2), self.number(count, 4)].concat());
            if 4 < value.len() {
                bytes.extend(self.number(beyond_at + beyond.len() as u32, 4));
                beyond.append(&mut value);
            } else {
                value.resize(4, 0);
                bytes.append(&mut value);
            }
        }
        bytes.extend([0; 4]);
        bytes.append(&mut beyond);
        bytes
    }

    fn number(&self, number: u32, size: usize) -> Vec<u8> {
        if self.big_endian { number.to_be_bytes()[4 - size..].to_vec() } else { number.to_le_bytes()[..size].to_vec() }
    }

    fn encode(&self, values: &Values) -> (u32, u32, Vec<u8>) {
        match values {
            Values::Short(shorts) => {
                (3, shorts.len() as u32, shorts.iter().flat_map(|&short| self.number(short.into(), 2)).collect())
            }
            Values::Long(longs) => {
                (4, longs.len() as u32, longs.iter().flat_map(|&long| self.number(long, 4)).collect())
            }
            Values::Double(doubles) => {
                let bytes = |double: &f64| if self.big_endian { double.to_be_bytes() } else { double.to_le_bytes() };
                (12, doubles.len() as u32, doubles.iter().flat_map(bytes).collect())
            }
            Values::Text(text) => (2, text.len() as u32 + 1, [text.as_bytes(), &[0]].concat()),
        }
    }
}

pub fn read(path: &Path) -> Result<Raster, SourceError> {
    let file = GeoTiff::open(path, None)?;
    file.read(file.rect())
}

pub fn read_tiff(tiff: &Tiff) -> Result<Raster, SourceError> {
    let folder = Folder::new();
    read(&folder.write("dem.tif", &tiff.bytes()))
}

/// A working grid whose post (0, 0) lies at the given place.
pub fn grid(east_m: f64, north_m: f64, spacing_m: f64) -> GridFrame {
    let spacing = Spacing::from_metres(spacing_m).unwrap();
    GridFrame { origin_east_m: east_m, origin_north_m: north_m, spacing }
}

/// A file of the shared terrain data, where that is there.
pub fn data(file: &str) -> Option<PathBuf> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data").to_string();
    let path = PathBuf::from(std::env::var("TIEFORT_DATA").unwrap_or(default)).join(file);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}
