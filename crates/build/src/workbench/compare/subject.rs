//! The ground that methods are compared on.

use std::collections::{HashMap, VecDeque};
use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::CompileError;
use crate::ground::{GamingArea, Ground, GroundError, decode, reading};
use fidelity::Tally;
use job::{DemSource, Job, SourceFile};
use schedule::Workers;
use source_files::{DemFile, VoidPolicy};
use terrain::geometry::WORKING_POSTS_MAX;
use terrain::{Dem, Metres, Post, PostRect, Tin, quanta_of_metres};
use tin::methods::DemWindow;

use super::made::{CompareGround, Equivalent, HeldGround, Made};
use crate::workbench::heights::{Heights, has_square_posts, open_alone};
use crate::workbench::mesh::untiled;
use crate::workbench::request::TinRequest;
use crate::workbench::tally::tally_of;
use crate::workbench::{TinMethod, TinStart};

/// When a TIN is good enough.
#[derive(Clone, Copy, Debug)]
pub(super) enum Until {
    /// With so many points.
    Points(usize),
    /// With such an RMS residual, in metres.
    RmsM(f64),
}

/// The ground that methods are compared on.
pub(super) struct Subject {
    pub dem: Dem,
    pub spacing: Metres,
    /// In words.
    pub name: String,
}

impl Subject {
    /// Reads the ground.
    ///
    /// # Errors
    /// When it cannot be read, or is too large or too small.
    pub fn open(ground: &CompareGround, window: Option<PostRect>, stop: &AtomicBool) -> Result<Self, CompileError> {
        match ground {
            CompareGround::Raster { path, crs } => {
                // Distances are all that matters here.
                let (file, _) = open_alone(path, crs.as_deref())?;
                let name = path.display().to_string();
                match has_square_posts(file.frame()) {
                    true => of_file(&file, windowed(file.rect(), window)?, name, stop),
                    false => of_resampled(&file, window, &name, stop),
                }
            }
            CompareGround::Held(HeldGround { dem, spacing, name }) => {
                let height = |post: Post| (!dem.is_void(post)).then(|| dem.height(post));
                of_heights(windowed(dem.rect(), window)?, *spacing, name.clone(), height)
            }
            CompareGround::Job(job) => of_job(job, window, stop),
        }
    }

    /// As methods want it.
    pub fn ground(&self) -> DemWindow<'_> {
        DemWindow { dem: &self.dem, spacing: self.spacing }
    }

    /// Posts with a height.
    pub fn posts(&self) -> u64 {
        (self.dem.rect().post_count() - self.dem.void_count()) as u64
    }

    /// A TIN of one tile by a method of `tin`.
    ///
    /// # Errors
    /// When the ground cannot be used.
    pub fn refine(&self, method: TinMethod, start: Option<TinStart>, until: Until) -> Result<Tin, CompileError> {
        let request = TinRequest {
            points: if let Until::Points(points) = until { Some(points) } else { None },
            rms_m: if let Until::RmsM(rms_m) = until { Some(rms_m) } else { None },
            start,
            ..TinRequest::plain(Path::new("").into(), method)
        };
        Ok(untiled(&request, &self.dem, [self.spacing.0; 2])?.tin)
    }

    /// What a method made, measured.
    pub fn measure(&self, tin: Tin) -> Made {
        let residual: Tally = tally_of(&self.dem, &tin);
        Made {
            points: tin.vertices.len(),
            triangles: tin.triangles.len(),
            covered: residual.posts,
            residual,
            equivalent: Equivalent::None,
            forced: None,
            tin,
        }
    }
}

/// The ground of a job: the posts of its one raster that lie in its area, or its working grid.
fn of_job(job: &Job, window: Option<PostRect>, stop: &AtomicBool) -> Result<Subject, CompileError> {
    let area = GamingArea::new(job)?;
    if let DemSource::Files { files, .. } = &job.dem.source
        && let [file] = &files[..]
        && let Some((opened, rect)) = own_posts(job, &area, file)?
    {
        let name = format!("posts of {} in the area of {}", file.written, job.area.name);
        return of_file(&opened, windowed(rect, window)?, name, stop);
    }
    let rect = windowed(area.rect, window)?;
    let dem = Ground::open(job, &area, &Workers::new(1), stop)?.window(rect)?.dem;
    let spacing = Metres(area.frame.spacing.metres());
    let name = format!("the working grid of {}", job.area.name);
    of_heights(rect, spacing, name, |post| (!dem.is_void(post)).then(|| dem.height(post)))
}

