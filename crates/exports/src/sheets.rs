//! What an exported mesh consists of, and how the materials of each are called and coloured.

use terrain::{MaterialName, OBJECT_MATERIALS, ObjectKind};

use crate::classes::{Classes, as_word, linear};

/// One of the meshes that an export shows, each with vertices of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sheet {
    /// The ground, by class.
    Ground,
    /// Decks of bridges, by class.
    Decks,
    /// Bands over ways that are lines in the ground, by class.
    Ribbons,
    /// What stands on the ground, by material.
    Objects,
}

impl Sheet {
    /// All of them, in the order in which files have them.
    pub(crate) const ALL: [Self; 4] = [Self::Ground, Self::Decks, Self::Ribbons, Self::Objects];

    /// What it is called in files.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Ground => "ground",
            Self::Decks => "decks",
            Self::Ribbons => "ribbons",
            Self::Objects => "objects",
        }
    }

    /// Whether it is seen from below too: it has no thickness.
    pub(crate) const fn is_seen_from_below(self) -> bool {
        matches!(self, Self::Decks | Self::Objects)
    }
}

/// Colours of the materials of objects, by number.
const OBJECT_COLORS: [[u8; 3]; OBJECT_MATERIALS.len()] = [
    [150, 92, 74],
    [214, 204, 186],
    [128, 128, 132],
    [168, 168, 170],
    [150, 144, 132],
    [164, 156, 142],
    [62, 92, 52],
    [54, 80, 46],
    [104, 118, 66],
    [94, 106, 60],
    [120, 140, 80],
    [108, 126, 72],
    [72, 104, 56],
    [64, 92, 50],
];

/// The number of an object's material.
pub(crate) const fn object_material(kind: ObjectKind, is_side: bool) -> u8 {
    2 * kind as u8 + is_side as u8
}

/// The material of triangles: the class of a sheet of ground, or the number of one of objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Material {
    pub sheet: Sheet,
    pub class: u8,
}

impl Material {
    /// Its name as one word.
    pub(crate) fn word(self, classes: Classes) -> String {
        let named = classes.named(self.of(classes)).map(|named| as_word(&named.name));
        named.unwrap_or_else(|| match self.sheet {
            Sheet::Objects => OBJECT_MATERIALS[usize::from(self.class)].to_owned(),
            Sheet::Ground | Sheet::Decks | Sheet::Ribbons => classes.word(self.class),
        })
    }

    /// What a job calls it: the name of the class, or of the material of objects.
    fn of<'a>(self, classes: Classes<'a>) -> &'a str {
        match self.sheet {
            Sheet::Objects => OBJECT_MATERIALS[usize::from(self.class)],
            Sheet::Ground | Sheet::Decks | Sheet::Ribbons => classes.own_name(self.class),
        }
    }

    /// Its surface material code and its feature identification: the job's, else [`Material::number`] and 0.
    pub(crate) fn codes(self, classes: Classes) -> [i16; 2] {
        let named = classes.named(self.of(classes));
        let code = |of: fn(&MaterialName) -> Option<u16>| named.and_then(of).and_then(|code| i16::try_from(code).ok());
        [code(|named| named.surface_code).unwrap_or(self.number()), code(|named| named.feature_id).unwrap_or(0)]
    }

    /// Red, green and blue from 0 to 255, as screens show them.
    pub(crate) fn color(self, classes: Classes) -> [u8; 3] {
        match self.sheet {
            Sheet::Objects => OBJECT_COLORS[usize::from(self.class)],
            Sheet::Ground | Sheet::Decks | Sheet::Ribbons => classes.color(self.class),
        }
    }

    /// Red, green and blue from 0 to 1, as light adds up.
    pub(crate) fn light(self, classes: Classes) -> [f64; 3] {
        match self.sheet {
            Sheet::Objects => self.color(classes).map(linear),
            Sheet::Ground | Sheet::Decks | Sheet::Ribbons => classes.light(self.class),
        }
    }

    /// The same material where that of the ground serves all that has a class.
    pub(crate) fn in_library(self) -> Self {
        let sheet = if self.sheet == Sheet::Objects { Sheet::Objects } else { Sheet::Ground };
        Self { sheet, ..self }
    }

    /// The same where what is seen from both sides has a material of its own.
    pub(crate) fn by_sides(self) -> Self {
        if self.sheet.is_seen_from_below() { self } else { self.in_library() }
    }

    /// A number that no other material of a file has: that of the class, and from 256 on those of objects.
    pub(crate) fn number(self) -> i16 {
        i16::from(self.class) + if self.sheet == Sheet::Objects { 256 } else { 0 }
    }
}
