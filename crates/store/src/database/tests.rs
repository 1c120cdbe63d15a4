//! Tests of a whole directory.

use std::fs;

use super::*;
use crate::{Report, TileState, samples};

fn stamped(manifest: &mut Manifest, database: &Database) {
    let record = manifest.tile_mut(samples::TILE).unwrap();
    record.state = TileState::Done;
    record.fingerprint = Some(samples::stamp().fingerprint);
    record.tin = Some(database.write_tile(&samples::stamp(), &samples::tile()).unwrap());
    record.slm = Some(database.write_modules(&samples::tile_modules(), &samples::levels()).unwrap());
    record.curve = Some(database.write_curve(&samples::stamp(), &samples::curve()).unwrap());
}

/// A finished database of one tile in `dir`.
fn build(dir: &Path) -> Manifest {
    let (database, _) = Database::create_or_open(dir, &samples::area()).unwrap();
    let mut manifest = Manifest::new(samples::area(), "job".into(), 7);
    database.begin(&manifest).unwrap();
    stamped(&mut manifest, &database);
    let allocation = database.write_json(files::ALLOCATION, &std::collections::BTreeMap::from([("n", 1)])).unwrap();
    manifest.files.insert(files::ALLOCATION.into(), allocation);
    manifest.state = ManifestState::Complete;
    database.write_report(&mut Report::default(), &manifest).unwrap();
    database.finish(&manifest).unwrap();
    manifest
}

#[test]
fn what_was_written_is_read_and_verified() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("a/sample.tdb");
    let manifest = build(&dir);
    let read = Folder::new(&dir);
    assert_eq!(read.manifest().unwrap(), manifest);
    assert_eq!(read.read_tile(samples::TILE).unwrap(), (samples::stamp(), samples::tile()));
    assert_eq!(read.tile_stamp(samples::TILE).unwrap(), Some(samples::stamp()));
    assert_eq!(read.tile_stamp(terrain::TileId { row: 5, col: 5 }).unwrap(), None);
    assert_eq!(read.read_modules(&manifest, samples::TILE).unwrap(), (samples::tile_modules(), samples::modules()));
    assert_eq!(read.read_levels(&manifest, samples::TILE).unwrap(), (samples::tile_modules(), samples::levels()));
    assert_eq!(read.read_curve(samples::TILE).unwrap(), (samples::stamp(), samples::curve()));
    assert!(read.verify(&manifest).unwrap().is_empty());
}

#[test]
fn verify_finds_every_flipped_byte_and_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("sample.tdb");
    let manifest = build(&dir);
    let read = Folder::new(&dir);
    for (path, _) in read.listed_files(&manifest) {
        let good = fs::read(&path).unwrap();
        for at in (0..good.len()).step_by(7) {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            fs::write(&path, bad).unwrap();
            let damage = read.verify(&manifest).unwrap();
            assert_eq!(damage.iter().map(|d| &d.path).collect::<Vec<_>>(), [&path]);
        }
        fs::write(&path, good).unwrap();
    }
}

#[test]
fn verify_names_missing_replaced_and_unlisted_files() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("sample.tdb");
    let manifest = build(&dir);
    let read = Folder::new(&dir);
    let (tin, curve, other) =
        (read.tile_path(samples::TILE), read.curve_path(samples::TILE), dir.join("tiles/r07c07.tin"));
    fs::remove_file(&curve).unwrap();
    let mut tile = samples::tile();
    tile.triangles_charged += 1;
    let sound_but_other = encode_tile(&samples::stamp(), &tile);
    fs::write(&tin, &sound_but_other).unwrap();
    fs::write(&other, &sound_but_other).unwrap();
    fs::write(dir.join(files::REPORT), "{}").unwrap();
    let damage = read.verify(&manifest).unwrap();
    let errors: Vec<_> = damage.iter().map(|damage| &damage.error).collect();
    assert!(matches!(errors[0], DatabaseError::WrongChecksum { path, .. } if *path == tin), "{errors:?}");
    assert!(matches!(errors[1], DatabaseError::Missing { path } if *path == curve), "{errors:?}");
    assert!(matches!(errors[2], DatabaseError::Malformed { path, .. } if path.ends_with(files::REPORT)), "{errors:?}");
    assert!(matches!(errors[3], DatabaseError::NotListed { path } if *path == other), "{errors:?}");
    assert!(matches!(
        read.read_tile(terrain::TileId { row: 7, col: 7 }),
        Err(DatabaseError::OtherTile { found: samples::TILE, .. })
    ));
}

