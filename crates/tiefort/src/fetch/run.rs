//! A job's files, planned and brought several at a time, and its lock.
//!
//! A planned file comes by its ranges, several requests at a time; then the file stands under its final name, whole.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fs, io};

use exports::Step;
use job::{Job, Lock, Locked, NamedFile, is_remote};
use schedule::Workers;
use source_files::GeoParquet;
use store::engine::Fingerprint;

use super::check::{Refused, check_raster, is_page};
use super::client::{Client, Patience, REQUESTS};
use super::fault::{Fault, page};
use super::pieces::Piece;
use super::plan::{Kept, Planned, What, disk, kept, plan, raster_of, stopped_or};
use super::silence;
use crate::catalogue::{Catalogue, catalogue};
use crate::clock::today;
use crate::failure::{Failure, Outcome};
use crate::files::bytes_text;
use crate::signals::Signals;
use crate::steps::Steps;
use crate::{files, fit, signals, terminal};

/// What is to be fetched, and how.
pub struct Options {
    /// The job file.
    pub job: PathBuf,
    /// Whether only to say what would come.
    pub dry_run: bool,
    /// Whether to take what has changed on its server.
    pub update: bool,
    /// Gigabytes that may come at most.
    pub max_gb: f64,
    /// A file with sources of one's own.
    pub catalogue: Option<PathBuf>,
    /// Whether to show no progress.
    pub quiet: bool,
}

/// What is to be done about one file of a job.
enum Task {
    Keep(Locked),
    Fetch(Box<Planned>),
}

/// Fetches what a job names on other machines.
///
/// # Errors
/// When the job is none, a server does not give a file, or it cannot be written.
pub fn fetch(options: &Options) -> Result<Outcome, Failure> {
    let job = Job::load_remote(&options.job, &build::ground::find_area)?;
    let known = catalogue(options.catalogue.as_deref())?;
    let named = named_apart(&job);
    if named.is_empty() {
        terminal::tell(&format!("{}: all its files are of this machine; nothing to fetch", job.path.display()));
        return Ok(Outcome::Sound);
    }
    let signals = Signals::watch()?;
    let variable = |name: &str| std::env::var(name).ok();
    let client = Client::new(signals.stop(), &variable, Patience::USUAL);
    if !options.quiet {
        silence::watch(client.silence(), terminal::tell);
    }
    // A request that waits for its server does not look at the flag.
    signals.end_in_time(|| signals::stopped("stopped", "run the same command again: what has come is kept"));
    let fetched = fetch_all(options, &job, &known, &named, (&client, &signals));
    // From here on this thread says how the process ends.
    signals.tell_once(|| {});
    fetched
}

fn fetch_all(
    options: &Options,
    job: &Job,
    known: &Catalogue,
    named: &[(NamedFile, PathBuf)],
    (client, signals): (&Client, &Signals),
) -> Result<Outcome, Failure> {
    let failed = |fault: Fault| Failure::new(&fault.text, fault.hint).after(signals.exit_code());
    let lock = Lock::read(&job.path)?.unwrap_or_default();
    let tasks = tasks(client, job, named, &lock, options.update).map_err(failed)?;
    let left = tasks.iter().map(|task| if let Task::Fetch(planned) = task { planned.left() } else { 0 }).sum();
    tell_plan(&tasks, left, job)?;
    if options.dry_run {
        return Ok(Outcome::Sound);
    }
    if options.max_gb * 1.0e9 < left as f64 {
        let message = format!("{} are to come, expected at most {} GB", bytes_text(left), options.max_gb);
        return Err(Failure::new(message, "--max-gb allows more; a coarser spacing_m needs fewer"));
    }
    check_disk(&tasks, left, &Lock::folder(&job.path))?;
    files::make_folder(&Lock::folder(&job.path))?;
    bring_all(client, job, tasks, known, (options.quiet, left)).map_err(failed)?;
    let (place, path, came) = (Lock::place(&job.path), job.path.display(), bytes_text(client.received()));
    terminal::print(&format!("{came} came; {} says what; build it: tiefort build {path}\n", place.display()))?;
    Ok(Outcome::Sound)
}

/// Refuses what the disk has no room for: the ranges of a file lie beside what is put together from them.
fn check_disk(tasks: &[Task], left: u64, folder: &Path) -> Result<(), Failure> {
    let bytes = tasks.iter().map(|task| if let Task::Fetch(planned) = task { planned.bytes() } else { 0 });
    let largest = bytes.max().unwrap_or(0);
    let why = format!("that the {} to come take, with the largest file twice", bytes_text(left));
    fit::check_disk(folder, left.saturating_add(largest), &why, "make room; a coarser spacing_m needs fewer bytes")
}

