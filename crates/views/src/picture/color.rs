//! Colours, and the scales that stand for numbers.
//!
//! Every scale is told apart by its lightness, so that it reads the same to the colour-blind and in print: heights and
//! counts grow lighter or darker all the way, residuals grow darker both ways from white, blue one way, red the other
//! (the pair that the common kinds of colour blindness keep apart).

/// A colour: red, green and blue, as screens show them.
pub type Color = [u8; 3];

pub(crate) const WHITE: Color = [255, 255, 255];
pub(crate) const INK: Color = [34, 34, 34];
pub(crate) const GREY: Color = [110, 110, 110];
pub(crate) const PALE: Color = [225, 225, 225];
/// Where nothing is known: voids, ground outside.
pub(crate) const NOTHING: Color = [200, 200, 200];
/// What broke a limit; on no scale.
pub(crate) const BREACH: Color = [213, 94, 0];
/// What a limit kept from growing; on no scale.
pub(crate) const BOUND: Color = [230, 159, 0];

/// Colours at equal steps from 0 to 1, blended between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ramp(pub &'static [Color]);

/// Heights: from dark green lowlands to white tops.
pub(crate) const HEIGHTS: Ramp = Ramp(&[
    [70, 112, 104],
    [104, 140, 112],
    [146, 166, 122],
    [184, 186, 138],
    [208, 198, 156],
    [222, 210, 180],
    [236, 228, 208],
    [250, 248, 242],
]);

/// Counts: viridis, from dark to light.
pub(crate) const COUNTS: Ramp = Ramp(&[
    [68, 1, 84],
    [71, 45, 123],
    [59, 82, 139],
    [44, 114, 142],
    [33, 145, 140],
    [40, 174, 128],
    [94, 201, 98],
    [173, 220, 48],
    [253, 231, 37],
]);

/// Use of a limit: from pale yellow, nothing, to dark blue, all of it.
pub(crate) const USE: Ramp = Ramp(&[
    [255, 255, 217],
    [237, 248, 177],
    [199, 233, 180],
    [127, 205, 187],
    [65, 182, 196],
    [29, 145, 192],
    [34, 94, 168],
    [37, 52, 148],
    [8, 29, 88],
]);

/// Residuals: blue where the DEM lies below the triangles, white where it lies on them, red above.
pub(crate) const RESIDUALS: Ramp = Ramp(&[
    [5, 48, 97],
    [33, 102, 172],
    [67, 147, 195],
    [146, 197, 222],
    [209, 229, 240],
    [247, 247, 247],
    [253, 219, 199],
    [244, 165, 130],
    [214, 96, 77],
    [178, 24, 43],
    [103, 0, 31],
]);

/// Kinds of things without an order: Okabe and Ito's, lightened so that letters read on them.
pub(crate) const KINDS: [Color; 4] = [[166, 206, 227], [253, 205, 130], [178, 223, 188], [222, 190, 218]];

impl Ramp {
    /// The colour at `share`, which is taken into 0 to 1.
    pub fn at(&self, share: f64) -> Color {
        let steps = self.0.len() - 1;
        let place = share.clamp(0.0, 1.0) * steps as f64;
        let step = (place as usize).min(steps - 1);
        mix(self.0[step], self.0[step + 1], place - step as f64)
    }

    /// Colours at `count` equal steps, to be looked up.
    pub fn table(&self, count: usize) -> Vec<Color> {
        (0..count).map(|step| self.at(step as f64 / (count - 1).max(1) as f64)).collect()
    }
}

/// `share` of the second colour over the first.
pub(crate) fn mix(a: Color, b: Color, share: f64) -> Color {
    std::array::from_fn(|i| (f64::from(a[i]) + (f64::from(b[i]) - f64::from(a[i])) * share + 0.5) as u8)
}

/// A colour under a light: 1 leaves it, less darkens it, more lightens it towards white.
pub(crate) fn lit(color: Color, light: f32) -> Color {
    color.map(|part| {
        let part = f32::from(part);
        let lit = if light <= 1.0 { part * light } else { part + (255.0 - part) * (light - 1.0).min(1.0) };
        (lit + 0.5) as u8
    })
}

/// Ink that reads on a background.
pub(crate) fn ink_on(background: Color) -> Color {
    let [red, green, blue] = background.map(f64::from);
    if 0.3 * red + 0.59 * green + 0.11 * blue < 128.0 { WHITE } else { INK }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness([red, green, blue]: Color) -> f64 {
        0.2126 * f64::from(red) + 0.7152 * f64::from(green) + 0.0722 * f64::from(blue)
    }

    #[test]
    fn scales_of_heights_counts_and_use_change_their_lightness_one_way() {
        for ramp in [HEIGHTS, COUNTS, USE] {
            let light: Vec<f64> = ramp.table(65).into_iter().map(lightness).collect();
            let grows = light.is_sorted();
            assert!(grows || light.iter().rev().is_sorted(), "{ramp:?}");
        }
    }

    #[test]
    fn residuals_are_lightest_in_the_middle_and_no_colour_stands_for_two() {
        let table = RESIDUALS.table(101);
        let light: Vec<f64> = table.iter().copied().map(lightness).collect();
        assert!(light[..=50].is_sorted() && light[50..].iter().rev().is_sorted());
        assert!((0..50).all(|step| table[step][2] > table[step][0] && table[100 - step][0] > table[100 - step][2]));
    }

    #[test]
    fn the_ends_of_a_scale_are_its_first_and_last_colour() {
        assert_eq!(USE.at(-1.0), USE.0[0]);
        assert_eq!(USE.at(2.0), USE.0[8]);
        assert_eq!(mix([0, 0, 0], [255, 255, 255], 0.5), [128, 128, 128]);
        assert_eq!(lit([100, 100, 100], 0.5), [50, 50, 50]);
        assert_eq!(lit([100, 100, 100], 1.5), [178, 178, 178]);
    }
}
