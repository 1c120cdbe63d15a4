//! Pictures inside the page: a bare map, with title, scale and legend in letters of the page around it, so that they
//! are read on a phone as well as on a desk.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use store::Report;
use terrain::{Each, gather};

use super::marks::Marks;
use crate::picture::{
    Drawing, GREY, Image, Key, Legend, Map, NO_RESIDUAL, NOTHING, RESIDUAL_SCALE_M, Scene, SceneGround, Shown,
    drawings, hex, length_text, module_pictures, round_length,
};

/// Pixels along the longer side of a map.
const MAP_PIXELS: usize = 900;
/// The same of each of the two maps of limits.
const LIMITS_PIXELS: usize = 640;
/// Pixels along a picture of one load module.
const MODULE_PIXELS: usize = 260;

/// A picture as an address that holds all of it.
pub(crate) fn data_uri(image: &Image) -> String {
    let mut bytes = Vec::new();
    image.write_png(&mut bytes).expect("memory takes whatever is written to it");
    format!("data:image/png;base64,{}", STANDARD.encode(&bytes))
}

fn figure(drawing: &Drawing, caption: &str, over: &Markup) -> Markup {
    let Drawing { sheet, map, map_extent } = drawing;
    let scale_m = round_length(0.3 * map_extent.metres_per_pixel() * map_extent.pixels[0] as f64);
    let scale_share = scale_m / (map_extent.extent_m[2] - map_extent.extent_m[0]);
    html! {
        figure style=(format!("max-width:{}px", map.wide())) {
            figcaption { b { (caption) } " " (sheet.subtitle) "." }
            div.map {
                img src=(data_uri(map)) width=(map.wide()) height=(map.high()) alt={ (sheet.title) ": " (caption) };
                (over)
            }
            div.scale style=(format!("width:{:.2}%", 100.0 * scale_share)) { (length_text(scale_m)) }
            @for legend in &sheet.legends { (legend_html(legend)) }
            p.quiet { "North is up; " (extent_text(drawing)) ". " (sheet.notes) }
        }
    }
}

fn extent_text(drawing: &Drawing) -> String {
    let ([west, south, east, north], place) = (drawing.map_extent.extent_m, &drawing.sheet.coordinates);
    let [east_0, north_0] = place.origin_m;
    let km = |metres: f64| metres / 1000.0;
    let crs = if place.crs.is_empty() { String::new() } else { format!(" in {}", place.crs) };
    let (west, east, south, north) = (km(east_0 + west), km(east_0 + east), km(north_0 + south), km(north_0 + north));
    format!("from {west} to {east} km east and from {south} to {north} km north{crs}")
}

fn legend_html(legend: &Legend) -> Markup {
    html! {
        div.legend {
            @match legend {
                Legend::Ramp { title, ramp, marks } => {
                    @let colors: Vec<String> = ramp.0.iter().copied().map(hex).collect();
                    b { (title) }
                    div.ramp style={ "background:linear-gradient(to right," (colors.join(",")) ")" } {}
                    div.marks {
                        @for (share, text) in marks {
                            span style=(mark_style(*share)) { (text) }
                        }
                    }
                },
                Legend::Keys { title, keys } => {
                    @if !title.is_empty() { b { (title) } }
                    @for (key, text) in keys { span.key { i style=(key_style(*key)) {} (text) } }
                },
                Legend::Lines { title, lines } => { b { (title) ": " } (lines.join(", ")) },
            }
        }
    }
}

/// Marks at the ends of a scale stand inside it.
fn mark_style(share: f64) -> String {
    match share {
        share if share < 0.04 => format!("left:{:.2}%", 100.0 * share),
        share if share <= 0.96 => format!("left:{:.2}%;transform:translateX(-50%)", 100.0 * share),
        share => format!("right:{:.2}%", 100.0 * (1.0 - share).max(0.0)),
    }
}

fn key_style(key: Key) -> String {
    match key {
        Key::Filled(color) | Key::Crossed(color) => format!("background:{}", hex(color)),
        Key::Framed(color) => format!("border:3px solid {}", hex(color)),
        Key::Hatched => {
            let (line, ground) = (hex(GREY), hex(NOTHING));
            format!("background:repeating-linear-gradient(135deg,{ground} 0 3px,{line} 3px 5px)")
        }
        Key::Line(color) => format!("height:2px;background:{}", hex(color)),
    }
}