/// The files of other machines, each with the path that it gets here: names that two have are told apart.
fn named_apart(job: &Job) -> Vec<(NamedFile, PathBuf)> {
    let folder = Lock::folder(&job.path);
    let mut named: Vec<(NamedFile, PathBuf)> = Vec::new();
    for file in job.remote_files() {
        debug_assert!(is_remote(&file.written), "only those are listed");
        let is_named = |part: &&str| part.contains(|c: char| c.is_ascii_alphanumeric()) && !part.contains('*');
        let last = match file.written.contains('*') {
            // A pattern's file has the name of its folder.
            true => format!("{}.parquet", file.written.rsplit('/').find(is_named).unwrap_or_default()),
            false => file.written.rsplit('/').next().unwrap_or_default().to_owned(),
        };
        let plain: String =
            last.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
        let plain = plain.trim_start_matches('.').to_owned();
        let is_free = |name: &str| !name.is_empty() && named.iter().all(|(_, path)| *path != folder.join(name));
        let name = (1..).map(|count| if count == 1 { plain.clone() } else { format!("{count}-{plain}") });
        let name = name.into_iter().find(|name| is_free(name)).expect("one of all numbers is free");
        named.push((file, folder.join(name)));
    }
    named
}

fn tasks(
    client: &Client,
    job: &Job,
    named: &[(NamedFile, PathBuf)],
    lock: &Lock,
    update: bool,
) -> Result<Vec<Task>, Fault> {
    let task = |_, (file, path): &(NamedFile, PathBuf)| {
        let kept = match kept(client, job, file, (lock, update)) {
            Err(fault) if update && fault.is_change() => Kept::Not,
            end => end?,
        };
        let locked = lock.of(&file.written).filter(|_| kept == Kept::Here);
        Ok(match locked {
            Some(locked) => Task::Keep(locked.clone()),
            None => Task::Fetch(Box::new(plan(client, job, file, path.clone())?)),
        })
    };
    let tasks = schedule::for_each_independent(named, &Workers::new(REQUESTS), client.stop(), task);
    tasks.map_err(|error| stopped_or(error, "fetch"))
}

/// Says what comes of each file.
fn tell_plan(tasks: &[Task], left: u64, job: &Job) -> Result<(), Failure> {
    let mut text = String::new();
    for task in tasks {
        text += &match task {
            Task::Keep(locked) => format!("{}: is here\n", locked.address),
            Task::Fetch(planned) => format!("{}: {}\n", planned.written, what_comes(planned, job)),
        };
    }
    text += &format!("{} are to come\n", bytes_text(left));
    terminal::print(&text)?;
    Ok(())
}

fn what_comes(planned: &Planned, job: &Job) -> String {
    let (bytes, total) = (bytes_text(planned.bytes()), bytes_text(planned.total));
    match &planned.what {
        What::Whole { .. } => format!("all of it, {total}"),
        What::Groups(files) => {
            let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
            let (all, wanted) = files
                .iter()
                .fold((0, 0), |(all, wanted), (file, groups)| (all + file.group_count(), wanted + groups.len()));
            format!("{wanted} of {} in {}, {bytes} of {total}", of(all, "row group"), of(files.len(), "file"))
        }
        What::Window { chunks, .. } if chunks.is_empty() => {
            format!("nothing, it lies outside the area; of {total}")
        }
        What::Window { level: 0, chunks, .. } => format!("{} tiles, {bytes} of {total}", chunks.len()),
        What::Window { chunks, spacing_m, .. } => format!(
            "{} tiles of its overview with posts {spacing_m:.0} m apart, as spacing_m is {}: {bytes} of {total}",
            chunks.len(),
            job.area.spacing.metres(),
        ),
    }
}

/// Brings all files, and writes the lock after each: what has come stays.
fn bring_all(
    client: &Client,
    job: &Job,
    tasks: Vec<Task>,
    known: &Catalogue,
    (quiet, left): (bool, u64),
) -> Result<(), Fault> {
    let steps = Steps::start(quiet);
    let mut lock = Lock { area: job.fetch_area(), files: Vec::new() };
    let mut left_to_do: Vec<Mutex<Option<Planned>>> = Vec::new();
    for task in tasks {
        match task {
            // What is kept is in the lock from the beginning, should the rest be cut.
            Task::Keep(locked) => lock.files.push(locked),
            Task::Fetch(planned) => left_to_do.push(Mutex::new(Some(*planned))),
        }
    }
    write(&lock, &job.path)?;
    let (order, done, lock) = (job.remote_files(), AtomicU64::new(0), Mutex::new(lock));
    let told = |bytes: u64| {
        let done = done.fetch_add(bytes, Ordering::Relaxed) + bytes;
        steps.tell(Step { what: "bytes came", done: done as usize, total: left as usize });
    };
    let one = |_, planned: &Mutex<Option<Planned>>| {
        let Some(planned) = guarded(planned).take() else { return Ok(()) };
        let locked = bring(client, job, planned, &told)?;
        let said = raster_of(job, &locked.address).and_then(|raster| raster.said.attribution.clone());
        let (licence, attribution) = known.said_of(&locked.address).unwrap_or_default();
        let (licence, attribution) = (licence.to_owned(), said.unwrap_or_else(|| attribution.to_owned()));
        let mut lock = guarded(&lock);
        lock.files.push(Locked { date: today(), licence, attribution, ..locked });
        lock.files.sort_by_key(|locked| order.iter().position(|file| file.written == locked.address));
        write(&lock, &job.path)
    };
    let brought = schedule::for_each_independent(&left_to_do, &Workers::new(REQUESTS), client.stop(), one);
    brought.map_err(|error| stopped_or(error, "fetch"))?;
    steps.finish();
    Ok(())
}

