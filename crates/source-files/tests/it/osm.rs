//! OpenStreetMap data: what is read, how it is put together, and what is told of what is not.

use proptest::prelude::*;
use source_files::{Crs, FeatureFile, SourceError, VectorFeature, VectorShape, Wanted, read_features};
use terrain::in_turn;

use crate::pbf::{Osm, Packing, bytes, frame, header, number, with_head};
use crate::support::{BOUNDS, Folder, LAKE, ROAD, WANTED, ids, remarks};

fn read_bytes(bytes: &[u8]) -> Result<FeatureFile, SourceError> {
    let folder = Folder::new();
    read_features(&folder.write("a.osm.pbf", bytes), &WANTED, &in_turn)
}

#[track_caller]
fn read(osm: &Osm) -> FeatureFile {
    read_bytes(&osm.bytes()).unwrap()
}

/// Nodes 1 to 9, about 100 m apart, from west to east; 11 to 19 the same 100 m farther north, and so on.
fn grid() -> Osm {
    let node = |id: i64| (id, [-117.0 + 0.001 * (id % 10) as f64, 35.0 + 0.001 * (id / 10) as f64]);
    Osm::new(&(1..100).filter(|id| id % 10 != 0).map(node).collect::<Vec<_>>())
}

fn line(feature: &VectorFeature) -> &[[f64; 2]] {
    let VectorShape::Line(line) = &feature.shape else { panic!("{} is no line", feature.id) };
    &line.places
}

/// The number of corners of each ring.
fn rings(feature: &VectorFeature) -> Vec<usize> {
    let VectorShape::Polygon(rings) = &feature.shape else { panic!("{} is no polygon", feature.id) };
    rings.iter().map(|ring| ring.places.len()).collect()
}

#[test]
fn ways_with_a_wanted_key_are_lines_in_metres_with_their_tags_sorted() {
    let osm = grid()
        .way(7, &[("name", "b"), ("highway", "track"), ("bridge", "yes")], &[1, 2, 3])
        .way(5, &[("building", "yes")], &[1, 2])
        .way(6, &[("power", "line")], &[1, 2]);
    let file = read(&osm);
    assert_eq!((ids(&file), file.found, file.attribution.is_some()), (vec!["way/7"], 1, true));
    let feature = &file.features[0];
    let tags: Vec<(&str, &str)> = feature.tags.iter().map(|(key, value)| (key.as_ref(), value.as_ref())).collect();
    assert_eq!(tags, [("bridge", "yes"), ("highway", "track"), ("name", "b")]);
    assert_eq!((feature.tag("highway"), feature.tag("width")), (Some("track"), None));
    let expected = Crs::wgs84().to(&Crs::from_epsg(32611).unwrap(), [-116.999, 35.0]).unwrap();
    assert_eq!((line(feature).len(), line(feature)[0]), (3, expected));
    let named = Wanted { keys: &["power"], ..WANTED };
    let folder = Folder::new();
    let file = read_features(&folder.write("a.osm.pbf", &osm.bytes()), &named, &in_turn).unwrap();
    assert_eq!(ids(&file), ["way/6"], "keys that the caller names");
}

#[test]
fn nodes_with_a_wanted_key_are_points_where_points_are_wanted() {
    let osm = grid().tagged(3, &[("man_made", "mast"), ("height", "40")]).tagged(5, &[("amenity", "bench")]).way(
        7,
        ROAD,
        &[1, 2, 3],
    );
    let folder = Folder::new();
    let path = folder.write("a.osm.pbf", &osm.bytes());
    assert_eq!(ids(&read_features(&path, &WANTED, &in_turn).unwrap()), ["way/7"]);
    let file = read_features(&path, &Wanted { points: true, ..WANTED }, &in_turn).unwrap();
    let mast = file.features.iter().find(|feature| feature.id == "node/3").unwrap();
    let expected = Crs::wgs84().to(&Crs::from_epsg(32611).unwrap(), [-116.997, 35.0]).unwrap();
    assert_eq!((file.features.len(), &mast.shape, mast.tag("height")), (2, &VectorShape::Point(expected), Some("40")));
    assert!(file.remarks.is_empty());
}

