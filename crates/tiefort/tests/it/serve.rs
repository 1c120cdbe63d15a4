//! `tiefort serve`: what programs ask, what they must not, and what happens while a database is built again.

use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use load_module_reader::{Area, Keep, LoadedGround, Sight};
use serde_json::{Value, json};

use crate::scene::{Scene, everything_below, send};
use crate::server::{ENOUGH, Server};

fn built() -> Scene {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    scene
}

fn served() -> Server {
    Server::start(built(), &["serve", "small.tdb", "--port", "0", "--assume-datum", "ellipsoid"])
}

/// 20 x 20 load modules: more than are read at once.
fn served_large() -> Server {
    let scene = Scene::with_job("small.toml", &[("size_m = [4000, 4000]", "size_m = [10000, 10000]")]);
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    Server::start(scene, &["serve", "small.tdb", "--port", "0"])
}

fn ground_of(server: &Server) -> LoadedGround {
    let area = Area::open(server.scene.path("small.tdb"), Keep::InMemory).unwrap();
    area.load(area.whole()).unwrap()
}

/// Places in and around a square, some of them on lines between load modules.
fn places(ground: &LoadedGround, count: usize) -> Vec<[f64; 2]> {
    let frame = ground.frame();
    let side_m = frame.side_m() * f64::from(frame.rows);
    let mut state: u64 = 7;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut metres = || match draw() {
        on_line if on_line < 0.2 => {
            (draw() * f64::from(frame.rows + 1)).floor() * frame.side_m() + (draw() - 0.5) * 1e-6
        }
        _ => (draw() * 1.1 - 0.05) * side_m,
    };
    (0..count).map(|_| [frame.origin_m[0] + metres(), frame.origin_m[1] + metres()]).collect()
}

#[test]
fn every_address_that_openapi_lists_is_answered_and_no_other() {
    let server = served();
    let document = server.get("/openapi.json").json();
    let example = |operation: &Value| operation["requestBody"]["content"]["application/json"]["example"].to_string();
    let mut count = 0;
    for (path, methods) in document["paths"].as_object().unwrap() {
        let tileset = server.get("/tileset.json").json();
        let square = &tileset["root"]["children"][0];
        let path = match path.as_str() {
            "/{database}/{z}/{x}/{file}" => "/small.tdb/0/0/0.terrain".to_owned(),
            "/{database}/squares/{file}" => format!("/small.tdb/{}", square["content"]["uri"].as_str().unwrap()),
            "/{database}/groups/{file}" => {
                format!("/small.tdb/{}", square["children"][0]["content"]["uri"].as_str().unwrap())
            }
            "/{database}/modules/{file}" => "/small.tdb/modules/r00c01.slm".to_owned(),
            "/{database}/explain" => "/small.tdb/explain?module=3,4".to_owned(),
            "/{database}/viewshed" => "/small.tdb/viewshed?from=507000,3876500,20&range_m=600".to_owned(),
            "/{database}/obstacle" => "/small.tdb/obstacle?at=507000,3876500,0&radius_m=2".to_owned(),
            "/{database}/profile" => "/small.tdb/profile?from=506000,3876000&to=507000,3876000".to_owned(),
            path => path.replace("{database}", "small.tdb"),
        };
        for (method, operation) in methods.as_object().unwrap() {
            let answer = match method.as_str() {
                "get" => server.get(&path),
                _ => server.post(&path, &example(operation)),
            };
            // There are neither holes nor coarser levels in this area.
            let expected = if path.contains("holes") || path.contains("levels") { 404 } else { 200 };
            assert_eq!(answer.status, expected, "{method} {path}: {}", answer.text());
            let kinds = operation["responses"]["200"]["content"].as_object().unwrap();
            assert!(
                expected == 404 || kinds.contains_key(answer.header("content-type")),
                "{path}: {:?}",
                answer.headers
            );
            assert!(operation["responses"].get(expected.to_string()).is_some(), "{path}: {expected}");
            count += 1;
        }
    }
    assert_eq!(count, 17);
    assert_eq!(server.get("/small.tdb/").json()["load_modules"], json!([8, 8]));
    for (path, part) in [("/", "small.tdb"), ("/docs", "line-of-sight")] {
        let page = server.get(path);
        assert!(page.status == 200 && page.text().contains(part), "{}", page.text());
        for elsewhere in ["http://", "https://", "src=", "<script"] {
            assert!(!page.text().contains(elsewhere), "{path} loads from elsewhere: {elsewhere}");
        }
    }
    for path in ["/nothing", "/other.tdb/layer.json", "/small.tdb/9/9/9.terrain", "/small.tdb/0/0/00.terrain"] {
        server.get(path).check_refusal(404, &["found"]);
    }
    for path in ["/small.tdb/modules/..%2Fdatabase.json", "/../database.json", "/small.tdb/modules/r0008c0000.slm"] {
        server.get(path).check_refusal(404, &["found"]);
    }
    server.get("/heights").check_refusal(405, &["found GET, expected POST"]);
}