/// A map of the page.
#[derive(Clone, Copy)]
pub(super) enum Figure {
    /// The surface, with the marks that tables link to.
    First,
    /// Roads and water, and what became of them.
    Features,
    Residuals,
    Density,
    Limits,
    Tiles,
}

/// The maps of the page.
pub(super) struct Figures(Vec<Markup>);

impl Figures {
    const ALL: [Figure; 6] =
        [Figure::First, Figure::Features, Figure::Residuals, Figure::Density, Figure::Limits, Figure::Tiles];

    /// Draws them; `each` runs one beside the other.
    pub(super) fn of(report: &Report, scene: &Scene, marks: &Marks, each: Each) -> Self {
        Self(gather(each, Self::ALL.len(), |number| Self::ALL[number].draw(report, scene, marks)))
    }

    pub(super) fn get(&self, figure: Figure) -> &Markup {
        &self.0[figure as usize]
    }

    /// All but those that stand in sections of their own.
    pub(super) fn maps(&self) -> Markup {
        html! {
            (self.get(Figure::Residuals))
            (self.get(Figure::Density))
            div.pair { (self.get(Figure::Limits)) }
            (self.get(Figure::Tiles))
        }
    }
}

impl Figure {
    fn draw(self, report: &Report, scene: &Scene, marks: &Marks) -> Markup {
        let none = html! {};
        match self {
            Self::First => {
                let caption = "The compiled surface, as a simulator loads it.";
                figures(scene, Map::Relief(Shown::Tin), MAP_PIXELS, caption, &marks.over(scene))
            }
            Self::Features if report.features.is_none() && report.objects.is_none() => none,
            Self::Features => {
                let caption =
                    "Where roads and water run, what stands beside them, and where something was wrong with one.";
                figures(scene, Map::Features, MAP_PIXELS, caption, &none)
            }
            Self::Residuals => {
                let per_pixel = scene.map_extent(MAP_PIXELS).metres_per_pixel();
                // Those of load modules are known without the ground.
                if scene.ground.is_none() && per_pixel <= scene.frame.spacing.metres() {
                    return without_residuals();
                }
                let caption = "How far the triangles lie from the ground.";
                figures(scene, Map::Residuals(RESIDUAL_SCALE_M), MAP_PIXELS, caption, &none)
            }
            Self::Density => figures(scene, Map::Density, MAP_PIXELS, "Where the triangles went.", &none),
            Self::Limits => figures(scene, Map::Limits, LIMITS_PIXELS, "How much of a limit is used.", &none),
            Self::Tiles => {
                let caption = "How the work was cut, and in which order tiles build on each other.";
                figures(scene, Map::Tiles, MAP_PIXELS, caption, &none)
            }
        }
    }
}

fn figures(scene: &Scene, map: Map, pixels: usize, caption: &str, over: &Markup) -> Markup {
    html! { @for drawing in &drawings(scene, map, pixels) { (figure(drawing, caption, over)) } }
}

fn without_residuals() -> Markup {
    html! {
        p.quiet {
            "No map of residuals: the ground was not there to be looked at. "
            code { "tiefort report --format html --against DEM" } " draws it."
        }
    }
}

/// Wireframe and residuals of one load module.
pub(crate) fn module_images(scene: &Scene, module: &terrain::LoadModule) -> Markup {
    let (row, col) = (module.id.row, module.id.col);
    let (wires, residuals) = module_pictures(scene, module, MODULE_PIXELS);
    html! {
        img src=(data_uri(&wires)) alt={ "wireframe of load module " (row) "," (col) };
        @if let Some(residuals) = residuals {
            img src=(data_uri(&residuals)) alt={ "residuals of load module " (row) "," (col) };
        }
    }
}

/// Residuals of a ground in metres, voids left out.
pub(crate) fn residuals_m<'a>(ground: &SceneGround<'a>) -> impl Iterator<Item = f64> + use<'a> {
    let known = ground.residuals.iter().filter(|&&residual| residual != NO_RESIDUAL);
    known.map(|&residual| terrain::metres_of_quanta(residual))
}
