//! What is exported: the load modules of an area, or of a block of it, and where they lie.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use store::{Folder, Manifest, TileModules};
use terrain::{
    GridFrame, HOLE_CLASS, LoadModule, MaterialName, ModuleGrid, ModuleId, ModuleLine, ModuleRect, OBJECT_MATERIALS,
    QUANTA_PER_METRE, TileId, is_band, plans,
};

use crate::classes::{Classes, names_in, water_in};
use crate::textures::{Place, Texture, Textures};
use crate::{ExportError, Work};

/// A block of load modules by its south-west and north-east one, both inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// The one in the south-west.
    pub south_west: ModuleId,
    /// The one in the north-east.
    pub north_east: ModuleId,
}

/// Which levels of detail are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Levels {
    /// This one alone; 0 is the finest.
    One(usize),
    /// This one and all that are coarser.
    From(usize),
}

/// The load modules of a block, each sound, and what holds for all of them.
#[derive(Clone, Debug)]
pub struct Product {
    /// What `database.json` says.
    pub manifest: Manifest,
    /// The names of the job's classes, in its order.
    pub class_names: Vec<String>,
    /// Those of them that are water.
    pub water: Vec<u8>,
    /// The load modules of the whole area.
    pub grid: ModuleGrid,
    /// Where the working grid lies.
    pub frame: GridFrame,
    /// The load modules that are exported.
    pub rect: ModuleRect,
    /// Their level of detail; 0 is the finest.
    pub level: usize,
    /// These, row by row from the south-west.
    pub modules: Vec<LoadModule>,
    /// The same at coarser levels, where these are exported, too.
    pub coarser: Vec<Vec<LoadModule>>,
    /// Middle lines of ways in each of them, without ways in the ground that this level leaves out.
    pub lines: Vec<Vec<ModuleLine>>,
    /// Classes of ways that each level beside the finest leaves out, and coarser ones with it.
    pub(crate) left_out: Vec<Vec<u8>>,
    /// Whether ways that are lines in the ground are seen as bands over it.
    pub has_ribbons: bool,
    /// Other names for materials.
    pub(crate) materials: Vec<MaterialName>,
    /// Orthophotos that the ground is seen with.
    pub textures: Option<Arc<Textures>>,
    /// The tiles that they are of.
    pub(crate) tiles: Vec<TileModules>,
    /// Place in `tiles` of each module's tile.
    pub(crate) tile_of: Vec<u32>,
    /// Objects of the database that are left out, since they stand over holes.
    pub over_holes: usize,
}

impl Product {
    /// Reads the load modules of `block`, or all of the area.
    ///
    /// # Errors
    /// When the database is missing, unfinished or damaged, or has no such load modules or levels.
    pub fn read(folder: &Path, block: Option<Block>, wanted: Levels, work: &Work) -> Result<Self, ExportError> {
        let folder = Folder::new(folder);
        let manifest = folder.finished()?;
        let rect = rect_of(&manifest, block)?;
        let of_rect = |tile: &TileId| manifest.area.modules_of(*tile).and_then(|own| own.intersection(rect)).is_some();
        let ids: Vec<TileId> = manifest.tiles.iter().map(store::TileRecord::tile).filter(of_rect).collect();
        let read = work.each("tiles read", &ids, |&tile| {
            let (tile, levels) = match block {
                Some(_) => folder.read_part(&manifest, tile, rect),
                None => folder.read_levels(&manifest, tile),
            }?;
            let finest = levels.first().map_or(&[][..], Vec::as_slice).iter();
            let lines: Vec<_> = finest.map(|module| (module.id, module.lines.clone())).collect();
            Ok(((tile, wanted.of(levels)?), lines))
        })?;
        let report = folder.report()?;
        let (read, lines): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        let mut lines: Vec<(ModuleId, Vec<ModuleLine>)> = lines.into_iter().flatten().collect();
        lines.sort_by_key(|(id, _)| *id);
        let product = Self::put_together((manifest, names_in(&report), water_in(&report)), rect, wanted.first(), read)?;
        Ok(Self { lines: lines.into_iter().map(|(_, lines)| lines).collect(), ..product })
    }