/// Every file of an export, by its name in it.
fn exported(server: &Server, format: &str) -> BTreeMap<String, Vec<u8>> {
    let mut arguments = vec!["export", "small.tdb", "--format", format, "--out", format, "--quiet"];
    if format != "modules" {
        arguments.extend(["--assume-datum", "ellipsoid"]);
    }
    server.scene.run_to(0, &arguments);
    let folder = server.scene.path(format);
    let name = |path: PathBuf| path.strip_prefix(&folder).unwrap().to_str().unwrap().to_owned();
    everything_below(&folder).into_iter().filter_map(|(path, bytes)| Some((name(path), bytes?))).collect()
}

#[test]
fn what_is_handed_out_has_the_bytes_of_the_export() {
    let server = served();
    for (format, folder) in [("quantized-mesh", ""), ("3dtiles", ""), ("modules", "modules/")] {
        let files = exported(&server, format);
        assert!(2 < files.len());
        for (name, bytes) in files {
            let answer = server.get(&format!("/small.tdb/{folder}{name}"));
            assert!(answer.status == 200 && answer.body == bytes, "{name}: {}", answer.status);
            let expected = match name.rsplit('.').next().unwrap() {
                "terrain" => "application/vnd.quantized-mesh",
                "glb" => "model/gltf-binary",
                "slm" => "application/octet-stream",
                _ => "application/json",
            };
            assert_eq!(answer.header("content-type"), expected, "{name}");
        }
    }
}

#[test]
fn contents_have_a_name_come_packed_and_in_parts() {
    let server = served();
    let path = "/small.tdb/modules/r00c01.slm";
    let file = fs::read(server.scene.path("small.tdb/modules/r00c01.slm")).unwrap();
    let whole = server.get(path);
    assert!(whole.body == file && whole.header("accept-ranges") == "bytes");
    let tag = whole.header("etag").to_owned();
    // The name is the checksum that the database has of the file.
    let listed = server.get("/modules").json();
    let listed = listed["files"].as_array().unwrap().iter().find(|file| file["name"] == "r00c01.slm").unwrap();
    assert!(listed["blake3"].as_str().unwrap().starts_with(tag.trim_matches('"')) && 30 < tag.len());
    let known = server.ask("GET", path, &[&format!("If-None-Match: {tag}")], &[]);
    assert_eq!((known.status, known.body.len(), known.header("etag")), (304, 0, tag.as_str()));
    let part = server.ask("GET", path, &["Range: bytes=10-19"], &[]);
    assert_eq!((part.status, part.body.as_slice()), (206, &file[10..20]));
    assert_eq!(part.header("content-range"), format!("bytes 10-19/{}", file.len()));
    let last = server.ask("GET", path, &["Range: bytes=-4", &format!("If-Range: {tag}")], &[]);
    assert_eq!((last.status, last.body.as_slice()), (206, &file[file.len() - 4..]));
    let other = server.ask("GET", path, &["Range: bytes=0-3", "If-Range: \"another\""], &[]);
    assert_eq!((other.status, other.body.len()), (200, file.len()));
    let beyond = server.ask("GET", path, &[&format!("Range: bytes={}-", file.len())], &[]);
    beyond.check_refusal(416, &["bytes"]);
    assert_eq!(beyond.header("content-range"), format!("bytes */{}", file.len()));
    let head = server.ask("HEAD", path, &[], &[]);
    assert_eq!(
        (head.status, head.header("content-length"), head.body.len()),
        (200, file.len().to_string().as_str(), 0)
    );

    let tile = "/0/0/0.terrain";
    let plain = server.get(tile);
    let packed = server.ask("GET", tile, &["Accept-Encoding: gzip"], &[]);
    assert_eq!((packed.status, packed.header("content-encoding")), (200, "gzip"));
    assert_eq!(packed.header("content-type"), "application/vnd.quantized-mesh");
    assert_eq!(packed.header("etag"), format!("W/{}", plain.header("etag")));
    assert!(packed.header("vary").to_ascii_lowercase().contains("accept-encoding"), "{:?}", packed.headers);
    let mut unpacked = Vec::new();
    flate2::read::GzDecoder::new(packed.body.as_slice()).read_to_end(&mut unpacked).unwrap();
    assert!(packed.body.len() < plain.body.len() && unpacked == plain.body);
    for tag in [plain.header("etag"), packed.header("etag")] {
        assert_eq!(server.ask("GET", tile, &[&format!("If-None-Match: {tag}")], &[]).status, 304);
    }
}

