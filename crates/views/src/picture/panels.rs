//! Pictures of several surfaces from one eye, side by side under one title.

use terrain::ObjectKind;

use super::camera::Camera;
use super::color::{GREY, INK, NOTHING, WHITE};
use super::image::Image;
use super::objects::object_keys;
use super::perspective::{Drawn, Look, Surface, draw_perspective, draw_wireframe};
use super::relief::Tints;
use super::sheet::{Key, Legend, draw_scale};
use super::text::{Anchor, Font, fitted, wrapped, write};

/// How surfaces are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// In colours of their heights, under light.
    Shaded,
    /// Their edges.
    Wireframe,
}

/// A surface, and what it is called.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// Above its picture, such as `TIN, 5,000 points`.
    pub label: String,
    /// What is drawn.
    pub surface: Surface<'a>,
}

/// Pixels between panels, and around them.
const GAP: i64 = 16;
/// Pixels of the column that north, scale and tints stand in.
const LEGEND_WIDE: i64 = 210;
/// Pixels of that column above the tints.
const ABOVE_TINTS: i64 = 146;

/// Draws panels from one eye under one light, `look.pixels` each, with title, north, scale and tints. `eye` says in
/// words where the eye is.
///
/// # Panics
/// When there is no panel.
pub fn draw_panels(title: &str, eye: &str, panels: &[Panel], style: Style, look: &Look) -> Image {
    let drawn: Vec<Drawn> = panels
        .iter()
        .map(|panel| match style {
            Style::Shaded => draw_perspective(&panel.surface, look),
            Style::Wireframe => draw_wireframe(&panel.surface, look),
        })
        .collect();
    let [wide, high] = look.pixels.map(|pixels| pixels as i64);
    let whole = GAP + panels.len() as i64 * (wide + GAP) + LEGEND_WIDE;
    let top = GAP + Font::Title.line() + GAP / 2 + Font::Bold.line();
    let notes = wrapped(&notes(eye, look), Font::Plain, whole - 2 * GAP);
    let has = |cover| panels.iter().any(|panel| panel.surface.has(cover));
    let mut kinds: Vec<ObjectKind> = panels.iter().flat_map(|panel| panel.surface.kinds()).copied().collect();
    kinds.sort_unstable();
    kinds.dedup();
    let tints = match style {
        Style::Shaded => {
            let objects = Legend::Keys { title: "What stands there".into(), keys: object_keys(&kinds) };
            let mut tints = Tints::new(look.range_m).legends(has, Key::Filled(NOTHING));
            tints.extend((!kinds.is_empty()).then_some(objects));
            tints
        }
        Style::Wireframe => Default::default(),
    };
    let body = high.max(ABOVE_TINTS + tints.iter().map(|legend| legend.high() + GAP).sum::<i64>()) + GAP;
    let mut image =
        Image::new(whole as usize, (top + body + notes.len() as i64 * Font::Plain.line() + GAP) as usize, WHITE);
    let title = fitted(title, Font::Title, whole - 2 * GAP);
    write(&mut image, [GAP, GAP], &title, Font::Title, Anchor::Start, INK);
    for (index, (panel, drawn)) in panels.iter().zip(&drawn).enumerate() {
        let left = GAP + index as i64 * (wide + GAP);
        let label = fitted(&panel.label, Font::Bold, wide);
        write(&mut image, [left, top - Font::Bold.line()], &label, Font::Bold, Anchor::Start, INK);
        image.paste(&drawn.image, left as usize, top as usize);
        image.outline([left - 1, top - 1, wide + 2, high + 2], 1, INK);
    }
    let left = GAP + panels.len() as i64 * (wide + GAP);
    draw_compass(&mut image, [left + 34, top + 34], &look.camera);
    if let Some(middle_m) = drawn[0].middle_m {
        draw_scale(&mut image, [left, top + 76], middle_m, LEGEND_WIDE - 2 * GAP);
        write(&mut image, [left, top + 110], "in the middle", Font::Plain, Anchor::Start, GREY);
    }
    let mut below = top + ABOVE_TINTS;
    for legend in tints {
        legend.draw(&mut image, [left, below]);
        below += legend.high() + GAP;
    }
    for (index, line) in notes.iter().enumerate() {
        let place = [GAP, top + body + index as i64 * Font::Plain.line()];
        write(&mut image, place, line, Font::Plain, Anchor::Start, GREY);
    }
    image
}

fn notes(eye: &str, look: &Look) -> String {
    let Camera { direction_degrees, pitch_degrees, field_of_view_degrees, .. } = look.camera;
    let heights = if look.times == 1.0 { String::new() } else { format!(" Heights are drawn {} times.", look.times) };
    format!(
        "{eye}, looking {:.1}° from north over east, {:.1}° {} the horizon, field of view {field_of_view_degrees}°. \
         Light from several directions, most of it from the north-west.{heights}",
        direction_degrees.rem_euclid(360.0),
        pitch_degrees.abs(),
        if pitch_degrees <= 0.0 { "below" } else { "above" },
    )
}

/// A needle that points north, as seen by who looks into the picture.
fn draw_compass(image: &mut Image, [x, y]: [i64; 2], camera: &Camera) {
    let angle = -camera.direction_degrees.to_radians();
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let place =
        |along: f64, across: f64| [x as f64 + along * sin + across * cos, y as f64 - along * cos + across * sin];
    image.line(place(-20.0, 0.0), place(12.0, 0.0), 2.0, INK);
    for step in 0..=24 {
        let along = 4.0 + f64::from(step) * 0.5;
        let half = (16.0 - along) * 0.5;
        image.line(place(along, -half), place(along, half), 1.0, INK);
    }
    let [x, y] = place(27.0, 0.0).map(|at| at.round() as i64);
    write(image, [x, y - Font::Bold.line() / 2], "N", Font::Bold, Anchor::Middle, INK);
}
