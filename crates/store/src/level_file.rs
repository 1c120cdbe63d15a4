//! `survey/features.level`: what the features of an area came to. Private to this project.

use std::path::Path;

use serde::{Deserialize, Serialize};
use terrain::{Earthwork, OffCause, Role};

use crate::frame::{Kind, malformed};
use crate::{DatabaseError, FileStamp, Stamp, codec, frame};

/// What was decided of all features together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AreaLevel {
    /// The file of each tile, row-major.
    pub tiles: Vec<FileStamp>,
    /// Triangles that features take of a load module and class: the load module's place in the area, row-major; the
    /// class of the job; triangles. In ascending order.
    pub cost: Vec<(u32, u8, u32)>,
    /// Triangles that features take of a load module, counted exactly, by its place. Those that take none are left out.
    pub reserved: Vec<(u32, u32)>,
    /// How much there is of each class, and how much of it is in the ground, by class in ascending order.
    pub amounts: Vec<FeatureAmounts>,
    /// Stretches from junction to junction and bodies of water that are not in the ground.
    pub left_out: Vec<FeatureLeftOut>,
    /// Where what is in the ground ends although its source goes on.
    pub ends: Vec<FeatureEnd>,
    /// Edges of the TIN as lines of their features.
    pub lines: Vec<FeatureLine>,
    /// What was found of strips, by class in ascending order.
    pub strips: Vec<StripFigures>,
    /// The surfaces of bridges.
    pub decks: Vec<FeatureFace>,
    /// What features in the ground move, by class, a number of the job's, in ascending order.
    pub earthworks: Vec<(u8, Earthwork)>,
    /// Cubic metres cut and filled in each load module: its place in the area, row-major; the class; both.
    pub moved: Vec<(u32, u8, [f64; 2])>,
    /// Where features lie more than 3 m off the ground, the worst of each in each load module, the farthest first.
    pub far_off: Vec<FeatureFarOff>,
    /// Metres of bridges that would run through hills, and became tunnels.
    pub through_hills_m: f64,
    /// What was mended, degraded or left out.
    pub remarks: Vec<FeatureRemark>,
    /// What a person should know of files and rules.
    pub notes: Vec<String>,
}

impl AreaLevel {
    /// Triangles that features take of each of `count` load modules, row-major.
    pub fn reserved_of(&self, count: usize) -> Vec<u32> {
        let mut reserved = vec![0; count];
        for &(place, triangles) in &self.reserved {
            if let Some(of) = reserved.get_mut(place as usize) {
                *of = triangles;
            }
        }
        reserved
    }
}

/// How much there is of a class, and how much of it is in the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeatureAmounts {
    /// The class, a number of the job's.
    pub class: u8,
    /// Metres of ways in the area, bridges among them, tunnels not.
    pub wanted_m: f64,
    /// Those of them that are in the ground.
    pub kept_m: f64,
    /// Those of these that are to have their width, and those that have it.
    pub wide_m: [f64; 2],
    /// Whether it is of a kind that may use the larger share of limits.
    pub is_main: bool,
    /// Bodies of water of a hectare and more.
    pub lakes_wanted: u32,
    /// Those of them that are in the ground.
    pub lakes_kept: u32,
}

/// Why something is not in the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FeatureWhy {
    /// A load module has no room for it: its row and column.
    Module(u32, u32),
    /// A window has no room for it: row and column of its south-western load module.
    Window(u32, u32),
    /// The area has no room for it.
    Area,
    /// It would end where its source goes on, soon after a junction or inside one load module.
    Stub,
    /// It would hang together with too little.
    Alone,
    /// It is small water with a long shore.
    Pond,
}

/// What is not in the ground: a stretch of a way from junction to junction, or a body of water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureLeftOut {
    /// The feature it begins with, as its file names it.
    pub feature: String,
    /// Its class, a number of the job's.
    pub class: u8,
    /// Why.
    pub why: FeatureWhy,
    /// Metres of it in the area.
    pub length_m: f64,
    /// Easting, northing and height of its vertices, in metres; several lines of water with islands.
    pub lines: Vec<Vec<[f64; 3]>>,
}

/// A place where a feature lies far off the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureFarOff {
    /// The feature, as its file names it.
    pub feature: String,
    /// Its class, a number of the job's.
    pub class: u8,
    /// Its load module, by its place in the area, row-major.
    pub module: u32,
    /// Easting and northing, in metres.
    pub at_m: [f64; 2],
    /// Metres above the ground; below it less than 0.
    pub off_m: f64,
    /// Why.
    pub cause: OffCause,
}

/// Where what is in the ground ends although its source goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureEnd {
    /// The feature that ends there, as its file names it.
    pub feature: String,
    /// Its class, a number of the job's.
    pub class: u8,
    /// Easting and northing, in metres.
    pub at_m: [f64; 2],
}

