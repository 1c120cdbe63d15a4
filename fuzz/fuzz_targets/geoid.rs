//! Geoid grids.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(geoid) = source_files::Geoid::read(&tiefort_fuzz::file("geoid", bytes), 34.0, 36.0) else { return };
    for place in [[-117.0, 35.0], [180.0, 34.0], [-180.0, 36.0], [539.9, 35.5]] {
        let _ = geoid.height_m(place);
    }
});
