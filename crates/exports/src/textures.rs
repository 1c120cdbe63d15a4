//! Textures from orthophotos: one for each unit that a program loads, seen straight from above.

use std::fmt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::ExportError;
use source_files::{Care, Crs, Imagery, Keep, SourceError, Square};

/// Bytes of decoded strips and tiles that are kept: a row of tiles of 512 pixels across 49,000 of them.
const KEPT_BYTES_MAX: usize = 96 << 20;
/// Sides of what a picture draws at once are multiples of this.
const SIDE_STEP: usize = 16;
/// How many times the wanted texel one is that is told of.
const COARSER: f64 = 1.05;
/// Quality of a texture as JPEG, of 100.
const QUALITY: u8 = 90;

/// What kind of file a texture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureFile {
    /// JPEG.
    Jpeg,
    /// PNG, which loses nothing.
    Png,
    /// SGI's RGB, not compressed, for image generators.
    Rgb,
}

impl TextureFile {
    /// What names of such files end in.
    pub(crate) const fn extension(self) -> &'static str {
        match self {
            Self::Jpeg => "jpg",
            Self::Png => "png",
            Self::Rgb => "rgb",
        }
    }
}

/// Orthophotos laid over a product, later ones above earlier.
pub struct Textures {
    pictures: Vec<Imagery>,
    crs: Crs,
    keep: Keep,
    texel_m: f64,
    side_max: usize,
    file: TextureFile,
    /// Bits of the largest texel so far of a texture that was to have the finest.
    largest_m: AtomicU64,
}

impl fmt::Debug for Textures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} pictures, a texel of {} m", self.pictures.len(), self.texel_m)
    }
}

/// Where load modules lie that have a texture.
pub(crate) struct Place {
    /// South-west corner of what is exported.
    pub origin_m: [f64; 2],
    /// South-west and north-east corner of the load modules.
    pub low_m: [f64; 2],
    pub high_m: [f64; 2],
    /// Side of one.
    pub module_m: f64,
    /// The colour where no picture is.
    pub below: [u8; 3],
}

/// The texture of some load modules, whose borders run between texels: where a photo's pixels do, too, and are as
/// large, texels are its pixels. One texel more lies beyond each border, so that what a program draws between the
/// outermost two is the same in both of two units beside each other.
#[derive(Clone, Debug)]
pub struct Texture {
    /// Its file.
    pub bytes: Vec<u8>,
    /// What kind of file it is.
    pub(crate) file: TextureFile,
    /// West and north of its north-western corner, in metres from the south-west corner of what is exported.
    corner_m: [f64; 2],
    size_m: [f64; 2],
}

impl Texture {
    /// Where a place lies in it: from its western and from its northern side, as shares of its size.
    pub(crate) fn uv(&self, [east, north]: [f64; 2]) -> [f32; 2] {
        [(east - self.corner_m[0]) / self.size_m[0], (self.corner_m[1] - north) / self.size_m[1]]
            .map(|share| share as f32)
    }
}

