//! The normal equations of one vertex: where the squares around it are least, as far as they are a parabola.

use crate::optimiser::hold::Hold;
use crate::optimiser::refit::DAMPING;

/// Relative and absolute damping of steps in the plane.
const PLANE_DAMPING: (f64, f64) = (0.01, 0.02);
/// Normal equations flatter than this have no step.
const LEAST_DETERMINANT: f64 = 1e-4;
/// A step goes no further than this part of the farthest neighbour's distance.
const STEP_MAX: f64 = 0.6;

/// The normal equations of one vertex: a step in the plane, heights eliminated, and the height alone.
#[derive(Default)]
pub(crate) struct Normal {
    pub matrix: [[f64; 3]; 3],
    pub pull: [f64; 3],
    pub stiffness: f64,
    pub height_pull: f64,
    pub squares: f64,
    /// Distance to the farthest neighbour, in posts.
    pub reach: f64,
}

impl Normal {
    #[inline(always)]
    pub fn add(&mut self, toward: [f64; 3], stiffness: f64, pull: f64) {
        for i in 0..3 {
            for j in 0..3 {
                self.matrix[i][j] += stiffness * toward[i] * toward[j];
            }
            self.pull[i] += pull * toward[i];
        }
        self.stiffness += stiffness;
        self.height_pull += pull;
    }

    #[inline(always)]
    pub fn plane(&self) -> Plane {
        let (matrix, pull) = (&self.matrix, &self.pull);
        let per_height = 1.0 / (matrix[2][2] + DAMPING);
        let reduced = |i: usize, j: usize| matrix[i][j] - matrix[i][2] * matrix[2][j] * per_height;
        Plane {
            a: reduced(0, 0) + matrix[0][0] * PLANE_DAMPING.0 + PLANE_DAMPING.1,
            b: reduced(0, 1),
            d: reduced(1, 1) + matrix[1][1] * PLANE_DAMPING.0 + PLANE_DAMPING.1,
            u: pull[0] - matrix[0][2] * pull[2] * per_height,
            w: pull[1] - matrix[1][2] * pull[2] * per_height,
        }
    }

    /// The damped Gauss-Newton step in the plane, in posts; `None` where there is none.
    #[inline(always)]
    pub fn step(&self, plane: &Plane, hold: Hold) -> Option<(f64, f64)> {
        let &Plane { a, b, d, u, w } = plane;
        let (dx, dy) = match (hold.has(Hold::COLUMN), hold.has(Hold::ROW)) {
            (true, true) => return None,
            (true, false) => (0.0, w / d),
            (false, true) => (u / a, 0.0),
            (false, false) => {
                let determinant = a * d - b * b;
                if determinant <= LEAST_DETERMINANT {
                    return None;
                }
                ((d * u - b * w) / determinant, (a * w - b * u) / determinant)
            }
        };
        let (length, most) = (dx.abs().max(dy.abs()), STEP_MAX * self.reach);
        let shorten = if most < length { most / length } else { 1.0 };
        Some((dx * shorten, dy * shorten))
    }
}

/// A step's normal equations in the plane, heights eliminated.
pub(crate) struct Plane {
    pub a: f64,
    pub b: f64,
    pub d: f64,
    pub u: f64,
    pub w: f64,
}

impl Plane {
    /// By how much the squares change with a step, as far as the equations go.
    #[inline(always)]
    pub fn rise(&self, dx: f64, dy: f64) -> f64 {
        dx * (self.a * dx + 2.0 * self.b * dy - 2.0 * self.u) + dy * (self.d * dy - 2.0 * self.w)
    }
}
