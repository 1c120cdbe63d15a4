//! What a sheet is made of: vertices, triangles between them, and edges of features that stay.

use terrain::{Tin, Vertex as TinVertex};

use crate::optimiser::hold::Hold;
use crate::optimiser::place::Place;
use crate::optimiser::weighted_heights::WeightedHeights;

/// No edge, no vertex, no triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// One vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub at: Place,
    /// In quanta above the ground's level.
    pub height: f64,
    /// An edge that leaves it; [`NONE`] once it is gone.
    pub edge: u32,
    pub hold: Hold,
    /// Whether something near it changed since this was last asked.
    pub has_changed: bool,
    /// What removing it cost, the heights around it fitted, when that was last asked or guessed; NaN where it was not.
    pub cost: f64,
}

/// Which vertices are held, and where lines run.
pub(crate) struct Layout<'a> {
    /// Steps between lines that edges may not cross; `None` where only the tile's border is one.
    pub line_step: Option<i32>,
    /// What else may not change about a vertex, by its place and what it is.
    pub hold: &'a dyn Fn(Place) -> Hold,
}

impl Layout<'_> {
    /// What lies on a line may only move along it.
    pub fn line_hold(&self, ground: &WeightedHeights, at: Place) -> Hold {
        line_hold(ground, self.line_step, at)
    }
}

/// What lies on a line may only move along it.
pub(crate) fn line_hold(ground: &WeightedHeights, line_step: Option<i32>, at: Place) -> Hold {
    let far = ground.far();
    let is_line = |at: i32, far: i32| match line_step {
        Some(step) => at % step == 0,
        None => at == 0 || at == far,
    };
    let column = if is_line(at.x, far.x) { Hold::COLUMN } else { Hold::FREE };
    let row = if is_line(at.y, far.y) { Hold::ROW } else { Hold::FREE };
    column.and(row)
}

/// Vertices and triangles that are not linked yet.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
    /// Edges that stay, by their ends, the lesser first, in ascending order.
    pub kept: Vec<[Place; 2]>,
}

impl Parts {
    /// Those of a TIN without features.
    pub fn of(ground: &WeightedHeights, tin: &Tin, layout: &Layout) -> Self {
        let vertex = |vertex: &TinVertex| {
            let at = Place::of(vertex.at, tin.rect, tin.steps_per_post);
            let hold = layout.line_hold(ground, at).and((layout.hold)(at));
            Vertex {
                at,
                height: f64::from(vertex.height) - ground.level(),
                edge: NONE,
                hold,
                has_changed: true,
                cost: f64::NAN,
            }
        };
        let vertices = tin.vertices.iter().map(vertex).collect();
        Self { vertices, triangles: tin.triangles.clone(), kept: Vec::new() }
    }
}
