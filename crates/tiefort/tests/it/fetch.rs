//! `tiefort fetch`: the same ground as from the whole file, few bytes, and a sentence for all that servers do wrong.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::remote::{FileServer, Manner, roads_parquet, tiled_raster};
use crate::scene::{Scene, everything_below};

/// A job of 7 km in the raster's middle.
fn job(source: &str, spacing_m: f64) -> String {
    format!(
        "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [506750, 3906250]\nsize_m = [7000, 7000]\n\
         spacing_m = {spacing_m}\n[dem]\nsources = [{source}]\n[tiles]\ncolumns = 2\nrows = 2\n[limits]\n\
         per_load_module = 100\nmean_per_load_module = 32\nper_4km_square = 4096\n"
    )
}

/// A server of the raster, and a scene with a job that names it, with a signature.
fn scene() -> (FileServer, Scene) {
    let server = FileServer::start(&[("dem.tif", tiled_raster().0)]);
    let scene = Scene::new();
    let address = format!("{{ file = \"{}/dem.tif?X-Sign=secret\", attribution = \"© the surveyors\" }}", server.host);
    fs::write(scene.path("a.toml"), job(&address, 25.0)).unwrap();
    (server, scene)
}

/// No file below the scene but the job holds the signature.
fn check_no_secret(scene: &Scene) {
    for (path, bytes) in scene.everything() {
        let bytes = bytes.filter(|_| !path.ends_with("a.toml")).unwrap_or_default();
        assert!(!bytes.windows(6).any(|six| six == b"secret"), "{}", path.display());
    }
}

#[test]
fn fetched_windows_build_the_same_bytes_as_the_whole_file() {
    let (server, scene) = scene();
    let (raster, sizes) = tiled_raster();
    scene.refuses(&["build", "a.toml"], &["dem.tif\"", "which is not fetched"]);
    let said = scene.run_to(0, &["fetch", "a.toml", "--dry-run"]);
    assert!(said.stdout.contains("9 tiles, ") && !scene.path("a.lock").exists(), "{}", said.stdout);
    let before = server.sent();
    let said = scene.run_to(0, &["fetch", "a.toml"]);
    assert!(!said.stdout.contains("secret") && !said.stderr.contains("secret"), "{}{}", said.stdout, said.stderr);
    let needed: u64 =
        (2..5).flat_map(|row| (2..5).map(move |col| (row, col))).map(|(row, col)| sizes[row * 6 + col]).sum();
    let sent = server.sent() - before;
    assert!(sent * 100 <= needed * 115, "{sent} bytes came for tiles of {needed}");
    let lock = fs::read_to_string(scene.path("a.lock")).unwrap();
    assert!(lock.contains("level = 0\nchunks = 9") && lock.contains("© the surveyors"), "{lock}");
    let requests = server.requests();
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
    assert_eq!(server.requests(), requests, "a build asks no server");
    let report = fs::read_to_string(scene.path("a.tdb/report.html")).unwrap();
    assert!(report.contains("© the surveyors"));
    check_no_secret(&scene);
    fs::write(scene.path("whole.tif"), raster).unwrap();
    fs::write(scene.path("b.toml"), job("\"whole.tif\"", 25.0)).unwrap();
    scene.run_to(0, &["build", "b.toml", "--quiet", "--out", "b.tdb"]);
    let (own, whole) = (built(&scene, "a.tdb"), built(&scene, "b.tdb"));
    assert!(!own.is_empty() && own == whole, "the same from windows as from the whole file");
    // A lock that no longer fits the job, or what lies there, is refused.
    fs::write(scene.path("a.toml"), fs::read_to_string(scene.path("a.toml")).unwrap().replace("506750", "507000"))
        .unwrap();
    scene.refuses(&["build", "a.toml"], &["fetched for another area"]);
}

