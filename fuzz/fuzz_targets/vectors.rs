//! Lines and polygons: OpenStreetMap data, GeoPackages, Shapefiles, GeoJSON, GeoParquet.
#![no_main]

use source_files::{BUILT_IN_KEYS, Extent, FeatureFile, VectorShape, Wanted, read_features};

const BOUNDS: Extent = Extent { east: [495_000.0, 505_000.0], north: [3_868_000.0, 3_878_000.0] };

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let (layer, crs, keys) = (None, None, &BUILT_IN_KEYS);
    let wanted = Wanted { epsg: 32611, bounds: BOUNDS, layer, crs, keys, buildings: true, points: true };
    let Ok(file) = read_features(&tiefort_fuzz::file("vectors", bytes), &wanted, &terrain::in_turn) else { return };
    check(&file);
});

/// Whatever was read lies inside the bounds, and rings are closed.
fn check(file: &FeatureFile) {
    for feature in &file.features {
        let runs = match &feature.shape {
            VectorShape::Point(place) => {
                assert!(BOUNDS.east[0] <= place[0] && place[0] <= BOUNDS.east[1], "{place:?} lies inside");
                continue;
            }
            VectorShape::Line(line) => {
                assert!(2 <= line.places.len(), "a line has two vertices");
                std::slice::from_ref(line)
            }
            VectorShape::Polygon(rings) => {
                assert!(rings.iter().all(|ring| ring.places.first() == ring.places.last()), "rings are closed");
                rings
            }
        };
        for [east, north] in runs.iter().flat_map(|run| &run.places) {
            assert!(BOUNDS.east[0] <= *east && *east <= BOUNDS.east[1], "{east} lies inside");
            assert!(BOUNDS.north[0] <= *north && *north <= BOUNDS.north[1], "{north} lies inside");
        }
    }
}
