//! The keys of `[objects]`: what each means, what it may be, and what holds where a job leaves it out.

use terrain::ObjectKind;

use crate::bounds::{
    CANOPY_CELL_M, FEATURE_SOURCES_MAX, LAYER_CHARS_MAX, OBJECT_AREA_M2, OBJECT_CORNERS, OBJECT_HEIGHT_M, OBJECT_LIMIT,
    RULES_MAX, TAG_CHARS_MAX, WKT_CHARS_MAX,
};
use crate::key::FILE_SAYS;
use crate::{Choice, Key};

pub(crate) const OBJECTS: &[Key] = &[
    Key::new("sources", "files of polygons and lines; a path, a pattern or a table each")
        .bounded(|| format!("a list of 1 to {FEATURE_SOURCES_MAX} paths and patterns of files"))
        .otherwise("the files of [features]")
        .example("sources = [\"town.osm.pbf\", { file = \"houses.gpkg\", kind = \"building\", height = \"h_m\" }]"),
    Key::new("rules", "what becomes of objects with certain tags; tried in order, before the built-in table")
        .bounded(|| format!("a list of at most {RULES_MAX} rules, each {{ where = {{ … }}, kind = … }}"))
        .otherwise("the built-in table alone")
        .example("rules = [{ where = { building = [\"ruins\"] }, kind = \"none\" }]"),
    Key::new("corners_max", "corners of a building at most; right angles stay where others are taken away")
        .whole("corners", OBJECT_CORNERS)
        .usual("15"),
    Key::new("area_min_m2", "square metres under which a building is left out")
        .number("square metres", OBJECT_AREA_M2)
        .usual("20"),
    Key::new("limits", "how many of them there may be")
        .form("a table of per_load_module, per_4km_square and joint")
        .otherwise("what holds of each of its keys")
        .example("limits = { per_load_module = 800, per_4km_square = 25600 }"),
];

pub(crate) const OBJECT_LIMITS: &[Key] = &[
    Key::new("per_load_module", "roofs, walls and triangles of woods in a load module; what hides least is left out")
        .whole("polygons", OBJECT_LIMIT)
        .usual("400"),
    Key::new("per_4km_square", "the same in every square of 4 km").whole("polygons", OBJECT_LIMIT).usual("12800"),
    Key::new("joint", "count them in `[limits]` too; they take at most half of what first points and features leave")
        .usual("false"),
];

pub(crate) const OBJECT_SOURCES: &[Key] = &[
    Key::new("file", "OpenStreetMap data as .pbf, GeoPackage, Shapefile, GeoJSON, or a raster of heights of leaves")
        .form("the path of a file of polygons and lines, or of a raster")
        .example(SOURCE),
    Key::new("layer", "its layer")
        .line("the name of a layer of a GeoPackage", LAYER_CHARS_MAX)
        .otherwise("its only one")
        .example("{ file = \"town.gpkg\", layer = \"houses\" }"),
    Key::new("kind", "what its polygons and lines are, whatever their tags say; rules come first")
        .words::<ObjectKind>()
        .otherwise("as rules and tags say")
        .example(SOURCE),
    Key::new("height", "the attribute that says how high they are, in metres where it names no unit")
        .line("the name of an attribute", TAG_CHARS_MAX)
        .otherwise("height")
        .example(SOURCE),
    Key::new("crs", "the system of its coordinates, where it names none or a wrong one; not of OpenStreetMap data")
        .line("a coordinate system, as \"EPSG:4326\" or well-known text", WKT_CHARS_MAX)
        .otherwise(FILE_SAYS)
        .example("{ file = \"houses.shp\", crs = \"EPSG:32611\" }"),
    Key::new("least_m", "of a raster of heights of leaves: the height under which there is no wood")
        .number("metres", OBJECT_HEIGHT_M)
        .usual("3")
        .example(CANOPY),
    Key::new("cell_m", "of a raster of heights of leaves: the side of the cells that woods are made of")
        .number("metres", CANOPY_CELL_M)
        .usual("12.5")
        .example(CANOPY),
];

const CANOPY: &str = "{ file = \"canopy.tif\", least_m = 3, cell_m = 12.5 }";

const SOURCE: &str = "{ file = \"houses.gpkg\", kind = \"building\", height = \"h_m\" }";

pub(crate) const OBJECT_RULES: &[Key] = &[
    Key::new("where", "tags or attribute columns, all of which an object must have; empty for every object")
        .bounded(|| {
            let values = "a value or a list of values each, [] for any";
            format!("a table of tags with {values}, keys and values of 1 to {TAG_CHARS_MAX} characters")
        })
        .example("where = { building = [\"silo\"] }"),
    Key::new("kind", "what it is; \"none\" leaves it out")
        .bounded(|| {
            let words: Vec<String> = ObjectKind::WORDS.iter().map(|word| format!("\"{}\"", word.name)).collect();
            format!("\"none\", {}", words.join(", "))
        })
        .otherwise("as the built-in table or the source says")
        .example("kind = \"tower\""),
    Key::new("height_m", "how high it is")
        .number("metres", OBJECT_HEIGHT_M)
        .otherwise("as its tags say, else as usual for its kind")
        .example("height_m = 18"),
];
