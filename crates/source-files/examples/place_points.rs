//! Places points of WGS 84 in another coordinate system, for comparison with PROJ (`scripts/compare.py crs`).
//!
//! `place_points SYSTEM` reads lines of longitude and latitude from stdin and writes lines of two coordinates, and
//! those brought back to longitude and latitude. SYSTEM is `EPSG:CODE`, well-known text, or the path of a raster.

use std::io::Read;
use std::path::Path;

use source_files::{Crs, DemFile, Reading};

fn main() {
    let system = std::env::args().nth(1).expect("give a coordinate system");
    let crs = match DemFile::open(Path::new(&system), &Reading::AS_IT_SAYS) {
        Ok(file) => file.frame().crs.clone(),
        Err(_) if !Path::new(&system).exists() => {
            Crs::named(&system).unwrap_or_else(|error| panic!("refused: {error}"))
        }
        Err(error) => panic!("refused: {error}"),
    };
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).expect("points on stdin");
    let wgs84 = Crs::wgs84();
    for line in text.lines() {
        let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        let place = wgs84.to(&crs, [numbers[0], numbers[1]]);
        let back = place.and_then(|place| crs.to(&wgs84, place));
        let ([x, y], [lon, lat]) = (place.unwrap_or([f64::NAN; 2]), back.unwrap_or([f64::NAN; 2]));
        println!("{x:.11} {y:.11} {lon:.12} {lat:.12}");
    }
}
