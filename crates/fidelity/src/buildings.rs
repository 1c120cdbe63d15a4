//! Roads that run through buildings.

use terrain::{Corner, LineKind, LineStorey, LoadModule, ModuleLine, ObjectKind, Prism};

use crate::decks::places_along;

/// How far above a road a building may begin and still stand in its way, in quanta: 2 m.
const HEADROOM: i32 = 256;

/// Metres of roads in the ground that lie inside buildings of a load module: their source leads them there and says of
/// no passage, or one of the two lies beside its place.
pub fn metres_in_buildings(module: &LoadModule) -> u64 {
    let buildings: Vec<(&Prism, [[u16; 2]; 2])> =
        module.objects.prisms.iter().filter(|prism| prism.kind == ObjectKind::Building).map(with_bounds).collect();
    let is_road =
        |line: &&ModuleLine| line.kind == LineKind::Travelled && line.storey == LineStorey::Ground && line.is_kept;
    let is_inside = |&[x, y, z]: &[f64; 3]| {
        buildings.iter().any(|(prism, [low, high])| {
            let bounds = [x, y].into_iter().enumerate();
            let near = bounds
                .fold(true, |near, (axis, at)| near && (f64::from(low[axis])..=f64::from(high[axis])).contains(&at));
            near && f64::from(prism.base) <= z + f64::from(HEADROOM) && holds(prism, [x, y])
        })
    };
    let places = module.lines.iter().filter(is_road).flat_map(places_along);
    if buildings.is_empty() { 0 } else { places.filter(is_inside).count() as u64 }
}

fn with_bounds(prism: &Prism) -> (&Prism, [[u16; 2]; 2]) {
    let corners = prism.rings.iter().flatten().map(|corner| [corner.x, corner.y]);
    let bounds = corners.fold([[u16::MAX; 2], [0; 2]], |[low, high], at| {
        let of = |pick: fn(u16, u16) -> u16, one: [u16; 2]| [pick(one[0], at[0]), pick(one[1], at[1])];
        [of(u16::min, low), of(u16::max, high)]
    });
    (prism, bounds)
}

/// Whether a place lies in the plan of a building, outside its courtyards.
fn holds(prism: &Prism, [x, y]: [f64; 2]) -> bool {
    let crosses = |(a, b): (&Corner, &Corner)| {
        let [[ax, ay], [bx, by]] = [a, b].map(|corner| [f64::from(corner.x), f64::from(corner.y)]);
        (ay <= y) != (by <= y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
    };
    let sides = prism.rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
    sides.filter(|side| crosses(*side)).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use terrain::{LineForm, LineTraits, ModuleId, ModuleVertex, Objects};

    use super::*;

    #[test]
    fn metres_of_roads_inside_buildings_are_counted_and_those_below_what_hangs_are_not() {
        let corner = |(x, y): (u16, u16)| Corner { x, y, has_wall: true };
        let square = |low: u16, high: u16| [(low, low), (high, low), (high, high), (low, high)].map(corner).to_vec();
        let metres = |base: i32, storey: LineStorey| {
            let rings = vec![square(1280, 5120), square(2560, 3840).into_iter().rev().collect()];
            let prism = Prism { id: 1, kind: ObjectKind::Building, base, roof: base + 1280, rings };
            let vertex = |x, y| ModuleVertex { x, y, z: 0 };
            let traits = LineTraits {
                kind: LineKind::Travelled,
                form: LineForm::Line,
                storey,
                is_kept: true,
                is_in_ground: true,
                width: 512,
            };
            let vertices = vec![vertex(0, 3200), vertex(6400, 3200)];
            metres_in_buildings(&LoadModule {
                id: ModuleId { row: 0, col: 0 },
                side: 12_800,
                lines: vec![traits.line(0, vertices)],
                objects: Objects { prisms: vec![prism], ..Objects::default() },
                ..LoadModule::default()
            })
        };
        // 30 m across, less a courtyard of 10 m.
        assert_eq!(metres(-256, LineStorey::Ground), 20);
        assert_eq!(metres(512, LineStorey::Ground), 0);
        assert_eq!(metres(-256, LineStorey::Tunnel), 0);
    }
}
