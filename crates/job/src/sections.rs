//! Every key of a job file: what it means, what it may be, and what holds where a job leaves it out.
//!
//! The reader takes ranges and defaults from here, `describe` the meanings, `docs/reference/job-keys.md` everything.

use std::ops::RangeInclusive;

use terrain::{Effort, HeightFit, LastBatch, Lattice, LodBorder, Resampling, Smooth, TileOrder};

use crate::bounds::{
    AREAS_MAX, AROUND_KM_MAX, COARSER_LEVELS_MAX, COUNT_MAX, DATUM_CHARS_MAX, EYE_M, FEATHER_M_MAX, FILL_POSTS_MAX,
    GEOIDS_MAX, HEIGHT_UNIT_M, LEVEL_M_MAX, MODULES_PER_TILE_MIN, NAME_CHARS_MAX, PER_MODULE_MAX, QUANTUM_M_MAX,
    RESIDUAL_M_MAX, RMS_M_MIN, SEED_MAX, SIDE_QUANTA_MAX, SIGHT_M, SLOPE_PERCENT_MAX, SMOOTH_M_MAX, SOURCES_MAX,
    THANKS_CHARS_MAX, TITLE_CHARS_MAX, TRIANGLES_MIN, WEIGHT_MAX, WKT_CHARS_MAX,
};
use crate::feature_keys::{FEATURE_SOURCES, FEATURES, RULES};
use crate::feature_keys::{OBJECT_LIMITS, OBJECT_RULES, OBJECT_SOURCES, OBJECTS};
use crate::key::FILE_SAYS;
use crate::{
    Allocation, AreaPlace, Borders, ClipHeights, Count, DemSource, Edges, ErrorKey, Key, KeyTable, MethodName,
    OuterBorder, SampleClass, StartMethod,
};

/// All tables, the sections in their order, each before those that stand in it.
pub(crate) static TABLES: [KeyTable; 25] = [
    KeyTable { place: "area", meaning: "The gaming area, whole load modules, and its working grid.", keys: AREA },
    KeyTable { place: "area.around", meaning: "An area around a place.", keys: AROUND },
    KeyTable { place: "dem", meaning: "Where heights come from.", keys: DEM },
    KeyTable { place: "dem.sources[]", meaning: "A source, where more is to be said than its path.", keys: SOURCES },
    KeyTable { place: "dem.voids", meaning: "Voids, where one word does not say it.", keys: VOIDS },
    KeyTable { place: "dem.geoids[]", meaning: "A grid for converting between vertical datums.", keys: GEOIDS },
    KeyTable { place: "dem.water", meaning: "Water, where more is to be said than its path.", keys: WATER },
    KeyTable { place: "importance", meaning: "Where ground matters more.", keys: IMPORTANCE },
    KeyTable { place: "importance.areas[]", meaning: "An area with a weight of its own.", keys: AREAS },
    KeyTable {
        place: "features",
        meaning: "Roads, rivers and lakes that become parts of the ground. Without this section there are none.",
        keys: FEATURES,
    },
    KeyTable {
        place: "features.sources[]",
        meaning: "A source of features, where more is to be said than its path.",
        keys: FEATURE_SOURCES,
    },
    KeyTable {
        place: "features.rules[]",
        meaning: "What becomes of features with certain tags; where no rule says it, the built-in table does.",
        keys: RULES,
    },
    KeyTable {
        place: "objects",
        meaning: "Buildings, walls and woods that stand on the ground and hide. Without this section there are none.",
        keys: OBJECTS,
    },
    KeyTable {
        place: "objects.sources[]",
        meaning: "A source of objects, where more is to be said than its path.",
        keys: OBJECT_SOURCES,
    },
    KeyTable {
        place: "objects.rules[]",
        meaning: "What becomes of objects with certain tags; where no rule says it, the built-in table does.",
        keys: OBJECT_RULES,
    },
    KeyTable {
        place: "objects.limits",
        meaning: "What may stand there, in polygons: a roof and each wall are one, and each triangle of a wood.",
        keys: OBJECT_LIMITS,
    },
    KeyTable { place: "tiles", meaning: "How the work is cut.", keys: TILES },
    KeyTable { place: "load_modules", meaning: "What the product is cut into.", keys: LOAD_MODULES },
    KeyTable {
        place: "limits",
        meaning: "What the simulator cannot exceed, in triangles or in what `count` says.",
        keys: LIMITS,
    },
    KeyTable { place: "tin", meaning: "How posts are chosen.", keys: TIN },
    KeyTable { place: "tin.start", meaning: "Points of another method to start from.", keys: START },
    KeyTable { place: "lod", meaning: "Coarser levels of load modules.", keys: LOD },
    KeyTable { place: "lod.levels[]", meaning: "A level beside the finest.", keys: LEVELS },
    KeyTable {
        place: "exports",
        meaning: "What exports are told; nothing that is built depends on it.",
        keys: EXPORTS,
    },
    KeyTable {
        place: "exports.materials[]",
        meaning: "A material, where more is to be said than its name.",
        keys: MATERIALS,
    },
];

