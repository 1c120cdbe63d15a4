//! `[features]`: every value that cannot be, and what it does not go with.

use super::{check, check_part};

/// What is told of a sound job with these keys in `[features]`.
#[track_caller]
fn check_keys(keys: &str, expected: &str) {
    check_part("pool", &format!("pool = 0\n[features]\n{keys}"), expected);
}

#[track_caller]
fn check_rule(keys: &str, expected: &str) {
    check_keys(&format!("sources = [\"r.gpkg\"]\nrules = [{{ {keys} }}]"), expected);
}

#[test]
fn a_section_of_features_names_its_sources() {
    check(
        "pool",
        "pool = 0\n[features]",
        &[
            "a/b.toml:17: features.sources: found nothing, expected a list of 1 to 4096 paths and patterns of files,",
            r#"or "sample" for the features of the built-in terrain"#,
            r#"hint: for example sources = ["roads.osm.pbf", { file = "hydro.gpkg", layer = "rivers" }]"#,
        ],
    );
    check_keys("sources = []", "features.sources: found [], expected a list of 1 to 4096 paths");
    check_keys("sources = \"r.gpkg\"", "features.sources: found the text \"r.gpkg\", expected a list of 1 to 4096");
    check_keys("sources = [3]", "features.sources[0]: found the whole number 3, expected a list of");
    check_keys("sources = [\"\"]", "features.sources[0]: found \"\", expected the path of a file");
    check_keys("sources = [\"*/../x.gpkg\"]", "hint: name the folder first: sources = [\"../other/*.gpkg\"]");
    check_keys("sources = [{ layer = \"a\" }]", "features.sources[0].file: found nothing, expected the path of a file");
    check_keys("sources = [{ file = \"a.gpkg\", layr = \"a\" }]", "hint: did you mean layer?");
    let layer = "features.sources[0].layer: found \"\", expected the name of a layer of a GeoPackage, 1 to 255";
    check_keys("sources = [{ file = \"a.gpkg\", layer = \"\" }]", layer);
    check_keys(
        "sources = [\"sample\", \"sample\"]",
        "found \"sample\" beside the same before it, expected \"sample\" once",
    );
}

#[test]
fn unknown_kinds_are_told_with_the_nearest_one() {
    let of = |kind: &str| format!("sources = [{{ file = \"a.gpkg\", kind = {kind} }}]");
    check_keys(&of("\"lakes\""), "features.sources[0].kind: found \"lakes\", expected \"motorway\" or \"primary\" or");
    check_keys(&of("\"lakes\""), "hint: did you mean \"lake\"?");
    check_keys(&of("\"none\""), "features.sources[0].kind: found \"none\", expected \"motorway\"");
    check_keys(&of("7"), "features.sources[0].kind: found the whole number 7, expected \"motorway\"");
    check_rule("where = {}, kind = \"road track\"", "hint: did you mean \"track\"?");
    check_rule("where = {}, kind = \"footpath\"", "or \"breakline\"");
    check_rule(
        "where = {}, form = \"polygon\"",
        "found \"polygon\", expected \"line\" or \"auto\" or \"strip\" or \"bench\"",
    );
    check_rule("where = {}, z = \"features\"", "hint: did you mean \"feature\"?");
}

#[test]
fn widths_grades_and_shares_lie_within_their_bounds() {
    for width in ["0", "-3", "1e9", "500.5"] {
        let expected = format!("rules[0].width_m: found {width}, expected metres from 0.01 to 500");
        check_rule(&format!("where = {{}}, width_m = {width}"), &expected);
    }
    check_rule("where = {}, width_m = \"wide\"", "width_m: found the text \"wide\", expected metres from 0.01 to 500");
    check_rule("where = {}, width_m = nan", "width_m: found nan, expected a finite number: metres from 0.01 to 500");
    for grade in ["0", "-1", "101", "1e9"] {
        let expected = format!("rules[0].grade_max_percent: found {grade}, expected percent from 0.01 to 100");
        check_rule(&format!("where = {{}}, grade_max_percent = {grade}"), &expected);
    }
    for share in ["0", "2", "-0.5", "1e-9"] {
        let expected = format!("features.share_max: found {share}, expected a share from 0.01 to 1");
        check_keys(&format!("sources = [\"r.gpkg\"]\nshare_max = {share}"), &expected);
    }
    for key in ["clearance_road_m", "clearance_rail_m", "clearance_water_m"] {
        for wrong in ["-1", "101"] {
            let expected = format!("features.{key}: found {wrong}, expected metres from 0 to 100");
            check_keys(&format!("sources = [\"r.gpkg\"]\n{key} = {wrong}"), &expected);
        }
    }
    let bank = "features.bank_m: found 1001, expected metres along the way from 0 to 1000";
    check_keys("sources = [\"r.gpkg\"]\nbank_m = 1001", bank);
}

