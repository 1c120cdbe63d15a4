//! A finished area, as pictures of it need it: plain values that the caller has read.

use store::{FeatureLine, FeatureRemark};
use terrain::{Dem, GridFrame, LoadModule, ModuleGrid, ModuleId, ModuleRect, TileId};

use super::color::feature_number;
use super::map_extent::{MapExtent, Posts};
use super::sheet::Coordinates;
use crate::table::grouped;

/// A finished area, or a part of it.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// Name of the area.
    pub name: &'a str,
    /// Name of its coordinate system.
    pub crs: &'a str,
    /// All load modules of the area.
    pub grid: ModuleGrid,
    /// Where posts lie.
    pub frame: GridFrame,
    /// The part that is looked at.
    pub part: ModuleRect,
    /// The load modules of that part, row by row from the south-west.
    pub modules: &'a [LoadModule],
    /// The ground they stand for, where it is there to look at.
    pub ground: Option<SceneGround<'a>>,
    /// What limits count, and how much of them is used.
    pub limits: &'a SceneLimits,
    /// The class of water, where there is one.
    pub water: Option<u8>,
    /// Roads and water, where there are any.
    pub features: Option<SceneFeatures<'a>>,
    /// All tiles of the area, row by row from the south-west.
    pub tiles: &'a [SceneTile],
}

/// Roads and water of an area, as its database tells them.
#[derive(Clone, Copy, Debug)]
pub struct SceneFeatures<'a> {
    /// Name of every class of the job; features have some of them.
    pub names: &'a [String],
    /// Classes that features have.
    pub classes: &'a [u8],
    /// Their lines, in metres of the area's coordinate system.
    pub lines: &'a [FeatureLine],
    /// What was mended, degraded or left out.
    pub remarks: &'a [FeatureRemark],
}

impl SceneFeatures<'_> {
    /// The place of a class among the colours, where features have it.
    pub(crate) fn color_of(&self, class: u8) -> Option<u8> {
        let name = self.names.get(usize::from(class)).filter(|_| self.classes.contains(&class))?;
        Some(feature_number(name))
    }

    pub(crate) fn has_lines_of(&self, number: u8) -> bool {
        self.lines.iter().any(|line| self.color_of(line.class) == Some(number))
    }
}

/// The ground under a part of an area.
#[derive(Clone, Copy, Debug)]
pub struct SceneGround<'a> {
    /// Heights at the posts of the part.
    pub dem: &'a Dem,
    /// Residual at each post, DEM less triangles, in quanta, row by row from the south-west; [`NO_RESIDUAL`] at voids.
    pub residuals: &'a [i32],
}

/// Stands for the residual of a void.
pub const NO_RESIDUAL: i32 = i32::MIN;

/// Limits of an area and how much of them is used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneLimits {
    /// What is counted: `triangles` or `polygons`.
    pub count: String,
    /// Count of each load module of the area, row by row from the south-west.
    pub modules: Vec<u32>,
    /// Limit of a load module.
    pub per_load_module: u32,
    /// Rows and columns of load modules in a window.
    pub window: [u32; 2],
    /// Count of each window, by its south-west load module, row by row.
    pub windows: Vec<u32>,
    /// Limit of a window.
    pub per_window: u32,
    /// Load modules and windows, by their south-west load module, where posts were refused.
    pub bound_modules: Vec<ModuleId>,
    /// The same of windows.
    pub bound_windows: Vec<ModuleId>,
}

/// A tile as a map shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneTile {
    /// Which.
    pub tile: TileId,
    /// Its load modules.
    pub modules: ModuleRect,
    /// Its place in the order of ranks.
    pub rank: usize,
    /// Its colour: tiles of one colour may be refined at once.
    pub color: u32,
    /// How it stands.
    pub state: store::TileState,
}

impl Scene<'_> {
    /// Side of a load module in metres.
    pub(crate) fn side_m(&self) -> f64 {
        f64::from(self.grid.side_cells) * self.frame.spacing.metres()
    }

    /// West, south, east and north of a rectangle of load modules, in metres from the area's south-west post.
    pub(crate) fn extent_m(&self, modules: ModuleRect) -> [f64; 4] {
        [modules.west, modules.south, modules.east, modules.north].map(|line| f64::from(line) * self.side_m())
    }

    /// The extent of the part that is looked at.
    pub(crate) fn map_extent(&self, longest: usize) -> MapExtent {
        MapExtent::of(self.extent_m(self.part), longest)
    }

    pub(crate) fn coordinates(&self) -> Coordinates {
        let origin_m = [self.frame.origin_east_m, self.frame.origin_north_m];
        Coordinates { origin_m, crs: self.crs.to_owned() }
    }

    /// The posts of the ground.
    pub(crate) fn posts(&self, ground: &SceneGround) -> Posts {
        Posts { rect: ground.dem.rect(), spacing_m: [self.frame.spacing.metres(); 2] }
    }

    /// Triangles of the load modules of the part, those of bridges among them, as limits and the report count them.
    pub(crate) fn triangles_in_words(&self) -> String {
        let triangles: u64 = self.modules.iter().map(|module| u64::from(module.counts().triangles)).sum();
        format!("{} triangles", grouped(triangles))
    }

    /// What is looked at, in words.
    pub(crate) fn what(&self) -> String {
        let part = self.part;
        let [west, south, east, north] = self.extent_m(part);
        let size = format!("{} x {} km", (east - west) / 1000.0, (north - south) / 1000.0);
        if part == self.grid.all() {
            return size;
        }
        let (last_row, last_col) = (part.north - 1, part.east - 1);
        format!("load modules {},{} to {last_row},{last_col}, {size}", part.south, part.west)
    }
}
