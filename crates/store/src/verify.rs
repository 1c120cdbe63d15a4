//! Reads everything again and says what is not as it was written.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::engine::is_temporary;
use serde::Deserialize;

use crate::names::{FOLDERS, files};
use crate::page::check_page;
use crate::read::{check_length, check_stamp};
use crate::{
    DatabaseError, FileStamp, Folder, Manifest, ManifestState, beside_tile, buildings_file, level_file, measured_file,
    outlines_file, slm, tile_file,
};

/// One file that is not as it should be.
#[derive(Debug)]
pub struct Damage {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it, by section where that is known.
    pub error: DatabaseError,
}

/// Reads a file of one kind, as far as damage in it can be told.
type Decode = fn(&Path, &[u8]) -> Result<(), DatabaseError>;

/// Endings of the names that a build gives to files in its folders, and what reads such files.
pub(crate) const KINDS: [(&str, Decode); 10] = [
    (".tin", |path, bytes| {
        let unsound = |fault| DatabaseError::UnsoundTin { path: path.to_path_buf(), fault };
        tile_file::decode_tile(path, bytes)?.1.tin.check().map_err(unsound)
    }),
    (".slm", |path, bytes| slm::decode_modules(path, bytes).map(drop)),
    (".sums", |path, bytes| measured_file::decode_measured(path, bytes).map(drop)),
    (".curve", |path, bytes| beside_tile::decode_curve(path, bytes).map(drop)),
    (".profile", |path, bytes| beside_tile::decode_profile(path, bytes).map(drop)),
    (".lines", |path, bytes| beside_tile::decode_lines(path, bytes).map(drop)),
    (".level", |path, bytes| level_file::decode_level(path, bytes).map(drop)),
    (".outlines", |path, bytes| outlines_file::decode_outlines(path, bytes).map(drop)),
    (".buildings", |path, bytes| buildings_file::decode_buildings(path, bytes).map(drop)),
    (".removed", |path, bytes| beside_tile::decode_removals(path, bytes).map(drop)),
];

impl Folder {
    /// Every file that `manifest` lists, with how it must look.
    pub(crate) fn listed_files(&self, manifest: &Manifest) -> Vec<(PathBuf, FileStamp)> {
        let of_tiles = manifest.tiles.iter().flat_map(|record| {
            let tile = record.tile();
            [
                (self.tile_path(tile), record.tin),
                (self.removals_path(tile), record.removed),
                (self.modules_path(tile), record.slm),
                (self.measured_path(tile), record.measured),
                (self.curve_path(tile), record.curve),
                (self.profile_path(tile), record.profile),
                (self.lines_path(tile), record.lines),
            ]
        });
        let of_tiles = of_tiles.filter_map(|(path, stamp)| Some((path, stamp?)));
        let others = manifest.files.iter().map(|(name, stamp)| (self.path(name), *stamp));
        of_tiles.chain(others).collect()
    }

    /// Reads every file that `manifest` lists: its sections, what they hold (TINs and load modules are walked for
    /// cracks), and its hash; also the report and what it lists. Files of ours that no list has are named
    /// too. At most one finding per file, in the order of the manifest.
    ///
    /// # Errors
    /// When a folder cannot be listed; damage is no error but a finding.
    pub fn verify(&self, manifest: &Manifest) -> Result<Vec<Damage>, DatabaseError> {
        let listed = self.listed_files(manifest);
        let mut damage = Vec::new();
        for (path, stamp) in &listed {
            if let Err(error) = self.check_listed(path, stamp) {
                damage.push(Damage { path: path.clone(), error });
            }
        }
        // They know times, so the report lists them, and no manifest the report.
        damage.extend(self.damage_of_reports(Self::check_bytes));
        let known: BTreeSet<PathBuf> = listed.into_iter().map(|(path, _)| path).collect();
        for name in FOLDERS {
            for path in self.list(&self.path(name))? {
                let temporary = path.file_name().is_some_and(|name| is_temporary(&name.to_string_lossy()));
                if !known.contains(&path) && !temporary {
                    damage.push(Damage { path: path.clone(), error: DatabaseError::NotListed { path } });
                }
            }
        }
        Ok(damage)
    }

