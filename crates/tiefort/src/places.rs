//! Places on the map as arguments, and the ground under them.

use load_module_reader::{Area, AreaFrame, Block, Standing};

use crate::failure::Failure;

/// How far air usually bends light, as a part of the earth's own curvature.
pub const REFRACTION: f64 = 0.13;
/// Load modules that are held at once at most: about 12 kB each.
const MODULES_MAX: u64 = 100_000;

/// Reads `E,N`: an easting and a northing.
pub fn place(text: &str) -> Result<[f64; 2], String> {
    numbers(text).ok_or_else(|| "expected EAST,NORTH in metres, such as 521000,3893000".into())
}

/// Metres above the ground that anything may be at most.
pub const ABOVE_M_MAX: f64 = 1e6;

/// Reads `E,N,H`: an easting, a northing and metres above the ground.
pub fn place_above(text: &str) -> Result<[f64; 3], String> {
    match numbers(text) {
        Some([_, _, above]) if !(0.0..=ABOVE_M_MAX).contains(&above) => {
            Err("expected 0 to 1000000 metres above the ground".into())
        }
        Some(place) => Ok(place),
        None => {
            Err("expected EAST,NORTH,ABOVE in metres, the last above the ground, such as 521000,3893000,2.5".into())
        }
    }
}

/// Reads which objects are looked at.
pub fn standing(text: &str) -> Result<Standing, String> {
    Standing::named(text).ok_or_else(|| "expected none, buildings or all".into())
}

/// The word that [`standing`] reads.
pub fn standing_word(standing: Standing) -> &'static str {
    match standing {
        Standing::None => "none",
        Standing::Buildings => "buildings",
        Standing::All => "all",
    }
}

/// So many finite numbers, with commas between.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let all = all.filter(|numbers| numbers.iter().all(|number| number.is_finite()))?;
    all.try_into().ok()
}

/// The load modules within so many metres of places, as far as the area goes.
///
/// # Errors
/// When there are too many.
pub fn block_around(area: &Area, places_m: &[[f64; 2]], range_m: f64) -> Result<Block, Failure> {
    let reach = (range_m / area.frame().side_m()).ceil() as u32;
    let blocks = places_m.iter().map(|&place_m| area.block_around(place_m, reach));
    let block = blocks.reduce(around_both).unwrap_or(Block { south: 0, west: 0, north: 0, east: 0 });
    if MODULES_MAX < block.count() as u64 {
        let message = format!("found {} load modules between these places, expected {MODULES_MAX}", block.count());
        return Err(Failure::new(message + " at most", "ask for a smaller range, or for places nearer to each other"));
    }
    Ok(block)
}

fn around_both(a: Block, b: Block) -> Block {
    Block {
        south: a.south.min(b.south),
        west: a.west.min(b.west),
        north: a.north.max(b.north),
        east: a.east.max(b.east),
    }
}

/// What to say of a place of an argument that has no ground.
pub fn outside(name: &str, place_m: [f64; 2], frame: &AreaFrame) -> Failure {
    let [west, south] = frame.origin_m;
    let far = |origin: f64, modules: u32| origin + f64::from(modules) * frame.side_m();
    let (east, north) = (far(west, frame.cols), far(south, frame.rows));
    Failure::new(
        format!("{name}: found {},{}, where there is no ground", place_m[0], place_m[1]),
        format!("the area reaches from {west},{south} to {east},{north} in {}", frame.crs),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_finite_numbers_of_the_right_count() {
        assert_eq!(place("521000, 3893000.5"), Ok([521_000.0, 3_893_000.5]));
        assert_eq!(place_above("-5,6,2.5"), Ok([-5.0, 6.0, 2.5]));
        for wrong in ["", "1", "1,2,3", "NaN,1", "1,inf", "1;2"] {
            assert!(place(wrong).is_err(), "{wrong}");
        }
        for wrong in ["1,2", "1,2,-3", "1,2,NaN"] {
            assert!(place_above(wrong).is_err(), "{wrong}");
        }
    }
}
