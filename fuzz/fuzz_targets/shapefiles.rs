//! Shapefiles with what lies beside them: the index that says where records begin, and the table of their attributes.
//!
//! The engine makes up all three in one piece of bytes, after two numbers of four bytes that say how long the shapes
//! and the index are.
#![no_main]

use source_files::{BUILT_IN_KEYS, Extent, Wanted, read_features, read_polygons};

const BOUNDS: Extent = Extent { east: [495_000.0, 505_000.0], north: [3_868_000.0, 3_878_000.0] };

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((lengths, rest)) = bytes.split_at_checked(8) else { return };
    let length = |at: usize| u32::from_le_bytes([lengths[at], lengths[at + 1], lengths[at + 2], lengths[at + 3]]);
    let (shapes, rest) = rest.split_at(rest.len().min(length(0) as usize));
    let (index, table) = rest.split_at(rest.len().min(length(4) as usize));
    let path = tiefort_fuzz::file("shapes.shp", shapes);
    for (name, bytes) in [("shapes.shx", index), ("shapes.dbf", table)] {
        match bytes {
            [] => _ = std::fs::remove_file(tiefort_fuzz::folder().join(name)),
            bytes => _ = tiefort_fuzz::file(name, bytes),
        }
    }
    let (layer, crs, keys) = (None, None, &BUILT_IN_KEYS);
    let wanted = Wanted { epsg: 32611, bounds: BOUNDS, layer, crs, keys, buildings: true, points: true };
    if let Ok(file) = read_features(&path, &wanted, &terrain::in_turn) {
        // No record is read twice, and the least of them has twelve bytes.
        assert!(12 * file.found <= shapes.len() as u64, "{} features of {} bytes", file.found, shapes.len());
    }
    let _ = read_polygons(&path, 32611);
});
