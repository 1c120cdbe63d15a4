//! The numbers of the format: what a file begins with, how long its parts are, and what it may hold at most.

/// The first eight bytes of every load-module file; a transfer as text damages them.
pub const MAGIC: [u8; 8] = *b"\x89SLM\r\n\x1a\n";
/// The newest version of the format that this crate reads: of files with a table of parts for each load module.
pub const VERSION: u16 = 3;
/// The version of files with decks and no other parts.
pub const VERSION_WITH_DECKS: u16 = 2;
/// The version of files with nothing but the ground.
pub const VERSION_OF_GROUND: u16 = 1;
/// Levels of detail in a file at most.
pub const LEVELS_MAX: u16 = 8;
/// Quanta in a metre, of coordinates and heights alike.
pub const QUANTA_PER_METRE: u32 = 128;
/// Bytes of the header before its texts.
pub const FIXED_HEADER_BYTES: usize = 124;
/// Bytes of one entry of the index in a file of version 1.
pub const INDEX_ENTRY_BYTES: usize = 32;
/// Bytes that follow in each entry of a file of version 2.
pub const DECK_ENTRY_BYTES: usize = 16;
/// Bytes that follow in each entry of a file of version 3.
pub const PARTS_ENTRY_BYTES: usize = 4;
/// Bytes of a load module's section before its vertices.
pub const FIXED_MODULE_BYTES: usize = 56;
/// Bytes of a part of decks before its vertices in a file of version 2.
pub const FIXED_DECKS_BYTES: usize = 20;
/// The same in a file of version 3.
pub const FIXED_DECKS_PART_BYTES: usize = 8;
/// Bytes of a table of parts before its entries.
pub const FIXED_TABLE_BYTES: usize = 16;
/// Bytes of an entry of a table of parts.
pub const TABLE_ENTRY_BYTES: usize = 12;
/// Bytes of a part of lines before its lines.
pub const FIXED_LINES_BYTES: usize = 8;
/// Bytes of a line before the vertices of all lines.
pub const LINE_BYTES: usize = 8;
/// The kind of the part with decks.
pub const PART_DECKS: u32 = 1;
/// The kind of the part with middle lines of ways.
pub const PART_LINES: u32 = 2;
/// The kind of the part with what stands on the ground.
pub const PART_OBJECTS: u32 = 3;
/// Bytes of a part of objects before its prisms.
pub const FIXED_OBJECTS_BYTES: usize = 24;
/// Bytes of a prism before the corners of all prisms.
pub const PRISM_BYTES: usize = 20;
/// Bytes of a canopy before the places of all canopies.
pub const CANOPY_BYTES: usize = 20;
/// Bytes of the longest file that is read: far above any tile, and small enough to hold in memory.
pub const FILE_BYTES_MAX: u64 = 1 << 30;
/// The class of triangles over a hole: no source has a height there, and their heights only close the surface.
pub const HOLE_CLASS: u8 = 255;