const AREA: &[Key] = &[
    Key::new("name", "name of the area and of its database").bounded(name).example("name = \"ntc\""),
    Key::new("title", "what stands above the report's page")
        .line("a line of text", TITLE_CHARS_MAX)
        .otherwise("the name")
        .example("title = \"National Training Center, west\""),
    Key::new("crs", "projected coordinate system")
        .form("a projected coordinate system in metres, as \"EPSG:32611\", or \"auto\" with around or cover")
        .example("crs = \"EPSG:32611\""),
    Key::new("origin_m", "east and north of the south-west post")
        .form("[east, north] of the south-west post in metres")
        .otherwise("found by around or cover")
        .example("origin_m = [505000, 3875000]"),
    Key::new("size_m", "size of the area, west to east and south to north")
        .form("[width, height] of the area in metres")
        .otherwise("found by around or cover")
        .example("size_m = [50000, 50000]"),
    Key::new("around", "the area lies around this place, instead of origin_m and size_m")
        .form("a table of lat, lon and size_km")
        .otherwise("origin_m and size_m say it")
        .example("around = { lat = 35.3, lon = -116.6, size_km = 50 }"),
    Key::new("cover", "the area is found from the sources, instead of origin_m and size_m")
        .words::<AreaPlace>()
        .otherwise("origin_m and size_m say it")
        .example("cover = \"dem\""),
    Key::new("spacing_m", "distance between posts of the working grid")
        .form("metres between posts, a positive multiple of 1/16 m")
        .example("spacing_m = 25"),
];

fn name() -> String {
    format!("1 to {NAME_CHARS_MAX} letters, digits, '-', '_' or '.', beginning with a letter or digit")
}

const AROUND_EXAMPLE: &str = "around = { lat = 35.3, lon = -116.6, size_km = 50 }";

const AROUND: &[Key] = &[
    Key::new("lat", "where its middle lies").form("degrees of latitude, south negative").example(AROUND_EXAMPLE),
    Key::new("lon", "where its middle lies").form("degrees of longitude, west negative").example(AROUND_EXAMPLE),
    Key::new("size_km", "its least size")
        .bounded(|| format!("kilometres a side up to {AROUND_KM_MAX}, or [east to west, north to south]"))
        .example("size_km = 50, or [50, 30] for west to east and south to north"),
];

