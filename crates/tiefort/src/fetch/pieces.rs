//! Ranges of a file on the disk, each in a file of its own under its first byte: what came before a cut is kept.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes of a range, at most.
pub const PIECE_BYTES_MAX: u64 = 8 << 20;
/// Bytes between two ranges that are fetched with them rather than asked twice.
const GAP_BYTES_MAX: u64 = 1 << 10;

/// A range of bytes of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Its first byte.
    pub start: u64,
    /// Its bytes.
    pub len: u64,
}

/// The ranges that hold all of `extents`: neighbours are joined, and none is longer than a limit unless one extent is.
pub fn joined(extents: impl IntoIterator<Item = (u64, u64)>) -> Vec<Piece> {
    let mut extents: Vec<(u64, u64)> = extents.into_iter().filter(|&(_, len)| 0 < len).collect();
    extents.sort_unstable();
    let mut pieces: Vec<Piece> = Vec::new();
    for (start, len) in extents {
        match pieces.last_mut() {
            // Two tiles may share their bytes.
            Some(last) if start + len <= last.start + last.len => {}
            Some(last)
                if start <= last.start + last.len + GAP_BYTES_MAX && start + len - last.start <= PIECE_BYTES_MAX =>
            {
                last.len = start + len - last.start;
            }
            _ => pieces.push(Piece { start, len }),
        }
    }
    pieces
}

/// All of a file of `total` bytes in ranges.
pub fn whole(total: u64) -> Vec<Piece> {
    let starts = (0..total.div_ceil(PIECE_BYTES_MAX)).map(|index| index * PIECE_BYTES_MAX);
    starts.map(|start| Piece { start, len: PIECE_BYTES_MAX.min(total - start) }).collect()
}

/// The folder of a file's ranges.
pub struct Pieces {
    folder: PathBuf,
}

impl Pieces {
    /// The folder `folder` of the ranges of one version of a file, which `version` tells from others. Ranges of another
    /// version are removed.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn open(folder: PathBuf, version: &str) -> io::Result<Self> {
        let mark = folder.join("version");
        if fs::read_to_string(&mark).ok().as_deref() != Some(version) {
            if folder.exists() {
                fs::remove_dir_all(&folder)?;
            }
            fs::create_dir_all(&folder)?;
            fs::write(&mark, version)?;
        }
        Ok(Self { folder })
    }

    fn path(&self, piece: Piece) -> PathBuf {
        self.folder.join(piece.start.to_string())
    }

    /// Whether a range is there whole: each appears whole, by a rename.
    pub fn has(&self, piece: Piece) -> bool {
        fs::metadata(self.path(piece)).is_ok_and(|data| data.len() == piece.len)
    }

    /// Puts a range there.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn put(&self, piece: Piece, bytes: &[u8]) -> io::Result<()> {
        let half = self.folder.join(format!("{}.half", piece.start));
        fs::write(&half, bytes)?;
        fs::rename(half, self.path(piece))
    }

    /// The bytes of one extent, which lies in one of `pieces`.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn extent(&self, pieces: &[Piece], (start, len): (u64, u64)) -> io::Result<Vec<u8>> {
        let piece = pieces.iter().find(|piece| piece.start <= start && start + len <= piece.start + piece.len);
        let piece = piece.expect("every extent that is asked for lies in a range that was fetched");
        let mut file = File::open(self.path(*piece))?;
        file.seek(SeekFrom::Start(start - piece.start))?;
        let mut bytes = vec![0; len as usize];
        file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// A range, whole.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn read(&self, piece: Piece) -> io::Result<Vec<u8>> {
        fs::read(self.path(piece))
    }

    /// Where something else of the file may lie in the meantime.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Removes all ranges.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn remove(self) -> io::Result<()> {
        fs::remove_dir_all(self.folder)
    }
}

/// The folder of the ranges of the file that will lie at `path`.
pub fn folder_of(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.part"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_fetched_at_once_and_far_ones_are_not() {
        let pieces = joined([(5000, 10), (0, 100), (108, 50), (0, 100), (300_000, 0)]);
        assert_eq!(pieces, [Piece { start: 0, len: 158 }, Piece { start: 5000, len: 10 }]);
        let long = joined([(0, PIECE_BYTES_MAX), (PIECE_BYTES_MAX, 9)]);
        assert_eq!(long.len(), 2);
        assert_eq!(whole(PIECE_BYTES_MAX + 1).iter().map(|piece| piece.len).collect::<Vec<_>>(), [PIECE_BYTES_MAX, 1]);
    }
}
