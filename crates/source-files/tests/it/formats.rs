//! The formats besides GeoTIFF, on small files made here.

use std::io::Write;
use std::path::Path;

use source_files::{Crs, DemFile, Raster, Reading, SourceError};
use terrain::Post;

use crate::support::{Folder, Tiff};

fn open(path: &Path, reading: &Reading) -> Result<Raster, SourceError> {
    let file = DemFile::open(path, reading)?;
    file.read(file.rect())
}

fn utm() -> Reading {
    Reading { crs: Some(Crs::from_epsg(32611).unwrap()), ..Reading::AS_IT_SAYS }
}

#[track_caller]
fn refused(name: &str, bytes: &[u8], expected: &str) {
    let folder = Folder::new();
    let error = open(&folder.write(name, bytes), &Reading::AS_IT_SAYS).expect_err("this file is refused");
    assert!(error.to_string().contains(expected), "{error}");
    assert!(error.to_string().contains(name) && error.hint().is_some(), "{error}");
}

/// A DTED cell of 3 meridians and 5 posts each, 10 seconds apart, from 117 W, 35 N; `height(row, col)`.
fn dted(height: impl Fn(i32, i32) -> i16) -> Vec<u8> {
    let mut bytes = b"UHL11170000W0350000N010001000007U  DT1         000300050".to_vec();
    bytes.resize(80 + 648 + 2700, b' ');
    bytes[80 + 141..80 + 149].copy_from_slice(b"E96WGS84");
    bytes[80 + 648 + 7..80 + 648 + 11].copy_from_slice(b"0007");
    for col in 0..3 {
        bytes.extend(record(col, |row| height(row, col)));
    }
    bytes
}

fn record(col: i32, height: impl Fn(i32) -> i16) -> Vec<u8> {
    let mut record = vec![0xaa, 0, 0, col as u8, 0, col as u8, 0, 0];
    for row in 0..5 {
        let sign = if height(row) < 0 { 0x8000 } else { 0 };
        record.extend((height(row).unsigned_abs() | sign).to_be_bytes());
    }
    let sum: u32 = record.iter().map(|&byte| u32::from(byte)).sum();
    [record, sum.to_be_bytes().to_vec()].concat()
}

fn sloping(row: i32, col: i32) -> i16 {
    (row * 10 + col - 12) as i16
}

#[track_caller]
fn check_sloping(raster: &Raster) {
    for row in 0..5 {
        for col in 0..3 {
            assert_eq!(raster.height_m(Post::new(row, col)), Some(f64::from(sloping(row, col))), "{row},{col}");
        }
    }
}

#[test]
fn a_dted_cell_is_read_by_meridian_from_the_south_in_sign_and_magnitude() {
    let folder = Folder::new();
    let path = folder.write("a.dt1", &dted(sloping));
    let file = DemFile::open(&path, &Reading::AS_IT_SAYS).unwrap();
    assert_eq!((file.vertical_datum(), file.accuracy_m()), (Some("EGM96"), Some(7.0)));
    assert_eq!(file.frame().south_west, [-117.0, 35.0]);
    assert_eq!(file.frame().spacing, [100.0 / 36_000.0; 2]);
    check_sloping(&file.read(file.rect()).unwrap());
}

#[test]
fn a_wrong_checksum_is_told_with_its_column_and_refused_when_strict() {
    let folder = Folder::new();
    let mut bytes = dted(sloping);
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    let path = folder.write("a.dt1", &bytes);
    let raster = open(&path, &Reading::AS_IT_SAYS).unwrap();
    check_sloping(&raster);
    assert!(raster.notes()[0].contains("the checksum of column 2 is"), "{:?}", raster.notes());
    let strict = open(&path, &Reading { strict: true, ..Reading::AS_IT_SAYS });
    assert!(matches!(strict, Err(SourceError::Checksum { column: 2, .. })));
}

