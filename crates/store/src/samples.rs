//! Small values for the tests of this crate.

use terrain::{
    Decks, GainCurve, GainRun, GridFrame, LatticePoint, LineForm, LineKind, LineStorey, LineTraits, LoadModule,
    ModuleGrid, ModuleId, ModuleRect, ModuleResidual, ModuleVertex, Post, PostRect, Refusal, RefusedBy, Spacing,
    StopReason, TileId, TileTin, Tin, Vertex,
};

use crate::{
    Area, FileStamp, Fingerprint, Measured, MeasuredCurvature, MeasuredModule, MeasuredTally, Stamp, TileModules,
};

pub(crate) const TILE: TileId = TileId { row: 0, col: 1 };

pub(crate) fn stamp() -> Stamp {
    Stamp { algorithm_revision: 7, fingerprint: Fingerprint::of_bytes(b"sample") }
}

/// Every truncation, every flipped bit and an extra byte must be an error.
#[track_caller]
pub(crate) fn check_every_damage(good: &[u8], is_error: impl Fn(&[u8]) -> bool) {
    assert!(!is_error(good), "the undamaged file must be accepted");
    for length in 0..good.len() {
        assert!(is_error(&good[..length]), "the first {length} bytes were accepted");
    }
    let mut bytes = good.to_vec();
    for at in 0..bytes.len() {
        for bit in 0..8 {
            bytes[at] ^= 1 << bit;
            assert!(is_error(&bytes), "bit {bit} of byte {at} was flipped and accepted");
            bytes[at] ^= 1 << bit;
        }
    }
    bytes.push(0);
    assert!(is_error(&bytes), "an extra byte was accepted");
}

/// A square of 20 x 20 cells with one vertex inside.
pub(crate) fn tile() -> TileTin {
    let rect = PostRect::new(Post::new(0, 20), Post::new(20, 40));
    let mut vertices: Vec<_> = rect.corners().iter().map(|&post| Vertex { at: post.into(), height: 12_800 }).collect();
    vertices.push(Vertex { at: LatticePoint::new(83, 241), height: -5 });
    let refused = vec![Refusal {
        post: Post::new(3, 33),
        module: ModuleId { row: 0, col: 1 },
        residual: 17,
        by: RefusedBy::Window,
    }];
    let tile = TileTin {
        tile: TILE,
        tin: Tin::new(rect, vertices, vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]),
        initial_count: 4,
        residuals: vec![12_805],
        triangles_charged: 4,
        refused,
        stop: StopReason::Exhausted,
    };
    assert_eq!(tile.tin.check(), Ok(()));
    tile
}

pub(crate) fn measured() -> Measured {
    let tally = MeasuredTally {
        posts: 3,
        sum: -4,
        sum_abs: 6,
        sum_squared: [1, 14],
        largest: 3,
        bins: vec![(1, 2), (9000, 1)],
    };
    Measured {
        tile: TILE,
        modules_file: FileStamp::of(b"slm"),
        modules: vec![MeasuredModule { triangles: 32, posts: 3, largest: 3, ..MeasuredModule::default() }; 2],
        classes: vec![tally.clone(), MeasuredTally::default()],
        at_source_grid: Some(tally.clone()),
        at_source: Some(tally),
        points: vec![7, 0],
        border: 2,
        heights: [-5, 1280],
        curvature: MeasuredCurvature { cells: 400, integral: 123_456_789, rough_cells: 17 },
        features: None,
    }
}

pub(crate) fn curve() -> GainCurve {
    let run = |col, bin, cost| GainRun { module: ModuleId { row: 0, col }, bin, cost };
    GainCurve {
        tile: TILE,
        runs: vec![run(1, 900, 2), run(2, 900, 4), run(1, -12, 70_000)],
        squares: vec![(900, 12.5), (-12, 3.0)],
    }
}

/// Load modules 2,3 and 2,4 of an area of 4 x 5.
pub(crate) fn tile_modules() -> TileModules {
    TileModules {
        tile: TILE,
        grid: ModuleGrid { rows: 4, cols: 5, side_cells: 20 },
        modules: ModuleRect { south: 2, west: 3, north: 3, east: 5 },
        frame: GridFrame {
            origin_east_m: 505_000.0,
            origin_north_m: 3_875_000.0,
            spacing: Spacing::from_metres(25.0).unwrap(),
        },
        crs: "EPSG:32611".into(),
        vertical_datum: "EGM96".into(),
        fingerprint: Fingerprint(std::array::from_fn(|i| i as u8)),
    }
}

pub(crate) fn modules() -> Vec<LoadModule> {
    let vertex = |x, y, z| ModuleVertex { y, x, z };
    let west = LoadModule {
        id: ModuleId { row: 2, col: 3 },
        side: 64_000,
        vertices: vec![
            vertex(0, 0, 128_000),
            vertex(64_000, 0, 128_256),
            vertex(0, 64_000, 128_128),
            vertex(64_000, 64_000, 128_512),
        ],
        triangles: vec![[0, 1, 3], [0, 3, 2]],
        classes: vec![0, 1],
        polygon_count: 2,
        residual: ModuleResidual { posts: 400, largest: 300, sum_abs: 25_600, sum_squared: 3_276_800 },
        ..LoadModule::default()
    };
    let east = LoadModule {
        id: ModuleId { row: 2, col: 4 },
        side: 64_000,
        vertices: vec![
            vertex(0, 0, 128_256),
            vertex(64_000, 0, 128_000),
            vertex(32_000, 25_600, -128),
            vertex(0, 64_000, 128_512),
            vertex(64_000, 64_000, 127_872),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]],
        classes: vec![1, 0, 0, 1],
        polygon_count: 4,
        residual: ModuleResidual { posts: 399, largest: 128, sum_abs: 12_800, sum_squared: 1_638_400 },
        ..LoadModule::default()
    };
    [&west, &east].iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    vec![west, east]
}