    /// What shows of damage without reading more than the report: files that `manifest` or the report lists and that
    /// are not there or have another length, and a report that is missing or of another build.
    pub fn visible_damage(&self, manifest: &Manifest) -> Vec<Damage> {
        let listed = self.listed_files(manifest).into_iter();
        let damage = listed.filter_map(|(path, stamp)| {
            let error = self.check_length(&path, &stamp, files::DATABASE).err()?;
            Some(Damage { path, error })
        });
        damage.chain(self.damage_of_reports(Self::check_length)).collect()
    }

    /// Whether every file that `manifest` lists has the bytes it had, and so have the report and what it lists; and no
    /// file of ours lies beside them.
    ///
    /// # Errors
    /// When a folder cannot be listed.
    pub fn verify_bytes(&self, manifest: &Manifest) -> Result<bool, DatabaseError> {
        let listed = self.listed_files(manifest);
        let mut files = 0;
        for name in FOLDERS {
            files += self.list(&self.path(name))?.len();
        }
        let is_whole = |(path, stamp): &(PathBuf, FileStamp)| self.check_file(path, stamp).is_ok();
        Ok(files == listed.len() && listed.iter().all(is_whole) && self.damage_of_reports(Self::check_bytes).is_empty())
    }

    /// Decodes first, because that names the section; a file that decodes may still be another than the one listed.
    fn check_listed(&self, path: &Path, stamp: &FileStamp) -> Result<(), DatabaseError> {
        let bytes = self.read(path)?;
        let kind = KINDS.iter().find(|(ending, _)| path.to_string_lossy().ends_with(ending));
        kind.map_or(Ok(()), |(_, decode)| decode(path, &bytes))?;
        check_stamp(path, &bytes, stamp, files::DATABASE)
    }

    /// Whether a file has the bytes that the list of this name promises.
    fn check_bytes(&self, path: &Path, stamp: &FileStamp, list: &str) -> Result<(), DatabaseError> {
        check_stamp(path, &self.read(path)?, stamp, list)
    }

    /// The same of its length alone: it is not read.
    fn check_length(&self, path: &Path, stamp: &FileStamp, list: &str) -> Result<(), DatabaseError> {
        check_length(&**self.store(), path, stamp, list)
    }

    /// The report, where it is not as it was written or of another build, and what it lists that is not as it says, as
    /// `check_listed` finds. A page that it does not list may have been drawn later, and vouches for itself.
    fn damage_of_reports(
        &self,
        check_listed: impl Fn(&Self, &Path, &FileStamp, &str) -> Result<(), DatabaseError>,
    ) -> Vec<Damage> {
        let found = |name: &str, error| Damage { path: self.path(name), error };
        let report: Beside = match self.read_json(files::REPORT) {
            Ok(report) => report,
            Err(error) => return vec![found(files::REPORT, error)],
        };
        let check = |name: &'static str| {
            let path = self.path(name);
            match report.files.get(name) {
                Some(stamp) => check_listed(self, &path, stamp, files::REPORT),
                None if name == files::REPORT_HTML => match self.read(&path) {
                    Err(DatabaseError::Missing { .. }) => Ok(()),
                    read => check_page(&path, &read?),
                },
                None => Ok(()),
            }
        };
        let of_other = self.check_of_build(&report.files).err().map(|error| found(files::REPORT, error));
        let beside = files::BESIDE_REPORT.into_iter();
        of_other.into_iter().chain(beside.filter_map(|name| Some(found(name, check(name).err()?)))).collect()
    }

    /// Whether a report that lists these files is of the build that `database.json` tells of. While a build is under
    /// way, its report may lie there before that file says so.
    ///
    /// # Errors
    /// When it is of another build, or `database.json` cannot be read.
    pub(crate) fn check_of_build(&self, listed: &BTreeMap<String, FileStamp>) -> Result<(), DatabaseError> {
        let Some(stamp) = listed.get(files::DATABASE) else { return Ok(()) };
        let is_same = self.check_file(&self.path(files::DATABASE), stamp).is_ok();
        if is_same || self.manifest()?.state == ManifestState::Incomplete {
            return Ok(());
        }
        Err(DatabaseError::OtherBuild { path: self.path(files::REPORT) })
    }
}

/// What a report says of the files beside it.
#[derive(Default, Deserialize)]
struct Beside {
    #[serde(default)]
    files: BTreeMap<String, FileStamp>,
}
