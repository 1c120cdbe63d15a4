//! A small product for the tests of this crate: two load modules side by side, in an area of two.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use schedule::Workers;
use store::{
    Area, Fingerprint, Manifest, Report, ReportBreach, ReportPerModule, ReportPerWindow, ReportPlace, ReportPoints,
    ReportResidual, TileModules, TileRecord,
};
use terrain::{
    Canopy, Corner, Decks, GridFrame, HOLE_CLASS, LineForm, LineKind, LineStorey, LoadModule, ModuleGrid, ModuleId,
    ModuleLine, ModuleRect, ModuleResidual, ModuleVertex, ObjectKind, Prism, Spacing, TileId,
};

use crate::archives::gathered;
use crate::{ExportError, Product, Put, Work};

/// The files of an export that writes a folder.
pub(crate) fn files<T>(write: impl FnOnce(&Put, &Work) -> Result<T, ExportError>) -> BTreeMap<String, Vec<u8>> {
    with_work(|work| gathered(|put| write(put, work))).unwrap().0
}

/// The same as text.
pub(crate) fn texts<T>(write: impl FnOnce(&Put, &Work) -> Result<T, ExportError>) -> BTreeMap<String, String> {
    files(write).into_iter().map(|(name, bytes)| (name, String::from_utf8(bytes).unwrap())).collect()
}

/// What comes of work on two threads.
pub(crate) fn with_work<R>(run: impl FnOnce(&Work) -> R) -> R {
    let (workers, stop) = (Workers::new(2), AtomicBool::new(false));
    run(&Work { workers: &workers, stop: &stop, tell: &|_| {} })
}

pub(crate) const GRID: ModuleGrid = ModuleGrid { rows: 1, cols: 2, side_cells: 20 };

pub(crate) fn product() -> Product {
    let tile = TileId { row: 0, col: 0 };
    let frame = GridFrame {
        origin_east_m: 505_000.0,
        origin_north_m: 3_875_000.0,
        spacing: Spacing::from_metres(25.0).unwrap(),
    };
    let rect = GRID.all();
    let tile_modules = TileModules {
        tile,
        grid: GRID,
        modules: rect,
        frame,
        crs: "EPSG:32611".into(),
        vertical_datum: "EGM96".into(),
        fingerprint: Fingerprint([7; 32]),
    };
    let mut manifest = Manifest::new(area(), "[area]\n".into(), 1);
    manifest.tiles = vec![TileRecord::missing(tile)];
    Product {
        manifest,
        class_names: Vec::new(),
        water: Vec::new(),
        grid: GRID,
        frame,
        rect,
        level: 0,
        modules: modules(),
        coarser: Vec::new(),
        lines: Vec::new(),
        left_out: Vec::new(),
        has_ribbons: true,
        materials: Vec::new(),
        textures: None,
        tiles: vec![tile_modules],
        tile_of: vec![0, 0],
        over_holes: 0,
    }
}

/// The same with a coarser level, at which both load modules are two triangles.
pub(crate) fn with_levels() -> Product {
    let mut product = product();
    let mut flat = product.modules.clone();
    flat[1].vertices.remove(2);
    (flat[1].triangles, flat[1].classes, flat[1].polygon_count) = (vec![[0, 1, 3], [0, 3, 2]], vec![0, 1], 2);
    flat[1].residual.largest = 1200;
    flat.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    product.coarser = vec![flat];
    product
}

/// The same on both sides of the line between two squares of 4 km, with a pit on it that the coarser level lacks.
pub(crate) fn across_squares() -> Product {
    let mut product = with_levels();
    let pit = |x| ModuleVertex { y: 32_000, x, z: 125_000 };
    let [west, east] = product.modules.as_mut_slice() else { unreachable!("a sample has two load modules") };
    west.vertices.insert(2, pit(64_000));
    (west.triangles, west.classes) = (vec![[0, 1, 2], [0, 2, 4], [0, 4, 3]], vec![0, 1, 1]);
    east.vertices.insert(3, pit(0));
    (east.triangles, east.classes) = (vec![[0, 1, 2], [0, 2, 3], [1, 5, 2], [2, 4, 3], [2, 5, 4]], vec![1, 0, 0, 0, 1]);
    product.modules.iter_mut().for_each(|module| module.polygon_count = module.triangles.len() as u32);
    product.modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    product.modules.iter_mut().chain(product.coarser.iter_mut().flatten()).for_each(|module| module.id.col += 7);
    product.rect = ModuleRect { south: 0, west: 7, north: 1, east: 9 };
    product.grid.cols = 9;
    product
}

