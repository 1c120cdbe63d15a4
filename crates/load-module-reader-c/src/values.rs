//! What the functions write for their callers, laid out as `include/load_module_reader.h` says. Pointers of callers
//! that are null or not aligned are never followed.

use std::ffi::c_int;

use load_module_reader::Vertex;

/// `lmr_frame`.
#[repr(C)]
pub struct AreaFrame {
    pub(crate) rows: u32,
    pub(crate) cols: u32,
    pub(crate) side_m: f64,
    pub(crate) east_m: f64,
    pub(crate) north_m: f64,
}

/// `lmr_sample`.
#[repr(C)]
pub struct Sample {
    pub(crate) height_m: f64,
    pub(crate) normal: [f64; 3],
    pub(crate) class_of_ground: u8,
}

/// `lmr_surface`.
#[repr(C)]
pub struct Surface {
    pub(crate) height_m: f64,
    pub(crate) normal: [f64; 3],
    pub(crate) class_of_surface: u8,
    pub(crate) is_deck: u8,
}

/// `lmr_decks`.
#[repr(C)]
pub struct Decks {
    pub(crate) vertices: *const Vertex,
    pub(crate) vertex_count: usize,
    pub(crate) triangles: *const [u16; 3],
    pub(crate) classes: *const u8,
    pub(crate) triangle_count: usize,
}

impl Decks {
    /// Those of a load module, which outlives what is pointed to.
    pub(crate) fn of(decks: &load_module_reader::Decks) -> Self {
        Self {
            vertices: start(&decks.vertices),
            vertex_count: decks.vertices.len(),
            triangles: start(&decks.triangles),
            classes: start(&decks.classes),
            triangle_count: decks.triangles.len(),
        }
    }
}

/// `lmr_line`.
#[repr(C)]
pub struct Line {
    pub(crate) vertices: *const Vertex,
    pub(crate) vertex_count: usize,
    pub(crate) width: u16,
    pub(crate) class_of_way: u8,
    pub(crate) kind: u8,
    pub(crate) form: u8,
    pub(crate) storey: u8,
    pub(crate) is_kept: u8,
    pub(crate) is_in_ground: u8,
}

impl Line {
    /// One of a load module, which outlives what is pointed to.
    pub(crate) fn of(line: &load_module_reader::Line) -> Self {
        Self {
            vertices: line.vertices.as_ptr(),
            vertex_count: line.vertices.len(),
            width: line.width,
            class_of_way: line.class,
            kind: line.kind as u8,
            form: line.form as u8,
            storey: line.storey as u8,
            is_kept: line.is_kept.into(),
            is_in_ground: line.is_in_ground.into(),
        }
    }
}

/// Where a list begins; null for an empty one.
fn start<T>(list: &[T]) -> *const T {
    if list.is_empty() { std::ptr::null() } else { list.as_ptr() }
}

/// `lmr_module`.
#[repr(C)]
pub struct Module {
    pub(crate) row: u32,
    pub(crate) col: u32,
    pub(crate) east_m: f64,
    pub(crate) north_m: f64,
    pub(crate) vertices: *const Vertex,
    pub(crate) vertex_count: usize,
    pub(crate) triangles: *const [u16; 3],
    pub(crate) classes: *const u8,
    pub(crate) triangle_count: usize,
}

/// What a pointer points to, unless it is null or not aligned.
///
/// # Safety
/// If it is neither, it points to a `T` that lives as long as what is returned is used, and nothing writes to it then.
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Option<&'a T> {
    // SAFETY: the caller's word, and what is checked first.
    (!pointer.is_null() && pointer.is_aligned()).then(|| unsafe { &*pointer })
}

/// The same, for something that the caller has this function write: it may hold anything before.
///
/// # Safety
/// If the pointer is neither null nor unaligned, a `T` may be written there.
pub(crate) unsafe fn give<T>(pointer: *mut T, value: T) -> c_int {
    if pointer.is_null() || !pointer.is_aligned() {
        return 0;
    }
    // SAFETY: the caller's word.
    unsafe { pointer.write(value) };
    1
}
