//! Points that a job gives: what tiles start from, and pins.
//!
//! A given point is a post of the working grid. It belongs to the tile that may choose there, so that tiles that share
//! a line agree on it as on any border point; heights given for posts on lines hold on both sides.

use std::path::Path;

use job::{Choice, Job, NamedFile, OuterBorder, Start, StartMethod};
use source_files::{GivenFeature, GivenShape, RasterFrame, read_given, short};
use terrain::{Dem, Importance, Metres, Post, PostRect, THOUSANDTHS, TileId, metres_of_quanta, quanta_of_metres};
use tin::StartPost;
use tin::methods::{
    Boundary, Contours, DemWindow, Diagonal, Distance, Extrema, FowlerLittle, Impossible, LatticeTin, Splitting,
};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::excluded::{GamingAreaFrame, excluded, inside};
use crate::ground::relief::Relief;

/// A post that the job gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct GivenPost {
    /// Where.
    pub at: Post,
    /// Whether it is in whatever limits say.
    pub pinned: bool,
    /// Whether it is on a fixed outer border of the area, where nothing else is chosen.
    pub outer: bool,
    /// The height it is to have, in quanta; the ground's where none is given.
    pub height: Option<i32>,
}

/// A height that a file gives.
struct HeightTold {
    at: Post,
    quanta: i32,
    /// The file, and where in it.
    place: String,
}

/// What a job gives for its whole area.
#[derive(Default)]
pub struct Given {
    start: Option<(StartMethod, u64)>,
    /// Whether the outer border has a point every border step and no others.
    outer_is_fixed: bool,
    posts: Vec<GivenPost>,
    /// Where the heights of posts come from, in the order of these.
    heights: Vec<HeightTold>,
    forbidden: Vec<Post>,
    /// Weights are multiplied by so many thousandths inside polygons.
    factors: Vec<(terrain::mask::Polygon, u32)>,
    /// Polygons in which nothing is chosen.
    excluded: Vec<terrain::mask::Polygon>,
}

impl Given {
    /// Posts on a fixed outer border of the area.
    pub fn outer_posts(&self) -> impl Iterator<Item = Post> {
        border_posts(&self.posts)
    }

    /// Reads what the job names.
    ///
    /// # Errors
    /// When a file cannot be used, or a point of it lies where it may not.
    pub fn open(job: &Job, area: &GamingArea) -> Result<Self, GroundError> {
        let outer_is_fixed = job.modules.outer_border == OuterBorder::Fixed;
        let mut given = Self { outer_is_fixed, ..Self::default() };
        if let Some(file) = &job.tin.pins {
            given.add_pins(job, area, file)?;
        }
        match &job.tin.start {
            Some(Start::Method { method, points }) => given.start = Some((*method, points.unwrap_or(0))),
            Some(Start::File(file)) => {
                given.add_start(job, area, file)?;
            }
            None => {}
        }
        given.refuse_forbidden(job)?;
        // Of two that give one post, one with a height comes before one without, pins before points to start from, and
        // the first of a file before later ones.
        given.posts.sort_by_key(|post| (post.at, !post.pinned, post.height.is_none()));
        given.posts.dedup_by_key(|post| post.at);
        given.heights.sort_by_key(|told| told.at);
        given.heights.dedup_by_key(|told| told.at);
        given.forbidden.sort_unstable();
        Ok(given)
    }

