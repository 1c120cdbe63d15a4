//! A first look at files of roads, rivers and lakes, for the job that is suggested.

use std::path::{Path, PathBuf};

use crate::CompileError;
use crate::ground::{FeaturesSeen, GroundError, features_in};
use source_files::feature_layers;

use crate::workbench::Suggestion;

/// A file of features, or one layer of it.
#[derive(Clone, Debug)]
pub struct SeenFeatures {
    /// The file.
    pub path: PathBuf,
    /// The layer, where the file has several.
    pub layer: Option<String>,
    /// What of it lies in the area.
    pub seen: FeaturesSeen,
    /// Where no tag says a kind: the kind that the name of the layer or the file suggests.
    pub kind_by_name: Option<&'static str>,
    /// The same of objects.
    pub object_by_name: Option<&'static str>,
}

/// Parts of names, the kinds that they suggest, and whether those are polygons; `None` where they may be either.
const NAMES: [(&str, &str, Option<bool>); 17] = [
    ("motorway", "motorway", Some(false)),
    ("highway", "primary", Some(false)),
    ("track", "track", Some(false)),
    ("trail", "track", Some(false)),
    ("road", "minor", Some(false)),
    ("street", "minor", Some(false)),
    ("rail", "rail", Some(false)),
    ("runway", "runway", None),
    ("stream", "stream", Some(false)),
    ("creek", "stream", Some(false)),
    ("river", "river", None),
    ("canal", "river", None),
    ("lake", "lake", Some(true)),
    ("reservoir", "lake", Some(true)),
    ("pond", "lake", Some(true)),
    ("playa", "lake", Some(true)),
    ("water", "lake", Some(true)),
];

/// Parts of names that suggest other things: lines of several kinds, which only their attributes tell apart.
const OTHERS: [&str; 4] = ["shore", "coast", "border", "boundar"];

/// Looks at files of features, each layer of a GeoPackage alone.
///
/// # Errors
/// When one cannot be read.
pub fn look_at_features(paths: &[PathBuf], suggestion: &Suggestion) -> Result<Vec<SeenFeatures>, CompileError> {
    let mut all = Vec::new();
    for path in paths {
        let layers = feature_layers(path).map_err(GroundError::from)?;
        let layers = match layers.len() {
            0 | 1 => vec![None],
            _ => layers.into_iter().map(Some).collect(),
        };
        for layer in layers {
            let area = [suggestion.origin_m, suggestion.size_m];
            let seen = features_in(path, layer.as_deref(), suggestion.epsg, area)?;
            let says_none = seen.kinds.is_empty() && seen.objects.is_empty() && 0 < seen.without_kind;
            let kind_by_name = says_none.then(|| kind_by_name(path, layer.as_deref(), &seen)).flatten();
            let is_open = says_none && kind_by_name.is_none();
            let object_by_name = is_open.then(|| object_by_name(path, layer.as_deref(), &seen)).flatten();
            all.push(SeenFeatures { path: path.clone(), layer, seen, kind_by_name, object_by_name });
        }
    }
    Ok(all)
}

/// Parts of names, and the kinds of objects that polygons with them are.
const OBJECT_NAMES: [(&str, &str); 7] = [
    ("building", "building"),
    ("house", "building"),
    ("footprint", "building"),
    ("forest", "wood"),
    ("wood", "wood"),
    ("tree", "wood"),
    ("canopy", "wood"),
];

/// The kind of object that the name of a layer suggests, or else that of its file.
fn object_by_name(path: &Path, layer: Option<&str>, seen: &FeaturesSeen) -> Option<&'static str> {
    let of = |name: String| OBJECT_NAMES.iter().find(|(part, _)| name.contains(part)).map(|(_, kind)| *kind);
    (seen.are_polygons == Some(true)).then(|| names(path, layer).filter_map(of).next()).flatten()
}

/// The name of a layer and that of its file, in small letters.
fn names(path: &Path, layer: Option<&str>) -> impl Iterator<Item = String> {
    let file = path.file_name().map(|name| name.to_string_lossy().to_lowercase());
    layer.map(str::to_lowercase).into_iter().chain(file)
}

/// The kind that the name of a layer suggests, or else that of its file; none where that names ways and waters, or what
/// is neither.
fn kind_by_name(path: &Path, layer: Option<&str>, seen: &FeaturesSeen) -> Option<&'static str> {
    let fits = |shape: Option<bool>| shape.is_none() || seen.are_polygons == shape;
    let of = |name: String| {
        let found =
            || NAMES.iter().filter(|(part, _, shape)| name.contains(part) && fits(*shape)).map(|(_, kind, _)| *kind);
        let is_water = |kind: &str| ["stream", "river", "lake"].contains(&kind);
        let is_mixed = found().any(is_water) && !found().all(is_water) || OTHERS.iter().any(|part| name.contains(part));
        found().next().filter(|_| !is_mixed)
    };
    names(path, layer).filter_map(of).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(file: &str, layer: Option<&str>, are_polygons: Option<bool>, expected: Option<&str>) {
        let (found, kinds, notes) = (1, Vec::new(), Vec::new());
        let (objects, coastlines) = (Vec::new(), 0);
        let seen = FeaturesSeen { found, outside: 0, kinds, objects, without_kind: 1, coastlines, are_polygons, notes };
        assert_eq!(kind_by_name(Path::new(file), layer, &seen), expected);
    }

    #[test]
    fn a_name_suggests_a_kind_of_the_shape_that_there_is() {
        check("in/Lakes.shp", None, Some(true), Some("lake"));
        check("in/lakes.shp", None, Some(false), None);
        check("tiger_roads.geojson", None, Some(false), Some("minor"));
        check("hydro.gpkg", Some("Rivers"), Some(false), Some("river"));
        check("roads.gpkg", Some("water"), Some(true), Some("lake"));
        check("roads.gpkg", Some("a"), None, None);
        check("streams.geojson", None, Some(false), Some("stream"));
        check("data.geojson", None, Some(false), None);
        check("shores_rivers.geojson", None, Some(false), None);
        check("roads_rivers.geojson", None, Some(false), None);
        check("rivers_streams.geojson", None, Some(false), Some("stream"));
    }

    #[test]
    fn every_kind_that_a_name_suggests_is_one() {
        let words: Vec<&str> = <job::FeatureKind as job::Choice>::WORDS.iter().map(|word| word.name).collect();
        assert!(NAMES.iter().all(|(_, kind, _)| words.contains(kind)));
        let words: Vec<&str> = <terrain::ObjectKind as job::Choice>::WORDS.iter().map(|word| word.name).collect();
        assert!(OBJECT_NAMES.iter().all(|(_, kind)| words.contains(kind)));
    }
}
