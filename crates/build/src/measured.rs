//! Between what a build knows of a tile's load modules and the file that keeps it.

use crate::product::{from_curvature, from_features, from_tally, to_curvature, to_features, to_tally};
use fidelity::Residuals;
use store::{FileStamp, Measured, MeasuredModule};
use terrain::{ModuleResidual, TileId};

use crate::assembled::{Assembled, ModuleNumbers};
use crate::order::Unit;
use crate::run::Run;
use crate::sums::{Adding, Sums};
use crate::{CompileError, Stage};

/// What is kept of a tile's load modules.
pub(crate) fn to_measured(tile: TileId, assembled: &Assembled, sums: &Sums) -> Measured {
    let module = |numbers: &ModuleNumbers| MeasuredModule {
        triangles: numbers.triangles,
        polygons: numbers.polygons,
        posts: numbers.residual.posts,
        largest: numbers.residual.largest,
        sum_abs: numbers.residual.sum_abs,
        sum_squared: numbers.residual.sum_squared,
    };
    Measured {
        tile,
        modules_file: assembled.file,
        modules: std::iter::once(&assembled.modules).chain(&assembled.coarser).flatten().map(module).collect(),
        classes: sums.residuals.classes.iter().map(to_tally).collect(),
        at_source_grid: sums.at_source_grid.as_ref().map(to_tally),
        at_source: sums.has_source.then(|| to_tally(&sums.at_source)),
        points: sums.points.clone(),
        border: sums.border,
        heights: sums.heights.into(),
        curvature: to_curvature(sums.curvature),
        features: sums.features.as_ref().map(to_features),
    }
}

/// What was kept of a tile of `count` load modules, in a file of this stamp.
pub(crate) fn from_measured(measured: Measured, count: usize, file: FileStamp) -> (Assembled, Sums) {
    let module = |module: &MeasuredModule| ModuleNumbers {
        triangles: module.triangles,
        polygons: module.polygons,
        residual: ModuleResidual {
            posts: module.posts,
            largest: module.largest,
            sum_abs: module.sum_abs,
            sum_squared: module.sum_squared,
        },
    };
    let mut levels = measured.modules.chunks(count.max(1)).map(|level| level.iter().map(module).collect());
    let (modules, coarser) = (levels.next().unwrap_or_default(), levels.collect());
    let done = Assembled { file: measured.modules_file, measured: file, modules, coarser };
    (done, sums_of(measured))
}

impl Sums {
    /// Those of every tile as `assembled` says that it is published.
    ///
    /// # Errors
    /// When a file cannot be read; [`CompileError::NotReady`] when another process has changed it since.
    pub(crate) fn published(run: &Run, assembled: &[Assembled]) -> Result<Sums, CompileError> {
        let (tiles, adding) = (&run.area.tiles, Adding::default());
        let folder = run.database.folder();
        let read = |place: usize, &tile: &terrain::TileId| -> Result<(), CompileError> {
            let (_, file, measured) = folder.read_measured(tile)?;
            if file != assembled[place].measured {
                let [unit, needs] =
                    [Unit::whole(Stage::Publish), Unit::of(Stage::Assemble, tile)].map(|unit| unit.to_string());
                return Err(CompileError::NotReady { unit, needs });
            }
            adding.add(sums_of(measured));
            Ok(())
        };
        schedule::for_each_independent(tiles, &run.workers, run.stop, read)
            .map_err(|error| CompileError::from_schedule(Stage::Enforce, tiles, error))?;
        Ok(adding.finish())
    }
}

/// What was kept of a tile's residuals and points.
pub fn sums_of(measured: Measured) -> Sums {
    Sums {
        residuals: Residuals { classes: measured.classes.iter().map(from_tally).collect() },
        at_source_grid: measured.at_source_grid.as_ref().map(from_tally),
        at_source: measured.at_source.as_ref().map(from_tally).unwrap_or_default(),
        has_source: measured.at_source.is_some(),
        points: measured.points,
        border: measured.border,
        heights: measured.heights.into(),
        curvature: from_curvature(measured.curvature),
        features: measured.features.as_ref().map(from_features),
    }
}
