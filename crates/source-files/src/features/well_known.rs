//! Geometries as GeoPackages store them: a header with a box around each, then well-known binary.

use super::clip::Vertex;
use super::curves::Chords;
use super::raw::{Part, RawShape};

/// The points, lines and polygons of a geometry, its arcs as chords.
///
/// # Errors
/// In words, what it is instead of a geometry.
pub(crate) fn geometry(blob: &[u8], chords: Chords) -> Result<RawShape, String> {
    let &[b'G', b'P', _, flags, ..] = blob else { return Err("a geometry without its mark, GP".into()) };
    let numbers = match flags >> 1 & 7 {
        0 => 0,
        1 => 4,
        2 | 3 => 6,
        4 => 8,
        other => return Err(format!("a geometry with a box of kind {other}")),
    };
    binary(blob.get(8 + 8 * numbers..).ok_or_else(cut_short)?, chords)
}

/// The points, lines and polygons of well-known binary, as the standard or PostGIS writes it, its arcs as
/// chords.
///
/// # Errors
/// In words, what it is instead of a geometry.
pub(crate) fn binary(bytes: &[u8], chords: Chords) -> Result<RawShape, String> {
    let mut binary = Binary { bytes, at: 0, shape: RawShape::default(), chords };
    binary.add(0)?;
    Ok(binary.shape)
}

fn cut_short() -> String {
    "a geometry that is cut short".into()
}

/// Well-known binary, read from the front.
struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    shape: RawShape,
    chords: Chords,
}

/// How the numbers of a geometry are written.
#[derive(Clone, Copy)]
struct Axes {
    is_little: bool,
    count: usize,
    has_heights: bool,
}

impl Binary<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let taken = self.bytes.get(self.at..self.at + N).and_then(|bytes| bytes.try_into().ok());
        self.at += N;
        taken.ok_or_else(cut_short)
    }

    fn number(&mut self, is_little: bool) -> Result<u32, String> {
        let bytes = self.take()?;
        Ok(if is_little { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    /// What kind a geometry is of, and how its numbers are written.
    fn head(&mut self) -> Result<(u32, Axes), String> {
        let [order] = self.take()?;
        let is_little = order == 1;
        let code = self.number(is_little)?;
        // Heights and measures are told by thousands, or by the highest bits.
        let (kind, flags) = (code & 0x0fff_ffff, code >> 28);
        let [has_heights, has_measures] = match kind / 1000 {
            0 => [flags & 8 != 0, flags & 4 != 0],
            1 => [true, false],
            2 => [false, true],
            _ => [true, true],
        };
        let count = 2 + usize::from(has_heights) + usize::from(has_measures);
        Ok((kind % 1000, Axes { is_little, has_heights, count }))
    }

    /// Adds one geometry; `false` where what follows it cannot be found.
    fn add(&mut self, depth: usize) -> Result<bool, String> {
        /// Collections in collections.
        const DEPTH_MAX: usize = 8;
        if DEPTH_MAX < depth {
            return Err("collections in collections in collections".into());
        }
        let (kind, axes) = self.head()?;
        let Axes { is_little, has_heights, .. } = axes;
        match kind {
            1 => {
                let place = self.place(axes)?;
                // POINT EMPTY is nowhere.
                self.shape.parts.extend((!place[0].is_nan()).then_some(Part::Point(place)));
                self.shape.has_heights |= has_heights;
            }
            2 | 8 | 9 => {
                let line = self.curve(kind, axes)?;
                // LINESTRING EMPTY has no vertices.
                self.shape.parts.extend((!line.is_empty()).then_some(Part::Line(line)));
                self.shape.has_heights |= has_heights;
            }
            3 => {
                let count = self.number(is_little)?;
                let rings = (0..count).map(|_| self.run(axes)).collect::<Result<Vec<_>, _>>()?;
                // POLYGON EMPTY has no rings.
                self.shape.parts.extend((!rings.is_empty()).then_some(Part::Polygon(rings)));
                self.shape.has_heights |= has_heights;
            }
            10 => {
                let rings = (0..self.number(is_little)?).map(|_| {
                    let (kind, axes) = self.head()?;
                    self.curve(kind, axes)
                });
                let rings = rings.collect::<Result<Vec<_>, _>>()?;
                self.shape.parts.extend((!rings.is_empty()).then_some(Part::Polygon(rings)));
                self.shape.has_heights |= has_heights;
            }
            4..=7 | 11 | 12 => {
                for _ in 0..self.number(is_little)? {
                    if !self.add(depth + 1)? {
                        return Ok(false);
                    }
                }
            }
            _ => {
                self.shape.other = Some("geometry of some other kind");
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// A line, arcs, or one of both after the other.
    fn curve(&mut self, kind: u32, axes: Axes) -> Result<Vec<Vertex>, String> {
        match kind {
            2 => self.run(axes),
            8 => {
                let places = self.run(axes)?;
                self.chords.draw(&places)
            }
            9 => {
                let mut joined: Vec<Vertex> = Vec::new();
                for _ in 0..self.number(axes.is_little)? {
                    let (kind, axes) = self.head()?;
                    if !matches!(kind, 2 | 8) {
                        return Err(format!("a curve with a part of kind {kind}"));
                    }
                    let next = self.curve(kind, axes)?;
                    let meets = joined.last().zip(next.first()).is_some_and(|(last, first)| last[..2] == first[..2]);
                    joined.extend(next.into_iter().skip(usize::from(meets)));
                }
                Ok(joined)
            }
            other => Err(format!("a curve of kind {other}")),
        }
    }

    fn run(&mut self, axes: Axes) -> Result<Vec<Vertex>, String> {
        let count = self.number(axes.is_little)?;
        // Grown as places are found, so that a number alone asks for no memory.
        (0..count).map(|_| self.place(axes)).collect()
    }

    fn place(&mut self, axes: Axes) -> Result<Vertex, String> {
        let mut number = || {
            let bytes = self.take()?;
            Ok::<_, String>(if axes.is_little { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) })
        };
        let mut place = [number()?, number()?, f64::NAN];
        for axis in 2..axes.count {
            let value = number()?;
            if axis == 2 && axes.has_heights {
                place[2] = value;
            }
        }
        Ok(place)
    }
}