#[test]
fn another_system_is_refused_for_data_that_is_in_degrees() {
    let folder = Folder::new();
    let utm = Crs::from_epsg(32611).unwrap();
    let path = folder.write("a.osm.pbf", &grid().bytes());
    let error = read_features(&path, &Wanted { crs: Some(&utm), ..WANTED }, &in_turn).unwrap_err();
    assert!(matches!(error, SourceError::NoOtherCrs { .. }), "{error:?}");
}

#[test]
fn the_order_of_blocks_and_how_they_are_packed_change_nothing() {
    let osm = grid().way(7, ROAD, &[1, 2, 300]).way(3, ROAD, &[2, 12]).way(9, &[], &[21, 22, 32, 21]).relation(
        4,
        LAKE,
        &[(1, 9, "outer")],
    );
    let expected = read(&osm);
    assert_eq!(ids(&expected), ["relation/4", "way/3", "way/7"]);
    for packing in [Packing::None, Packing::Zlib, Packing::Zstd] {
        let [nodes, ways, relations] = osm.blocks(packing);
        for order in [[&nodes, &ways, &relations], [&relations, &ways, &nodes], [&ways, &relations, &nodes]] {
            let unknown = frame("Whatever", b"x", Packing::None);
            let found = read_bytes(&[&header(&[]), order[0], &unknown, order[1], order[2]].map(|b| &b[..]).concat());
            let found = found.unwrap();
            assert_eq!((found.features, found.remarks), (expected.features.clone(), expected.remarks.clone()));
        }
    }
}

#[test]
fn a_file_cut_short_anywhere_inside_a_block_is_an_error_that_names_the_place() {
    let osm = grid().way(7, ROAD, &[1, 2, 3]);
    let whole = osm.bytes();
    let first = header(&["OsmSchema-V0.6", "DenseNodes"]).len();
    let [nodes, ways, _] = osm.blocks(Packing::Zlib).map(|block| block.len());
    let borders = [first, first + nodes, first + nodes + ways, whole.len()];
    for end in 16..whole.len() {
        let found = read_bytes(&whole[..end]);
        assert_eq!(found.is_ok(), borders.contains(&end), "cut at {end}: {found:?}");
    }
    let error = read_bytes(&whole[..whole.len() - 1]).unwrap_err();
    let at = first + nodes + ways;
    let expected =
        format!("truncated: block 3 (byte {at}) ends at byte {}, the file at byte {}", whole.len(), whole.len() - 1);
    assert!(error.to_string().contains(&expected), "{error}");
    assert!(error.hint().unwrap().contains("fetch it again"));
}

#[test]
fn a_line_is_cut_where_its_nodes_are_missing_and_a_lake_is_joined_across() {
    let osm = grid()
        .way(1, ROAD, &[1, 2, 1000, 3, 4, 1001, 5])
        .way(2, ROAD, &[1000, 1, 1001])
        .way(3, LAKE, &[11, 12, 13, 23, 1000, 21, 11])
        .way(4, LAKE, &[11, 1000, 1001, 1002, 11])
        .way(5, ROAD, &[2000, 2001])
        .way(6, ROAD, &[1])
        .way(7, ROAD, &[]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["way/1.1", "way/1.2", "way/3"]);
    assert_eq!(rings(&file.features[2]), [6]);
    let mut found = remarks(&file);
    found.sort();
    assert_eq!(
        found,
        [
            "way/1: 2 of its 7 nodes not in the file (cut there)",
            "way/2: 2 of its 3 nodes not in the file (left out)",
            "way/3: 1 of its 7 nodes not in the file (joined across)",
            "way/4: 3 of its 5 nodes not in the file (left out)",
            "way/5: its first node (2000) is not in the file, and none of its others near the area (left out)",
            "way/6: fewer than 2 nodes (left out)",
            "way/7: no nodes (left out)",
        ]
    );
    let at = file.remarks.iter().find(|remark| remark.id == "way/1").unwrap().at.unwrap();
    assert!((at[0] - 500_091.0).abs() < 5.0, "told where: {at:?}");
}

