//! What is seen from a place, on shaded ground.

use super::color::{BREACH, Color, HEIGHTS, NOTHING, PALE, WHITE, lit, mix};
use super::image::Image;

/// Ground in a square around an eye, row by row from the north-west.
pub struct SeenGround<'a> {
    /// Places along a side; the eye stands at the middle one.
    pub side: usize,
    /// Metres between places.
    pub spacing_m: f64,
    /// Height of each place; not a number where there is none.
    pub height_m: &'a [f32],
    /// Whether each is seen; `None` where none looked.
    pub seen: &'a [Option<bool>],
}

/// Lays what is hidden in the dark: ground that is seen has the colours of heights, what lies beyond the range is pale.
///
/// # Panics
/// When there is not one height and one answer for each place.
pub fn draw_seen(ground: &SeenGround) -> Image {
    let &SeenGround { side, spacing_m, height_m, seen } = ground;
    assert!(height_m.len() == side * side && seen.len() == side * side, "a height and an answer for each place");
    let known = height_m.iter().copied().filter(|height| !height.is_nan());
    let (low, top) = known.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, top), at| (low.min(at), top.max(at)));
    let pixel = |index: usize| -> Color {
        let height = height_m[index];
        if height.is_nan() {
            return NOTHING;
        }
        let share = f64::from(height - low) / f64::from((top - low).max(1e-3));
        // Light from the north-west: what falls off that way is bright.
        let before = |step: usize, is_first: bool| if is_first { height } else { height_m[index - step] };
        let (west, north) = (before(1, index.is_multiple_of(side)), before(side, index < side));
        let falls = if west.is_nan() || north.is_nan() { 0.0 } else { 2.0 * height - west - north };
        let ground = lit(HEIGHTS.at(share), (1.0 + 0.7 * falls / spacing_m as f32).clamp(0.5, 1.3));
        match seen[index] {
            Some(true) => ground,
            Some(false) => mix(lit(ground, 0.55), [70, 62, 78], 0.45),
            None => mix(ground, PALE, 0.75),
        }
    };
    let mut image = Image::of(side, side, (0..side * side).map(pixel).collect());
    let (middle, arm) = (side as i64 / 2, (side as i64 / 80).clamp(3, 14));
    for (wide, high) in [(arm, 1), (1, arm)] {
        image.fill([middle - wide - 1, middle - high - 1, 2 * wide + 3, 2 * high + 3], WHITE);
    }
    for (wide, high) in [(arm, 1), (1, arm)] {
        image.fill([middle - wide, middle - high, 2 * wide + 1, 2 * high + 1], BREACH);
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hidden_is_darker_than_what_is_seen_and_what_is_beyond_is_pale() {
        let side = 41;
        let seen: Vec<Option<bool>> =
            (0..side * side).map(|at| [Some(true), Some(false), None][at % side / 14]).collect();
        let image = draw_seen(&SeenGround { side, spacing_m: 25.0, height_m: &vec![5.0; side * side], seen: &seen });
        let light = |x: usize| image.pixel(x, 3).iter().map(|&part| u32::from(part)).sum::<u32>();
        assert!(light(20) < light(5) && light(5) < light(35));
    }
}