fn guarded<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn write(lock: &Lock, job: &Path) -> Result<(), Fault> {
    let text = lock.text();
    let written = files::write_whole(&Lock::place(job), |out| {
        use std::io::Write;
        out.write_all(text.as_bytes())
    });
    written.map_err(|failure| Fault::last(failure.message().to_owned()))
}

/// Brings a file; `told` hears of every range, with its bytes.
///
/// # Errors
/// When a range does not come, or cannot be written; those that came are kept. When a build could not read the file:
/// then nothing of it is.
fn bring(client: &Client, job: &Job, planned: Planned, told: &(dyn Fn(u64) + Sync)) -> Result<Locked, Fault> {
    // Under its own name, which may say what it is.
    let half = planned.store.beside("made").join(planned.path.file_name().expect("the file has a name"));
    half.parent().map_or(Ok(()), fs::create_dir_all).map_err(|error| disk(&half, &error))?;
    let failed = |error: io::Error| disk(&half, &error);
    match &planned.what {
        What::Whole { has_ranges: false } => in_one_answer(client, &planned, &half, told)?,
        What::Whole { has_ranges: true } => {
            pieces(client, &planned, told)?;
            let all = planned.pieces.iter().map(|piece| planned.store.read(*piece));
            write_to_disk(&half, |out| all.into_iter().try_for_each(|bytes| out.write_all(&bytes?))).map_err(failed)?;
        }
        What::Groups(files) => {
            pieces(client, &planned, told)?;
            let parts: Vec<_> = files.iter().map(|(file, groups)| (file, groups.clone())).collect();
            let bytes = |part: usize, (start, len): (u64, u64)| {
                planned.store.extent(&planned.pieces, (planned.remotes[part].base + start, len))
            };
            write_to_disk(&half, |out| GeoParquet::write(&parts, out, bytes)).map_err(failed)?;
        }
        What::Window { levels, level, chunks, .. } => {
            pieces(client, &planned, told)?;
            let bytes = |chunk| planned.store.extent(&planned.pieces, levels.chunk(*level, chunk));
            write_to_disk(&half, |out| levels.write(*level, chunks, out, bytes)).map_err(failed)?;
        }
    }
    if let Err(fault) = check(client, job, &planned, &half) {
        if !client.stop().load(Ordering::Relaxed) {
            let Planned { path, store, .. } = planned;
            store.remove().map_err(|error| disk(&path, &error))?;
        }
        return Err(fault);
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

/// Refuses what came of a file where a build could not read it.
fn check(client: &Client, job: &Job, planned: &Planned, half: &Path) -> Result<(), Fault> {
    if matches!(planned.what, What::Whole { .. }) && is_page(half).map_err(|error| disk(half, &error))? {
        return Err(page(&planned.written));
    }
    let Some(raster) = raster_of(job, &planned.written) else { return Ok(()) };
    let is_tiff = matches!(planned.what, What::Window { .. });
    match check_raster(client, raster, half) {
        Err(Refused::Stopped(fault)) => Err(fault),
        // Of a GeoTIFF the header was read before. Another raster's may be nothing without a file beside it.
        Err(Refused::Header(_)) if !is_tiff => Ok(()),
        Err(Refused::Header(found) | Refused::Heights(found)) => {
            let found = found.replace(&half.display().to_string(), "what came of it");
            let hint = "nothing of it is kept: run the same command again; where it is damaged again, it is so on its \
                        server, and another source is needed";
            Err(Fault::hinted(format!("{}: it cannot be read: {found}", planned.written), hint))
        }
        Ok(()) => Ok(()),
    }
}

/// Writes a file, down to the disk.
fn write_to_disk(path: &Path, put: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
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
    client.trying(&planned.remotes[0].address, || {
        let mut out = File::create(half).map_err(|error| disk(half, &error))?;
        client.whole(&planned.remotes[0].address, planned.total, &mut |bytes| {
            told(bytes.len() as u64);
            out.write_all(bytes).map_err(|error| disk(half, &error))
        })
    })
}
