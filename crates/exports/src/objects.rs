//! Surfaces of what stands on the ground: roofs and walls of prisms, tops and sides of canopies.

use serde_json::{Value, json};
use terrain::plans::{Plan, triangles, union};
use terrain::{Canopy, Draped, ModuleId, ObjectKind, Prism, metres_of_quanta};

use crate::Product;
use crate::sheets::object_material;

/// An object, or the piece of one in a load module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Thing {
    /// Of all pieces of the object.
    pub id: u64,
    pub kind: ObjectKind,
    /// From its base, or from the ground, to its top, in quanta.
    pub height: i32,
}

impl Thing {
    /// A name that no other object has, and all pieces of this one.
    pub(crate) fn name(&self) -> String {
        format!("{}_{}", self.kind.name(), self.id)
    }

    /// What a reader is told of it.
    pub(crate) fn told(&self) -> Value {
        // As text: a script's numbers have 53 bits.
        json!({ "id": self.id.to_string(), "class": self.kind.name(), "height_m": metres_of_quanta(self.height) })
    }
}

/// Convex polygons of one facet, whose vertices are its own, counter-clockwise from outside.
pub(crate) struct Facet {
    pub material: u8,
    pub polygons: Vec<Vec<[i32; 3]>>,
}

/// What stands in a load module, as facets at their places from the south-west corner of what is exported.
pub(crate) fn things_in(product: &Product, id: ModuleId) -> Vec<(Thing, Vec<Facet>)> {
    let Some(module) = product.module(id).filter(|module| !module.objects.is_empty()) else { return Vec::new() };
    let corner = product.corner(id);
    let ground = Draped::of(module, corner);
    let prisms = module.objects.prisms.iter().map(|prism| {
        let &Prism { id, kind, base, roof, .. } = prism;
        (Thing { id, kind, height: roof - base }, facets_of_prism(prism, corner))
    });
    let canopies = module.objects.canopies.iter().map(|canopy| {
        let &Canopy { id: of, kind, height, .. } = canopy;
        let goes_on = |rows: i64, cols: i64| goes_on(product, id, [rows, cols], of);
        let facets = facets_of_canopy(canopy, corner, module.side, &ground, &goes_on);
        (Thing { id: of, kind, height: height.into() }, facets)
    });
    prisms.chain(canopies).collect()
}

/// Whether a canopy goes on in a load module beside this one.
fn goes_on(product: &Product, id: ModuleId, [rows, cols]: [i64; 2], canopy: u64) -> bool {
    let beside = |of: u32, step: i64| u32::try_from(i64::from(of) + step).ok();
    let (Some(row), Some(col)) = (beside(id.row, rows), beside(id.col, cols)) else { return false };
    let module = product.module(ModuleId { row, col });
    module.is_some_and(|module| module.objects.canopies.iter().any(|of| of.id == canopy))
}

/// A roof, and a wall between each two corners that have one.
fn facets_of_prism(prism: &Prism, corner: [i32; 2]) -> Vec<Facet> {
    let place = |x: u16, y: u16, z: i32| [corner[0] + i32::from(x), corner[1] + i32::from(y), z];
    let (places, triangles) = triangles(&prism.plan());
    let roof = |triangle: &[u32; 3]| {
        triangle.map(|at| places[at as usize]).map(|[x, y]| [corner[0] + x, corner[1] + y, prism.roof]).to_vec()
    };
    let roof = Facet { material: object_material(prism.kind, false), polygons: triangles.iter().map(roof).collect() };
    let pairs = prism.rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
    let wall = |(a, b): (&terrain::Corner, &terrain::Corner)| Facet {
        material: object_material(prism.kind, true),
        polygons: vec![vec![
            place(a.x, a.y, prism.base),
            place(b.x, b.y, prism.base),
            place(b.x, b.y, prism.roof),
            place(a.x, a.y, prism.roof),
        ]],
    };
    std::iter::once(roof).chain(pairs.filter(|(a, _)| a.has_wall).map(wall)).collect()
}

/// The top of a canopy, as high above the ground as it is, and its sides.
fn facets_of_canopy(
    canopy: &Canopy,
    corner: [i32; 2],
    side: u16,
    ground: &Draped,
    goes_on: &dyn Fn(i64, i64) -> bool,
) -> Vec<Facet> {
    let height = i32::from(canopy.height);
    let whole = |[x, y, z]: [f64; 3], up: i32| [x.round() as i32, y.round() as i32, z.round() as i32 + up];
    let flat = |[x, y]: [i32; 2]| [corner[0] + x, corner[1] + y].map(f64::from);
    let lifted = |piece: Vec<[f64; 3]>| piece.into_iter().map(|place| whole(place, height)).collect();
    let top = canopy.triangles.iter().flat_map(|triangle| {
        let places = triangle.map(|at| canopy.places[usize::from(at)].map(i32::from));
        ground.under(&places.map(flat))
    });
    let top = Facet { material: object_material(canopy.kind, false), polygons: top.map(lifted).collect() };
    let mut facets = vec![top];
    let side = i32::from(side);
    for plan in canopy_plans(canopy) {
        for (a, b) in plan.iter().flat_map(|ring| ring.iter().copied().zip(ring.iter().copied().cycle().skip(1))) {
            let on = |axis: usize, line: i32| a[axis] == line && b[axis] == line;
            let is_cut = (on(0, 0) && goes_on(0, -1)) || (on(0, side) && goes_on(0, 1));
            if is_cut || (on(1, 0) && goes_on(-1, 0)) || (on(1, side) && goes_on(1, 0)) {
                continue;
            }
            let foot = ground.along([flat(a), flat(b)]);
            let part = |pair: &[[f64; 3]]| {
                vec![whole(pair[0], 0), whole(pair[1], 0), whole(pair[1], height), whole(pair[0], height)]
            };
            let polygons = foot.windows(2).map(part).collect();
            facets.push(Facet { material: object_material(canopy.kind, true), polygons });
        }
    }
    facets
}

/// What the triangles of a canopy cover, in quanta from the corner of its load module.
pub(crate) fn canopy_plans(canopy: &Canopy) -> Vec<Plan> {
    let triangle = |of: &[u16; 3]| of.map(|at| canopy.places[usize::from(at)].map(i32::from)).to_vec();
    union(&[canopy.triangles.iter().map(triangle).collect()])
}
