//! The keys of `[features]` and `[objects]`: what each means, what it may be, and what holds where a job leaves it out.

use std::ops::RangeInclusive;

use features::{Form, Kind, RuleKind};
use terrain::ObjectKind;

use crate::bounds::{
    BANK_M_MAX, CANOPY_CELL_M, CLEARANCE_M_MAX, EARTHWORK_M_MAX, FEATURE_SOURCES_MAX, GRADE_GIVE, LAYER_CHARS_MAX,
    LEFT_OUT_WEIGHT, NAME_CHARS_MAX, OBJECT_AREA_M2, OBJECT_CORNERS, OBJECT_HEIGHT_M, OBJECT_LIMIT, RIVER_TAU,
    RULE_GRADE_PERCENT, RULE_WIDTH_M, RULES_MAX, SHARE_MAX, SMOOTH_POSTS, TAG_CHARS_MAX, WKT_CHARS_MAX,
};
use crate::key::FILE_SAYS;
use crate::{Choice, HeightsFrom, Key};

pub(crate) const FEATURES: &[Key] = &[
    Key::new("sources", "files of lines and polygons; a path, a pattern or a table each")
        .bounded(|| {
            let sample = "or \"sample\" for the features of the built-in terrain";
            format!("a list of 1 to {FEATURE_SOURCES_MAX} paths and patterns of files, {sample}")
        })
        .example("sources = [\"roads.osm.pbf\", { file = \"hydro.gpkg\", layer = \"rivers\" }]"),
    Key::new("rules", "what becomes of features with certain tags; tried in order, before the built-in table")
        .bounded(|| format!("a list of at most {RULES_MAX} rules, each {{ where = {{ … }}, kind = … }}"))
        .otherwise("the built-in table alone")
        .example("rules = [{ where = { highway = \"path\" }, kind = \"track\", width_m = 2 }]"),
    Key::new("buildings", "keep buildings, which `tiefort view` draws as blocks; they are no part of the ground")
        .usual("true"),
    Key::new(
        "share_main",
        "of each limit, how much features may take for motorways, primary, rail, river, larger lakes",
    )
    .number("a share", SHARE_MAX)
    .usual("0.8"),
    Key::new("share_max", "of each limit, how much features may take for all others, and to be finer and wider")
        .number("a share", SHARE_MAX)
        .usual("0.5"),
    Key::new(
        "left_out_weight",
        "times that posts weigh on roads and in water that had no room and only shape the ground",
    )
    .number("a factor", LEFT_OUT_WEIGHT)
    .usual("2"),
    Key::new("clearance_road_m", "what decks keep clear of above roads and runways")
        .number(HIGH, CLEARANCE)
        .usual("4.5"),
    Key::new("clearance_rail_m", "what decks keep clear of above railways").number(HIGH, CLEARANCE).usual("6"),
    Key::new("clearance_water_m", "what decks keep clear of above water").number(HIGH, CLEARANCE).usual("1"),
    Key::new("bank_m", "how far back from a deck its bank may sag: decks rest on the highest ground within it")
        .number("metres along the way", 0.0..=BANK_M_MAX)
        .usual("100"),
    Key::new("cut_max_m", "how deep roads and rivers may cut into the ground before grades give way")
        .number(HIGH, EARTHWORK_M)
        .usual("10"),
    Key::new("fill_max_m", "how high roads and rivers may be filled before grades give way")
        .number(HIGH, EARTHWORK_M)
        .usual("10"),
    Key::new("grade_give", "how many times its greatest grade a road may be where those limits ask for it; 1: never")
        .number("a factor", GRADE_GIVE)
        .usual("1.5"),
    Key::new("clip_m", "heights of the DEM farther than this from a first fit are taken for errors")
        .number(HIGH, EARTHWORK_M)
        .usual("3"),
    Key::new("smooth_posts", "posts along roads, either side, over which noisy ground is smoothed; 0: not at all")
        .number("posts", SMOOTH_POSTS)
        .otherwise("2 where the DEM is noisy along roads, else 0")
        .example("smooth_posts = 3"),
    Key::new("river_tau", "the share of the ground along a river that lies below it: a DEM sees banks and trees")
        .number("a share", RIVER_TAU)
        .usual("0.35"),
    Key::new("carve_max_m", "how deep a river is carved down to its lower bank").number(HIGH, EARTHWORK_M).usual("2"),
    Key::new("river_tilt", "let rivers and canals fall evenly through the pools that a DEM makes of them")
        .usual("true"),
];

