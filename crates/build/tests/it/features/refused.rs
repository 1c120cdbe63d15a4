//! What cannot be with features is refused by name.

use super::drawing::{Drawing, geojson, line};
use crate::scene::Words;

#[test]
fn clipped_edges_and_the_papers_method_are_refused_with_features() {
    let words = Drawing::words();
    let all = [
        (
            Words {
                modules: "edges = \"clip\"".into(),
                tin: "method = \"greedy\"\npoints = 200".into(),
                ..words.clone()
            },
            "load_modules.edges",
        ),
        (Words { tin: "method = \"paper\"\npoints = 200".into(), ..words }, "tin.method"),
    ];
    for (words, key) in all {
        let error = job::Job::from_text(&words.text(), std::path::Path::new("job.toml")).unwrap_err().to_string();
        assert!(error.contains(key) && error.contains("features"), "{error}");
    }
}

#[test]
fn a_file_that_cannot_be_read_ends_the_build_and_single_features_never_do() {
    let drawing = Drawing::new(|_, _| 500.0, &[line("highway=primary width=wide", &[(100.0, 100.0), (900.0, 100.0)])]);
    assert!(drawing.built().was_told("width = \"wide\""));
    let path = drawing.scene.path("features.geojson");
    let text = geojson(&[line("highway=primary", &[(100.0, 100.0), (900.0, 100.0)])]);
    std::fs::write(&path, &text[..text.len() / 2]).unwrap();
    let error = drawing.scene.try_build("area.tdb", 2).unwrap_err();
    assert!(error.to_string().contains("features.geojson"), "{error}");
}
