//! What stands on the ground, in pictures: solid in views of the area, as plans on maps.

use terrain::plans::triangles;
use terrain::{Canopy, Corner, Draped, LoadModule, ObjectKind, Prism, QUANTA_PER_METRE};

use super::color::{Color, lit};
use super::image::Image;
use super::light::light_of_triangle;
use super::map_extent::MapExtent;
use super::scene::Scene;
use super::sheet::Key;

/// A triangle of a wall, a roof or a crown, in metres from the area's south-west post, and its colour under its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Solid {
    pub(crate) corners: [[f64; 3]; 3],
    pub(crate) color: Color,
}

/// The colour of a kind: of walls, or of leaves.
fn color_of(kind: ObjectKind) -> Color {
    match kind {
        ObjectKind::Building => [186, 168, 150],
        ObjectKind::Tower => [150, 150, 156],
        ObjectKind::Wall => [140, 132, 122],
        ObjectKind::Wood => [62, 96, 58],
        ObjectKind::Scrub => [120, 138, 82],
        ObjectKind::Orchard => [98, 134, 74],
        ObjectKind::Row => [78, 112, 66],
    }
}

/// Roofs of buildings.
const ROOF: Color = [146, 84, 68];

/// What stands on a load module whose south-west corner is `corner_m`.
pub(crate) fn solids(module: &LoadModule, corner_m: [f64; 2]) -> Vec<Solid> {
    let mut all = Vec::new();
    module.objects.prisms.iter().for_each(|prism| add_prism(prism, corner_m, &mut all));
    if !module.objects.canopies.is_empty() {
        let ground = Draped::of(module, [0; 2]);
        module.objects.canopies.iter().for_each(|canopy| add_canopy(canopy, &ground, corner_m, &mut all));
    }
    all
}

fn metres(quanta: i32) -> f64 {
    f64::from(quanta) / f64::from(QUANTA_PER_METRE)
}

fn add_prism(prism: &Prism, corner_m: [f64; 2], all: &mut Vec<Solid>) {
    let [base, roof] = [prism.base, prism.roof].map(metres);
    let at = |x: i32, y: i32, z: f64| [corner_m[0] + metres(x), corner_m[1] + metres(y), z];
    for (a, b) in prism.rings.iter().flat_map(|ring| edges(ring)).filter(|(a, _)| a.has_wall) {
        let [a, b] = [a, b].map(|corner| [i32::from(corner.x), i32::from(corner.y)]);
        add_wall([at(a[0], a[1], base), at(b[0], b[1], base)], [roof; 2], color_of(prism.kind), all);
    }
    let (places, triangles) = triangles(&prism.plan());
    let color = if prism.kind == ObjectKind::Building { ROOF } else { color_of(prism.kind) };
    let place = |index: u32| at(places[index as usize][0], places[index as usize][1], roof);
    all.extend(triangles.iter().map(|triangle| Solid { corners: triangle.map(place), color }));
}

fn edges(ring: &[Corner]) -> impl Iterator<Item = (Corner, Corner)> {
    ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))
}

/// An upright wall over two places, up to the heights `tops`, under light from the north-west.
fn add_wall([a, b]: [[f64; 3]; 2], tops: [f64; 2], color: Color, all: &mut Vec<Solid>) {
    const LIGHT: [f64; 2] = [-std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2];
    let run = [b[0] - a[0], b[1] - a[1]];
    let length = (run[0] * run[0] + run[1] * run[1]).sqrt();
    // Rings run counter-clockwise, so outside lies to the right.
    let towards = (LIGHT[0] * run[1] - LIGHT[1] * run[0]) / length.max(1e-9);
    let color = lit(color, (0.82 + 0.2 * towards) as f32);
    let [top_a, top_b] = [[a[0], a[1], tops[0]], [b[0], b[1], tops[1]]];
    all.push(Solid { corners: [a, b, top_b], color });
    all.push(Solid { corners: [a, top_b, top_a], color });
}

