//! A planned file, brought: its ranges by several requests at a time, then the file under its final name, whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use job::Locked;
use schedule::Workers;
use source_files::GeoParquet;
use store::engine::Fingerprint;

use super::client::{Client, REQUESTS};
use super::fault::Fault;
use super::pieces::Piece;
use super::plan::{Planned, What, disk, stopped_or};

/// Brings a file; `told` hears of every range, with its bytes.
///
/// # Errors
/// When a range does not come, or cannot be written; those that came are kept.
pub fn bring(client: &Client, planned: Planned, told: &(dyn Fn(u64) + Sync)) -> Result<Locked, Fault> {
    let half = planned.store.beside("whole");
    let failed = |error: io::Error| disk(&half, &error);
    match &planned.what {
        What::Whole { has_ranges: false } => in_one_answer(client, &planned, &half, told)?,
        What::Whole { has_ranges: true } => {
            pieces(client, &planned, told)?;
            let all = planned.pieces.iter().map(|piece| planned.store.read(*piece));
            write(&half, |out| all.into_iter().try_for_each(|bytes| out.write_all(&bytes?))).map_err(failed)?;
        }
        What::Groups(files) => {
            pieces(client, &planned, told)?;
            let parts: Vec<_> = files.iter().map(|(file, groups)| (file, groups.clone())).collect();
            let bytes = |part: usize, (start, len): (u64, u64)| {
                planned.store.extent(&planned.pieces, (planned.remotes[part].base + start, len))
            };
            write(&half, |out| GeoParquet::write(&parts, out, bytes)).map_err(failed)?;
        }
        What::Window { levels, level, chunks, .. } => {
            pieces(client, &planned, told)?;
            let bytes = |chunk| planned.store.extent(&planned.pieces, levels.chunk(*level, chunk));
            write(&half, |out| levels.write(*level, chunks, out, bytes)).map_err(failed)?;
        }
    }
    let hash = File::open(&half).and_then(Fingerprint::of_reader).map_err(failed)?;
    let len = fs::metadata(&half).map_err(failed)?.len();
    fs::rename(&half, &planned.path).map_err(|error| disk(&planned.path, &error))?;
    let window = match &planned.what {
        What::Window { level, chunks, .. } => Some((*level as u64, chunks.len() as u64)),
        What::Groups(files) => Some((0, files.iter().map(|(_, groups)| groups.len() as u64).sum())),
        What::Whole { .. } => None,
    };
    let Planned { written, path, etag, total, store, .. } = planned;
    store.remove().map_err(|error| disk(&path, &error))?;
    let [date, licence, attribution] = [const { String::new() }; 3];
    let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let blake3 = hash.to_string();
    Ok(Locked { address: written, file, len, blake3, etag, remote_len: total, date, window, licence, attribution })
}

/// Writes a file, down to the disk.
fn write(path: &Path, put: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    put(&mut out)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
}

/// Brings the ranges that are not there yet.
fn pieces(client: &Client, planned: &Planned, told: &(dyn Fn(u64) + Sync)) -> Result<(), Fault> {
    let left: Vec<Piece> = planned.pieces.iter().filter(|piece| !planned.store.has(**piece)).copied().collect();
    let brought = schedule::for_each_independent(&left, &Workers::new(REQUESTS), client.stop(), |_, &piece| {
        let remote = planned.remote(piece.start);
        let start = piece.start - remote.base;
        let answer = client.range(&remote.address, start, piece.len, Some(&remote.etag))?;
        if answer.bytes.len() as u64 != piece.len || answer.total != remote.total {
            let text = format!("{}: it has {} bytes now, expected {}", remote.address, answer.total, remote.total);
            return Err(Fault::hinted(text, "run the same command again"));
        }
        planned.store.put(piece, &answer.bytes).map_err(|error| disk(&planned.path, &error))?;
        told(piece.len);
        Ok(())
    });
    brought.map(|_| ()).map_err(|error| stopped_or(error, &planned.written))
}

/// Brings a file from a server that gives no ranges: it begins anew where it was cut.
fn in_one_answer(client: &Client, planned: &Planned, half: &Path, told: &(dyn Fn(u64) + Sync)) -> Result<(), Fault> {
    client.trying(|| {
        let mut out = File::create(half).map_err(|error| disk(half, &error))?;
        client.whole(&planned.remotes[0].address, planned.total, &mut |bytes| {
            told(bytes.len() as u64);
            out.write_all(bytes).map_err(|error| disk(half, &error))
        })
    })
}