#[test]
fn a_partial_cell_has_voids_where_it_has_no_record() {
    let folder = Folder::new();
    let whole = dted(sloping);
    let record = whole.len() - 22;
    let partial = [&whole[..80 + 648 + 2700], &whole[record..]].concat();
    let raster = open(&folder.write("a.dt1", &partial), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(raster.void_count(), 10);
    assert_eq!(raster.height_m(Post::new(4, 2)), Some(30.0));
    let twice = [&whole[..80 + 648 + 2700], &whole[record..], &whole[record..]].concat();
    refused("b.dt1", &twice, "malformed: a partial cell is the record of meridian 2");
    refused("c.dt1", &whole[..whole.len() - 1], "truncated");
}

#[test]
fn twos_complement_in_a_dted_cell_is_told() {
    let folder = Folder::new();
    let mut bytes = dted(sloping);
    let at = bytes.len() - 14;
    bytes[at..at + 2].copy_from_slice(&(-5_i16).to_be_bytes());
    let raster = open(&folder.write("a.dt1", &bytes), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(raster.height_m(Post::new(0, 2)), Some(-5.0));
    assert!(raster.notes().iter().any(|note| note.contains("1 posts of column 2 are taken for two's complement")));
}

#[test]
fn an_hgt_tile_is_placed_by_its_name_or_by_the_corner_given() {
    let folder = Folder::new();
    let mut bytes = vec![0; 1201 * 1201 * 2];
    bytes[..2].copy_from_slice(&77_i16.to_be_bytes());
    bytes[2..4].copy_from_slice(&(-32768_i16).to_be_bytes());
    let raster = open(&folder.write("N35W117.hgt", &bytes), &Reading::AS_IT_SAYS).unwrap();
    let file = DemFile::open(&folder.path("N35W117.hgt"), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!((file.format(), file.vertical_datum()), ("HGT", Some("EGM96")));
    assert_eq!(raster.frame().south_west, [-117.0, 35.0]);
    assert_eq!((raster.height_m(Post::new(1200, 0)), raster.void_count()), (Some(77.0), 1));
    let other = folder.write("tile", &bytes);
    assert!(matches!(open(&other, &Reading::AS_IT_SAYS), Err(SourceError::NoCorner { .. })));
    let cornered = open(&other, &Reading { corner: Some([5.0, -3.0]), ..Reading::AS_IT_SAYS }).unwrap();
    assert_eq!(cornered.frame().place(0, 1200), [6.0, -3.0]);
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in [("../../etc/N36E005.hgt", bytes.as_slice()), ("readme.txt", b"x")] {
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    let zipped = folder.write("anything.zip", &zip.finish().unwrap().into_inner());
    assert_eq!(open(&zipped, &Reading::AS_IT_SAYS).unwrap().frame().south_west, [5.0, 36.0]);
}

const ASCII: &str = "ncols 3\nnrows 5\nxllcorner 499985\nyllcenter 4000000\ncellsize 30\nNODATA_value -1\n";

fn numbers() -> String {
    let row = |row: i32| (0..3).map(|col| format!("{} ", sloping(row, col))).collect::<String>();
    (0..5).rev().map(|north| row(north) + "\r\n").collect()
}

#[test]
fn a_text_grid_is_read_in_corner_and_centre_registration() {
    let folder = Folder::new();
    let text = ASCII.to_owned() + &numbers().replace("-1 ", "-1.0 ");
    let path = folder.write("a.asc", text.to_uppercase().as_bytes());
    let raster = open(&path, &utm()).unwrap();
    assert_eq!(raster.frame().south_west, [500_000.0, 4_000_000.0]);
    assert_eq!((raster.void_count(), raster.height_m(Post::new(4, 2))), (1, Some(30.0)));
    folder.write("a.prj", br#"PROJCS["x",GEOGCS["x",DATUM["x"]],AUTHORITY["EPSG","26911"]]"#);
    assert_eq!(open(&path, &Reading::AS_IT_SAYS).unwrap().frame().crs.epsg(), Some(26911));
}

#[test]
fn text_grids_that_lie_about_themselves_are_refused() {
    let (head, tail) = (ASCII.to_owned(), numbers());
    let with_crs = |name: &str, text: &str, expected: &str| {
        let folder = Folder::new();
        let error = open(&folder.write(name, text.as_bytes()), &utm()).expect_err("this file is refused").to_string();
        assert!(error.contains(expected), "{error}");
    };
    with_crs("a.asc", &(head.clone() + &tail[..tail.len() - 6]), "the grid is 14 numbers, expected 15");
    with_crs("a.asc", &(head.clone() + &tail + "7"), "more than 15 numbers");
    with_crs("a.asc", &(head.clone() + &tail.replace("29", "x9")), "number 1 of line 0 is `x9`");
    with_crs("a.asc", &(head.replace("ncols 3", "ncols 900000") + &tail), "truncated: the last number");
    with_crs("a.asc", &(head.replace("ncols 3", "ncols 99999999") + &tail), "too large");
    with_crs("a.asc", &(head.replace("ncols 3", "ncols -3") + &tail), "ncols is `-3`");
    with_crs("a.asc", &(head.replace("cellsize 30", "cellsize -30") + &tail), "malformed: the place of the raster");
    with_crs("a.asc", &(head.replace("cellsize 30", "cellsize nan") + &tail), "malformed: the place of the raster");
    with_crs("a.asc", &(head.replace("xllcorner", "xcorner") + &tail), "no position");
}

#[test]
fn raw_grids_are_read_in_every_type_and_byte_order() {
    let heights = || (0..5).rev().flat_map(|row| (0..3).map(move |col| sloping(row, col)));
    let bil = "NROWS 5\nNCOLS 3\nLAYOUT BIL\nULXMAP 500000\nULYMAP 4000120\nXDIM 30\nYDIM 30\n";
    let cases: [(&str, String, Vec<u8>); 4] = [
        ("a.bil", format!("{bil}NBITS 16\nBYTEORDER M\n"), heights().flat_map(i16::to_be_bytes).collect()),
        (
            "a.bil",
            format!("{bil}NBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER I\nSKIPBYTES 3\nTOTALROWBYTES 8\n"),
            [vec![9; 3], heights().collect::<Vec<_>>().chunks(3).flat_map(padded).collect()].concat(),
        ),
        ("a.bil", format!("{bil}NBITS 64\nPIXELTYPE FLOAT\nBYTEORDER M\n"), wide(heights(), f64::to_be_bytes)),
        ("a.flt", ASCII.replace("-1", "-99") + "BYTEORDER LSBFIRST\n", wide(heights(), |m| (m as f32).to_le_bytes())),
    ];
    for (name, header, bytes) in cases {
        let folder = Folder::new();
        let hdr = folder.write("a.hdr", header.as_bytes());
        let raster = open(&folder.write(name, &bytes), &utm()).unwrap();
        assert_eq!(raster.frame().south_west, [500_000.0, 4_000_000.0], "{header}");
        check_sloping(&raster);
        check_sloping(&open(&hdr, &utm()).unwrap());
        let truncated = open(&folder.write(name, &bytes[..bytes.len() - 3]), &utm());
        assert!(truncated.is_err(), "{header}");
    }
    refused("b.hdr", format!("{bil}NBITS 16\n").as_bytes(), "the header of a raw grid, but no grid beside it");
}

fn padded(row: &[i16]) -> Vec<u8> {
    row.iter().chain(&[0]).flat_map(|height| height.to_le_bytes()).collect()
}

fn wide<const N: usize>(heights: impl Iterator<Item = i16>, bytes: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    heights.flat_map(|height| bytes(height.into())).collect()
}

#[test]
fn a_geographic_tiff_is_read_and_one_in_an_archive_too() {
    let folder = Folder::new();
    let tiff = Tiff::of_heights(&[&[1, 2, 3], &[4, 5, 6]]);
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&tiff.bytes()).unwrap();
    let raster = open(&folder.write("x.tif.gz", &packed.finish().unwrap()), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(raster.height_m(Post::new(0, 2)), Some(6.0));
    assert_eq!(raster.frame().crs.epsg(), Some(32611));
}

#[test]
fn what_is_no_raster_is_told_by_its_content() {
    refused("a.tif", b"", "an empty file");
    refused("a.tif", b"\x01\x02\x03", "it begins with 01 02 03");
    refused("a.tif", b"<html><body>not found</body></html>", "a page of HTML or XML");
    refused("a.img", b"EHFA_HEADER_TAG\0", "an ERDAS Imagine file");
    refused("a.nc", b"\x89HDF\r\n\x1a\n", "an HDF5 or netCDF 4 file");
    refused("a.vrt", b"<VRTDataset rasterXSize=\"3\">", "a GDAL virtual raster");
    refused("a.zip", b"PK\x05\x06\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", "the archive holds 0 files");
    refused("a.gz", b"\x1f\x8b\x08\0garbage", "the archive is it cannot be unpacked");
}

#[test]
fn every_truncation_is_an_error_and_no_flipped_byte_a_panic() {
    let folder = Folder::new();
    let ascii = ASCII.to_owned() + &numbers();
    for (name, bytes) in [("a.dt1", dted(sloping)), ("a.asc", ascii.into_bytes())] {
        let step = if name == "a.dt1" { 61 } else { 1 };
        for end in (0..bytes.len() - 4).step_by(step) {
            assert!(open(&folder.write(name, &bytes[..end]), &utm()).is_err(), "{name} cut at {end}");
        }
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1 << (at % 8);
            let _ = open(&folder.write(name, &flipped), &utm());
        }
    }
}