    /// What a person should know of heights that files give: which lies farthest off the ground there, where that is
    /// farther than a surface without mistakes leaves its sources. Nothing is known of the sample terrain's.
    ///
    /// # Errors
    /// When the source cannot be read.
    pub fn far_off(&self, area: &GamingArea, relief: &Relief) -> Result<Option<String>, GroundError> {
        let Some(bounds) = relief.bounds else { return Ok(None) };
        let most_m = bounds.far_m();
        let mut far = Vec::new();
        for &tile in &area.tiles {
            // A tile's posts on lines are also its neighbours'.
            let rect = area.tiling.rect(tile);
            let here: Vec<&HeightTold> = self.heights.iter().filter(|told| rect.contains(told.at)).collect();
            if here.is_empty() {
                continue;
            }
            let dem = relief.dem(rect)?;
            let off_m = |told: &HeightTold| metres_of_quanta(told.quanta) - metres_of_quanta(dem.height(told.at));
            let known = here.into_iter().filter(|told| !dem.is_void(told.at));
            far.extend(known.map(|told| (off_m(told), told)).filter(|(off_m, _)| most_m < off_m.abs()));
        }
        far.sort_by(|(a, told), (b, other)| b.abs().total_cmp(&a.abs()).then(told.at.cmp(&other.at)));
        far.dedup_by_key(|(_, told)| told.at);
        Ok(far.first().map(|(off_m, told)| {
            let height_m = metres_of_quanta(told.quanta);
            let way = if *off_m < 0.0 { "below" } else { "above" };
            let others = match far.len() - 1 {
                0 => String::new(),
                others => format!("; {others} more heights lie as far off"),
            };
            format!("{}: a height of {height_m:.2} m, {:.2} m {way} the ground there{others}", told.place, off_m.abs())
        }))
    }

    /// Which heights that files give lie on roads or in water, whose own heights hold: the first, and how many.
    /// `classes_at` tells the classes of the features at posts of a tile.
    ///
    /// # Errors
    /// Those of `classes_at`.
    pub fn on_features<E>(
        &self,
        area: &GamingArea,
        names: &[String],
        classes_at: impl Fn(TileId, &[Post]) -> Result<Vec<Option<u8>>, E>,
    ) -> Result<Option<String>, E> {
        let is_free = |told: &&HeightTold| !(self.outer_is_fixed && area.rect.has_on_border(told.at));
        let mut left: Vec<&HeightTold> = self.heights.iter().filter(is_free).collect();
        let mut found = Vec::new();
        for &tile in &area.tiles {
            let rect = area.tiling.rect(tile);
            let (here, others) = left.into_iter().partition::<Vec<_>, _>(|told| rect.contains(told.at));
            left = others;
            if !here.is_empty() {
                let posts: Vec<Post> = here.iter().map(|told| told.at).collect();
                let classes = classes_at(tile, &posts)?;
                found.extend(here.into_iter().zip(classes).filter_map(|(told, class)| Some((told, class?))));
            }
        }
        let first = found.iter().min_by_key(|(told, _)| told.at);
        Ok(first.map(|(told, class)| {
            let name = names.get(usize::from(*class)).map_or("a class", String::as_str);
            let (place, height_m) = (&told.place, metres_of_quanta(told.quanta));
            let all = if found.len() == 1 { String::new() } else { format!("; {} such heights in all", found.len()) };
            format!("{place}: a height of {height_m:.2} m lies on {name}, whose own height holds there{all}")
        }))
    }

    /// Keeps in mind a post that a file gives.
    fn add(&mut self, path: &Path, feature: &GivenFeature, post: GivenPost) {
        let place = || format!("{}: {}", path.display(), feature.place);
        self.heights.extend(post.height.map(|quanta| HeightTold { at: post.at, quanta, place: place() }));
        self.posts.push(post);
    }

    fn add_start(&mut self, job: &Job, area: &GamingArea, file: &NamedFile) -> Result<(), GroundError> {
        for feature in read_given(&file.path, job.area.epsg)? {
            let GivenShape::Point(at) = feature.shape else {
                return Err(wrong(&file.path, &feature, "a polygon", "points to start from"));
            };
            let at = Lattice::of_area(area).post(&file.path, &feature, at)?;
            let height = height_of(&file.path, &feature)?;
            // What stands at a height of its own is fixed, as is a point on the outer border.
            let outer = is_on_fixed_border(job, area, at);
            self.add(&file.path, &feature, GivenPost { at, pinned: outer || height.is_some(), outer, height });
        }
        Ok(())
    }

