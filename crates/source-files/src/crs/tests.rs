//! A few figures computed by PROJ 9.5.1; a thousand places of each system are compared by `scripts/compare.py crs`.

use super::*;

/// WGS 84 longitude and latitude, and where PROJ puts them.
#[track_caller]
fn check(crs: &Crs, lon_lat: [f64; 2], expected: [f64; 2]) {
    let wgs84 = Crs::wgs84();
    let found = wgs84.to(crs, lon_lat).unwrap();
    let unit_m = crs.unit_m().unwrap_or(111_319.0);
    for axis in 0..2 {
        assert!((found[axis] - expected[axis]).abs() * unit_m < 1.0e-3, "{crs:?}: {found:?}, expected {expected:?}");
    }
    let back = crs.to(&wgs84, found).unwrap();
    assert!((0..2).all(|axis| (back[axis] - lon_lat[axis]).abs() < 1.0e-8), "{crs:?} there and back: {back:?}");
}

#[test]
fn places_agree_with_proj_to_a_millimetre() {
    let systems = [
        (32611, [-116.6, 35.3], [536_367.040_835, 3_906_386.105_537]),
        (32733, [14.2, -22.7], [417_832.831_374, 7_489_468.144_240]),
        (26910, [-122.1, 46.2], [569_437.452_681, 5_116_662.889_638]),
        (5070, [-113.6, 44.0], [-1_398_484.841_533, 2_464_189.626_386]),
        (2154, [5.3, 44.2], [883_800.996_896, 6_347_231.403_795]),
        (3857, [-113.0, 36.1], [-12_579_102.459_640, 4_314_389.956_334]),
        (3035, [11.4, 47.6], [4_426_342.193_713, 2_721_705.642_609]),
        (2229, [-118.1, 34.3], [6_531_465.153_691, 1_931_572.780_162]),
        (4269, [-118.1, 34.3], [-118.1, 34.3]),
    ];
    for (code, lon_lat, expected) in systems {
        check(&Crs::from_epsg(code).unwrap(), lon_lat, expected);
    }
}

const DEGREES: &str = r#"GEOGCS["x",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],
    PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]"#;

