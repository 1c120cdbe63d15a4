//! The C interface of `load-module-reader`, described in `include/load_module_reader.h`.
//!
//! The one crate of the workspace where `unsafe` may be: every function takes pointers at the caller's word, and files
//! may be mapped into memory. Nothing is decided here; each function turns its arguments and calls the reader.
//! A pointer that is null or not aligned is never followed: the function answers as the header says.

mod objects;
mod values;

use std::borrow::Cow;
use std::ffi::{CStr, c_char, c_int};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

use load_module_reader::{Area, Block, Keep, LoadedGround, ReadError, Sight, TileFile, open_file};
use memmap2::Mmap;

use crate::values::{AreaFrame, Decks, Line, Module, Sample, Surface};
use crate::values::{give, given};

/// `LMR_ALL`: the whole area.
const ALL: u32 = u32::MAX;
/// `LMR_ON_DISK`, `LMR_IN_MEMORY`, `LMR_MAPPED`.
const ON_DISK: c_int = 0;
const IN_MEMORY: c_int = 1;
const MAPPED: c_int = 2;
/// `LMR_INVALID`.
const INVALID: c_int = 3;
/// Bytes of a list at most: what fits into the memory of any machine.
const BYTES_MAX: usize = isize::MAX as usize;

/// The bytes of a mapped file.
struct Mapped(Mmap);

impl AsRef<[u8]> for Mapped {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

fn open(dir: &Path, keep: c_int) -> Result<Area, String> {
    let opened = match keep {
        ON_DISK => Area::open(dir, Keep::OnDisk),
        IN_MEMORY => Area::open(dir, Keep::InMemory),
        MAPPED => map_all(dir),
        _ => return Err(format!("found keep {keep}, expected {ON_DISK} to {MAPPED}")),
    };
    opened.map_err(|error| error.to_string())
}

fn map_all(dir: &Path) -> Result<Area, ReadError> {
    let files = Area::files_in(dir)?;
    Area::of_files(files.iter().map(|path| map(path)).collect::<Result<_, _>>()?)
}

fn map(path: &Path) -> Result<TileFile, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
    let file = open_file(path)?;
    // SAFETY: the map is only read, and every byte is checked before it is believed. A file that is made shorter
    // meanwhile ends the process, which the header says; ours are replaced by renaming and never change.
    let map = unsafe { Mmap::map(&file) }.map_err(unreadable)?;
    TileFile::of_bytes(path, Arc::new(Mapped(map)))
}

/// The block that `reach` stands for.
fn block(area: &Area, place_m: [f64; 2], reach: u32) -> Block {
    if reach == ALL { area.whole() } else { area.block_around(place_m, reach) }
}

/// Writes a message, cut to fit and ended by a zero.
///
/// # Safety
/// `why` is null or points to `size` bytes that may be written.
unsafe fn tell(error: &dyn Display, why: *mut c_char, size: usize) {
    if why.is_null() || size == 0 {
        return;
    }
    let text = error.to_string();
    let mut length = text.len().min(size - 1);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    // SAFETY: `length` is below `size`, and the text is another piece of memory.
    unsafe {
        std::ptr::copy_nonoverlapping(text.as_ptr(), why.cast::<u8>(), length);
        *why.add(length) = 0;
    }
}

/// A path as C has it: any bytes.
#[cfg(unix)]
fn path_of(text: &CStr) -> Cow<'_, Path> {
    use std::os::unix::ffi::OsStrExt;
    Path::new(std::ffi::OsStr::from_bytes(text.to_bytes())).into()
}

/// A path as C has it, in UTF-8.
#[cfg(not(unix))]
fn path_of(text: &CStr) -> Cow<'_, Path> {
    std::path::PathBuf::from(&*text.to_string_lossy()).into()
}

/// Opens a database; see the header.
///
/// # Safety
/// `dir` is null or a text ended by a zero, `why` null or `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_open(dir: *const c_char, keep: c_int, why: *mut c_char, why_size: usize) -> *mut Area {
    let opened = if dir.is_null() {
        Err("found no `dir`, expected the path of a database".to_owned())
    } else {
        // SAFETY: the caller's word.
        open(&path_of(unsafe { CStr::from_ptr(dir) }), keep)
    };
    match opened {
        Ok(area) => Box::into_raw(Box::new(area)),
        Err(error) => {
            // SAFETY: the caller's word.
            unsafe { tell(&error, why, why_size) };
            std::ptr::null_mut()
        }
    }
}

/// Closes a database.
///
/// # Safety
/// `area` is null, or comes from `lmr_open` and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_close(area: *mut Area) {
    if !area.is_null() {
        // SAFETY: it came from a box, and the caller gives it back.
        drop(unsafe { Box::from_raw(area) });
    }
}

/// Where load modules lie.
///
/// # Safety
/// `area` is null or comes from `lmr_open`; `frame` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_describe(area: *const Area, frame: *mut AreaFrame) -> c_int {
    // SAFETY: the caller's word.
    let Some(area) = (unsafe { given(area) }) else { return 0 };
    let of = area.frame();
    let [east_m, north_m] = of.origin_m;
    let told = AreaFrame { rows: of.rows, cols: of.cols, side_m: of.side_m(), east_m, north_m };
    // SAFETY: the caller's word.
    unsafe { give(frame, told) }
}

