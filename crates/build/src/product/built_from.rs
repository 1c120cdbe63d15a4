//! The ground that a finished database was built from, for those who compare with it.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::ground::Ground;
use schedule::Workers;
use terrain::{Dem, PostRect};

use crate::product::{Opened, ProductError, choose_ground};

/// Heights of a finished database's ground.
pub struct BuiltFrom {
    ground: Ground,
    name: String,
}

impl BuiltFrom {
    /// Opens the ground the database was built from, or the raster `against`.
    ///
    /// # Errors
    /// When the database is missing, unfinished or damaged, or the ground cannot be found or used.
    pub fn open(folder: &Path, against: Option<&Path>) -> Result<Self, ProductError> {
        let Opened { folder, manifest, mut job, area } = Opened::open(folder)?;
        // Nothing that is compared with heights depends on weights.
        job.importance.areas.clear();
        let name = choose_ground(&mut job, &manifest, folder.dir(), against)?;
        let ground = Ground::open_built(&job, &area, (&Workers::new(1), &AtomicBool::new(false)), &folder)?;
        Ok(Self { ground, name })
    }

    /// What it is: the sample terrain, or the rasters.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Heights at the posts of a rectangle of the area.
    ///
    /// # Errors
    /// When the source has no heights there.
    pub fn heights(&self, rect: PostRect) -> Result<Dem, ProductError> {
        Ok(self.ground.window(rect)?.dem)
    }
}