/// The same with a hole over the eastern half of the eastern load module.
pub(crate) fn with_hole() -> Product {
    let mut product = product();
    // Triangles 0 (south) and 1 (west) remain ground.
    product.modules[1].classes = vec![1, 0, HOLE_CLASS, HOLE_CLASS];
    product
}

/// The same with a motorway on the ground, and a bridge with that class over the line between both load modules.
pub(crate) fn with_bridge() -> Product {
    let mut product = product();
    product.class_names = ["default", "motorway", "track"].map(str::to_owned).to_vec();
    let vertex = |x, y, z| ModuleVertex { y, x, z };
    let square = |[west, east]: [u16; 2], [low, high]: [i32; 2], class| {
        let south = [vertex(west, 30_000, low), vertex(east, 30_000, high)];
        let north = [vertex(east, 30_640, high), vertex(west, 30_640, low)];
        [([south[0], south[1], north[0]], class), ([south[0], north[0], north[1]], class)]
    };
    product.modules[0].decks = Decks::of_triangles(square([60_000, 64_000], [129_024, 129_152], 1));
    let over = square([0, 9000], [129_152, 129_280], 1).into_iter().chain(square([0, 9000], [130_000, 130_128], 2));
    product.modules[1].decks = Decks::of_triangles(over);
    product.modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    product
}