fn projected(method: &str, parameters: &[(&str, f64)]) -> Crs {
    let parameters: String = parameters.iter().map(|(name, value)| format!("PARAMETER[\"{name}\",{value}],")).collect();
    let text = format!(r#"PROJCS["own",{DEGREES},PROJECTION["{method}"],{parameters}UNIT["Meter",1.0]]"#);
    Crs::from_wkt(&text).unwrap()
}

#[test]
fn a_system_spelled_out_in_well_known_text_is_computed() {
    let mercator = projected(
        "Transverse_Mercator",
        &[
            ("False_Easting", 200_000.0),
            ("False_Northing", -50_000.0),
            ("Central_Meridian", -116.5),
            ("Scale_Factor", 0.9999),
            ("Latitude_Of_Origin", 10.0),
        ],
    );
    check(&mercator, [-116.6, 35.3], [190_905.534_384, 2_751_745.449_887]);
    let albers = projected(
        "Albers",
        &[
            ("Central_Meridian", -110.0),
            ("Standard_Parallel_1", 29.5),
            ("Standard_Parallel_2", 45.5),
            ("Latitude_Of_Origin", 23.0),
        ],
    );
    check(&albers, [-113.6, 44.0], [-287_626.682_315, 2_339_768.132_765]);
    assert_eq!(albers.epsg(), None);
}

#[test]
fn utm_and_degrees_are_recognised_however_they_are_written() {
    let zone = [("False_Easting", 5.0e5), ("Central_Meridian", -117.0), ("Scale_Factor", 0.9996)];
    assert_eq!(projected("Transverse_Mercator", &zone), Crs::from_epsg(32611).unwrap());
    assert_eq!(Crs::from_wkt(DEGREES).unwrap().epsg(), Some(4326));
    let coded = r#"PROJCRS["ETRS89 / UTM zone 32N",ID["EPSG",25832]]"#;
    assert_eq!(Crs::from_wkt(coded).unwrap(), Crs::named("epsg:25832").unwrap());
}

#[test]
fn what_cannot_be_computed_is_refused_by_name() {
    let refused = |text: &str| Crs::named(text).expect_err("this system is refused");
    assert!(refused("EPSG:4267").contains("needs a grid of shifts"));
    assert!(refused("EPSG:5514").contains("krovak"));
    assert!(refused("EPSG:4978").contains("geocentric"));
    assert!(refused("EPSG:99999").contains("not in the table"));
    assert!(refused("EPSG:x").contains("without a number"));
    assert!(refused(&DEGREES.replace("D_WGS_1984", "D_Mars_2000")).contains("D_Mars_2000"));
    assert!(refused(&DEGREES.replace("Greenwich\",0.0", "Paris\",2.337")).contains("meridian 2.337"));
    for text in ["", "nonsense", "GEOGCS[", "GEOGCS[\"x", "GEOGCS[\"x\",", &"A[".repeat(1000), "LOCAL_CS[\"x\"]"] {
        assert!(!refused(text).is_empty(), "{text}");
    }
}

#[test]
fn a_place_outside_a_projection_is_none_and_not_a_number() {
    let utm = Crs::from_epsg(32611).unwrap();
    assert_eq!(Crs::wgs84().to(&utm, [-117.0, 95.0]), None);
    assert_eq!(Crs::wgs84().to(&utm, [f64::NAN, 0.0]), None);
    assert_eq!(Crs::utm_at([-116.6, 35.3]).unwrap().epsg(), Some(32611));
    assert_eq!(Crs::utm_at([14.2, -22.7]).unwrap().epsg(), Some(32733));
    assert_eq!(Crs::utm_at([180.0, 1.0]).unwrap().epsg(), Some(32601));
    assert!(Crs::utm_at([0.0, 88.0]).is_err());
}

#[test]
fn a_compound_system_says_what_heights_are_measured_from() {
    let found = |text: &str| {
        let crs = Crs::named(text).unwrap();
        (crs.vertical_datum().unwrap_or_default().to_owned(), crs.vertical_unit_m())
    };
    let metres = |name: &str| (name.to_owned(), Some(1.0));
    assert_eq!(found("EPSG:7415"), metres("NAP"));
    assert_eq!(found("EPSG:5498"), metres("NAVD88"));
    assert_eq!(found("EPSG:9518"), metres("EGM2008"));
    assert_eq!(found("EPSG:9705"), metres(""), "mean sea level is no datum");
    assert_eq!(found("EPSG:8700"), ("NAVD88".into(), Some(vertical::FOOT_M)));
    assert_eq!([found("EPSG:4979"), found("EPSG:4326")], [("ellipsoid".into(), None), (String::new(), None)]);
    for (code, ..) in COMPOUND {
        assert!(Crs::from_epsg(code.into()).is_ok(), "{code}");
    }
    let compound = |vertical: &str| format!(r#"COMPD_CS["x",{DEGREES},{vertical}]"#);
    let coded = r#"VERT_CS["x",VERT_DATUM["x",2005],UNIT["metre",1],AUTHORITY["EPSG","7837"]]"#;
    assert_eq!(found(&compound(coded)), metres("DHHN2016"));
    let by_its_datum = r#"VERT_CS["x",VERT_DATUM["x",2005,AUTHORITY["EPSG","5103"]],UNIT["metre",1]]"#;
    assert_eq!(found(&compound(by_its_datum)), metres("NAVD88"));
    let by_name = r#"VERTCS["EGM96_Geoid",VDATUM["EGM96_Geoid"],UNIT["Meter",1.0]]"#;
    assert_eq!(found(&format!("{DEGREES},{by_name}")), metres("EGM96"), "ESRI's writers put it behind");
}
