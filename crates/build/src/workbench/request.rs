//! A mesh that is asked for without a job, and what no ground allows.

use std::path::PathBuf;

use crate::CompileError;
use crate::ground::GroundError;
use job::{ErrorKey, Optimising, StartMethod};
use terrain::PostRect;
use terrain::geometry::WORKING_POSTS_MAX;

/// Which post comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TinMethod {
    /// The best of ours.
    Optimised(Optimising),
    /// The founding paper's passes.
    Paper,
    /// One post at a time: the worst of all, or the worst of the triangle with the largest sum of squares.
    Greedy {
        /// Which of the two.
        key: ErrorKey,
    },
}

/// What a mesh starts from beside the corners of its tiles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TinStart {
    /// So many points of a method in all.
    Method(StartMethod, usize),
    /// The points of a file; those with a height are fixed at it.
    File(PathBuf),
}

/// A mesh to make from a raster.
#[derive(Clone, Debug)]
pub struct TinRequest {
    /// The raster.
    pub dem: PathBuf,
    /// Its coordinate system, where it names none.
    pub crs: Option<String>,
    /// Which post comes next.
    pub method: TinMethod,
    /// Vertices at most, corners included.
    pub points: Option<usize>,
    /// Triangles at most; of the optimised method, and instead of `points`.
    pub triangles: Option<usize>,
    /// Largest residual to accept, in metres.
    pub max_residual_m: Option<f64>,
    /// RMS residual to reach, in metres.
    pub rms_m: Option<f64>,
    /// What tiles start from beside their corners.
    pub start: Option<TinStart>,
    /// Rows and columns of tiles; those that suit the raster and the number of points where `None`.
    pub tiles: Option<(u32, u32)>,
    /// Tiles at once.
    pub workers: usize,
}

impl TinRequest {
    /// A mesh of a raster by a method, on one worker: nothing else is asked for, not even when it is to stop.
    pub fn plain(dem: PathBuf, method: TinMethod) -> Self {
        Self {
            dem,
            crs: None,
            method,
            points: None,
            triangles: None,
            max_residual_m: None,
            rms_m: None,
            start: None,
            tiles: None,
            workers: 1,
        }
    }
}

/// Refuses a mesh of so many rows and columns of tiles that a raster has no room for.
pub(crate) fn refuse(request: &TinRequest, (rows, cols): (u32, u32), rect: PostRect) -> Result<(), CompileError> {
    let longest =
        (rect.cells_high().div_ceil(rows.max(1) as usize)).max(rect.cells_wide().div_ceil(cols.max(1) as usize));
    let impossible = |key: &str, found: String, expected: &str, hint: &str| {
        Err(GroundError::Impossible { key: key.into(), found, expected: expected.into(), hint: hint.into() }.into())
    };
    if rect.posts_wide() < 2 || rect.posts_high() < 2 {
        let found = format!("{} x {} posts", rect.posts_high(), rect.posts_wide());
        return impossible("DEM", found, "at least 2 x 2 posts", "a mesh needs ground to cover");
    }
    if rows == 0 || cols == 0 || rect.cells_high() < rows as usize || rect.cells_wide() < cols as usize {
        let found = format!("{rows}x{cols} for {} x {} posts", rect.posts_high(), rect.posts_wide());
        return impossible("--tiles", found, "at least one row and column, and a cell for each", "try --tiles 6x6");
    }
    if WORKING_POSTS_MAX <= longest {
        let found = format!("tiles of {longest} cells");
        return impossible("--tiles", found, "tiles below 16384 cells a side", "ask for more tiles");
    }
    let corners = (rows as usize + 1) * (cols as usize + 1);
    match request.points {
        Some(points) if points < corners => impossible(
            "--points",
            points.to_string(),
            &format!("at least the {corners} corners of tiles"),
            "corners of tiles are vertices of every mesh",
        ),
        _ if request.triangles.is_some_and(|triangles| triangles < 2 * rows as usize * cols as usize) => impossible(
            "--triangles",
            request.triangles.unwrap_or_default().to_string(),
            &format!("at least {}, two in each tile", 2 * rows as usize * cols as usize),
            "ask for more triangles, or for fewer tiles",
        ),
        None if [request.max_residual_m, request.rms_m, request.triangles.map(|_| 0.0)].iter().all(Option::is_none) => {
            impossible(
                "--points",
                "nothing that says when to stop".into(),
                "--points, --triangles, --max-residual or --rms",
                "for example --points 5000",
            )
        }
        _ => Ok(()),
    }
}
