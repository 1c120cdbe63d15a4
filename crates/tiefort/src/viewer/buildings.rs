//! Buildings as the page reads them: blocks that stand on the load modules, drawn only.
//!
//! As bytes, of each building: the number of its rings, then the corners of each (u32 each); height of its floor and of
//! its roof, its size, then east and north of each corner from the area's south-west corner (f32 each, metres). The
//! largest of a load module come first, so that those seen from afar are the first ones.

use std::collections::BTreeMap;

use load_module_reader::{Area, Block, LoadedGround};
use store::{BUILDING_UNITS_PER_METRE, Building, Folder, files};

use crate::places::block_around;
use crate::terminal;

/// Metres along a wall between two places where the ground is looked at.
const STEP_M: f64 = 5.0;
/// Metres that walls reach into the ground, which is drawn coarser from afar: what lies in it is not seen.
const SINK_M: f64 = 25.0;
/// Metres that the roof stands at least above the highest ground: on a slope, a low building would lie in it.
const LEAST_M: f64 = 2.5;

/// The buildings of an area by load module, row and column.
#[derive(Default)]
pub struct Buildings(BTreeMap<(u32, u32), Vec<Building>>);

impl Buildings {
    /// Those of the database in `folder`; none where it has no file of them. One that cannot be read is told, and
    /// leaves the rest to be seen.
    pub fn read(folder: &Folder, area: &Area) -> Self {
        let mut buildings = Self::default();
        if !folder.path(files::BUILDINGS).exists() {
            return buildings;
        }
        let all = folder.read_buildings().map(|(_, all)| all).unwrap_or_else(|error| {
            terminal::tell(&format!("warning: no building is drawn: {error}"));
            Vec::new()
        });
        let frame = area.frame();
        for building in all {
            let middle = middle_m(&building).map(|metres| (metres / frame.side_m()).floor());
            let inside = [frame.cols, frame.rows].map(f64::from);
            if (0..2).all(|axis| 0.0 <= middle[axis] && middle[axis] < inside[axis]) {
                buildings.0.entry((middle[1] as u32, middle[0] as u32)).or_default().push(building);
            }
        }
        for all in buildings.0.values_mut() {
            all.sort_by(|a, b| size_m(b).total_cmp(&size_m(a)).then_with(|| a.cmp(b)));
        }
        buildings
    }

    pub fn count(&self) -> usize {
        self.0.values().map(Vec::len).sum()
    }

    /// Those of a block of load modules of the area.
    ///
    /// # Errors
    /// In words, when the ground cannot be read.
    pub fn bytes(&self, area: &Area, block: Block) -> Result<Vec<u8>, String> {
        let frame = area.frame();
        let place = |col: u32, row: u32| {
            [0, 1].map(|axis| frame.origin_m[axis] + (f64::from([col, row][axis]) + 0.5) * frame.side_m())
        };
        let corners = [place(block.west, block.south), place(block.east - 1, block.north - 1)];
        // A building may reach into the next load module.
        let around = block_around(area, &corners, 1.0).map_err(|failure| failure.message().to_owned())?;
        let ground = area.load(around).map_err(|error| error.to_string())?;
        let rows = self.0.range((block.south, 0)..(block.north, 0));
        let mut out = Vec::new();
        for (_, all) in rows.filter(|((_, col), _)| (block.west..block.east).contains(col)) {
            all.iter().for_each(|building| write(building, &ground, frame.origin_m, &mut out));
        }
        Ok(out)
    }
}

/// Nothing is written of a building without ground under it.
fn write(building: &Building, ground: &LoadedGround, origin_m: [f64; 2], out: &mut Vec<u8>) {
    let Some([low, high]) = ground_under(building, ground, origin_m) else { return };
    let [bottom, top] = [building.bottom, building.top].map(metres);
    let floor = if building.bottom == 0 { low - SINK_M } else { low + bottom };
    let roof = (low + top).max(high + LEAST_M);
    let counts = building.rings.iter().map(|ring| ring.len() as u32);
    let words = std::iter::once(building.rings.len() as u32).chain(counts);
    out.extend(words.flat_map(u32::to_le_bytes));
    let corners = building.rings.iter().flatten().flat_map(|corner| corner.map(metres));
    let numbers = [floor, roof, size_m(building)].into_iter().chain(corners);
    out.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
}

/// The lowest and highest ground along the outer walls of a building.
fn ground_under(building: &Building, ground: &LoadedGround, origin_m: [f64; 2]) -> Option<[f64; 2]> {
    let ring = building.rings.first()?;
    let mut found: Option<[f64; 2]> = None;
    for (from, to) in ring.iter().zip(ring.iter().cycle().skip(1)) {
        let (from, to) = (from.map(metres), to.map(metres));
        let run = [to[0] - from[0], to[1] - from[1]];
        let steps = ((run[0] * run[0] + run[1] * run[1]).sqrt() / STEP_M).ceil().max(1.0);
        for step in 0..steps as u32 {
            let share = f64::from(step) / steps;
            let place = [0, 1].map(|axis| origin_m[axis] + from[axis] + share * run[axis]);
            if let Some(height) = ground.height_m(place) {
                let [low, high] = found.unwrap_or([height; 2]);
                found = Some([low.min(height), high.max(height)]);
            }
        }
    }
    found
}

fn metres(units: i32) -> f64 {
    f64::from(units) / f64::from(BUILDING_UNITS_PER_METRE)
}

/// Lowest and highest place along an axis, in metres from the area's south-west corner.
fn extent_m(building: &Building, axis: usize) -> [f64; 2] {
    let along = building.rings.iter().flatten().map(|corner| corner[axis]);
    [along.clone().min().unwrap_or(0), along.max().unwrap_or(0)].map(metres)
}

fn middle_m(building: &Building) -> [f64; 2] {
    [0, 1].map(|axis| extent_m(building, axis).into_iter().sum::<f64>() / 2.0)
}

/// The longest of what is seen of a building: its extent each way, and its height.
fn size_m(building: &Building) -> f64 {
    let wide = |axis: usize| extent_m(building, axis)[1] - extent_m(building, axis)[0];
    wide(0).max(wide(1)).max(metres(building.top))
}
