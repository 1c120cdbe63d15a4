//! Messages as a stranger reads them: the hint fits what was done.

use std::fs;

use crate::raster::Raster;
use crate::scene::Scene;

/// What the program answers must be refused, with a hint that holds `hint`.
#[track_caller]
fn check(scene: &Scene, arguments: &[&str], parts: &[&str], hint: &str) {
    scene.refuses(arguments, parts);
    let said = scene.run_to(2, arguments).stderr;
    let told = said.lines().find_map(|line| line.strip_prefix("hint: ")).unwrap_or_default();
    assert!(told.contains(hint), "{arguments:?}: the hint does not hold {hint:?}: {said}");
}

/// Commands that read a database, as far as its name.
const READERS: [&[&str]; 9] = [
    &["report"],
    &["status"],
    &["verify"],
    &["inadequate"],
    &["fidelity"],
    &["explain"],
    &["export", "--format", "ply", "--out", "m.ply"],
    &["export", "--format", "modules", "--out", "m"],
    &["render", "--view", "relief", "--out", "a.png"],
];

#[test]
fn what_is_named_as_a_database_and_is_none_is_told_as_what_it_is() {
    let scene = Scene::with_job("small.toml", &[]);
    fs::create_dir(scene.path("photos")).unwrap();
    fs::write(scene.path("dem.tif"), "").unwrap();
    for reader in READERS {
        let named = |name| {
            let mut arguments = vec![reader[0], name];
            arguments.extend(if reader[0] == "explain" { &["0,0"][..] } else { &reader[1..] });
            arguments
        };
        check(&scene, &named("nothere.tdb"), &["nothere.tdb: found nothing there"], "check the path");
        check(&scene, &named("job.toml"), &["job.toml: found a job file"], "that is a job");
        check(&scene, &named("dem.tif"), &["dem.tif: found a file"], "such as ntc.tdb");
        check(&scene, &named("photos"), &["photos: found another folder"], "no database.json");
    }
    check(&scene, &["diff", "a.tdb", "b.tdb"], &["a.tdb: found nothing there"], "check the path");
    check(&scene, &["tile", "job.toml", "0,0"], &["found nothing there"], "tiefort build");
}

#[test]
fn a_folder_named_as_a_job_is_told_so() {
    let scene = Scene::new();
    fs::create_dir(scene.path("some.tdb")).unwrap();
    for command in ["plan", "build"] {
        check(&scene, &[command, "some.tdb"], &["some.tdb", "expected a job file"], "a job file");
    }
}

#[cfg(unix)]
#[test]
fn a_link_that_leads_nowhere_is_no_place_to_write() {
    let scene = Scene::with_job("small.toml", &[]);
    std::os::unix::fs::symlink(scene.path("gone"), scene.path("link.ply")).unwrap();
    let link = "a link that leads nowhere";
    let refused = |arguments: &[&str]| {
        let said = scene.run_to(2, arguments);
        said.check_error(&["link.ply", link]);
        assert!(!scene.path("gone").exists());
    };
    refused(&["build", "job.toml", "--out", "link.ply"]);
    refused(&["export", "x.tdb", "--format", "ply", "--out", "link.ply"]);
    refused(&["export", "x.tdb", "--format", "modules", "--out", "link.ply"]);
    refused(&["sample", "--posts", "9", "--out", "link.ply"]);
}

#[test]
fn a_file_is_replaced_and_a_folder_is_not_and_help_says_so() {
    let scene = Scene::with_job("small.toml", &[]);
    scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]);
    fs::write(scene.path("p.obj"), "old").unwrap();
    scene.run_to(0, &["export", "x.tdb", "--format", "obj", "--out", "p.obj"]);
    assert_ne!(fs::read(scene.path("p.obj")).unwrap(), b"old");
    let folder = ["export", "x.tdb", "--format", "modules", "--out", "m"];
    scene.run_to(0, &folder);
    check(&scene, &folder, &["m: found a folder that is not empty"], "a folder is never written over");
    let help = scene.run_to(0, &["export", "--help"]).stdout;
    assert!(help.contains("a file of that name is replaced"), "{help}");
    // Folders for maps are made.
    scene.run_to(0, &["inadequate", "x.tdb", "--out", "new/maps"]);
    assert!(scene.path("new/maps/inadequate.geojson").is_file());
}

#[test]
fn control_characters_of_a_job_do_not_reach_the_terminal_and_long_values_are_cut() {
    let scene = Scene::with_job("small.toml", &[("[area]", "[area]\n\"\\u001b[31mred\\u0007\" = 1")]);
    let said = scene.run_to(2, &["plan", "job.toml"]).stderr;
    assert!(!said.contains('\u{1b}') && !said.contains('\u{7}') && said.contains("red"), "{said:?}");
    let long = format!("[area]\n{} = 1", "a".repeat(16_000));
    let scene = Scene::with_job("small.toml", &[("[area]", &long)]);
    let said = scene.run_to(2, &["plan", "job.toml"]).stderr;
    assert!(said.len() < 3000 && said.contains("characters left out"), "{} bytes", said.len());
}

#[test]
fn an_hgt_tile_of_another_size_is_told_with_the_sizes_there_are() {
    let scene = Scene::new();
    fs::write(scene.path("N35W117.hgt"), vec![0; 5000]).unwrap();
    let parts = ["N35W117.hgt: found 5000 bytes", "2884802 (1201 x 1201 posts)"];
    check(&scene, &["init", "N35W117.hgt"], &parts, "not copied or unpacked whole");
}

