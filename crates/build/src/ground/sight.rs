//! What is seen from where: the ground around a tile, and what its posts weigh for lines of sight.

use job::Sight;
use terrain::mask::Surroundings;
use terrain::{HOLE_CLASS, TileId};

use crate::ground::{GamingArea, Ground, GroundError};

/// Eyes and their range as the scan counts them.
pub fn scanned(sight: Sight, metres_per_post: f64) -> terrain::mask::Sight {
    let quanta_per_post = metres_per_post * f64::from(terrain::QUANTA_PER_METRE);
    terrain::mask::Sight::new(sight.eyes_quanta, f64::from(sight.range_quanta) / quanta_per_post, metres_per_post)
}

impl Ground {
    /// A tile's ground and what lies within sight of it.
    ///
    /// # Errors
    /// As [`Ground::around`].
    pub fn within_sight(
        &self,
        area: &GamingArea,
        tile: TileId,
        sight: &terrain::mask::Sight,
    ) -> Result<Surroundings, GroundError> {
        let wide = self.around(area, tile, sight.halo())?;
        // Voids are filled from whatever window they are read with.
        let height = |post| (wide.importance.class(post) != HOLE_CLASS).then(|| wide.dem.height(post));
        Ok(Surroundings::new(wide.dem.rect(), height))
    }
}
