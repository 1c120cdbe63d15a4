//! Features beyond the area, whose ground the DEM does not tell: what they put into the area lies on ground near it.

use super::{Drawn, geojson, line, polygon};
use crate::product::Product;
use crate::scene::{Scene, Words, sample_dem, write_dem};

/// Builds with these features, and looks at every height that a simulator reads.
#[track_caller]
fn check(what: &str, drawn: &[Drawn]) {
    let words = Words {
        features:
            "sources = [\"features.geojson\"]\nrules = [{ where = { breakline = \"yes\" }, kind = \"breakline\" }]"
                .into(),
        tin: "height_fit = \"off\"".into(),
        ..Words::raster()
    };
    let dem = sample_dem(words.grid(), 1);
    let scene = Scene::with_files(&words, |folder| {
        write_dem(&folder.join("dem.tif"), &dem);
        std::fs::write(folder.join("features.geojson"), geojson(drawn)).unwrap();
    });
    let report = scene.build("area", 2).report;
    assert_eq!(report.warnings.iter().find(|warning| warning.contains("beyond the heights")), None, "{what}");
    scene.verify("area");
    let product = Product::read(&scene.path("area"));
    product.check_cracks();
    let (low, high) = dem.range();
    let slack = 10 * 128;
    for z in product.modules.values().flat_map(|module| &module.vertices).map(|vertex| vertex.z) {
        assert!((low - slack..=high + slack).contains(&z), "{what}: {} m", z / 128);
    }
}

#[test]
fn what_lies_wholly_outside_takes_no_ground_away() {
    // The area is 5000 m wide and 4500 m high.
    let crossing = polygon("natural=water", &[(4700.0, 2000.0), (5200.0, 2000.0), (5200.0, 2300.0), (4700.0, 2300.0)]);
    let beside = polygon("natural=water", &[(5200.0, 2000.0), (5400.0, 2000.0), (5400.0, 2300.0), (5200.0, 2300.0)]);
    check("a lake beside one that crosses the border", &[crossing, beside]);
    let larger = [(-300.0, -300.0), (5300.0, -300.0), (5300.0, 4800.0), (-300.0, 4800.0)];
    check("a lake larger than the area", &[polygon("natural=water", &larger)]);
    for north in [4501.0, 4510.0, 4530.0, 4558.0] {
        let road = line("highway=primary", &[(500.0, north), (4500.0, north + 1.0)]);
        check("a road along the border", &[road]);
    }
    let bank = [(-200.0, 1000.0), (5200.0, 1000.0), (5200.0, 1200.0), (-200.0, 1200.0)];
    let middle = line("waterway=river", &[(5050.0, 1100.0), (5180.0, 1100.0)]);
    check("a river whose middle lies outside", &[polygon("natural=water water=river", &bank), middle]);
    let far = line("breakline=yes", &[(4000.0, 1000.0), (5400.0, 1400.0)]);
    check("a line that ends outside", &[far]);
    let bridge = line("highway=primary bridge=yes layer=1", &[(1000.0, 1000.0), (1200.0, 1000.0)]);
    check("a bridge that no road leads to", &[bridge]);
}