const fn layer(example: &'static str) -> Key {
    Key::new("layer", "its layer")
        .line("the name of a layer of a GeoPackage", LAYER_CHARS_MAX)
        .otherwise("its only one")
        .example(example)
}

const fn crs(example: &'static str) -> Key {
    Key::new("crs", "the system of its coordinates, where it names none or a wrong one; not of OpenStreetMap data")
        .line("a coordinate system, as \"EPSG:4326\" or well-known text", WKT_CHARS_MAX)
        .otherwise(FILE_SAYS)
        .example(example)
}

const fn tags(example: &'static str) -> Key {
    Key::new("where", "tags or attribute columns, all of which it must have; empty for all")
        .bounded(|| {
            let values = "a value or a list of values each, [] for any";
            format!("a table of tags with {values}, keys and values of 1 to {TAG_CHARS_MAX} characters")
        })
        .example(example)
}

pub(crate) const FEATURE_SOURCES: &[Key] = &[
    Key::new("file", "the file: OpenStreetMap data as .pbf, GeoPackage, Shapefile, GeoJSON or GeoParquet")
        .form("the path of a file of lines and polygons")
        .example("{ file = \"lakes.shp\", kind = \"lake\" }"),
    layer("{ file = \"hydro.gpkg\", layer = \"rivers\" }"),
    Key::new("kind", "the kind of its features, whatever their tags say; rules come first")
        .words::<Kind>()
        .otherwise("as rules and tags say")
        .example("{ file = \"lakes.shp\", kind = \"lake\" }"),
    crs("{ file = \"roads.shp\", crs = \"EPSG:32611\" }"),
];

pub(crate) const RULES: &[Key] = &[
    tags("where = { highway = [\"track\", \"path\"], surface = \"sand\" }"),
    Key::new("kind", "what it is")
        .words::<RuleKind>()
        .otherwise("as the built-in table or the source says, else \"breakline\"")
        .example("kind = \"track\""),
    Key::new("class", "its class, which triangles carry")
        .bounded(|| format!("the name of a class, 1 to {NAME_CHARS_MAX} letters, digits, '-' or '_'"))
        .otherwise("the name of its kind")
        .example("class = \"trail\""),
    Key::new("width_m", "its width")
        .number("metres", RULE_WIDTH_M)
        .otherwise("as its tags say, else as usual for its kind")
        .example("width_m = 3"),
    Key::new("grade_max_percent", "its greatest rise over run")
        .number("percent", RULE_GRADE_PERCENT)
        .otherwise("as usual for its kind")
        .example("grade_max_percent = 25"),
    Key::new("grade_give", "how many times that it may be where limits of cut and fill ask for it")
        .number("a factor", GRADE_GIVE)
        .otherwise("1 of railways and runways, else as all features")
        .example("grade_give = 1.2"),
    Key::new("form", "what of it becomes edges of the TIN")
        .words::<Form>()
        .otherwise("as usual for its kind")
        .example("form = \"line\""),
    Key::new("z", "where its heights come from").words::<HeightsFrom>().usual("dem").example("z = \"feature\""),
];

const HIGH: &str = "metres";
const CLEARANCE: RangeInclusive<f64> = 0.0..=CLEARANCE_M_MAX;
const EARTHWORK_M: RangeInclusive<f64> = 0.0..=EARTHWORK_M_MAX;

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
    Key::new("file", "OpenStreetMap data as .pbf, GeoPackage, Shapefile, GeoJSON, GeoParquet, or heights of leaves")
        .form("the path of a file of polygons and lines, or of a raster")
        .example(SOURCE),
    layer("{ file = \"town.gpkg\", layer = \"houses\" }"),
    Key::new("kind", "what its polygons and lines are, whatever their tags say; rules come first")
        .words::<ObjectKind>()
        .otherwise("as rules and tags say")
        .example(SOURCE),
    Key::new("height", "the attribute that says how high they are, in metres where it names no unit")
        .line("the name of an attribute", TAG_CHARS_MAX)
        .otherwise("height")
        .example(SOURCE),
    crs("{ file = \"houses.shp\", crs = \"EPSG:32611\" }"),
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
    tags("where = { building = [\"silo\"] }"),
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