#[test]
fn heights_and_lines_of_sight_are_those_of_the_reader() {
    let server = served_large();
    let ground = ground_of(&server);
    let places = places(&ground, 5000);
    let expected: Vec<f64> = places.iter().map(|&place| ground.height_m(place).unwrap_or(f64::NAN)).collect();
    let same = |a: &f64, b: &f64| a == b || a.is_nan() && b.is_nan();
    let found = server.post_raw("/heights", &places.concat());
    let wrong = (0..places.len()).find(|&index| !same(&found[index], &expected[index]));
    assert_eq!(wrong.map(|index| (places[index], found[index], expected[index])), None);
    assert!(expected.iter().any(|height| height.is_nan()) && expected.iter().any(|height| height.is_finite()));
    let answer = server.post("/small.tdb/heights", &json!({ "positions": places }).to_string()).json();
    let found: Vec<f64> =
        answer["heights"].as_array().unwrap().iter().map(|h| h.as_f64().unwrap_or(f64::NAN)).collect();
    assert!(found.iter().zip(&expected).all(|(a, b)| same(a, b)));
    // Under a ceiling below all ground there is nothing.
    let none = server.post("/heights", &json!({ "positions": places, "ceiling": -1000 }).to_string()).json();
    assert!(none["heights"].as_array().unwrap().iter().all(Value::is_null));

    let ends: Vec<[f64; 3]> =
        places.iter().zip(&expected).take(600).map(|(place, height)| [place[0], place[1], height + 30.0]).collect();
    let lines: Vec<[f64; 6]> = ends
        .chunks_exact(2)
        .filter(|ends| ends.iter().all(|end| end[2].is_finite()))
        .map(|ends| [ends[0][0], ends[0][1], ends[0][2], ends[1][0], ends[1][1], ends[1][2]])
        .collect();
    let answer = server.post("/line-of-sight", &json!({ "lines": lines }).to_string()).json();
    let raw = server.post_raw("/line-of-sight", &lines.concat());
    let mut seen = [0, 0];
    for ((line, answer), raw) in lines.iter().zip(answer["lines"].as_array().unwrap()).zip(raw.chunks_exact(5)) {
        let (from, to) = ([line[0], line[1], line[2]], [line[3], line[4], line[5]]);
        let clearance = ground.clearance_m(from, to);
        let (visible, at) = match ground.sight(from, to) {
            Sight::Free => (true, None),
            Sight::Hidden(share) => (false, Some(share)),
            // It begins on the area's side, a micrometre beyond.
            Sight::Unknown => {
                assert!(answer["visible"].is_null() && raw[0].is_nan());
                continue;
            }
        };
        assert_eq!((answer["visible"].as_bool(), answer["blocked_at"].as_f64()), (Some(visible), at), "{line:?}");
        assert_eq!(answer["clearance_m"].as_f64(), clearance);
        assert_eq!(answer["blocker"].is_null(), visible);
        let hider = if visible { f64::NAN } else { 0.0 };
        assert_eq!(answer["hidden_by"].as_str(), (!visible).then_some("ground"));
        assert_eq!((answer["transmission"].as_f64(), answer["wood_m"].as_f64()), (Some(1.0), Some(0.0)));
        let [at, clearance] = [at, clearance].map(|number| number.unwrap_or(f64::NAN));
        let numbers = [f64::from(u8::from(visible)), at, clearance, hider, 1.0];
        assert!(raw.iter().zip(&numbers).all(|(a, b)| same(a, b)), "{raw:?} is not {numbers:?}");
        seen[usize::from(visible)] += 1;
    }
    assert!(20 < seen[0] && 20 < seen[1], "{seen:?}");
    let outside = server.post("/line-of-sight", r#"{"lines": [[0, 0, 1, 1e9, 5, 2]]}"#).json();
    assert_eq!(outside["lines"][0]["visible"], Value::Null);
}

/// A house beside a line of sight, a wall along the next, a wood over the third.
const OBJECTS: &str = r#"{"type": "FeatureCollection",
    "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32611"}}, "features": [
    {"type": "Feature", "properties": {"building": "yes", "height": "30"}, "geometry": {"type": "Polygon",
        "coordinates": [[[505600, 3875600], [505620, 3875600], [505620, 3875620], [505600, 3875620],
        [505600, 3875600]]]}},
    {"type": "Feature", "properties": {"natural": "wood", "height": "25"}, "geometry": {"type": "Polygon",
        "coordinates": [[[505600, 3875700], [505606, 3875700], [505606, 3875900], [505600, 3875900],
        [505600, 3875700]], [[505610, 3875710], [505620, 3875710], [505620, 3875720], [505610, 3875710]]]}}]}"#;