/// The same load modules at three levels: as they are, all flat, all flat.
pub(crate) fn levels() -> Vec<Vec<LoadModule>> {
    let fine = modules();
    let flat = |module: &LoadModule| LoadModule {
        vertices: module.vertices.iter().copied().filter(|v| v.x == 0 || v.x == module.side).collect(),
        residual: ModuleResidual { largest: 2 * module.residual.largest, ..module.residual },
        id: module.id,
        ..fine[0].clone()
    };
    let coarse: Vec<_> = fine.iter().map(flat).collect();
    coarse.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    vec![fine, coarse.clone(), coarse]
}

/// The same levels with decks: a bridge of three triangles that hangs over the line between both load modules, and
/// another that crosses above it in the eastern one; at the coarsest level there are none.
pub(crate) fn levels_with_decks() -> Vec<Vec<LoadModule>> {
    let mut levels = levels();
    let vertex = |x, y, z| ModuleVertex { y, x, z };
    let bridge = |[west, east]: [u16; 2], y: u16, z: i32, class| {
        let [a, b] = [vertex(west, y, z), vertex(east, y, z)];
        let [c, d] = [vertex(east, y + 700, z + 1), vertex(west, y + 700, z + 1)];
        [([a, b, c], class), ([a, c, d], class)]
    };
    let south = |x: [u16; 2]| bridge(x, 30_000, 129_024, 1);
    let west = Decks::of_triangles(south([60_000, 64_000]));
    let east = Decks::of_triangles(south([0, 9000]).into_iter().chain(bridge([0, 64_000], 30_100, 129_664, 254)));
    for modules in &mut levels[..2] {
        (modules[0].decks, modules[1].decks) = (west.clone(), east.clone());
        modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    }
    levels[1][0].decks = Decks::default();
    levels
}

/// The same levels with lines at the finest: a road up to the line between both load modules, one that is left out, and
/// a stream.
pub(crate) fn levels_with_lines() -> Vec<Vec<LoadModule>> {
    let mut levels = levels_with_decks();
    let vertex = |(x, y, z): (u16, u16, i32)| ModuleVertex { y, x, z };
    let line = |class, kind, form, is_kept, places: &[(u16, u16, i32)]| {
        let storey = LineStorey::Ground;
        let traits = LineTraits { kind, form, storey, is_kept, is_in_ground: is_kept, width: 640 };
        traits.line(class, places.iter().copied().map(vertex).collect())
    };
    let road = |places| line(1, LineKind::Travelled, LineForm::Strip, true, places);
    let out = line(2, LineKind::Travelled, LineForm::Nothing, false, &[(0, 0, -5), (900, 0, -6)]);
    let stream = line(3, LineKind::Channel, LineForm::Line, true, &[(500, 64_000, 9), (500, 9, 8), (700, 0, 7)]);
    levels[0][0].lines = vec![road(&[(0, 700, 7), (64_000, 700, 9)])];
    levels[0][1].lines = vec![road(&[(0, 700, 9), (64_000, 700, 8)]), out, stream];
    levels[0].iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    levels
}

pub(crate) fn area() -> Area {
    Area {
        name: "sample".into(),
        crs: "EPSG:32611".into(),
        vertical_datum: "EGM96".into(),
        origin_m: [505_000.0, 3_875_000.1],
        size_m: [2500.0, 2000.0],
        spacing_m: 25.0,
        module_side_m: 500.0,
        module_rows: 4,
        module_cols: 5,
        tile_rows: 1,
        tile_cols: 2,
    }
}

/// A house with a courtyard on a line between load modules, and a wood.
pub(crate) fn objects() -> load_module_reader::Objects {
    use load_module_reader::{Canopy, Corner, ObjectKind, Objects, Prism};
    let ring = |places: &[[u16; 2]]| places.iter().map(|&[x, y]| Corner { x, y, has_wall: x != 0 }).collect();
    Objects {
        prisms: vec![Prism {
            id: 77,
            kind: ObjectKind::Building,
            base: -5,
            roof: 900,
            rings: vec![
                ring(&[[0, 100], [2_000, 100], [2_000, 2_100], [0, 2_100]]),
                ring(&[[500, 500], [500, 900], [900, 900]]),
            ],
        }],
        canopies: vec![Canopy {
            id: 78,
            kind: ObjectKind::Wood,
            height: 1_920,
            fullness: 90,
            spacing: 512,
            places: vec![[0, 9_000], [5_000, 9_000], [0, 12_000]],
            triangles: vec![[0, 1, 2]],
        }],
    }
}
