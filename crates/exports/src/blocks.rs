//! A raster as deflated blocks with the predictor for floats, and the same for coarser and coarser images of it: each
//! post of one the mean of up to four, of those that have a value.

use source_files::geotiff_parts::{deflate, put_predicted};

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

/// Posts along a side of a block.
pub(crate) const BLOCK: usize = 256;

/// The deflated blocks of a raster, row by row from the north; what lies beyond the raster is NaN.
pub(crate) fn blocks(raster: &Raster) -> Vec<Vec<u8>> {
    raster.metres.chunks(raster.wide * BLOCK).flat_map(|band| blocks_of_band(band, raster.wide)).collect()
}

/// Those of at most [`BLOCK`] rows, from west to east.
fn blocks_of_band(values: &[f32], wide: usize) -> Vec<Vec<u8>> {
    let rows: Vec<&[f32]> = values.chunks(wide).collect();
    let block = |west: usize| {
        let mut bytes = Vec::with_capacity(4 * BLOCK * BLOCK);
        for index in 0..BLOCK {
            let mut row = [f32::NAN; BLOCK];
            if let Some(part) = rows.get(index).map(|row| &row[west..wide.min(west + BLOCK)]) {
                row[..part.len()].copy_from_slice(part);
            }
            put_predicted(&mut bytes, &row);
        }
        deflate(&bytes)
    };
    (0..wide).step_by(BLOCK).map(block).collect()
}

/// The blocks of a raster, and how many posts it has west to east and south to north.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blocks {
    pub wide: usize,
    pub high: usize,
    pub blocks: Vec<Vec<u8>>,
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
