//! What globes ask for: quantized-mesh terrain and 3D Tiles, file by file, with the bytes of `tiefort export`.
//!
//! The area is set on the globe when the first of its files is asked for; a file is made when it is asked for, and
//! those made last are kept.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, OnceLock, PoisonError};

use axum::body::Bytes;
use axum::http::StatusCode;
use exports::{Datum, ExportError, Levels, Product, QuantizedMesh, Tileset, Work};
use job::Job;
use lru::LruCache;
use schedule::Workers;

use super::refusal::Refusal;
use crate::contents::Contents;
use crate::failure::Failure;
use crate::resources;

/// Triangles of an area that is set on the globe at most: some 150 bytes each stay in memory.
const TRIANGLES_MAX: u64 = 8_000_000;
/// Bytes of files that are kept, of a database.
const KEPT_BYTES_MAX: usize = 64 << 20;

/// The file of the terrain that says where holes are.
pub const HOLES: &str = "holes.geojson";

/// What the files are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Quantized-mesh 1.0.
    Terrain,
    /// 3D Tiles 1.1.
    Tileset,
}

/// A database on the globe.
pub struct Globes {
    assumed: Option<Datum>,
    terrain: OnceLock<Result<QuantizedMesh<Product>, Refusal>>,
    /// Where holes lie, of a database whose heights cannot be brought above the ellipsoid.
    holes: OnceLock<Result<Option<Bytes>, Refusal>>,
    tileset: OnceLock<Result<Tileset, Refusal>>,
    kept: Mutex<Kept>,
}

/// The files made last, and their bytes together.
struct Kept {
    files: LruCache<String, Bytes>,
    bytes: usize,
}

impl Globes {
    pub fn new(assumed: Option<Datum>) -> Self {
        let kept = Mutex::new(Kept { files: LruCache::unbounded(), bytes: 0 });
        Self { assumed, terrain: OnceLock::new(), holes: OnceLock::new(), tileset: OnceLock::new(), kept }
    }

    /// What decides the bytes of files beside the database.
    pub fn key(&self) -> String {
        format!("{} {:?}", env!("CARGO_PKG_VERSION"), self.assumed)
    }

    /// A file by its name in the export.
    ///
    /// # Errors
    /// When there is none of this name, the area is too large, or cannot be set on the globe.
    pub fn file(&self, of: &Contents, kind: Kind, name: &str) -> Result<Bytes, Refusal> {
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = lock().files.get(name) {
            return Ok(bytes.clone());
        }
        let made = match kind {
            Kind::Terrain => match self.terrain.get_or_init(|| self.terrain(of, self.assumed)) {
                Ok(terrain) => terrain.file(name).map(Bytes::from),
                // Where holes lie does not ask for heights.
                Err(_) if name == HOLES => self
                    .holes
                    .get_or_init(|| Ok(self.terrain(of, Some(Datum::Ellipsoid))?.file(name).map(Bytes::from)))
                    .clone()?,
                Err(refusal) => return Err(refusal.clone()),
            },
            Kind::Tileset => {
                let tileset = self.tileset.get_or_init(|| self.tileset(of)).as_ref().map_err(Refusal::clone)?;
                tileset.file(name).map_err(refusal)?.map(Bytes::from)
            }
        };
        let listed = match kind {
            Kind::Terrain => "layer.json",
            Kind::Tileset => "tileset.json",
        };
        let bytes = made.ok_or_else(|| {
            Refusal::missing(format!("found no {name}, expected one that {listed} lists"), "read that file first")
        })?;
        lock().keep(name, &bytes);
        Ok(bytes)
    }

    fn terrain(&self, of: &Contents, datum: Option<Datum>) -> Result<QuantizedMesh<Product>, Refusal> {
        worked(of, |work| {
            let product = Product::read(&of.folder, None, Levels::One(0), work)?;
            QuantizedMesh::of(product, datum, work)
        })
    }

    fn tileset(&self, of: &Contents) -> Result<Tileset, Refusal> {
        let job = Job::from_text(&of.manifest.job, &of.folder).map_err(Refusal::of)?;
        worked(of, |work| {
            let product = Product::read(&of.folder, None, Levels::From(0), work)?.leaving_out(&job.lod.leave_out);
            Tileset::of(&product, self.assumed, work)
        })
    }
}

impl Kept {
    fn keep(&mut self, name: &str, bytes: &Bytes) {
        if let Some(before) = self.files.put(name.to_owned(), bytes.clone()) {
            self.bytes -= before.len();
        }
        self.bytes += bytes.len();
        while KEPT_BYTES_MAX < self.bytes {
            let Some((_, oldest)) = self.files.pop_lru() else { return };
            self.bytes -= oldest.len();
        }
    }
}

/// Works on all of an area that is not too large.
fn worked<R>(of: &Contents, work: impl FnOnce(&Work) -> Result<R, ExportError>) -> Result<R, Refusal> {
    let triangles = of.manifest.totals.triangles;
    if TRIANGLES_MAX < triangles {
        return Err(Refusal::new(
            StatusCode::CONFLICT,
            format!("found an area of {triangles} triangles, expected at most {TRIANGLES_MAX} for a globe"),
            "write it once with `tiefort export --format quantized-mesh` or `3dtiles`, which any web server hands out",
        ));
    }
    let (workers, stop) = (Workers::new(resources::cores()), AtomicBool::new(false));
    work(&Work { workers: &workers, stop: &stop, tell: &|_| {} }).map_err(refusal)
}

fn refusal(error: ExportError) -> Refusal {
    let failure = Failure::from(error);
    Refusal::of(failure)
}
