//! What features put into tiles, as a database has it, for every window of the ground.

use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use lru::LruCache;
use store::Folder;
use terrain::{PostRect, Spacing, TileFeatures, TileId};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::burn::burn;
use crate::ground::window::Window;

/// Tiles whose features are kept in memory at most.
const TILES_MAX: NonZeroUsize = NonZeroUsize::new(64).expect("64 is not 0");

/// Where what features put into tiles is read from.
pub(crate) struct Lines {
    folder: Folder,
    tiles: Vec<(TileId, PostRect)>,
    spacing: Spacing,
    /// Times that posts on features weigh which are not in the TIN.
    left_out_weight: f64,
    read: Mutex<LruCache<TileId, Arc<TileFeatures>>>,
    windows: Option<Vec<OnceLock<Arc<Window>>>>,
}

impl Lines {
    /// Of the tiles of `area`; `keeps` says whether windows of tiles are kept.
    pub fn new(folder: &Folder, area: &GamingArea, left_out_weight: f64, keeps: bool) -> Self {
        let tiles: Vec<_> = area.tiles.iter().map(|&tile| (tile, area.tiling.rect(tile))).collect();
        let windows = keeps.then(|| tiles.iter().map(|_| OnceLock::new()).collect());
        let (folder, spacing) = (folder.clone(), area.frame.spacing);
        Self { folder, tiles, spacing, left_out_weight, read: Mutex::new(LruCache::new(TILES_MAX)), windows }
    }

    /// Where the window of a tile is kept.
    pub fn kept(&self, index: usize) -> Option<&OnceLock<Arc<Window>>> {
        self.windows.as_ref().map(|windows| &windows[index])
    }

    /// What features put into a tile.
    pub fn features(&self, tile: TileId) -> Result<Arc<TileFeatures>, GroundError> {
        let known = || self.read.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(features) = known().get(&tile) {
            return Ok(features.clone());
        }
        let (_, read) = self.folder.read_lines(tile)?;
        let read = Arc::new(read);
        known().put(tile, read.clone());
        Ok(read)
    }

    /// The window of a tile with its features; its neighbours add nothing that it does not have.
    pub fn burn_tile(&self, window: Window, tile: TileId) -> Result<Window, GroundError> {
        Ok(burn(window, &*self.features(tile)?, (self.spacing, self.left_out_weight)))
    }

    /// A window with the features of all tiles that it touches. What lies on a line between tiles is burned from the
    /// natural ground by each, and the same by all.
    pub fn burn(&self, window: &Window) -> Result<Window, GroundError> {
        let rect = window.dem.rect();
        let touched = self.tiles.iter().filter_map(|(tile, of)| Some((*tile, of.intersection(&rect)?)));
        let part = |(tile, of)| self.burn_tile(Window::of(window.dem.window(of), window.importance.window(of)), tile);
        let parts = touched.map(part).collect::<Result<Vec<_>, _>>()?;
        Ok(Window::joined(rect, &parts.iter().collect::<Vec<_>>()))
    }
}
