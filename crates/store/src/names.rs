//! Names of files and folders inside a database's directory.

/// Names of files inside the directory.
pub mod files {
    /// What is there; written last.
    pub const DATABASE: &str = "database.json";
    /// What a run found.
    pub const REPORT: &str = "report.json";
    /// The same for a browser.
    pub const REPORT_HTML: &str = "report.html";
    /// Limits that could not be met, on a map.
    pub const BREACHES: &str = "breaches.geojson";
    /// The same as a table.
    pub const BREACHES_CSV: &str = "breaches.csv";
    /// What was mended, degraded or left out of roads, rivers and lakes, on a map.
    pub const FEATURES: &str = "features.geojson";
    /// Roads, rivers and lakes as they are in the ground, as layers.
    pub const FEATURES_GPKG: &str = "features.gpkg";
    /// What each tile may spend.
    pub const ALLOCATION: &str = "survey/allocation.json";
    /// What features of the area came to: their heights, their cost, what was mended.
    pub const LEVEL: &str = "survey/features.level";
    /// What stands on the ground, before its heights are known.
    pub const OUTLINES: &str = "survey/objects.outlines";
    /// What of it had no room.
    pub const OBJECTS: &str = "objects.geojson";
    /// What a report lists of what is written beside it, where a build has it.
    pub const BESIDE_REPORT: [&str; 6] = [REPORT_HTML, BREACHES, BREACHES_CSV, FEATURES, FEATURES_GPKG, OBJECTS];
    /// Buildings of the sources of features, which are drawn only.
    pub const BUILDINGS: &str = "survey/features.buildings";
}

/// Folder of the tiles' TINs.
pub(crate) const TILES: &str = "tiles";
/// Folder of the load modules.
pub(crate) const MODULES: &str = "modules";
/// Folder of what was measured of them.
pub(crate) const MEASURED: &str = "measured";
/// Folder of the survey.
pub(crate) const SURVEY: &str = "survey";
/// The folders of a database that stay.
pub const FOLDERS: [&str; 4] = [TILES, MODULES, MEASURED, SURVEY];
/// Folder of leases and marks, gone at the end of a build.
pub(crate) const WORK: &str = "work";
