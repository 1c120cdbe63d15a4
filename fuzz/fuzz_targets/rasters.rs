//! Files told by their content: DTED, HGT, Esri ASCII, archives of them, and others.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    tiefort_fuzz::use_up(&tiefort_fuzz::file("rasters", bytes));
});
