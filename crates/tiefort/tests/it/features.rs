//! Roads, rivers and lakes in a job: what `init` finds and writes, and what `plan` tells of them.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::scene::{Scene, hills};

/// A scene with `dem.asc`, 2 km x 2 km of EPSG:32611 from 506000 E, 3876000 N.
fn scene() -> Scene {
    let scene = Scene::new();
    let row = |row: usize| (0..81).map(|col| hills(row, col) + " ").collect::<String>() + "\n";
    let head = "ncols 81\nnrows 81\nxllcenter 506000\nyllcenter 3876000\ncellsize 25\n";
    fs::write(scene.path("dem.asc"), head.to_owned() + &(0..81).map(row).collect::<String>()).unwrap();
    scene
}

/// GeoJSON of lines, each by its tags and how many kilometres east of the middle of the area it lies.
fn lines(all: &[(&str, f64)]) -> String {
    let line = |(tags, east_km): &(&str, f64)| {
        let west = -116.923 + east_km * 0.011;
        let geometry = format!("\"type\":\"LineString\",\"coordinates\":[[{west},35.03],[{},35.04]]", west + 0.002);
        format!("{{\"type\":\"Feature\",\"properties\":{{{tags}}},\"geometry\":{{{geometry}}}}}")
    };
    let all: Vec<String> = all.iter().map(line).collect();
    format!("{{\"type\":\"FeatureCollection\",\"features\":[{}]}}", all.join(","))
}

const ROADS: [(&str, f64); 5] = [
    ("\"highway\":\"track\"", 0.0),
    ("\"highway\":\"track\",\"surface\":\"sand\"", 0.3),
    ("\"highway\":\"primary\",\"lanes\":\"2\"", -0.3),
    ("\"natural\":\"coastline\"", 0.1),
    ("\"highway\":\"track\"", 80.0),
];

/// A GeoPackage in EPSG:32611 whose layers hold a square each, at these kilometres east of the area's middle.
fn package(path: &Path, layers: &[(&str, &[f64])]) {
    let database = rusqlite::Connection::open(path).unwrap();
    let tables =
        "CREATE TABLE gpkg_spatial_ref_sys (srs_id INTEGER, organization TEXT, organization_coordsys_id INTEGER);
        CREATE TABLE gpkg_geometry_columns (table_name TEXT, column_name TEXT, srs_id INTEGER);
        INSERT INTO gpkg_spatial_ref_sys VALUES (32611, 'EPSG', 32611);";
    database.execute_batch(tables).unwrap();
    for (name, squares) in layers {
        database.execute("INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', 32611)", [name]).unwrap();
        database.execute_batch(&format!("CREATE TABLE \"{name}\" (fid INTEGER PRIMARY KEY, geom BLOB)")).unwrap();
        for east_km in *squares {
            let (west, south) = (506_900.0 + 1000.0 * east_km, 3_876_900.0);
            let corners = [[west, south], [west + 200.0, south], [west + 200.0, south + 200.0], [west, south]];
            // GeoPackage's head, then a polygon of one ring as well-known binary.
            let mut blob = vec![b'G', b'P', 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0];
            corners.iter().flatten().for_each(|metres: &f64| blob.extend(metres.to_le_bytes()));
            database.execute(&format!("INSERT INTO \"{name}\" (geom) VALUES (?1)"), [blob]).unwrap();
        }
    }
}

