//! What rasters say their heights are measured from.

use source_files::{Crs, DemFile, Reading};

use crate::support::{Folder, Tiff, Values};

/// The datum of a raster in UTM zone 11 with these keys besides.
#[track_caller]
fn check(keys: &[(u16, u16)], expected: Option<&str>) {
    let folder = Folder::new();
    let utm = [(1024, 1), (1025, 1), (3072, 32611)];
    let tiff = Tiff::of_heights(&[&[1, 2], &[3, 4]]).with_keys(&[&utm, keys].concat());
    let file = DemFile::open(&folder.write("a.tif", &tiff.bytes()), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(file.vertical_datum(), expected, "{keys:?}");
}

#[test]
fn a_vertical_system_names_its_datum_whatever_its_unit() {
    for code in [5703, 6360, 8228] {
        check(&[(4096, code)], Some("NAVD88"));
    }
    check(&[(4096, 5702)], Some("NGVD29"));
    check(&[(4096, 7837)], Some("DHHN2016"));
    check(&[(4096, 5760)], Some("EPSG:5760"));
    check(&[(4096, 5714)], None);
    check(&[(4096, 5103), (4099, 9001)], Some("NAVD88"));
    check(&[(4096, 32767), (4098, 5103), (4099, 9001)], Some("NAVD88"));
    check(&[], None);
}

#[test]
fn a_compound_system_names_its_datum_and_the_systems_own_key_counts_more() {
    let folder = Folder::new();
    let datum = |name: &str, keys: &[(u16, u16)], reading: &Reading| {
        let tie = vec![0.0, 0.0, 0.0, 5.0, 36.0, 0.0];
        let tiff = Tiff::of_heights(&[&[1, 2], &[3, 4]]).with_keys(keys).with(33922, Values::Double(tie));
        let tiff = tiff.with(33550, Values::Double(vec![0.001, 0.001, 0.0]));
        let file = DemFile::open(&folder.write(name, &tiff.bytes()), reading).unwrap();
        file.vertical_datum().unwrap_or_default().to_owned()
    };
    let as_it_says = |keys: &[(u16, u16)]| datum("a.tif", keys, &Reading::AS_IT_SAYS);
    assert_eq!(as_it_says(&[(1024, 1), (3072, 7415)]), "NAP");
    assert_eq!(as_it_says(&[(1024, 2), (2048, 5498)]), "NAVD88");
    assert_eq!(as_it_says(&[(1024, 2), (2048, 9518)]), "EGM2008");
    assert_eq!(as_it_says(&[(1024, 2), (2048, 4979)]), "ellipsoid");
    assert_eq!(as_it_says(&[(1024, 2), (2048, 4979), (4096, 5773)]), "EGM96");
    let said = Reading { crs: Some(Crs::from_epsg(5498).unwrap()), ..Reading::AS_IT_SAYS };
    assert_eq!(datum("b.tif", &[(1024, 2), (2048, 4326), (4096, 5773)], &said), "NAVD88", "as the job says");
}

#[test]
fn a_text_grid_has_the_datum_of_the_text_beside_it() {
    let folder = Folder::new();
    let heights = r#"VERT_CS["NAP height",VERT_DATUM["x",2005],UNIT["metre",1],AUTHORITY["EPSG","5709"]]"#;
    let text = format!(r#"COMPD_CS["x",PROJCS["x",AUTHORITY["EPSG","32611"]],{heights}]"#);
    folder.write("a.prj", text.as_bytes());
    let grid = "ncols 2\nnrows 2\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\n1 2\n3 4\n";
    let file = DemFile::open(&folder.write("a.asc", grid.as_bytes()), &Reading::AS_IT_SAYS).unwrap();
    assert_eq!(file.vertical_datum(), Some("NAP"));
}
