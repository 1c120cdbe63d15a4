//! Every key of a job file with an example, and the one somebody probably meant.

/// A key and how it may be written.
type Key = (&'static str, &'static str);

/// The sections of a job file and the keys of each.
const SECTIONS: [(&str, &[Key]); 8] = [
    ("area", AREA),
    ("dem", DEM),
    ("importance", IMPORTANCE),
    ("tiles", TILES),
    ("load_modules", LOAD_MODULES),
    ("limits", LIMITS),
    ("tin", TIN),
    ("lod", LOD),
];

const AREA: &[Key] = &[
    ("name", "name = \"ntc\""),
    ("title", "title = \"National Training Center, west\""),
    ("crs", "crs = \"EPSG:32611\""),
    ("origin_m", "origin_m = [505000, 3875000]"),
    ("size_m", "size_m = [50000, 50000]"),
    ("around", "around = { lat = 35.3, lon = -116.6, size_km = 50 }"),
    ("cover", "cover = \"dem\""),
    ("spacing_m", "spacing_m = 25"),
];

const DEM: &[Key] = &[
    ("sources", "sources = [\"dem/*.tif\"]"),
    ("source", "source = \"sample\""),
    ("seed", "seed = 1"),
    ("vertical_datum", "vertical_datum = \"EGM96\""),
    ("height_unit_m", "height_unit_m = 0.3048"),
    ("voids", "voids = \"fail\""),
    ("resampling", "resampling = \"cubic\""),
    ("feather_m", "feather_m = 500"),
    ("geoids", "geoids = [{ datum = \"EGM96\", file = \"egm96_15.gtx\" }]"),
    ("water", "water = \"lakes.geojson\""),
];

const IMPORTANCE: &[Key] = &[
    ("default", "default = 8"),
    ("areas", "areas = [{ file = \"mountains.geojson\", class = \"mountains\", weight = 1 }]"),
    ("smooth", "smooth = \"binomial-7\""),
];

const TILES: &[Key] = &[
    ("columns", "columns = 6"),
    ("rows", "rows = 6"),
    ("order", "order = \"colour\""),
    ("borders", "borders = \"inherit\""),
];

const LOAD_MODULES: &[Key] = &[
    ("side_m", "side_m = 500"),
    ("border_step_m", "border_step_m = 125"),
    ("outer_border", "outer_border = \"refined\""),
    ("edges", "edges = \"constrained\""),
    ("clip_heights", "clip_heights = \"coplanar\""),
];

const LIMITS: &[Key] = &[
    ("count", "count = \"triangles\""),
    ("per_load_module", "per_load_module = 100"),
    ("pool", "pool = 0"),
    ("mean_per_load_module", "mean_per_load_module = 32"),
    ("per_4km_square", "per_4km_square = 4096"),
];

const TIN: &[Key] = &[
    ("method", "method = \"optimised\""),
    ("points", "points = 76500"),
    ("key", "key = \"max\""),
    ("allocation", "allocation = \"equal\""),
    ("residual_quantum_m", "residual_quantum_m = 1, the paper's; 0.0078125 compares residuals as they are"),
    ("proximity_m", "proximity_m = [300, 20]"),
    ("proximity", "proximity = false"),
    ("last_batch", "last_batch = \"truncate\""),
    ("max_residual_m", "max_residual_m = 10"),
    ("target_rms_m", "target_rms_m = 1.5"),
    ("effort", "effort = \"normal\""),
    ("height_fit", "height_fit = \"l2_keep_crests\""),
    ("lattice", "lattice = \"eighth\""),
    ("start", "start = { method = \"vip\", points = 1000 }, or a file: start = \"points.csv\""),
    ("pins", "pins = \"pins.geojson\""),
];

const LOD: &[Key] =
    &[("levels", "levels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]"), ("border", "border = \"full\"")];

/// Keys of one entry of `lod.levels`.
const LEVELS: &[Key] = &[("inner_share", "{ inner_share = 0.5 }, half of the vertices inside a load module")];

