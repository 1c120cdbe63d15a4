//! Marks over the first map of the page, for the places that its tables list and link to it.

use std::collections::BTreeSet;

use maud::{Markup, html};
use store::ReportPlace;
use terrain::{ModuleId, ModuleRect};

use super::place_text;
use crate::parts::Part;
use crate::picture::Scene;
use crate::table::Cell;

/// Places that the page links to its first map: name of the mark, and the load modules it lies over.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Marks(BTreeSet<(String, [u32; 4])>);

impl Marks {
    /// Those of tables, as far as these are shown, and of these load modules; none without a scene to draw.
    pub fn of(parts: &[Part], scene: Option<&Scene>, worst: &[ModuleId]) -> Self {
        let Some(scene) = scene else { return Self::default() };
        let rows = parts.iter().flat_map(|part| &part.sections).flat_map(|section| section.table.of_page().0);
        let places = rows.flatten().filter_map(|cell| if let Cell::Place(place) = cell { Some(*place) } else { None });
        let places = places.chain(worst.iter().map(|module| ReportPlace::Module([module.row, module.col])));
        let mark = |place| {
            let id = mark_id(place)?;
            let ([row, col], [high, wide]) = match place {
                ReportPlace::Module(at) => (at, [1, 1]),
                ReportPlace::Window(at) => (at, scene.limits.window),
                ReportPlace::Area => return None,
            };
            Some((id, [row, col, (row + high).min(scene.grid.rows), (col + wide).min(scene.grid.cols)]))
        };
        Self(places.filter_map(mark).collect())
    }

    /// A place as a link to the map, where that has a mark of it.
    pub fn link(&self, place: ReportPlace) -> Markup {
        let id = mark_id(place).filter(|id| self.0.iter().any(|(mark, _)| mark == id));
        let text = place_text(place);
        html! {
            @match id {
                Some(id) => a href={ "#" (id) } title="show it on the map" { (text) },
                None => (text),
            }
        }
    }

    /// The marks, to be laid over the map.
    pub fn over(&self, scene: &Scene) -> Markup {
        let [west, south, east, north] = scene.extent_m(scene.part);
        html! {
            @for (id, [row, col, end_row, end_col]) in &self.0 {
                @let rect = ModuleRect { south: *row, west: *col, north: *end_row, east: *end_col };
                @let [left, bottom, right, top] = scene.extent_m(rect);
                @let across = |metres: f64| 100.0 * metres / (east - west);
                @let down = |metres: f64| 100.0 * metres / (north - south);
                span.mark id=(id) style=(format!(
                    "left:{:.3}%;top:{:.3}%;width:{:.3}%;height:{:.3}%",
                    across(left - west), down(north - top), across(right - left), down(top - bottom),
                )) {}
            }
        }
    }
}

fn mark_id(place: ReportPlace) -> Option<String> {
    match place {
        ReportPlace::Module([row, col]) => Some(format!("module-{row}-{col}")),
        ReportPlace::Window([row, col]) => Some(format!("window-{row}-{col}")),
        ReportPlace::Area => None,
    }
}