/// A house over the line between both load modules with a courtyard, a chimney, and a wood that goes on in both.
pub(crate) fn with_objects() -> Product {
    let mut product = product();
    let ring = |corners: &[[u16; 2]], open: usize| -> Vec<Corner> {
        corners.iter().enumerate().map(|(n, &[x, y])| Corner { x, y, has_wall: n != open }).collect()
    };
    let house = |rings| Prism { id: 7, kind: ObjectKind::Building, base: 128_100, roof: 129_500, rings };
    let chimney = ring(&[[1000, 1000], [1500, 1000], [1500, 1500], [1000, 1500]], 9);
    let chimney = Prism { id: 3, kind: ObjectKind::Tower, base: 127_900, roof: 135_000, rings: vec![chimney] };
    let wood = |west: u16, east: u16| Canopy {
        id: 9,
        kind: ObjectKind::Wood,
        height: 1920,
        fullness: 90,
        spacing: 512,
        places: vec![[west, 40_000], [east, 40_000], [east, 50_000], [west, 50_000]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let west_ring = ring(&[[60_000, 20_000], [64_000, 20_000], [64_000, 26_000], [60_000, 26_000]], 1);
    let yard = ring(&[[61_000, 22_000], [61_000, 24_000], [63_000, 24_000], [63_000, 22_000]], 9);
    let east_ring = ring(&[[0, 20_000], [3_000, 20_000], [3_000, 26_000], [0, 26_000]], 3);
    product.modules[0].objects.prisms = vec![chimney, house(vec![west_ring, yard])];
    product.modules[0].objects.canopies = vec![wood(50_000, 64_000)];
    product.modules[1].objects.prisms = vec![house(vec![east_ring])];
    product.modules[1].objects.canopies = vec![wood(0, 30_000)];
    product.modules.iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    product
}

/// A road 7 m wide that bends on the line between both load modules, and a stream that it crosses.
pub(crate) fn with_ways() -> Product {
    let mut product = product();
    product.class_names = ["default", "minor", "stream"].map(str::to_owned).to_vec();
    let line = |class, kind, width, places: &[[u16; 2]]| {
        let vertices = places.iter().map(|&[x, y]| ModuleVertex { y, x, z: 0 }).collect();
        let (form, storey) = (LineForm::Line, LineStorey::Ground);
        ModuleLine { class, kind, form, storey, is_kept: true, is_in_ground: true, width, vertices }
    };
    let road = |places: &[[u16; 2]]| line(1, LineKind::Travelled, 896, places);
    let stream = line(2, LineKind::Channel, 256, &[[50_000, 0], [50_000, 64_000]]);
    let west = vec![road(&[[10_000, 20_000], [40_000, 30_000], [64_000, 30_000]]), stream];
    product.lines = vec![west, vec![road(&[[0, 30_000], [30_000, 60_000]])]];
    product.modules.iter_mut().for_each(|module| module.classes.fill(0));
    product
}

/// The eastern load module alone.
pub(crate) fn eastern() -> Product {
    let mut product = product();
    product.rect = ModuleRect { south: 0, west: 1, north: 1, east: 2 };
    product.modules.remove(0);
    product.tile_of.pop();
    product
}

fn area() -> Area {
    Area {
        name: "sample".into(),
        crs: "EPSG:32611".into(),
        vertical_datum: "EGM96".into(),
        origin_m: [505_000.0, 3_875_000.0],
        size_m: [1000.0, 500.0],
        spacing_m: 25.0,
        module_side_m: 500.0,
        module_rows: 1,
        module_cols: 2,
        tile_rows: 1,
        tile_cols: 1,
    }
}

fn modules() -> Vec<LoadModule> {
    let vertex = |x, y, z| ModuleVertex { y, x, z };
    let corner = [vertex(0, 0, 128_000), vertex(64_000, 0, 128_256)];
    let west = LoadModule {
        id: ModuleId { row: 0, col: 0 },
        side: 64_000,
        vertices: vec![corner[0], corner[1], vertex(0, 64_000, 128_128), vertex(64_000, 64_000, 128_512)],
        triangles: vec![[0, 1, 3], [0, 3, 2]],
        classes: vec![0, 1],
        polygon_count: 2,
        residual: ModuleResidual { posts: 400, largest: 300, sum_abs: 25_600, sum_squared: 3_276_800 },
        ..LoadModule::default()
    };
    let east = LoadModule {
        id: ModuleId { row: 0, col: 1 },
        side: 64_000,
        vertices: vec![
            vertex(0, 0, 128_256),
            vertex(64_000, 0, 128_000),
            vertex(32_000, 25_600, 127_000),
            vertex(0, 64_000, 128_512),
            vertex(64_000, 64_000, 127_872),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]],
        classes: vec![1, 0, 0, 1],
        polygon_count: 4,
        residual: ModuleResidual { posts: 441, largest: 128, sum_abs: 12_800, sum_squared: 1_638_400 },
        ..LoadModule::default()
    };
    [&west, &east].iter().for_each(|module| assert_eq!(module.check(), Ok(())));
    vec![west, east]
}

/// A report with one breach.
pub(crate) fn report() -> Report {
    let residual = ReportResidual { rms_m: 1.0, max_m: 5.0, mean_abs_m: 0.5, p95_m: 2.0, p99_m: 3.0 };
    let breach = ReportBreach {
        kind: "per_load_module".into(),
        place: ReportPlace::Module([0, 1]),
        count: 4,
        limit: 3,
        excess: 1,
        refused: 0,
        rms_with_m: 1.0,
        rms_without_m: None,
    };
    Report {
        area: "sample".into(),
        workers: 1,
        points: ReportPoints { selected: 0, border: 0, corner: 6, total: 7 },
        count: "triangles".into(),
        triangles: 6,
        polygons: 6,
        per_load_module: ReportPerModule { mean: 3.0, mean_limit: 32.0, max: 4, limit: 3, over: 1 },
        per_4km: ReportPerWindow { max: 6, limit: 4096, over: 0, worst_9x9: 6 },
        residual,
        overall_point_weighted_rms_m: 1.0,
        breaches: vec![breach],
        ..Report::default()
    }
}