    fn put_together(
        (manifest, class_names, water): (Manifest, Vec<String>, Vec<u8>),
        rect: ModuleRect,
        level: usize,
        read: Vec<(TileModules, Vec<Vec<LoadModule>>)>,
    ) -> Result<Self, ExportError> {
        let mut tiles = Vec::new();
        let level_count = read.iter().map(|(_, levels)| levels.len()).max().unwrap_or(0);
        let mut placed: Vec<Vec<(u32, LoadModule)>> = vec![Vec::with_capacity(rect.count()); level_count];
        for (tile, levels) in read {
            for (placed, modules) in placed.iter_mut().zip(levels) {
                placed.extend(modules.into_iter().map(|module| (tiles.len() as u32, module)));
            }
            tiles.push(tile);
        }
        let mut levels = Vec::with_capacity(level_count);
        let mut tile_of = Vec::new();
        for mut placed in placed {
            placed.sort_by_key(|(_, module)| module.id);
            if !placed.iter().map(|(_, module)| module.id).eq(rect.iter()) {
                return Err(damaged(placed.len(), rect));
            }
            let (tiles, modules): (Vec<u32>, Vec<LoadModule>) = placed.into_iter().unzip();
            levels.push(modules);
            tile_of = tiles;
        }
        let mut levels = levels.into_iter();
        let (Some(first), Some(modules)) = (tiles.first(), levels.next()) else { return Err(damaged(0, rect)) };
        let (grid, frame) = (first.grid, first.frame);
        let coarser = levels.collect();
        let (lines, left_out, has_ribbons) = (Vec::new(), Vec::new(), true);
        let (materials, textures) = (Vec::new(), None);
        let mut product = Self {
            manifest,
            class_names,
            water,
            grid,
            frame,
            rect,
            level,
            modules,
            coarser,
            lines,
            left_out,
            has_ribbons,
            materials,
            textures,
            tiles,
            tile_of,
            over_holes: 0,
        };
        if 0 < product.hole_triangles() {
            let count = product.object_count();
            product.modules.iter_mut().for_each(leave_out_over_holes);
            product.over_holes = count - product.object_count();
            // All levels have the same objects, wherever the holes of each end.
            for level in &mut product.coarser {
                level.iter_mut().zip(&product.modules).for_each(|(own, finest)| own.objects = finest.objects.clone());
            }
        }
        Ok(product)
    }

    /// The same at each of its levels, from fine to coarse, one at a time.
    pub(crate) fn levels(&self) -> impl Iterator<Item = Self> {
        let coarser = (self.level + 1..).zip(&self.coarser);
        let all = std::iter::once((self.level, &self.modules)).chain(coarser);
        all.map(|(level, modules)| {
            let lines = self.lines_at(level);
            Self { level, modules: modules.clone(), coarser: Vec::new(), lines, ..self.clone() }
        })
    }

    /// The same without the ways that its levels leave out of the ground: names of their classes for each level beside
    /// the finest, as the job has them.
    #[must_use]
    pub fn leaving_out(mut self, levels: &[Vec<String>]) -> Self {
        let numbers = |names: &Vec<String>| -> Vec<u8> {
            let named = (0..).zip(&self.class_names).filter(|(_, name)| names.contains(name));
            named.map(|(class, _)| class).collect()
        };
        self.left_out = levels.iter().map(numbers).collect();
        self.lines = self.lines_at(self.level);
        self
    }

