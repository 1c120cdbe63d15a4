//! What can be wrong with a load-module file: the section, the offset, what was found, what was expected.

use std::fmt;
use std::path::PathBuf;

/// A part of a load-module file that has a checksum of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// The first bytes of the file, up to and with their checksum.
    Header,
    /// One entry per load module, and a checksum.
    Index,
    /// One level of a load module.
    Module {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
        /// Its level; 0 is the finest.
        level: u16,
    },
    /// The decks of one level of a load module.
    Decks {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
        /// Its level; 0 is the finest.
        level: u16,
    },
    /// The lines of one level of a load module.
    Lines {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
        /// Its level; 0 is the finest.
        level: u16,
    },
    /// What stands on the ground of one level of a load module.
    Objects {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
        /// Its level; 0 is the finest.
        level: u16,
    },
    /// The table of parts of one level of a load module, or a part of a kind that is not known.
    Parts {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
        /// Its level; 0 is the finest.
        level: u16,
    },
}

impl fmt::Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Section::Header => f.write_str("header"),
            Section::Index => f.write_str("index"),
            Section::Module { row, col, level } => of_level(f, "", [row, col], level),
            Section::Decks { row, col, level } => of_level(f, "decks of ", [row, col], level),
            Section::Lines { row, col, level } => of_level(f, "lines of ", [row, col], level),
            Section::Objects { row, col, level } => of_level(f, "objects of ", [row, col], level),
            Section::Parts { row, col, level } => of_level(f, "parts of ", [row, col], level),
        }
    }
}

fn of_level(f: &mut fmt::Formatter<'_>, what: &str, [row, col]: [&u32; 2], level: &u16) -> fmt::Result {
    write!(f, "{what}load module {row},{col}")?;
    if *level == 0 { Ok(()) } else { write!(f, " at level {level}") }
}

/// Why a load-module file could not be read. Offsets are bytes from the start of the file.
#[derive(Debug)]
pub enum ReadError {
    /// The file could not be opened or read.
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is longer than this reader takes.
    TooLarge {
        /// Bytes in the file.
        found: u64,
        /// Bytes at most.
        limit: u64,
    },
    /// The file does not start as a load-module file does.
    NotALoadModuleFile {
        /// Its first eight bytes.
        found: [u8; 8],
    },
    /// The file has another version of the format.
    UnsupportedVersion {
        /// The file's version.
        found: u16,
        /// The newest version that this reader knows.
        newest: u16,
    },
    /// The file ends inside a section.
    Truncated {
        /// The section that is cut.
        section: Section,
        /// Where the missing value begins.
        offset: u64,
        /// Bytes left there.
        found: u64,
        /// Bytes needed there.
        expected: u64,
    },
    /// The file is shorter or longer than its header promises.
    WrongLength {
        /// Bytes in the file.
        found: u64,
        /// Bytes promised.
        expected: u64,
    },
    /// The bytes of a section are not those that were written.
    WrongChecksum {
        /// The damaged section.
        section: Section,
        /// Where its stored checksum stands.
        offset: u64,
        /// Checksum of the bytes found.
        found: u32,
        /// Checksum stored.
        expected: u32,
    },
    /// A value is not the only one that would fit the rest of the file.
    WrongValue {
        /// Where.
        section: Section,
        /// Where it stands.
        offset: u64,
        /// The field's name in `docs/FORMAT.md`.
        field: &'static str,
        /// The value found.
        found: i64,
        /// The value that would fit.
        expected: i64,
    },
    /// A value lies outside its range.
    OutOfRange {
        /// Where.
        section: Section,
        /// Where it stands.
        offset: u64,
        /// The field's name in `docs/FORMAT.md`.
        field: &'static str,
        /// The value found.
        found: i64,
        /// The smallest value allowed.
        low: i64,
        /// The largest value allowed.
        high: i64,
    },
    /// A text or a number is not one (not UTF-8, not finite).
    NotAValue {
        /// Where.
        section: Section,
        /// Where it stands.
        offset: u64,
        /// The field's name in `docs/FORMAT.md`.
        field: &'static str,
        /// What it should have been.
        expected: &'static str,
    },
    /// There is no load-module file where an area was expected.
    NoFiles {
        /// The folder.
        path: PathBuf,
    },
    /// A file belongs to another area, grid or coordinate system than the first.
    OtherArea {
        /// The file.
        file: String,
        /// The first one.
        first: String,
    },
    /// Ground was to be moved over an area that it was not loaded from.
    OtherGround,
    /// A file is another than when its area was opened.
    Changed {
        /// Its path.
        path: PathBuf,
    },
    /// What should be a file is none, but a pipe, a device or a folder.
    NotAFile {
        /// Its path.
        path: PathBuf,
    },
    /// The area's load modules have no such level.
    NoSuchLevel {
        /// The level.
        found: u16,
        /// Levels that there are, from 0 on.
        level_count: u16,
    },
    /// A load module of the area is in no file.
    NoSuchModule {
        /// Its row in the area.
        row: u32,
        /// Its column in the area.
        col: u32,
    },
    /// A file that was opened by its path is damaged.
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: Box<ReadError>,
    },
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { path, source } => write!(f, "{}: {source}", path.display()),
            Self::TooLarge { found, limit } => write!(f, "file of {found} bytes, at most {limit} are read"),
            Self::NotALoadModuleFile { found } => {
                write!(f, "header, offset 0: found {found:02x?}, expected {:02x?}", crate::MAGIC)
            }
            Self::UnsupportedVersion { found, newest } => {
                write!(f, "header, offset 8: found format version {found}, expected 1 to {newest}")
            }
            Self::Truncated { section, offset, found, expected } => {
                write!(f, "{section}, offset {offset}: found {found} bytes, expected {expected}")
            }
            Self::WrongLength { found, expected } => {
                write!(f, "found a file of {found} bytes, expected the {expected} its header promises")
            }
            Self::WrongChecksum { section, offset, found, expected } => {
                write!(f, "{section}, offset {offset}: found checksum {found:08x}, expected {expected:08x}")
            }
            Self::WrongValue { section, offset, field, found, expected } => {
                write!(f, "{section}, offset {offset}: found {field} {found}, expected {expected}")
            }
            Self::OutOfRange { section, offset, field, found, low, high } => {
                write!(f, "{section}, offset {offset}: found {field} {found}, expected {low} to {high}")
            }
            Self::NotAValue { section, offset, field, expected } => {
                write!(f, "{section}, offset {offset}: {field} is not {expected}")
            }
            Self::NoFiles { path } => {
                write!(f, "{}: found no load-module file, expected one for each tile", path.display())
            }
            Self::OtherArea { file, first } => {
                write!(f, "{file}: found another area than that of {first}, expected files of one area")
            }
            Self::OtherGround => f.write_str("found ground of another area, expected the area it was loaded from"),
            Self::Changed { path } => {
                write!(f, "{}: found another file than when the area was opened, expected the same", path.display())
            }
            Self::NotAFile { path } => {
                write!(f, "{}: found a pipe, a device or a folder, expected a file", path.display())
            }
            Self::NoSuchModule { row, col } => write!(f, "load module {row},{col}: found no file that holds it"),
            Self::NoSuchLevel { found, level_count } => {
                write!(f, "found level {found}, expected 0 to {}", level_count.saturating_sub(1))
            }
            Self::InFile { path, fault } => write!(f, "{}: {fault}", path.display()),
        }
    }
}

impl std::error::Error for ReadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Unreadable { source, .. } => Some(source),
            Self::InFile { fault, .. } => Some(fault),
            _ => None,
        }
    }
}
