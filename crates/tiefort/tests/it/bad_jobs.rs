//! Bad jobs, one by one: the error names the file, the line and the key.

use crate::scene::Scene;

/// `small.toml` with `from` in place of `to` must be refused in words that hold all of `parts`, by every command that
/// reads a job.
#[track_caller]
fn check(from: &str, to: &str, parts: &[&str]) {
    let scene = Scene::with_job("small.toml", &[(from, to)]);
    for arguments in [&["build", "job.toml", "--out", "x.tdb"][..], &["plan", "job.toml"], &["tile", "job.toml", "0,0"]]
    {
        scene.refuses(arguments, parts);
    }
}

#[test]
fn a_spacing_that_does_not_divide() {
    check("spacing_m = 25", "spacing_m = 24", &["job.toml:", "spacing_m", "24"]);
    check("spacing_m = 25", "spacing_m = 25.27", &["job.toml:", "spacing_m", "25.27"]);
}

#[test]
fn a_spacing_that_is_none() {
    for wrong in ["0", "-25", "nan", "inf", "1e300", "\"fine\""] {
        check("spacing_m = 25", &format!("spacing_m = {wrong}"), &["job.toml:", "area.spacing_m", "expected"]);
    }
}

#[test]
fn an_area_of_no_size() {
    for wrong in ["[0, 4000]", "[4000, -4000]", "[4000]", "[4100, 4000]", "[1e15, 1e15]", "[nan, 4000]", "4000"] {
        check("size_m = [4000, 4000]", &format!("size_m = {wrong}"), &["job.toml:", "area.size_m", "expected"]);
    }
}

#[test]
fn a_number_of_tiles_that_cannot_be() {
    for wrong in ["0", "-1", "5", "1000000"] {
        check("columns = 2", &format!("columns = {wrong}"), &["job.toml:", "tiles.columns", "expected"]);
    }
}

#[test]
fn a_key_that_no_job_has() {
    check("spacing_m = 25", "spacing_m = 25\nspacnig_m = 30", &["job.toml:9", "area.spacnig_m", "expected"]);
    check("[tiles]", "[tils]", &["job.toml:", "tils"]);
}

#[test]
fn a_limit_below_what_is_there_before_any_point() {
    check("mean_per_load_module = 32", "mean_per_load_module = 1", &["mean_per_load_module", "expected"]);
}

#[test]
fn a_limit_that_is_none() {
    for wrong in ["0", "-1", "1e30"] {
        let limit = format!("per_load_module = {wrong}");
        check("per_load_module = 100", &limit, &["job.toml:", "limits.per_load_module", "expected"]);
    }
}

#[test]
fn a_job_that_is_no_toml() {
    check("[area]", "[area", &["job.toml:3", "not TOML"]);
}