    /// The lines of a level, which is no finer than its own.
    fn lines_at(&self, level: usize) -> Vec<Vec<ModuleLine>> {
        let is_left_out = |class: &u8| self.left_out.iter().take(level).flatten().any(|other| other == class);
        let stays = |line: &&ModuleLine| !line.is_in_ground || !is_left_out(&line.class);
        self.lines.iter().map(|lines| lines.iter().filter(stays).cloned().collect()).collect()
    }

    /// Length of a load module's side in quanta of 1/128 m.
    pub(crate) fn side(&self) -> i32 {
        self.grid.side_cells * self.frame.spacing.quanta_per_post()
    }

    /// Length of a load module's side in metres.
    pub(crate) fn side_m(&self) -> f64 {
        f64::from(self.grid.side_cells) * self.frame.spacing.metres()
    }

    /// East and north in quanta from the south-west corner of what is exported to that of a load module.
    pub(crate) fn corner(&self, id: ModuleId) -> [i32; 2] {
        [(id.col - self.rect.west) as i32 * self.side(), (id.row - self.rect.south) as i32 * self.side()]
    }

    /// Easting and northing of the south-west corner of a load module.
    pub fn corner_m(&self, row: u32, col: u32) -> [f64; 2] {
        let [east_m, north_m] = [self.frame.origin_east_m, self.frame.origin_north_m];
        [east_m + f64::from(col) * self.side_m(), north_m + f64::from(row) * self.side_m()]
    }

    /// The load module at (`row`, `col`) of the area, if it is exported.
    pub(crate) fn module(&self, id: ModuleId) -> Option<&LoadModule> {
        let index =
            |rect: ModuleRect| (id.row - rect.south) as usize * rect.cols() as usize + (id.col - rect.west) as usize;
        self.rect.contains(id).then(|| &self.modules[index(self.rect)])
    }

    /// Triangles over holes, where no source has a height.
    pub fn hole_triangles(&self) -> usize {
        self.modules.iter().flat_map(|module| &module.classes).filter(|&&class| class == HOLE_CLASS).count()
    }

    /// Triangles of decks of bridges.
    pub fn deck_triangles(&self) -> usize {
        self.modules.iter().map(|module| module.decks.triangles.len()).sum()
    }

    /// Length of the ways that are seen as ribbons, in metres.
    pub fn ribbons_m(&self) -> f64 {
        if self.has_ribbons { length_m(&self.lines) } else { 0.0 }
    }

    /// How many objects stand on what is exported, those over holes left out.
    pub fn object_count(&self) -> usize {
        let objects = || self.modules.iter().map(|module| &module.objects);
        let prisms = objects().flat_map(|objects| objects.prisms.iter().map(|prism| (prism.kind, prism.id)));
        let canopies = objects().flat_map(|objects| objects.canopies.iter().map(|canopy| (canopy.kind, canopy.id)));
        prisms.chain(canopies).collect::<BTreeSet<_>>().len()
    }

    /// The texture of some of its load modules, where it has orthophotos, with texels no finer than `texel_m`.
    ///
    /// # Errors
    /// When a picture has changed, or part of it cannot be decoded.
    pub fn texture(&self, rect: ModuleRect, texel_m: f64) -> Result<Option<Texture>, ExportError> {
        let origin_m = self.corner_m(self.rect.south, self.rect.west);
        let [low_m, high_m] = [self.corner_m(rect.south, rect.west), self.corner_m(rect.north, rect.east)];
        let place = Place { origin_m, low_m, high_m, module_m: self.side_m(), below: self.classes().color(0) };
        self.textures.as_ref().map(|textures| textures.of(&place, texel_m)).transpose()
    }

