//! Lines and polygons with enough vertices: what is none is told.

use super::model::Done;
use super::placing::{LEFT_OUT, Placing};
use super::raw::Part;

impl Placing {
    /// A part that has enough vertices, its rings closed.
    pub(super) fn sound(&mut self, id: &str, part: Part) -> Option<Part> {
        let first = part.runs().flatten().next().copied();
        let at = |placing: &Self| first.and_then(|vertex| placing.at(&vertex));
        match part {
            Part::Point(_) => Some(part),
            Part::Line(line) if line.len() < 2 => {
                let at = at(self);
                self.remark(id, at, format!("a line of {}", counted(line.len())), LEFT_OUT);
                None
            }
            Part::Line(line) => Some(Part::Line(line)),
            Part::Polygon(rings) => {
                let mut sound = Vec::with_capacity(rings.len());
                for (index, mut ring) in rings.into_iter().enumerate() {
                    if let (Some(&first), Some(last)) = (ring.first(), ring.last())
                        && first[..2] != last[..2]
                    {
                        let at = at(self);
                        self.remark(id, at, "a ring whose last vertex is not its first".into(), Done::Kept("closed"));
                        ring.push(first);
                    }
                    if ring.len() < 4 {
                        let found = format!("a ring of {}, the last being the first", counted(ring.len()));
                        let done = if index == 0 { LEFT_OUT } else { Done::LeftOut("the hole left out") };
                        let at = at(self);
                        self.remark(id, at, found, done);
                        // Without its outer ring there is nothing to have holes.
                        if index == 0 {
                            return None;
                        }
                    } else {
                        sound.push(ring);
                    }
                }
                Some(Part::Polygon(sound))
            }
        }
    }
}

fn counted(vertices: usize) -> String {
    format!("{vertices} {}", if vertices == 1 { "vertex" } else { "vertices" })
}
