//! One small job for every mode of the compiler.

use std::path::Path;

use crate::scene::{ORIGIN_M, Scene, Words};

const CLIP: &str = "edges = \"clip\"";
const MOUNTAINS: &str = "default = 8\nareas = [{ sample = \"mountains\", class = \"mountains\", weight = 1 }]";

/// Follows the section `[tin]`.
const LEVELS: &str = "[lod]\nlevels = [{ inner_share = 0.6 }, { inner_share = 0.25 }]";

/// A mode with its name.
pub type Mode = (&'static str, Words);

fn with(change: impl FnOnce(&mut Words)) -> Words {
    let mut words = Words::sample();
    change(&mut words);
    words
}

fn tin(text: &str) -> Words {
    with(|words| words.tin = text.into())
}

fn clip(text: &str) -> Words {
    with(|words| {
        words.modules = CLIP.into();
        words.tin = text.into();
    })
}

/// Load-module sides are edges of the TIN.
pub fn constrained() -> Vec<Mode> {
    let paper = "method = \"paper\"\npoints = 800";
    vec![
        ("optimised", Words::sample()),
        ("paper", tin(paper)),
        ("paper, allocated globally", tin(&format!("{paper}\nallocation = \"global\""))),
        ("greedy", tin("method = \"greedy\"")),
        ("greedy, squares, allocated equally", tin("method = \"greedy\"\nkey = \"sse\"\nallocation = \"equal\"")),
        ("optimised to a residual", tin("max_residual_m = 12")),
        ("greedy to an rms", tin("method = \"greedy\"\ntarget_rms_m = 9\nallocation = \"equal\"")),
        ("raster order", with(|words| words.order = "order = \"raster\"".into())),
        ("polygons counted", with(|words| words.limits = "count = \"polygons\"".into())),
        (
            "limits that bind, with a pool",
            with(|words| words.limits = "per_load_module = 40\npool = 150\nper_4km_square = 1700".into()),
        ),
        ("mountains masked", with(|words| words.importance = MOUNTAINS.into())),
        (
            "mountains excluded",
            with(|words| words.importance = MOUNTAINS.replace("weight = 1", "weight = 0") + "\nsmooth = \"none\""),
        ),
        ("two tiles excluded", excluded()),
        ("levels of detail", tin(&format!("{LEVELS}\nborder = \"full\""))),
    ]
}

/// Triangles are cut at load-module lines.
pub fn clipped() -> Vec<Mode> {
    let paper = "method = \"paper\"\npoints = 800";
    let with_dem = |words: Words| Words { modules: format!("{CLIP}\nclip_heights = \"dem\""), ..words };
    let with_limits = |limits: &str| Words { limits: limits.into(), ..clip(paper) };
    vec![
        ("clip, paper", clip(paper)),
        ("clip, paper, no proximity test", clip(&format!("{paper}\nproximity = false\nlast_batch = \"finish\""))),
        ("clip, paper, heights of the dem", with_dem(clip(paper))),
        ("clip, greedy squares", clip("method = \"greedy\"\nkey = \"sse\"\npoints = 800\nallocation = \"global\"")),
        ("clip, greedy equal", clip("method = \"greedy\"\npoints = 800\nallocation = \"equal\"")),
        ("clip, to an rms", clip("method = \"greedy\"\ntarget_rms_m = 9")),
        ("clip, raster order", Words { order: "order = \"raster\"".into(), ..clip(paper) }),
        ("clip, regular borders", Words { order: "borders = \"regular\"".into(), ..clip(paper) }),
        ("clip, masked", Words { importance: MOUNTAINS.into(), ..clip(paper) }),
        ("clip, limits that bind", with_limits("per_load_module = 45\npool = 40\nmean_per_load_module = 24")),
        (
            "clip, polygons counted, limits that bind",
            with_limits("count = \"polygons\"\nper_load_module = 36\nper_4km_square = 1300"),
        ),
        ("clip, levels of detail", clip(&format!("{paper}\n{LEVELS}\nborder = \"own\""))),
    ]
}

/// Both kinds.
pub fn all() -> Vec<Mode> {
    constrained().into_iter().chain(clipped()).collect()
}

/// A polygon of weight 0 over the two western tiles of the southern row and part of the next.
fn excluded() -> Words {
    let area = "areas = [{ file = \"excluded.geojson\", class = \"excluded\", weight = 0 }]";
    with(|words| words.importance = format!("{area}\nsmooth = \"none\""))
}

/// The scene of a mode, with the files some of them name.
#[track_caller]
pub fn scene((_, words): &Mode) -> Scene {
    Scene::with_files(words, |folder| write_polygon(&folder.join("excluded.geojson"), [-100.0, -100.0, 3800.0, 1800.0]))
}

/// A rectangle, [west, south, east, north] in metres from the origin, as GeoJSON.
pub fn write_polygon(path: &Path, [west, south, east, north]: [f64; 4]) {
    let [east_m, north_m] = ORIGIN_M;
    let corners = [(west, south), (east, south), (east, north), (west, north), (west, south)];
    let corners: Vec<String> = corners.iter().map(|(x, y)| format!("[{}, {}]", east_m + x, north_m + y)).collect();
    let text = format!(
        "{{\"type\": \"FeatureCollection\", \
         \"crs\": {{\"type\": \"name\", \"properties\": {{\"name\": \"urn:ogc:def:crs:EPSG::32611\"}}}}, \
         \"features\": [{{\"type\": \"Feature\", \"properties\": {{}}, \
         \"geometry\": {{\"type\": \"Polygon\", \"coordinates\": [[{}]]}}}}]}}",
        corners.join(", ")
    );
    std::fs::write(path, text).unwrap();
}