#[test]
fn multipolygons_are_put_together_from_their_ways() {
    let osm = grid()
        .way(1, &[], &[11, 12, 13, 14, 24, 34])
        .way(2, &[], &[11, 21, 31, 41, 44, 34])
        .way(3, &[], &[22, 23, 33, 22])
        .way(4, &[], &[61, 62, 72, 61])
        .relation(5, LAKE, &[(1, 2, "outer"), (0, 1, "label"), (1, 3, "inner"), (1, 1, ""), (1, 4, "outer")])
        .relation(6, &[("type", "boundary"), ("natural", "water")], &[(1, 4, "outer")])
        .relation(7, &[("type", "multipolygon"), ("building", "yes")], &[(1, 4, "outer")]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["relation/5.1", "relation/5.2"]);
    assert_eq!((rings(&file.features[0]), rings(&file.features[1])), (vec![4], vec![11, 4]));
    assert_eq!(remarks(&file), [""; 0]);
}

#[test]
fn rings_whose_ways_meet_at_two_nodes_of_one_place_are_closed() {
    let mut osm = grid();
    let at = |osm: &Osm, id| osm.nodes.iter().find(|node| node.0 == id).unwrap().1;
    let twins = [(200, at(&osm, 11)), (201, at(&osm, 34)), (202, at(&osm, 22))];
    osm.nodes.extend(twins);
    let osm = osm
        .way(1, &[], &[11, 12, 13, 14, 24, 34])
        .way(2, &[], &[200, 21, 31, 41, 44, 201])
        .way(3, &[], &[22, 23, 33, 202])
        .relation(5, LAKE, &[(1, 1, "outer"), (1, 2, "outer"), (1, 3, "inner")]);
    let file = read(&osm);
    assert_eq!((ids(&file), rings(&file.features[0])), (vec!["relation/5"], vec![11, 4]));
    assert_eq!(remarks(&file), [""; 0]);
}

#[test]
fn buildings_are_read_apart_with_the_tags_of_their_heights_and_change_no_feature() {
    const HALL: &[(&str, &str)] = &[("type", "multipolygon"), ("building", "yes"), ("height", "12")];
    let osm = grid()
        .way(1, &[("building", "house"), ("addr:street", "x"), ("building:levels", "2")], &[1, 2, 12, 11, 1])
        .way(2, &[("building", "yes")], &[31, 36, 86, 81, 31])
        .way(3, &[], &[43, 44, 54, 53, 43])
        .way(4, &[("building", "yes"), ("natural", "water")], &[7, 8, 18, 17, 7])
        .way(5, ROAD, &[1, 2])
        .way(6, &[("building", "yes")], &[4, 5])
        .relation(9, HALL, &[(1, 2, "outer"), (1, 3, "inner")])
        .relation(8, LAKE, &[(1, 2, "outer")]);
    let plain = read(&osm);
    let folder = Folder::new();
    let path = folder.write("a.osm.pbf", &osm.bytes());
    let with = read_features(&path, &Wanted { buildings: true, ..WANTED }, &in_turn).unwrap();
    assert_eq!((&with.features, &with.remarks, with.found), (&plain.features, &plain.remarks, plain.found));
    assert!(plain.buildings.is_empty());
    let ids: Vec<&str> = with.buildings.iter().map(|building| building.id.as_str()).collect();
    assert_eq!(ids, ["relation/9", "way/1", "way/4", "way/6"], "the outline of a relation is read with it");
    assert_eq!((rings(&with.buildings[0]), with.buildings[0].tag("height")), (vec![7, 5], Some("12")));
    assert_eq!(with.buildings[1].tags.len(), 2, "no address is kept");
}

#[test]
fn multipolygons_without_an_outer_ring_or_with_open_ones_are_told() {
    let osm = grid()
        .way(1, &[], &[11, 12, 22, 11])
        .way(2, &[], &[31, 32, 42])
        .way(3, &[], &[51, 52, 62, 51])
        .relation(1, LAKE, &[(1, 1, "inner")])
        .relation(2, LAKE, &[(1, 2, "outer"), (1, 1, "inner")])
        .relation(3, LAKE, &[(1, 3, "outer"), (1, 99, "outer")])
        .relation(4, LAKE, &[(1, 3, "outer"), (1, 1, "inner")])
        .relation(5, LAKE, &[])
        .relation(6, LAKE, &[(1, 98, "outer"), (1, 99, "inner")]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["relation/3", "relation/4"]);
    assert_eq!(
        remarks(&file),
        [
            "relation/6: none of its 2 ways in the file (left out)",
            "relation/1: a multipolygon without an outer ring (left out)",
            "relation/2: an inner ring outside all outer rings (the ring left out)",
            "relation/2: 1 of its 2 ways in no closed ring (left out)",
            "relation/3: 1 of its 2 ways not in the file (its closed rings kept, the others left out)",
            "relation/4: an inner ring outside all outer rings (the ring left out)",
            "relation/5: a multipolygon without an outer ring (left out)",
        ]
    );
}

