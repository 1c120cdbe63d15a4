//! What does not suffice: a result with both numbers, no error.

use crate::ModuleId;

/// An allowance that is exceeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortfall {
    /// Whose allowance.
    pub of: ShortOf,
    /// Triangles that are needed there.
    pub needed: u32,
    /// Triangles that there are.
    pub room: u32,
}

/// Whose allowance falls short.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ShortOf {
    /// A load module's.
    Module(ModuleId),
    /// That of the window with this south-west load module.
    Window(ModuleId),
    /// That of the whole tile.
    Tile,
}
