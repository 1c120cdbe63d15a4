//! From a file's coordinates to those of the area: what is not on the Earth is left out, what is far away is cut off
//! before it is projected, and what is left is cut at the bounds.

use std::path::Path;
use std::sync::Arc;

use super::clip::{self, Extent, Vertex};
use super::model::{Done, FeatureFile, Remark, Tags, VectorFeature, VectorShape, Vertices, Wanted};
use super::raw::{Part, RawFeature};
use super::seen::{between, seen_in};
use crate::crs::Crs;
use crate::limits::{Allowance, HEIGHT_M_MAX, REMARKS_MAX, VERTEX_BYTES};
use crate::polygons::pieces_of;
use crate::{SourceError, short};

/// Whether most places can only be degrees; what nothing is said about is taken for WGS 84 then.
pub(super) fn look_like_degrees(vertices: impl Iterator<Item = Vertex>) -> bool {
    let is_degrees = |[east, north, _]: Vertex| east.abs() <= 360.0 && north.abs() <= 90.0;
    let (all, degrees) =
        vertices.fold((0_u64, 0_u64), |(all, degrees), vertex| (all + 1, degrees + u64::from(is_degrees(vertex))));
    all < 2 * degrees
}

/// Brings features to the area.
pub(super) struct Placing {
    area: Crs,
    bounds: Extent,
    /// The file's system.
    source: Crs,
    /// Whether that is the area's because the file names none.
    is_assumed: bool,
    is_same: bool,
    /// What of the file's coordinates is projected at all.
    near: Extent,
    /// Where the features of the file lie, in its coordinates.
    lies: Extent,
    height_unit_m: f64,
    /// Whether points are placed.
    points: bool,
    remarks_beyond: u64,
    /// Lines and polygons with a vertex that is not on the Earth.
    off_the_earth: u64,
    /// Lines and polygons that are none, and what was found of the first.
    unsound: (u64, Option<String>),
    /// Features of a shape that is not read, and what was found of the first.
    unread: (u64, Option<String>),
    /// Of the whole file, whose parts share it.
    allowance: Arc<Allowance>,
    file: FeatureFile,
}

impl Placing {
    /// For a file of so many bytes in the system `said`, or in the area's own.
    pub(super) fn new(path: &Path, file_bytes: u64, wanted: &Wanted, said: Option<Crs>) -> Result<Self, SourceError> {
        let refused = |found: String| SourceError::PolygonCrs { path: path.into(), found, expected: wanted.epsg };
        let area = Crs::from_epsg(wanted.epsg).map_err(refused)?;
        let is_assumed = said.is_none();
        let source = said.unwrap_or_else(|| area.clone());
        let is_same = source == area;
        let near = if is_same { wanted.bounds } else { seen_in(&area, &source, &wanted.bounds) };
        let height_unit_m = source.vertical_unit_m().unwrap_or(1.0);
        let mut file = FeatureFile::default();
        file.notes.extend(source.remark().filter(|_| !is_same).map(|remark| format!("{}: {remark}", source.name())));
        Ok(Self {
            area,
            bounds: wanted.bounds,
            source,
            is_assumed,
            is_same,
            near,
            lies: Extent::NOTHING,
            height_unit_m,
            points: wanted.points,
            remarks_beyond: 0,
            off_the_earth: 0,
            unsound: (0, None),
            unread: (0, None),
            allowance: Arc::new(Allowance::new(path, file_bytes)),
            file,
        })
    }

    /// For a part of the same file, to be placed elsewhere.
    pub(super) fn of_part(&self) -> Self {
        Self {
            area: self.area.clone(),
            source: self.source.clone(),
            lies: Extent::NOTHING,
            remarks_beyond: 0,
            off_the_earth: 0,
            unsound: (0, None),
            unread: (0, None),
            allowance: self.allowance.clone(),
            file: FeatureFile::default(),
            ..*self
        }
    }

    /// What the file may take.
    pub(super) fn allowance(&self) -> &Arc<Allowance> {
        &self.allowance
    }

