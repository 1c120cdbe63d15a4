//! How large anything in a job may be, and why.

/// Bytes of a job file: thousands of times a real one, so that a DEM named by mistake is not read as text.
pub const JOB_BYTES_MAX: u64 = 1 << 20;

/// Posts along a side of the area, less one: lattice coordinates (eighths) then fit 23 bits and every product of two
/// is exact in 64. It is 26,000 km at 25 m.
pub const CELLS_A_SIDE_MAX: i32 = 1 << 20;

/// Levels of a load module beside the finest: the file format counts up to eight.
pub const COARSER_LEVELS_MAX: usize = 7;

/// Load modules in the area: the ledger of counts holds each of them in memory.
pub const MODULES_MAX: u64 = 1 << 24;

/// Side of a load module in quanta of 1/128 m: its vertices have 16-bit coordinates.
pub const SIDE_QUANTA_MAX: u32 = u16::MAX as u32;

/// Metres from the origin of a projection: beyond any projection of the Earth, and exact to 1/128 m in an `f64`.
pub const COORDINATE_M_MAX: f64 = 1.0e8;

/// Tiles: each has three files and a place in `database.json`.
pub const TILES_MAX: u64 = 1 << 16;

/// Weight of a post: it is kept in 16 bits of thousandths.
pub const WEIGHT_MAX: f64 = 65.535;

/// Importance areas: each is laid over every window of the mask.
pub const AREAS_MAX: usize = 1000;

/// Classes besides the default one: a class is kept in 8 bits, and the last number means a hole.
pub const CLASSES_MAX: usize = 254;

/// Source files: a mosaic of every cell of the Earth is 64,800.
pub const SOURCES_MAX: usize = 65_536;

/// Characters of a name: leaves room in the 255 bytes of a file name for what is put behind it.
pub const NAME_CHARS_MAX: usize = 100;

/// Characters of a title: a line that a page can show.
pub const TITLE_CHARS_MAX: usize = 200;

/// Triangles in a load module: its vertices are named by 16 bits.
pub const PER_MODULE_MAX: u64 = u16::MAX as u64;

/// Triangles in a window, in the pool, and selected points: vertices and triangles are named by 32 bits.
pub const COUNT_MAX: u64 = u32::MAX as u64;

/// Posts across which a void may be filled: beyond it the filled ground is invented.
pub const FILL_POSTS_MAX: u64 = 1024;

/// Metres over which one source fades into another: beyond it there is no seam to hide.
pub const FEATHER_M_MAX: f64 = 100_000.0;

/// Residuals and tolerances in metres: heights go no further (24 bits of quanta).
pub const RESIDUAL_M_MAX: f64 = 131_071.0;

/// The side of the window that the third limit speaks of, in metres.
pub const WINDOW_M: f64 = 4000.0;

/// EPSG codes: those below are datums and units, those above are other registries'.
pub const EPSG_RANGE: std::ops::RangeInclusive<u32> = 1024..=32_766;

/// Geographic coordinate systems that DEMs come in; a few of many, so that the common mistake has a clear message.
pub const EPSG_GEOGRAPHIC: [u32; 13] = [4326, 4979, 4258, 4269, 4267, 4283, 4322, 4490, 4612, 4617, 4674, 6318, 7844];