/// Levels of detail of every load module.
///
/// # Safety
/// `area` is null or comes from `lmr_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_level_count(area: *const Area) -> u32 {
    // SAFETY: the caller's word.
    unsafe { given(area) }.map_or(0, |area| u32::from(area.frame().level_count))
}

/// Loads the ground around a place at its finest level.
///
/// # Safety
/// As of `lmr_load_level`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_load(
    area: *const Area,
    east_m: f64,
    north_m: f64,
    reach: u32,
    why: *mut c_char,
    why_size: usize,
) -> *mut LoadedGround {
    // SAFETY: the caller's word.
    unsafe { lmr_load_level(area, east_m, north_m, reach, 0, why, why_size) }
}

/// Loads the ground around a place at a level of detail.
///
/// # Safety
/// `area` is null or comes from `lmr_open`, `why` is null or `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_load_level(
    area: *const Area,
    east_m: f64,
    north_m: f64,
    reach: u32,
    level: u32,
    why: *mut c_char,
    why_size: usize,
) -> *mut LoadedGround {
    // SAFETY: the caller's word.
    let Some(area) = (unsafe { given(area) }) else {
        // SAFETY: the caller's word.
        unsafe { tell(&"found no `area`, expected one that is open", why, why_size) };
        return std::ptr::null_mut();
    };
    // No area has as many levels as what does not fit.
    let level = u16::try_from(level).unwrap_or(u16::MAX);
    match area.load_level(block(area, [east_m, north_m], reach), level) {
        Ok(ground) => Box::into_raw(Box::new(ground)),
        Err(error) => {
            // SAFETY: the caller's word.
            unsafe { tell(&error, why, why_size) };
            std::ptr::null_mut()
        }
    }
}

/// Follows the observer.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is in use nowhere else; `area` is null or comes from `lmr_open`,
/// `why` is null or `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_move(
    ground: *mut LoadedGround,
    area: *const Area,
    east_m: f64,
    north_m: f64,
    reach: u32,
    why: *mut c_char,
    why_size: usize,
) -> c_int {
    // SAFETY: the caller's word.
    let (Some(now), Some(area)) = (unsafe { (given(ground), given(area)) }) else {
        // SAFETY: the caller's word.
        unsafe { tell(&"found no `ground` or no `area`, expected both", why, why_size) };
        return 0;
    };
    let block = block(area, [east_m, north_m], reach);
    if block == now.block() && area.frame() == now.frame() {
        return 1;
    }
    match now.moved(area, block) {
        Ok(moved) => {
            // SAFETY: the caller's word; `now` is not used again.
            unsafe { *ground = moved };
            1
        }
        Err(error) => {
            // SAFETY: the caller's word.
            unsafe { tell(&error, why, why_size) };
            0
        }
    }
}

/// Drops what is loaded.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_unload(ground: *mut LoadedGround) {
    if !ground.is_null() {
        // SAFETY: it came from a box, and the caller gives it back.
        drop(unsafe { Box::from_raw(ground) });
    }
}

/// Height at a place.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `height_m` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_height(
    ground: *const LoadedGround,
    east_m: f64,
    north_m: f64,
    height_m: *mut f64,
) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { given(ground) }.and_then(|ground| ground.height_m([east_m, north_m]));
    // SAFETY: the caller's word.
    found.map_or(0, |found| unsafe { give(height_m, found) })
}

/// Height, normal and class at a place.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `sample` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_sample_at(
    ground: *const LoadedGround,
    east_m: f64,
    north_m: f64,
    sample: *mut Sample,
) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { given(ground) }.and_then(|ground| ground.sample([east_m, north_m]));
    let Some(found) = found else { return 0 };
    let told = Sample { height_m: found.height_m, normal: found.normal, class_of_ground: found.class };
    // SAFETY: the caller's word.
    unsafe { give(sample, told) }
}

/// Height of the topmost surface not above a ceiling.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `height_m` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_height_below(
    ground: *const LoadedGround,
    east_m: f64,
    north_m: f64,
    ceiling_m: f64,
    height_m: *mut f64,
) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { given(ground) }.and_then(|ground| ground.height_below_m([east_m, north_m], ceiling_m));
    // SAFETY: the caller's word.
    found.map_or(0, |found| unsafe { give(height_m, found) })
}

/// Height, normal and class of the topmost surface not above a ceiling.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `surface` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_surface_below(
    ground: *const LoadedGround,
    east_m: f64,
    north_m: f64,
    ceiling_m: f64,
    surface: *mut Surface,
) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { given(ground) }.and_then(|ground| ground.sample_below([east_m, north_m], ceiling_m));
    let Some(found) = found else { return 0 };
    let (height_m, normal) = (found.height_m, found.normal);
    let told = Surface { height_m, normal, class_of_surface: found.class, is_deck: found.is_deck.into() };
    // SAFETY: the caller's word.
    unsafe { give(surface, told) }
}

