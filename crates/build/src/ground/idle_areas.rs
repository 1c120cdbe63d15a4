//! Areas of importance that hold no post: a wrong value of a class raster, polygons that lie elsewhere, a height at
//! which nothing lies level. A person should know of them, since the ground is built as if the job did not name them.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicBool;

use job::{AreaShape, Job, NamedFile};
use schedule::Workers;
use source_files::{ClassRaster, read_polygons};
use terrain::mask::{Area, Mask, Polygon, Shape, importance};
use terrain::{Post, PostRect, Smooth, TileId};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;

/// Tiles that are looked at before it is asked whether one of them has a post.
const TILES_AT_ONCE: usize = 64;
/// Values of a class raster that are named.
const VALUES_NAMED: usize = 8;

/// A sentence for each area of importance of polygons, of a class raster or of level ground that holds no post of the
/// gaming area; `posts` are those of each class of the job, as a build counts them anyway.
///
/// No file is read for an area whose class has posts that no other part of the job can have given it.
///
/// # Errors
/// When a file cannot be read any more.
pub fn idle_areas(
    job: &Job,
    area: &GamingArea,
    posts: &[u64],
    (workers, stop): (&Workers, &AtomicBool),
) -> Result<Vec<String>, GroundError> {
    let areas = &job.importance.areas;
    let mut idle = Vec::new();
    for (index, spec) in areas.iter().enumerate() {
        let class = spec.class;
        let is_shared =
            class == 0 || job.is_of_features(class) || 1 < areas.iter().filter(|other| other.class == class).count();
        if !is_shared && posts.get(usize::from(class)).is_some_and(|&count| 0 < count) {
            continue;
        }
        let looked = Looked { job, area, workers, stop };
        let found = match &spec.shape {
            AreaShape::Polygons { file } => looked.polygons(file)?,
            AreaShape::RasterValue { file, value } => looked.raster(file, *value)?,
            AreaShape::Level { .. } if !is_shared => {
                Some("matches nothing: nowhere in the area are 5 x 5 posts or more at that height".to_owned())
            }
            // Ground may well be nowhere steep.
            AreaShape::Slope { .. } | AreaShape::Level { .. } | AreaShape::Sample(_) => None,
        };
        idle.extend(found.map(|found| format!("importance.areas[{index}] {found}")));
    }
    Ok(idle)
}

/// What files are looked at for.
struct Looked<'a> {
    job: &'a Job,
    area: &'a GamingArea,
    workers: &'a Workers,
    stop: &'a AtomicBool,
}

impl Looked<'_> {
    fn polygons(&self, file: &NamedFile) -> Result<Option<String>, GroundError> {
        let polygons = read_polygons(&file.path, self.job.area.epsg)?;
        let (count, frame, rect) = (polygons.len(), self.area.frame, self.area.rect);
        let extent = extent_of(&polygons);
        let shape = Shape::Polygons(polygons);
        let areas = vec![Area { class: "held".into(), weight: 1, shape }];
        let mask = Mask { default_weight: 0, areas, smooth: Smooth::None, over: Vec::new() };
        let tiles: Vec<TileId> = self.area.tiles.iter().copied().filter(|&tile| self.meets(tile, extent)).collect();
        let holds_some = |tile: TileId| -> Result<bool, GroundError> {
            let held = importance(&mask, rect, &frame, self.area.tiling.rect(tile));
            Ok(held.rect().posts().any(|post| held.class(post) != 0))
        };
        let is_idle = self.until(&tiles, holds_some, |&holds_some| holds_some)?.is_some();
        let none = format!("({}) matches nothing: none of its {count} polygons holds a post of the area", file.written);
        Ok(is_idle.then_some(none))
    }

    fn raster(&self, file: &NamedFile, value: i64) -> Result<Option<String>, GroundError> {
        let frame = self.area.frame;
        let raster = ClassRaster::open(&file.path, self.job.area.epsg, &frame, self.area.rect)?;
        let nodata = raster.nodata().filter(|&nodata| nodata == value as f64);
        let values_of = |tile: TileId| Ok(Values::of(raster.values(&frame, self.area.tiling.rect(tile))?, value));
        let Some(parts) = self.until(&self.area.tiles, values_of, |values| values.has_it)? else { return Ok(None) };
        let there = parts.into_iter().fold(Values::default(), Values::and);
        let why = match nodata {
            Some(_) => "the file marks what has no class with that value",
            None => "no post of the area has that value",
        };
        Ok(Some(format!("({}, value = {value}) matches nothing: {why}; there {}", file.written, there.text())))
    }

    /// What tiles hold, unless one of them has a post of the area of importance: no more of them are looked at then.
    fn until<T: Send>(
        &self,
        tiles: &[TileId],
        of: impl Fn(TileId) -> Result<T, GroundError> + Sync,
        has_post: impl Fn(&T) -> bool,
    ) -> Result<Option<Vec<T>>, GroundError> {
        let mut all = Vec::new();
        for tiles in tiles.chunks(TILES_AT_ONCE) {
            let parts = schedule::for_each_independent(tiles, self.workers, self.stop, |_, &tile| of(tile))
                .map_err(|error| -> GroundError { GroundError::from_schedule(tiles, error) })?;
            if parts.iter().any(&has_post) {
                return Ok(None);
            }
            all.extend(parts);
        }
        Ok(Some(all))
    }

    fn meets(&self, tile: TileId, [west, south, east, north]: [f64; 4]) -> bool {
        let PostRect { south: row, west: col, north: last_row, east: last_col } = self.area.tiling.rect(tile);
        let [tile_west, tile_south] = self.area.frame.place_m(Post::new(row, col));
        let [tile_east, tile_north] = self.area.frame.place_m(Post::new(last_row, last_col));
        west <= tile_east && tile_west <= east && south <= tile_north && tile_south <= north
    }
}

/// West, south, east and north of polygons.
fn extent_of(polygons: &[Polygon]) -> [f64; 4] {
    let nowhere = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let places = polygons.iter().flat_map(|polygon| polygon.rings.iter().flatten());
    places.fold(nowhere, |[west, south, east, north], &[x, y]| [west.min(x), south.min(y), east.max(x), north.max(y)])
}

/// Values that posts have, the least of them, and whether one is that of the job.
#[derive(Default)]
struct Values {
    least: BTreeSet<i64>,
    has_it: bool,
}

impl Values {
    fn of(mut all: BTreeSet<i64>, wanted: i64) -> Self {
        let has_it = all.contains(&wanted);
        cut(&mut all);
        Self { least: all, has_it }
    }

    fn and(mut self, mut other: Self) -> Self {
        self.least.append(&mut other.least);
        cut(&mut self.least);
        Self { has_it: self.has_it || other.has_it, ..self }
    }

    fn text(&self) -> String {
        let named: Vec<String> = self.least.iter().take(VALUES_NAMED).map(i64::to_string).collect();
        match self.least.len() {
            0 => "is no value".into(),
            1 => format!("is {} alone", named[0]),
            count if VALUES_NAMED < count => format!("are {} and more", named.join(", ")),
            _ => format!("are {}", named.join(", ")),
        }
    }
}

/// One more than is named tells that there are more.
fn cut(values: &mut BTreeSet<i64>) {
    while VALUES_NAMED + 1 < values.len() {
        values.pop_last();
    }
}