const DEM: &[Key] = &[
    Key::new("sources", "rasters in order of priority; a path, a pattern or a table each")
        .bounded(|| format!("a list of 1 to {SOURCES_MAX} paths and patterns of rasters"))
        .otherwise("source says it")
        .example("sources = [\"dem/*.tif\"]"),
    Key::new("source", "built-in terrain instead of rasters")
        .words::<DemSource>()
        .otherwise("sources says it")
        .example("source = \"sample\""),
    Key::new("seed", "which one of its terrains").whole("a seed", 0..=SEED_MAX).usual("1"),
    Key::new("vertical_datum", "what heights are measured from; sources that say something else are refused")
        .line("a name such as \"EGM96\"", DATUM_CHARS_MAX)
        .otherwise("unknown")
        .example("vertical_datum = \"EGM96\""),
    Key::new("height_unit_m", "unit of the heights of all sources")
        .number(UNIT, HEIGHT_UNIT_M)
        .otherwise(FILE_SAYS)
        .example("height_unit_m = 0.3048"),
    Key::new("voids", "what becomes of posts without a height: an error, a height of the next source, or a hole")
        .form("\"fail\", \"next_source\", \"hole\" or { fill_within_posts = 8 }")
        .usual("\"fail\""),
    Key::new("resampling", "how heights between posts come about")
        .words::<Resampling>()
        .usual("bilinear")
        .example("resampling = \"cubic\""),
    Key::new("feather_m", "over how far a source fades into the next")
        .number("metres", 0.0..=FEATHER_M_MAX)
        .usual("0")
        .example("feather_m = 500"),
    Key::new("geoids", "heights of vertical datums above the ellipsoid, for converting")
        .bounded(|| format!("a list of at most {GEOIDS_MAX} grids, each {{ datum = …, file = … }}"))
        .otherwise("none")
        .example("geoids = [{ datum = \"EGM96\", file = \"egm96_15.gtx\" }]"),
    Key::new("water", "polygons of water, each a body that lies level")
        .form("the path of a file of polygons, or a table")
        .otherwise("none")
        .example("water = \"lakes.geojson\""),
];

const UNIT: &str = "metres in a unit of height,";
const SOURCE_EXAMPLE: &str = "{ file = \"cell.asc\", crs = \"EPSG:32611\" }";

const SOURCES: &[Key] = &[
    Key::new("file", "the raster").form("the path of a raster").example(SOURCE_EXAMPLE),
    Key::new("crs", "its coordinate system")
        .line("a coordinate system, as \"EPSG:4326\" or well-known text", WKT_CHARS_MAX)
        .otherwise(FILE_SAYS)
        .example(SOURCE_EXAMPLE),
    Key::new("corner", "the south-west post of an HGT tile")
        .form("latitude and longitude in degrees, latitude first")
        .otherwise("as the file's name says")
        .example("corner = [35, -117], latitude and longitude of the south-west post of an HGT tile"),
    Key::new("height_unit_m", "unit of its heights")
        .number(UNIT, HEIGHT_UNIT_M)
        .otherwise(FILE_SAYS)
        .example("height_unit_m = 0.3048"),
    Key::new("nodata", "its mark of a void")
        .form("the value that marks a void")
        .otherwise(FILE_SAYS)
        .example("nodata = -32767"),
    Key::new("vertical_datum", "what its heights are measured from")
        .line("a name such as \"EGM96\"", DATUM_CHARS_MAX)
        .otherwise(FILE_SAYS)
        .example("vertical_datum = \"EGM96\""),
    Key::new("attribution", "stands on the report's page")
        .line("whom to thank", THANKS_CHARS_MAX)
        .otherwise("none")
        .example("attribution = \"NASA/USGS SRTM, public domain\""),
];

const VOIDS: &[Key] = &[
    Key::new("fill_within_posts", "voids this near a height are filled from it")
        .whole("a number of posts", 1..=FILL_POSTS_MAX)
        .otherwise("none is filled")
        .example("voids = { fill_within_posts = 8 }"),
    Key::new("next_source", "voids are filled from the next source first")
        .usual("false")
        .example("voids = { next_source = true, fill_within_posts = 8 }"),
    Key::new("hole", "other voids are holes, ground without weight, instead of errors")
        .usual("false")
        .example("voids = { fill_within_posts = 8, hole = true }"),
];

const GEOID_EXAMPLE: &str = "{ datum = \"EGM96\", file = \"egm96_15.gtx\" }";

const GEOIDS: &[Key] = &[
    Key::new("datum", "which datum it gives")
        .line("the name of a vertical datum, as sources have it", DATUM_CHARS_MAX)
        .example(GEOID_EXAMPLE),
    Key::new("file", "the grid").form("the path of a geoid grid").example(GEOID_EXAMPLE),
];

const WATER: &[Key] = &[
    Key::new("file", "its polygons")
        .form("the path of a file of polygons")
        .example("water = { file = \"lakes.geojson\" }"),
    Key::new("level_m", "level of all of it")
        .number("a height in metres", -LEVEL_M_MAX..=LEVEL_M_MAX)
        .otherwise("each body lies at the median of its heights")
        .example("water = { file = \"sea.geojson\", level_m = 0 }"),
    Key::new("class", "its class")
        .line(CLASS, NAME_CHARS_MAX)
        .otherwise("\"water\"")
        .example("class = \"water\"; triangles carry it"),
    Key::new("weight", "its weight")
        .bounded(weight)
        .otherwise("at least 32 times that of the heaviest ground")
        .example(WEIGHT_EXAMPLE),
];

