//! The addresses of databases, as OpenAPI and the router write them.

pub const DATABASES: &str = "/databases.json";
pub const DATABASE: &str = "/{database}";
pub const LAYER: &str = "/{database}/layer.json";
pub const TERRAIN: &str = "/{database}/{z}/{x}/{file}";
pub const HOLES: &str = "/{database}/holes.geojson";
pub const TILESET: &str = "/{database}/tileset.json";
pub const SQUARE: &str = "/{database}/squares/{file}";
pub const GROUP: &str = "/{database}/groups/{file}";
pub const LEVEL: &str = "/{database}/levels/{level}/{file}";
pub const MODULES: &str = "/{database}/modules";
pub const MODULE: &str = "/{database}/modules/{file}";
pub const HEIGHTS: &str = "/{database}/heights";
pub const SIGHT: &str = "/{database}/line-of-sight";
pub const VIEWSHED: &str = "/{database}/viewshed";
pub const PROFILE: &str = "/{database}/profile";
pub const OBSTACLE: &str = "/{database}/obstacle";
pub const EXPLAIN: &str = "/{database}/explain";