    /// Takes over what was placed of the next part of the file.
    pub(super) fn append(&mut self, part: Self) {
        self.lies_over(&part.lies);
        self.remarks_beyond += part.remarks_beyond;
        self.off_the_earth += part.off_the_earth;
        self.unsound.0 += part.unsound.0;
        self.unsound.1 = self.unsound.1.take().or(part.unsound.1);
        self.unread.0 += part.unread.0;
        self.unread.1 = self.unread.1.take().or(part.unread.1);
        let FeatureFile { mut features, remarks, notes, found, outside, attribution: _, buildings: _ } = part.file;
        self.file.features.append(&mut features);
        self.file.notes.extend(notes);
        self.count_outside(outside);
        self.file.found += found - outside;
        for Remark { id, at, found, done } in remarks {
            self.remark(&id, at, found, done);
        }
    }

    /// What of the file's coordinates lies within `metres` of the bounds.
    pub(super) fn within(&self, metres: f64) -> Extent {
        let bounds = self.bounds.grown(metres);
        if self.is_same { bounds } else { seen_in(&self.area, &self.source, &bounds) }
    }

    /// Whether something with this extent may lie near the area.
    #[cfg(feature = "geoparquet")]
    pub(super) fn is_near(&self, extent: &Extent) -> bool {
        self.turns(extent).next().is_some()
    }

    /// Whether a shape may lie near the area, or has something that is to be told; counts one that does not.
    #[cfg(feature = "geoparquet")]
    pub(super) fn is_shape_near(&mut self, shape: &super::raw::RawShape) -> bool {
        let extent = Extent::around(shape.vertices().map(|&[east, north, _]| [east, north]));
        let is_odd = shape.parts.is_empty() || shape.vertices().any(|vertex| !self.is_on_earth(vertex));
        if is_odd || self.is_near(&extent) {
            return true;
        }
        self.lies_over(&extent);
        self.count_outside(1);
        false
    }

    /// Tells where things of the file lie that are not placed.
    pub(super) fn lies_over(&mut self, extent: &Extent) {
        if !extent.is_empty() {
            self.lies.hold([extent.east[0], extent.north[0]]);
            self.lies.hold([extent.east[1], extent.north[1]]);
        }
    }

    /// Counts features that are not placed because they lie outside.
    pub(super) fn count_outside(&mut self, count: u64) {
        self.file.found += count;
        self.file.outside += count;
    }

    /// Counts a feature that is left out before it is placed.
    pub(super) fn count_left_out(&mut self) {
        self.file.found += 1;
    }

    /// Tells of a feature, counted already, that is no line or polygon in numbers.
    pub(super) fn leave_out(&mut self, id: &str, found: String) {
        self.remark(id, None, found.clone(), LEFT_OUT);
        self.unsound.1.get_or_insert(found);
        self.unsound.0 += 1;
    }

    /// Tells of a feature whose shape cannot be read.
    pub(super) fn unread(&mut self, id: &str, found: String) {
        self.unread.0 += 1;
        self.unread.1.get_or_insert_with(|| found.clone());
        self.remark(id, None, found, LEFT_OUT);
    }

    /// Where a vertex of the file lies, for remarks.
    pub(super) fn at(&self, vertex: &Vertex) -> Option<[f64; 2]> {
        let place = [vertex[0], vertex[1]];
        if self.is_same { Some(place) } else { self.source.to(&self.area, place) }
    }

    pub(super) fn note(&mut self, note: String) {
        self.file.notes.push(note);
    }

    pub(super) fn remark(&mut self, id: &str, at: Option<[f64; 2]>, found: String, done: Done) {
        if self.file.remarks.len() < REMARKS_MAX {
            self.file.remarks.push(Remark { id: id.into(), at, found, done });
        } else {
            self.remarks_beyond += 1;
        }
    }