/// `text` on one line.
fn flat(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

const INIT: [&str; 2] = ["--crs", "EPSG:32611"];

#[test]
fn init_writes_a_section_of_features_that_plan_reads() {
    let scene = scene();
    fs::write(scene.path("roads.json"), lines(&ROADS)).unwrap();
    package(&scene.path("water.gpkg"), &[("lakes", &[0.0, 50.0]), ("things", &[0.1]), ("none", &[])]);
    // Rasters choose the area, wherever they stand.
    let arguments = [&["init", "roads.json", "dem.asc", "water.gpkg", "--out", "mine.toml"], &INIT[..]].concat();
    let said = scene.run_to(0, &arguments);
    for part in [
        "found 1 file: 2 x 2 km at 25 m",
        "roads.json: 4 of 5 lie in the area: 1 primary, 2 track, 1 of no kind, which are left out; \
         coastlines (1) make no sea: give its polygon kind = \"lake\"",
        "water.gpkg, layer lakes: 1 of 2 lie in the area: no tag says what they are, the name says lake",
        "water.gpkg, layer none: no lines or polygons",
    ] {
        assert!(flat(&said.stderr).contains(part), "{part} is not in: {}", said.stderr);
    }
    assert!(said.printed.lines().all(|line| line.chars().count() <= 80), "{}", said.printed);
    let job = fs::read_to_string(scene.path("mine.toml")).unwrap();
    for line in [
        "\n[features]\nsources = [\n    # 4 of 5 lie in the area: 1 primary, 2 track, 1 of no kind",
        "    \"roads.json\",\n",
        "    # 1 of 2 lie in the area: no tag says what they are, the name says lake\n    \
         { file = \"water.gpkg\", layer = \"lakes\", kind = \"lake\" },\n",
        "    { file = \"water.gpkg\", layer = \"things\", kind = \"lake\" },\n",
        "    # no lines or polygons\n    # { file = \"water.gpkg\", layer = \"none\" },\n]\n",
        "share_max = 0.5  #",
    ] {
        assert!(job.contains(line), "{line} is not in:\n{job}");
    }
    assert!(job.lines().all(|line| line.chars().count() <= 80), "{job}");
    let plan = scene.run_to(0, &["plan", "mine.toml"]).stdout;
    for row in [
        "roads.json 5 1 1 0",
        "water.gpkg, layer lakes 2 1 0 0",
        "lake lake 2 - level polygon sources that say so",
        "primary primary 1 7 m 10 % auto highway = primary, secondary,",
        "track track 2 3 m 25 % line highway = track",
        "share_max 0.5",
    ] {
        assert!(flat(&plan).contains(row), "{row} is not in:\n{plan}");
    }
    assert!(plan.lines().all(|line| line.chars().count() <= 80), "{plan}");
}

#[test]
fn init_sizes_limits_from_the_data_or_as_it_is_told() {
    let scene = scene();
    fs::write(scene.path("roads.json"), lines(&ROADS)).unwrap();
    let check = |name: &str, more: &[&str], told: &str, limits: [u32; 3]| {
        let arguments = [&["init", "roads.json", "dem.asc", "--out", name], &INIT[..], more].concat();
        let said = scene.run_to(0, &arguments);
        assert!(flat(&said.stderr).contains(told), "{}", said.stderr);
        let job = fs::read_to_string(scene.path(name)).unwrap();
        let [most, mean, square] = limits;
        for (key, limit) in [("per_load_module", most), ("mean_per_load_module", mean), ("per_4km_square", square)] {
            assert!(job.contains(&format!("\n{key} = {limit} ")), "{key} is not {limit} in:\n{job}");
        }
        assert!(job.contains(&format!("mean {mean:>4}: ")) && job.contains("(this job)"), "{job}");
        job
    };
    scene.run_to(0, &[&["init", "roads.json", "dem.asc", "--out", "data.toml"], &INIT[..]].concat());
    let job = fs::read_to_string(scene.path("data.toml")).unwrap();
    assert!(job.lines().all(|line| line.chars().count() <= 80), "{job}");
    check("simnet.toml", &["--limits", "simnet"], "32 triangles a load module keep", [100, 32, 4096]);
    check("mean.toml", &["--mean", "100"], "100 triangles a load module keep", [300, 100, 12_800]);
    let both = scene.run_to(2, &[&["init", "dem.asc", "--mean", "9", "--rms", "1"], &INIT[..]].concat());
    assert!(both.stderr.contains("'--mean <N>' cannot be used with '--rms <R>'"), "{}", both.stderr);
    let plan = scene.run_to(0, &["plan", "data.toml"]).stdout;
    assert!(flat(&plan).contains("What budgets would keep of features"), "{plan}");
    let json = scene.run_to(0, &["plan", "data.toml", "--emit", "json"]).stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    let budgets = json["budgets"].as_array().unwrap();
    assert_eq!((&budgets[0]["mean_per_load_module"], &budgets[budgets.len() - 1]["holds"]), (&32.into(), &true.into()));
    let least = budgets.iter().find(|budget| budget["holds"] == true).unwrap();
    let mean = format!("\nmean_per_load_module = {} ", least["mean_per_load_module"]);
    assert!(job.contains(&mean), "{mean} is not in:\n{job}");
}

#[test]
fn init_leaves_room_for_the_kind_of_each_layer_that_nothing_tells() {
    let scene = scene();
    package(&scene.path("data.gpkg"), &[("a", &[0.0]), ("b", &[0.1])]);
    let said = scene.run_to(0, &[&["init", "dem.asc", "data.gpkg", "--out", "a.toml"], &INIT[..]].concat());
    assert!(flat(&said.stderr).contains("add kind = \"…\", or all 1 are left out"), "{}", said.stderr);
    let job = fs::read_to_string(scene.path("a.toml")).unwrap();
    for layer in ["a", "b"] {
        let line = format!("\n    {{ file = \"data.gpkg\", layer = \"{layer}\" }},  # kind = \"…\"\n");
        assert!(job.contains(&line), "{line} is not in:\n{job}");
    }
    scene.run_to(0, &["plan", "a.toml"]);
}

#[test]
fn init_takes_features_from_a_folder_and_refuses_them_alone() {
    let scene = scene();
    fs::create_dir(scene.path("all")).unwrap();
    fs::rename(scene.path("dem.asc"), scene.path("all/dem.asc")).unwrap();
    fs::write(scene.path("all/roads.geojson"), lines(&ROADS)).unwrap();
    fs::write(scene.path("all/settings.json"), "[1, 2]").unwrap();
    let said = scene.run_to(0, &[&["init", "all"], &INIT[..]].concat());
    assert!(said.stdout.contains("roads.geojson\",\n") && !said.stdout.contains("settings"), "{}", said.stdout);
    let parts = ["all/roads.geojson: found a file of roads, water or buildings, expected a raster beside it"];
    scene.refuses(&[&["init", "all/roads.geojson"], &INIT[..]].concat(), &parts);
}

#[test]
fn init_leaves_out_a_section_without_sources_and_comments_it() {
    let scene = scene();
    fs::write(scene.path("empty.geojson"), lines(&[])).unwrap();
    let said = scene.run_to(0, &[&["init", "dem.asc", "empty.geojson", "--out", "a.toml"], &INIT[..]].concat());
    assert!(said.stderr.contains("empty.geojson: no lines or polygons"), "{}", said.stderr);
    let job = fs::read_to_string(scene.path("a.toml")).unwrap();
    assert!(job.contains("\n# [features]\n# sources = [\n"), "{job}");
    scene.run_to(0, &["plan", "a.toml"]);
}

/// A scene with these files of features and a job that names them with `keys`.
fn with_features(files: &[(&str, &str)], keys: &str) -> Scene {
    let scene = Scene::with_job("small.toml", &[]);
    files.iter().for_each(|(name, text)| fs::write(scene.path(name), text).unwrap());
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::write(scene.path("job.toml"), format!("{job}\n[features]\n{keys}\n")).unwrap();
    scene
}

#[test]
fn plan_tells_rules_that_match_nothing_and_features_that_all_lie_outside() {
    let keys = "sources = [\"far.geojson\"]\nrules = [{ where = { highway = \"trak\" }, kind = \"track\" }]";
    let scene = with_features(&[("far.geojson", &lines(&[("\"highway\":\"track\"", 5000.0)]))], keys);
    let said = scene.run_to(0, &["plan", "job.toml"]);
    let told = flat(&said.stderr);
    assert!(
        told.contains("note: far.geojson: none of its 1 lines and polygons lies inside the area: they lie"),
        "{told}"
    );
    assert!(
        told.contains("features.rules[0] (highway = trak) matches nothing: no feature in the area has a tag"),
        "{told}"
    );
    let json = scene.run_to(0, &["plan", "job.toml", "--emit", "json"]).stdout;
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["features"]["sources"][0]["outside"], 1);
    assert_eq!(json["features"]["rows"][0]["from"], "rule 0: highway = trak");
}