    fn add_pins(&mut self, job: &Job, area: &GamingArea, file: &NamedFile) -> Result<(), GroundError> {
        for feature in read_given(&file.path, job.area.epsg)? {
            let height = height_of(&file.path, &feature)?;
            match (feature.pin.as_deref(), feature.shape.clone()) {
                (Some("add"), GivenShape::Point(at)) => {
                    let at = Lattice::of_area(area).post(&file.path, &feature, at)?;
                    let outer = is_on_fixed_border(job, area, at);
                    self.add(&file.path, &feature, GivenPost { at, pinned: true, outer, height });
                }
                (Some("height"), GivenShape::Point(at)) => {
                    if height.is_none() {
                        let wrong = wrong(&file.path, &feature, "a height pin without height_m", "height_m in metres");
                        let hint = "say how high: \"properties\": { \"pin\": \"height\", \"height_m\": 712.5 }";
                        return Err(hinted(wrong, hint));
                    }
                    let at = Lattice::of_area(area).post(&file.path, &feature, at)?;
                    let outer = is_on_fixed_border(job, area, at);
                    self.add(&file.path, &feature, GivenPost { at, pinned: true, outer, height });
                }
                (Some("forbid"), GivenShape::Point(at)) => {
                    let at = Lattice::of_area(area).post(&file.path, &feature, at)?;
                    refuse_fixed(job, area, file, &feature, at)?;
                    self.forbidden.push(at);
                }
                (Some("importance"), GivenShape::Polygon(polygon)) => {
                    self.factors.push((polygon, factor_of(&file.path, &feature)?));
                }
                (Some("exclude"), GivenShape::Polygon(polygon)) => self.excluded.push(polygon),
                (pin, shape) => {
                    let shape = if matches!(shape, GivenShape::Point(_)) { "point" } else { "polygon" };
                    let found =
                        pin.map_or(format!("a {shape} without pin"), |pin| format!("a {shape} with pin {pin:?}"));
                    let expected =
                        "a point with \"add\", \"forbid\" or \"height\", a polygon with \"importance\" or \"exclude\"";
                    let hint = match shape {
                        "point" => "say what the point is for: \"properties\": { \"pin\": \"add\" }",
                        _ => "say what the polygon is for: \"properties\": { \"pin\": \"importance\", \"factor\": 4 }",
                    };
                    return Err(hinted(wrong(&file.path, &feature, &found, expected), hint));
                }
            }
        }
        // No pin comes before another, and those of one post stand side by side then.
        self.heights.sort_by_key(|told| told.at);
        let differ = |pair: &&[HeightTold]| pair[0].at == pair[1].at && pair[0].quanta != pair[1].quanta;
        self.heights.windows(2).find(differ).map_or(Ok(()), |pair| {
            let [one, other] = [0, 1].map(|index| metres_of_quanta(pair[index].quanta));
            Err(GroundError::Impossible {
                key: pair[1].place.clone(),
                found: format!(
                    "a height of {other:.2} m at post {}, where {} has {one:.2} m",
                    pair[0].at, pair[0].place
                ),
                expected: "one height for a post".into(),
                hint: "remove one of the pins; each is at the post nearest to it".into(),
            })
        })
    }

    /// Refuses to forbid what is given.
    fn refuse_forbidden(&self, job: &Job) -> Result<(), GroundError> {
        let both = self.posts.iter().find(|post| post.pinned && self.forbidden.contains(&post.at));
        both.map_or(Ok(()), |both| {
            let file = job.tin.pins.as_ref().map_or("", |file| &file.written);
            Err(GroundError::Impossible {
                key: format!("tin.pins: {file}"),
                found: format!("a point to add and a point to forbid at post {}", both.at),
                expected: "one of the two".into(),
                hint: "remove one of the pins".into(),
            })
        })
    }

    /// Pinned posts of the area, in ascending order.
    pub fn pinned(&self) -> Vec<Post> {
        self.posts.iter().filter(|post| post.pinned).map(|post| post.at).collect()
    }

