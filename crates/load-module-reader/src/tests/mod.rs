//! Tests of what is asked of the ground, against slow and obvious answers.

mod decks;
mod eye;
mod objects;

use std::sync::Arc;

use fastrand::Rng;

use crate::lookup::STEPS;
use crate::module::torn_edge_count;
use crate::{
    Area, Block, Decks, Keep, LoadedGround, Module, Objects, ReadError, Residual, Sight, SlmFile, TerrainModule,
    TileFile, Vertex, sample,
};

const SIDE: u16 = 64_000;

/// A load module over `n` x `n` squares whose inner corners are shaken, each cut along one diagonal or the other.
fn rough(n: u16, seed: u64) -> Module {
    let mut draw = Rng::with_seed(seed);
    let step = SIDE / n;
    let mut vertices = Vec::new();
    for row in 0..=n {
        for col in 0..=n {
            let mut shaken = |index: u16| match index {
                0 => 0,
                _ if index == n => SIDE,
                _ => index * step + draw.u16(..step / 2) - step / 4,
            };
            let (x, y) = (shaken(col), shaken(row));
            vertices.push(Vertex { x, y, z: draw.i32(0..20_000) });
        }
    }
    let mut triangles = Vec::new();
    for row in 0..n {
        for col in 0..n {
            let at = |row: u16, col: u16| row * (n + 1) + col;
            let [a, b, c, d] = [at(row, col), at(row, col + 1), at(row + 1, col + 1), at(row + 1, col)];
            match draw.u8(..2) {
                0 => triangles.extend([[a, b, c], [a, c, d]]),
                _ => triangles.extend([[a, b, d], [b, c, d]]),
            }
        }
    }
    let residual = Residual { posts: 0, largest: 0, sum_abs: 0, sum_squared: 0 };
    let (classes, polygon_count) = (vec![3; triangles.len()], triangles.len() as u32);
    Module {
        row: 0,
        col: 0,
        level: 0,
        vertices,
        triangles,
        classes,
        sides: Default::default(),
        polygon_count,
        residual,
        decks: Decks::default(),
        lines: Vec::new(),
        objects: Objects::default(),
        unknown_parts: Vec::new(),
    }
}

/// The height at a place in quanta, from every triangle that holds it.
fn by_search(module: &Module, [x, y]: [f64; 2]) -> f64 {
    let mut best = (f64::NEG_INFINITY, 0.0);
    for triangle in &module.triangles {
        let [a, b, c] = triangle.map(|v| {
            let v = module.vertices[usize::from(v)];
            [f64::from(v.x), f64::from(v.y), f64::from(v.z)]
        });
        let left = |a: [f64; 3], b: [f64; 3]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
        let shares = [left(b, c), left(c, a), left(a, b)];
        let whole: f64 = shares.iter().sum();
        let least = shares.iter().fold(f64::INFINITY, |least, share| least.min(share / whole));
        if best.0 < least {
            best = (least, (a[2] * shares[0] + b[2] * shares[1] + c[2] * shares[2]) / whole);
        }
    }
    best.1 / 128.0
}

#[test]
fn heights_equal_those_of_a_search_through_all_triangles() {
    for (n, seed) in [(1, 1), (2, 2), (5, 3), (13, 4), (40, 5)] {
        let module = rough(n, seed);
        let prepared = TerrainModule::new(module.clone(), SIDE);
        let mut draw = Rng::with_seed(seed);
        for _ in 0..2000 {
            let place = [0, 1].map(|_| draw.i64(0..=i64::from(SIDE) * STEPS));
            let found = prepared.lookup().height_m(place).expect("some triangle holds every place");
            let expected = by_search(&module, place.map(|steps| steps as f64 / STEPS as f64));
            assert!((found - expected).abs() < 1e-6, "seed {seed} at {place:?}: {found}, expected {expected}");
        }
        for vertex in &module.vertices {
            let place = [i64::from(vertex.x) * STEPS, i64::from(vertex.y) * STEPS];
            assert_eq!(prepared.lookup().height_m(place), Some(f64::from(vertex.z) / 128.0));
        }
    }
}

