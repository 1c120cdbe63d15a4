//! Prints the features of the built-in terrain that touch a rectangle, and how long they took, for a look at them:
//! `cargo run -p sample-terrain --example map -- [seed [west south east north]] > features.geojsonl`, one GeoJSON
//! feature a line, in metres from the terrain's origin.

use std::time::Instant;

use sample_terrain::{DEFAULT_SEED, SampleFeature, SampleShape, features};

fn main() {
    let arguments: Vec<f64> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let seed = arguments.first().map_or(DEFAULT_SEED, |seed| *seed as u64);
    let rect = match arguments[..] {
        [_, west_m, south_m, east_m, north_m] => [west_m, south_m, east_m, north_m],
        _ => [0.0, 0.0, 50_000.0, 50_000.0],
    };
    let start = Instant::now();
    let found = features(seed, rect[0], rect[1], rect[2], rect[3]);
    eprintln!("{} features in {:.0} ms", found.len(), start.elapsed().as_secs_f64() * 1000.0);
    found.iter().for_each(|feature| println!("{}", line_of(feature)));
}

fn line_of(feature: &SampleFeature) -> String {
    let places = |line: &[[f64; 2]]| {
        let places: Vec<String> = line.iter().map(|place| format!("[{:.2},{:.2}]", place[0], place[1])).collect();
        format!("[{}]", places.join(","))
    };
    let (shape, coordinates) = match &feature.shape {
        SampleShape::Line(line) => ("LineString", places(line)),
        SampleShape::Polygon(rings) => {
            let rings: Vec<String> = rings.iter().map(|ring| places(ring)).collect();
            ("Polygon", format!("[{}]", rings.join(",")))
        }
    };
    let tags: Vec<String> = feature.tags.iter().map(|(key, value)| format!(r#""{key}":"{value}""#)).collect();
    let properties = tags.join(",");
    let geometry = format!(r#"{{"type":"{shape}","coordinates":{coordinates}}}"#);
    format!(r#"{{"type":"Feature","id":{},"properties":{{{properties}}},"geometry":{geometry}}}"#, feature.id)
}