    /// Posts of a rectangle that no vertex may come nearer to than to any other, in ascending order: those that pins
    /// forbid, and those that keep vertices out of polygons.
    pub fn forbidden(&self, area: &GamingAreaFrame, rect: PostRect) -> Vec<Post> {
        let mut posts = excluded(&self.excluded, area, rect);
        posts.extend(self.forbidden.iter().filter(|&&post| rect.contains(post)));
        posts.sort_unstable();
        posts.dedup();
        posts
    }

    /// Weights with what pins say of them.
    pub fn weigh(&self, importance: Importance, area: &GamingAreaFrame) -> Importance {
        if self.forbidden.is_empty() && self.factors.is_empty() && self.excluded.is_empty() {
            return importance;
        }
        let rect = importance.rect();
        let mut weights: Vec<u32> = rect.posts().map(|post| u32::from(importance.weight(post))).collect();
        for (polygon, factor) in &self.factors {
            let inside = inside(polygon, area, rect);
            for (weight, _) in weights.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
                let scaled = u64::from(*weight) * u64::from(*factor) / u64::from(THOUSANDTHS);
                // What mattered still does, however small the factor.
                *weight = scaled.clamp(u64::from(0 < *weight), u64::from(u16::MAX)) as u32;
            }
        }
        for polygon in &self.excluded {
            let inside = inside(polygon, area, rect);
            weights.iter_mut().zip(inside).filter(|(_, inside)| *inside).for_each(|(weight, _)| *weight = 0);
        }
        let weights = rect
            .posts()
            .zip(weights)
            .map(|(post, weight)| if self.forbidden.binary_search(&post).is_ok() { 0 } else { weight as u16 });
        let classes = rect.posts().map(|post| importance.class(post)).collect();
        Importance::new(rect, weights.collect(), classes)
    }

    /// What a tile is given: all posts with heights on its ground, and those to start from that are its own to choose.
    ///
    /// # Errors
    /// When the method to start from cannot make the tile's share of points.
    pub fn of_tile(&self, area: &GamingArea, tile: TileId, dem: &Dem) -> Result<Vec<GivenPost>, GroundError> {
        let rect = area.tiling.rect(tile);
        let place = GamingAreaFrame { rect: area.rect, frame: area.frame };
        let barred = self.forbidden(&place, rect);
        let is_barred = |at: Post| barred.binary_search(&at).is_ok();
        let mut found: Vec<GivenPost> = self.posts.iter().copied().filter(|post| rect.contains(post.at)).collect();
        // A pin says more than a point to start from does.
        found.retain(|post| post.pinned || !is_barred(post.at));
        if let Some((method, points)) = self.start {
            let modules = area.tiling.modules(tile, area.grid).count() as u64;
            let share = (points * modules).div_ceil(area.grid.count() as u64) as usize;
            let spacing = Metres(area.frame.spacing.metres());
            let chosen =
                chosen(&DemWindow { dem, spacing }, method, share).map_err(|why| refused("tin.start", method, why))?;
            let known: std::collections::HashSet<Post> = found.iter().map(|post| post.at).collect();
            // A fixed outer border has its own points.
            let is_fixed = |at: Post| self.outer_is_fixed && area.rect.has_on_border(at);
            let fresh = chosen.into_iter().filter(|&at| !known.contains(&at) && !is_fixed(at) && !is_barred(at));
            found.extend(fresh.map(|at| GivenPost { at, pinned: false, outer: false, height: None }));
        }
        Ok(found)
    }
}

