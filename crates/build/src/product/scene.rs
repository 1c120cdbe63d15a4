//! From a database that was read back to what pictures and reports are drawn from.

use job::Job;
use store::{Report, ReportPlace, TileState};
use terrain::{LoadModule, ModuleId, ModuleRect};
use views::{Scene, SceneFeatures, SceneGround, SceneLimits, SceneTile};

use crate::product::{LimitUse, Product};

/// What a scene borrows besides the product itself.
#[derive(Debug)]
pub struct SceneParts {
    limits: SceneLimits,
    tiles: Vec<SceneTile>,
    /// Names of all classes, and those that features have.
    classes: (Vec<String>, Vec<u8>),
}

impl SceneParts {
    /// Of a product, of which `limit_use` is known when all of it was read.
    pub fn new(product: &Product, limit_use: Option<LimitUse>, report: Option<&Report>) -> Self {
        let limits = &product.job.limits;
        let use_of = limit_use.unwrap_or(LimitUse { modules: Vec::new(), windows: Vec::new(), window: [1, 1] });
        let places = report.iter().flat_map(|report| &report.bound).map(|bound| bound.place);
        let id = |[row, col]: [u32; 2]| ModuleId { row, col };
        let (mut bound_modules, mut bound_windows) = (Vec::new(), Vec::new());
        for place in places {
            match place {
                ReportPlace::Module(place) => bound_modules.push(id(place)),
                ReportPlace::Window(place) => bound_windows.push(id(place)),
                ReportPlace::Area => {}
            }
        }
        let limits = SceneLimits {
            count: product.job.counted_words().into(),
            modules: use_of.modules,
            per_load_module: limits.per_load_module,
            window: use_of.window,
            windows: use_of.windows,
            per_window: limits.window.limit,
            bound_modules,
            bound_windows,
        };
        let state = |tile| product.manifest.tile(tile).map_or(TileState::Missing, |record| record.state);
        let tiles = product.tiles.iter().map(|planned| SceneTile {
            tile: planned.tile,
            modules: planned.modules,
            rank: planned.rank,
            color: planned.color,
            state: state(planned.tile),
        });
        let names = product.job.class_names().to_vec();
        let of_features = product.job.features.as_ref().map(|spec| spec.classes()).unwrap_or_default();
        let classes =
            (0..).zip(&names).filter(|(_, name)| of_features.contains(name)).map(|(class, _)| class).collect();
        Self { limits, tiles: tiles.collect(), classes: (names, classes) }
    }

    /// The scene of `part`, whose load modules are `modules`, row by row from the south-west.
    pub fn scene<'a>(&'a self, product: &'a Product, part: ModuleRect, modules: &'a [LoadModule]) -> Scene<'a> {
        Scene {
            name: &product.manifest.area.name,
            crs: &product.manifest.area.crs,
            grid: product.grid,
            frame: product.frame,
            part,
            modules,
            ground: product
                .ground
                .as_ref()
                .map(|ground| SceneGround { dem: &ground.dem, residuals: &ground.residuals }),
            limits: &self.limits,
            water: water(&product.job),
            features: product.features.as_ref().map(|(level, remarks)| SceneFeatures {
                names: &self.classes.0,
                classes: &self.classes.1,
                lines: &level.lines,
                remarks,
            }),
            tiles: &self.tiles,
        }
    }
}

/// The class of water: what the job gives to its water polygons, or one that is named so.
pub fn water(job: &Job) -> Option<u8> {
    let named = || job.class_names().iter().position(|class| class == "water");
    job.dem.water.as_ref().map(|water| water.class).or_else(|| named().map(|index| index as u8))
}