#[test]
fn lines_of_sight_and_viewsheds_look_past_objects_as_the_command_does() {
    let scene = Scene::with_job("small.toml", &[]);
    let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
    std::fs::write(scene.path("town.geojson"), OBJECTS).unwrap();
    let sections = "[features]\nsources = [\"town.geojson\"]\n[objects]\n";
    std::fs::write(scene.path("job.toml"), format!("{job}\n{sections}")).unwrap();
    scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    let server = Server::start(scene, &["serve", "small.tdb", "--port", "0"]);
    let lines = [
        [505_590.0, 3_875_610.0, 3.0, 505_640.0, 3_875_610.0, 3.0],
        [505_590.0, 3_875_800.0, 3.0, 505_640.0, 3_875_800.0, 3.0],
    ];
    for (objects, expected) in
        [("none", [None, None]), ("buildings", [Some("building"), None]), ("all", [Some("building"), Some("wood")])]
    {
        let body = json!({ "lines": lines, "objects": objects, "above_ground": true }).to_string();
        let answer = server.post("/line-of-sight", &body).json();
        for ((line, answer), by) in lines.iter().zip(answer["lines"].as_array().unwrap()).zip(expected) {
            assert_eq!(answer["hidden_by"].as_str(), by, "{objects}: {answer}");
            let [from, to] = [&line[..3], &line[3..]].map(|end| format!("{},{},{}", end[0], end[1], end[2]));
            let words = ["sight", "small.tdb", "--from", &from, "--to", &to, "--objects", objects];
            let said = server.scene.run_to(0, &words).stdout;
            let told = by.map_or("visible".to_owned(), |by| format!("hidden by {by}, first"));
            let clearance = format!("clearance  {:.2} m", answer["clearance_m"].as_f64().unwrap());
            assert!(said.starts_with(&told) && said.contains(&clearance), "{answer}: {said}");
            let height = format!("at {:.2} m", answer["ends"][0][2].as_f64().unwrap());
            assert!(said.contains(&height), "{height}: {said}");
        }
        let path = format!("/viewshed?from=505590,3875610,3&target_m=3&range_m=50&spacing_m=5&objects={objects}");
        let seen = server.get(&path).body;
        let side = 21;
        assert_eq!((seen.len(), &seen[..4]), (8 + 2 * side * side, &(side as u32).to_le_bytes()[..]));
        // 50 m to the east, behind the house.
        assert_eq!(seen[8 + side * (side / 2) + side - 1], u8::from(objects == "none"), "{objects}");
    }
    let curved = json!({ "lines": [lines[1]], "above_ground": true, "curvature": true }).to_string();
    let curved = server.post("/line-of-sight", &curved).json()["lines"][0]["transmission"].as_f64().unwrap();
    assert!(0.2 < curved && curved < 0.3, "6 m of a wood leave a quarter of the light: {curved}");
    let profile = server.get("/profile?from=505590,3875610&to=505640,3875610&spacing_m=10&objects=all").json();
    assert_eq!(profile["height_m"].as_array().unwrap().len(), 6);
    assert_eq!(profile["top_of"], json!(["ground", "building", "building", "ground", "ground", "ground"]));
    let places = json!([[505_590, 3_875_610], [505_610, 3_875_610], [505_603, 3_875_800]]);
    for (objects, of) in [("all", ["ground", "building", "wood"]), ("buildings", ["ground", "building", "ground"])] {
        let tops = server.post("/heights", &json!({ "positions": places, "objects": objects }).to_string()).json();
        assert_eq!(tops["top_of"], json!(of), "{tops}");
    }
    let hit = |at: &str| server.get(&format!("/obstacle?at={at},0&radius_m=2")).json()["obstacle"].clone();
    assert_eq!(hit("505599,3875610")["kind"], "building");
    assert_eq!((&hit("505603,3875800")["kind"], &hit("505603,3875800")["spacing_m"]), (&json!("wood"), &json!(4.0)));
    assert_eq!(hit("505590,3875610"), Value::Null);
}

