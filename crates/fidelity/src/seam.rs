//! Seams: are the lines between load modules seen in the ground?
//!
//! A line that terrain does not explain shows as a crease. So the angle between the two triangles on an edge along such
//! a line is held against that on other edges of like length; long edges lie in gentle ground and bend less.

use serde::Serialize;
use terrain::{Metres, QUANTA_PER_METRE};

use crate::Triangles;
use crate::edges::{Edges, SharedEdge};
use crate::nearest::{Point, cross, dot, less};

/// Classes of length in an octave.
const CLASSES_PER_OCTAVE: f64 = 4.0;
/// Classes of length: from 2^-8 to 2^24 posts.
const CLASSES: usize = 128;
const CLASS_OF_ONE_POST: f64 = 32.0;

/// How much the ground bends along the lines between load modules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SeamVisibility {
    /// Edges along lines between load modules that have others of like length.
    pub edges: u64,
    /// Mean angle by which the ground bends there, in degrees.
    pub bend_mean_degrees: f64,
    /// Mean angle at other edges of like length, in degrees.
    pub like_mean_degrees: f64,
}

impl SeamVisibility {
    /// How much more the ground bends along these lines than elsewhere: 1 where they cannot be told; `None` where
    /// there is nothing to compare.
    pub fn ratio(&self) -> Option<f64> {
        (0 < self.edges && 0.0 < self.like_mean_degrees).then(|| self.bend_mean_degrees / self.like_mean_degrees)
    }
}

/// Measures the bends along the lines between load modules of `module_cells` cells a side.
pub fn seam_visibility(triangles: &Triangles, module_cells: i32, spacing: Metres) -> SeamVisibility {
    seams_with(triangles, module_cells, spacing, &Edges::of(triangles))
}

/// Bends of edges of one class of length.
#[derive(Clone, Copy, Default)]
struct Bends {
    count: u64,
    sum: f64,
}

impl Bends {
    fn add(&mut self, degrees: f64) {
        self.count += 1;
        self.sum += degrees;
    }
}

pub(crate) fn seams_with(triangles: &Triangles, module_cells: i32, spacing: Metres, edges: &Edges) -> SeamVisibility {
    let (mut on_lines, mut others) = ([Bends::default(); CLASSES], [Bends::default(); CLASSES]);
    for edge in &edges.shared {
        let class = length_class(triangles, edge);
        let bend = bend_degrees(triangles, spacing, edge);
        if is_on_line(triangles, module_cells, edge) { on_lines[class].add(bend) } else { others[class].add(bend) }
    }
    let (mut found, mut like) = (Bends::default(), 0.0);
    for (on_line, other) in on_lines.iter().zip(&others).filter(|(_, other)| 0 < other.count) {
        found.count += on_line.count;
        found.sum += on_line.sum;
        like += other.sum / other.count as f64 * on_line.count as f64;
    }
    if found.count == 0 {
        return SeamVisibility::default();
    }
    let edges = found.count as f64;
    SeamVisibility { edges: found.count, bend_mean_degrees: found.sum / edges, like_mean_degrees: like / edges }
}

fn is_on_line(triangles: &Triangles, module_cells: i32, edge: &SharedEdge) -> bool {
    let (places, units) = triangles.places();
    let side = i64::from(module_cells) * units;
    let [a, b] = edge.ends.map(|v| places[v as usize]);
    (0..2).any(|axis| a[axis] == b[axis] && a[axis].rem_euclid(side) == 0)
}

fn length_class(triangles: &Triangles, edge: &SharedEdge) -> usize {
    let [a, b] = edge.ends.map(|v| triangles.vertices()[v as usize]);
    let posts = (b[0] - a[0]).hypot(b[1] - a[1]);
    let class = (posts.log2() * CLASSES_PER_OCTAVE + CLASS_OF_ONE_POST).floor();
    class.clamp(0.0, (CLASSES - 1) as f64) as usize
}

/// Angle between the two triangles: 0 where they lie in one plane.
fn bend_degrees(triangles: &Triangles, spacing: Metres, edge: &SharedEdge) -> f64 {
    let metres = |[x, y, z]: Point| [x * spacing.0, y * spacing.0, z / f64::from(QUANTA_PER_METRE)];
    let [a, b] = edge.triangles.map(|triangle| {
        let [a, b, c] = triangles.corners_of(triangle).map(metres);
        cross(less(b, a), less(c, a))
    });
    let across = cross(a, b);
    dot(across, across).sqrt().atan2(dot(a, b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use terrain::{Dem, Post, PostRect};

    use super::*;
    use crate::scene::full_tin;

    const SPACING: Metres = Metres(10.0);

    fn seams(height: impl Fn(Post) -> i32) -> SeamVisibility {
        let dem = Dem::from_fn(PostRect::of_size(41, 41), |post| Some(height(post)));
        seam_visibility(&Triangles::of_tin(&full_tin(&dem)), 20, SPACING)
    }

    #[test]
    fn on_a_plane_nothing_bends() {
        let plane = seams(|post| 300 * post.col - 70 * post.row);
        // Two inner lines and four border lines, of which border edges have one side only.
        assert_eq!(plane.edges, 2 * 40);
        assert!(plane.bend_mean_degrees < 1e-9 && plane.ratio().is_none_or(f64::is_finite), "{plane:?}");
        assert_eq!(SeamVisibility::default().ratio(), None);
    }

    #[test]
    fn a_crease_along_a_line_between_load_modules_is_seen_and_one_beside_it_is_not() {
        // A roof of 45 degrees either side of a column: a bend of a right angle there, none elsewhere.
        let roof = |ridge: i32| seams(move |post| -1280 * (post.col - ridge).abs());
        let seen = roof(20);
        assert!((seen.bend_mean_degrees - 45.0).abs() < 1e-9, "half of the edges: {seen:?}");
        assert!(seen.like_mean_degrees < 1e-9);
        let aside = roof(23);
        assert!(aside.bend_mean_degrees < 1e-9 && 0.5 < aside.like_mean_degrees, "{aside:?}");
        assert!(aside.ratio().unwrap() < 1e-9);
    }

    #[test]
    fn on_ground_that_bends_everywhere_alike_lines_cannot_be_told() {
        let waves = seams(|post| 2 * (post.col * post.col + post.row * post.row));
        assert!((waves.ratio().unwrap() - 1.0).abs() < 0.02, "{waves:?}");
    }
}