impl Textures {
    /// Opens the pictures for ground from `low` to `high` of a coordinate system. A texel is that of the finest of
    /// them unless it is given; no texture has more texels along a side than `side_max`.
    ///
    /// # Errors
    /// When one is no picture that can be drawn, or lies nowhere in what is exported.
    pub fn open(
        paths: &[PathBuf],
        crs: &str,
        [low, high]: [[f64; 2]; 2],
        texel_m: Option<f64>,
        (file, side_max): (TextureFile, usize),
    ) -> Result<Self, ExportError> {
        let crs = Crs::named(crs).map_err(|found| ExportError::Impossible {
            what: format!("the coordinate system {crs}"),
            found,
            expected: "one that pictures are brought to".into(),
            hint: "leave --imagery out".into(),
        })?;
        let opened = paths.iter().enumerate().map(|(id, path)| Imagery::open(path, id));
        let pictures: Vec<Imagery> = opened.collect::<Result<_, _>>().map_err(of_source)?;
        if let Some(at) = pictures.iter().position(|picture| !picture.reaches(&crs, low, high)) {
            return Err(ExportError::Impossible {
                what: paths[at].display().to_string(),
                found: "a picture that lies elsewhere".into(),
                expected: "one that reaches into what is exported".into(),
                hint: "check its coordinate system with gdalinfo, or name a picture of this area".into(),
            });
        }
        let middle = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]));
        let own = pictures.iter().filter_map(|picture| picture.pixel_m(&crs, middle)).fold(f64::INFINITY, f64::min);
        let texel_m = texel_m.unwrap_or(if own.is_finite() { own } else { 1.0 });
        let (keep, largest_m) = (Keep::new(KEPT_BYTES_MAX), AtomicU64::new(0));
        Ok(Self { pictures, crs, keep, texel_m, side_max, file, largest_m })
    }

    /// What names of textures end in.
    pub fn extension(&self) -> &'static str {
        self.file.extension()
    }

    /// The texel that was wanted, and the largest that a texture came to for having too many of them, in metres; `None`
    /// where all have the one that was wanted, but for what load modules need to have a whole number of them.
    pub fn coarser_m(&self) -> Option<[f64; 2]> {
        let largest_m = f64::from_bits(self.largest_m.load(Ordering::Relaxed));
        (COARSER * self.texel_m < largest_m).then_some([self.texel_m, largest_m])
    }

    /// The texture of the load modules of a rectangle, with texels no finer than `texel_m`.
    pub(crate) fn of(&self, place: &Place, texel_m: f64) -> Result<Texture, ExportError> {
        let &Place { origin_m, low_m, high_m, module_m, below } = place;
        let sides = [0, 1].map(|axis| high_m[axis] - low_m[axis]);
        let wanted_m = texel_m;
        let texel_m = self.texel_m(module_m, sides[0].max(sides[1]), wanted_m);
        if wanted_m == 0.0 {
            // Positive numbers have their bits in their order.
            self.largest_m.fetch_max(texel_m.to_bits(), Ordering::Relaxed);
        }
        let texels = sides.map(|side| (side / texel_m - 1e-9).ceil() as usize + 2);
        let side = texels[0].max(texels[1]).next_multiple_of(SIDE_STEP);
        let corner = [low_m[0] - texel_m, high_m[1] + texel_m];
        let square = Square { crs: &self.crs, corner, pixel_m: texel_m, side };
        let mut pixels = vec![0; 4 * side * side];
        for picture in &self.pictures {
            picture.draw_with(Care::Whole, &square, &self.keep, &mut pixels).map_err(of_source)?;
        }
        repeat_edge(&mut pixels, side, texels);
        let opaque = |pixel: &[u8; 4]| {
            // Colours come multiplied with how opaque they are; the ground shows where none is.
            let rest = 255 - u32::from(pixel[3]);
            [0, 1, 2].map(|part| (u32::from(pixel[part]) + u32::from(below[part]) * rest / 255).min(255) as u8)
        };
        let rows = pixels.chunks_exact(4 * side).take(texels[1]);
        let colors: Vec<u8> = rows.flat_map(|row| row[..4 * texels[0]].as_chunks::<4>().0).flat_map(opaque).collect();
        Ok(Texture {
            bytes: encoded(self.file, &colors, texels)?,
            file: self.file,
            corner_m: [0, 1].map(|axis| corner[axis] - origin_m[axis]),
            size_m: texels.map(|count| count as f64 * texel_m),
        })
    }

    /// The finest texel that a texture of so many metres may have: load modules have a whole number of them.
    pub(crate) fn texel_m(&self, module_m: f64, longest_m: f64, texel_m: f64) -> f64 {
        let least = texel_m.max(self.texel_m).max(longest_m / (self.side_max - 2) as f64);
        // Rounded down, a module has fewer texels, each of them longer.
        if least <= module_m { module_m / (module_m / least + 1e-9).floor() } else { least }
    }
}

/// Gives texels along the rim those beside them inside, where pictures end between both: what lies beyond is blended in
/// along the border.
fn repeat_edge(pixels: &mut [u8], side: usize, [wide, high]: [usize; 2]) {
    let mut repeat = |own: [usize; 2], inside: [usize; 2]| {
        let [own, inside] = [own, inside].map(|[x, y]| 4 * (y * side + x));
        if pixels[own + 3] < pixels[inside + 3] {
            pixels.copy_within(inside..inside + 4, own);
        }
    };
    // Along a side that two textures share both have what lies beside it from the same picture.
    for x in 0..wide {
        repeat([x, 0], [x, 1]);
        repeat([x, high - 1], [x, high - 2]);
    }
    for y in 0..high {
        repeat([0, y], [1, y]);
        repeat([wide - 1, y], [wide - 2, y]);
    }
}