#[test]
fn what_cannot_be_read_is_refused_in_words() {
    let server = served();
    for (body, part) in [
        ("", "EOF"),
        ("{", "EOF"),
        (r#"{"positions": [[1, 2]"#, "line 1"),
        (r#"{"positions": [[1, NaN]]}"#, "line 1 column"),
        (r#"{"positions": [[1, 1e999]]}"#, "number out of range"),
        (r#"{"positions": [[1, "2"]]}"#, "invalid type"),
        (r#"{"positions": [[1]]}"#, "invalid length 1"),
        (r#"{"positions": [[1, 2]], "hight": 3}"#, "unknown field `hight`"),
        (r#"{"places": []}"#, "unknown field `places`"),
        ("[[1, 2]]", "expected"),
    ] {
        server.post("/heights", body).check_refusal(400, &["found", "expected", part]);
    }
    server.post("/heights", &"[".repeat(100_000)).check_refusal(400, &["found"]);
    server.post("/heights", r#"{"positions": [], "level": 1}"#).check_refusal(400, &["found level 1, expected 0"]);
    server.post("/line-of-sight", r#"{"lines": [[1, 2, 3]]}"#).check_refusal(400, &["invalid length 3"]);
    server.ask("POST", "/heights", &["Content-Type: text/xml"], b"<a/>").check_refusal(415, &["text/xml"]);
    let raw = ["Content-Type: application/octet-stream"];
    server.ask("POST", "/heights", &raw, &[0; 24]).check_refusal(400, &["24 bytes", "multiple of 16"]);
    server.ask("POST", "/line-of-sight", &raw, &[0; 8]).check_refusal(400, &["multiple of 48"]);
    server.post("/heights?hight=3", "{}").check_refusal(400, &["hight"]);
    for asked in ["/heights?level=1", "/heights?ceiling=9"] {
        server.post(asked, r#"{"positions": []}"#).check_refusal(400, &["found a level or more", "in the JSON"]);
    }
    server.post("/line-of-sight?objects=none", r#"{"lines": []}"#).check_refusal(400, &["in the JSON"]);
    server.post("/line-of-sight", "{}").check_refusal(400, &["found no lines"]);
    server
        .post("/line-of-sight", r#"{"lines": [], "objects": "some"}"#)
        .check_refusal(400, &["none, buildings or all"]);
    server.post("/line-of-sight", r#"{"lines": [], "round": true}"#).check_refusal(400, &["unknown field `round`"]);
    for (asked, part) in [
        ("/viewshed?from=507000,3876500&range_m=9", "EAST,NORTH,ABOVE"),
        ("/viewshed?from=1,2,3&range_m=9", "where there is no ground"),
        ("/viewshed?from=507000,3876500,2&range_m=0", "range_m=0"),
        ("/viewshed?from=507000,3876500,2&range_m=9&target_m=-1", "target_m=-1"),
        ("/viewshed?from=507000,3876500,2&range_m=9&objects=some", "none, buildings or all"),
        ("/viewshed?from=507000,3876500,2&range_m=900000&spacing_m=1", "places along a side"),
        ("/viewshed?from=507000,3876500,2&range_m=9&level=3", "found level 3"),
        ("/profile?from=506000,3876000&to=507000,3876000&spacing_m=0", "spacing_m=0"),
        ("/profile?from=506000,3876000&to=507000,3876000&spacing_m=0.001", "steps"),
        ("/profile?from=506000,3876000&to=1,2", "to: found 1,2"),
        ("/obstacle?at=506000,3876000,0&radius_m=-1", "radius_m=-1"),
        ("/obstacle?at=1,2,0&radius_m=1", "at: found 1,2"),
    ] {
        server.get(asked).check_refusal(400, &["found", part]);
    }
    // Raw numbers that are no places are answered with what is none.
    let strange = [f64::NAN, 1.0, f64::INFINITY, 1.0, 1.0, f64::NEG_INFINITY, 1e300, -1e300];
    assert!(server.post_raw("/heights", &strange).iter().all(|height| height.is_nan()));
    let strange = [[f64::NAN; 6], [f64::INFINITY; 6], [1e300; 6]].concat();
    assert!(server.post_raw("/line-of-sight", &strange).iter().all(|number| number.is_nan()));
    for (path, part) in [
        ("/explain", "neither"),
        ("/explain?module=1,2&at=3,4", "both"),
        ("/explain?module=a", "module=a"),
        ("/explain?at=nan", "at=nan"),
    ] {
        server.get(path).check_refusal(400, &[part, "expected module=ROW,COL"]);
    }
    for path in ["/explain?module=8,0", "/explain?at=0,0", "/explain?at=nan,nan"] {
        server.get(path).check_refusal(404, &["expected"]);
    }
}

#[test]
fn a_body_that_is_too_large_or_too_slow_is_refused_before_it_is_read() {
    let limits = ["--max-body", "1", "--request-seconds", "2"];
    let server = Server::start(built(), &[&["serve", "small.tdb", "--port", "0"][..], &limits].concat());
    let start = Instant::now();
    let told = server.ask("POST", "/heights", &["Content-Length: 1073741824"], &[]);
    told.check_refusal(413, &["found a body of 1073741824 bytes, expected at most 1048576"]);
    assert!(start.elapsed() < Duration::from_secs(2));
    // Of unknown length: 2 MiB in pieces.
    let piece = format!("10000\r\n{}\r\n", " ".repeat(0x10000)).repeat(32);
    let mut stream = server.connect();
    let head = format!("POST /heights HTTP/1.1\r\nHost: {}\r\nTransfer-Encoding: chunked\r\n\r\n", server.host);
    let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(piece.as_bytes()));
    let mut answer = [0; 12];
    stream.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 413");
    let mut slow = server.connect();
    write!(slow, "POST /heights HTTP/1.1\r\nHost: {}\r\nContent-Length: 100\r\n\r\n{{", server.host).unwrap();
    let start = Instant::now();
    slow.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 408");
    assert!(Duration::from_secs(1) < start.elapsed() && start.elapsed() < ENOUGH);
    assert_eq!(server.get("/layer.json").status, 409, "heights above an unknown datum");
}

#[test]
fn slow_clients_neither_keep_others_waiting_nor_stay() {
    let server = Server::start(built(), &["serve", "small.tdb", "--port", "0", "--max-clients", "64"]);
    let begun = |text: &str| {
        let mut stream = server.connect();
        stream.write_all(text.as_bytes()).unwrap();
        stream
    };
    let texts = ["", "G", "GET / HTTP/1.1\r\nHost: ", "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nA: "];
    let mut clients: Vec<TcpStream> = (0..400).map(|i| begun(texts[i % texts.len()])).collect();
    let start = Instant::now();
    assert_eq!(server.get("/databases.json").status, 200);
    assert!(start.elapsed() < Duration::from_secs(3), "an answer after {:?}", start.elapsed());
    // The newest client sends on, a byte at a time; it is ended as the others are.
    let last = clients.last_mut().unwrap();
    last.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let is_open = |stream: &mut TcpStream| {
        let read = stream.write_all(b"a").and_then(|()| stream.read(&mut [0; 256]));
        // Nothing to read within the time; an answer, an end or an error is an end.
        matches!(read, Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut))
    };
    while is_open(last) {
        assert!(start.elapsed() < ENOUGH, "a slow client is still connected");
    }
    for client in &mut clients {
        let mut rest = Vec::new();
        let waited = matches!(client.read_to_end(&mut rest), Err(error) if error.kind() == ErrorKind::WouldBlock);
        assert!(!waited, "a client that sends nothing is still connected");
    }
}

#[test]
fn clients_that_do_not_read_make_place_for_others() {
    let server = Server::start(built(), &["serve", "small.tdb", "--port", "0", "--max-clients", "32"]);
    let ask = || {
        let mut stream = server.connect();
        // More answers than sockets hold, none of them read.
        let requests =
            format!("GET /small.tdb/modules/r00c00.slm HTTP/1.1\r\nHost: {}\r\n\r\n", server.host).repeat(150);
        let _ = stream.set_write_timeout(Some(Duration::from_secs(1)));
        let _ = stream.write_all(requests.as_bytes());
        stream
    };
    let clients: Vec<TcpStream> = (0..50).map(|_| ask()).collect();
    let start = Instant::now();
    // While all places have an answer in the making, others are told to come again; a busy machine takes longer.
    loop {
        let answer = server.get("/databases.json");
        if answer.status == 200 {
            break;
        }
        answer.check_refusal(503, &["found all places taken", "expected a free one"]);
        assert!(answer.text().contains("--max-clients"), "{}", answer.text());
        assert_eq!(answer.header("retry-after"), "1");
        assert!(start.elapsed() < ENOUGH, "no answer after {:?}", start.elapsed());
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(clients);
}

#[test]
fn a_request_that_is_too_long_is_refused() {
    let server = served();
    let answer = server.ask("GET", "/", &[&format!("A: {}", "a".repeat(1 << 16))], &[]);
    assert!((400..500).contains(&answer.status), "{}", answer.status);
    assert_eq!(server.get("/databases.json").status, 200);
}

#[test]
fn a_file_that_is_damaged_or_of_another_build_is_not_handed_out() {
    let server = served();
    let (path, other) = ("/modules/r00c00.slm", "/modules/r00c01.slm");
    let on_disk = server.scene.path("small.tdb/modules/r00c00.slm");
    let sound = fs::read(&on_disk).unwrap();
    let tag = server.get(path).header("etag").to_owned();
    let heights = r#"{"positions": [[505010, 3875010]]}"#;
    let mut damaged = sound.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    // Sound, but of another build.
    let job = fs::read_to_string(server.scene.path("job.toml")).unwrap();
    let job = job.replace("mean_per_load_module = 32", "mean_per_load_module = 20");
    fs::write(server.scene.path("other.toml"), job).unwrap();
    server.scene.run_to(0, &["build", "other.toml", "--out", "other.tdb", "--quiet", "--no-html"]);
    let of_another_build = fs::read(server.scene.path("other.tdb/modules/r00c00.slm")).unwrap();
    for (bytes, part) in [(damaged, ""), (of_another_build, "not of the build"), (sound[..100].to_vec(), "")] {
        fs::write(&on_disk, &bytes).unwrap();
        for answer in [
            server.get(path),
            server.ask("GET", path, &["Range: bytes=0-9"], &[]),
            server.get("/modules/r0000c0000.slm"),
            server.post("/heights", heights),
        ] {
            answer.check_refusal(503, &["r00c00.slm", part]);
        }
        // What a client has already is what the build left.
        assert_eq!(server.ask("GET", path, &[&format!("If-None-Match: {tag}")], &[]).status, 304);
        assert_eq!(server.get(other).status, 200);
    }
    fs::write(&on_disk, &sound).unwrap();
    assert_eq!((server.get(path).status, server.get(path).body), (200, sound));
    assert_eq!(server.post("/heights", heights).status, 200);
}

#[test]
fn a_database_that_is_built_again_is_opened_again_and_nothing_is_mixed() {
    let server = served();
    let before = server.get("/").text();
    let tags: Vec<String> =
        ["/modules/r00c00.slm", "/layer.json"].map(|path| server.get(path).header("etag").to_owned()).to_vec();
    let places = places(&ground_of(&server), 500);
    let heights = server.post_raw("/heights", &places.concat());
    // Gone, and back: nothing is answered from what is not there.
    let (record, away) = (server.scene.path("small.tdb/database.json"), server.scene.path("away.json"));
    fs::rename(&record, &away).unwrap();
    for path in ["/layer.json", "/modules/r00c00.slm", "/small.tdb", "/explain?module=1,1"] {
        let answer = server.get(path);
        answer.check_refusal(503, &["small.tdb"]);
        assert!(!answer.header("retry-after").is_empty());
    }
    server.post("/heights", r#"{"positions": [[1, 2]]}"#).check_refusal(503, &["small.tdb"]);
    assert_eq!(server.get("/databases.json").json()["databases"][0]["name"], "small.tdb");
    assert_eq!(server.get("/").status, 200);
    fs::write(&record, &fs::read(&away).unwrap()[..100]).unwrap();
    server.get("/layer.json").check_refusal(503, &["database.json"]);
    fs::rename(&away, &record).unwrap();
    assert_eq!(server.get("/").text(), before);
    // Built again from another job, below the server.
    let job = fs::read_to_string(server.scene.path("job.toml")).unwrap();
    let job = job.replace("mean_per_load_module = 32", "mean_per_load_module = 20");
    fs::write(server.scene.path("job.toml"), job).unwrap();
    server.scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
    let ground = ground_of(&server);
    let expected: Vec<f64> = places.iter().map(|&place| ground.height_m(place).unwrap_or(f64::NAN)).collect();
    let after = server.post_raw("/heights", &places.concat());
    assert!(after.iter().zip(&expected).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
    assert!(after.iter().zip(&heights).any(|(a, b)| a.is_finite() && a != b), "another mesh has other heights");
    for (path, tag) in ["/modules/r00c00.slm", "/layer.json"].iter().zip(&tags) {
        let answer = server.ask("GET", path, &[&format!("If-None-Match: {tag}")], &[]);
        assert!(answer.status == 200 && answer.header("etag") != tag, "{path}: {}", answer.status);
    }
    let files = exported(&server, "quantized-mesh");
    assert!(files.iter().all(|(name, bytes)| server.get(&format!("/{name}")).body == *bytes));
}

#[test]
fn several_databases_have_an_address_each() {
    let scene = built();
    let copy = |to: &str| {
        for (path, bytes) in everything_below(&scene.path("small.tdb")) {
            let to = scene.path(to).join(path.strip_prefix(scene.path("small.tdb")).unwrap());
            if let Some(bytes) = bytes {
                fs::create_dir_all(to.parent().unwrap()).unwrap();
                fs::write(to, bytes).unwrap();
            }
        }
    };
    copy("a b+ü.tdb");
    copy("other/small.tdb");
    scene.refuses(&["serve", "small.tdb", "other/small.tdb"], &["small.tdb", "second folder"]);
    scene.refuses(&["serve", "none.tdb", "--port", "0"], &["none.tdb"]);
    scene.refuses(&["serve", "other", "--port", "0"], &["other"]);
    scene.refuses(&["serve", "small.tdb", "--host", "192.0.2.1"], &["192.0.2.1", "cannot be served"]);
    for wrong in [["--cors", "example.org"], ["--cors", "https://a/b"], ["--host", "nowhere"], ["--max-body", "0"]] {
        scene.run_to(2, &["serve", "small.tdb", wrong[0], wrong[1]]);
    }
    let server = Server::start(scene, &["serve", "small.tdb", "a b+ü.tdb", "--port", "0", "--assume-datum", "EGM96"]);
    let port = server.host.rsplit(':').next().unwrap();
    server.scene.refuses(&["serve", "small.tdb", "--port", port], &[port, "cannot be served"]);
    let listed = server.get("/databases.json").json();
    let paths: Vec<&str> =
        listed["databases"].as_array().unwrap().iter().map(|database| database["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["/a%20b%2B%C3%BC.tdb", "/small.tdb"]);
    for path in paths {
        assert_eq!(server.get(&format!("{path}/layer.json")).status, 200, "{path}");
    }
    server.get("/layer.json").check_refusal(404, &["layer.json", "expected one of a b+ü.tdb, small.tdb"]);
}

#[test]
fn only_this_machine_and_the_origins_that_were_named_may_ask() {
    let server = served();
    server.ask("GET", "/", &["Host: example.org"], &[]).check_refusal(403, &["example.org"]);
    assert_eq!(server.ask("GET", "/", &["Origin: https://example.org"], &[]).header("access-control-allow-origin"), "");
    let cors = ["serve", "small.tdb", "--port", "0", "--cors", "https://example.org"];
    let server = Server::start(built(), &cors);
    let allowed = |origin: &str, method: &str| {
        let head = [format!("Origin: {origin}"), "Access-Control-Request-Method: POST".to_owned()];
        let answer = server.ask(method, "/heights", &[&head[0], &head[1]], &[]);
        answer.header("access-control-allow-origin").to_owned()
    };
    assert_eq!(allowed("https://example.org", "OPTIONS"), "https://example.org");
    assert_eq!(allowed("https://example.org", "POST"), "https://example.org");
    assert_eq!(allowed("https://example.com", "OPTIONS"), "");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_in_order_from_the_moment_its_address_is_told() {
    for signal in ["-INT", "-TERM", "-INT", "-TERM"] {
        let mut server = served();
        send(signal, server.process.id());
        assert_eq!(server.process.wait().unwrap().code(), Some(0), "{signal}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_within_a_second_with_clients_connected() {
    for signal in ["-INT", "-TERM"] {
        let mut server = served();
        let mut idle = server.connect();
        idle.write_all(b"GET / HTTP/1.1\r\n").unwrap();
        let start = Instant::now();
        send(signal, server.process.id());
        assert_eq!(server.process.wait().unwrap().code(), Some(0));
        // One second is asked for; a machine at its limits is allowed a little more.
        assert!(start.elapsed() < Duration::from_millis(2500), "{signal}: {:?}", start.elapsed());
    }
}
