//! GeoTIFFs for tests: sound ones, and ones with a single fault.

use std::fs::File;
use std::path::Path;

use tiff::encoder::TiffEncoder;
use tiff::encoder::colortype::Gray32Float;
use tiff::tags::Tag;

/// GeoKeys of a raster in UTM zone 11 north.
const UTM: &[u16] = &[1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 2, 3072, 0, 1, 32611];
/// GeoKeys of a raster in longitude and latitude.
const GEOGRAPHIC: &[u16] = &[1, 1, 0, 3, 1024, 0, 1, 2, 1025, 0, 1, 2, 2048, 0, 1, 4326];

/// A square raster whose north-west post lies at `corner_m`; posts are points.
pub struct Raster {
    posts: u32,
    spacing_m: f64,
    corner_m: [f64; 2],
    keys: &'static [u16],
    nodata: Option<&'static str>,
    heights: Vec<f32>,
}

impl Raster {
    /// Covers the 2 km x 2 km of `raster.toml` exactly, 25 m apart: hills of some 60 m.
    pub fn sound() -> Self {
        let posts = 81;
        let hill = |place: u32| {
            let (row, col) = (i64::from(place / posts), i64::from(place % posts));
            let bump = (40 - (row - 30).abs()).max(0) * (35 - (col - 50).abs()).max(0);
            bump as f32 / 16.0 + (row * 7 + col * 13).rem_euclid(11) as f32 / 4.0
        };
        let heights = (0..posts * posts).map(hill).collect();
        Self { posts, spacing_m: 25.0, corner_m: [505_000.0, 3_877_000.0], keys: UTM, nodata: None, heights }
    }

    /// Four square kilometres of the same place, and half a kilometre around them, 25 m apart: what `height_m` says at
    /// each easting and northing.
    pub fn around(height_m: impl Fn(f64, f64) -> f64) -> Self {
        let (posts, spacing_m, corner_m) = (121, 25.0, [504_500.0, 3_877_500.0]);
        let place = |index: u32| [index % posts, index / posts].map(|step| f64::from(step) * spacing_m);
        let height = |[x, y]: [f64; 2]| height_m(corner_m[0] + x, corner_m[1] - y) as f32;
        let heights = (0..posts * posts).map(|index| height(place(index))).collect();
        Self { posts, spacing_m, corner_m, keys: UTM, nodata: None, heights }
    }

    pub fn without_crs(self) -> Self {
        Self { keys: &[], ..self }
    }

    pub fn geographic(self) -> Self {
        Self { keys: GEOGRAPHIC, spacing_m: 0.000_25, corner_m: [-116.9, 35.1], ..self }
    }

    pub fn moved_m(mut self, east_m: f64) -> Self {
        self.corner_m[0] += east_m;
        self
    }

    /// One post in the middle has this height.
    pub fn with_height(mut self, height: f32) -> Self {
        let middle = self.heights.len() / 2;
        self.heights[middle] = height;
        self
    }

    pub fn all_void(mut self) -> Self {
        self.heights.fill(-9999.0);
        Self { nodata: Some("-9999"), ..self }
    }

    pub fn write(&self, path: &Path) {
        let mut encoder = TiffEncoder::new(File::create(path).unwrap()).unwrap();
        let mut image = encoder.new_image::<Gray32Float>(self.posts, self.posts).unwrap();
        let tags = image.encoder();
        if !self.keys.is_empty() {
            tags.write_tag(Tag::GeoKeyDirectoryTag, self.keys).unwrap();
        }
        let scale = [self.spacing_m, self.spacing_m, 0.0];
        tags.write_tag(Tag::ModelPixelScaleTag, &scale[..]).unwrap();
        let [east_m, north_m] = self.corner_m;
        tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, east_m, north_m, 0.0][..]).unwrap();
        if let Some(nodata) = self.nodata {
            tags.write_tag(Tag::GdalNodata, nodata).unwrap();
        }
        image.write_data(&self.heights).unwrap();
    }
}