    /// Places a feature, as long as the file may take more; [`Placing::finish`] refuses the file if it may not.
    pub(super) fn place(&mut self, feature: RawFeature) {
        if self.allowance.is_spent() {
            return;
        }
        let RawFeature { id, tags, mut shape } = feature;
        if !self.points {
            let all = shape.parts.len();
            shape.parts.retain(|part| !matches!(part, Part::Point(_)));
            if shape.parts.len() < all {
                shape.other = shape.other.or(Some("Point"));
            }
        }
        if let Some(other) = shape.other {
            if other != "Point" {
                self.unread.0 += 1;
                self.unread.1.get_or_insert_with(|| format!("a {other}"));
            }
            let done = if shape.parts.is_empty() { "left out" } else { "left out, its lines and polygons kept" };
            let found = format!("a {other}, where lines and polygons are read");
            self.remark(&id, None, found, Done::LeftOut(done));
        }
        if shape.parts.is_empty() {
            return;
        }
        self.file.found += 1;
        if let Some(vertex) = shape.vertices().find(|vertex| !self.is_on_earth(vertex)) {
            let [east, north] = [vertex[0], vertex[1]].map(short);
            if vertex[0].is_nan() || vertex[1].is_nan() {
                return self.leave_out(&id, format!("a vertex at {east}, {north}, expected two numbers"));
            }
            let found = format!("a vertex at {east}, {north}, which is not on the Earth");
            self.off_the_earth += 1;
            return self.remark(&id, None, found, LEFT_OUT);
        }
        if self.source.is_geographic() {
            shape.parts.iter_mut().for_each(Part::unwrap);
        }
        let extent = Extent::around(shape.vertices().map(|&[east, north, _]| [east, north]));
        self.lies_over(&extent);
        if self.turns(&extent).next().is_none() {
            return self.count_one_outside();
        }
        let mut placed = Vec::new();
        let parts: Vec<Part> = shape.parts.into_iter().filter_map(|part| self.sound(&id, part)).collect();
        if parts.is_empty() {
            return;
        }
        for part in parts {
            match self.part_in_any_turn(part) {
                Some(mut shapes) => placed.append(&mut shapes),
                None => {
                    let found = "a vertex that the area's coordinate system cannot express".into();
                    return self.remark(&id, None, found, LEFT_OUT);
                }
            }
        }
        if placed.is_empty() {
            return self.count_one_outside();
        }
        let heights = if shape.has_heights { self.heights(&id, &placed) } else { None };
        self.keep(id, tags, placed, heights);
    }

    fn count_one_outside(&mut self) {
        self.file.outside += 1;
    }

    /// Whether numbers can be a place at all.
    fn is_on_earth(&self, &[east, north, _]: &Vertex) -> bool {
        match self.source.is_geographic() {
            true => east.abs() <= 540.0 && north.abs() <= 90.0,
            false => east.abs() <= PLACE_MAX && north.abs() <= PLACE_MAX,
        }
    }

    /// By how many degrees of longitude something is to be turned so that it may meet what is near, mostly none.
    fn turns(&self, extent: &Extent) -> impl Iterator<Item = f64> {
        let turns: &[f64] = if self.source.is_geographic() { &[0.0, -360.0, 360.0] } else { &[0.0] };
        let (near, extent) = (self.near, *extent);
        let meets =
            move |by: &f64| near.meets(&Extent { east: extent.east.map(|east| east + by), north: extent.north });
        turns.iter().copied().filter(meets)
    }

    /// What of a part lies inside the bounds, turned so that some does; `None` where it cannot be projected. Parts of a
    /// feature may lie on both sides of the 180th meridian, and one of them round the Earth.
    fn part_in_any_turn(&self, part: Part) -> Option<Vec<Part>> {
        let extent = Extent::around(part.runs().flatten().map(|&[east, north, _]| [east, north]));
        let (mut left, mut turns) = (Some(part), self.turns(&extent).peekable());
        while let Some(by) = turns.next() {
            let mut turned = if turns.peek().is_some() { left.clone()? } else { left.take()? };
            if by != 0.0 {
                turned.turn(by);
            }
            let found = self.part(turned)?;
            if !found.is_empty() {
                return Some(found);
            }
        }
        Some(Vec::new())
    }

