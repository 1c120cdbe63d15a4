//! Sizes of the parts of a file, and what the ground and the decks of a load module have in common.

/// Bytes of a load module's section before its vertices.
pub const FIXED_MODULE_BYTES: usize = 56;

/// Bytes of a part of decks before its vertices.
pub const FIXED_DECKS_BYTES: usize = 20;

/// The class of triangles over a hole: no source has a height there, and their heights only close the surface.
pub const HOLE_CLASS: u8 = 255;

/// A vertex, in quanta of 1/128 m from the load module's south-west corner. It lies in memory as C would have it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vertex {
    /// East of the western side.
    pub x: u16,
    /// North of the southern side.
    pub y: u16,
    /// Above the vertical datum.
    pub z: i32,
}
