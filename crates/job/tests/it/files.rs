//! What a job reads from the disk: itself, the files it names, and those its patterns find.

use std::fs;
use std::path::Path;

use job::{DemSource, Job, JobError};

const HEAD: &str = r#"[area]
name = "ntc"
crs = "EPSG:32611"
origin_m = [505000, 3875000]
size_m = [50000, 50000]
spacing_m = 25
[dem]
"#;

/// A folder with a job that has `rest` in its `[dem]` and behind it, and the named files beside it.
fn folder(rest: &str, files: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        let path = folder.path().join("jobs").join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "x").unwrap();
    }
    fs::create_dir_all(folder.path().join("jobs")).unwrap();
    fs::write(folder.path().join("jobs/ntc.toml"), format!("{HEAD}{rest}\n")).unwrap();
    folder
}

fn load(folder: &Path) -> Result<Job, JobError> {
    Job::load(&folder.join("jobs/ntc.toml"))
}

/// The sources a job finds, as it would write them.
#[track_caller]
fn check_found(folder: &Path, expected: &[&str]) {
    let job = load(folder).unwrap();
    let DemSource::Files { files, .. } = &job.dem.source else { panic!("the job names files") };
    let written: Vec<&str> = files.iter().map(|file| file.written.as_str()).collect();
    assert_eq!(written, expected);
    assert!(files.iter().all(|file| file.path.is_file()));
}

/// What is told of a job, with the folder called ROOT.
#[track_caller]
fn check_told(folder: &Path, expected: &[&str]) {
    let error = load(folder).expect_err("this job is wrong");
    let told = format!("{error} hint: {}", error.hint());
    let roots = [folder.canonicalize().unwrap(), folder.to_owned()];
    let told = roots.iter().fold(told, |told, root| told.replace(root.to_str().unwrap(), "ROOT"));
    assert_eq!(told, expected.join(" "));
}

