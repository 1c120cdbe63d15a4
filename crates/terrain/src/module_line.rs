//! Middle lines of ways in a load module: where roads, rails, rivers and breaklines run, whether they are in the ground
//! or not.

use serde::{Deserialize, Serialize};

use crate::{HOLE_CLASS, LineForm, LineKind, LineStorey, ModuleLine, ModuleVertex};

/// Writes what a line is as its number in files, and reads it.
macro_rules! by_number {
    ($module:ident, $of:ident) => {
        mod $module {
            use serde::de::{Deserialize, Deserializer, Error};

            use super::$of;

            pub fn serialize<S: serde::Serializer>(value: &$of, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_u8(*value as u8)
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<$of, D::Error> {
                let number = u8::deserialize(deserializer)?;
                let unknown = || format!("found {} {number}, expected below {}", stringify!($of), $of::ALL.len());
                $of::ALL.get(usize::from(number)).copied().ok_or_else(|| D::Error::custom(unknown()))
            }
        }
    };
}
by_number!(kind, LineKind);
by_number!(form, LineForm);
by_number!(storey, LineStorey);

/// All of a line but its class and its vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct LineTraits {
    /// What kind of way.
    #[serde(with = "kind")]
    pub kind: LineKind,
    /// What it is in the ground.
    #[serde(with = "form")]
    pub form: LineForm,
    /// Where it runs.
    #[serde(with = "storey")]
    pub storey: LineStorey,
    /// Whether the budget keeps its way: what is not kept is left out of the ground.
    pub is_kept: bool,
    /// Whether the triangles of the ground have its edges.
    pub is_in_ground: bool,
    /// Width of its way in quanta.
    pub width: u16,
}

impl LineTraits {
    /// Those of a line of a load module.
    pub fn of(line: &ModuleLine) -> Self {
        let ModuleLine { class: _, kind, form, storey, is_kept, is_in_ground, width, vertices: _ } = *line;
        Self { kind, form, storey, is_kept, is_in_ground, width }
    }

    /// The line of a load module that has them, its class, and its vertices.
    pub fn line(self, class: u8, vertices: Vec<ModuleVertex>) -> ModuleLine {
        let Self { kind, form, storey, is_kept, is_in_ground, width } = self;
        ModuleLine { class, kind, form, storey, is_kept, is_in_ground, width, vertices }
    }

    /// Whether its fields fit together: what is in the ground is kept and on the ground, and what is there has a form.
    pub fn fit(&self) -> bool {
        let Self { form, storey, is_kept, is_in_ground, .. } = *self;
        let is_there = is_in_ground || (is_kept && storey == LineStorey::Bridge);
        (form == LineForm::Nothing || is_there) && (!is_in_ground || (is_kept && storey == LineStorey::Ground))
    }
}

/// Walks every invariant of the lines of a load module whose square has sides of `side` quanta.
///
/// # Errors
/// The first fault found, in words.
pub(crate) fn check(lines: &[ModuleLine], side: u16) -> Result<(), String> {
    for (number, line) in lines.iter().enumerate() {
        let ModuleLine { class, vertices, .. } = line;
        if !(2..=usize::from(u16::MAX)).contains(&vertices.len()) {
            return Err(format!("line {number} has fewer than two vertices, or too many"));
        }
        if vertices.iter().any(|vertex| side < vertex.x || side < vertex.y) {
            return Err(format!("a vertex of line {number} lies beyond a side"));
        }
        if vertices.windows(2).any(|pair| (pair[0].x, pair[0].y) == (pair[1].x, pair[1].y)) {
            return Err(format!("line {number} has two neighbours at one place"));
        }
        if *class == HOLE_CLASS {
            return Err(format!("line {number} has the class of holes"));
        }
        if !LineTraits::of(line).fit() {
            return Err(format!("line {number} is in the ground and left out"));
        }
    }
    let is_sorted = lines.is_sorted_by(|a, b| a < b);
    if is_sorted { Ok(()) } else { Err("lines are out of order, or one is listed twice".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(north: u16) -> ModuleLine {
        ModuleLine {
            class: 3,
            kind: LineKind::Travelled,
            form: LineForm::Strip,
            storey: LineStorey::Ground,
            is_kept: true,
            is_in_ground: true,
            width: 896,
            vertices: vec![ModuleVertex { y: north, x: 0, z: 5 }, ModuleVertex { y: north, x: 64_000, z: -5 }],
        }
    }

    #[track_caller]
    fn check_fault(damage: impl FnOnce(&mut Vec<ModuleLine>), expected: &str) {
        let mut lines = vec![line(0), line(10)];
        damage(&mut lines);
        assert_eq!(check(&lines, 64_000).err().unwrap_or_default(), expected);
    }

    #[test]
    fn faults_of_lines_are_told_apart() {
        check_fault(|_| {}, "");
        check_fault(|lines| lines[1].vertices.truncate(1), "line 1 has fewer than two vertices, or too many");
        check_fault(|lines| lines[0].vertices[1].x = 64_001, "a vertex of line 0 lies beyond a side");
        check_fault(|lines| lines[0].vertices[1].x = 0, "line 0 has two neighbours at one place");
        check_fault(|lines| lines[1].class = HOLE_CLASS, "line 1 has the class of holes");
        check_fault(|lines| lines[0].is_kept = false, "line 0 is in the ground and left out");
        check_fault(|lines| lines[0].is_in_ground = false, "line 0 is in the ground and left out");
        check_fault(|lines| lines.swap(0, 1), "lines are out of order, or one is listed twice");
    }
}
