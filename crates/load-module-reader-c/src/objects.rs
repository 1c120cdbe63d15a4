//! What stands on the ground: sight past it, tops, obstacles, and what is drawn of it.

use std::ffi::c_int;

use load_module_reader::{Corner, Curvature, Hider, LoadedGround, Objects, PastObjects, Sight, Standing};

use crate::INVALID;
use crate::values::{give, given};

/// `lmr_sighting`.
#[repr(C)]
pub struct Sighting {
    share: f64,
    transmission: f64,
    wood_m: f64,
    hidden_by: u8,
}

/// `lmr_top`.
#[repr(C)]
pub struct Top {
    height_m: f64,
    of: u8,
}

/// `lmr_obstacle`.
#[repr(C)]
pub struct Obstacle {
    id: u64,
    distance_m: f64,
    spacing_m: f64,
    kind: u8,
}

/// `lmr_prism`.
#[repr(C)]
pub struct Prism {
    id: u64,
    base: i32,
    roof: i32,
    kind: u8,
    ring_count: usize,
}

/// `lmr_canopy`.
#[repr(C)]
pub struct Canopy {
    id: u64,
    places: *const [u16; 2],
    place_count: usize,
    triangles: *const [u16; 3],
    triangle_count: usize,
    height: u16,
    spacing: u16,
    kind: u8,
    fullness: u8,
}

/// `LMR_BY_GROUND` to `LMR_BY_WALL`; 0 is nothing.
fn number_of(hider: Hider) -> u8 {
    hider as u8 + 1
}

/// Line of sight past objects; see the header.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `from_m` and `to_m` are null or three numbers each; `sighting` is null or
/// may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_sight_past(
    ground: *const LoadedGround,
    from_m: *const [f64; 3],
    to_m: *const [f64; 3],
    objects: c_int,
    least: f64,
    sighting: *mut Sighting,
) -> c_int {
    // SAFETY: the caller's word.
    let (Some(ground), Some(from), Some(to)) = (unsafe { (given(ground), given(from_m), given(to_m)) }) else {
        return INVALID;
    };
    let standing = match objects {
        0 => Standing::None,
        1 => Standing::Buildings,
        2 => Standing::All,
        _ => return INVALID,
    };
    if !(0.0 < least && least <= 1.0) {
        return INVALID;
    }
    let found = ground.sight_past(*from, *to, &PastObjects { standing, least, ..PastObjects::all(Curvature::NONE) });
    let (answer, share) = match found.sight {
        Sight::Free => (0, 1.0),
        Sight::Hidden(at) => (1, at),
        Sight::Unknown => (2, 1.0),
    };
    let hidden_by = found.by.map_or(0, number_of);
    let told = Sighting { share, transmission: found.transmission, wood_m: found.wood_m, hidden_by };
    // SAFETY: the caller's word.
    unsafe { give(sighting, told) };
    answer
}

/// What lies on top.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `top` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_top_at(ground: *const LoadedGround, east_m: f64, north_m: f64, top: *mut Top) -> c_int {
    // SAFETY: the caller's word.
    let found = unsafe { given(ground) }.and_then(|ground| ground.top([east_m, north_m]));
    let Some(found) = found else { return 0 };
    // SAFETY: the caller's word.
    unsafe { give(top, Top { height_m: found.height_m, of: number_of(found.of) }) }
}

/// What a vehicle hits.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `place_m` is null or three numbers; `obstacle` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_obstacle_at(
    ground: *const LoadedGround,
    place_m: *const [f64; 3],
    radius_m: f64,
    obstacle: *mut Obstacle,
) -> c_int {
    // SAFETY: the caller's word.
    let (Some(ground), Some(place_m)) = (unsafe { (given(ground), given(place_m)) }) else { return 0 };
    let Some(found) = ground.obstacle_at(*place_m, radius_m) else { return 0 };
    let spacing_m = found.spacing_m.unwrap_or(0.0);
    let told = Obstacle { id: found.id, distance_m: found.distance_m, spacing_m, kind: found.kind as u8 };
    // SAFETY: the caller's word.
    unsafe { give(obstacle, told) }
}

/// Objects of a load module that is loaded.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`.
unsafe fn objects_of<'a>(ground: *const LoadedGround, index: usize) -> Option<&'a Objects> {
    // SAFETY: the caller's word.
    let ground = unsafe { given(ground) }?;
    Some(&ground.modules().get(index)?.module().objects)
}

/// Buildings, towers and walls of one load module.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_prism_count(ground: *const LoadedGround, index: usize) -> usize {
    // SAFETY: the caller's word.
    unsafe { objects_of(ground, index) }.map_or(0, |objects| objects.prisms.len())
}

/// One of them.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`; `out` is null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_prism_at(
    ground: *const LoadedGround,
    index: usize,
    prism: usize,
    out: *mut Prism,
) -> c_int {
    // SAFETY: the caller's word.
    let Some(found) = unsafe { objects_of(ground, index) }.and_then(|objects| objects.prisms.get(prism)) else {
        return 0;
    };
    let (base, roof, kind) = (found.base, found.roof, found.kind as u8);
    // SAFETY: the caller's word.
    unsafe { give(out, Prism { id: found.id, base, roof, kind, ring_count: found.rings.len() }) }
}

/// A ring of a prism: its corners, or null.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not moved while what is pointed to is used; `corner_count` is null
/// or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_ring_at(
    ground: *const LoadedGround,
    index: usize,
    prism: usize,
    ring: usize,
    corner_count: *mut usize,
) -> *const Corner {
    // SAFETY: the caller's word.
    let prism = unsafe { objects_of(ground, index) }.and_then(|objects| objects.prisms.get(prism));
    let Some(ring) = prism.and_then(|prism| prism.rings.get(ring)) else { return std::ptr::null() };
    // SAFETY: the caller's word.
    let is_told = unsafe { give(corner_count, ring.len()) };
    if is_told == 1 { ring.as_ptr() } else { std::ptr::null() }
}

/// Woods, scrub, orchards and rows of one load module.
///
/// # Safety
/// `ground` is null or comes from `lmr_load`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_canopy_count(ground: *const LoadedGround, index: usize) -> usize {
    // SAFETY: the caller's word.
    unsafe { objects_of(ground, index) }.map_or(0, |objects| objects.canopies.len())
}

/// One of them.
///
/// # Safety
/// `ground` is null, or comes from `lmr_load` and is not moved while what is pointed to is used; `out` is null or may
/// be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lmr_canopy_at(
    ground: *const LoadedGround,
    index: usize,
    canopy: usize,
    out: *mut Canopy,
) -> c_int {
    // SAFETY: the caller's word.
    let Some(found) = unsafe { objects_of(ground, index) }.and_then(|objects| objects.canopies.get(canopy)) else {
        return 0;
    };
    let told = Canopy {
        id: found.id,
        places: found.places.as_ptr(),
        place_count: found.places.len(),
        triangles: found.triangles.as_ptr(),
        triangle_count: found.triangles.len(),
        height: found.height,
        spacing: found.spacing,
        kind: found.kind as u8,
        fullness: found.fullness,
    };
    // SAFETY: the caller's word.
    unsafe { give(out, told) }
}