#[test]
fn an_outline_with_the_tags_of_its_relation_is_read_once() {
    let osm = grid()
        .way(1, &[("natural", "water")], &[11, 12, 22, 11])
        .way(2, &[("landuse", "grass")], &[31, 32, 42, 31])
        .relation(5, LAKE, &[(1, 1, "outer"), (1, 2, "outer")]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["relation/5.1", "relation/5.2", "way/2"]);
    assert_eq!(remarks(&file), ["way/1: the outline of a relation with the same tags (read once, with the relation)"]);
}

#[test]
fn ways_are_cut_at_the_bounds_and_found_though_no_node_is_near() {
    let mut osm = grid();
    // 19 km from node to node, across the area; and from the area to far away in steps.
    osm.nodes.extend([(200, [-117.104, 35.01]), (201, [-116.896, 35.01])]);
    osm.nodes.extend((1..40).map(|step| (300 + step, [-117.0 - 0.1 * step as f64, 35.02])));
    let steps: Vec<i64> = (301..340).collect();
    let osm = osm.way(1, ROAD, &[200, 201]).way(2, ROAD, &[&[11], &steps[..]].concat()).way(3, ROAD, &[338, 339]);
    let file = read(&osm);
    assert_eq!((ids(&file), file.found, file.outside), (vec!["way/1", "way/2"], 3, 1));
    let ends = |index: usize| {
        let places = line(&file.features[index]);
        [places[0][0], places[places.len() - 1][0]]
    };
    assert_eq!(ends(0), BOUNDS.east, "a cut lies exactly on the side");
    assert_eq!(ends(1)[1], BOUNDS.east[0]);
    assert_eq!(remarks(&file), [""; 0]);
}

#[test]
fn the_far_ways_of_a_relation_that_reaches_the_area_are_fetched() {
    let mut osm = grid();
    let far = |step: i64| (500 + step, [-117.0 - 0.1 * step as f64, 35.0 + 0.05 * (step % 2) as f64]);
    osm.nodes.extend((1..12).map(far));
    osm.nodes.extend((1..12).map(|step| (600 + step, [-117.0 - 0.1 * step as f64, 34.9])));
    let far: Vec<i64> = (501..512).collect();
    let back: Vec<i64> = [511].into_iter().chain((601..612).rev()).chain([12]).collect();
    let osm = osm.way(1, &[], &[&[12, 11], &far[..1]].concat()).way(2, &[], &far).way(3, &[], &back);
    let osm = osm.relation(9, LAKE, &[(1, 1, "outer"), (1, 2, "outer"), (1, 3, "outer")]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["relation/9"], "{:?}", file.remarks);
    let VectorShape::Polygon(rings) = &file.features[0].shape else { panic!("expected a polygon") };
    assert!(rings[0].places.iter().any(|place| place[0] == BOUNDS.east[0]), "it is cut at the bounds");
}

#[test]
fn nodes_off_the_earth_and_far_from_all_others_are_told() {
    let mut osm = grid();
    osm.nodes.extend([(200, [-117.0, 95.0]), (201, [-115.0, 35.0]), (202, [200.0, 35.0])]);
    let osm = osm
        .way(1, ROAD, &[1, 2, 200])
        .way(2, ROAD, &[1, 2, 201, 3, 4])
        .way(3, ROAD, &[202, 200])
        .way(4, LAKE, &[11, 12, 201, 22, 11])
        .way(5, ROAD, &[1, 201]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["way/2.1", "way/2.2", "way/4"]);
    assert_eq!(
        remarks(&file),
        [
            "way/1: its node 200 is not on the Earth (left out)",
            "way/2: its node 201 lies 188 km from the next (cut there)",
            "way/3: its node 202 is not on the Earth (left out)",
            "way/4: its node 201 lies 188 km from the next (joined across)",
            "way/5: its node 1 lies 188 km from the next (left out)",
        ]
    );
}

