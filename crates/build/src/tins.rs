//! The TINs of an area's tiles: each in its file, those asked for last in memory too.
//!
//! A tile looks at its neighbours' borders while it is refined, and at its own TIN when it is assembled; so a small
//! area is never read back, and a large one never takes more memory than this.

use std::sync::{Arc, Mutex, PoisonError};

use lru::LruCache;
use store::{DatabaseError, Folder, Stamp};
use terrain::{Refusal, TileId, TileTin, Vertex};

/// Bytes of TINs that are kept: some 150 tiles of 17 x 17 load modules with the paper's 32 triangles in each.
pub(crate) const KEPT_BYTES_MAX: usize = 32 << 20;

/// TINs by tile, for as long as there is room.
pub(crate) struct Tins {
    kept: Mutex<Kept>,
}

struct Kept {
    tins: LruCache<TileId, (Stamp, Arc<TileTin>)>,
    bytes: usize,
    bytes_max: usize,
}

impl Tins {
    /// None yet.
    pub fn new() -> Self {
        Self::of_bytes(KEPT_BYTES_MAX)
    }

    fn of_bytes(bytes_max: usize) -> Self {
        Self { kept: Mutex::new(Kept { tins: LruCache::unbounded(), bytes: 0, bytes_max }) }
    }

    /// Keeps a TIN that has just been published or read.
    pub fn keep(&self, stamp: Stamp, tin: Arc<TileTin>) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.bytes += bytes_of(&tin);
        if let Some((_, (_, before))) = kept.tins.push(tin.tile, (stamp, tin)) {
            kept.bytes -= bytes_of(&before);
        }
        while kept.bytes_max < kept.bytes {
            let Some((_, (_, oldest))) = kept.tins.pop_lru() else { break };
            kept.bytes -= bytes_of(&oldest);
        }
    }

    /// The TIN of a tile that is published with this stamp.
    ///
    /// # Errors
    /// When its file cannot be read, or was made from something else.
    pub fn get(&self, folder: &Folder, tile: TileId, stamp: &Stamp) -> Result<Arc<TileTin>, DatabaseError> {
        if let Some((kept, tin)) = self.kept.lock().unwrap_or_else(PoisonError::into_inner).tins.get(&tile)
            && kept == stamp
        {
            return Ok(tin.clone());
        }
        let (found, tin) = folder.read_tile(tile)?;
        if found != *stamp {
            let what = format!("found a TIN made from {}, expected {}", found.fingerprint, stamp.fingerprint);
            return Err(DatabaseError::Malformed { path: folder.tile_path(tile), section: "header", what });
        }
        let tin = Arc::new(tin);
        self.keep(found, tin.clone());
        Ok(tin)
    }
}

fn bytes_of(tile: &TileTin) -> usize {
    size_of::<TileTin>()
        + tile.tin.vertices.len() * size_of::<Vertex>()
        + tile.tin.triangles.len() * size_of::<[u32; 3]>()
        + tile.residuals.len() * size_of::<u32>()
        + tile.refused.len() * size_of::<Refusal>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use store::Fingerprint;
    use terrain::{PostRect, StopReason, Tin};

    fn tin(col: u32) -> Arc<TileTin> {
        Arc::new(TileTin {
            tile: TileId { row: 0, col },
            tin: Tin::new(PostRect::of_size(3, 3), Vec::new(), Vec::new()),
            initial_count: 0,
            residuals: vec![0; 1000],
            triangles_charged: 0,
            refused: Vec::new(),
            stop: StopReason::Exhausted,
        })
    }

    #[test]
    fn the_tin_asked_for_longest_ago_makes_room() {
        let stamp = Stamp { algorithm_revision: 1, fingerprint: Fingerprint([1; 32]) };
        let nowhere = Folder::new(std::path::Path::new("not/there"));
        let tins = Tins::of_bytes(2 * bytes_of(&tin(0)));
        let is_there = |col| tins.get(&nowhere, TileId { row: 0, col }, &stamp).is_ok();
        tins.keep(stamp, tin(0));
        tins.keep(stamp, tin(1));
        tins.keep(stamp, tin(0));
        assert!(is_there(1) && is_there(0));
        tins.keep(stamp, tin(2));
        assert!(!is_there(1) && is_there(0) && is_there(2));
        let other = Stamp { algorithm_revision: 2, ..stamp };
        assert!(tins.get(&nowhere, TileId { row: 0, col: 0 }, &other).is_err(), "one made from something else");
    }
}