#[test]
fn opening_again_finds_the_database_and_removes_what_was_left_over() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("sample.tdb");
    let manifest = build(&dir);
    let left_over = [dir.join(".tiefort-x.part"), dir.join("tiles/.tiefort-y.part")];
    left_over.iter().for_each(|path| fs::write(path, b"half").unwrap());
    let (database, previous) = Database::create_or_open(&dir, &samples::area()).unwrap();
    assert_eq!(previous, Some(manifest));
    assert!(left_over.iter().all(|path| !path.exists()));
    database.begin_afresh(&Manifest::new(samples::area(), "job".into(), 7)).unwrap();
    assert!(fs::read_dir(dir.join("tiles")).unwrap().next().is_none());
    assert_eq!(Folder::new(&dir).manifest().unwrap().state, ManifestState::Incomplete, "what is there stays ours");
}

#[test]
fn a_directory_that_is_not_ours_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("thesis.tex"), b"").unwrap();
    let error = Database::create_or_open(folder.path(), &samples::area()).unwrap_err();
    let expected = "\"thesis.tex\" in it and no database.json";
    assert!(matches!(&error, DatabaseError::NotOurFolder { found, .. } if found == expected), "{error}");
    assert!(error.hint().is_some());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let file = folder.path().join("thesis.tex");
    assert!(matches!(Database::create_or_open(&file, &samples::area()), Err(DatabaseError::NotOurFolder { .. })));
}

#[test]
fn names_of_ours_do_not_make_a_folder_ours() {
    let filled: [&[&str]; 8] = [
        &["work/2026/letters/thesis.doc"],
        &["report.html"],
        &["tiles/r00c00.tin", "lock"],
        &["survey/answers.csv"],
        &["modules/a/b"],
        &["features.gpkg"],
        &["breaches.csv", "measured/a.sums"],
        &["database.json", "work/0123456789abcdef/done/a"],
    ];
    for names in filled {
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            fs::create_dir_all(folder.path().join(name).parent().unwrap()).unwrap();
            fs::write(folder.path().join(name), "{\"theirs\": 1}\n").unwrap();
        }
        let opened = [
            Database::create_or_open(folder.path(), &samples::area()),
            Database::join(folder.path(), &samples::area()),
        ];
        for error in opened.map(Result::unwrap_err) {
            assert!(matches!(error, DatabaseError::NotOurFolder { .. }), "{names:?}: {error}");
        }
        assert!(Database::foresee(folder.path(), &samples::area()).is_err());
        let is_theirs = |name: &&str| fs::read(folder.path().join(name)).unwrap() == b"{\"theirs\": 1}\n";
        assert!(names.iter().all(is_theirs), "{names:?}");
        let others = fs::read_dir(folder.path()).unwrap().count();
        let own: std::collections::BTreeSet<_> = names.iter().map(|name| name.split('/').next()).collect();
        assert_eq!(others, own.len(), "{names:?}: something was made there");
    }
}

#[test]
fn what_a_build_leaves_that_ended_before_it_began_is_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("a.tdb");
    drop(Database::create_or_open(&dir, &samples::area()).unwrap());
    fs::write(dir.join(".tiefort-x.part"), b"half").unwrap();
    assert!(!dir.join(files::DATABASE).exists());
    Database::create_or_open(&dir, &samples::area()).unwrap();
}

#[test]
fn only_runs_are_removed_from_the_work_folder_and_only_files_of_ours_for_a_fresh_start() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("a.tdb");
    build(&dir);
    let theirs = ["work/2026/letters/thesis.doc", "tiles/notes.txt", "modules/kept/b.slm", "notes.txt"];
    for name in theirs.iter().copied().chain(["work/0123456789abcdef/done/refine-r00c00"]) {
        fs::create_dir_all(dir.join(name).parent().unwrap()).unwrap();
        fs::write(dir.join(name), b"theirs").unwrap();
    }
    let (database, _) = Database::create_or_open(&dir, &samples::area()).unwrap();
    assert!(!dir.join("work/0123456789abcdef").exists());
    database.begin_afresh(&Manifest::new(samples::area(), "job".into(), 7)).unwrap();
    assert!(theirs.iter().all(|name| fs::read(dir.join(name)).unwrap() == b"theirs"));
    assert_eq!(fs::read_dir(dir.join("tiles")).unwrap().count(), 1);
}

