//! Heightmaps of 16 bits for game engines: square tiles that share their border rows, with one scale of heights for
//! all, and a JSON with the numbers that the engine's import dialog asks for.
//!
//! Samples are the posts of the working grid, with the exact height of the compiled surface there; over holes, where no
//! source has a height, that of the triangles which close them. Beyond the area the heights of its border go on, since
//! tiles have sizes of the engine's own.

use serde_json::{Value, json};
use terrain::geometry::Facet;
use terrain::geometry::owned::{OwnedRows, PostGrid};
use terrain::{HOLE_CLASS, LoadModule, PostRect, QUANTA_PER_METRE};

use crate::{ExportError, Product, Put, Work};

/// Whose import the tiles are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// PNG, the northern row first; tiles count from the north-west.
    Unreal,
    /// RAW, little-endian, the southern row first; tiles count from the south-west.
    Unity,
}

impl Engine {
    /// The sides of a tile that the engine takes, in samples.
    pub fn sizes(self) -> &'static [usize] {
        match self {
            Engine::Unreal => &[505, 1009, 2017, 4033, 8129],
            Engine::Unity => &[33, 65, 129, 257, 513, 1025, 2049, 4097],
        }
    }

    /// The least size with which one tile holds so many samples a side; else the one that is handled well.
    fn size_for(self, samples: usize) -> usize {
        let many = match self {
            Engine::Unreal => 2017,
            Engine::Unity => 2049,
        };
        self.sizes().iter().copied().find(|&size| samples <= size).unwrap_or(many)
    }
}

/// Steps of height that 16 bits count.
const STEPS: f64 = 65_535.0;

/// Writes a tile for each square of `size` samples, or of the size that suits the area, and `heightmap.json`.
///
/// # Errors
/// When the engine has no such size, a file cannot be written, or the work was asked to stop.
pub fn write_heightmap(
    product: &Product,
    engine: Engine,
    size: Option<usize>,
    put: &Put,
    work: &Work,
) -> Result<(), ExportError> {
    if let Some(size) = size.filter(|size| !engine.sizes().contains(size)) {
        let sizes: Vec<String> = engine.sizes().iter().map(usize::to_string).collect();
        return Err(ExportError::Impossible {
            what: "the size of a tile".into(),
            found: format!("{size} samples"),
            expected: format!("one of {}", sizes.join(", ")),
            hint: "the engine imports these sizes only; leave --size out for the one that suits the area".into(),
        });
    }
    let raster = sample(product, work)?;
    let size = size.unwrap_or_else(|| engine.size_for(raster.wide.max(raster.high())));
    let tiles = [raster.wide, raster.high()].map(|samples| (samples - 1).div_ceil(size - 1).max(1));
    let numbers: Vec<[usize; 2]> = (0..tiles[1]).flat_map(|y| (0..tiles[0]).map(move |x| [x, y])).collect();
    let scale = Scale::of(&raster.heights);
    let files = work.each("tiles", &numbers, |&[x, y]| {
        let samples = tile(&raster, &scale, engine, size, [x, y]);
        let extension = if engine == Engine::Unreal { "png" } else { "raw" };
        let name = format!("{}_x{x}_y{y}.{extension}", file_stem(&product.manifest.area.name));
        let bytes = match engine {
            Engine::Unreal => png_of(size, &samples).map_err(ExportError::write(&name))?,
            Engine::Unity => samples.iter().flat_map(|sample| sample.to_le_bytes()).collect(),
        };
        put(&name, &bytes).map_err(ExportError::write(&name))?;
        Ok(name)
    })?;
    let about = about(product, &raster, &scale, engine, size, &files);
    put("heightmap.json", format!("{about:#}\n").as_bytes()).map_err(ExportError::write("heightmap.json"))
}

/// Heights of the surface at posts in metres, row by row from the south.
struct Samples {
    wide: usize,
    heights: Vec<f64>,
    /// How many of them lie over holes.
    holes: usize,
}

impl Samples {
    fn high(&self) -> usize {
        self.heights.len() / self.wide
    }

    /// That at a row and column, or at the nearest of the area.
    fn at(&self, row: usize, col: usize) -> f64 {
        self.heights[row.min(self.high() - 1) * self.wide + col.min(self.wide - 1)]
    }
}

fn sample(product: &Product, work: &Work) -> Result<Samples, ExportError> {
    let posts = product.grid.posts_of_rect(product.rect);
    let (wide, mut heights, mut holes) = (posts.posts_wide(), vec![0.0; posts.post_count()], 0);
    let indices: Vec<usize> = (0..product.modules.len()).collect();
    let rows = work.each("load modules", &indices, |&index| Ok(sample_module(product, &product.modules[index])))?;
    for (place, height, is_hole) in rows.into_iter().flatten() {
        heights[index_of(posts, wide, place)] = height;
        holes += usize::from(is_hole);
    }
    Ok(Samples { wide, heights, holes })
}