/// The one raster of a job, if its posts need no projecting, and those in the area.
fn own_posts(job: &Job, area: &GamingArea, file: &SourceFile) -> Result<Option<(DemFile, PostRect)>, CompileError> {
    let opened = DemFile::open(&file.path, &reading(file, false)?)?;
    let frame = opened.frame();
    if frame.require_epsg(job.area.epsg).is_err() || !has_square_posts(frame) {
        return Ok(None);
    }
    let metres = area.frame.spacing.metres();
    let (high, wide) = (area.rect.cells_high() as f64 * metres, area.rect.cells_wide() as f64 * metres);
    let south_west = [area.frame.origin_east_m - frame.south_west[0], area.frame.origin_north_m - frame.south_west[1]];
    let [east, north] = frame.spacing;
    let first = |metres: f64, step: f64| (metres / step).ceil() as i32;
    let last = |metres: f64, step: f64| (metres / step).floor() as i32;
    let (low, high) = (
        Post::new(first(south_west[1], north), first(south_west[0], east)),
        Post::new(last(south_west[1] + high, north), last(south_west[0] + wide, east)),
    );
    if high.row < low.row || high.col < low.col {
        return Ok(None);
    }
    let rect = PostRect::new(low, high).intersection(&opened.rect());
    Ok(rect.map(|rect| (opened, rect)))
}

/// The ground of a raster whose posts are not square ones in metres, on those it is resampled to.
fn of_resampled(
    file: &DemFile,
    window: Option<PostRect>,
    name: &str,
    stop: &AtomicBool,
) -> Result<Subject, CompileError> {
    let Heights { dem, frame, .. } = Heights::of(file, &Workers::new(1), stop)?;
    let rect = windowed(dem.rect(), window)?;
    let name = format!("{name}, resampled to {} m in {}", frame.spacing[0], frame.crs.name());
    of_heights(rect, Metres(frame.spacing[0]), name, |post| (!dem.is_void(post)).then(|| dem.height(post)))
}

fn of_file(file: &DemFile, rect: PostRect, name: String, stop: &AtomicBool) -> Result<Subject, CompileError> {
    let mut raster = decode(file, rect, &Workers::new(1), stop)?;
    raster.settle_voids(VoidPolicy::Hole)?;
    let scale = file.sample_scale();
    of_heights(rect, Metres(file.frame().spacing[0]), name, |post| {
        raster.sample(post).and_then(|sample| quanta_of_metres(scale.height_m(sample)))
    })
}

/// The ground of a window, whose posts are from here on counted from its own corner.
fn of_heights(
    rect: PostRect,
    spacing: Metres,
    name: String,
    height: impl Fn(Post) -> Option<i32>,
) -> Result<Subject, CompileError> {
    let own = PostRect::of_size(rect.posts_high(), rect.posts_wide());
    let mut dem = Dem::from_fn(own, |post| height(Post::new(rect.south + post.row, rect.west + post.col)));
    if dem.void_count() == own.post_count() {
        return Err(GroundError::Impossible {
            key: name,
            found: "no height anywhere".into(),
            expected: "ground to compare on".into(),
            hint: "choose another window".into(),
        }
        .into());
    }
    fill(&mut dem);
    Ok(Subject { dem, spacing, name })
}

/// Sets voids to the height of a post near them, ring by ring, so that what covers them is no cliff.
fn fill(dem: &mut Dem) {
    if dem.void_count() == 0 {
        return;
    }
    let rect = dem.rect();
    let all = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    let mut known: HashMap<Post, i32> = HashMap::new();
    let mut open: VecDeque<(Post, i32)> =
        all.filter(|&post| !dem.is_void(post)).map(|post| (post, dem.height(post))).collect();
    while let Some((post, height)) = open.pop_front() {
        for (rows, cols) in [(-1, 0), (0, -1), (0, 1), (1, 0)] {
            let beside = Post::new(post.row + rows, post.col + cols);
            if rect.contains(beside) && dem.is_void(beside) && !known.contains_key(&beside) {
                known.insert(beside, height);
                open.push_back((beside, height));
            }
        }
    }
    dem.fill_voids(|post| known[&post]);
}

/// The part of the ground that was asked for.
fn windowed(rect: PostRect, window: Option<PostRect>) -> Result<PostRect, CompileError> {
    let (rows, cols) = (rect.posts_high(), rect.posts_wide());
    let impossible = |key: &str, found: String, expected: String, hint: &str| {
        Err(GroundError::Impossible { key: key.into(), found, expected, hint: hint.into() }.into())
    };
    let cut = match window {
        None => rect,
        Some(window) if PostRect::of_size(rows, cols).contains_rect(&window) => PostRect {
            south: rect.south + window.south,
            west: rect.west + window.west,
            north: rect.south + window.north,
            east: rect.west + window.east,
        },
        Some(window) => {
            let found =
                format!("rows {} to {}, columns {} to {}", window.south, window.north, window.west, window.east);
            let expected = format!("a part of the {rows} rows and {cols} columns there are");
            return impossible("--window", found, expected, "rows count from the south, columns from the west, from 0");
        }
    };
    let longest = cut.posts_high().max(cut.posts_wide());
    if WORKING_POSTS_MAX < longest {
        let expected = format!("at most {WORKING_POSTS_MAX} posts a side");
        let found = format!("{} x {} posts", cut.posts_high(), cut.posts_wide());
        return impossible("DEM", found, expected, "compare on a part of it: --window ROW,COL,ROWSxCOLUMNS");
    }
    if cut.posts_high().min(cut.posts_wide()) < 2 {
        let found = format!("{} x {} posts", cut.posts_high(), cut.posts_wide());
        return impossible("--window", found, "at least 2 x 2 posts".into(), "a TIN needs ground to cover");
    }
    Ok(cut)
}