/// Keys of one entry of `importance.areas`.
const AREAS: &[Key] = &[
    ("file", "{ file = \"mountains.geojson\", class = \"mountains\", weight = 1 }"),
    ("raster", "{ raster = \"class.tif\", value = 3, class = \"mountains\", weight = 1 }"),
    ("value", "{ raster = \"class.tif\", value = 3, class = \"mountains\", weight = 1 }"),
    ("slope_above_percent", "{ slope_above_percent = 20, smooth_m = 500, class = \"mountains\", weight = 1 }"),
    ("smooth_m", "{ slope_above_percent = 20, smooth_m = 500, class = \"mountains\", weight = 1 }"),
    ("sample", "{ sample = \"mountains\", class = \"mountains\", weight = 1 }"),
    ("class", "class = \"mountains\"; reports tell classes apart"),
    ("weight", "weight = 1; 0 excludes posts from selection"),
];

/// Keys of one entry of `dem.sources` when it is a table.
const SOURCES: &[Key] = &[
    ("file", "{ file = \"cell.asc\", crs = \"EPSG:32611\" }"),
    ("crs", "{ file = \"cell.asc\", crs = \"EPSG:32611\" }"),
    ("corner", "corner = [35, -117], latitude and longitude of the south-west post of an HGT tile"),
    ("height_unit_m", "height_unit_m = 0.3048"),
    ("nodata", "nodata = -32767"),
    ("vertical_datum", "vertical_datum = \"EGM96\""),
    ("attribution", "attribution = \"NASA/USGS SRTM, public domain\""),
];

/// Keys of one entry of `dem.geoids`.
const GEOIDS: &[Key] = &[
    ("datum", "{ datum = \"EGM96\", file = \"egm96_15.gtx\" }"),
    ("file", "{ datum = \"EGM96\", file = \"egm96_15.gtx\" }"),
];

/// Keys of `dem.water` when it is a table.
const WATER: &[Key] = &[
    ("file", "water = { file = \"lakes.geojson\" }"),
    ("level_m", "water = { file = \"sea.geojson\", level_m = 0 }"),
    ("class", "class = \"water\"; triangles carry it"),
    ("weight", "weight = 1; 0 excludes posts from selection"),
];

/// Keys of `area.around`.
const AROUND: &[Key] = &[
    ("lat", "around = { lat = 35.3, lon = -116.6, size_km = 50 }"),
    ("lon", "around = { lat = 35.3, lon = -116.6, size_km = 50 }"),
    ("size_km", "size_km = 50, or [50, 30] for west to east and south to north"),
];

/// Keys of `dem.voids` when it is a table.
const VOIDS: &[Key] = &[
    ("fill_within_posts", "voids = { fill_within_posts = 8 }"),
    ("next_source", "voids = { next_source = true, fill_within_posts = 8 }"),
    ("hole", "voids = { fill_within_posts = 8, hole = true }"),
];

/// Keys of `tin.start` when it is a table.
const START: &[Key] = &[
    ("method", "start = { method = \"vip\", points = 1000 }"),
    ("points", "start = { method = \"vip\", points = 1000 }"),
];

/// The keys of a table, by its place in the job: `area`, `dem.voids`, `importance.areas[3]`.
fn table(place: &str) -> &'static [Key] {
    match place {
        "dem.voids" => VOIDS,
        "area.around" => AROUND,
        "dem.water" => WATER,
        _ if place.starts_with("dem.geoids[") => GEOIDS,
        "tin.start" => START,
        _ if place.starts_with("dem.sources[") => SOURCES,
        _ if place.starts_with("importance.areas[") => AREAS,
        _ if place.starts_with("lod.levels[") => LEVELS,
        _ => SECTIONS.iter().find(|(name, _)| *name == place).map_or(&[], |(_, keys)| keys),
    }
}

/// The names of the keys of a table.
pub(crate) fn keys_of(place: &str) -> Vec<&'static str> {
    table(place).iter().map(|(key, _)| *key).collect()
}

/// The names of the sections.
pub(crate) fn section_names() -> Vec<&'static str> {
    SECTIONS.iter().map(|(name, _)| *name).collect()
}