/// A run of edges of one feature, all of one role; a channel runs downstream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureLine {
    /// The feature, as its file names it.
    pub feature: String,
    /// Its class, a number of the job's.
    pub class: u8,
    /// What it is to its feature.
    pub role: Role,
    /// Metres wide.
    pub width_m: f64,
    /// The greatest grade of its rule, in parts per million; 0 where it has none.
    pub grade_max_ppm: u32,
    /// The steepest it may be where limits of cut and fill ask for it, in parts per million.
    pub grade_most_ppm: u32,
    /// Cubic metres cut and filled along it; of a strip with several lines each piece counts for one of them.
    pub moved_m3: [f64; 2],
    /// Easting, northing and height of its vertices, in metres.
    pub vertices: Vec<[f64; 3]>,
}

/// What was found of the strips of a class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StripFigures {
    /// The class, a number of the job's.
    pub class: u8,
    /// Pieces from one station to the next.
    pub pieces: u64,
    /// Metres along their middles.
    pub length_m: f64,
    /// Pieces steeper than the greatest grade by more than a quantum of height.
    pub steeper: u64,
    /// The largest difference in height between left and right, in quanta.
    pub fall_max: u32,
}

/// A polygon of a feature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureFace {
    /// The feature, as its file names it.
    pub feature: String,
    /// Its class, a number of the job's.
    pub class: u8,
    /// Easting, northing and height of its corners, in metres; the first is not repeated.
    pub ring: Vec<[f64; 3]>,
}

/// What is done where a road crosses a channel without a bridge.
pub const CULVERT: &str = "a culvert was assumed";

impl FeatureRemark {
    /// Whether a channel passes below a road there.
    pub fn is_culvert(&self) -> bool {
        self.done == CULVERT
    }
}

/// Something that was wrong with a feature, and what was done about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FeatureRemark {
    /// The feature, as its file names it.
    pub feature: String,
    /// Easting and northing in metres, where it has a place.
    pub at_m: Option<[f64; 2]>,
    /// What was wrong.
    pub found: String,
    /// What was done.
    pub done: String,
    /// Whether it, or a part of it, is missing from the ground because of it.
    pub leaves_out: bool,
    /// Whether it is coarser than asked for because of it.
    pub degrades: bool,
}

/// The bytes of what features came to.
pub fn encode_level(stamp: &Stamp, level: &AreaLevel) -> Vec<u8> {
    frame::seal(Kind::Level, stamp, &codec::encode(level))
}

/// What features came to, whose file, at `path`, has these bytes.
///
/// # Errors
/// When the file is not as it was written.
pub(crate) fn decode_level(path: &Path, bytes: &[u8]) -> Result<(Stamp, AreaLevel), DatabaseError> {
    let (stamp, payload) = frame::open(Kind::Level, path, bytes)?;
    Ok((stamp, codec::decode(payload).map_err(|what| malformed(path, what))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn what_features_came_to_survives_its_file_and_every_damage_is_an_error() {
        let path = Path::new("features.level");
        let left_out = FeatureLeftOut {
            feature: "way/3".into(),
            class: 3,
            why: FeatureWhy::Window(2, 1),
            length_m: 120.5,
            lines: vec![vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]],
        };
        let level = AreaLevel {
            tiles: vec![FileStamp::of(b"one"), FileStamp::of(b"other")],
            cost: vec![(0, 3, 12), (7, 2, 1)],
            reserved: vec![(0, 12), (7, 1)],
            amounts: vec![FeatureAmounts {
                class: 3,
                wanted_m: 1250.5,
                kept_m: 0.25,
                wide_m: [0.25, 0.0],
                is_main: true,
                lakes_wanted: 2,
                lakes_kept: 1,
            }],
            left_out: vec![left_out],
            ends: vec![FeatureEnd { feature: "way 7".into(), class: 3, at_m: [0.5, -0.0] }],
            lines: vec![FeatureLine {
                feature: "way/12".into(),
                class: 3,
                role: Role::Centre,
                width_m: 3.5,
                grade_max_ppm: 250_000,
                grade_most_ppm: 375_000,
                moved_m3: [0.5, 12.0],
                vertices: vec![[500_000.5, 4_000_000.0, 12.25]],
            }],
            strips: vec![StripFigures { class: 3, pieces: 2, length_m: 12.5, steeper: 1, fall_max: 9 }],
            earthworks: vec![(3, Earthwork { off_m: [0.5; 4], ..Earthwork::default() })],
            moved: vec![(7, 3, [0.5, 2.5])],
            far_off: vec![FeatureFarOff {
                feature: "way/12".into(),
                class: 3,
                module: 7,
                at_m: [0.5, 2.0],
                off_m: -12.5,
                cause: OffCause::Falling,
            }],
            through_hills_m: 12.5,
            decks: vec![FeatureFace { feature: "way/13".into(), class: 3, ring: vec![[1.0, 2.0, 3.0]] }],
            remarks: vec![FeatureRemark {
                feature: "way/12".into(),
                at_m: Some([1.0, 2.0]),
                found: "a spike".into(),
                done: "left out".into(),
                leaves_out: true,
                degrades: false,
            }],
            notes: vec!["no line or polygon in the file".into()],
        };
        let bytes = encode_level(&samples::stamp(), &level);
        assert_eq!(decode_level(path, &bytes).unwrap(), (samples::stamp(), level));
        samples::check_every_damage(&bytes, |bytes| decode_level(path, bytes).is_err());
    }
}