    /// What names of textures end in.
    pub(crate) fn texture_extension(&self) -> &'static str {
        self.textures.as_ref().map_or("", |textures| textures.extension())
    }

    /// Gives materials other names.
    ///
    /// # Errors
    /// When no material has one of these names.
    pub fn name_materials(&mut self, materials: Vec<MaterialName>) -> Result<(), ExportError> {
        let known = || self.class_names.iter().map(String::as_str).chain(OBJECT_MATERIALS);
        if let Some(unknown) = materials.iter().find(|named| known().all(|name| name != named.of)) {
            return Err(ExportError::Impossible {
                what: "--material".into(),
                found: format!("{:?}", unknown.of),
                expected: format!("one of {}", known().collect::<Vec<_>>().join(", ")),
                hint: "write --material CLASS=NAME, once for each material that is called otherwise".into(),
            });
        }
        self.materials = materials;
        Ok(())
    }

    /// The classes of the job, by name and colour.
    pub(crate) fn classes(&self) -> Classes<'_> {
        Classes::new(&self.class_names, &self.materials)
    }

    /// The coordinate system as the database names it.
    pub fn crs(&self) -> &str {
        &self.manifest.area.crs
    }

    /// The EPSG code of the coordinate system, where it is named by one.
    pub(crate) fn epsg(&self) -> Option<u32> {
        self.crs().strip_prefix("EPSG:").and_then(|code| code.parse().ok())
    }

    /// What heights are above; empty when unknown.
    pub(crate) fn vertical_datum(&self) -> &str {
        &self.manifest.area.vertical_datum
    }

    /// Whom to thank for the sources.
    pub(crate) fn attributions(&self) -> Vec<&str> {
        self.manifest.sources.iter().filter_map(|source| source.attribution.as_deref()).collect()
    }

    /// Rectangles of at most `side` x `side` load modules, cut on lines that are multiples of `side` in the area.
    pub(crate) fn squares(&self, side: u32) -> Vec<ModuleRect> {
        let starts = |low: u32, high: u32| (low / side..high.div_ceil(side)).map(move |index| index * side);
        let clipped = |south: u32, west: u32| ModuleRect {
            south: south.max(self.rect.south),
            west: west.max(self.rect.west),
            north: (south + side).min(self.rect.north),
            east: (west + side).min(self.rect.east),
        };
        starts(self.rect.south, self.rect.north)
            .flat_map(|south| starts(self.rect.west, self.rect.east).map(move |west| clipped(south, west)))
            .collect()
    }
}

impl Levels {
    /// The finest of them.
    fn first(self) -> usize {
        match self {
            Levels::One(level) | Levels::From(level) => level,
        }
    }

    /// Those of a file's levels.
    fn of(self, mut levels: Vec<Vec<LoadModule>>) -> Result<Vec<Vec<LoadModule>>, ExportError> {
        if levels.len() <= self.first() {
            return Err(ExportError::Impossible {
                what: "--lod".into(),
                found: format!("level {}", self.first()),
                expected: match levels.len() {
                    1 => "0, the only level in the database".into(),
                    count => format!("0 to {}: the database has {count} levels", count - 1),
                },
                hint: "[lod] levels in a job gives load modules more levels; `tiefort report` lists them".into(),
            });
        }
        let mut wanted = levels.split_off(self.first());
        if matches!(self, Levels::One(_)) {
            wanted.truncate(1);
        }
        Ok(wanted)
    }
}

fn damaged(found: usize, rect: ModuleRect) -> ExportError {
    ExportError::Impossible {
        what: "the database".into(),
        found: format!("{found} load modules in its files"),
        expected: format!("{}, each once", rect.count()),
        hint: "the database is damaged: `tiefort verify` says where".into(),
    }
}

fn rect_of(manifest: &Manifest, block: Option<Block>) -> Result<ModuleRect, ExportError> {
    let (rows, cols) = (manifest.area.module_rows, manifest.area.module_cols);
    let Some(Block { south_west, north_east }) = block else {
        return Ok(ModuleRect { south: 0, west: 0, north: rows, east: cols });
    };
    let inside = north_east.row < rows && north_east.col < cols;
    if inside && south_west.row <= north_east.row && south_west.col <= north_east.col {
        let (north, east) = (north_east.row + 1, north_east.col + 1);
        return Ok(ModuleRect { south: south_west.row, west: south_west.col, north, east });
    }
    Err(ExportError::Impossible {
        what: "--modules".into(),
        found: format!("{south_west}..{north_east}"),
        expected: format!("load modules from 0,0 to {},{}", rows.saturating_sub(1), cols.saturating_sub(1)),
        hint: "name the south-west one first, then the north-east one, each as ROW,COL".into(),
    })
}