#[test]
fn a_database_of_fetched_sources_is_measured_where_its_lock_lies() {
    let (_server, scene) = scene();
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
    let fidelity = ["fidelity", "a.tdb", "--pairs", "100"];
    assert!(scene.run_to(0, &fidelity).stdout.contains("a.sources/dem.tif"));
    let said = scene.run_to(0, &["inadequate", "a.tdb", "--against", "a.sources/dem.tif"]).stdout;
    assert_eq!(said.lines().nth(1), Some("against a.sources/dem.tif"), "{said}");
    scene.run_to(0, &["inadequate", "a.tdb"]);
    scene.run_to(0, &["render", "a.tdb", "--view", "residual", "--out", "a.png"]);
    let said = scene.run_to(0, &["explain", "a.tdb", "1,1"]).stdout;
    assert!(!said.contains("was not computed"), "{said}");
    let mut elsewhere = scene.program();
    elsewhere.current_dir(std::env::temp_dir()).arg("fidelity").arg(scene.path("a.tdb"));
    assert_eq!(elsewhere.output().unwrap().status.code(), Some(0));
    fs::remove_file(scene.path("a.lock")).unwrap();
    scene.refuses(&fidelity, &["nor fetched for a job there"]);
}

#[test]
fn what_arrives_damaged_is_dropped_and_comes_again() {
    let (server, scene) = scene();
    server.behave(Manner::Damaged);
    for _ in 0..2 {
        let said = scene.run_to(2, &["fetch", "a.toml", "--quiet"]);
        assert!(said.stderr.contains("dem.tif: it cannot be read: ") && said.stderr.contains("nothing of it is kept"));
        assert!(!said.stderr.contains("secret"), "{}", said.stderr);
        assert_eq!(fs::read_dir(scene.path("a.sources")).unwrap().count(), 0);
    }
    server.behave(Manner::Sound);
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
    // One that came before it was looked at, and is as the lock says.
    let (path, place) = (scene.path("a.sources/dem.tif"), scene.path("a.lock"));
    let (mut bytes, lock) = (fs::read(&path).unwrap(), fs::read_to_string(&place).unwrap());
    let old = blake3(&bytes);
    let middle = bytes.len() / 2;
    bytes[middle..].fill(0xaa);
    fs::write(&path, &bytes).unwrap();
    fs::write(&place, lock.replace(&old, &blake3(&bytes))).unwrap();
    let said = scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    assert!(said.stdout.contains("is here"), "{}", said.stdout);
    scene.refuses(&["build", "a.toml", "--fresh"], &["a.sources/dem.tif"]);
    let said = scene.run_to(0, &["fetch", "a.toml", "--quiet", "--update"]);
    assert!(!said.stdout.contains("is here"), "{}", said.stdout);
    assert!(fs::read_to_string(&place).unwrap().contains(&old));
    let said = scene.run_to(0, &["fetch", "a.toml", "--quiet", "--update"]);
    assert!(said.stdout.contains("is here"), "{}", said.stdout);
}

fn blake3(bytes: &[u8]) -> String {
    store::engine::Fingerprint::of_bytes(bytes).to_string()
}

#[test]
fn a_page_to_log_in_on_is_no_source() {
    let page = "\n<!DOCTYPE html><html><body>Log in</body></html>";
    let server = FileServer::start(&[("roads.geojson", page.into()), ("sound.geojson", "{}".into())]);
    let scene = Scene::new();
    for (name, manner) in [("roads", Manner::Sound), ("roads", Manner::NoRanges), ("sound", Manner::Page)] {
        server.behave(manner);
        let features = format!("[features]\nsources = [\"{}/{name}.geojson\"]\n", server.host);
        fs::write(scene.path("a.toml"), format!("{}{features}", job("\"whole.tif\"", 25.0))).unwrap();
        let said = scene.run_to(2, &["fetch", "a.toml", "--quiet"]);
        assert!(said.stderr.contains(&format!("{name}.geojson: found a web page (HTML)")), "{}", said.stderr);
        assert!(!scene.path(&format!("a.sources/{name}.geojson")).exists());
    }
}

#[test]
fn an_overview_comes_where_its_posts_are_close_enough() {
    let (server, scene) = scene();
    fs::write(scene.path("b.toml"), job(&format!("\"{}/dem.tif\"", server.host), 62.5)).unwrap();
    let said = scene.run_to(0, &["fetch", "b.toml", "--quiet"]);
    assert!(said.stdout.contains("overview with posts 50 m apart, as spacing_m is 62.5"), "{}", said.stdout);
    scene.run_to(0, &["build", "b.toml", "--quiet"]);
}