/// The top of a canopy, and its sides where it ends; both follow the ground.
fn add_canopy(canopy: &Canopy, ground: &Draped, corner_m: [f64; 2], all: &mut Vec<Solid>) {
    let height_m = metres(canopy.height.into());
    let at = |[x, y, z]: [f64; 3], up: f64| {
        let [x, y, z] = [x, y, z].map(|quanta| quanta / f64::from(QUANTA_PER_METRE));
        [corner_m[0] + x, corner_m[1] + y, z + up]
    };
    let flat = |index: u16| canopy.places[usize::from(index)].map(f64::from);
    let color = color_of(canopy.kind);
    for piece in canopy.triangles.iter().flat_map(|triangle| ground.under(&triangle.map(flat))) {
        all.extend((2..piece.len()).map(|last| {
            let corners = [piece[0], piece[last - 1], piece[last]].map(|place| at(place, height_m));
            Solid { corners, color: lit(color, light_of_triangle(corners, 1.0)) }
        }));
    }
    let directed = || canopy.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let inner: std::collections::BTreeSet<(u16, u16)> = directed().collect();
    for (a, b) in directed().filter(|(a, b)| !inner.contains(&(*b, *a))) {
        for pair in ground.along([flat(a), flat(b)]).windows(2) {
            let tops = [pair[0], pair[1]].map(|place| at(place, height_m)[2]);
            add_wall([pair[0], pair[1]].map(|place| at(place, 0.0)), tops, lit(color, 0.8), all);
        }
    }
}

/// Draws the plans of what stands on the load modules of a scene, woods below buildings.
pub(crate) fn draw_plans(image: &mut Image, map_extent: &MapExtent, scene: &Scene) {
    for module in scene.modules {
        let corner = [module.id.col, module.id.row].map(|index| f64::from(index) * scene.side_m());
        let at = |[x, y]: [u16; 2]| {
            map_extent.at([corner[0] + metres(x.into()), corner[1] + metres(y.into())]).map(|at| at - 0.5)
        };
        for canopy in &module.objects.canopies {
            for triangle in &canopy.triangles {
                let ring = triangle.map(|index| at(canopy.places[usize::from(index)]));
                image.fill_rings(&[&ring], color_of(canopy.kind));
            }
        }
        for prism in &module.objects.prisms {
            let rings: Vec<Vec<[f64; 2]>> =
                prism.rings.iter().map(|ring| ring.iter().map(|corner| at([corner.x, corner.y])).collect()).collect();
            let color = if prism.kind == ObjectKind::Building { ROOF } else { color_of(prism.kind) };
            image.fill_rings(&rings.iter().map(Vec::as_slice).collect::<Vec<_>>(), color);
        }
    }
}

/// The kinds that stand on load modules.
pub(crate) fn kinds<'a>(modules: impl Iterator<Item = &'a LoadModule> + Clone) -> Vec<ObjectKind> {
    let stands = |kind: &ObjectKind| {
        modules.clone().map(|module| &module.objects).any(|all| {
            all.prisms.iter().any(|prism| prism.kind == *kind) || all.canopies.iter().any(|wood| wood.kind == *kind)
        })
    };
    ObjectKind::ALL.into_iter().filter(stands).collect()
}

/// The colours of kinds.
pub(crate) fn object_keys(kinds: &[ObjectKind]) -> Vec<(Key, String)> {
    let color = |kind: ObjectKind| if kind == ObjectKind::Building { ROOF } else { color_of(kind) };
    kinds.iter().map(|&kind| (Key::Filled(color(kind)), kind.name().to_owned())).collect()
}

#[cfg(test)]
mod tests {
    use terrain::{ModuleVertex, Objects};

    use super::*;
    use crate::samples;

    #[test]
    fn a_wood_follows_the_ground_between_its_corners() {
        let vertex = |x, y, z| ModuleVertex { x, y, z };
        let canopy = Canopy {
            id: 1,
            kind: ObjectKind::Wood,
            height: 1_280,
            fullness: 90,
            spacing: 512,
            places: vec![[0, 0], [64_000, 0], [64_000, 64_000], [0, 64_000]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        // A valley of 50 m between sides of equal height.
        let places = [(0, 0), (32_000, 0), (64_000, 0), (64_000, 64_000), (32_000, 64_000), (0, 64_000)];
        let vertices = places.map(|(x, y)| vertex(x, y, if x == 32_000 { 0 } else { 6_400 })).to_vec();
        let module = LoadModule {
            vertices,
            triangles: vec![[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4]],
            classes: vec![0; 4],
            objects: Objects { canopies: vec![canopy], ..Objects::default() },
            ..samples::modules().remove(0)
        };
        let made = solids(&module, [0.0, 0.0]);
        let at_bottom: Vec<f64> =
            made.iter().flat_map(|solid| solid.corners).filter(|at| at[0] == 250.0).map(|at| at[2]).collect();
        assert!(!at_bottom.is_empty() && at_bottom.iter().all(|z| *z == 0.0 || *z == 10.0), "{at_bottom:?}");
    }
}
