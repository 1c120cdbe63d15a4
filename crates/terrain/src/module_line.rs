//! Middle lines of ways in a load module: where roads, rails, rivers and breaklines run, whether they are in the ground
//! or not.

use serde::{Deserialize, Serialize};

use crate::{HOLE_CLASS, LineForm, LineKind, LineStorey, ModuleVertex};

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

/// A line in the square of one load module, whose line it crosses at vertices only.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModuleLine {
    /// Class of its way; never [`HOLE_CLASS`].
    pub class: u8,
    /// What else is known of it.
    pub traits: LineTraits,
    /// Two or more; neighbours differ in place.
    pub vertices: Vec<ModuleVertex>,
}

/// What is wrong with the lines of a load module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineFault {
    /// This line has fewer than two vertices, or more than 16 bits number.
    WrongCount(usize),
    /// A vertex of this line lies beyond a side.
    VertexOutside(usize),
    /// Two neighbours on this line stand at one place.
    NoLength(usize),
    /// This line has the class of holes.
    HoleClass(usize),
    /// Lines are not in order, or one is listed twice.
    NotCanonical,
    /// This line is in the ground and not kept, or has a form and is neither in the ground nor a bridge.
    Contradicts(usize),
}

impl std::fmt::Display for LineFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::WrongCount(line) => write!(f, "line {line} has fewer than two vertices, or too many"),
            Self::VertexOutside(line) => write!(f, "a vertex of line {line} lies beyond a side"),
            Self::NoLength(line) => write!(f, "line {line} has two neighbours at one place"),
            Self::HoleClass(line) => write!(f, "line {line} has the class of holes"),
            Self::NotCanonical => f.write_str("lines are out of order, or one is listed twice"),
            Self::Contradicts(line) => write!(f, "line {line} is in the ground and left out"),
        }
    }
}

impl LineTraits {
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
/// The first fault found.
pub(crate) fn check(lines: &[ModuleLine], side: u16) -> Result<(), LineFault> {
    for (number, line) in lines.iter().enumerate() {
        let ModuleLine { class, traits, vertices } = line;
        if !(2..=usize::from(u16::MAX)).contains(&vertices.len()) {
            return Err(LineFault::WrongCount(number));
        }
        if vertices.iter().any(|vertex| side < vertex.x || side < vertex.y) {
            return Err(LineFault::VertexOutside(number));
        }
        if vertices.windows(2).any(|pair| (pair[0].x, pair[0].y) == (pair[1].x, pair[1].y)) {
            return Err(LineFault::NoLength(number));
        }
        if *class == HOLE_CLASS {
            return Err(LineFault::HoleClass(number));
        }
        if !traits.fit() {
            return Err(LineFault::Contradicts(number));
        }
    }
    if lines.is_sorted_by(|a, b| a < b) { Ok(()) } else { Err(LineFault::NotCanonical) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(north: u16) -> ModuleLine {
        let traits = LineTraits {
            kind: LineKind::Travelled,
            form: LineForm::Strip,
            storey: LineStorey::Ground,
            is_kept: true,
            is_in_ground: true,
            width: 896,
        };
        let vertices = vec![ModuleVertex { y: north, x: 0, z: 5 }, ModuleVertex { y: north, x: 64_000, z: -5 }];
        ModuleLine { class: 3, traits, vertices }
    }

    #[track_caller]
    fn check_fault(damage: impl FnOnce(&mut Vec<ModuleLine>), expected: Result<(), LineFault>) {
        let mut lines = vec![line(0), line(10)];
        damage(&mut lines);
        assert_eq!(check(&lines, 64_000), expected);
    }

    #[test]
    fn faults_of_lines_are_told_apart() {
        check_fault(|_| {}, Ok(()));
        check_fault(|lines| lines[1].vertices.truncate(1), Err(LineFault::WrongCount(1)));
        check_fault(|lines| lines[0].vertices[1].x = 64_001, Err(LineFault::VertexOutside(0)));
        check_fault(|lines| lines[0].vertices[1].x = 0, Err(LineFault::NoLength(0)));
        check_fault(|lines| lines[1].class = HOLE_CLASS, Err(LineFault::HoleClass(1)));
        check_fault(|lines| lines[0].traits.is_kept = false, Err(LineFault::Contradicts(0)));
        check_fault(|lines| lines[0].traits.is_in_ground = false, Err(LineFault::Contradicts(0)));
        check_fault(|lines| lines.swap(0, 1), Err(LineFault::NotCanonical));
    }
}