fn index_of(posts: PostRect, wide: usize, [row, col]: [i32; 2]) -> usize {
    (row - posts.south) as usize * wide + (col - posts.west) as usize
}

/// Every post that a load module owns, the height there, and whether it lies over a hole; on the far sides of what is
/// exported, those on the line too.
fn sample_module(product: &Product, module: &LoadModule) -> Vec<([i32; 2], f64, bool)> {
    let far = |is_last: bool| is_last.then_some(product.grid.side_cells);
    let posts = PostGrid {
        origin: product.grid.posts_of(module.id).south_west(),
        units_per_post: product.frame.spacing.quanta_per_post(),
        far_row: far(module.id.row + 1 == product.rect.north),
        far_col: far(module.id.col + 1 == product.rect.east),
    };
    let step = i64::from(posts.units_per_post);
    let mut found = Vec::new();
    for (&triangle, &class) in module.triangles.iter().zip(&module.classes) {
        let corners = triangle.map(|v| module.vertices[usize::from(v)]);
        let facet = Facet::new(corners.map(|v| i32::from(v.x)), corners.map(|v| i32::from(v.y)), corners.map(|v| v.z));
        for (row, cols) in OwnedRows::new(&posts, &facet) {
            for col in cols {
                let east = facet.px * (i64::from(col) * step - i64::from(facet.x[0]));
                let north = facet.py * (i64::from(row) * step - i64::from(facet.y[0]));
                let quanta = f64::from(facet.z[0]) + (east + north) as f64 / facet.den as f64;
                let place = [posts.origin.row + row, posts.origin.col + col];
                found.push((place, quanta / f64::from(QUANTA_PER_METRE), class == HOLE_CLASS));
            }
        }
    }
    found
}

/// How heights become 16 bits: one scale for all tiles.
struct Scale {
    low_m: f64,
    step_m: f64,
}

impl Scale {
    fn of(heights: &[f64]) -> Self {
        let low_m = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high_m = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Ground of one height has any scale.
        let step_m = if low_m < high_m { (high_m - low_m) / STEPS } else { 1.0 / f64::from(QUANTA_PER_METRE) };
        Self { low_m, step_m }
    }

    fn steps(&self, height_m: f64) -> u16 {
        ((height_m - self.low_m) / self.step_m).round().clamp(0.0, STEPS) as u16
    }
}

/// The samples of a tile in the order of its file.
fn tile(raster: &Samples, scale: &Scale, engine: Engine, size: usize, [x, y]: [usize; 2]) -> Vec<u16> {
    let last_row = raster.high() - 1;
    let sample = |line: usize, col: usize| {
        let row = match engine {
            // From the north; beyond the southern border the last row goes on.
            Engine::Unreal => last_row.saturating_sub(line),
            Engine::Unity => line,
        };
        scale.steps(raster.at(row, col))
    };
    let start = |number: usize| number * (size - 1);
    (start(y)..start(y) + size).flat_map(|line| (start(x)..start(x) + size).map(move |col| sample(line, col))).collect()
}

fn png_of(size: usize, samples: &[u16]) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size as u32, size as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::Fast);
    let big_endian: Vec<u8> = samples.iter().flat_map(|sample| sample.to_be_bytes()).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&big_endian)?;
    writer.finish()?;
    Ok(bytes)
}

/// The name of an area where files of engines have only letters, digits, hyphens and underscores.
fn file_stem(name: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let stem: String = name.chars().map(letter).collect();
    if stem.is_empty() { "area".into() } else { stem }
}

