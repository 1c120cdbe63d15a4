//! Heightmaps of 16 bits for game engines: square tiles that share their border rows, with one scale of heights for
//! all; a map of weights for each class on the same samples; what stands on the ground as placements; and a JSON with
//! the numbers that the engine's import dialog asks for.
//!
//! Tiles have sizes of the engine's own, so samples divide the area evenly from border to border, no farther apart than
//! the posts of the working grid. Each has the height of the compiled surface at its place; over holes, where no source
//! has a height, that of the triangles which close them.

mod placements;
mod samples;

use serde_json::{Value, json};
use terrain::HOLE_CLASS;

use crate::classes::HOLE_NAME;
use crate::sheets::Material;
use crate::{ExportError, Product, Put, Sheet, Work, textures};
pub use placements::Engine;
use placements::placements;
use samples::{Off, Samples};

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
    let layout = Layout::of(product, engine, size);
    let samples = Samples::of(product, layout.samples(), work)?;
    let off = samples.off(product, work)?;
    let layers = layers(product, &samples);
    let files = work.each("tiles", &layout.numbers(), |&number| write_tile(product, &layout, &samples, number, put))?;
    work.each("maps of weights", &layers, |layer| {
        for number in layout.numbers() {
            let name = layer_file(product, layer, number);
            let weights = layout.tile(number, true, |at| if samples.classes[at] == layer.class { u8::MAX } else { 0 });
            let bytes = png_of(layout.size, png::BitDepth::Eight, &weights)?;
            put(&name, &bytes)?;
        }
        Ok(())
    })?;
    let mut about = about(product, &layout, &samples, off);
    about["tiles"] = json!(files);
    if !layers.is_empty() {
        about["weights"] = weights_told(product, &layout, &layers);
    }
    if let Some(text) = placements(product, engine) {
        about["objects"] = placements::told(engine);
        put(placements::FILE, text.as_bytes())?;
    }
    put("heightmap.json", format!("{about:#}\n").as_bytes())
}

/// How the area is divided into tiles and samples.
struct Layout {
    engine: Engine,
    /// Samples along a side of a tile.
    size: usize,
    /// Tiles from west to east, and from south to north.
    tiles: [usize; 2],
    /// Metres between samples, likewise.
    spacing_m: [f64; 2],
}

impl Layout {
    fn of(product: &Product, engine: Engine, size: Option<usize>) -> Self {
        let posts = product.grid.posts_of_rect(product.rect);
        let posts = [posts.posts_wide(), posts.posts_high()];
        let size = size.unwrap_or_else(|| engine.size_for(posts[0].max(posts[1])));
        let tiles = posts.map(|count| (count - 1).div_ceil(size - 1).max(1));
        let post_m = product.frame.spacing.metres();
        let spacing_m = [0, 1].map(|axis| (posts[axis] - 1) as f64 * post_m / (tiles[axis] * (size - 1)) as f64);
        Self { engine, size, tiles, spacing_m }
    }

    /// Samples from west to east and from south to north; tiles share those on their borders.
    fn samples(&self) -> [usize; 2] {
        self.tiles.map(|count| count * (self.size - 1) + 1)
    }

    /// Columns and rows of tiles, as the engine counts them.
    fn numbers(&self) -> Vec<[usize; 2]> {
        (0..self.tiles[1]).flat_map(|y| (0..self.tiles[0]).map(move |x| [x, y])).collect()
    }

    /// The samples of a tile by their places in the raster, from its northern or its southern row on.
    fn tile<T>(&self, [x, y]: [usize; 2], is_from_north: bool, of: impl Fn(usize) -> T) -> Vec<T> {
        let [wide, high] = self.samples();
        let south = match self.engine {
            Engine::Unreal => high - 1 - (y + 1) * (self.size - 1),
            Engine::Unity => y * (self.size - 1),
        };
        let row = |line: usize| if is_from_north { south + self.size - 1 - line } else { south + line };
        let west = x * (self.size - 1);
        let places = (0..self.size).flat_map(|line| (0..self.size).map(move |col| row(line) * wide + west + col));
        places.map(of).collect()
    }
}