#[test]
fn patterns_are_expanded_in_order_and_a_file_counts_once() {
    let files = ["dem/b.tif", "dem/a.tif", "dem/c.txt", "dem/.d.tif", "dem/far/e.tif", "first.tif"];
    let folder = folder(r#"sources = ["first.tif", "dem/b.tif", "dem/*.tif"]"#, &files);
    check_found(folder.path(), &["first.tif", "dem/b.tif", "dem/a.tif"]);
}

#[test]
fn a_double_star_finds_files_in_all_folders_below() {
    let folder = folder(r#"sources = ["dem/**/*.tif"]"#, &["dem/b.tif", "dem/x/a.tif", "dem/x/y/a.tif", "a.tif"]);
    check_found(folder.path(), &["dem/b.tif", "dem/x/a.tif", "dem/x/y/a.tif"]);
}

#[test]
fn a_name_with_brackets_is_a_name_where_such_a_file_exists() {
    let folder = folder(r#"sources = ["dem[1].tif"]"#, &["dem[1].tif"]);
    check_found(folder.path(), &["dem[1].tif"]);
}

#[test]
fn a_named_file_may_lie_anywhere() {
    let folder = folder(r#"sources = ["../far/a.tif", "../far/*.tif"]"#, &["../far/a.tif", "../far/b.tif"]);
    check_found(folder.path(), &["../far/a.tif", "../far/b.tif"]);
}

#[test]
fn files_that_are_not_there_are_told() {
    let missing = folder(r#"sources = ["dem.tif"]"#, &[]);
    check_told(
        missing.path(),
        &[
            r#"ROOT/jobs/ntc.toml:8: dem.sources[0]: found "dem.tif", which cannot be opened, expected a raster file"#,
            "hint: paths are relative to the folder of the job file, ROOT/jobs",
        ],
    );
    let polygons =
        folder("source = \"sample\"\n[importance]\nareas = [{ file = \"m.geojson\", class = \"m\", weight = 1 }]", &[]);
    check_told(
        polygons.path(),
        &[
            r#"ROOT/jobs/ntc.toml:10: importance.areas[0].file: found "m.geojson","#,
            "which cannot be opened, expected a file",
            "hint: paths are relative to the folder of the job file, ROOT/jobs",
        ],
    );
    let folder_named = folder(r#"sources = ["dem"]"#, &["dem/a.tif"]);
    check_told(
        folder_named.path(),
        &[
            r#"ROOT/jobs/ntc.toml:8: dem.sources[0]: found "dem", which is a folder, expected a raster file"#,
            "hint: its files are dem/*.tif",
        ],
    );
}

#[test]
fn patterns_that_find_nothing_or_are_none_are_told() {
    let empty = folder(r#"sources = ["dem/*.tif"]"#, &["dem/a.txt"]);
    check_told(
        empty.path(),
        &[
            r#"ROOT/jobs/ntc.toml:8: dem.sources[0]: found "dem/*.tif", which no file matches,"#,
            "expected a pattern that finds a raster file",
            "hint: paths are relative to the folder of the job file, ROOT/jobs",
        ],
    );
    let broken = folder(r#"sources = ["dem/[a.tif"]"#, &["dem/a.tif"]);
    check_told(
        broken.path(),
        &[
            r#"ROOT/jobs/ntc.toml:8: dem.sources[0]: found "dem/[a.tif", expected a pattern (invalid range pattern)"#,
            "hint: * is any part of a name, ** any folders",
        ],
    );
}

#[cfg(unix)]
#[test]
fn links_may_not_leave_their_folder() {
    use std::os::unix::fs::symlink;
    for source in ["dem/a.tif", "dem/*.tif"] {
        let folder = folder(&format!("sources = [\"{source}\"]"), &["dem/inside.txt", "../far/b.tif"]);
        symlink(folder.path().join("far/b.tif"), folder.path().join("jobs/dem/a.tif")).unwrap();
        let found = format!(
            "ROOT/jobs/ntc.toml:8: dem.sources[0]: found \"{source}\", where ROOT/jobs/dem/a.tif is a link to \
             ROOT/far/b.tif, expected files below ROOT/jobs/dem"
        );
        let hint = "hint: name the file that the link leads to; a named file may lie anywhere";
        check_told(folder.path(), &[&found, hint]);
    }
    // A link that stays at home is a name like any other.
    let home = folder(r#"sources = ["dem/*.tif"]"#, &["dem/inside.txt"]);
    symlink("inside.txt", home.path().join("jobs/dem/a.tif")).unwrap();
    check_found(home.path(), &["dem/a.tif"]);
}

#[cfg(unix)]
#[test]
fn a_pattern_does_not_follow_a_linked_folder_outside() {
    use std::os::unix::fs::symlink;
    let folder = folder(r#"sources = ["dem/*/*.tif"]"#, &["dem/near/a.tif", "../far/b.tif"]);
    symlink(folder.path().join("far"), folder.path().join("jobs/dem/out")).unwrap();
    assert!(matches!(load(folder.path()), Err(JobError::LeavesFolder(_))));
}

#[test]
fn a_job_file_that_is_none_is_told() {
    let empty = tempfile::tempdir().unwrap();
    let told = load(empty.path()).expect_err("there is no job").to_string();
    assert!(told.ends_with("jobs/ntc.toml: found nothing there, expected a job file"), "{told}");

    let folder = folder("", &[]);
    fs::write(folder.path().join("jobs/ntc.toml"), b"[area]\n\xFF\xFE").unwrap();
    let hint = "hint: a job is text; for a raster this writes one: tiefort init ROOT/jobs/ntc.toml --out mine.toml";
    check_told(
        folder.path(),
        &["ROOT/jobs/ntc.toml: found bytes that are not UTF-8 after byte 7, expected a TOML file", hint],
    );
    let hint = "hint: a working job starts with [area] and name, crs, origin_m, size_m, spacing_m";
    fs::write(folder.path().join("jobs/ntc.toml"), vec![b'#'; 2_000_000]).unwrap();
    check_told(
        folder.path(),
        &["ROOT/jobs/ntc.toml: found 2000000 bytes, expected a job file of at most 1048576", hint],
    );
}
