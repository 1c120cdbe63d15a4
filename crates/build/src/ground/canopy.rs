//! Woods from a raster of heights of leaves above the ground, of whatever spacing and system.

use features::objects::{CanopyRun, FoundObject, canopy_class, canopy_woods, traits};
use job::{Job, ObjectSource, ObjectsSpec};
use source_files::{Crs, DemFile, Mosaic, MosaicRules, MosaicVoids, Reading, SourceError, Standing, window_reaching};
use terrain::{Each, GridFrame, ObjectKind, Post, PostRect, Resampling, Spacing, gather, metres_of_quanta};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;

/// Samples along a side of a cell, whose median is its height.
const SAMPLES: i32 = 4;
/// Rows of cells that are read at once.
const STRIP: i32 = 32;

/// The woods of a raster in the area; `each` runs strips of rows.
///
/// # Errors
/// When the file is no raster of heights, cannot be read, or lies elsewhere.
pub fn woods(
    job: &Job,
    (spec, source): (&ObjectsSpec, &ObjectSource),
    crs: Option<Crs>,
    area: &GamingArea,
    each: Each,
) -> Result<Vec<FoundObject>, GroundError> {
    // Metres wherever the file names no unit; leaves have no datum.
    let file = DemFile::open(&source.file.path, &Reading { crs, ..Reading::AS_IT_SAYS })?;
    let of_area = Crs::from_epsg(job.area.epsg).map_err(|found| SourceError::PolygonCrs {
        path: source.file.path.clone(),
        found,
        expected: job.area.epsg,
    })?;
    // In whole sixteenths of a metre, as all spacings are.
    let sixteenths = (source.cell_m * 16.0 / f64::from(SAMPLES)).round().max(1.0) as u32;
    let spacing = Spacing::from_sixteenths(sixteenths).expect("one or more");
    let cell_m = f64::from(SAMPLES) * spacing.metres();
    let [west, south] = area.frame.place_m(Post::new(area.rect.south, area.rect.west));
    let half_m = spacing.metres() / 2.0;
    let grid = GridFrame { origin_east_m: west + half_m, origin_north_m: south + half_m, spacing };
    let cells = |posts: i32| (f64::from(posts) * area.frame.spacing.metres() / cell_m).ceil() as i32;
    let (rows, cols) = (cells(area.rect.north - area.rect.south), cells(area.rect.east - area.rect.west));
    let strip = |number: usize| -> Result<Vec<CanopyRun>, SourceError> {
        let first = number as i32 * STRIP;
        let last = (first + STRIP).min(rows);
        let rect = PostRect { south: SAMPLES * first, west: 0, north: SAMPLES * last - 1, east: SAMPLES * cols - 1 };
        let Some(window) = window_reaching(file.frame(), &of_area, &grid, rect) else { return Ok(Vec::new()) };
        let heights = Heights::read(&file, window, (&of_area, &grid, rect))?;
        let class = |row: i32, col: i32| {
            let height_m = heights.median_m([row - first, col])?;
            (source.least_m <= height_m).then(|| canopy_class(height_m))
        };
        Ok((first..last).flat_map(|row| runs(row, cols, |col| class(row, col))).collect())
    };
    let mut all = Vec::new();
    for runs in gather(each, (rows as usize).div_ceil(STRIP as usize), strip) {
        all.extend(runs?);
    }
    let said = (source.kind.or(Some(ObjectKind::Wood)), None);
    let Some((traits, _)) = traits(|_| None, said, &spec.rules).filter(|(traits, _)| !traits.kind.is_prism()) else {
        return Err(no_wood(source));
    };
    let corner = [west - area.frame.origin_east_m, south - area.frame.origin_north_m];
    Ok(canopy_woods(&all, corner, cell_m, (&source.file.written, traits)))
}

/// The stretches of a row of cells of one class.
fn runs(row: i32, cols: i32, class: impl Fn(i32) -> Option<i32>) -> Vec<CanopyRun> {
    let mut runs: Vec<CanopyRun> = Vec::new();
    for col in 0..cols {
        let Some(class) = class(col) else { continue };
        match runs.last_mut().filter(|run| run.cols[1] == col && run.class == class) {
            Some(run) => run.cols[1] = col + 1,
            None => runs.push(CanopyRun { row, cols: [col, col + 1], class }),
        }
    }
    runs
}

/// Samples of a strip of cells, in quanta; `None` where there is no height.
struct Heights {
    samples: Vec<Option<i32>>,
    wide: usize,
}

impl Heights {
    fn read(
        file: &DemFile,
        window: PostRect,
        (crs, grid, rect): (&Crs, &GridFrame, PostRect),
    ) -> Result<Self, SourceError> {
        let voids = MosaicVoids { next_source: false, fill_within: 0 };
        let rules = MosaicRules { resampling: Resampling::Bilinear, feather_m: 0.0, voids };
        let patch = Mosaic::new(vec![file.read(window)?], rules, crs, grid, rect)?.resample(rect);
        let sample = |(height, standing): (&i32, &Standing)| (*standing == Standing::Height).then_some(*height);
        let samples = patch.heights.iter().zip(&patch.standings).map(sample).collect();
        Ok(Self { samples, wide: rect.posts_wide() })
    }

    /// The median of a cell by row and column in the strip; `None` where half of it has no height.
    fn median_m(&self, [row, col]: [i32; 2]) -> Option<f64> {
        let side = SAMPLES as usize;
        let first = row as usize * side * self.wide + col as usize * side;
        let lines = (0..side).map(|line| first + line * self.wide);
        let mut known: Vec<i32> = lines.flat_map(|at| &self.samples[at..at + side]).filter_map(|at| *at).collect();
        known.sort_unstable();
        (side * side < 2 * known.len()).then(|| metres_of_quanta(known[known.len() / 2]))
    }
}

fn no_wood(source: &ObjectSource) -> GroundError {
    GroundError::Impossible {
        key: "objects.sources".into(),
        found: format!("{}, a raster, of a kind that is no wood", source.file.written),
        expected: "kind = \"wood\", \"scrub\", \"orchard\" or \"row\"".into(),
        hint: "remove kind: heights of leaves are woods".into(),
    }
}
