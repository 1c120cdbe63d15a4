//! The C interface of `load-module-reader`, described in `include/load_module_reader.h`.
//!
//! The one crate of the workspace where `unsafe` may be: every function takes pointers at the caller's word, and files
//! may be mapped into memory. Nothing is decided here; each function turns its arguments and calls the reader.

use std::ffi::{CStr, c_char, c_int};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use load_module_reader::{Area, Block, Ground, Keep, ReadError, Sight, TileFile, Vertex};
use memmap2::Mmap;

/// `LMR_ALL`: the whole area.
const ALL: u32 = u32::MAX;

/// `lmr_frame`.
#[repr(C)]
pub struct Frame {
    rows: u32,
    cols: u32,
    side_m: f64,
    east_m: f64,
    north_m: f64,
}

/// `lmr_sample`.
#[repr(C)]
pub struct Sample {
    height_m: f64,
    normal: [f64; 3],
    class_of_ground: u8,
}

/// `lmr_module`.
#[repr(C)]
pub struct Module {
    row: u32,
    col: u32,
    east_m: f64,
    north_m: f64,
    vertices: *const Vertex,
    vertex_count: usize,
    triangles: *const [u16; 3],
    classes: *const u8,
    triangle_count: usize,
}

/// The bytes of a mapped file.
struct Mapped(Mmap);

impl AsRef<[u8]> for Mapped {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

fn open(dir: &Path, keep: c_int) -> Result<Area, ReadError> {
    match keep {
        0 => Area::open(dir, Keep::OnDisk),
        1 => Area::open(dir, Keep::InMemory),
        _ => {
            let files = Area::files_in(dir)?;
            Area::of_files(files.iter().map(|path| map(path)).collect::<Result<_, _>>()?)
        }
    }
}

fn map(path: &Path) -> Result<TileFile, ReadError> {
    let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
    let file = File::open(path).map_err(unreadable)?;
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
unsafe fn tell(error: &ReadError, why: *mut c_char, size: usize) {
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

/// Opens a database; see the header.
///
/// # Safety
/// `dir` is a text ended by a zero, `why` null or `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_open(dir: *const c_char, keep: c_int, why: *mut c_char, why_size: usize) -> *mut Area {
    // SAFETY: the caller's word.
    let dir = unsafe { CStr::from_ptr(dir) }.to_string_lossy();
    match open(Path::new(&*dir), keep) {
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
/// `area` comes from `lmr_open`; `frame` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_describe(area: *const Area, frame: *mut Frame) {
    // SAFETY: the caller's word.
    let (area, frame) = unsafe { (&*area, &mut *frame) };
    let of = area.frame();
    let [east_m, north_m] = of.origin_m;
    *frame = Frame { rows: of.rows, cols: of.cols, side_m: of.side_m(), east_m, north_m };
}

/// Levels of detail of every load module.
///
/// # Safety
/// `area` comes from `lmr_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_level_count(area: *const Area) -> u32 {
    // SAFETY: the caller's word.
    u32::from(unsafe { &*area }.frame().level_count)
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
) -> *mut Ground {
    // SAFETY: the caller's word.
    unsafe { lmr_load_level(area, east_m, north_m, reach, 0, why, why_size) }
}

/// Loads the ground around a place at a level of detail.
///
/// # Safety
/// `area` comes from `lmr_open`, `why` is null or `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_load_level(
    area: *const Area,
    east_m: f64,
    north_m: f64,
    reach: u32,
    level: u32,
    why: *mut c_char,
    why_size: usize,
) -> *mut Ground {
    // SAFETY: the caller's word.
    let area = unsafe { &*area };
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
/// `ground` comes from `lmr_load` and is used by nobody else now, `area` comes from `lmr_open`, `why` is null or
/// `why_size` bytes that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_move(
    ground: *mut Ground,
    area: *const Area,
    east_m: f64,
    north_m: f64,
    reach: u32,
    why: *mut c_char,
    why_size: usize,
) -> c_int {
    // SAFETY: the caller's word.
    let (ground, area) = unsafe { (&mut *ground, &*area) };
    let block = block(area, [east_m, north_m], reach);
    if block == ground.block() {
        return 1;
    }
    match ground.moved(area, block) {
        Ok(moved) => {
            *ground = moved;
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
pub unsafe extern "C" fn lmr_unload(ground: *mut Ground) {
    if !ground.is_null() {
        // SAFETY: it came from a box, and the caller gives it back.
        drop(unsafe { Box::from_raw(ground) });
    }
}

/// Height at a place.
///
/// # Safety
/// `ground` comes from `lmr_load`; `height_m` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_height(ground: *const Ground, east_m: f64, north_m: f64, height_m: *mut f64) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { &*ground }.height_m([east_m, north_m]);
    if let Some(found) = found {
        // SAFETY: the caller's word.
        unsafe { *height_m = found };
    }
    c_int::from(found.is_some())
}

/// Height, normal and class at a place.
///
/// # Safety
/// `ground` comes from `lmr_load`; `sample` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_sample_at(ground: *const Ground, east_m: f64, north_m: f64, sample: *mut Sample) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { &*ground }.sample([east_m, north_m]);
    if let Some(found) = found {
        let (height_m, normal, class_of_ground) = (found.height_m, found.normal, found.class);
        // SAFETY: the caller's word.
        unsafe { *sample = Sample { height_m, normal, class_of_ground } };
    }
    c_int::from(found.is_some())
}

/// Heights at many places.
///
/// # Safety
/// `ground` comes from `lmr_load`; `places_m` are `count` pairs, `heights_m` `count` numbers that may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_heights(
    ground: *const Ground,
    places_m: *const [f64; 2],
    heights_m: *mut f64,
    count: usize,
) {
    if count == 0 {
        return;
    }
    // SAFETY: the caller's word.
    let (places, heights) =
        unsafe { (std::slice::from_raw_parts(places_m, count), std::slice::from_raw_parts_mut(heights_m, count)) };
    // SAFETY: the caller's word.
    unsafe { &*ground }.heights_m(places, heights);
}

/// Line of sight.
///
/// # Safety
/// `ground` comes from `lmr_load`; `from_m` and `to_m` are three numbers each; `share` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_sight(
    ground: *const Ground,
    from_m: *const [f64; 3],
    to_m: *const [f64; 3],
    share: *mut f64,
) -> c_int {
    // SAFETY: the caller's word.
    match unsafe { (&*ground).sight(*from_m, *to_m) } {
        Sight::Free => 0,
        Sight::Hidden(at) => {
            if !share.is_null() {
                // SAFETY: the caller's word.
                unsafe { *share = at };
            }
            1
        }
        Sight::Unknown => 2,
    }
}

/// Load modules that are loaded.
///
/// # Safety
/// `ground` comes from `lmr_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_module_count(ground: *const Ground) -> usize {
    // SAFETY: the caller's word.
    unsafe { &*ground }.modules().len()
}

/// One load module for drawing.
///
/// # Safety
/// `ground` comes from `lmr_load` and is not moved while what is pointed to is used; `module` may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_module_at(ground: *const Ground, index: usize, module: *mut Module) -> c_int {
    // SAFETY: the caller's word.
    let ground = unsafe { &*ground };
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
    unsafe { *module = told };
    1
}