    /// What of a part lies inside the bounds; `None` where it cannot be projected.
    fn part(&self, part: Part) -> Option<Vec<Part>> {
        match part {
            Part::Point(vertex) => {
                let placed = if self.is_same { vertex } else { self.one_projected(vertex)? };
                let is_inside = self.bounds.holds([placed[0], placed[1]]);
                Some(is_inside.then_some(Part::Point(placed)).into_iter().collect())
            }
            Part::Line(line) => {
                let mut pieces = Vec::new();
                for piece in clip::line(line, &self.near) {
                    pieces.extend(clip::line(self.projected(piece)?, &self.bounds).into_iter().map(Part::Line));
                }
                Some(pieces)
            }
            Part::Polygon(rings) => {
                let mut kept = Vec::with_capacity(rings.len());
                for (index, ring) in rings.into_iter().enumerate() {
                    let cut = match clip::ring(ring, &self.near) {
                        Some(ring) => clip::ring(self.projected(ring)?, &self.bounds),
                        None => None,
                    };
                    match cut {
                        Some(ring) => kept.push(ring),
                        // Without its outer ring there is nothing to have holes.
                        None if index == 0 => return Some(Vec::new()),
                        None => {}
                    }
                }
                Some(vec![Part::Polygon(kept)])
            }
        }
    }

    /// Vertices in the area's system. Long segments get vertices between, since what is straight in one system is not
    /// in the other; they lie at the same places whichever way the segment is digitised.
    fn projected(&self, vertices: Vec<Vertex>) -> Option<Vec<Vertex>> {
        if self.is_same {
            return Some(vertices);
        }
        let mut placed = Vec::with_capacity(vertices.len());
        for (index, &vertex) in vertices.iter().enumerate() {
            if 0 < index {
                let before = vertices[index - 1];
                let pieces = pieces_of(&self.source, [before[0], before[1]], [vertex[0], vertex[1]]);
                for step in 1..pieces {
                    placed.push(self.one_projected(between(before, vertex, step, pieces))?);
                }
            }
            placed.push(self.one_projected(vertex)?);
        }
        Some(placed)
    }

    fn one_projected(&self, [east, north, height]: Vertex) -> Option<Vertex> {
        let [east, north] = self.source.to(&self.area, [east, north])?;
        Some([east, north, height])
    }

    /// The unit of the heights of a feature that has some; tells those that are no heights. Those of points are not
    /// looked at.
    fn heights(&mut self, id: &str, parts: &[Part]) -> Option<f64> {
        let unit_m = self.height_unit_m;
        let all = parts.iter().filter(|part| !matches!(part, Part::Point(_))).flat_map(Part::runs).flatten();
        let wrong: Vec<Vertex> = all.clone().filter(|vertex| height_m(vertex, unit_m).is_none()).copied().collect();
        let count = all.count();
        if let Some(first) = wrong.first() {
            let found = format!("{} of {count} heights that are none, the first {}", wrong.len(), first[2]);
            self.remark(id, Some([first[0], first[1]]), found, Done::Kept("left without a height there"));
        }
        (wrong.len() < count).then_some(unit_m)
    }

    fn keep(&mut self, id: String, tags: Tags, mut parts: Vec<Part>, unit_m: Option<f64>) {
        let vertices: usize = parts.iter().flat_map(Part::runs).map(<[Vertex]>::len).sum();
        // Each part has tags of its own.
        self.allowance.count(parts.len() * (128 + 32 * tags.len()) + vertices * VERTEX_BYTES);
        let vertices = |run: Vec<Vertex>| Vertices {
            heights_m: unit_m.map_or_else(Vec::new, |unit_m| run.iter().map(|v| height_m(v, unit_m)).collect()),
            places: run.into_iter().map(|[east, north, _]| [east, north]).collect(),
        };
        let shape = |part: Part| match part {
            Part::Point([east, north, _]) => VectorShape::Point([east, north]),
            Part::Line(line) => VectorShape::Line(vertices(line)),
            Part::Polygon(rings) => VectorShape::Polygon(rings.into_iter().map(vertices).collect()),
        };
        if parts.len() == 1 {
            let shape = shape(parts.remove(0));
            return self.file.features.push(VectorFeature { id, tags, shape });
        }
        for (part, number) in parts.into_iter().zip(1..) {
            let id = format!("{id}.{number}");
            self.file.features.push(VectorFeature { id, tags: tags.clone(), shape: shape(part) });
        }
    }