fn sample_area() -> Area {
    let file = TileFile::of_bytes("sample", Arc::new(sample::file())).unwrap();
    Area::of_files(vec![file]).unwrap()
}

/// Both load modules of the sample: 2,3 is level at 5 m, 2,4 a pit whose bottom lies below zero.
fn sample_ground() -> LoadedGround {
    sample_area().load(Block { south: 2, west: 3, north: 3, east: 5 }).unwrap()
}

#[test]
fn ground_has_heights_normals_and_classes() {
    let ground = sample_ground();
    let [east, north] = [501_500.0, 3_876_000.25];
    let flat = ground.sample([east + 400.0, north + 20.0]).unwrap();
    assert_eq!((flat.height_m, flat.normal, flat.class), (5.0, [0.0, 0.0, 1.0], 0));
    assert_eq!(ground.sample([east + 20.0, north + 400.0]).unwrap().class, 1);
    let bottom = [east + 500.0 + 30_000.0 / 128.0, north + 20_000.0 / 128.0];
    assert_eq!(ground.height_m(bottom), Some(-7.0 / 128.0));
    let slope = ground.sample([bottom[0], north + 10.0]).unwrap();
    assert!(0.0 < slope.normal[1] && slope.normal[0].abs() < 1e-12, "{slope:?}");
    // The far side of the area belongs to it; beyond, and where nothing is loaded, is nothing.
    assert_eq!(ground.height_m([502_500.0, north]), Some(5.0));
    for nowhere in [[502_500.01, north], [east - 0.01, north], [east, north - 1.0], [f64::NAN, north], [1e300, 0.0]] {
        assert_eq!(ground.height_m(nowhere), None, "{nowhere:?}");
    }
    let places: Vec<[f64; 2]> =
        (0..100).map(|i| [east - 9.0 + 11.0 * f64::from(i), north + 4.0 * f64::from(i)]).collect();
    let mut heights = vec![0.0; places.len()];
    ground.heights_m(&places, &mut heights);
    for (&place, height_m) in places.iter().zip(heights) {
        assert_eq!(ground.height_m(place), (!height_m.is_nan()).then_some(height_m), "{place:?}");
    }
}

#[test]
fn a_line_of_sight_ends_at_the_first_ground_above_it() {
    let ground = sample_ground();
    let [east, north] = [501_500.0, 3_876_000.25];
    let above = |along: f64, up: f64| [east + along, north + 20_000.0 / 128.0, up];
    assert_eq!(ground.sight(above(10.0, 6.0), above(990.0, 6.0)), Sight::Free);
    assert_eq!(ground.sight(above(10.0, 5.0), above(490.0, 5.0)), Sight::Free, "what only touches hides nothing");
    // From the pit one does not see over its rim.
    let Sight::Hidden(share) = ground.sight(above(734.375, 1.0), above(100.0, 5.5)) else { panic!("the rim hides") };
    let entered = above(734.375 - share * 634.375, 1.0 + share * 4.5);
    assert!((ground.height_m([entered[0], entered[1]]).unwrap() - entered[2]).abs() < 1e-6, "{share}");
    assert_eq!(ground.sight(above(10.0, 6.0), above(-400.0, 6.0)), Sight::Unknown);
    let Sight::Hidden(share) = ground.sight(above(734.375, 1.0), above(-100.0, 1.0)) else { panic!("the slope hides") };
    assert!((share - share_of_slope()).abs() < 1e-9, "{share}");
}

/// Along the level line 1 m up from the bottom, westwards, the slope reaches it where it has risen by 135/128 m, of the
/// 647/128 m up to the rim.
fn share_of_slope() -> f64 {
    234.375 * 135.0 / 647.0 / 834.375
}