/// The file of a picture, row by row from the north.
fn encoded(file: TextureFile, colors: &[u8], [wide, high]: [usize; 2]) -> Result<Vec<u8>, ExportError> {
    match file {
        TextureFile::Jpeg => {
            let mut bytes = Vec::new();
            let encoder = jpeg_encoder::Encoder::new(&mut bytes, QUALITY);
            let made = encoder.encode(colors, wide as u16, high as u16, jpeg_encoder::ColorType::Rgb);
            made.map_err(|error| ExportError::write("texture")(std::io::Error::other(error)))?;
            Ok(bytes)
        }
        TextureFile::Png => png_of([wide, high], colors, |encoder| encoder.set_color(png::ColorType::Rgb)),
        TextureFile::Rgb => Ok(sgi(colors, [wide, high])),
    }
}

/// The file of a picture of samples, row by row from the north; `set` says which these are.
pub(crate) fn png_of(
    [wide, high]: [usize; 2],
    samples: &[u8],
    set: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Result<Vec<u8>, ExportError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, wide as u32, high as u32);
    set(&mut encoder);
    let write = || {
        let mut writer = encoder.write_header()?;
        writer.write_image_data(samples)?;
        writer.finish()
    };
    write().map_err(|error| ExportError::write("picture")(error.into()))?;
    Ok(bytes)
}

/// A picture as SGI has it: a head of 512 bytes, then all red, all green and all blue, each from the south.
fn sgi(colors: &[u8], [wide, high]: [usize; 2]) -> Vec<u8> {
    const HEAD_BYTES: usize = 512;
    // Its mark; not compressed, a byte each.
    let mut bytes = vec![1, 218, 0, 1];
    for number in [3, wide as u16, high as u16, 3] {
        bytes.extend(number.to_be_bytes());
    }
    // The least and the largest value.
    for number in [0, u32::from(u8::MAX)] {
        bytes.extend(number.to_be_bytes());
    }
    bytes.resize(HEAD_BYTES, 0);
    for part in 0..3 {
        for row in colors.chunks(3 * wide).rev() {
            bytes.extend(row.iter().skip(part).step_by(3));
        }
    }
    bytes
}

fn of_source(error: SourceError) -> ExportError {
    ExportError::Ground { message: error.to_string(), hint: error.hint() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_along_the_rim_repeat_those_beside_them_where_a_picture_ends() {
        // Four by four texels of a square of five: the picture ends before the rim, but for one side.
        let (side, of) = (5, |x: usize, y: usize| 4 * (y * 5 + x));
        let mut pixels = vec![0; 4 * side * side];
        for (x, y) in [(1, 1), (2, 1), (1, 2), (2, 2), (0, 2)] {
            pixels[of(x, y)..][..4].copy_from_slice(&[10 * x as u8, 10 * y as u8, 0, 255]);
        }
        repeat_edge(&mut pixels, side, [4, 4]);
        let found = [(0, 0), (3, 0), (1, 3), (0, 2)].map(|(x, y)| pixels[of(x, y)..][..4].to_vec());
        assert_eq!(found, [[10, 10, 0, 255], [20, 10, 0, 255], [10, 20, 0, 255], [0, 20, 0, 255]]);
        assert_eq!(pixels[of(4, 2) + 3], 0, "what lies beyond the texture stays");
    }

    #[test]
    fn a_picture_of_sgi_has_its_colours_one_after_the_other_from_the_south() {
        let bytes = sgi(&[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], [2, 2]);
        assert_eq!(bytes[..20], [1, 218, 0, 1, 0, 3, 0, 2, 0, 2, 0, 3, 0, 0, 0, 0, 0, 0, 0, 255]);
        assert_eq!(bytes[512..], [7, 10, 1, 4, 8, 11, 2, 5, 9, 12, 3, 6]);
    }
}