/// The posts that a method chooses on a window, in its order, corners left out.
pub fn chosen(ground: &DemWindow, method: StartMethod, points: usize) -> Result<Vec<Post>, Impossible> {
    let rect = ground.dem.rect();
    // Four of a method's points are the corners, which every tile has.
    let count = (points + 4).min(rect.post_count());
    let tin = match method {
        StartMethod::Vip => tin::methods::vip(ground, count, Distance::Perpendicular, Boundary::CornersOnly)?,
        StartMethod::HighLow => tin::methods::highlow(ground, Extrema::Strict)?,
        StartMethod::Lattice => {
            let step = tin::methods::step_of_points(rect, (count / 2).max(4)).max(16);
            tin::methods::lattice_tin(ground, &LatticeTin { step, ..LatticeTin::of_points(count) })?
        }
        StartMethod::FowlerLittle => tin::methods::fowler_little(ground, &FowlerLittle::of_points(count))?,
        StartMethod::Hierarchical => tin::methods::hierarchical(ground, count, Splitting::MaxError)?.cut(count),
        StartMethod::Earlier => tin::methods::earlier(ground, count)?,
        StartMethod::Regular => {
            tin::methods::regular_grid(ground, tin::methods::step_of_points(rect, count), Diagonal::Fixed)?
        }
        StartMethod::Contour => tin::methods::contour_tin(ground, Contours::Points(count), None)?,
    };
    let corners = rect.corners();
    Ok(tin.vertices.iter().filter_map(|vertex| vertex.at.post()).filter(|post| !corners.contains(post)).collect())
}

/// What a method says no to, as an error of the key or argument that asks it.
pub fn refused(key: &str, method: StartMethod, why: Impossible) -> GroundError {
    GroundError::Impossible {
        key: format!("{key}, method {}", method.name()),
        found: why.found,
        expected: why.expected,
        hint: why.hint,
    }
}

/// Of a tile's given posts those that it starts from, in their order: not those that its neighbours choose.
pub fn start_posts(given: &[GivenPost], rect: PostRect, open: terrain::SeamSides) -> Vec<StartPost> {
    let is_closed = |at: Post| {
        (at.row == rect.south && !open.south)
            || (at.row == rect.north && !open.north)
            || (at.col == rect.west && !open.west)
            || (at.col == rect.east && !open.east)
    };
    given
        .iter()
        .filter(|post| !post.outer && !is_closed(post.at))
        .map(|post| StartPost { at: post.at, pinned: post.pinned })
        .collect()
}

/// Given posts on a fixed outer border of the area.
pub fn border_posts(given: &[GivenPost]) -> impl Iterator<Item = Post> {
    given.iter().filter(|post| post.outer).map(|post| post.at)
}

/// Posts in metres of a map.
struct Lattice {
    /// Those there are.
    rect: PostRect,
    /// Easting and northing of post (0, 0).
    origin_m: [f64; 2],
    spacing_m: f64,
}

impl Lattice {
    fn of_area(area: &GamingArea) -> Self {
        let frame = &area.frame;
        let origin_m = [frame.origin_east_m, frame.origin_north_m];
        Self { rect: area.rect, origin_m, spacing_m: frame.spacing.metres() }
    }

    /// The post nearest to the place of a feature, which must lie among them.
    fn post(&self, path: &Path, feature: &GivenFeature, at: [f64; 2]) -> Result<Post, GroundError> {
        let [col, row] = [0, 1].map(|axis| ((at[axis] - self.origin_m[axis]) / self.spacing_m).round());
        let fits = |v: f64| (-1e9..=1e9).contains(&v);
        let post = (fits(row) && fits(col)).then(|| Post::new(row as i32, col as i32));
        post.filter(|&post| self.rect.contains(post)).ok_or_else(|| {
            let [east, north] = at.map(|metres| short((10.0 * metres).round() / 10.0));
            let found = format!("a point at {east}, {north} m, outside the area");
            wrong(path, feature, &found, "points inside the area, its border included")
        })
    }
}