/// Kilometres a side of an area around a place: half around the Earth.
pub const AROUND_KM_MAX: f64 = 20_000.0;
/// Metres in a unit of height: a micrometre to a kilometre.
pub const HEIGHT_UNIT_M: std::ops::RangeInclusive<f64> = 1.0e-6..=1.0e3;
/// No water on Earth lies farther from the level of the sea.
pub const LEVEL_M_MAX: f64 = 10_000.0;
/// Load modules that a tile is at least wide, unless it spans the area.
pub const MODULES_PER_TILE_MIN: u32 = 2;
/// Metres of a step in which residuals are compared.
pub const QUANTUM_M_MAX: f64 = 1000.0;
/// RMS residual to aim at, about a hundredth of a quantum: heights are rounded to 1/128 m, so a smaller one means none
/// at all.
pub const RMS_M_MIN: f64 = 1.0e-4;
/// Seeds of the built-in terrain: those that TOML can write.
pub const SEED_MAX: u64 = i64::MAX as u64;
/// Characters of an attribution.
pub const THANKS_CHARS_MAX: usize = 1000;
/// Characters of a coordinate system spelled out.
pub const WKT_CHARS_MAX: usize = 1 << 16;
/// A square is two triangles: no load module has fewer.
pub const TRIANGLES_MIN: u64 = 2;
/// Geoid grids of a job: there are not that many vertical datums.
pub const GEOIDS_MAX: usize = 16;
/// Characters of the name of a vertical datum.
pub const DATUM_CHARS_MAX: usize = 64;
/// Metres over which slopes may be averaged: a halo of that size is read around every tile.
pub const SMOOTH_M_MAX: f64 = 10_000.0;
/// Slope in percent of a wall nearly upright.
pub const SLOPE_PERCENT_MAX: f64 = 10_000.0;
/// Files and folders that a pattern may look at: more than any archive of rasters has, and a few seconds.
pub const VISITED_MAX: usize = 500_000;
/// Entries of `features.sources`: an entry for each layer of each file of a country.
pub const FEATURE_SOURCES_MAX: usize = 4096;
/// Rules of `features.rules`: each is tried on each feature.
pub const RULES_MAX: usize = 1000;
/// Tags in `where` of a rule, and values of one of them.
pub const TAGS_MAX: usize = 1000;
/// Characters of a tag's key or value: what OpenStreetMap allows.
pub const TAG_CHARS_MAX: usize = 255;
/// Characters of the name of a layer.
pub const LAYER_CHARS_MAX: usize = 255;
/// Metres of width that a rule may give: a step of heights to the widest runway and its shoulders.
pub const RULE_WIDTH_M: std::ops::RangeInclusive<f64> = 0.01..=500.0;
/// Percent of the greatest grade that a rule may give: half a right angle is the most.
pub const RULE_GRADE_PERCENT: std::ops::RangeInclusive<f64> = 0.01..=100.0;
/// Times that posts weigh which lie on features that there was no room for.
pub const LEFT_OUT_WEIGHT: std::ops::RangeInclusive<f64> = 0.0..=10.0;

/// The share of a load module's limit that features may take.
pub const SHARE_MAX: std::ops::RangeInclusive<f64> = 0.01..=1.0;
/// Corners of a building: fewer than four are no house.
pub const OBJECT_CORNERS: std::ops::RangeInclusive<u64> = 4..=255;
/// Square metres under which buildings may be left out.
pub const OBJECT_AREA_M2: std::ops::RangeInclusive<f64> = 0.0..=10_000.0;
/// Metres of height that a rule may give: the highest building has 828.
pub const OBJECT_HEIGHT_M: std::ops::RangeInclusive<f64> = 0.1..=1000.0;
/// Metres of the side of a cell of leaves.
pub const CANOPY_CELL_M: std::ops::RangeInclusive<f64> = 2.0..=100.0;
/// Polygons of objects in a load module or a square of 4 km.
pub const OBJECT_LIMIT: std::ops::RangeInclusive<u64> = 0..=10_000_000;
/// Metres that decks may be asked to keep clear of what runs below: the highest bridges leave so much.
pub const CLEARANCE_M_MAX: f64 = 100.0;
/// Metres that roads and rivers may cut into the ground or be filled before their grades give way.
pub const EARTHWORK_M_MAX: f64 = 1000.0;
/// How many times its greatest grade a road may be.
pub const GRADE_GIVE: std::ops::RangeInclusive<f64> = 1.0..=10.0;
/// Posts along a road over which the ground is smoothed.
pub const SMOOTH_POSTS: std::ops::RangeInclusive<f64> = 0.0..=100.0;
/// The share of the ground along a river that lies below it.
pub const RIVER_TAU: std::ops::RangeInclusive<f64> = 0.01..=0.99;
/// Metres back along a way in which the bank of a deck may sag.
pub const BANK_M_MAX: f64 = 1000.0;
/// Metres above the ground that an eye may be: lower ones see nothing but the next bump, higher ones fly.
pub const EYE_M: std::ops::RangeInclusive<f64> = 0.5..=100.0;
/// Metres that an eye may look.
pub const SIGHT_M: std::ops::RangeInclusive<f64> = 100.0..=10_000.0;