const CLASS: &str = "the name of a class";
const WEIGHT_EXAMPLE: &str = "weight = 1; 0 excludes posts from selection";

fn weight() -> String {
    format!("a weight from 0 to {WEIGHT_MAX}, in whole thousandths")
}

const IMPORTANCE: &[Key] = &[
    Key::new("default", "weight of every post that no area holds").bounded(weight).usual("1").example("default = 8"),
    Key::new("areas", "areas with a weight of their own, later ones over earlier ones")
        .bounded(|| {
            let kinds = "each { file = … } or { raster = …, value = … } or { sample = … }";
            let of_heights = "or { slope_above_percent = … } or { level_m = … }";
            format!("a list of at most {AREAS_MAX} areas, {kinds} {of_heights}")
        })
        .otherwise("all ground matters the same")
        .example("areas = [{ file = \"mountains.geojson\", class = \"mountains\", weight = 1 }]"),
    Key::new("smooth", "how the borders between weights are softened").words::<Smooth>().usual("binomial-7"),
];

const RASTER_EXAMPLE: &str = "{ raster = \"class.tif\", value = 3, class = \"mountains\", weight = 1 }";
const SLOPE_EXAMPLE: &str = "{ slope_above_percent = 20, smooth_m = 500, class = \"mountains\", weight = 1 }";
const ONE_OF_FIVE: &str = "file, raster, slope_above_percent, level_m or sample says which ground";

const AREAS: &[Key] = &[
    Key::new("file", "polygons that hold it")
        .form("the path of a file")
        .otherwise(ONE_OF_FIVE)
        .example("{ file = \"mountains.geojson\", class = \"mountains\", weight = 1 }"),
    Key::new("raster", "a raster of classes").form("the path of a file").otherwise(ONE_OF_FIVE).example(RASTER_EXAMPLE),
    Key::new("value", "its class there")
        .form("the value of the class in the raster, a whole number")
        .otherwise("needed with raster")
        .example(RASTER_EXAMPLE),
    Key::new("slope_above_percent", "ground steeper than this")
        .bounded(|| format!("a slope in percent, above 0 and at most {SLOPE_PERCENT_MAX}, in whole thousandths"))
        .otherwise(ONE_OF_FIVE)
        .example(SLOPE_EXAMPLE),
    Key::new("smooth_m", "radius over which slopes are averaged first")
        .number("metres", 0.0..=SMOOTH_M_MAX)
        .otherwise("needed with slope_above_percent")
        .example(SLOPE_EXAMPLE),
    Key::new("level_m", "ground that lies level at this height over 5 x 5 posts or more, as the sea does")
        .number("a height in metres", -LEVEL_M_MAX..=LEVEL_M_MAX)
        .otherwise(ONE_OF_FIVE)
        .example("{ level_m = 0, class = \"water\", weight = 1 }"),
    Key::new("sample", "ground of the built-in terrain")
        .words::<SampleClass>()
        .otherwise(ONE_OF_FIVE)
        .example("{ sample = \"mountains\", class = \"mountains\", weight = 1 }"),
    Key::new("class", "its class, which triangles carry")
        .line(CLASS, NAME_CHARS_MAX)
        .example("class = \"mountains\"; reports tell classes apart"),
    Key::new("weight", "its weight; 0 excludes posts from selection").bounded(weight).example(WEIGHT_EXAMPLE),
];

const TILES: &[Key] = &[
    Key::new("columns", "tiles west to east, fewer where they would be too narrow").bounded(tiles).usual("6"),
    Key::new("rows", "tiles south to north, fewer where they would be too low").bounded(tiles).usual("6"),
    Key::new("order", "in which order tiles are refined").words::<TileOrder>().usual("colour"),
    Key::new("borders", "what a tile finds on its sides").words::<Borders>().usual("inherit"),
];