/// Holds a line of sight to how far it stays above the ground `at` each share of it; whether it is free.
fn agrees_with_small_steps(found: Sight, clearance_m: f64, at: impl Fn(f64) -> f64) -> bool {
    let steps = || (0..=2000).map(|step| f64::from(step) / 2000.0);
    let least = steps().map(&at).fold(f64::INFINITY, f64::min);
    assert!(clearance_m <= least + 1e-4 && least <= clearance_m + 3.0, "{clearance_m} of {least}");
    match found {
        Sight::Free => assert!(-0.5 < least && -1e-5 <= clearance_m, "{least}, {clearance_m}"),
        Sight::Hidden(share) => {
            // It is above the ground up to there, on it there, or below it from its beginning.
            let is_entered =
                at(share).abs() < 1e-4 && steps().filter(|&step| step < share).all(|step| -1e-4 < at(step));
            assert!(is_entered || share == 0.0 && at(0.0) < 0.0, "{} at {share}", at(share));
            assert!(clearance_m < 1e-5, "{clearance_m}");
        }
        Sight::Unknown => panic!("all of it is loaded"),
    }
    found == Sight::Free
}

#[test]
fn a_line_of_sight_agrees_with_small_steps() {
    let module = rough(9, 7);
    let mut file = sample_ground();
    let prepared = Arc::new(TerrainModule::new(module.clone(), SIDE));
    let block = file.block();
    file = file.with_modules(block, vec![Arc::clone(&prepared), prepared]);
    let [east, north] = [501_500.0, 3_876_000.25];
    let mut draw = Rng::with_seed(11);
    let (mut hidden, mut free) = (0, 0);
    for _ in 0..400 {
        let mut place = || [0, 1].map(|_| f64::from(draw.u32(..500_000)) / 1000.0);
        let (from, to) = (place(), place());
        let (up, over) = (f64::from(draw.u32(..160)), f64::from(draw.u32(..160)));
        let at = |share: f64| {
            let local = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            let ground = by_search(&module, local.map(|metres| metres * 128.0));
            up + share * (over - up) - ground
        };
        let world = |[x, y]: [f64; 2], up: f64| [east + x, north + y, up];
        let (from, to) = (world(from, up), world(to, over));
        match agrees_with_small_steps(file.sight(from, to), file.clearance_m(from, to).unwrap(), at) {
            true => free += 1,
            false => hidden += 1,
        }
    }
    assert!(20 < hidden && 20 < free, "{hidden} hidden, {free} free");
}

#[test]
fn moving_keeps_what_is_loaded_and_reads_the_rest() {
    let area = sample_area();
    let west = area.load(Block { south: 2, west: 3, north: 3, east: 4 }).unwrap();
    let both = west.moved(&area, Block { south: 2, west: 3, north: 3, east: 5 }).unwrap();
    assert!(Arc::ptr_eq(&west.modules()[0], &both.modules()[0]));
    assert_eq!(both.modules()[1].module().col, 4);
    assert!(matches!(area.load(area.whole()), Err(ReadError::NoSuchModule { row: 0, col: 0 })));
}

#[test]
fn a_block_is_cut_at_the_ends_of_the_area() {
    let area = sample_area();
    let block = |place, reach| {
        let Block { south, west, north, east } = area.block_around(place, reach);
        [south, west, north, east]
    };
    let [east, north] = area.frame().origin_m;
    assert_eq!(block([east + 750.0, north + 1250.0], 1), [1, 0, 4, 3]);
    assert_eq!(block([east + 750.0, north + 1250.0], 100), [0, 0, 4, 5]);
    assert_eq!(area.block_around([0.0, 0.0], 7).count(), 0);
    assert_eq!(area.block_around([f64::INFINITY, north], 7).count(), 0);
}

