//! What is seen from a place: a square of places around it, those within range.

use crate::{Curvature, Eye, LoadedGround, Standing};

/// What a place of a viewshed is told as.
pub const HIDDEN: u8 = 0;
/// See [`HIDDEN`].
pub const SEEN: u8 = 1;
/// Beyond the range, or where nothing is loaded.
pub const NOT_LOOKED_AT: u8 = u8::MAX;

/// Places around an eye, in rows and columns so far apart that it stands at one of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewshed {
    /// Easting and northing of the eye.
    pub place_m: [f64; 2],
    /// Metres of the eye above the ground.
    pub eye_m: f64,
    /// Metres above the ground of what it looks at.
    pub target_m: f64,
    /// How far it sees, metres.
    pub range_m: f64,
    /// Metres between the places that it looks at.
    pub spacing_m: f64,
    /// How the earth falls away.
    pub curvature: Curvature,
    /// Which objects are looked at; what half of the light reaches is seen.
    pub standing: Standing,
    /// Whether what it looks at stands on roofs and decks where there are any, and not below them.
    pub is_on_roofs: bool,
}

/// What a viewshed tells of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// [`SEEN`], [`HIDDEN`] or [`NOT_LOOKED_AT`].
    pub seen: u8,
    /// Per cent of the light that reaches the eye, 0 where ground, a deck or a prism hides it; or [`NOT_LOOKED_AT`].
    pub light: u8,
}

impl Viewshed {
    /// Places from the eye to the last one in each direction.
    pub fn reach(&self) -> u32 {
        (self.range_m / self.spacing_m) as u32
    }

    /// Places along a side.
    pub fn side(&self) -> u64 {
        2 * u64::from(self.reach()) + 1
    }

    /// The eye of this viewshed; `None` where nothing is loaded under it.
    pub fn eye<'a>(&self, ground: &'a LoadedGround) -> Option<Eye<'a>> {
        let [east, north] = self.place_m;
        let height_m = ground.height_m(self.place_m)?;
        Some(ground.eye([east, north, height_m + self.eye_m], self.curvature).looking_far(self.range_m))
    }

    /// What is seen of row `row`, counted from the north, from west to east.
    pub fn row(&self, ground: &LoadedGround, eye: &mut Eye, row: u64) -> Vec<Look> {
        let reach = i64::from(self.reach());
        let up = (reach - row as i64) as f64 * self.spacing_m;
        let places = (-reach..=reach).map(|step| step as f64 * self.spacing_m);
        let looked_at = |right: f64| right * right + up * up <= self.range_m * self.range_m;
        let height_m = |place| if self.is_on_roofs { ground.roof_m(place) } else { ground.height_m(place) };
        let mut looks = Vec::with_capacity(self.side() as usize);
        looks.extend(places.map(|right| {
            let place = [self.place_m[0] + right, self.place_m[1] + up];
            let height_m = looked_at(right).then(|| height_m(place)).flatten();
            height_m.map_or(Look { seen: NOT_LOOKED_AT, light: NOT_LOOKED_AT }, |height_m| {
                let to = [place[0], place[1], height_m + self.target_m];
                let light = if eye.sees(to) { eye.light(to, self.standing) } else { 0.0 };
                Look { seen: if 0.5 <= light { SEEN } else { HIDDEN }, light: (100.0 * light).round() as u8 }
            })
        }));
        looks
    }
}