    /// What was placed, and nothing of what was told.
    pub(super) fn into_features(self) -> Vec<VectorFeature> {
        self.file.features
    }

    /// What was placed, with a word where that is nothing.
    ///
    /// # Errors
    /// When that takes more than the file may.
    pub(super) fn finish(mut self, attribution: Option<&'static str>) -> Result<FeatureFile, SourceError> {
        self.allowance.check()?;
        if self.is_assumed && 0 < self.file.found {
            let (names_none, metres) = ("it names no coordinate system", format!("metres of {}", self.area.name()));
            let note =
                format!("{names_none} and its numbers are no degrees: they are taken for {metres}; crs names another");
            self.file.notes.insert(0, note);
        }
        if 0 < self.remarks_beyond {
            self.file.notes.push(format!("{} more remarks about single features", self.remarks_beyond));
        }
        if 0 < self.off_the_earth {
            let (count, found) = (self.off_the_earth, self.file.found);
            let note = format!("{count} of its {found} lines and polygons reach beyond the Earth and are left out");
            self.file.notes.push(note);
        }
        if let (count, Some(first)) = &self.unsound {
            let found = self.file.found;
            let note = format!("{count} of its {found} lines and polygons are left out; the first has {first}");
            self.file.notes.push(note);
        }
        if let (count, Some(first)) = &self.unread {
            let note = format!(
                "{count} of its features are left out, as their shapes are not read; the first has {first}; \
                lines and polygons come of most: ogr2ogr -nlt CONVERT_TO_LINEAR out.gpkg in.…"
            );
            self.file.notes.push(note);
        }
        if self.file.found == 0 {
            self.file.notes.push("no line or polygon in the file".into());
        } else if self.file.features.is_empty() && 0 < self.file.outside {
            let (lies, bounds) = (self.text(&self.source, &self.lies), self.text(&self.area, &self.bounds));
            let place = if self.lies.is_empty() { "nowhere on the Earth".into() } else { lies };
            let found = self.file.found;
            // OpenStreetMap data is in degrees, whatever else is said of it.
            let hint = if attribution.is_some() { "" } else { "; if the file is in another system, name it with crs" };
            self.file.notes.push(format!(
                "none of its {found} lines and polygons lies inside the area: they lie {place}; the area and one load \
                module round it {bounds}{hint}"
            ));
        }
        self.file.features.shrink_to_fit();
        self.file.attribution = attribution;
        Ok(self.file)
    }

    fn text(&self, crs: &Crs, Extent { east, north }: &Extent) -> String {
        let digits = if crs.is_geographic() { 4 } else { 0 };
        let numbers = [east[0], north[0], east[1], north[1]].map(|number| format!("{number:.digits$}"));
        let [west, south, east, north] = numbers;
        format!("from {west}, {south} to {east}, {north} ({})", crs.name())
    }
}

/// What is done with a feature that cannot be used.
pub(super) const LEFT_OUT: Done = Done::LeftOut("left out");
/// Metres, or feet, that no coordinate on the Earth exceeds in any system.
const PLACE_MAX: f64 = 4.0e8;

fn height_m(vertex: &Vertex, unit_m: f64) -> Option<f64> {
    let height_m = vertex[2] * unit_m;
    (height_m.abs() <= HEIGHT_M_MAX).then_some(height_m)
}
