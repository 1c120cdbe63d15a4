//! GeoTIFF files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    tiefort_fuzz::use_up(&tiefort_fuzz::file("geotiff", bytes));
});