fn about(product: &Product, raster: &Samples, scale: &Scale, engine: Engine, size: usize, files: &[String]) -> Value {
    let spacing_m = product.frame.spacing.metres();
    let side_m = (size - 1) as f64 * spacing_m;
    let [west, south] = product.corner_m(product.rect.south, product.rect.west);
    let [east, north] = product.corner_m(product.rect.north, product.rect.east);
    let tiles_high = (raster.high() - 1).div_ceil(size - 1).max(1) as f64;
    let import = match engine {
        // 128 steps of 16 bits are 1 cm at a scale of 1 and 1 m at the usual 100; 32768 is height 0.
        Engine::Unreal => json!({
            "where": "Landscape mode, Import from File; with several tiles a World Partition level",
            "scale_x": 100.0 * spacing_m, "scale_y": 100.0 * spacing_m, "scale_z": 100.0 * 128.0 * scale.step_m,
            "location_z_cm": 100.0 * (scale.low_m + 32_768.0 * scale.step_m),
            "resolution": size,
            "axes": "X east, Y south; x0_y0 is the north-west tile",
        }),
        // The importer divides by 2^16.
        Engine::Unity => json!({
            "where": "Terrain Settings, Import Raw: depth Bit 16, byte order Windows, no vertical flip",
            "resolution": size, "terrain_width": side_m, "terrain_length": side_m,
            "terrain_height": 65_536.0 * scale.step_m, "position_y": scale.low_m,
            "axes": "X east, Z north; x0_y0 is the south-west tile",
        }),
    };
    let corner_m = match engine {
        Engine::Unreal => [west, north],
        Engine::Unity => [west, south],
    };
    json!({
        "area": product.manifest.area.name,
        "crs": product.crs(),
        "vertical_datum": product.vertical_datum(),
        "engine": if engine == Engine::Unreal { "unreal" } else { "unity" },
        "import": import,
        "tiles": files,
        "samples_a_side": size,
        "spacing_m": spacing_m,
        "first_corner_m": corner_m,
        "bounds_m": { "west": west, "south": south, "east": east, "north": north },
        "continued_beyond_m": [
            (raster.wide - 1).div_ceil(size - 1).max(1) as f64 * side_m - (east - west),
            tiles_high * side_m - (north - south),
        ],
        "lowest_m": scale.low_m,
        "step_m": scale.step_m,
        "height_is": "lowest_m + value * step_m",
        "hole_samples": raster.holes,
        "attribution": product.attributions(),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Mutex;
    use std::sync::atomic::AtomicBool;

    use schedule::Workers;

    use super::*;
    use crate::samples;

    fn files(product: &Product, engine: Engine, size: Option<usize>) -> BTreeMap<String, Vec<u8>> {
        let files = Mutex::new(BTreeMap::new());
        let put = |name: &str, bytes: &[u8]| {
            files.lock().unwrap().insert(name.to_owned(), bytes.to_vec());
            Ok(())
        };
        let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
        write_heightmap(product, engine, size, &put, &Work { workers: &workers, stop: &stop, tell: &|_| {} }).unwrap();
        files.into_inner().unwrap()
    }

    fn values(raw: &[u8]) -> Vec<u16> {
        raw.chunks(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect()
    }

    #[test]
    fn tiles_share_their_border_rows_and_one_scale() {
        let files = files(&samples::product(), Engine::Unity, Some(33));
        let names: Vec<&str> = files.keys().map(String::as_str).collect();
        assert_eq!(names, ["heightmap.json", "sample_x0_y0.raw", "sample_x1_y0.raw"]);
        let [west, east] = ["sample_x0_y0.raw", "sample_x1_y0.raw"].map(|name| values(&files[name]));
        assert_eq!(west.len(), 33 * 33);
        let column = |tile: &[u16], col: usize| (0..33).map(|row| tile[33 * row + col]).collect::<Vec<_>>();
        assert_eq!(column(&west, 32), column(&east, 0));
        let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
        assert_eq!((&about["lowest_m"], &about["import"]["terrain_width"]), (&json!(992.1875), &json!(800.0)));
        let height =
            |value: u16| about["lowest_m"].as_f64().unwrap() + f64::from(value) * about["step_m"].as_f64().unwrap();
        let highest = west.iter().chain(&east).copied().max().unwrap();
        assert_eq!((highest, height(highest).round()), (65_535, 1004.0));
    }

    #[test]
    fn a_png_has_its_northern_row_first_and_numbers_for_the_import() {
        let files = files(&samples::product(), Engine::Unreal, None);
        let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
        assert_eq!((&about["samples_a_side"], &about["import"]["scale_x"]), (&json!(505), &json!(2500.0)));
        let decoder = png::Decoder::new(std::io::Cursor::new(&files["sample_x0_y0.png"][..]));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        let at = |row: usize, col: usize| {
            u16::from_be_bytes([bytes[2 * (505 * row + col)], bytes[2 * (505 * row + col) + 1]])
        };
        let unity = values(&self::files(&samples::product(), Engine::Unity, Some(65))["sample_x0_y0.raw"]);
        for row in 0..21 {
            for col in 0..41 {
                assert_eq!(at(row, col), unity[65 * (20 - row) + col]);
            }
        }
        assert_eq!(at(400, 400), at(20, 40), "the border goes on");
    }

    #[test]
    fn a_size_that_the_engine_does_not_take_is_refused_with_those_it_takes() {
        let (workers, stop) = (Workers::new(1), AtomicBool::new(false));
        let work = Work { workers: &workers, stop: &stop, tell: &|_| {} };
        let put = |_: &str, _: &[u8]| Ok(());
        let error = write_heightmap(&samples::product(), Engine::Unity, Some(100), &put, &work).unwrap_err();
        assert!(error.to_string().contains("found 100 samples, expected one of 33, 65"), "{error}");
    }

    #[test]
    fn samples_over_holes_are_counted_and_as_high_as_the_triangles_that_close_them() {
        let files = files(&samples::with_hole(), Engine::Unity, Some(33));
        let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
        assert!(0 < about["hole_samples"].as_u64().unwrap());
        assert_eq!(
            files["sample_x0_y0.raw"],
            self::files(&samples::product(), Engine::Unity, Some(33))["sample_x0_y0.raw"]
        );
    }
}
