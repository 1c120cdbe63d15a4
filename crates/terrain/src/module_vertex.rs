//! A vertex of a load module, of its ground and of its decks.

/// A vertex of a load module, in quanta of 1/128 m from the load module's south-west corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ModuleVertex {
    /// North of the southern side (compared first, as everywhere).
    pub y: u16,
    /// East of the western side.
    pub x: u16,
    /// Height above the datum.
    pub z: i32,
}