#[test]
fn engines_know_every_file_that_a_job_reads() {
    let roads = lines(&[("\"highway\":\"track\"", 0.0)]);
    let scene = with_features(&[("roads.geojson", &roads), ("roads.prj", "")], "sources = [\"roads.geojson\"]");
    let job = fs::read_to_string(scene.path("job.toml")).unwrap();
    fs::create_dir(scene.path("jobs")).unwrap();
    fs::write(scene.path("jobs/job.toml"), job.replace("roads.geojson", "../roads.geojson")).unwrap();
    let emitted = |emit| scene.run_to(0, &["plan", "jobs/job.toml", "--emit", emit, "--out", "jobs/a.tdb"]).stdout;
    for emit in ["ninja", "snakemake"] {
        let text = emitted(emit);
        for name in ["/roads.geojson", "/roads.prj"] {
            assert!(text.contains(name), "{emit}: {name} is not in: {text}");
        }
    }
    let mounted = format!("mountPath: \"{}\"\n", scene.path("").canonicalize().unwrap().display());
    let text = emitted("kubernetes");
    assert!(text.contains(&mounted), "{mounted:?} is not in: {text}");
}

#[test]
fn plan_counts_the_buildings_that_a_job_keeps() {
    let house = |east_km: f64| {
        let west = -116.923 + east_km * 0.011;
        let corners = [[0.0, 0.0], [3e-4, 0.0], [3e-4, 2e-4], [0.0, 0.0]].map(|[x, y]| [west + x, 35.03 + y]);
        let geometry = serde_json::json!({ "type": "Polygon", "coordinates": [corners] });
        serde_json::json!({ "type": "Feature", "properties": { "building": "yes" }, "geometry": geometry })
    };
    let all = serde_json::json!({ "type": "FeatureCollection", "features": [house(0.0), house(0.2), house(50.0)] });
    let plan = |keys: &str| {
        let scene = with_features(&[("a.geojson", &all.to_string())], &format!("sources = [\"a.geojson\"]\n{keys}"));
        let json = scene.run_to(0, &["plan", "job.toml", "--emit", "json"]).stdout;
        let json: Value = serde_json::from_str(&json).unwrap();
        (flat(&scene.run_to(0, &["plan", "job.toml"]).stdout), json["features"]["buildings"].clone())
    };
    let (text, count) = plan("");
    assert!(text.contains("Buildings: 2, kept beside the ground to be drawn; they cost no triangle."), "{text}");
    assert_eq!(count, 2);
    let (text, count) = plan("buildings = false");
    assert!(!text.contains("Buildings: ") && count == Value::Null, "{text}");
}