/// Heights at many places.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `places_m` is null or `count` pairs, `heights_m` null or `count` numbers
/// that may be written; the two do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_heights(
    ground: *const LoadedGround,
    places_m: *const [f64; 2],
    heights_m: *mut f64,
    count: usize,
) -> c_int {
    // SAFETY: the caller's word.
    unsafe { fill(ground, places_m, heights_m, count, LoadedGround::heights_m) }
}

/// Heights of the topmost surfaces not above a ceiling, at many places.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `places_m` is null or `count` triples, `heights_m` null or `count`
/// numbers that may be written; the two do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_heights_below(
    ground: *const LoadedGround,
    places_m: *const [f64; 3],
    heights_m: *mut f64,
    count: usize,
) -> c_int {
    // SAFETY: the caller's word.
    unsafe { fill(ground, places_m, heights_m, count, LoadedGround::heights_below_m) }
}

/// Asks for a height at each of many places.
///
/// # Safety
/// As of the two functions above.
unsafe fn fill<T>(
    ground: *const LoadedGround,
    places_m: *const T,
    heights_m: *mut f64,
    count: usize,
    ask: fn(&LoadedGround, &[T], &mut [f64]),
) -> c_int {
    // SAFETY: the caller's word.
    let (ground, first, out) = unsafe { (given(ground), given(places_m), given(heights_m)) };
    let Some(ground) = ground else { return 0 };
    if count == 0 {
        return 1;
    }
    if first.is_none() || out.is_none() || BYTES_MAX / size_of::<T>() < count {
        return 0;
    }
    // SAFETY: the caller's word.
    let (places, heights) =
        unsafe { (std::slice::from_raw_parts(places_m, count), std::slice::from_raw_parts_mut(heights_m, count)) };
    ask(ground, places, heights);
    1
}

/// Line of sight.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `from_m` and `to_m` are null or three numbers each; `share` is null or
/// may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_sight(
    ground: *const LoadedGround,
    from_m: *const [f64; 3],
    to_m: *const [f64; 3],
    share: *mut f64,
) -> c_int {
    // SAFETY: the caller's word.
    let (Some(ground), Some(from), Some(to)) = (unsafe { (given(ground), given(from_m), given(to_m)) }) else {
        return INVALID;
    };
    match ground.sight(*from, *to) {
        Sight::Free => 0,
        Sight::Hidden(at) => {
            // SAFETY: the caller's word.
            unsafe { give(share, at) };
            1
        }
        Sight::Unknown => 2,
    }
}

/// Load modules that are loaded.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_module_count(ground: *const LoadedGround) -> usize {
    // SAFETY: the caller's word.
    unsafe { given(ground) }.map_or(0, |ground| ground.modules().len())
}

/// One load module for drawing.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not moved while what is pointed to is used; `module` is null or
/// may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_module_at(ground: *const LoadedGround, index: usize, module: *mut Module) -> c_int {
    // SAFETY: the caller's word.
    let Some(ground) = (unsafe { given(ground) }) else { return 0 };
    let Some(found) = ground.modules().get(index).map(|found| found.module()) else { return 0 };
    let (frame, row, col) = (ground.frame(), found.row, found.col);
    let told = Module {
        row,
        col,
        east_m: frame.origin_m[0] + f64::from(col) * frame.side_m(),
        north_m: frame.origin_m[1] + f64::from(row) * frame.side_m(),
        vertices: found.vertices.as_ptr(),
        vertex_count: found.vertices.len(),
        triangles: found.triangles.as_ptr(),
        classes: found.classes.as_ptr(),
        triangle_count: found.triangles.len(),
    };
    // SAFETY: the caller's word.
    unsafe { give(module, told) }
}

/// The decks of one load module for drawing.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not moved while what is pointed to is used; `decks` is null or may
/// be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_decks_at(ground: *const LoadedGround, index: usize, decks: *mut Decks) -> c_int {
    // SAFETY: the caller's word.
    let Some(ground) = (unsafe { given(ground) }) else { return 0 };
    let Some(found) = ground.modules().get(index).map(|found| &found.module().decks) else { return 0 };
    // SAFETY: the caller's word.
    unsafe { give(decks, Decks::of(found)) }
}

/// Lines of one load module.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_line_count(ground: *const LoadedGround, index: usize) -> usize {
    // SAFETY: the caller's word.
    let ground = unsafe { given(ground) };
    ground.and_then(|ground| ground.modules().get(index)).map_or(0, |found| found.module().lines.len())
}

/// One line of one load module.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not moved while what is pointed to is used; `out` is null or may
/// be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_line_at(ground: *const LoadedGround, index: usize, line: usize, out: *mut Line) -> c_int {
    // SAFETY: the caller's word.
    let Some(ground) = (unsafe { given(ground) }) else { return 0 };
    let Some(found) = ground.modules().get(index).and_then(|found| found.module().lines.get(line)) else { return 0 };
    // SAFETY: the caller's word.
    unsafe { give(out, Line::of(found)) }
}