/// The length of all of them.
fn length_m(lines: &[Vec<ModuleLine>]) -> f64 {
    let all = lines.iter().flatten().filter(|line| is_band(line)).flat_map(|line| line.vertices.windows(2));
    let part = |pair: &[terrain::ModuleVertex]| {
        let [east, north] = [[pair[0].x, pair[1].x], [pair[0].y, pair[1].y]].map(|[a, b]| f64::from(b) - f64::from(a));
        east.hypot(north)
    };
    all.map(part).sum::<f64>() / f64::from(QUANTA_PER_METRE)
}

/// Leaves out buildings of which more than half stands over holes, where nothing is known of the ground, and triangles
/// of woods whose middle does.
fn leave_out_over_holes(module: &mut LoadModule) {
    let LoadModule { vertices, triangles, classes, objects, .. } = module;
    let corner = |v: u16| [vertices[usize::from(v)].x, vertices[usize::from(v)].y].map(i64::from);
    let over = triangles.iter().zip(classes.iter()).filter(|(_, class)| **class == HOLE_CLASS);
    let holes: Vec<[[i64; 2]; 3]> = over.map(|(triangle, _)| triangle.map(corner)).collect();
    // The middle of a triangle, in thirds of a quantum.
    let stands_over = |triangle: [[i64; 2]; 3]| {
        let middle = [0, 1].map(|axis| triangle.iter().map(|at| at[axis]).sum::<i64>());
        let is_left = |a: [i64; 2], b: [i64; 2]| {
            0 <= (b[0] - a[0]) * (middle[1] - 3 * a[1]) - (b[1] - a[1]) * (middle[0] - 3 * a[0])
        };
        holes.iter().any(|&[a, b, c]| is_left(a, b) && is_left(b, c) && is_left(c, a))
    };
    objects.prisms.retain(|prism| {
        let (places, triangles) = plans::triangles(&prism.plan());
        let at = |index: u32| places[index as usize].map(i64::from);
        // Twice the areas of its triangles: those over holes against the others.
        let weigh = |triangle: &[u32; 3]| {
            let corners = triangle.map(at);
            let [[ax, ay], [bx, by], [cx, cy]] = corners;
            let area = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay)).abs();
            if stands_over(corners) { area } else { -area }
        };
        triangles.iter().map(weigh).sum::<i64>() <= 0
    });
    for canopy in &mut objects.canopies {
        let at = |index: u16| canopy.places[usize::from(index)].map(i64::from);
        canopy.triangles.retain(|triangle| !stands_over(triangle.map(at)));
    }
    objects.canopies.retain(|canopy| !canopy.triangles.is_empty());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn what_stands_over_a_hole_is_left_out() {
        // Houses, and triangles of woods: the house and one of the two triangles stand over ground triangle 1.
        let standing = |holes: &[usize]| {
            let mut module = samples::with_objects().modules.swap_remove(1);
            holes.iter().for_each(|&hole| module.classes[hole] = HOLE_CLASS);
            leave_out_over_holes(&mut module);
            let triangles = module.objects.canopies.iter().map(|canopy| canopy.triangles.len()).sum::<usize>();
            (module.objects.prisms.len(), triangles)
        };
        assert_eq!(standing(&[]), (1, 2));
        assert_eq!(standing(&[0, 2, 3]), (1, 1));
        assert_eq!(standing(&[1]), (0, 1));
        assert_eq!(standing(&[0, 1, 2, 3]), (0, 0));
    }
}