#[test]
fn what_servers_do_wrong_is_told_in_a_sentence() {
    let (server, scene) = scene();
    for (manner, part) in [
        (Manner::NoRanges, "the server gives no parts of files"),
        (Manner::Status(403, 9), "does not give it to strangers (403)"),
        (Manner::Status(404, 9), "there is no such file (404)"),
        (Manner::Status(416, 9), "it ends before the bytes that were asked for (416)"),
        (Manner::Status(500, 99), "not able to now (500)"),
        (Manner::OtherRange, "the server gave bytes"),
        (Manner::Truncated, "the answer ended after"),
        (Manner::Endless, "the answer goes on behind"),
        (Manner::Redirect("file:///etc/passwd".into()), "leads on to file:///etc/passwd, which is not followed"),
        (Manner::Redirect("http://example.org/dem.tif".into()), "which is not followed"),
        (Manner::Redirect("/dem.tif".into()), "leads on more than 5 times"),
        (Manner::Redirect("./dem.tif".into()), "leads on more than 5 times"),
        (Manner::Packed, "the server packs it on its way"),
        (Manner::CutAfter(3), "does not give it to strangers"),
    ] {
        server.behave(manner.clone());
        let said = scene.run(&["fetch", "a.toml", "--quiet"]);
        assert_eq!(said.code, Some(2), "{manner:?}: {}", said.stderr);
        assert!(said.stderr.contains(part) && said.stderr.contains("\nhint: "), "{manner:?}: {}", said.stderr);
        assert!(!said.stderr.contains("secret") && !said.stderr.contains("panicked"), "{manner:?}: {}", said.stderr);
        assert!(!scene.path("a.sources/dem.tif").exists(), "{manner:?}");
    }
    check_no_secret(&scene);
    server.behave(Manner::Status(503, 2));
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    assert!(scene.path("a.sources/dem.tif").exists());
}