#[test]
fn tags_of_a_rule_are_texts() {
    let expected = "expected a table of tags with a value or a list of values each, [] for any, keys and values of 1";
    check_rule("kind = \"track\"", "features.rules[0].where: found nothing, expected a table of tags with");
    check_rule("where = \"track\"", &format!("rules[0].where: found the text \"track\", {expected}"));
    check_rule("where = { lanes = 2 }", &format!("rules[0].where.lanes: found the whole number 2, {expected}"));
    // A tag may be called as a key of a rule is.
    check_rule("where = { class = [2] }", &format!("rules[0].where.class[0]: found the whole number 2, {expected}"));
    check_rule("where = { \"a.b\" = [\"\"] }", &format!("rules[0].where: found {{ \"a.b\" = [\"\"] }}, {expected}"));
    check_rule("where = { class = [2] }", "hint: for example where = { highway = [\"track\", \"path\"], surface");
    let long = format!("where = {{ name = \"{}\" }}", "x".repeat(256));
    check_rule(&long, "features.rules[0].where: found { name = \"xxx");
    check_keys("sources = [\"r.gpkg\"]\nrules = 3", "features.rules: found the whole number 3, expected a list of");
    check_keys(
        "sources = [\"r.gpkg\"]\nrules = [3]",
        "features.rules[0]: found the whole number 3, expected a table of",
    );
}

#[test]
fn classes_of_rules_have_plain_names_and_all_of_them_are_few_enough() {
    let expected = "expected the name of a class, 1 to 100 letters, digits, '-' or '_'";
    for class in ["", "dirt road", "straße", "a.b"] {
        check_rule(&format!("where = {{}}, class = \"{class}\""), &format!("class: found \"{class}\", {expected}"));
    }
    check_rule("where = {}, class = \"hole\"", "expected another name for a class of the job");
    let rules: Vec<String> = (0..300).map(|class| format!("{{ where = {{}}, class = \"c{class}\" }}")).collect();
    let keys = format!("sources = [\"r.gpkg\"]\nrules = [{}]", rules.join(", "));
    check_keys(&keys, "expected at most 255 classes in all, not 312");
}

#[test]
fn features_that_are_left_out_have_nothing_else() {
    let expected = "features.rules[0].width_m: found 3 beside kind = \"none\", expected no more keys";
    check_rule("where = {}, kind = \"none\", width_m = 3", expected);
    check_rule("where = {}, kind = \"none\", z = \"dem\"", "rules[0].z: found \"dem\" beside kind = \"none\"");
}

#[test]
fn what_would_undo_features_is_refused_beside_them() {
    check(
        "method",
        "method = \"paper\"\npoints = 9\n[features]\nsources = [\"r.gpkg\"]",
        &[
            r#"a/b.toml:18: tin.method: found "paper" beside [features], expected "optimised" or "greedy", since the"#,
            "paper's TIN has no edges that must stay",
            "hint: remove method, or leave [features] out",
        ],
    );
    check(
        "source",
        "source = \"sample\"\nwater = \"lakes.gpkg\"\n[features]\nsources = [\"r.gpkg\"]",
        &[
            r#"a/b.toml:9: dem.water: found "lakes.gpkg" beside [features], expected no water in [dem], since lakes"#,
            "of features lie level by rules of their own",
            r#"hint: move the file: sources = [{ file = "lakes.gpkg", kind = "lake" }] in [features]"#,
        ],
    );
    check(
        "source",
        "sources = [\"a.tif\"]\n[features]\nsources = [\"sample\"]",
        &[
            r#"a/b.toml:10: features.sources[0]: found "sample" beside dem.sources, expected a file, since only the"#,
            "built-in terrain brings features of its own",
            r#"hint: a file of that name is { file = "sample" }"#,
        ],
    );
    let clip = "edges = \"clip\"\n[features]\nsources = [\"r.gpkg\"]";
    check_part("side_m", clip, "hint: write edges = \"constrained\"");
}

#[test]
fn clipped_edges_beside_features_are_refused_with_a_method_that_could_clip() {
    let text = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [5000, 5000]\nspacing_m = 25\n\
        [dem]\nsource = \"sample\"\n[features]\nsources = [\"sample\"]\n[load_modules]\nedges = \"clip\"\n\
        [tin]\nmethod = \"greedy\"\npoints = 9\n";
    let error = job::Job::from_text(text, std::path::Path::new("a.toml")).unwrap_err();
    assert_eq!(
        super::told(&error),
        "a.toml:12: load_modules.edges: found \"clip\" beside [features], expected \"constrained\", since clipping \
         would cut the edges of features hint: remove edges, or leave [features] out"
    );
}