#[test]
fn files_on_disk_in_memory_and_damaged_are_told_apart() {
    let folder = std::env::temp_dir().join(format!("load-module-reader-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("modules")).unwrap();
    assert!(matches!(Area::open(&folder, Keep::OnDisk), Err(ReadError::NoFiles { .. })));
    let path = folder.join("modules/r00c01.slm");
    let bytes = sample::file();
    std::fs::write(&path, &bytes).unwrap();
    let block = Block { south: 2, west: 3, north: 3, east: 5 };
    for keep in [Keep::OnDisk, Keep::InMemory] {
        let ground = Area::open(&folder, keep).unwrap().load(block).unwrap();
        assert_eq!(ground.height_m([501_500.0, 3_876_000.25]), Some(5.0));
    }
    for length in 0..bytes.len() {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let opened = Area::open(&folder, Keep::OnDisk);
        assert!(opened.and_then(|area| area.load(block)).is_err(), "the first {length} bytes were accepted");
    }
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        let file = TileFile::of_bytes("damaged", Arc::new(damaged));
        let loaded = file.and_then(|file| Area::of_files(vec![file])).and_then(|area| area.load(block));
        assert!(loaded.is_err(), "byte {at} was changed and accepted");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_file_of_an_area_is_opened_when_a_load_module_of_it_is_asked_for() {
    let folder = std::env::temp_dir().join(format!("load-module-reader-area-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (near, far) = (folder.join("near.slm"), folder.join("far.slm"));
    std::fs::write(&near, sample::file()).unwrap();
    // The same load modules a row farther north, and an index that cannot be read.
    let mut bytes = with_header(&[(40, &3u32.to_le_bytes()), (44, &4u32.to_le_bytes())]);
    let header_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    bytes[header_length] ^= 1;
    std::fs::write(&far, bytes).unwrap();
    let block = Block { south: 2, west: 3, north: 3, east: 5 };
    let [held, late] = [(); 2].map(|()| Area::open(&folder, Keep::OnDisk).unwrap());
    let ground = held.load(block).unwrap();
    assert!(held.load(Block { south: 3, north: 4, ..block }).is_err());
    // What was opened is held open; what is opened late is the file that the area was made of, or none.
    std::fs::write(folder.join("new"), with_header(&[(92, &[7; 32])])).unwrap();
    std::fs::rename(folder.join("new"), &near).unwrap();
    assert_eq!(held.load(block).unwrap().modules().len(), ground.modules().len());
    assert!(matches!(late.load(block), Err(ReadError::Changed { .. })));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_block_is_loaded_at_any_level_of_the_area() {
    let area = Area::of_files(vec![TileFile::of_bytes("levels", Arc::new(sample::two_levels())).unwrap()]).unwrap();
    assert_eq!(area.frame().level_count, 2);
    let west = Block { south: 2, west: 3, north: 3, east: 4 };
    let both = Block { east: 5, ..west };
    let bottom = [502_000.0 + 30_000.0 / 128.0, 3_876_000.25 + 20_000.0 / 128.0];
    assert_eq!(area.load(both).unwrap().height_m(bottom), Some(-7.0 / 128.0));
    let coarse = area.load_level(west, 1).unwrap().moved(&area, both).unwrap();
    assert_eq!((coarse.level(), coarse.height_m(bottom)), (1, Some(5.0)));
    assert!(coarse.modules().iter().all(|module| module.module().level == 1));
    let error = area.load_level(both, 2).unwrap_err().to_string();
    assert_eq!(error, "found level 2, expected 0 to 1");
}

#[test]
fn files_with_other_levels_are_of_another_area() {
    let open = |name: &str, bytes: Vec<u8>| TileFile::of_bytes(name, Arc::new(bytes)).unwrap();
    let files = vec![open("plain", sample::file()), open("levels", sample::two_levels())];
    assert!(matches!(Area::of_files(files), Err(ReadError::OtherArea { .. })));
}

#[test]
fn a_line_of_sight_beyond_any_ground_is_unknown_at_once() {
    let far = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e307, -1e307, f64::MAX, 1e155, 1e19, -9.3e18, 1e13];
    let ground = sample_ground();
    let [east, north] = [501_510.0, 3_876_010.0];
    for number in far {
        for axis in 0..3 {
            let eye = [east, north, 6.0];
            let mut place = eye;
            place[axis] = number;
            assert_eq!(ground.sight(eye, place), Sight::Unknown, "to {place:?}");
            assert_eq!(ground.sight(place, eye), Sight::Unknown, "from {place:?}");
            assert_eq!(ground.sight(place, place.map(|number| -number)), Sight::Unknown, "through {place:?}");
        }
        assert_eq!(ground.sight([number; 3], [-number; 3]), Sight::Unknown, "{number}");
        assert_eq!(ground.height_m([number, north]), None);
        assert_eq!(ground.sample([east, number]), None);
        let mut heights = [0.0; 2];
        ground.heights_m(&[[number, north], [number; 2]], &mut heights);
        assert!(heights.iter().all(|height_m| height_m.is_nan()));
    }
    // As far as ground can be, the line is followed to where it leaves what is loaded.
    assert_eq!(ground.sight([east, north, 6.0], [east, 9e11, 6.0]), Sight::Unknown);
    assert!(matches!(ground.sight([east, north, 6.0], [9e11, north, -9e11]), Sight::Hidden(share) if share < 1e-9));
}

#[test]
fn no_place_loads_ground_where_none_can_be() {
    let area = sample_area();
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e307, -1e307] {
        for reach in [0, 7, u32::MAX] {
            let block = area.block_around([number, 3_876_010.0], reach);
            assert_eq!(block.count(), 0, "{number}, {reach}");
            assert_eq!(area.load(block).unwrap().modules().len(), 0);
        }
    }
}

/// The sample with header fields changed, and its checksums made right.
fn with_header(edits: &[(usize, &[u8])]) -> Vec<u8> {
    let mut bytes = sample::file();
    for (at, field) in edits {
        bytes[*at..*at + field.len()].copy_from_slice(field);
    }
    sample::mend_checksums(&mut bytes);
    bytes
}

#[test]
fn an_area_as_large_as_a_header_may_say_takes_no_room_for_what_is_in_no_file() {
    let most = ((1u32 << 30) / 20).to_le_bytes();
    let bytes = with_header(&[(32, &most), (36, &most)]);
    let area = Area::of_files(vec![TileFile::of_bytes("large", Arc::new(bytes)).unwrap()]).unwrap();
    assert_eq!(area.whole().count(), (1 << 30) / 20 * ((1 << 30) / 20));
    assert!(matches!(area.load(area.whole()), Err(ReadError::NoSuchModule { row: 0, col: 0 })));
    let held = Block { south: 2, west: 3, north: 3, east: 5 };
    let ground = area.load(held).unwrap();
    assert_eq!(ground.height_m([501_510.0, 3_876_010.0]), Some(5.0));
    assert_eq!(ground.sight([501_510.0, 3_876_010.0, 6.0], [9e11, 3_876_010.0, 6.0]), Sight::Unknown);
    for wrong in [Block { north: u32::MAX, ..held }, Block { east: u32::MAX, ..held }] {
        assert!(matches!(ground.moved(&area, wrong), Err(ReadError::NoSuchModule { .. })));
    }
    // Rows without columns, and sides the wrong way round, are nothing.
    for nothing in [Block { north: u32::MAX, east: 3, ..held }, Block { south: 9, ..held }, Block { east: 1, ..held }] {
        assert_eq!(ground.moved(&area, nothing).unwrap().modules().len(), 0, "{nothing:?}");
    }
}

#[test]
fn a_header_that_cannot_be_is_refused() {
    let refused = |edits: &[(usize, &[u8])], expected: &str| {
        let error = SlmFile::parse(&with_header(edits)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error:?} does not say {expected:?}");
    };
    let one = |at: usize, field: &[u8], expected: &str| refused(&[(at, field)], expected);
    one(32, &u32::MAX.to_le_bytes(), "found area rows 4294967295, expected 1 to 53687091");
    one(36, &u32::MAX.to_le_bytes(), "found area columns 4294967295, expected 1 to 53687091");
    one(56, &[0; 4], "found side 0, expected 1 to 65535");
    one(60, &[0; 4], "found side in cells 0");
    one(64, &[0; 4], "found spacing 0");
    one(64, &u32::MAX.to_le_bytes(), "found spacing 4294967295");
    one(72, &f64::NAN.to_le_bytes(), "origin east is not a finite number");
    one(80, &f64::INFINITY.to_le_bytes(), "origin north is not a finite number");
    one(72, &1e307f64.to_le_bytes(), "found origin east 9223372036854775807, expected -1000000000 to 1000000000");
    one(80, &(-1e9f64 - 0.5).to_le_bytes(), "found origin north -1000000001");
    one(12, &u32::MAX.to_le_bytes(), "found header length 4294967295, expected 128 to 131200");
    one(12, &[0; 4], "found header length 0");
}

#[test]
fn a_header_with_bytes_behind_its_fields_is_refused() {
    // Both the fields and all bytes together end with a right checksum.
    let good = sample::file();
    let length = u32::from_le_bytes(good[12..16].try_into().unwrap()) as usize;
    let mut bytes = good[..length].to_vec();
    bytes[12..16].copy_from_slice(&(length as u32 + 8).to_le_bytes());
    let fields = crc32fast::hash(&bytes[..length - 4]);
    bytes[length - 4..].copy_from_slice(&fields.to_le_bytes());
    bytes.extend([7; 4]);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes.extend(&good[length..]);
    let error = SlmFile::parse(&bytes).unwrap_err().to_string();
    assert!(error.contains("found header length"), "{error}");
}

#[test]
fn ground_is_not_moved_over_another_area() {
    let ground = sample_ground();
    let other = with_header(&[(72, &1000f64.to_le_bytes())]);
    let other = Area::of_files(vec![TileFile::of_bytes("other", Arc::new(other)).unwrap()]).unwrap();
    assert!(matches!(ground.moved(&other, ground.block()), Err(ReadError::OtherGround)));
}

/// Triangles from the middle of the northern side to each of many vertices on the southern one.
fn splinters(count: u16) -> Module {
    let step = SIDE / count;
    let mut vertices: Vec<Vertex> = (0..=count).map(|i| Vertex { x: i * step, y: 0, z: i32::from(i) }).collect();
    vertices.extend([0, SIDE / 2, SIDE].map(|x| Vertex { x, y: SIDE, z: 0 }));
    let [west, top, east] = [count + 1, count + 2, count + 3];
    let mut triangles: Vec<[u16; 3]> = vec![[0, top, west]];
    triangles.extend((0..count).map(|i| [i, i + 1, top]));
    triangles.push([count, east, top]);
    Module { vertices, classes: vec![3; triangles.len()], polygon_count: 1, triangles, ..rough(1, 1) }
}

#[test]
fn splinters_across_a_load_module_take_no_more_room_than_other_triangles() {
    for count in [100, 16_000, 64_000] {
        let module = splinters(count);
        let prepared = TerrainModule::new(module.clone(), SIDE);
        let bytes = prepared.lookup().byte_count() as u64;
        assert!(bytes <= 20 * 16_384 + (24 + 4 * 64) * u64::from(count + 2), "{count}: {bytes} bytes");
        let mut draw = Rng::with_seed(3);
        for _ in 0..50 {
            let place = [0, 1].map(|_| draw.i64(0..=i64::from(SIDE) * STEPS));
            let found = prepared.lookup().height_m(place).expect("some triangle holds every place");
            let expected = by_search(&module, place.map(|steps| steps as f64 / STEPS as f64));
            assert!((found - expected).abs() < 1e-3, "{count} at {place:?}: {found}, expected {expected}");
        }
    }
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_waited_for() {
    let folder = std::env::temp_dir().join(format!("load-module-reader-pipe-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("a.slm")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.join("b.slm")).unwrap();
    for name in ["a.slm", "b.slm"] {
        assert!(matches!(SlmFile::open(folder.join(name)), Err(ReadError::NotAFile { .. })), "{name}");
        for keep in [Keep::OnDisk, Keep::InMemory] {
            assert!(matches!(TileFile::open(folder.join(name), keep), Err(ReadError::NotAFile { .. })), "{name}");
        }
    }
    assert!(matches!(Area::open(&folder, Keep::OnDisk), Err(ReadError::NotAFile { .. })));
    std::fs::remove_dir_all(folder).unwrap();
}

/// The sample with other triangles in its flat load module, and its checksums made right.
fn with_triangles(triangles: [[u16; 3]; 2]) -> Vec<u8> {
    let mut bytes = sample::file();
    let words = |triangles: [[u16; 3]; 2]| -> Vec<u8> {
        triangles.as_flattened().iter().flat_map(|vertex| vertex.to_le_bytes()).collect()
    };
    let old = words([[0, 1, 3], [0, 3, 2]]);
    let at = bytes.windows(old.len()).position(|found| found == old).unwrap();
    bytes[at..at + old.len()].copy_from_slice(&words(triangles));
    sample::mend_checksums(&mut bytes);
    bytes
}

#[test]
fn a_hole_beside_an_overlap_as_large_is_refused() {
    assert!(SlmFile::parse(&with_triangles([[0, 1, 2], [1, 3, 2]])).is_ok());
    for overlapping in [[[0, 1, 2], [0, 1, 3]], [[0, 1, 3], [1, 3, 2]], [[0, 1, 2], [0, 3, 2]]] {
        let error = SlmFile::parse(&with_triangles(overlapping)).unwrap_err().to_string();
        assert!(error.contains("found torn edges 2, expected 0"), "{overlapping:?}: {error}");
    }
}

#[test]
fn torn_edges_are_those_that_a_list_of_all_edges_names() {
    let mut draw = Rng::with_seed(17);
    for seed in 0..60 {
        let mut module = rough(1 + (seed % 7) as u16, seed);
        if 20 <= seed {
            for _ in 0..1 + seed % 3 {
                let count = module.triangles.len();
                let (from, to) = (draw.usize(..count), draw.usize(..count));
                module.triangles[to] = module.triangles[from];
            }
        }
        let directed = |&[a, b, c]: &[u16; 3]| [(a, b), (b, c), (c, a)];
        let edges: Vec<(u16, u16)> = module.triangles.iter().flat_map(directed).collect();
        let is_torn = |&(from, to): &(u16, u16)| {
            let [a, b] = [from, to].map(|index| module.vertices[usize::from(index)]);
            let on_side = (a.x == b.x && a.x % SIDE == 0) || (a.y == b.y && a.y % SIDE == 0);
            let count = |edge| edges.iter().filter(|&&found| found == edge).count();
            !on_side && count((from, to)) != count((to, from))
        };
        let mut torn: Vec<(u16, u16)> = edges.iter().filter(|edge| is_torn(edge)).copied().collect();
        torn.iter_mut().for_each(|edge| *edge = (edge.0.min(edge.1), edge.0.max(edge.1)));
        torn.sort_unstable();
        torn.dedup();
        assert_eq!(torn_edge_count(&module.vertices, &module.triangles, SIDE), torn.len(), "seed {seed}");
        assert!(20 <= seed || torn.is_empty(), "seed {seed}");
    }
}
