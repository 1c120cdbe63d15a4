//! Where an observer stands and what lies where before him.
//!
//! Places are east, north and up in metres from the area's south-west post. Seen places are across and down in pixels
//! and ahead in metres. Sine and tangent come from one library, so a picture is the same on every machine.

/// An observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// East, north and up of the eye, in metres.
    pub eye_m: [f64; 3],
    /// Direction of the middle of the picture, in degrees from north over east.
    pub direction_degrees: f64,
    /// How far the middle lies above the horizon, in degrees; negative below.
    pub pitch_degrees: f64,
    /// Degrees from the left to the right edge of the picture.
    pub field_of_view_degrees: f64,
}

impl Camera {
    /// One that looks over all of an extent (west, south, east, north) from `direction_degrees`, at heights between
    /// `range_m`, which are drawn `times` as large.
    pub(crate) fn overlooking(
        [west, south, east, north]: [f64; 4],
        range_m: (f64, f64),
        times: f64,
        direction_degrees: f64,
        field_of_view_degrees: f64,
    ) -> Self {
        /// Width over height of the picture that everything is to be on, and the part of it to be used.
        const SHAPE: (f64, f64) = (16.0 / 9.0, 0.96);
        let angle = direction_degrees.to_radians();
        let (to_east, to_north) = (libm::sin(angle), libm::cos(angle));
        let middle = [0.5 * (west + east), 0.5 * (south + north), 0.5 * times * (range_m.0 + range_m.1)];
        let heights = [range_m.0, range_m.1].map(|height_m| height_m * times);
        let corners: Vec<[f64; 3]> = [[west, south], [east, south], [west, north], [east, north]]
            .into_iter()
            .flat_map(|[x, y]| heights.map(|z| [x, y, z]))
            .collect();
        let from = |back: f64| {
            let eye_m = [middle[0] - back * to_east, middle[1] - back * to_north, middle[2] + 0.6 * back];
            // Halfway between the highest and the lowest corner as they are seen.
            let rises = corners.iter().map(|&[x, y, z]| {
                let ahead = (x - eye_m[0]) * to_east + (y - eye_m[1]) * to_north;
                libm::atan2(z - eye_m[2], ahead).to_degrees()
            });
            let (low, high) = rises.fold((90.0_f64, -90.0_f64), |(low, high), rise| (low.min(rise), high.max(rise)));
            Self { eye_m, direction_degrees, pitch_degrees: 0.5 * (low + high), field_of_view_degrees }
        };
        let sees = |camera: &Self| {
            let view = camera.view([1600, (1600.0 / SHAPE.0) as usize]);
            corners.iter().all(|&corner| {
                let turned = view.turned(corner);
                let [x, y, _] = view.on_picture(turned);
                let inside = |at: f64, middle: f64| (at - middle).abs() < SHAPE.1 * middle;
                0.0 < turned[2] && inside(x, view.middle[0]) && inside(y, view.middle[1])
            })
        };
        let size = (east - west).max(north - south);
        // Further and further back, in steps too small to see.
        let mut tries = (0..400).map(|step| from(size * (0.3 + 0.02 * f64::from(step))));
        tries.find(|camera| sees(camera)).unwrap_or(from(size * 10.0))
    }

    /// What it sees on a picture of so many pixels.
    pub(crate) fn view(&self, [wide, high]: [usize; 2]) -> View {
        let (angle, pitch) = (self.direction_degrees.to_radians(), self.pitch_degrees.to_radians());
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let (rise, run) = (libm::sin(pitch), libm::cos(pitch));
        let half = libm::tan(0.5 * self.field_of_view_degrees.to_radians());
        View {
            eye: self.eye_m,
            right: [cos, -sin, 0.0],
            up: [-rise * sin, -rise * cos, run],
            ahead: [run * sin, run * cos, rise],
            focal: 0.5 * wide as f64 / half,
            middle: [0.5 * wide as f64, 0.5 * high as f64],
        }
    }
}