/// How a key may be written, as a hint; `key` has its section, and an index when it is an item of a list.
pub(crate) fn example(key: &str) -> String {
    let whole = |key: &str| {
        let (place, name) = key.rsplit_once('.')?;
        table(place).iter().find(|(known, _)| *known == name).map(|(_, example)| *example)
    };
    let list = |key: &str| key.rfind('[').and_then(|at| whole(&key[..at]));
    match whole(key).or_else(|| list(key)) {
        Some(example) => format!("for example {example}"),
        None => SEE_EXAMPLE.to_owned(),
    }
}

/// What to say where nothing better is known.
const SEE_EXAMPLE: &str = "configs/ntc.toml shows the usual keys with what they mean";

/// The word nearest to `found`, if it is near enough to have been meant: few edits away, or abbreviated by it
/// (`cols` for `columns`), or lengthened by it (`clipped` for `clip`).
pub(crate) fn nearest<'a>(found: &str, known: &[&'a str]) -> Option<&'a str> {
    let lower = found.to_lowercase();
    let edits = |word: &&&str| strsim::osa_distance(&lower, word);
    let best = known.iter().min_by_key(edits)?;
    if edits(&best) <= (lower.chars().count() / 4).max(1) {
        return Some(best);
    }
    let meant = |word: &&&str| abbreviates(&lower, word) || (4 <= word.len() && lower.starts_with(**word));
    known.iter().find(meant).copied()
}

/// Whether `short` is `word` with letters left out, the first one kept.
fn abbreviates(short: &str, word: &str) -> bool {
    let mut letters = word.chars();
    3 <= short.len() && short.chars().next() == word.chars().next() && short.chars().all(|c| letters.any(|l| l == c))
}

/// What somebody who wrote the key `found` in `place` probably meant.
pub(crate) fn hint_for_key(place: &str, found: &str) -> String {
    if let Some(name) = section_of(place, found) {
        return format!("did you mean {found} in [{name}]?");
    }
    match nearest(found, &keys_of(place)) {
        Some(key) => format!("did you mean {key}?"),
        None => SEE_EXAMPLE.to_owned(),
    }
}

/// What somebody who wrote `found` outside all sections, or as a section, probably meant.
pub(crate) fn hint_for_section(found: &str) -> String {
    match (found, section_of("", found)) {
        ("sample", _) => "the sample terrain is chosen by source = \"sample\" and seed in [dem]".to_owned(),
        ("workers" | "out", _) => format!("give it on the command line: --{found}"),
        (_, Some(name)) => format!("did you mean {found} in [{name}]?"),
        _ => match nearest(found, &section_names()) {
            Some(name) => format!("did you mean [{name}]?"),
            None => SEE_EXAMPLE.to_owned(),
        },
    }
}

/// The section, other than `place`, that has exactly this key.
fn section_of(place: &str, key: &str) -> Option<&'static str> {
    let names = SECTIONS.iter().filter(|(name, _)| *name != place);
    names.filter(|(_, keys)| keys.iter().any(|(known, _)| *known == key)).map(|(name, _)| *name).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(place: &str, found: &str, expected: &str) {
        assert_eq!(hint_for_key(place, found), expected);
    }

    #[test]
    fn the_key_that_was_meant_is_found_by_edits_by_abbreviation_and_in_other_sections() {
        check("area", "spacing", "did you mean spacing_m?");
        check("area", "orgin_m", "did you mean origin_m?");
        check("tiles", "cols", "did you mean columns?");
        check("tiles", "colums", "did you mean columns?");
        check("tin", "pool", "did you mean pool in [limits]?");
        check("importance.areas[2]", "clas", "did you mean class?");
        check("area", "quux", SEE_EXAMPLE);
    }

    #[test]
    fn every_key_has_an_example() {
        for (section, keys) in SECTIONS {
            for (key, written) in keys {
                assert_eq!(example(&format!("{section}.{key}")), format!("for example {written}"));
            }
        }
        assert_eq!(example("area.size_m[1]"), "for example size_m = [50000, 50000]");
        assert_eq!(example("importance.areas[1].weight"), "for example weight = 1; 0 excludes posts from selection");
        assert!(example("importance.areas[1]").contains("areas = [{"));
    }
}
