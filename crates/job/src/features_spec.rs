//! What a job says about roads, rivers and lakes that become parts of the ground.

use features::{FallOptions, GradeOptions, Kind, Rule};

use crate::{ImportanceSpec, NamedFile};

/// Roads, rivers and lakes that become parts of the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct FeaturesSpec {
    /// Where they come from. The order decides nothing but how remarks number features.
    pub sources: Vec<FeatureSource>,
    /// What features are by their tags; tried in order, before the built-in table.
    pub rules: Vec<Rule>,
    /// Whether buildings are kept beside the ground, to be drawn.
    pub buildings: bool,
    /// The share of each limit that features may take while motorways, primary roads, railways, rivers and lakes of a
    /// hectare and more are granted, from 0 to 1; never less than `share_max`.
    pub share_main: f64,
    /// The share of each limit that features may take, from 0 to 1.
    pub share_max: f64,
    /// Times that posts weigh which lie on features that there was no room for.
    pub left_out_weight: f64,
    /// How many times its greatest grade a road may be where limits of cut and fill ask for it, from 1.
    pub grade_give: f64,
    /// How high decks stand over what they cross, where they rest, and how far roads follow the ground.
    pub options: GradeOptions,
    /// How rivers follow the ground.
    pub falls: FallOptions,
}

/// Where features come from.
#[derive(Clone, Debug, PartialEq)]
pub enum FeatureSource {
    /// Those that the built-in terrain brings (only with [`crate::DemSource::Sample`]).
    Sample,
    /// A file of lines and polygons.
    File {
        /// The file.
        file: NamedFile,
        /// Its layer, where it has several.
        layer: Option<String>,
        /// The kind of its features, whatever their tags say; rules come first.
        kind: Option<Kind>,
        /// The system of its coordinates as the job names it, whatever the file says.
        crs: Option<String>,
    },
}

/// Where the heights of features come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightsFrom {
    /// The DEM.
    Dem,
    /// The features' own vertices.
    Feature,
}

impl FeaturesSpec {
    /// The files, each once, in the order of their entries.
    pub fn files(&self) -> Vec<&NamedFile> {
        let mut files: Vec<&NamedFile> = Vec::new();
        for source in &self.sources {
            let FeatureSource::File { file, .. } = source else { continue };
            if !files.iter().any(|other| other.path == file.path) {
                files.push(file);
            }
        }
        files
    }

    /// How large the files are; those that cannot be found have no size.
    pub fn bytes_on_disk(&self) -> u64 {
        self.files().iter().filter_map(|file| Some(std::fs::metadata(&file.path).ok()?.len())).sum()
    }

    /// Whether a database has a file of buildings: the job wants it, and has a file that may hold some.
    pub fn has_buildings(&self) -> bool {
        self.buildings && self.sources.iter().any(|source| matches!(source, FeatureSource::File { .. }))
    }

    /// Keys of tags that rules look at, sorted, each once.
    pub fn keys(&self) -> Vec<&str> {
        let mut keys: Vec<&str> = self.rules.iter().flat_map(|rule| &rule.tags).map(|(key, _)| key.as_str()).collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    /// Names of the classes that features may have, in the order of the table of kinds.
    pub fn classes(&self) -> Vec<String> {
        features::class_names(&self.rules)
    }

    /// All classes: those of the ground, as in [`ImportanceSpec::classes`], then those of features that are not among
    /// them, at most 255 together. They follow from the job alone.
    pub fn classes_after(&self, ground: &ImportanceSpec) -> Vec<String> {
        let mut all = ground.classes.clone();
        all.extend(self.classes().into_iter().filter(|class| !ground.classes.contains(class)));
        all
    }
}
