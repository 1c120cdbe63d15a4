//! Classes of triangles as exports name and colour them.

use store::Report;
use terrain::{MaterialName, named_class_color};

/// Base colours, as screens show them, of classes whose names say nothing of their colour, in order and over again:
/// told apart by the colour-blind, too.
const COLOURS: [[f64; 3]; 8] = [
    [0.55, 0.50, 0.36],
    [0.34, 0.42, 0.30],
    [0.10, 0.27, 0.45],
    [0.62, 0.36, 0.12],
    [0.46, 0.46, 0.46],
    [0.17, 0.48, 0.43],
    [0.60, 0.56, 0.20],
    [0.42, 0.24, 0.38],
];

/// The classes of a job, in its order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Classes<'a> {
    names: &'a [String],
    /// Other names for materials.
    materials: &'a [MaterialName],
}

impl<'a> Classes<'a> {
    /// Classes with these names, and with other names for some materials.
    pub(crate) fn new(names: &'a [String], materials: &'a [MaterialName]) -> Self {
        Self { names, materials }
    }

    /// What else a material is called, by its own name.
    pub(crate) fn named(self, of: &str) -> Option<&'a MaterialName> {
        self.materials.iter().find(|named| named.of == of)
    }

    /// The name that the job gives a class; empty where it gives none.
    pub(crate) fn own_name(self, class: u8) -> &'a str {
        self.names.get(usize::from(class)).map_or("", String::as_str)
    }

    /// The name of a class, where a job has several: a single one needs none.
    pub(crate) fn name(self, class: u8) -> Option<&'a str> {
        self.names.get(usize::from(class)).filter(|_| 1 < self.names.len()).map(String::as_str)
    }

    /// The same as one word, which ends no line of a text and no word in it; `class_3` without a name.
    pub(crate) fn word(self, class: u8) -> String {
        self.name(class).map_or_else(|| format!("class_{class}"), as_word)
    }

    /// Red, green and blue from 0 to 255, as screens show them.
    pub(crate) fn color(self, class: u8) -> [u8; 3] {
        color(self.own_name(class), class)
    }

    /// Red, green and blue from 0 to 1, as light adds up.
    pub(crate) fn light(self, class: u8) -> [f64; 3] {
        self.color(class).map(linear)
    }
}

/// A name as one word.
pub(crate) fn as_word(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}

/// The colour of a class by its name and number, as screens show it.
pub(crate) fn color(name: &str, class: u8) -> [u8; 3] {
    let numbered = COLOURS[usize::from(class) % COLOURS.len()].map(|part| (part * 255.0).round() as u8);
    named_class_color(name).unwrap_or(numbered)
}

/// A part of a colour as screens show it, as light: the curve of sRGB, to a thousandth.
pub(crate) fn linear(part: u8) -> f64 {
    let part = f64::from(part) / 255.0;
    let light = if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) };
    (light * 1000.0).round() / 1000.0
}

/// The names that a report gives to the classes of its job, without that of holes, which is no class of a job.
pub(crate) fn names_in(report: &Report) -> Vec<String> {
    report.classes.iter().map(|class| class.name.clone()).filter(|name| name != HOLE_NAME).collect()
}

/// The classes of a report that are water: those with rivers, streams or lakes, and those that are named so.
pub(crate) fn water_in(report: &Report) -> Vec<u8> {
    let of_features = report.features.iter().flat_map(|features| &features.classes);
    let has_water = |name: &str| {
        let mut of = of_features.clone().filter(|class| class.name == name);
        of.any(|class| 0 < class.lakes || 0.0 < class.channel_km)
    };
    let is_water = |name: &str| ["water", "lake", "river", "stream"].contains(&name) || has_water(name);
    (0..).zip(names_in(report)).filter(|(_, name)| is_water(name)).map(|(number, _)| number).collect()
}

/// What triangles over holes are called.
pub(crate) const HOLE_NAME: &str = "hole";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_has_the_colour_of_its_name_or_else_of_its_number() {
        let names = ["default", "a b\nc", "motorway", "lake"].map(str::to_owned);
        let classes = Classes::new(&names, &[]);
        assert_eq!(classes.color(2), named_class_color("motorway").unwrap());
        assert_eq!((classes.color(0), classes.color(9)), ([140, 128, 92], [87, 107, 77]));
        assert_eq!([classes.light(0), classes.light(3)], [[0.262, 0.216, 0.107], [0.117, 0.323, 0.552]]);
        assert_eq!([1, 3, 9].map(|class| classes.word(class)), ["a_b_c", "lake", "class_9"]);
    }

    #[test]
    fn a_single_class_needs_no_name() {
        let names = ["default".to_owned()];
        assert_eq!(Classes::new(&names, &[]).word(0), "class_0");
    }
}
