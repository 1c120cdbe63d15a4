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
    assert!(refused("EPSG:4807").contains("grads"));
    assert!(refused("EPSG:6984").contains("without a known shift"));
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

/// Places in systems that count longitudes from elsewhere: WGS 84 longitude and latitude, and where PROJ puts them.
#[test]
fn longitudes_count_from_the_meridian_of_the_system() {
    for (code, place, lon_lat) in [
        (27_561, [552_587.595, 215_784.194], [1.68, 49.64]),
        (27_572, [549_826.630, 2_192_990.712], [1.68, 46.735]),
        (31_251, [26_674.954, 227_959.912], [10.685, 47.19]),
        (27_391, [-13_265.906, 283_443.642], [5.81, 60.545]),
        (21_780, [60_013.543, -14_828.018], [8.225, 46.815]),
        (5329, [4_655_117.850, 902_715.209], [116.805, 0.025]),
        (5330, [3_396_557.718, 737_974.839], [105.465, -1.47]),
        (5331, [4_981_176.152, 435_309.463], [119.745, -4.21]),
        (4801, [0.7865, 46.8163], [8.225, 46.815]),
        (4803, [1.2581, 39.5534], [-7.875, 39.555]),
        (4813, [-1.3444, -1.4697], [105.465, -1.47]),
        (4805, [33.9527, 44.9351], [16.285, 44.935]),
        (4818, [34.9931, 49.3956], [17.325, 49.395]),
    ] {
        let crs = Crs::from_epsg(code).unwrap();
        let found = crs.to(&Crs::wgs84(), place).unwrap();
        // Of some datums PROJ knows other parameters, too.
        assert!((0..2).all(|axis| (found[axis] - lon_lat[axis]).abs() < 1.0e-4), "{code}: {found:?}");
        let back = Crs::wgs84().to(&crs, found).unwrap();
        let unit_m = crs.unit_m().unwrap_or(111_319.0);
        assert!(
            (0..2).all(|axis| (back[axis] - place[axis]).abs() * unit_m < 1.0e-2),
            "{code} there and back: {back:?}"
        );
    }
    let shifted = "DATUM[\"x\",SPHEROID[\"x\",6378249.2,293.4660212936269],TOWGS84[-168,-60,320,0,0,0,0]]";
    let paris = format!("GEOGCS[\"x\",{shifted},PRIMEM[\"Paris\",2.33722917],UNIT[\"degree\",0.0174532925199433]]");
    let lambert = format!(
        "PROJCS[\"x\",{paris},PROJECTION[\"Lambert_Conformal_Conic_1SP\"],PARAMETER[\"latitude_of_origin\",46.8],\
        PARAMETER[\"central_meridian\",0],PARAMETER[\"scale_factor\",0.99987742],PARAMETER[\"false_easting\",600000],\
        PARAMETER[\"false_northing\",2200000],UNIT[\"metre\",1]]"
    );
    let by_code = Crs::from_epsg(27_572).unwrap().to(&Crs::wgs84(), [6.0e5, 2.3e6]).unwrap();
    let spelled_out = Crs::from_wkt(&lambert).unwrap().to(&Crs::wgs84(), [6.0e5, 2.3e6]).unwrap();
    assert!((0..2).all(|axis| (by_code[axis] - spelled_out[axis]).abs() < 1.0e-6), "{by_code:?} {spelled_out:?}");
    let degrees = Crs::from_wkt(&paris).unwrap().to(&Crs::wgs84(), [0.0, 47.7]).unwrap();
    assert!((degrees[0] - by_code[0]).abs() < 1.0e-6, "{degrees:?} {by_code:?}");
}

/// Transverse Mercator on ellipsoids that are known by both axes, and shifts that the table of systems has wrong.
#[test]
fn old_datums_lie_where_proj_puts_them() {
    for (code, lon_lat, expected) in [
        (3121, [117.02, 12.425], [502_020.681, 1_374_106.430]),
        (3920, [-64.565, 18.53], [334_769.115, 2_049_638.211]),
        (3769, [-64.75, 32.3], [335_200.255, 3_574_689.641]),
        (2987, [-56.2, 46.9], [560_693.051, 5_193_871.076]),
        (3303, [-138.65, -10.5], [757_397.767, 8_838_225.626]),
        (6991, [35.2, 31.8], [219_035.789, 634_141.139]),
        (2039, [35.2, 31.8], [219_035.790, 634_141.139]),
        (3844, [26.1, 44.4], [587_745.847, 322_843.965]),
        (29_902, [-8.0, 53.0], [200_049.314, 194_328.988]),
    ] {
        let found = Crs::wgs84().to(&Crs::from_epsg(code).unwrap(), lon_lat).unwrap();
        let off_m = (found[0] - expected[0]).hypot(found[1] - expected[1]);
        assert!(off_m < 2.0, "{code}: {found:?}, {off_m} m off");
    }
    let remark = |code: u32| Crs::from_epsg(code).unwrap().remark().unwrap_or_default().to_owned();
    assert!(remark(2987).ends_with("good to some metres") && remark(24_305).ends_with("off by up to 95 m"));
    assert!(remark(24_311).contains("not known") && remark(6991).contains("is shifted"));
}

#[test]
fn web_mercator_is_known_in_the_words_of_its_makers() {
    let text = |parallel: f64| {
        let words = [("False_Easting", 0.0), ("Standard_Parallel_1", parallel), ("Auxiliary_Sphere_Type", 0.0)];
        let words: String = words.iter().map(|(name, value)| format!("PARAMETER[\"{name}\",{value}],")).collect();
        format!("PROJCS[\"x\",{DEGREES},PROJECTION[\"Mercator_Auxiliary_Sphere\"],{words}UNIT[\"Meter\",1.0]]")
    };
    assert_eq!(Crs::from_wkt(&text(0.0)).unwrap().epsg(), Some(3857));
    assert!(Crs::from_wkt(&text(10.0)).unwrap_err().contains("Mercator_Auxiliary_Sphere"));
}
