//! Heights along a line over the ground.

use crate::LoadedGround;

/// One place of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// Metres from the beginning, along the line.
    pub along_m: f64,
    /// Easting and northing.
    pub place_m: [f64; 2],
    /// Height of the ground; `None` where nothing is loaded.
    pub height_m: Option<f64>,
    /// Height of the topmost deck above it, if there is one.
    pub deck_m: Option<f64>,
    /// Class of the ground; [`crate::HOLE_CLASS`] where no source has a height.
    pub class: Option<u8>,
}

impl LoadedGround {
    /// The ground along a line through places, at most `spacing_m` apart at even steps between two of them, all of them
    /// included: as `along_m` grows, in the order of the places. A spacing that is no number above 0 leaves the places.
    pub fn profile(&self, places_m: &[[f64; 2]], spacing_m: f64) -> Vec<ProfilePoint> {
        let mut points = Vec::new();
        let mut before_m = 0.0;
        points.extend(places_m.first().map(|&place_m| self.profile_point(0.0, place_m)));
        for ends in places_m.windows(2) {
            let run = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
            let length_m = (run[0] * run[0] + run[1] * run[1]).sqrt();
            let steps = (length_m / spacing_m).ceil();
            let steps = if spacing_m > 0.0 && 1.0 <= steps && steps.is_finite() { steps as u64 } else { 1 };
            for step in 1..=steps {
                let share = step as f64 / steps as f64;
                let place_m =
                    if step == steps { ends[1] } else { [ends[0][0] + share * run[0], ends[0][1] + share * run[1]] };
                points.push(self.profile_point(before_m + share * length_m, place_m));
            }
            before_m += length_m;
        }
        points
    }

    fn profile_point(&self, along_m: f64, place_m: [f64; 2]) -> ProfilePoint {
        let ground = self.sample(place_m);
        let top = self.sample_below(place_m, f64::INFINITY).filter(|top| top.is_deck);
        ProfilePoint {
            along_m,
            place_m,
            height_m: ground.map(|sample| sample.height_m),
            deck_m: top.map(|deck| deck.height_m),
            class: ground.map(|sample| sample.class),
        }
    }
}