fn write_tile(
    product: &Product,
    layout: &Layout,
    samples: &Samples,
    number: [usize; 2],
    put: &Put,
) -> Result<String, ExportError> {
    let is_png = layout.engine == Engine::Unreal;
    let name = tile_name(product, "", number, if is_png { "png" } else { "raw" });
    let heights = layout.tile(number, is_png, |at| samples.heights[at]);
    let bytes: Vec<u8> = match layout.engine {
        Engine::Unreal => {
            let big_endian: Vec<u8> = heights.iter().flat_map(|height| height.to_be_bytes()).collect();
            png_of(layout.size, png::BitDepth::Sixteen, &big_endian)?
        }
        Engine::Unity => heights.iter().flat_map(|height| height.to_le_bytes()).collect(),
    };
    put(&name, &bytes)?;
    Ok(name)
}

/// A class that has a map of weights.
struct Layer {
    class: u8,
    name: String,
}

/// The classes that any sample has, where there are several.
fn layers(product: &Product, samples: &Samples) -> Vec<Layer> {
    let mut is_there = [false; 256];
    samples.classes.iter().for_each(|&class| is_there[usize::from(class)] = true);
    let name = |class: u8| match class {
        HOLE_CLASS => HOLE_NAME.to_owned(),
        class => Material { sheet: Sheet::Ground, class }.word(product.classes()),
    };
    let there = (0..=u8::MAX).filter(|&class| is_there[usize::from(class)]);
    let layers: Vec<Layer> = there.map(|class| Layer { class, name: name(class) }).collect();
    if layers.len() < 2 { Vec::new() } else { layers }
}

fn layer_file(product: &Product, layer: &Layer, number: [usize; 2]) -> String {
    format!("weights/{}", tile_name(product, &format!("_{}_{}", layer.class, layer.name), number, "png"))
}

fn weights_told(product: &Product, layout: &Layout, layers: &[Layer]) -> Value {
    let layer = |layer: &Layer| {
        let files: Vec<String> = layout.numbers().iter().map(|&number| layer_file(product, layer, number)).collect();
        json!({ "class": layer.name, "files": files })
    };
    json!({
        "is": "8 bits, the northern row first; 255 where a sample is of the class, else 0",
        "layers": layers.iter().map(layer).collect::<Vec<_>>(),
    })
}

/// The file of a tile of grey samples.
fn png_of(size: usize, depth: png::BitDepth, samples: &[u8]) -> Result<Vec<u8>, ExportError> {
    textures::png_of([size; 2], samples, |encoder| {
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(depth);
        encoder.set_compression(png::Compression::Fast);
    })
}

/// The name of a file of an area, where files of engines have only letters, digits, hyphens and underscores.
fn tile_name(product: &Product, of: &str, [x, y]: [usize; 2], extension: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let stem: String = product.manifest.area.name.chars().chain(of.chars()).map(letter).collect();
    let stem = if product.manifest.area.name.is_empty() { format!("area{stem}") } else { stem };
    format!("{stem}_x{x}_y{y}.{extension}")
}