fn tiles() -> String {
    format!("a number of tiles, each at least {MODULES_PER_TILE_MIN} load modules")
}

const LOAD_MODULES: &[Key] = &[
    Key::new("side_m", "a side of a load module, a multiple of its border step").bounded(length).usual("500"),
    Key::new("border_step_m", "between points on a fixed outer border, a multiple of the spacing")
        .bounded(length)
        .usual("125"),
    Key::new("outer_border", "which points the outer border of the area has")
        .words::<OuterBorder>()
        .otherwise("\"refined\"; \"fixed\" with edges = \"clip\" or method = \"paper\"")
        .example("outer_border = \"refined\""),
    Key::new("edges", "how load modules get their sides").words::<Edges>().usual("constrained"),
    Key::new("clip_heights", "height of a vertex that clipping makes; for edges = \"clip\" only")
        .words::<ClipHeights>()
        .usual("coplanar"),
    Key::new("format", "newest version of their files; 2 leaves out the lines of roads and rivers")
        .whole("a version of the format", 2..=3)
        .usual("3"),
];

fn length() -> String {
    format!("a positive number of metres, at most {SIDE_QUANTA_MAX}/128")
}

const NUMBER: &str = "a number of triangles";

const LIMITS: &[Key] = &[
    Key::new("count", "what limits count").words::<Count>().usual("triangles"),
    Key::new("per_load_module", "at most in one load module")
        .whole(NUMBER, TRIANGLES_MIN..=PER_MODULE_MAX)
        .usual("100"),
    Key::new("pool", "at most above that in the whole area together").whole(NUMBER, 0..=COUNT_MAX).usual("0"),
    Key::new("mean_per_load_module", "at most on average over all load modules")
        .number(NUMBER, TRIANGLES_MIN as f64..=PER_MODULE_MAX as f64)
        .usual("32"),
    Key::new("per_4km_square", "at most in every window of load modules that covers 4 km")
        .whole(NUMBER, TRIANGLES_MIN..=COUNT_MAX)
        .usual("4096"),
];

const TIN: &[Key] = &[
    Key::new("method", "by which method posts are chosen").words::<MethodName>().usual("optimised"),
    Key::new("points", "selected points in the whole area")
        .of(&[MethodName::Paper, MethodName::Greedy])
        .whole("a number of selected points", 1..=COUNT_MAX)
        .otherwise(
            "as many as the limits allow; method = \"paper\" and edges = \"clip\" need an end, this one or another",
        )
        .example("points = 76500"),
    Key::new("key", "what makes a post worth a point")
        .words::<ErrorKey>()
        .otherwise("\"sse\" with method = \"optimised\", otherwise \"max\"")
        .example("key = \"max\""),
    Key::new("allocation", "how the budget is shared among tiles")
        .words::<Allocation>()
        .otherwise("\"global\"; \"equal\" with method = \"paper\"")
        .example("allocation = \"equal\""),
    Key::new("residual_quantum_m", "residuals are compared in such steps")
        .of(&[MethodName::Paper, MethodName::Greedy])
        .bounded(|| format!("metres, a positive multiple of 1/128 m up to {QUANTUM_M_MAX}"))
        .otherwise("1/128; 1 with method = \"paper\"")
        .example("residual_quantum_m = 1, the paper's; 0.0078125 compares residuals as they are"),
    Key::new("proximity_m", "a post this near a vertex, over the ground and in height, waits")
        .of(&[MethodName::Paper])
        .bounded(|| format!("[horizontal, vertical] in metres, neither negative nor above {RESIDUAL_M_MAX}"))
        .usual("[300, 20]"),
    Key::new("proximity", "whether any post waits for being near a vertex")
        .of(&[MethodName::Paper])
        .usual("true")
        .example("proximity = false"),
    Key::new("last_batch", "what becomes of a batch that exceeds the points")
        .of(&[MethodName::Paper])
        .words::<LastBatch>()
        .usual("truncate"),
    Key::new("max_residual_m", "choosing ends when no residual is larger, whatever posts weigh")
        .number("metres", 0.0..=RESIDUAL_M_MAX)
        .otherwise("none")
        .example("max_residual_m = 10"),
    Key::new("target_rms_m", "choosing ends at this RMS residual at the posts of the working grid")
        .number("metres", RMS_M_MIN..=RESIDUAL_M_MAX)
        .otherwise("none")
        .example("target_rms_m = 1.5"),
    Key::new("effort", "how much work is done for a lower residual")
        .of(&[MethodName::Optimised])
        .words::<Effort>()
        .usual("normal"),
    Key::new("height_fit", "which vertices leave the height of the DEM")
        .of(&[MethodName::Optimised])
        .words::<HeightFit>()
        .usual("l2"),
    Key::new("lattice", "where vertices stand").of(&[MethodName::Optimised]).words::<Lattice>().usual("eighth"),
    Key::new("sight", "whether ground that decides what is seen from elsewhere counts more than other ground")
        .of(&[MethodName::Optimised])
        .otherwise("true; false with effort = \"fast\"")
        .example("sight = true"),
    Key::new("sight_eyes_m", "how high above the ground eyes are, and what they look at: the lowest and the highest")
        .of(&[MethodName::Optimised])
        .bounded(|| format!("[lowest, highest] in metres, {} to {}", EYE_M.start(), EYE_M.end()))
        .usual("[1, 10]"),
    Key::new("sight_range_m", "how far they look; at most 160 posts")
        .of(&[MethodName::Optimised])
        .number("metres", SIGHT_M)
        .usual("1000"),
    Key::new("start", "points that tiles start from")
        .form("the path of a file, or a table of method, points")
        .otherwise("none")
        .example("start = { method = \"vip\", points = 1000 }, or a file: start = \"points.csv\""),
    Key::new("pins", "points to add and to leave out, heights, and ground that matters more or less")
        .form("the path of a file")
        .otherwise("none")
        .example("pins = \"pins.geojson\""),
];

