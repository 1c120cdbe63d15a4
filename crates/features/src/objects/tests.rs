//! Objects from tags to load modules.

use terrain::ObjectKind;

use super::plan::METRE;
use super::*;

const SIDE: i32 = 64_000;
const OPTIONS: ObjectOptions = ObjectOptions { corners_max: 15, area_min_m2: 20.0 };
/// Of four load modules, which are one window.
fn limits(per_module: u32, per_window: u32) -> ObjectLimits {
    ObjectLimits::even([per_module, per_window], [2, 2], [8, 8])
}

fn object(name: &str, tags: &[(&str, &'static str)], shape: FoundShape) -> FoundObject {
    let tag = |key: &str| tags.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
    let (traits, bad_tags) = traits(tag, (None, None), &[]).unwrap();
    FoundObject { name: name.into(), traits, bad_tags, shape }
}

/// A closed square from a corner on, in metres, clockwise.
fn square([x, y]: [f64; 2], side: f64) -> Vec<[f64; 2]> {
    [[0.0, 0.0], [0.0, side], [side, side], [side, 0.0], [0.0, 0.0]].map(|[dx, dy]| [x + dx, y + dy]).to_vec()
}

fn house(at: [f64; 2], side: f64, height: &'static str) -> FoundObject {
    object("house", &[("building", "yes"), ("height", height)], FoundShape::Polygon(vec![square(at, side)]))
}

fn made(found: Vec<FoundObject>) -> (Granted, Vec<ObjectRemark>) {
    objects(found, &limits(400, 12_800))
}

fn objects(found: Vec<FoundObject>, limits: &ObjectLimits) -> (Granted, Vec<ObjectRemark>) {
    let (outlines, remarks) = mended(found, &OPTIONS);
    (Claims::of(&outlines, &[], limits.size, SIDE).granted(limits), remarks)
}

#[test]
fn nothing_depends_on_the_order_and_what_is_there_twice_is_kept_once() {
    let all = vec![
        house([10.0, 10.0], 10.0, "6"),
        house([495.0, 495.0], 10.0, "9"),
        house([15.0, 12.0], 10.0, "6"),
        object("wood", &[("natural", "wood")], FoundShape::Polygon(vec![square([300.0, 300.0], 400.0)])),
        object("wood", &[("natural", "wood")], FoundShape::Polygon(vec![square([600.0, 600.0], 200.0)])),
        object("row", &[("natural", "tree_row")], FoundShape::Line(vec![[50.0, 50.0], [90.0, 50.0], [90.0, 99.0]])),
        house([10.0, 10.0], 10.0, "6"),
    ];
    let (one, remarks) = made(all.clone());
    assert_eq!((one.clone(), remarks.clone()), made(all.into_iter().rev().collect()));
    assert_eq!(one.kinds[&ObjectKind::Building][0].count, 3, "overlaps stay");
    assert_eq!(one.kinds[&ObjectKind::Wood][0].count, 4, "united, one part in each load module");
    assert_eq!(remarks.len(), 1);
    let corner: Vec<_> = one
        .modules
        .values()
        .map(|objects| objects.prisms.iter().filter(|prism| prism.roof == 9 * 128).count())
        .collect();
    assert_eq!(corner, [1, 1, 1, 1], "a house over the corner of four");
    let ids = |row, col| one.modules[&[row, col]].canopies.iter().map(|canopy| canopy.id).max();
    assert_eq!(ids(0, 1), ids(1, 0));
}

#[test]
fn what_hides_least_goes_first_and_whole() {
    let mut found: Vec<FoundObject> = (0..30).map(|k| house([10.0 + 15.0 * f64::from(k), 100.0], 10.0, "6")).collect();
    found.push(house([495.0, 300.0], 10.0, "30"));
    found.push(house([30.0, 400.0], 10.0, "5"));
    // 32 houses of 5 polygons, one of them half in the next load module, with a wall less on both sides.
    let (granted, _) = objects(found, &limits(154, 12_800));
    let [kept, wanted] = granted.kinds[&ObjectKind::Building];
    assert_eq!((kept.count, wanted.count), (31, 32));
    assert_eq!(granted.left_out.len(), 1);
    assert_eq!((granted.left_out[0].height_m, granted.left_out[0].full), (5.0, grant::Full::Module([0, 0])));
    assert!(kept.silhouette_m2 < wanted.silhouette_m2);
    assert_eq!(granted.modules[&[0, 0]].polygons(), 154);
    let (none, _) = objects(vec![house([10.0, 10.0], 10.0, "6")], &limits(400, 4));
    assert_eq!((none.modules.len(), none.left_out[0].full), (0, grant::Full::Window([0, 0])));
    let of_area = ObjectLimits { area: 9, ..limits(400, 12_800) };
    let (one, _) = objects([10.0, 600.0].map(|at| house([at, 10.0], 10.0, "6")).into(), &of_area);
    assert_eq!((one.modules.len(), one.left_out[0].full), (1, grant::Full::Area));
}

#[test]
fn what_has_several_pieces_in_a_load_module_costs_all_of_them_there() {
    // Open to the east, both of its wings reach over the side of a load module: 7 polygons, and twice 4 beyond it.
    let ring = [[480, 100], [520, 100], [520, 110], [490, 110], [490, 130], [520, 130], [520, 140], [480, 140]];
    let ring = ring.into_iter().cycle().take(9).map(|at: [i32; 2]| at.map(f64::from)).collect();
    let found = object("house", &[("building", "yes")], FoundShape::Polygon(vec![ring]));
    for (per_module, kept) in [(7, 0), (8, 1)] {
        let (granted, _) = objects(vec![found.clone()], &limits(per_module, 12_800));
        assert_eq!(granted.kinds[&ObjectKind::Building][0].count, kept, "{per_module}");
        assert_eq!(granted.left_out.first().map(|left| left.full), (kept == 0).then_some(grant::Full::Module([0, 1])));
    }
}

#[test]
fn bad_outlines_are_mended_or_left_out_and_told() {
    let bow = [[0.0, 0.0], [20.0, 20.0], [20.0, 0.0], [0.0, 20.0], [0.0, 0.0]];
    let flat = vec![[0.0, 0.0], [20.0, 0.0], [40.0, 0.0], [0.0, 0.0]];
    let polygon = |ring: Vec<[f64; 2]>| object("x", &[("building", "yes")], FoundShape::Polygon(vec![ring]));
    let (crossed, told) = made(vec![polygon(bow.iter().map(|[x, y]| [x + 50.0, y + 50.0]).collect())]);
    assert_eq!(crossed.kinds[&ObjectKind::Building][0].count, 2, "a bow tie is two triangles");
    assert!(told.len() == 1 && told[0].found.contains("crosses itself") && told[0].done.is_some(), "{told:?}");
    for (ring, told) in [
        (flat, "without area"),
        (square([100.0, 100.0], 3.0), "area_min"),
        (vec![[f64::NAN, 0.0], [1.0, 1.0], [1.0, 0.0]], "a place"),
        (square([1e9, 0.0], 10.0), "a place"),
    ] {
        let (granted, remarks) = made(vec![polygon(ring)]);
        assert!(granted.modules.is_empty());
        assert!(remarks[0].found.contains(told), "{remarks:?}");
    }
    assert!(made(vec![polygon(square([-100.0, -100.0], 50.0))]).0.kinds.is_empty(), "outside the area");
    let line = object("x", &[("natural", "wood")], FoundShape::Line(vec![[0.0, 0.0], [9.0, 9.0]]));
    assert_eq!(made(vec![line]).1[0].done, None);
    // Whatever it would have been.
    let far = vec![[0.0, 0.0], [f64::INFINITY, 5.0], [9.0, 9.0]];
    for (tag, shape) in [
        (("barrier", "wall"), FoundShape::Line(far.clone())),
        (("natural", "tree_row"), FoundShape::Line(vec![[3.0, 3.0], [3.0, 3.0]])),
        (("natural", "wood"), FoundShape::Polygon(vec![far])),
    ] {
        let (_, told) = made(vec![object("x", &[tag], shape)]);
        assert!(told.len() == 1 && told[0].done.is_none(), "{tag:?}: {told:?}");
    }
}

#[test]
fn parts_stand_in_the_place_of_their_building() {
    let part = |at, side, height| {
        object("p", &[("building:part", "yes"), ("height", height)], FoundShape::Polygon(vec![square(at, side)]))
    };
    let whole = house([100.0, 100.0], 30.0, "20");
    let (with, _) = made(vec![whole.clone(), part([100.0, 100.0], 25.0, "12"), part([110.0, 110.0], 6.0, "40")]);
    let mut roofs: Vec<i32> = with.modules[&[0, 0]].prisms.iter().map(|prism| prism.roof / 128).collect();
    roofs.sort_unstable();
    assert_eq!(roofs, [12, 40]);
    let (small, _) = made(vec![whole, part([100.0, 100.0], 10.0, "12")]);
    assert_eq!(small.modules[&[0, 0]].prisms.len(), 2, "a part of a ninth leaves the rest standing");
}

#[test]
fn a_wood_of_many_corners_is_cut_smoothed_and_covered_by_triangles() {
    let corners = 100_000;
    let ring: Vec<[f64; 2]> = (0..corners)
        .map(|k| {
            let turn = f64::from(k) / f64::from(corners) * std::f64::consts::TAU;
            let far = 380.0 + 60.0 * (turn * 40.0).sin() + f64::from(k % 2);
            [500.0 + far * turn.cos(), 500.0 + far * turn.sin()]
        })
        .collect();
    let wood = object("wood", &[("landuse", "forest")], FoundShape::Polygon(vec![ring]));
    let (granted, _) = objects(vec![wood], &limits(2_000, 12_800));
    assert_eq!(granted.modules.len(), 4);
    let area: f64 = granted.modules.values().flat_map(|objects| &objects.canopies).map(area_m2).sum();
    // The integral of half the square of the distance.
    let expected = std::f64::consts::PI * (380.5 * 380.5 + 60.0 * 60.0 / 2.0);
    assert!((area - expected).abs() < 0.01 * expected, "{area} of {expected}");
}

fn area_m2(canopy: &terrain::Canopy) -> f64 {
    let doubled = |triangle: &[u16; 3]| {
        let [a, b, c] = triangle.map(|index| canopy.places[usize::from(index)].map(f64::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    canopy.triangles.iter().map(doubled).sum::<f64>() / (2.0 * METRE * METRE)
}

#[test]
fn woods_leave_roads_and_buildings_free() {
    let wood = object("wood", &[("natural", "wood")], FoundShape::Polygon(vec![square([100.0, 100.0], 300.0)]));
    let (outlines, _) = mended(vec![wood, house([200.0, 300.0], 20.0, "6")], &OPTIONS);
    let quanta = |[x, y]: [f64; 2]| [x, y].map(|metres| (metres * METRE) as i32);
    let road = strips(&[[50.0, 150.0], [250.0, 150.0], [450.0, 200.0]].map(quanta), 8 * 128);
    let area = |free: &[Plan]| {
        let granted = Claims::of(&outlines, free, [2, 2], SIDE).granted(&limits(400, 12_800));
        assert!(granted.overlaps.is_empty());
        area_m2(&granted.modules[&[0, 0]].canopies[0])
    };
    assert!((area(&[]) - (90_000.0 - 400.0)).abs() < 1.0, "{}", area(&[]));
    let bend = 150.0 * (1.0_f64 + 0.0625).sqrt();
    let expected = 90_000.0 - 400.0 - 8.0 * (150.0 + bend);
    assert!((area(&road) - expected).abs() < 20.0, "{}, expected {expected}", area(&road));
    // At a sharp bend nothing is left between the edges, on either side.
    let bend = strips(&[[250.0, 150.0], [250.0, 250.0], [320.0, 180.0]].map(quanta), 8 * 128);
    let left = Claims::of(&outlines, &bend, [2, 2], SIDE).granted(&limits(400, 12_800));
    let canopy = &left.modules[&[0, 0]].canopies[0];
    let near = canopy.places.iter().filter(|at| (f64::from(at[0]) / METRE - 250.0).abs() < 3.9);
    let between = near.filter(|at| (145.0..251.0).contains(&(f64::from(at[1]) / METRE)));
    assert_eq!(between.collect::<Vec<_>>(), Vec::<&[u16; 2]>::new());
    // As many roads as cost much more than the wood: they are free where there is room for that, and the wood is there
    // in any case.
    let many: Vec<Plan> =
        (0..40).flat_map(|k| strips(&[[90.0 + 8.0 * f64::from(k), 90.0], [98.0, 410.0]].map(quanta), 128)).collect();
    let claims = Claims::of(&outlines, &many, [2, 2], SIDE);
    let woods = |per_module: u32| {
        let granted = claims.granted(&limits(per_module, 12_800));
        (granted.overlaps.len(), granted.modules[&[0, 0]].canopies[0].triangles.len())
    };
    assert_eq!(woods(30), (1, 2));
    let (overlaps, triangles) = woods(400);
    assert!(overlaps == 0 && (30..400).contains(&triangles), "{overlaps} over roads, {triangles} triangles");
}

#[test]
fn points_are_as_wide_as_what_stands_there() {
    let at = FoundShape::Point([100.0, 100.0]);
    let mast = object("mast", &[("man_made", "mast")], at.clone());
    let tree = object("tree", &[("natural", "tree"), ("height", "8")], at.clone());
    let (granted, remarks) = made(vec![mast, tree, object("house", &[("building", "yes")], at)]);
    let objects = &granted.modules[&[0, 0]];
    let around: Vec<[u16; 2]> = objects.prisms[0].rings[0].iter().map(|corner| [corner.x, corner.y]).collect();
    assert_eq!((around.len(), around.iter().min(), around.iter().max()), (4, Some(&[12_736; 2]), Some(&[12_864; 2])));
    // Leaves leave the mast free.
    assert_eq!((area_m2(&objects.canopies[0]), objects.canopies[0].height), (35.0, 1_024));
    let found: Vec<&str> = remarks.iter().map(|remark| remark.found.as_str()).collect();
    assert_eq!(found, ["a point, where a polygon is needed"]);
}
