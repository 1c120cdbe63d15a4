//! What the page knows of the whole area: heights on a coarse grid, and counts and residuals of every load module.
//!
//! As bytes: heights in metres (f32), row by row from the south-west; then of each load module triangles, polygons
//! (u32 each), root mean square and largest residual in metres (f32 each; not a number without posts); then the class
//! at each height (u8).

use std::collections::{BTreeMap, HashSet};

use load_module_reader::{Area, Block, Module, ObjectKind, QUANTA_PER_METRE, ReadError};

use super::lines::{Longest, edges_of};

/// Heights that a browser still draws easily.
const HEIGHTS_MAX: u64 = 60_000;

/// The whole area, coarsely.
pub struct Overview {
    /// Coarse cells along a side of a load module.
    pub steps: u32,
    /// Lowest and highest vertex, metres.
    pub range_m: [f64; 2],
    /// Roads and streams that load modules have as lines.
    pub lines: Longest,
    /// What stands in load modules: the numbers of the objects of each kind, of which each may stand in several.
    objects: BTreeMap<ObjectKind, HashSet<u64>>,
    heights: Vec<f32>,
    classes: Vec<u8>,
    figures: Vec<u8>,
}

impl Overview {
    /// Reads every load module, row by row.
    ///
    /// # Errors
    /// When one is damaged or missing.
    pub fn read(area: &Area) -> Result<Self, ReadError> {
        let (rows, cols) = (area.frame().rows, area.frame().cols);
        let heights = |steps: &u64| (u64::from(rows) * steps + 1) * (u64::from(cols) * steps + 1);
        let steps = [4, 2].into_iter().find(|steps| heights(steps) <= HEIGHTS_MAX).unwrap_or(1) as u32;
        let mut overview = Self {
            steps,
            range_m: [f64::INFINITY, f64::NEG_INFINITY],
            lines: Longest::default(),
            objects: BTreeMap::new(),
            heights: Vec::new(),
            classes: Vec::new(),
            figures: Vec::new(),
        };
        for row in 0..rows {
            overview.add_row(area, row)?;
        }
        Ok(overview)
    }

    fn add_row(&mut self, area: &Area, row: u32) -> Result<(), ReadError> {
        let frame = area.frame();
        let ground = area.load(Block { south: row, west: 0, north: row + 1, east: frame.cols })?;
        // From afar water is what lies at the corners of the coarse grid: without its line a river would have gaps.
        self.lines.add(edges_of(&ground, &[]));
        for module in ground.modules() {
            let module = module.module();
            self.add_figures(module);
            let prisms = module.objects.prisms.iter().map(|prism| (prism.kind, prism.id));
            for (kind, id) in prisms.chain(module.objects.canopies.iter().map(|canopy| (canopy.kind, canopy.id))) {
                self.objects.entry(kind).or_default().insert(id);
            }
        }
        let step_m = frame.side_m() / f64::from(self.steps);
        for line in 0..self.steps + u32::from(row + 1 == frame.rows) {
            let north = frame.origin_m[1] + f64::from(row * self.steps + line) * step_m;
            let places =
                (0..=frame.cols * self.steps).map(|step| [frame.origin_m[0] + f64::from(step) * step_m, north]);
            for sample in places.map(|place| ground.sample(place)) {
                self.heights.push(sample.as_ref().map_or(f64::NAN, |sample| sample.height_m) as f32);
                self.classes.push(sample.map_or(u8::MAX, |sample| sample.class));
            }
        }
        Ok(())
    }

    fn add_figures(&mut self, module: &Module) {
        let metre = f64::from(QUANTA_PER_METRE);
        for vertex in &module.vertices {
            let height = f64::from(vertex.z) / metre;
            self.range_m = [self.range_m[0].min(height), self.range_m[1].max(height)];
        }
        // Decks count as the ground does.
        let of_decks = module.decks.triangles.len() as u32;
        self.figures.extend((module.triangles.len() as u32 + of_decks).to_le_bytes());
        self.figures.extend((module.polygon_count + of_decks).to_le_bytes());
        for figure in residuals_m(module) {
            self.figures.extend(figure.to_le_bytes());
        }
    }

    /// How many objects of each kind stand in the area, by the kind's name.
    pub fn objects(&self) -> BTreeMap<&'static str, usize> {
        self.objects.iter().map(|(kind, ids)| (kind.name(), ids.len())).collect()
    }

    /// As the page reads it.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes: Vec<u8> = self.heights.iter().flat_map(|height| height.to_le_bytes()).collect();
        bytes.extend(&self.figures);
        bytes.extend(&self.classes);
        bytes
    }
}

/// Root mean square and largest residual of a load module in metres, not a number where no post was measured.
pub fn residuals_m(module: &Module) -> [f32; 2] {
    let largest = f64::from(module.residual.largest) / f64::from(QUANTA_PER_METRE);
    module.residual.rms_m().map_or([f32::NAN; 2], |rms_m| [rms_m as f32, largest as f32])
}
