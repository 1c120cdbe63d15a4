//! What the ground and the decks of a load module have in common.

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
