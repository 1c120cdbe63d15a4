//! Points and pins: GeoJSON, comma-separated values.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    for name in ["pins.geojson", "points.csv"] {
        let _ = source_files::read_given(&tiefort_fuzz::file(name, bytes), 32611);
    }
});
