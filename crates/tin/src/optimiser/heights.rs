//! All heights at once: the squares are a quadratic form in them, and conjugate gradients bring it down; what is loose
//! is bound, and all are rounded.

use terrain::geometry::BEYOND_LEAST;

use crate::optimiser::parts::{NONE, Vertex};
use crate::optimiser::refit::DAMPING;
use crate::optimiser::tile_mesh::TileMesh;

/// Brings all heights that are free nearer to where the squares are least, in so many steps.
pub(crate) fn fit_heights(sheet: &mut TileMesh, steps: usize) {
    let live: Vec<u32> = (0..sheet.triangles.len() as u32).filter(|&triangle| sheet.is_live(triangle)).collect();
    let (mut residual, stiffness) = pulls(sheet, &live);
    let is_free: Vec<bool> =
        sheet.vertices.iter().zip(&residual).map(|(vertex, &pull)| is_free(sheet, vertex, pull)).collect();
    clear_held(&mut residual, &is_free);
    let scaled = |residual: &[f64]| residual.iter().zip(&stiffness).map(|(r, s)| r / s).collect::<Vec<f64>>();
    let mut direction = scaled(&residual);
    let mut rise = vec![0.0; residual.len()];
    let mut worth = dot(&residual, &direction);
    for _ in 0..steps {
        let mut bent = bend(sheet, &live, &direction);
        clear_held(&mut bent, &is_free);
        let curvature = dot(&direction, &bent);
        if curvature <= 0.0 || worth <= 0.0 {
            break;
        }
        let length = worth / curvature;
        for i in 0..rise.len() {
            rise[i] += length * direction[i];
            residual[i] -= length * bent[i];
        }
        let next = scaled(&residual);
        let before = std::mem::replace(&mut worth, dot(&residual, &next));
        let kept = worth / before;
        direction.iter_mut().zip(next).for_each(|(direction, next)| *direction = next + kept * *direction);
    }
    for ((vertex, rise), _) in sheet.vertices.iter_mut().zip(rise).zip(is_free).filter(|(_, is_free)| *is_free) {
        vertex.height = sheet.ground.bounded(vertex.at, vertex.height + rise);
    }
    live.into_iter().for_each(|triangle| sheet.settle(triangle));
}

/// Rounds all heights to whole quanta, which is how they are kept; beside features loose ones are bound first.
pub(crate) fn round_heights(sheet: &mut TileMesh) {
    if sheet.has_features {
        bind_loose_heights(sheet);
    }
    let level = sheet.ground.level();
    for vertex in &mut sheet.vertices {
        vertex.height = (vertex.height + level).round() - level;
    }
    for triangle in 0..sheet.triangles.len() as u32 {
        if sheet.is_live(triangle) {
            sheet.settle(triangle);
        }
    }
}

/// Brings back the heights of vertices of which posts tell less than one does where it stands: to those of their
/// neighbours and of the ground there, and a metre or a tenth of that range beyond. Among triangles smaller than posts
/// are apart, beside features, a post near the foot of a triangle raised its top many times as far as it lay off
/// itself.
fn bind_loose_heights(sheet: &mut TileMesh) {
    /// Squares of the shares that posts have in a height, below which it is loose.
    const LOOSE: f64 = 1.0;
    let live: Vec<u32> = (0..sheet.triangles.len() as u32).filter(|&triangle| sheet.is_live(triangle)).collect();
    let mut told = vec![0.0; sheet.vertices.len()];
    let mut ends = vec![[f64::INFINITY, f64::NEG_INFINITY]; sheet.vertices.len()];
    for &triangle in &live {
        let corners = sheet.triangles[triangle as usize].corners.map(|corner| corner as usize);
        let heights = sheet.heights(sheet.triangles[triangle as usize].corners);
        for k in 0..3 {
            told[corners[k]] += sheet.forms[triangle as usize].aa[k];
            for other in [heights[(k + 1) % 3], heights[(k + 2) % 3]] {
                let [low, high] = ends[corners[k]];
                ends[corners[k]] = [low.min(other), high.max(other)];
            }
        }
    }
    let ground = sheet.ground;
    for ((vertex, told), [low, high]) in sheet.vertices.iter_mut().zip(told).zip(ends) {
        let is_loose = told < LOOSE * ground.weight_in_squares(vertex.at);
        if vertex.edge == NONE || !is_loose || !vertex.hold.height_is_free() {
            continue;
        }
        let here = ground.height(vertex.at);
        let [low, high] = [low.min(here), high.max(here)];
        let beyond = ((high - low) / 10.0).max(f64::from(BEYOND_LEAST));
        vertex.height = ground.bounded(vertex.at, vertex.height.clamp(low - beyond, high + beyond));
    }
    live.into_iter().for_each(|triangle| sheet.settle(triangle));
}

