//! How light slopes are.

use std::f64::consts::FRAC_1_SQRT_2;

use super::map_extent::slope;

/// Where light comes from, seen from above: south-west, west, north-west (as on maps since Lehmann) and north, each of
/// length 1; and how much of it. West weighs more than north, so that slopes to the south-west and the north-east,
/// which light from the north-west alone leaves equal, differ.
const LIGHTS: [([f64; 2], f64); 4] = [
    ([-FRAC_1_SQRT_2, -FRAC_1_SQRT_2], 0.9),
    ([-1.0, 0.0], 1.0),
    ([-FRAC_1_SQRT_2, FRAC_1_SQRT_2], 1.0),
    ([0.0, 1.0], 0.5),
];
/// Which of them is the main one, and its share.
const MAIN: (usize, f64) = (2, 0.55);
/// What is left of the difference in the shade: no slope is darker than one less this.
const SHADE: f64 = 0.55;

/// How light a slope is that rises so much per metre to the east and to the north: 1 where it is flat.
///
/// All lights stand halfway up. After Mark (1992), each counts by how far it shines across the slope, so that it shows
/// what the others flatten.
pub(crate) fn light_of(to_east: f64, to_north: f64) -> f32 {
    let squared = to_east * to_east + to_north * to_north;
    if squared == 0.0 {
        return 1.0;
    }
    let length = (1.0 + squared).sqrt();
    // As a multiple of the light on flat ground.
    let lambert = |[x, y]: [f64; 2]| ((1.0 - x * to_east - y * to_north) / length).max(0.0);
    let (mut sum, mut weights) = (0.0, 0.0);
    for (direction, weight) in LIGHTS {
        let across = direction[0] * to_north - direction[1] * to_east;
        let weight = weight * across * across / squared;
        sum += weight * lambert(direction);
        weights += weight;
    }
    let light = MAIN.1 * lambert(LIGHTS[MAIN.0].0) + (1.0 - MAIN.1) * sum / weights;
    (if light < 1.0 { 1.0 - SHADE * (1.0 - light) } else { light }) as f32
}

/// How light a triangle is whose heights are drawn `times` as large.
pub(crate) fn light_of_triangle([a, b, c]: [[f64; 3]; 3], times: f64) -> f32 {
    let [to_east, to_north] = slope([a, b, c]);
    light_of(to_east * times, to_north * times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_shadow_is_black_and_light_from_one_side_alone_flattens_no_slope() {
        for step in 0..64 {
            for steep in [0.01, 0.3, 1.0, 3.0, 50.0] {
                let angle = f64::from(step) * 0.1;
                let light = light_of(steep * libm::cos(angle), steep * libm::sin(angle));
                assert!((0.44..=1.6).contains(&light), "{steep} {angle}: {light}");
            }
        }
        // Both lie along the light from the north-west, which would leave them equal.
        let (north_east, south_west) = (light_of(-0.8, -0.8), light_of(0.8, 0.8));
        assert!(north_east + 0.03 < south_west, "{south_west} {north_east}");
        assert!((light_of(1e-9, 1e-9) - 1.0).abs() < 1e-6, "flat ground has no edge in its light");
    }

    #[test]
    fn slopes_towards_the_north_west_are_lighter_than_flat_ground_and_others_darker() {
        assert!((light_of(0.0, 0.0) - 1.0).abs() < 1e-6);
        assert!(1.0 < light_of(0.3, -0.3), "rising to the south-east: it faces the light");
        assert!(light_of(-0.3, 0.3) < 1.0);
        let plane = [[0.0, 0.0, 0.0], [10.0, 0.0, 1.0], [0.0, 10.0, -2.0]];
        assert_eq!(slope(plane), [0.1, -0.2]);
    }
}
