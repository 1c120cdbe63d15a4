//! `tiefort export` of several databases: one tileset of 3D Tiles, the finer above the coarser.

use std::path::{Path, PathBuf};

use exports::{Covered, Datum, ExportError, Format, Gap, Product, Put, Together, Work};
use store::Folder;
use views::grouped;

use crate::failure::Failure;
use crate::files;
use crate::new_folder::NewFolder;

/// Reads a database as it is to be seen, and says in words what it holds.
type Read<'a> = dyn Fn(&Path) -> Result<(Product, String), Failure> + 'a;

/// Databases that become one tileset.
pub(super) struct Several<'a> {
    pub databases: &'a [PathBuf],
    pub format: Format,
    /// What to take all heights to be above.
    pub assumed: Option<Datum>,
    pub out: &'a Path,
    pub read: &'a Read<'a>,
}

impl Several<'_> {
    /// Refuses what cannot be, before any work; `has_block` is whether load modules were chosen.
    pub(super) fn check(&self, has_block: bool) -> Result<(), Failure> {
        if !matches!(self.format, Format::Tiles3d | Format::Archive) {
            let format = self.format.carries().name;
            let message = format!("found several databases with --format {format}, expected 3dtiles or 3tz");
            return Err(Failure::new(message, "name one database; tilesets alone have an index of several"));
        }
        if has_block {
            let message = "found --modules with several databases, expected one database or no --modules";
            return Err(Failure::new(message, "load modules are counted in each area; export the block alone"));
        }
        for (place, database) in self.databases.iter().enumerate() {
            let Ok(full) = database.canonicalize() else { continue };
            let same = |other: &&PathBuf| other.canonicalize().is_ok_and(|other| other == full);
            if let Some(other) = self.databases[..place].iter().find(same) {
                let both = format!("{} and {}", other.display(), database.display());
                let message = format!("{both}: found the same database twice, expected each once");
                return Err(Failure::new(message, "leave one of them out"));
            }
        }
        Ok(())
    }

    /// Does it; what was exported, in words.
    pub(super) fn export(&self, work: &Work) -> Result<String, Failure> {
        let named = |database: &PathBuf| Ok((database.display().to_string(), Folder::new(database).finished()?));
        let named = self.databases.iter().map(named).collect::<Result<_, Failure>>()?;
        let together = Together::of(named, self.assumed)?;
        if self.format == Format::Tiles3d {
            let folder = NewFolder::begin(self.out)?;
            let put = |name: &str, bytes: &[u8]| folder.put(name, bytes).map_err(ExportError::write(name));
            let told = self.write(together, &put, work)?;
            folder.finish()?;
            return Ok(told);
        }
        let mut told = None;
        files::write_whole_or(self.out, |out| {
            told = Some(exports::write_3tz(out, |put| self.write(together, put, work))?);
            Ok(())
        })?;
        Ok(told.unwrap_or_default())
    }

    fn write(&self, mut together: Together, put: &Put, work: &Work) -> Result<String, Failure> {
        let mut told = String::new();
        for number in together.order() {
            let database = &self.databases[number];
            let (product, holds) = (self.read)(database)?;
            let written = together.write(number, product, put, work)?;
            let lines = [written.datum.said(), holds];
            let lines = lines.iter().flat_map(|lines| lines.lines()).map(str::to_owned).chain(under(written.covered));
            lines.for_each(|line| told += &format!("{}: {line}\n", database.display()));
        }
        for Gap { areas, border_m, gaping_m, most_m } in together.gaps() {
            let [one, other] = areas.map(|number| self.databases[number].display());
            told += &format!(
                "{one} and {other}: along {gaping_m:.0} of {border_m:.0} m of their common border the grounds lie more \
                 than 5 cm apart, {most_m:.2} m at most\n"
            );
        }
        let bytes = together.finish(put)?;
        Ok(format!("{told}{} databases in one tileset, {}", self.databases.len(), files::bytes_text(bytes)))
    }
}

/// What of an area lies under finer ones, in words.
fn under(Covered { left_out, cut }: Covered) -> Option<String> {
    let modules = if left_out == 1 { "load module is" } else { "load modules are" };
    let are = if cut == 1 { "is" } else { "are" };
    let [left_out_count, cut_count] = [left_out, cut].map(|count| grouped(count as u64));
    (0 < left_out + cut).then(|| {
        format!(
            "of these {left_out_count} {modules} left out under finer areas, {cut_count} {are} cut at their borders"
        )
    })
}