#[test]
fn a_file_whose_ways_all_lie_elsewhere_says_where() {
    let nodes = [(1, [8.0, 47.0]), (2, [8.1, 47.2])];
    let file = read(&Osm::new(&nodes).way(1, ROAD, &[1, 2]));
    assert_eq!((file.features.len(), file.found, file.outside), (0, 1, 1));
    let expected = "none of its 1 lines and polygons lies inside the area: they lie from 8.0000, 47.0000 to 8.1000, \
        47.2000 (EPSG:4326); the area and one load module round it from 495000, 3868000 to 505000, 3878000 \
        (EPSG:32611)";
    assert_eq!(file.notes, [expected]);
    assert_eq!(read(&grid()).notes, ["no line or polygon in the file"]);
}

#[test]
fn what_asks_for_too_much_or_cannot_be_unpacked_is_refused() {
    let refused = |frame: Vec<u8>| {
        let error = read_bytes(&[header(&[]), frame].concat()).unwrap_err();
        (error.to_string(), error.hint().unwrap())
    };
    let bomb = vec![0; (32 << 20) + 1];
    assert!(refused(frame("OSMData", &bomb, Packing::Zlib)).0.contains("bytes in a block once unpacked (or more)"));
    let torn = bytes(3, b"torn");
    assert!(refused(with_head("OSMData", &torn)).0.contains("data that cannot be unpacked"));
    let lies = [number(2, 5), bytes(1, b"1234567")].concat();
    assert!(refused(with_head("OSMData", &lies)).0.contains("7 bytes once unpacked, where it promises 5"));
    let (message, hint) = refused(with_head("OSMData", &bytes(4, b"x")));
    assert!(message.contains("OpenStreetMap data packed with LZMA, which is not read as features"), "{message}");
    assert!(hint.starts_with("rewrite it: osmium cat -o out.osm.pbf "), "{hint}");
    assert!(refused(with_head("OSMData", &[])).0.contains("a block without data"));
    let huge = [bytes(1, b"OSMData"), number(3, 1 << 40)].concat();
    let huge = [&(huge.len() as u32).to_be_bytes()[..], &huge].concat();
    assert!(refused(huge).0.contains("too large"));
    let history = read_bytes(&header(&["OsmSchema-V0.6", "HistoricalInformation"])).unwrap_err();
    assert!(history.to_string().contains("asks its readers for `HistoricalInformation`"), "{history}");
}

#[test]
fn unknown_kinds_of_members_and_wild_numbers_are_no_panic() {
    let osm = Osm::new(&[(i64::MAX, [-117.0, 35.0]), (i64::MIN, [-117.001, 35.0])])
        .way(i64::MIN, ROAD, &[i64::MAX, i64::MIN])
        .relation(-1, LAKE, &[(7, i64::MIN, "outer"), (1, i64::MAX, "x")]);
    let file = read(&osm);
    assert_eq!(ids(&file), ["way/-9223372036854775808"]);
    // A table of texts and a group that point beyond each other.
    let beyond = [number(1, 1), bytes(2, &[9]), bytes(3, &[9]), bytes(8, &[2])].concat();
    let block = frame("OSMData", &[bytes(1, &[]), bytes(2, &bytes(3, &beyond))].concat(), Packing::Zlib);
    let error = read_bytes(&[header(&[]), block].concat()).unwrap_err();
    assert!(error.to_string().contains("malformed: block 1 (byte "), "{error}");
    assert!(error.to_string().contains("is a text that is not in its table"), "{error}");
}

proptest! {
    #[test]
    fn no_handful_of_bytes_makes_the_reader_of_openstreetmap_data_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let osm = grid().way(1, ROAD, &[1, 2, 3]).way(2, &[], &[11, 12, 22, 11]).relation(3, LAKE, &[(1, 2, "outer")]);
        let blocks = osm.blocks(Packing::None).concat();
        let mut bytes = [header(&["OsmSchema-V0.6"]), blocks].concat();
        for (place, value) in changes {
            let place = place.index(bytes.len());
            bytes[place] = value;
        }
        let _ = read_bytes(&bytes);
    }
}