const START_EXAMPLE: &str = "start = { method = \"vip\", points = 1000 }";

const START: &[Key] = &[
    Key::new("method", "which method chooses them").words::<StartMethod>().example(START_EXAMPLE),
    Key::new("points", "how many; none with \"highlow\"")
        .whole("a number of points in the whole area", 1..=COUNT_MAX)
        .example(START_EXAMPLE),
];

const LOD: &[Key] = &[
    Key::new("levels", "levels beside the finest, which is always there")
        .bounded(|| format!("a list of at most {COARSER_LEVELS_MAX} levels, each coarser than the one before"))
        .otherwise("none")
        .example("levels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]"),
    Key::new("border", "what becomes of the vertices on the sides").words::<LodBorder>().usual("full"),
];

const LEVELS: &[Key] = &[
    Key::new("inner_share", "how many of the finest level's inner vertices it keeps; beside roads and water more stay")
        .form("the share of inner vertices that the level keeps, above 0 and below 1")
        .example("{ inner_share = 0.5 }, half of the vertices inside a load module"),
    Key::new("leave_out", "roads and water that the level does without, and coarser ones with it; decks stay")
        .bounded(|| "a list of names of classes of features".to_owned())
        .otherwise("none")
        .example("{ inner_share = 0.2, leave_out = [\"track\", \"stream\"] }"),
];

const EXPORTS: &[Key] =
    &[Key::new("materials", "what materials are called: of classes, and of objects (building_wall)")
        .form("a table of names by classes and materials of objects; a name, or a table, each")
        .otherwise("the names of classes, and those of the materials of objects")
        .example("materials = { primary = \"asphalt\", building_wall = { name = \"plaster\", surface_code = 12 } }")];

const MATERIAL_EXAMPLE: &str = "primary = { name = \"asphalt\", surface_code = 12, feature_id = 45 }";
const CODES: RangeInclusive<u64> = 0..=32_767;

const MATERIALS: &[Key] = &[
    Key::new("name", "what it is called").bounded(name).example(MATERIAL_EXAMPLE),
    Key::new("surface_code", "its surface material code (SMC) in OpenFlight")
        .whole("a code", CODES)
        .otherwise("the number of its class; from 256 on for objects")
        .example(MATERIAL_EXAMPLE),
    Key::new("feature_id", "its feature identification (FID) in OpenFlight")
        .whole("an identification", CODES)
        .otherwise("0")
        .example(MATERIAL_EXAMPLE),
];
