//! Polygons: GeoJSON, Shapefiles, GeoPackages.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = source_files::read_polygons(&tiefort_fuzz::file("polygons", bytes), 32611);
});