/// The numbers of the engine's import dialog, by the names that it has for them.
fn import(layout: &Layout, samples: &Samples) -> Value {
    let (scale, size) = (samples.scale, layout.size);
    match layout.engine {
        Engine::Unreal => {
            let section = if size == 8129 { 127 } else { 63 };
            let components = (size - 1) / (2 * section);
            json!({
                "where": "Landscape mode, New, Import from File; with several tiles a World Partition level",
                "Section Size": format!("{section}x{section} Quads"),
                "Sections Per Component": "2x2 Sections",
                "Number of Components": [components, components],
                "Overall Resolution": [size, size],
                // The dialog places the middle of the landscape. 128 steps of 16 bits are 1 cm at a scale of 1 and 1 m
                // at the usual 100; 32768 is height 0.
                "Location": { "X": 0.0, "Y": 0.0, "Z": 100.0 * (scale.low_m + 32_768.0 * scale.step_m) },
                "Scale": {
                    "X": 100.0 * layout.spacing_m[0],
                    "Y": 100.0 * layout.spacing_m[1],
                    "Z": 100.0 * 128.0 * scale.step_m,
                },
                "axes": "X east, Y south; x0_y0 is the north-west tile",
            })
        }
        // The importer divides by 2^16.
        Engine::Unity => json!({
            "where": "Terrain Settings, Import Raw",
            "Depth": "Bit 16",
            "Resolution": size,
            "Byte Order": "Windows",
            "Flip Vertically": false,
            "Terrain Size": {
                "X": (size - 1) as f64 * layout.spacing_m[0],
                "Y": 65_536.0 * scale.step_m,
                "Z": (size - 1) as f64 * layout.spacing_m[1],
            },
            "Position": { "X": 0.0, "Y": scale.low_m, "Z": 0.0 },
            "axes": "X east, Z north; x0_y0 is the south-west tile, others lie beside it by its Terrain Size",
        }),
    }
}