#[test]
fn a_fetch_that_was_killed_goes_on_where_it_was() {
    let (server, scene) = scene();
    // Its directory, then three ranges of tiles: the first of them ends well.
    server.behave(Manner::CutAfter(2));
    scene.run_to(2, &["fetch", "a.toml", "--quiet"]);
    server.behave(Manner::Status(503, usize::MAX));
    let mut killed = scene.program().args(["fetch", "a.toml"]).stderr(Stdio::null()).spawn().unwrap();
    let start = Instant::now();
    while server.requests() == 0 && start.elapsed() < Duration::from_secs(30) {
        std::thread::yield_now();
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert!(!scene.path("a.lock").exists() || !scene.path("a.sources/dem.tif").exists());
    server.behave(Manner::Sound);
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    let of_new = server.requests();
    fs::remove_dir_all(scene.path("a.sources")).unwrap();
    fs::remove_file(scene.path("a.lock")).unwrap();
    server.behave(Manner::Sound);
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    assert!(of_new < server.requests(), "{of_new} requests after a cut, {} anew", server.requests());
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_fetch_that_waits_for_a_silent_server() {
    let (server, scene) = scene();
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        server.behave(Manner::Silent);
        let waiting = scene.program().args(["fetch", "a.toml"]).stderr(Stdio::piped()).spawn().unwrap();
        let start = Instant::now();
        while server.requests() == 0 && start.elapsed() < Duration::from_secs(30) {
            std::thread::yield_now();
        }
        // A person is told that nothing comes.
        std::thread::sleep(Duration::from_secs(7));
        let sent = Instant::now();
        Command::new("kill").args([signal, &waiting.id().to_string()]).status().unwrap();
        let said = waiting.wait_with_output().unwrap();
        assert!(sent.elapsed() < Duration::from_secs(5), "{:?}", sent.elapsed());
        let told = String::from_utf8(said.stderr).unwrap();
        assert_eq!(said.status.code(), Some(code), "{told}");
        assert!(told.contains("waits for 127.0.0.1:") && told.contains("stopped"), "{told}");
        assert!(told.contains("what has come is kept") && !told.contains("secret"), "{told}");
    }
}

#[test]
fn a_lock_holds_what_was_fetched_to_it() {
    let (server, scene) = scene();
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    let said = scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    assert!(said.stdout.contains("dem.tif: is here\n0 "), "{}", said.stdout);
    server.change("\"v2\"");
    let said = scene.run_to(2, &["fetch", "a.toml", "--quiet"]);
    assert!(said.stderr.contains("changed on the server: found version \"v2\", expected \"v1\""), "{}", said.stderr);
    scene.run_to(0, &["fetch", "a.toml", "--quiet", "--update"]);
    let lock = fs::read_to_string(scene.path("a.lock")).unwrap();
    for (old, new, part) in [
        ("\nbytes = ", "\nbytes = 1", "in the lock"),
        ("file = \"dem.tif\"", "file = \"../a.toml\"", "no name of a file"),
        ("/dem.tif\"", "/other.tif\"", "which is not fetched"),
        ("[[file]]", "[[file", "a.lock"),
    ] {
        fs::write(scene.path("a.lock"), lock.replacen(old, new, 1)).unwrap();
        scene.refuses(&["build", "a.toml"], &[part]);
    }
    fs::write(scene.path("a.lock"), &lock).unwrap();
    fs::write(scene.path("a.sources/dem.tif"), "short").unwrap();
    scene.refuses(&["build", "a.toml"], &["has 5 bytes"]);
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
}

#[test]
fn other_files_come_whole_also_in_one_answer_and_none_beyond_the_limit() {
    let roads = "{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\",\"properties\":\
        {\"highway\":\"primary\"},\"geometry\":{\"type\":\"LineString\",\"coordinates\":\
        [[-116.910,35.312],[-116.893,35.326]]}}]}";
    let server = FileServer::start(&[("roads.geojson", roads.into()), ("dem.tif", tiled_raster().0)]);
    let scene = Scene::new();
    let text = job(&format!("\"{}/dem.tif\"", server.host), 25.0);
    let features = format!("[features]\nsources = [\"{}/roads.geojson\"]\n", server.host);
    fs::write(scene.path("a.toml"), format!("{text}{features}")).unwrap();
    scene.run_to(0, &["fetch", "a.toml", "--quiet"]);
    assert_eq!(fs::read_to_string(scene.path("a.sources/roads.geojson")).unwrap(), roads);
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
    let only = format!("{}{features}", job("\"whole.tif\"", 25.0));
    fs::write(scene.path("b.toml"), &only).unwrap();
    server.behave(Manner::NoRanges);
    scene.run_to(0, &["fetch", "b.toml", "--quiet"]);
    assert_eq!(fs::read_to_string(scene.path("b.sources/roads.geojson")).unwrap(), roads);
    fs::write(scene.path("c.toml"), &only).unwrap();
    server.behave(Manner::Total(10_000_000_000));
    let said = scene.run_to(2, &["fetch", "c.toml", "--quiet"]);
    assert!(said.stderr.contains("are to come, expected at most 8 GB"), "{}", said.stderr);
}

/// The bytes of what was built, by name.
fn built(scene: &Scene, name: &str) -> Vec<(PathBuf, Option<Vec<u8>>)> {
    let folder = scene.path(name);
    let parts = ["tiles", "modules"].iter().flat_map(|part| everything_below(&folder.join(part)));
    parts.map(|(path, bytes)| (path.strip_prefix(&folder).unwrap().to_owned(), bytes)).collect()
}

#[test]
fn row_groups_of_all_files_that_fit_come_from_a_bucket_that_is_closed_to_strangers() {
    let (first, second) = (roads_parquet(&[-116.91, -100.0, -90.0]), roads_parquet(&[-80.0, -116.9]));
    let list: String = [("a.parquet", &first), ("b.parquet", &second), ("c.txt", &first)]
        .iter()
        .map(|(name, bytes)| {
            format!("<Contents><Key>x/{name}</Key><ETag>&quot;v1&quot;</ETag><Size>{}</Size></Contents>", bytes.len())
        })
        .collect();
    let list = format!("<ListBucketResult><IsTruncated>false</IsTruncated>{list}</ListBucketResult>");
    let files =
        [("maps/", list.into_bytes()), ("maps/x/a.parquet", first.clone()), ("maps/x/b.parquet", second.clone())];
    let server = FileServer::start(&files);
    server.behave(Manner::Closed("AKIDEXAMPLE".into()));
    let scene = Scene::new();
    fs::write(scene.path("whole.tif"), tiled_raster().0).unwrap();
    let text = job("\"whole.tif\"", 25.0);
    fs::write(scene.path("a.toml"), format!("{text}[features]\nsources = [\"s3://maps/x/*.parquet\"]\n")).unwrap();
    let fetch = |keys: &[(&str, &str)]| {
        let mut program = scene.program();
        program.args(["fetch", "a.toml", "--quiet"]).env("AWS_ENDPOINT_URL", &server.host).env("HOME", scene.path(""));
        let said = program.envs(keys.iter().copied()).output().unwrap();
        let text = String::from_utf8([said.stdout, said.stderr].concat()).unwrap();
        (said.status.code(), text.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (code, said) = fetch(&[]);
    assert!(code == Some(2) && said.contains("strangers (403)") && said.contains("AWS_ACCESS_KEY_ID"), "{said}");
    let keys =
        [("AWS_ACCESS_KEY_ID", "AKIDEXAMPLE"), ("AWS_SECRET_ACCESS_KEY", "secret"), ("AWS_SESSION_TOKEN", "secret")];
    let (code, said) = fetch(&keys);
    assert!(code == Some(0) && said.contains("2 of 5 row groups in 2 files"), "{said}");
    assert!(!said.contains("secret") && !said.contains("AKID"), "{said}");
    check_no_secret(&scene);
    let lock = fs::read_to_string(scene.path("a.lock")).unwrap();
    assert!(lock.contains("address = \"s3://maps/x/*.parquet\"") && !lock.contains("AKID"), "{lock}");
    scene.run_to(0, &["build", "a.toml", "--quiet"]);
    fs::write(scene.path("first.parquet"), first).unwrap();
    fs::write(scene.path("second.parquet"), second).unwrap();
    fs::write(scene.path("b.toml"), format!("{text}[features]\nsources = [\"first.parquet\", \"second.parquet\"]\n"))
        .unwrap();
    scene.run_to(0, &["build", "b.toml", "--quiet", "--out", "b.tdb"]);
    let (own, whole) = (built(&scene, "a.tdb"), built(&scene, "b.tdb"));
    assert!(!own.is_empty() && own == whole, "the same from row groups as from whole files");
    let (code, said) = fetch(&keys);
    assert!(code == Some(0) && said.contains("is here"), "{said}");
    server.change("\"v2\"");
    // The list still has the old mark, so the files are as they were said to be.
    assert_eq!(fetch(&keys).0, Some(0));
}

#[test]
fn a_place_becomes_a_job_without_a_network() {
    let scene = Scene::new();
    let words = ["init", "--around", "35.3,-116.6", "--km", "50", "--dem", "glo30", "--out", "irwin.toml"];
    scene.run_to(0, &words);
    let text = fs::read_to_string(scene.path("irwin.toml")).unwrap();
    let squares = ["N35_00_W117_00", "N35_00_W118_00", "N34_00_W117_00"];
    let held: Vec<bool> = squares.iter().map(|square| text.contains(square)).collect();
    assert_eq!(held, [true, false, false], "{text}");
    assert!(text.contains("crs = \"EPSG:32611\"") && text.contains("COPERNICUS"), "{text}");
    scene.refuses(&["build", "irwin.toml"], &["which is not fetched"]);
    let vectors = ["init", "--around", "35.3,-116.6", "--km", "20", "--dem", "3dep13", "--vectors", "overture"];
    scene.refuses(&vectors, &["found no --release"]);
    let said = scene.run_to(0, &[&vectors[..], &["--release", "2025-11-19.0", "--out", "o.toml"]].concat());
    let text = fs::read_to_string(scene.path("o.toml")).unwrap();
    assert!(text.contains("/2025-11-19.0/theme=transportation/type=segment/*.parquet\""), "{text}{}", said.stdout);
    scene.refuses(&["build", "o.toml"], &["which is not fetched"]);
    scene.refuses(&["init", "--around", "35.3,-116.6", "--dem", "3dep1m"], &["3dep1m"]);
    scene.refuses(&["init", "--around", "35.3,-116.6", "--dem", "moon"], &["no such source", "glo30"]);
    let said = scene.run_to(0, &["sources"]);
    assert!(["glo30", "glo90", "3dep13", "EGM2008", "public domain"].iter().all(|part| said.stdout.contains(part)));
}