#[test]
fn init_tells_to_say_crs_as_an_argument_and_takes_a_folder_for_its_rasters() {
    let scene = Scene::new();
    let row = (0..81).map(|col| format!("{} ", 700 + col % 9)).collect::<String>() + "\n";
    let head = "ncols 81\nnrows 81\nxllcenter 506000\nyllcenter 3876000\ncellsize 25\n";
    fs::create_dir(scene.path("dem")).unwrap();
    fs::create_dir(scene.path("none")).unwrap();
    fs::write(scene.path("dem/a.asc"), head.to_owned() + &row.repeat(81)).unwrap();
    check(&scene, &["init", "dem"], &["a.asc", "no coordinate reference system"], "--crs EPSG:");
    check(&scene, &["init", "none"], &["none: found a folder without rasters"], ".asc");
    let said = scene.run_to(0, &["init", "dem", "--crs", "EPSG:32611"]);
    fs::create_dir_all(scene.path("tree/w117")).unwrap();
    fs::copy(scene.path("dem/a.asc"), scene.path("tree/w117/a.asc")).unwrap();
    let deeper = scene.run_to(0, &["init", "tree", "--crs", "EPSG:32611"]);
    assert!(deeper.stdout.contains("tree/w117/a.asc"), "{}", deeper.stdout);
    fs::copy(scene.path("dem/a.asc"), scene.path("tree/a.asc")).unwrap();
    let beside = scene.run_to(0, &["init", "tree", "--crs", "EPSG:32611"]);
    let told = beside.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("files in a folder in tree are not taken"), "{told}");
    let found = "found 1 file: 2 x 2 km at 25 m, no voids, heights above an unknown datum; a build takes about";
    let line = said.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(line.contains(found) && line.contains("leave an RMS residual"), "{}", said.stderr);
    assert!(said.printed.lines().all(|line| line.chars().count() <= 80), "{}", said.printed);
    let job = said.stdout;
    assert!(job.contains("a.asc") && job.contains("size_m = [2000, 2000]"), "{job}");
    assert!(!job.contains("left out") && !line.contains("left out"), "all of it: {job}");
    // 2.225 by 2.475 km, of which whole load modules take 2 by 2.
    let row = "7 ".repeat(90) + "\n";
    let head = head.replace("ncols 81", "ncols 90").replace("nrows 81", "nrows 100");
    fs::write(scene.path("b.asc"), head + &row.repeat(100)).unwrap();
    let said = scene.run_to(0, &["init", "b.asc", "--crs", "EPSG:32611"]);
    let line = said.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    let left = "; 0.23 km of the files' width and 0.48 km of their height are left out";
    assert!(line.contains(left), "{}", said.stderr);
    assert!(
        said.stdout.contains("# 0.23 km of their width and 0.48 km of their height left out\nsize_m"),
        "{}",
        said.stdout
    );
}

#[test]
fn init_writes_a_part_where_rasters_lie_too_far_apart_for_one_area() {
    let scene = Scene::new();
    let row = (0..81).map(|col| format!("{} ", 700 + col % 9)).collect::<String>() + "\n";
    for (name, north) in [("a.asc", 3_876_000), ("b.asc", 3_976_000)] {
        let head = format!("ncols 81\nnrows 81\nxllcenter 506000\nyllcenter {north}\ncellsize 25\n");
        fs::write(scene.path(name), head + &row.repeat(81)).unwrap();
    }
    scene.run_to(0, &["init", "a.asc", "b.asc", "--crs", "EPSG:32611", "--out", "near.toml"]);
    let far = fs::read_to_string(scene.path("b.asc")).unwrap().replace("3976000", "9576000");
    fs::write(scene.path("b.asc"), far.replace("506000", "90006000")).unwrap();
    scene.run_to(0, &["init", "a.asc", "b.asc", "--crs", "EPSG:32611", "--out", "far.toml"]);
    let job = fs::read_to_string(scene.path("far.toml")).unwrap();
    assert!(job.contains("# around = { lat = 35.") && job.contains("size_m = [2000, 2000]"), "{job}");
    scene.run_to(0, &["build", "far.toml"]);
}

#[test]
fn a_plan_refuses_what_the_build_would_refuse_for_its_datum() {
    let said = "sources = [{ file = \"dem.tif\", vertical_datum = \"ellipsoid\" }]\nvertical_datum = \"EGM96\"";
    let scene = Scene::with_job("raster.toml", &[("sources = [\"dem.tif\"]", said)]);
    Raster::sound().write(&scene.path("dem.tif"));
    for command in ["plan", "build"] {
        check(
            &scene,
            &[command, "job.toml"],
            &["job.toml:", ": dem.vertical_datum", "ellipsoid", "EGM96"],
            "name the grid",
        );
    }
}

#[test]
fn a_plan_refuses_a_raster_that_does_not_cover_the_area() {
    let scene = Scene::with_job("raster.toml", &[]);
    Raster::sound().moved_m(100.0).write(&scene.path("dem.tif"));
    scene.refuses(&["plan", "job.toml"], &["dem.tif", "does not cover the area"]);
}

#[test]
fn a_build_prints_no_settings_unless_asked() {
    let scene = Scene::with_job("small.toml", &[]);
    let said = scene.run_to(0, &["build", "job.toml", "--out", "x.tdb"]).stderr;
    assert!(!said.contains("mean_per_load_module") && said.contains("into x.tdb"), "{said}");
    let said = scene.run_to(0, &["build", "job.toml", "--out", "y.tdb", "-v"]).stderr;
    assert!(said.contains("mean_per_load_module"), "{said}");
}