/// A camera on a picture of known size.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    eye: [f64; 3],
    right: [f64; 3],
    up: [f64; 3],
    ahead: [f64; 3],
    /// Pixels to a metre, a metre ahead.
    pub focal: f64,
    middle: [f64; 2],
}

/// Nothing nearer is seen, in metres.
pub(crate) const NEAREST_M: f64 = 0.5;

impl View {
    /// A place as the observer has it: to the right, up and ahead, in metres.
    #[inline]
    pub fn turned(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let to = [x - self.eye[0], y - self.eye[1], z - self.eye[2]];
        let along = |axis: [f64; 3]| to[0] * axis[0] + to[1] * axis[1] + to[2] * axis[2];
        [along(self.right), along(self.up), along(self.ahead)]
    }

    /// Where a turned place ahead of the observer lies on the picture: across, down, ahead.
    #[inline]
    pub fn on_picture(&self, [right, up, ahead]: [f64; 3]) -> [f64; 3] {
        let scale = self.focal / ahead;
        [self.middle[0] + right * scale, self.middle[1] - up * scale, ahead]
    }

    /// How far ahead of the observer the horizon's row lies, down in pixels.
    pub fn horizon(&self) -> f64 {
        // The direction with no rise: ahead without its height.
        let level = [self.ahead[0], self.ahead[1], 0.0];
        let along = |axis: [f64; 3]| level[0] * axis[0] + level[1] * axis[1];
        self.middle[1] - along(self.up) * self.focal / along(self.ahead).max(1e-9)
    }

    /// Whether a ball of so many metres around a place may be on the picture.
    pub fn may_see(&self, center: [f64; 3], radius_m: f64) -> bool {
        let [right, up, ahead] = self.turned(center);
        // Beyond the plane through the eye and an edge of the picture.
        let beyond = |off: f64, half: f64| {
            let slant = (self.focal * self.focal + half * half).sqrt();
            radius_m * slant < off.abs() * self.focal - ahead * half
        };
        NEAREST_M < ahead + radius_m && !beyond(right, self.middle[0]) && !beyond(up, self.middle[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn east_is_to_the_right_when_one_looks_north_and_up_is_up() {
        let camera = Camera {
            eye_m: [100.0, 200.0, 50.0],
            direction_degrees: 0.0,
            pitch_degrees: 0.0,
            field_of_view_degrees: 90.0,
        };
        let view = camera.view([200, 100]);
        assert!(near(view.turned([110.0, 300.0, 55.0]), [10.0, 5.0, 100.0]));
        assert!(near(view.on_picture(view.turned([200.0, 300.0, 50.0])), [200.0, 50.0, 100.0]));
        assert!((view.horizon() - 50.0).abs() < 1e-9);
        let east = Camera { direction_degrees: 90.0, ..camera }.view([200, 100]);
        assert!(near(east.turned([110.0, 190.0, 50.0]), [10.0, 0.0, 10.0]));
        let down = Camera { pitch_degrees: -30.0, ..camera }.view([200, 100]);
        assert!(down.horizon() < 0.0, "the horizon is above a picture that looks down");
    }

    #[test]
    fn an_overlooking_camera_sees_every_corner() {
        let extent = [0.0, 0.0, 50_000.0, 30_000.0];
        for direction in [0.0, 45.0, 90.0, 200.0, 315.0] {
            let camera = Camera::overlooking(extent, (500.0, 2500.0), 1.0, direction, 45.0);
            let view = camera.view([1600, 900]);
            for place in [[0.0, 0.0, 500.0], [5e4, 0.0, 500.0], [0.0, 3e4, 500.0], [5e4, 3e4, 500.0]] {
                let [x, y, ahead] = view.on_picture(view.turned(place));
                let inside = 0.0 < ahead && (0.0..1600.0).contains(&x) && (0.0..900.0).contains(&y);
                assert!(inside, "{direction}: {place:?} at {x} {y}");
                assert!(view.may_see(place, 1.0));
            }
            assert!(!view.may_see([camera.eye_m[0], camera.eye_m[1], 0.0], 1.0), "what lies below is not seen");
        }
    }
}
