//! The keys of `[features]`: what each means, what it may be, and what holds where a job leaves it out.

use std::ops::RangeInclusive;

use features::{Form, Kind, RuleKind};

use crate::bounds::{
    BANK_M_MAX, CLEARANCE_M_MAX, EARTHWORK_M_MAX, FEATURE_SOURCES_MAX, GRADE_GIVE, LAYER_CHARS_MAX, LEFT_OUT_WEIGHT,
    NAME_CHARS_MAX, RIVER_TAU, RULE_GRADE_PERCENT, RULE_WIDTH_M, RULES_MAX, SHARE_MAX, SMOOTH_POSTS, TAG_CHARS_MAX,
    WKT_CHARS_MAX,
};
use crate::key::FILE_SAYS;
use crate::{HeightsFrom, Key};

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

pub(crate) const FEATURE_SOURCES: &[Key] = &[
    Key::new("file", "the file: OpenStreetMap data as .pbf, GeoPackage, Shapefile, GeoJSON or GeoParquet")
        .form("the path of a file of lines and polygons")
        .example("{ file = \"lakes.shp\", kind = \"lake\" }"),
    Key::new("layer", "its layer")
        .line("the name of a layer of a GeoPackage", LAYER_CHARS_MAX)
        .otherwise("its only one")
        .example("{ file = \"hydro.gpkg\", layer = \"rivers\" }"),
    Key::new("kind", "the kind of its features, whatever their tags say; rules come first")
        .words::<Kind>()
        .otherwise("as rules and tags say")
        .example("{ file = \"lakes.shp\", kind = \"lake\" }"),
    Key::new("crs", "the system of its coordinates, where it names none or a wrong one; not of OpenStreetMap data")
        .line("a coordinate system, as \"EPSG:4326\" or well-known text", WKT_CHARS_MAX)
        .otherwise(FILE_SAYS)
        .example("{ file = \"roads.shp\", crs = \"EPSG:32611\" }"),
];

pub(crate) const RULES: &[Key] = &[
    Key::new("where", "tags or attribute columns, all of which a feature must have; empty for every feature")
        .bounded(|| {
            let values = "a value or a list of values each, [] for any";
            format!("a table of tags with {values}, keys and values of 1 to {TAG_CHARS_MAX} characters")
        })
        .example("where = { highway = [\"track\", \"path\"], surface = \"sand\" }"),
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
