//! The files that a Shapefile consists of, beside each other in a folder or in one zip file.

use crate::SourceError;
use crate::content::beside;
use crate::crs::Crs;
use crate::error::at_most;
use crate::limits::SHAPEFILE_BYTES_MAX;
use crate::store::Store;

/// A Shapefile: its shapes, and what of the rest is there.
pub(crate) struct Parts {
    pub shapes: Store,
    index: Option<Store>,
    pub table: Option<Store>,
    encoding: Option<Store>,
    system: Option<Store>,
}

impl Parts {
    /// What belongs to the shapes in `store`, from where these come from.
    pub(crate) fn of(store: &Store) -> Result<Self, SourceError> {
        let shapes = store.clone();
        if !store.is_packed() {
            let part = |ending: &str| beside(store.path(), &[ending]).map(|path| Store::plain(&path)).transpose();
            let (index, table) = (part("shx")?, part("dbf")?);
            return Ok(Self { shapes, index, table, encoding: part("cpg")?, system: part("prj")? });
        }
        let mut packed = Store::zipped_shapefile(store.path())?;
        let mut part = |ending: &str| {
            let is_it = |store: &Store| store.name().to_lowercase().ends_with(&format!(".{ending}"));
            packed.iter().position(is_it).map(|index| packed.remove(index))
        };
        let (index, table) = (part("shx"), part("dbf"));
        Ok(Self { shapes, index, table, encoding: part("cpg"), system: part("prj") })
    }

    /// The bytes of its index.
    pub(crate) fn index(&self) -> Result<Option<Vec<u8>>, SourceError> {
        self.index.as_ref().map(whole).transpose()
    }

    /// What it says of how texts in its table are written.
    pub(crate) fn encoding(&self) -> Result<Option<String>, SourceError> {
        let said = self.encoding.as_ref().map(|store| store.start(64)).transpose()?;
        Ok(said.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// The coordinate system that it names.
    pub(crate) fn system(&self) -> Result<Option<Crs>, SourceError> {
        let Some(store) = &self.system else { return Ok(None) };
        let crs = Crs::from_wkt(&String::from_utf8_lossy(&store.start(1 << 16)?));
        crs.map(Some).map_err(|found| SourceError::UnnamedCrs { path: store.path().into(), found })
    }
}

/// All bytes of a part, which are held in memory.
pub(crate) fn whole(store: &Store) -> Result<Vec<u8>, SourceError> {
    at_most(store.path(), store.len(), SHAPEFILE_BYTES_MAX, "bytes")?;
    store.start(SHAPEFILE_BYTES_MAX)
}
