//! What methods are compared on, and what one made.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::CompileError;
use fidelity::Tally;
use job::Job;
use schedule::Workers;
use source_files::Raster;
use terrain::{Dem, Metres, Tin};

use crate::workbench::heights::Heights;

/// What to compare methods on.
#[derive(Clone, Debug)]
pub enum CompareGround {
    /// The posts of a raster.
    Raster {
        /// Its file.
        path: PathBuf,
        /// Its coordinate system, where it names none.
        crs: Option<String>,
    },
    /// The heights of a raster in memory.
    Held(HeldGround),
    /// The ground of a job: its one raster's own posts, or else its working grid.
    Job(Box<Job>),
}

/// The heights of a raster in memory, on its own posts where these are square, else resampled.
#[derive(Clone, Debug)]
pub struct HeldGround {
    pub(super) dem: Arc<Dem>,
    pub(super) spacing: Metres,
    pub(super) name: String,
}

impl HeldGround {
    /// Those of a raster.
    ///
    /// # Errors
    /// When it has no heights, or no grid suits it.
    pub fn of(raster: Raster, name: &str, stop: &AtomicBool) -> Result<Self, CompileError> {
        let Heights { dem, frame, .. } = Heights::of_raster(raster, &Workers::new(1), stop)?;
        Ok(Self { dem, spacing: Metres(frame.spacing[0]), name: name.to_owned() })
    }
}

/// What a method made.
#[derive(Clone, Debug)]
pub struct Made {
    /// The TIN.
    pub tin: Tin,
    /// Its vertices.
    pub points: usize,
    /// Its triangles.
    pub triangles: usize,
    /// Posts it covers: all of the ground but for HIGHLOW.
    pub covered: u64,
    /// Residuals at the posts it covers.
    pub residual: Tally,
    /// How many points of the iterative method do as well.
    pub equivalent: Equivalent,
    /// Of a method that forces border posts: how many, and what the iterative method makes of as many points less.
    pub forced: Option<Forced>,
}

/// How many points of the iterative method have a smaller RMS residual.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Equivalent {
    /// So many, and no fewer.
    Points(usize),
    /// More than it has when no residual is left by its own measure.
    MoreThan(usize),
    /// The method does not cover the ground, or it is the iterative method.
    None,
}

/// Border posts a method takes whether they help or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forced {
    /// How many.
    pub points: usize,
    /// RMS residual, in metres, of the iterative method without so many points; none where fewer than corners are left.
    pub iterative_rms_m: Option<f64>,
}
