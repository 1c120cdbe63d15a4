//! Raw grids: a header, and the file of numbers that it describes.
#![no_main]

libfuzzer_sys::fuzz_target!(|header: &[u8]| {
    tiefort_fuzz::file("raw.hdr", header);
    tiefort_fuzz::use_up(&tiefort_fuzz::file("raw.flt", &[7; 4096]));
});