#[test]
fn another_area_or_version_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("sample.tdb");
    build(&dir);
    let mut other = samples::area();
    other.spacing_m = 3.0;
    let error = Database::create_or_open(&dir, &other).unwrap_err();
    assert!(matches!(error, DatabaseError::OtherArea { key: "spacing_m", .. }), "{error}");
    let path = dir.join(files::DATABASE);
    let later = json::encode(&path, &std::collections::BTreeMap::from([("format_version", 99)])).unwrap();
    fs::write(&path, later).unwrap();
    let error = Database::create_or_open(&dir, &samples::area()).unwrap_err();
    assert!(matches!(error, DatabaseError::OtherVersion { found: 99, .. }), "{error}");
}

#[test]
fn a_damaged_manifest_can_be_built_over_but_only_among_our_own_files() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("sample.tdb");
    build(&dir);
    let path = dir.join(files::DATABASE);
    let mut text = fs::read(&path).unwrap();
    text[40] ^= 1;
    fs::write(&path, text).unwrap();
    let (database, previous) = Database::create_or_open(&dir, &samples::area()).unwrap();
    assert_eq!(previous, None);
    drop(database);
    fs::write(dir.join("notes.txt"), b"").unwrap();
    assert!(matches!(Database::create_or_open(&dir, &samples::area()), Err(DatabaseError::NotOurFolder { .. })));
}

#[test]
fn two_builds_in_one_directory_exclude_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let (_first, previous) = Database::create_or_open(folder.path(), &samples::area()).unwrap();
    assert_eq!(previous, None);
    let error = Database::create_or_open(folder.path(), &samples::area()).unwrap_err();
    assert!(error.is_transient(), "{error}");
}

#[cfg(unix)]
#[test]
fn a_link_in_place_of_a_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (dir, elsewhere) = (folder.path().join("sample.tdb"), folder.path().join("elsewhere"));
    fs::create_dir(&dir).unwrap();
    fs::create_dir(&elsewhere).unwrap();
    std::os::unix::fs::symlink(&elsewhere, dir.join("tiles")).unwrap();
    assert!(matches!(Database::create_or_open(&dir, &samples::area()), Err(DatabaseError::NotAFolder { .. })));
}

#[cfg(unix)]
#[test]
fn a_directory_without_write_permission_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(closed.join("probe"), b"").is_ok() {
        eprintln!("skipped: this user may write anywhere");
        return;
    }
    let error = Database::create_or_open(&closed.join("sample.tdb"), &samples::area()).unwrap_err();
    assert!(matches!(error, DatabaseError::NotWritable { .. }), "{error}");
}

#[test]
fn a_build_is_not_called_complete_while_a_listed_file_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = build(folder.path());
    let (database, _) = Database::create_or_open(folder.path(), &samples::area()).unwrap();
    manifest.files.insert("breaches.geojson".into(), FileStamp::of(b""));
    assert!(matches!(database.finish(&manifest), Err(DatabaseError::Missing { .. })));
}

#[test]
fn a_fresh_build_of_the_same_values_has_the_same_bytes() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let texts = folders.each_ref().map(|folder| {
        build(folder.path());
        fs::read(folder.path().join(files::DATABASE)).unwrap()
    });
    assert_eq!(texts[0], texts[1]);
}

#[test]
fn only_our_own_temporary_files_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("a.tdb");
    let (database, _) = Database::create_or_open(&dir, &samples::area()).unwrap();
    let before = fs::read_dir(&dir).unwrap().count();
    for name in [".tiefort-abc.part", ".tiefort-abc", "other.part"] {
        fs::write(dir.join(name), b"").unwrap();
    }
    database.sweep().unwrap();
    assert!(!dir.join(".tiefort-abc.part").exists());
    assert_eq!(fs::read_dir(&dir).unwrap().count(), before + 2);
}

#[test]
fn a_folder_that_is_gone_is_an_error_with_the_path() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("a.tdb");
    let (database, _) = Database::create_or_open(&dir, &samples::area()).unwrap();
    fs::remove_dir(dir.join("tiles")).unwrap();
    let error = database.write_tile(&samples::stamp(), &samples::tile()).unwrap_err().to_string();
    let path = database.folder().tile_path(samples::TILE);
    assert!(error.starts_with(&format!("{}: cannot write: ", path.display())), "{error}");
    assert!(!error.contains(".tiefort-"), "{error}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_as_such() {
    use std::io::Write;
    let path = Path::new("/dev/full");
    let Ok(mut full) = fs::File::options().write(true).open(path) else {
        eprintln!("skipped: no /dev/full on this system");
        return;
    };
    let source = full.write_all(b"x").unwrap_err();
    assert!(matches!(DatabaseError::from_io("write", path, 1, source), DatabaseError::DiskFull { .. }));
}