/// Whether a height may follow its pull.
pub(crate) fn is_free(sheet: &TileMesh, vertex: &Vertex, pull: f64) -> bool {
    let further = vertex.height + pull.signum();
    vertex.edge != NONE && vertex.hold.height_is_free() && sheet.ground.bounded(vertex.at, further) == further
}

fn clear_held(values: &mut [f64], is_free: &[bool]) {
    values.iter_mut().zip(is_free).filter(|(_, is_free)| !**is_free).for_each(|(value, _)| *value = 0.0);
}

/// Half the slope of the squares towards lower heights, and the diagonal of the form, for each vertex.
fn pulls(sheet: &TileMesh, live: &[u32]) -> (Vec<f64>, Vec<f64>) {
    let (mut pull, mut stiffness) = (vec![0.0; sheet.vertices.len()], vec![DAMPING; sheet.vertices.len()]);
    for &triangle in live {
        let corners = sheet.triangles[triangle as usize].corners;
        let (form, heights) = (&sheet.forms[triangle as usize], sheet.heights(corners));
        for (k, corner) in corners.into_iter().enumerate() {
            pull[corner as usize] += form.pull(k, heights);
            stiffness[corner as usize] += form.aa[k];
        }
    }
    (pull, stiffness)
}

/// The form applied to a change of heights.
fn bend(sheet: &TileMesh, live: &[u32], change: &[f64]) -> Vec<f64> {
    let mut bent: Vec<f64> = change.iter().map(|change| DAMPING * change).collect();
    for &triangle in live {
        let corners = sheet.triangles[triangle as usize].corners.map(|corner| corner as usize);
        let form = &sheet.forms[triangle as usize];
        for k in 0..3 {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            bent[corners[k]] +=
                form.aa[k] * change[corners[k]] + form.ab[m] * change[corners[l]] + form.ab[l] * change[corners[m]];
        }
    }
    bent
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimiser::hold::Hold;
    use crate::optimiser::parts::{Layout, Parts};
    use crate::optimiser::place::Place;
    use crate::optimiser::weighted_heights::WeightedHeights;
    use terrain::{Dem, HeightFit, Importance, LatticePoint, PostRect, SeamSides, Tin, Vertex};

    #[test]
    fn a_height_of_which_posts_tell_nothing_is_bound_to_those_around_it() {
        let rect = PostRect::of_size(9, 9);
        // A cliff that lets heights range widely, far from a vertex whose triangles lie between posts.
        let dem = Dem::from_fn(rect, |post| Some(if post.col < 3 { 9000 } else { 0 }));
        let importance = Importance::uniform(rect, 1000);
        let places = [(0, 0), (0, 64), (64, 64), (64, 0), (34, 34), (34, 38), (38, 36), (35, 36)];
        let vertex = |(row, col): (i32, i32)| {
            let height = if col < 24 { 9000 } else { 0 };
            Vertex { at: LatticePoint::new(row, col), height }
        };
        let [sw, se, ne, nw, a, b, c, middle] = [0, 1, 2, 3, 4, 5, 6, 7];
        let triangles = vec![
            [sw, se, a],
            [se, b, a],
            [se, ne, b],
            [ne, c, b],
            [ne, nw, c],
            [nw, a, c],
            [nw, sw, a],
            [a, b, middle],
            [b, c, middle],
            [c, a, middle],
        ];
        let start = Tin::new(rect, places.map(vertex).to_vec(), triangles);
        let ground = WeightedHeights::new(&dem, (&importance, &importance), SeamSides::OPEN, HeightFit::Squares);
        let layout = Layout { line_step: None, hold: &|_: Place| Hold::FREE };
        let mut sheet = TileMesh::new(&ground, Parts::of(&ground, &start, &layout), None, true);
        let number = |row: i32, col: i32| {
            let at = Place::of(LatticePoint::new(row, col), rect, terrain::LATTICE_PER_POST);
            sheet.vertices.iter().position(|vertex| vertex.at == at).unwrap()
        };
        let (loose, told) = (number(35, 36), number(34, 34));
        let level = ground.level();
        for vertex in [loose, told] {
            sheet.vertices[vertex].height = 5000.0 - level;
        }
        bind_loose_heights(&mut sheet);
        assert_eq!(sheet.vertices[told].height + level, 5000.0);
        // Its neighbours' heights now range up to 5000, and a tenth beyond.
        sheet.vertices[told].height = -level;
        bind_loose_heights(&mut sheet);
        assert_eq!(sheet.vertices[loose].height + level, f64::from(BEYOND_LEAST));
    }
}
