//! Coarser images of a raster: each post the mean of up to four, of those that have a value.

use crate::geotiff::{BLOCK, Blocks, blocks};
use crate::{ExportError, Work};

/// Values row by row from the north; NaN where there is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Raster {
    /// Values in a row.
    pub wide: usize,
    /// The values.
    pub metres: Vec<f32>,
}

impl Raster {
    /// Rows.
    pub(crate) fn high(&self) -> usize {
        self.metres.len() / self.wide
    }

    /// The same with half the rows and columns; an odd last one is halved alone.
    pub(crate) fn halved(&self) -> Self {
        let mut metres = Vec::with_capacity(self.metres.len().div_ceil(4) + self.wide);
        for rows in self.metres.chunks(2 * self.wide) {
            for west in (0..self.wide).step_by(2) {
                let east = self.wide.min(west + 2);
                let (mut sum, mut count) = (0.0, 0);
                for value in rows.chunks(self.wide).flat_map(|row| &row[west..east]).filter(|value| !value.is_nan()) {
                    (sum, count) = (sum + f64::from(*value), count + 1);
                }
                metres.push(if count == 0 { f32::NAN } else { (sum / f64::from(count)) as f32 });
            }
        }
        Self { wide: self.wide.div_ceil(2), metres }
    }
}

/// The blocks of `raster`, and of coarser and coarser ones until one block holds a whole raster.
pub(crate) fn overviews(mut raster: Raster, work: &Work) -> Result<Vec<Blocks>, ExportError> {
    let mut images = Vec::new();
    loop {
        let (wide, high) = (raster.wide, raster.high());
        let bands: Vec<&[f32]> = raster.metres.chunks(wide * BLOCK).collect();
        let deflated =
            work.each("bands of overviews", &bands, |band| Ok(blocks(&Raster { wide, metres: band.to_vec() })))?;
        images.push(Blocks { wide, high, blocks: deflated.concat() });
        if wide.max(high) <= BLOCK {
            return Ok(images);
        }
        raster = raster.halved();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarser_post_is_the_mean_of_those_that_have_a_value() {
        const NONE: f32 = f32::NAN;
        let raster = Raster {
            wide: 5,
            metres: [[1.0, 2.0, NONE, NONE, 5.0], [3.0, 6.0, NONE, 8.0, NONE], [7.0, NONE, NONE, NONE, 9.0]].concat(),
        };
        let half = raster.halved();
        assert_eq!((half.wide, half.high()), (3, 2));
        assert_eq!(half.metres[..3], [3.0, 8.0, 5.0]);
        assert_eq!((half.metres[3], half.metres[5]), (7.0, 9.0));
        assert!(half.metres[4].is_nan());
    }
}