/// The points of a file to start a mesh of a raster from, each post once, in ascending order; those with a height are
/// fixed at it.
///
/// # Errors
/// When the file cannot be used, or a point of it lies outside the raster.
pub fn posts_of_file(path: &Path, frame: &RasterFrame, rect: PostRect) -> Result<Vec<GivenPost>, GroundError> {
    let epsg = frame.crs.epsg().ok_or_else(|| GroundError::Impossible {
        key: "--start".into(),
        found: "a raster whose coordinate system has no EPSG code".into(),
        expected: "one that places in a file can be brought to".into(),
        hint: "name the system: --crs EPSG:32611 (your own)".into(),
    })?;
    let lattice = Lattice { rect, origin_m: frame.south_west, spacing_m: frame.spacing[0] };
    let mut posts = Vec::new();
    for feature in read_given(path, epsg)? {
        let GivenShape::Point(at) = feature.shape else {
            return Err(wrong(path, &feature, "a polygon", "points to start from"));
        };
        let (at, height) = (lattice.post(path, &feature, at)?, height_of(path, &feature)?);
        posts.push(GivenPost { at, pinned: height.is_some(), outer: false, height });
    }
    posts.sort_by_key(|post| (post.at, !post.pinned));
    posts.dedup_by_key(|post| post.at);
    Ok(posts)
}

fn height_of(path: &Path, feature: &GivenFeature) -> Result<Option<i32>, GroundError> {
    let Some(metres) = feature.height_m else { return Ok(None) };
    let quanta = quanta_of_metres(metres);
    let found = || wrong(path, feature, &format!("a height of {} m", short(metres)), "a height that terrain can have");
    quanta.map(Some).ok_or_else(found)
}

/// The factor of an importance pin, in thousandths.
fn factor_of(path: &Path, feature: &GivenFeature) -> Result<u32, GroundError> {
    const FACTOR_MAX: f64 = 1000.0;
    match feature.factor.map(|factor| (factor * f64::from(THOUSANDTHS)).round()) {
        Some(thousandths) if (1.0..=FACTOR_MAX * f64::from(THOUSANDTHS)).contains(&thousandths) => {
            Ok(thousandths as u32)
        }
        _ => {
            let found = feature.factor.map_or("no factor".to_owned(), |factor| format!("a factor of {factor}"));
            let wrong = wrong(path, feature, &found, "factor from 0.001 to 1000; to leave ground out, \"exclude\"");
            Err(hinted(
                wrong,
                "say how much more it matters: \"properties\": { \"pin\": \"importance\", \"factor\": 4 }",
            ))
        }
    }
}

/// Whether a post lies on an outer border that has a point every border step and no others chosen.
fn is_on_fixed_border(job: &Job, area: &GamingArea, at: Post) -> bool {
    job.modules.outer_border == OuterBorder::Fixed && area.rect.has_on_border(at)
}

/// Refuses to forbid what is a vertex in any case.
fn refuse_fixed(
    job: &Job,
    area: &GamingArea,
    file: &NamedFile,
    feature: &GivenFeature,
    at: Post,
) -> Result<(), GroundError> {
    let side = area.grid.side_cells;
    let is_corner = at.row % side == 0 && at.col % side == 0;
    let step = job.outer_step_cells();
    let on_border = area.rect.has_on_border(at) && at.row % step == 0 && at.col % step == 0;
    let fixed = match (is_corner, on_border) {
        (true, _) => "a corner of load modules",
        (_, true) => "a point of the outer border",
        _ => return Ok(()),
    };
    Err(wrong(&file.path, feature, &format!("a forbidden post, {at}, that is {fixed}"), "another"))
}

/// `error` with another hint.
fn hinted(error: GroundError, hint: &str) -> GroundError {
    match error {
        GroundError::Impossible { key, found, expected, .. } => {
            GroundError::Impossible { key, found, expected, hint: hint.into() }
        }
        other => other,
    }
}

fn wrong(path: &Path, feature: &GivenFeature, found: &str, expected: &str) -> GroundError {
    GroundError::Impossible {
        key: format!("{}: {}", path.display(), feature.place),
        found: found.into(),
        expected: expected.into(),
        hint: "coordinates are metres of the area's system, or degrees; `tiefort plan` shows the area's corners".into(),
    }
}
