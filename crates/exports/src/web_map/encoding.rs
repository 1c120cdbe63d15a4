//! Heights as colours of 8 bits.

/// How a height becomes red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightEncoding {
    /// Mapbox Terrain-RGB: tenths of a metre above -10,000 m.
    Mapbox,
    /// Terrarium: 256ths of a metre above -32,768 m.
    Terrarium,
}

impl HeightEncoding {
    /// What programs call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mapbox => "mapbox",
            Self::Terrarium => "terrarium",
        }
    }

    /// How a reader gets the height back.
    pub(crate) fn formula(self) -> &'static str {
        match self {
            Self::Mapbox => "height = -10000 + 0.1 * (65536 * red + 256 * green + blue)",
            Self::Terrarium => "height = 256 * red + green + blue / 256 - 32768",
        }
    }

    /// The lowest height, and steps to a metre.
    fn scale(self) -> (f64, f64) {
        match self {
            Self::Mapbox => (-10_000.0, 10.0),
            Self::Terrarium => (-32_768.0, 256.0),
        }
    }

    /// Red, green and blue of the step next to a height in metres.
    pub(crate) fn color(self, height_m: f64) -> [u8; 3] {
        const STEPS_MAX: f64 = 16_777_215.0;
        let (lowest_m, steps_per_m) = self.scale();
        let step = ((height_m - lowest_m) * steps_per_m).round().clamp(0.0, STEPS_MAX) as u32;
        let [_, red, green, blue] = step.to_be_bytes();
        [red, green, blue]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_within_half_a_step_of_its_height() {
        assert_eq!(HeightEncoding::Mapbox.color(0.0), [1, 134, 160]);
        assert_eq!(HeightEncoding::Terrarium.color(0.0), [128, 0, 0]);
        for height_m in [-430.5, -0.04, 0.0, 0.051, 1234.5678, 8848.86] {
            let [red, green, blue] = HeightEncoding::Mapbox.color(height_m).map(f64::from);
            let back = -10_000.0 + 0.1 * (65_536.0 * red + 256.0 * green + blue);
            assert!((back - height_m).abs() <= 0.05 + 1e-9, "{height_m}: {back}");
            let [red, green, blue] = HeightEncoding::Terrarium.color(height_m).map(f64::from);
            let back = 256.0 * red + green + blue / 256.0 - 32_768.0;
            assert!((back - height_m).abs() <= 0.5 / 256.0 + 1e-9, "{height_m}: {back}");
        }
    }
}