fn about(product: &Product, layout: &Layout, samples: &Samples, off: Off) -> Value {
    let [west, south] = product.corner_m(product.rect.south, product.rect.west);
    let [east, north] = product.corner_m(product.rect.north, product.rect.east);
    json!({
        "area": product.manifest.area.name,
        "crs": product.crs(),
        "vertical_datum": product.vertical_datum(),
        "engine": if layout.engine == Engine::Unreal { "unreal" } else { "unity" },
        "import": import(layout, samples),
        "samples_a_side": layout.size,
        "samples": [samples.wide, samples.high()],
        "spacing_m": layout.spacing_m,
        "spacing_of_posts_m": product.frame.spacing.metres(),
        "first_corner_m": [west, if layout.engine == Engine::Unreal { north } else { south }],
        "bounds_m": { "west": west, "south": south, "east": east, "north": north },
        "lowest_m": samples.scale.low_m,
        "step_m": samples.scale.step_m,
        "height_is": "lowest_m + value * step_m",
        "off_at_posts_m": { "max": off.max_m, "rms": off.rms_m },
        "hole_samples": samples.holes(),
        "attribution": product.attributions(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;
    use std::collections::BTreeMap;

    fn files(product: &Product, engine: Engine, size: Option<usize>) -> BTreeMap<String, Vec<u8>> {
        samples::files(|put, work| write_heightmap(product, engine, size, put, work))
    }

    fn values(raw: &[u8]) -> Vec<u16> {
        raw.chunks(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect()
    }

    #[test]
    fn tiles_share_their_border_rows_and_one_scale() {
        let files = files(&samples::product(), Engine::Unity, Some(33));
        let names: Vec<&str> = files.keys().map(String::as_str).filter(|name| !name.starts_with("weights/")).collect();
        assert_eq!(names, ["heightmap.json", "sample_x0_y0.raw", "sample_x1_y0.raw"]);
        let [west, east] = ["sample_x0_y0.raw", "sample_x1_y0.raw"].map(|name| values(&files[name]));
        assert_eq!(west.len(), 33 * 33);
        let column = |tile: &[u16], col: usize| (0..33).map(|row| tile[33 * row + col]).collect::<Vec<_>>();
        assert_eq!(column(&west, 32), column(&east, 0));
        let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
        // 1,000 m by 500 m of ground, to its borders and not beyond.
        let terrain = &about["import"]["Terrain Size"];
        assert_eq!(
            (&about["lowest_m"], &terrain["X"], &terrain["Z"]),
            (&json!(992.1875), &json!(500.0), &json!(500.0))
        );
        let height =
            |value: u16| about["lowest_m"].as_f64().unwrap() + f64::from(value) * about["step_m"].as_f64().unwrap();
        let highest = west.iter().chain(&east).copied().max().unwrap();
        assert_eq!((highest, height(highest).round()), (65_535, 1004.0));
    }

    /// The samples of a PNG of 8 or 16 bits, the northern row first.
    fn png_values(bytes: &[u8]) -> (usize, Vec<u16>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        let values = match info.bit_depth {
            png::BitDepth::Sixteen => data.chunks(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect(),
            _ => data.into_iter().map(u16::from).collect(),
        };
        (info.width as usize, values)
    }

    #[test]
    fn samples_go_from_border_to_border_and_a_png_has_its_northern_row_first() {
        let product = samples::product();
        let files = files(&product, Engine::Unreal, None);
        let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
        let import = &about["import"];
        // Of 1,000 m by 500 m with a post each 25 m.
        assert_eq!((&about["samples_a_side"], &about["samples"]), (&json!(127), &json!([127, 127])));
        assert_eq!(import["Number of Components"], json!([1, 1]));
        let scale = |axis: &str| import["Scale"][axis].as_f64().unwrap();
        assert!((scale("X") * 126.0 - 100_000.0).abs() < 1e-6 && (scale("Y") * 126.0 - 50_000.0).abs() < 1e-6);
        let (size, values) = png_values(&files["sample_x0_y0.png"]);
        let height = |line: usize, col: usize| {
            let above_m = (f64::from(values[line * size + col]) - 32_768.0) / 128.0 * scale("Z") / 100.0;
            above_m + import["Location"]["Z"].as_f64().unwrap() / 100.0
        };
        let mut index = crate::triangle_index::TriangleIndex::new(&product);
        let half_m = about["step_m"].as_f64().unwrap() / 2.0;
        for (line, col) in (0..size).flat_map(|line| (0..size).map(move |col| (line, col))) {
            let share = |index: usize| index as f64 / 126.0;
            let place_m = [505_000.0 + 1000.0 * share(col), 3_875_000.0 + 500.0 * share(126 - line)];
            let ground = index.at(place_m).unwrap();
            assert!((height(line, col) - ground.height_m).abs() < half_m + 1e-6, "{line} {col}");
        }
        // Posts lie between samples, and no farther from them than the ground bends there.
        let off = |of: &str| about["off_at_posts_m"][of].as_f64().unwrap();
        assert!(0.0 < off("rms") && off("rms") < off("max") && off("max") < 0.5, "{} {}", off("rms"), off("max"));
    }

    #[test]
    fn each_class_has_a_map_of_weights_on_the_same_samples() {
        for engine in [Engine::Unreal, Engine::Unity] {
            let files = files(&samples::with_hole(), engine, Some(engine.sizes()[0]));
            let about: Value = serde_json::from_slice(&files["heightmap.json"]).unwrap();
            let layers = about["weights"]["layers"].as_array().unwrap();
            let classes: Vec<&str> = layers.iter().map(|layer| layer["class"].as_str().unwrap()).collect();
            assert_eq!(classes, ["class_0", "class_1", "hole"]);
            let mut sums = vec![0; png_values(&files[layers[0]["files"][0].as_str().unwrap()]).1.len()];
            for layer in layers {
                let (size, weights) = png_values(&files[layer["files"][0].as_str().unwrap()]);
                assert_eq!(size, engine.sizes()[0]);
                sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += weight);
            }
            assert!(sums.iter().all(|sum| *sum == 255));
        }
    }

    #[test]
    fn a_size_that_the_engine_does_not_take_is_refused_with_those_it_takes() {
        let put = |_: &str, _: &[u8]| Ok(());
        let write = |work: &Work| write_heightmap(&samples::product(), Engine::Unity, Some(100), &put, work);
        let error = samples::with_work(write).unwrap_err();
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