#[test]
fn plan_refuses_a_file_of_features_that_cannot_be_read() {
    let keys = "sources = [\"a.geojson\"]";
    for (text, part) in
        [("", "an empty file"), ("{\"type\": 3", "a.geojson"), ("north is up", "a text file of some other kind")]
    {
        with_features(&[("a.geojson", text)], keys).refuses(&["plan", "job.toml"], &["a.geojson", part]);
    }
    with_features(&[], keys).refuses(&["plan", "job.toml"], &["features.sources[0]", "which cannot be opened"]);
    let scene = with_features(&[], "sources = [{ file = \"a.gpkg\", layer = \"roads\" }]");
    package(&scene.path("a.gpkg"), &[("lakes", &[0.0])]);
    scene.refuses(&["plan", "job.toml"], &["a.gpkg: the layer `roads` named; expected one of `lakes`"]);
    let scene = with_features(&[], "sources = [\"a.gpkg\"]");
    package(&scene.path("a.gpkg"), &[]);
    let said = scene.run_to(0, &["plan", "job.toml"]);
    assert!(said.stderr.contains("note: a.gpkg: a GeoPackage without a layer of features"), "{}", said.stderr);
    let scene = with_features(&[], "sources = [\"a.gpkg\"]");
    package(&scene.path("a.gpkg"), &[("lakes", &[])]);
    let said = scene.run_to(0, &["plan", "job.toml"]);
    assert!(said.stderr.contains("note: a.gpkg: no line or polygon in the file"), "{}", said.stderr);
}

/// The shared data, where it is there.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder = std::env::var_os("TIEFORT_DATA").map_or_else(|| beside.into(), PathBuf::from);
    let path = folder.join("vectors").join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}

#[test]
fn real_extracts_become_jobs_whose_tables_hold_their_features() {
    for (folder, kinds) in [
        ("liechtenstein_south", &["primary", "minor", "track", "river", "stream", "lake", "dam"][..]),
        ("north_bayreuth", &["motorway", "primary", "minor", "track", "rail", "river", "stream", "lake"]),
        ("monaco", &["primary", "minor", "rail"]),
    ] {
        let Some(path) = shared(folder) else { continue };
        let scene = Scene::new();
        scene.run_to(0, &["init", path.to_str().unwrap(), "--out", "mine.toml"]);
        let json = scene.run_to(0, &["plan", "mine.toml", "--emit", "json", "--force"]).stdout;
        let json: Value = serde_json::from_str(&json).unwrap();
        let rows = json["features"]["rows"].as_array().unwrap();
        for kind in kinds {
            let of_kind = rows.iter().filter(|row| row["kind"] == *kind);
            let count: u64 = of_kind.map(|row| row["features"].as_u64().unwrap()).sum();
            assert!(0 < count, "{folder} has no {kind}");
        }
        // A file that is cut short is refused.
        let pbf = fs::read(path.join(format!("{folder}.osm.pbf"))).unwrap();
        fs::write(scene.path("cut.osm.pbf"), &pbf[..pbf.len() / 2]).unwrap();
        let job = fs::read_to_string(scene.path("mine.toml")).unwrap();
        let whole = job.lines().find(|line| line.contains(".osm.pbf\"")).unwrap();
        fs::write(scene.path("cut.toml"), job.replace(whole, "\"cut.osm.pbf\",")).unwrap();
        scene.refuses(&["plan", "cut.toml"], &["cut.osm.pbf"]);
    }
}
