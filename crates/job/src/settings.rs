//! Every setting of a job: as TOML, and with what it means.
//!
//! One list serves both the announcement at the start of a run and the canonical text in `database.json`, so the two
//! cannot disagree. The canonical text is itself a job: reading it gives the same settings again.

use terrain::{THOUSANDTHS, metres_of_quanta};

use crate::{
    Allocation, AreaShape, Borders, Budget, ClipHeights, Count, DemSource, Edges, Effort, ErrorKey, GeoidSpec,
    HeightFit, ImportanceArea, Job, LastBatch, Lattice, LodBorder, LodSpec, Method, Optimising, OuterBorder,
    Resampling, SampleClass, Smooth, SourceEntry, Start, TileOrder, TinSpec, Voids, WaterSpec,
};

/// One setting of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The key with its section, as `area.spacing_m`.
    pub key: &'static str,
    /// The value as the job file writes it.
    pub value: String,
    /// What it means for this run.
    pub meaning: String,
}

/// The lines of a [canonical text](Job::canonical_text) that decide what is built: all but the title, which only stands
/// above the report's page.
pub fn deciding_lines(canonical: &str) -> impl Iterator<Item = &str> {
    canonical.lines().filter(|line| !line.starts_with("title = "))
}

impl Job {
    /// Every setting of the job with its value and meaning, defaults included, in the order of the sections.
    pub fn describe(&self) -> Vec<Setting> {
        let mut list = List(Vec::new());
        self.describe_area(&mut list);
        self.describe_dem(&mut list);
        self.describe_importance(&mut list);
        self.describe_tiles(&mut list);
        self.describe_modules(&mut list);
        self.describe_limits(&mut list);
        self.describe_tin(&mut list);
        describe_lod(&self.lod, &mut list);
        list.0
    }

    /// The resolved job as TOML: every setting, one a line, always in the same order and form. It depends on the
    /// settings only, not on where the job file lies, what it leaves out, or how it is laid out.
    pub fn canonical_text(&self) -> String {
        let mut text = String::new();
        let mut section = "";
        for Setting { key, value, .. } in self.describe() {
            let (name, key) = key.split_once('.').expect("every setting is named section.key");
            if name != section {
                text += &format!("[{name}]\n");
                section = name;
            }
            text += &format!("{key} = {value}\n");
        }
        text
    }

    fn describe_area(&self, list: &mut List) {
        let area = &self.area;
        list.add("area.name", quoted(&area.name), "name of the area");
        if let Some(title) = &area.title {
            list.add("area.title", quoted(title), "what stands above the report's page");
        }
        list.add("area.crs", quoted(&format!("EPSG:{}", area.epsg)), "projected coordinate system, in metres");
        list.add("area.origin_m", pair(area.origin_m), "east and north of the south-west post");
        let (rows, cols) = (area.grid.rows, area.grid.cols);
        list.add(
            "area.size_m",
            pair(area.size_m()),
            format!("{cols} x {rows} load modules, west to east x south to north"),
        );
        let posts = area.grid.area();
        let meaning = format!("working grid of {} x {} posts", posts.posts_wide(), posts.posts_high());
        list.add("area.spacing_m", number(area.spacing.metres()), meaning);
    }

    fn describe_dem(&self, list: &mut List) {
        match &self.dem.source {
            DemSource::Sample { seed } => {
                list.add("dem.source", quoted("sample"), "the built-in basin-and-range terrain");
                list.add("dem.seed", seed.to_string(), "which one of its terrains");
            }
            DemSource::Files { written, files } => {
                let names: Vec<String> = written.iter().map(source_text).collect();
                let meaning = format!("{} in order of priority", counted(files.len(), "raster"));
                list.add("dem.sources", format!("[{}]", names.join(", ")), meaning);
            }
        }
        if let Some(datum) = &self.dem.vertical_datum {
            list.add("dem.vertical_datum", quoted(datum), "what heights are measured from");
        }
        self.describe_voids(list);
        if self.dem.resampling == Resampling::Cubic {
            list.add("dem.resampling", quoted("cubic"), "heights between posts come from sixteen of them");
        }
        if 0.0 < self.dem.feather_m {
            let meaning = "metres over which a source fades into the next";
            list.add("dem.feather_m", number(self.dem.feather_m), meaning);
        }
        if !self.dem.geoids.is_empty() {
            let grid = |geoid: &GeoidSpec| {
                format!("{{ datum = {}, file = {} }}", quoted(&geoid.datum), quoted(&geoid.file.written))
            };
            let grids: Vec<String> = self.dem.geoids.iter().map(grid).collect();
            let meaning = "heights of vertical datums above the ellipsoid, for converting";
            list.add("dem.geoids", format!("[{}]", grids.join(", ")), meaning);
        }
        if let Some(water) = &self.dem.water {
            let (value, meaning) = self.water_text(water);
            list.add("dem.water", value, meaning);
        }
    }

    fn water_text(&self, water: &WaterSpec) -> (String, &'static str) {
        let mut keys = vec![format!("file = {}", quoted(&water.file.written))];
        keys.extend(water.level_m.map(|level_m| format!("level_m = {}", number(level_m))));
        keys.push(format!("class = {}", quoted(&self.importance.classes[usize::from(water.class)])));
        keys.extend(water.weight.map(|thousandths| format!("weight = {}", weight(thousandths))));
        let meaning = match water.level_m {
            Some(_) => "water lies at one level",
            None => "each body of water lies level, at the median of its heights",
        };
        (format!("{{ {} }}", keys.join(", ")), meaning)
    }

    fn describe_voids(&self, list: &mut List) {
        let next = if self.dem.next_source { "voids are filled from the next source first; " } else { "" };
        let table = |keys: &str| match self.dem.next_source {
            true => format!("{{ next_source = true, {keys} }}"),
            false => format!("{{ {keys} }}"),
        };
        let filled = |posts: u32| {
            format!("{next}voids are filled from heights at most {} away", counted(posts as usize, "post"))
        };
        let (value, meaning) = match self.dem.voids {
            Voids::Fail if self.dem.next_source => {
                (quoted("next_source"), format!("{next}a post without a height in any is an error"))
            }
            Voids::Fail => (quoted("fail"), "a post without a height is an error".to_owned()),
            Voids::Hole if self.dem.next_source => (table("hole = true"), format!("{next}others are holes")),
            Voids::Hole => (quoted("hole"), "ground without a height has no weight".to_owned()),
            Voids::FillWithinPosts(posts) => (table(&format!("fill_within_posts = {posts}")), filled(posts)),
            Voids::FillThenHole(posts) => {
                (table(&format!("fill_within_posts = {posts}, hole = true")), filled(posts) + "; others are holes")
            }
        };
        list.add("dem.voids", value, meaning);
    }

    fn describe_importance(&self, list: &mut List) {
        let importance = &self.importance;
        let excluded = if importance.default_weight == 0 { ": no post is chosen there" } else { "" };
        let meaning = format!("weight of every post that no area holds{excluded}");
        list.add("importance.default", weight(importance.default_weight), meaning);
        let areas: Vec<String> = importance.areas.iter().map(|area| self.area_text(area)).collect();
        let meaning = if areas.is_empty() {
            "all ground matters the same".to_owned()
        } else {
            format!("{} with a weight of their own, later ones over earlier ones", counted(areas.len(), "area"))
        };
        list.add("importance.areas", format!("[{}]", areas.join(", ")), meaning);
        match importance.smooth {
            Smooth::Binomial7 => {
                list.add("importance.smooth", quoted("binomial-7"), "weights are softened across 7 x 7 posts")
            }
            Smooth::None => list.add("importance.smooth", quoted("none"), "weights change from post to post"),
        }
    }

    fn area_text(&self, area: &ImportanceArea) -> String {
        let shape = match &area.shape {
            AreaShape::Polygons { file } => format!("file = {}", quoted(&file.written)),
            AreaShape::RasterValue { file, value } => format!("raster = {}, value = {value}", quoted(&file.written)),
            AreaShape::Slope { above, smooth_mm } => {
                let [above, smooth_m] = [above, smooth_mm].map(|thousandths| number(f64::from(*thousandths) / 1000.0));
                format!("slope_above_percent = {above}, smooth_m = {smooth_m}")
            }
            AreaShape::Sample(SampleClass::Mountains) => "sample = \"mountains\"".to_owned(),
        };
        let class = quoted(&self.importance.classes[usize::from(area.class)]);
        format!("{{ {shape}, class = {class}, weight = {} }}", weight(area.weight))
    }

    fn describe_tiles(&self, list: &mut List) {
        let tiles = &self.tiles;
        let tall = share(self.area.grid.rows, tiles.rows);
        let wide = share(self.area.grid.cols, tiles.columns);
        list.add(
            "tiles.columns",
            tiles.columns.to_string(),
            format!("tiles west to east, each {wide} load modules wide"),
        );
        list.add("tiles.rows", tiles.rows.to_string(), format!("tiles south to north, each {tall} load modules high"));
        match tiles.order {
            TileOrder::Color => list.add("tiles.order", quoted("colour"), "four colours: most tiles at once"),
            TileOrder::Raster => list.add("tiles.order", quoted("raster"), "row by row: a wave front of tiles"),
        }
        match tiles.borders {
            Borders::Inherit => list.add(
                "tiles.borders",
                quoted("inherit"),
                "a tile takes over the border points of its lower-ranked neighbours",
            ),
            Borders::Regular => {
                list.add("tiles.borders", quoted("regular"), "seams hold a point every border step, no others")
            }
        }
    }

    fn describe_modules(&self, list: &mut List) {
        let modules = &self.modules;
        let cells = self.area.grid.side_cells;
        list.add(
            "load_modules.side_m",
            number(modules.side_m),
            format!("a side of a load module, {}", counted(cells as usize, "cell")),
        );
        let steps = counted(modules.border_step_cells as usize, "cell");
        list.add(
            "load_modules.border_step_m",
            number(modules.border_step_m),
            format!("between points on a fixed outer border, {steps}"),
        );
        match modules.outer_border {
            OuterBorder::Refined => list.add(
                "load_modules.outer_border",
                quoted("refined"),
                "points on the outer border are chosen as others are, within the limits",
            ),
            OuterBorder::Fixed => list.add(
                "load_modules.outer_border",
                quoted("fixed"),
                "a point every border step and no others, as in an area beside this one",
            ),
        }
        match modules.edges {
            Edges::Constrained => list.add(
                "load_modules.edges",
                quoted("constrained"),
                "module lines are edges of the TIN from the start",
            ),
            Edges::Clip(heights) => {
                list.add("load_modules.edges", quoted("clip"), "triangles are cut at module lines after merging");
                let (word, meaning) = match heights {
                    ClipHeights::Coplanar => ("coplanar", "pieces of a triangle keep its plane"),
                    ClipHeights::Dem => ("dem", "cut vertices take the height of the DEM"),
                };
                list.add("load_modules.clip_heights", quoted(word), meaning);
            }
        }
    }

    fn describe_limits(&self, list: &mut List) {
        let limits = &self.limits;
        let (count, unit) = match limits.count {
            Count::Triangles => ("triangles", "triangles"),
            Count::Polygons => ("polygons", "convex polygons"),
        };
        list.add("limits.count", quoted(count), format!("limits count {unit}"));
        list.add("limits.per_load_module", limits.per_load_module.to_string(), format!("{unit} in one load module"));
        list.add("limits.pool", limits.pool.to_string(), format!("{unit} above that in the whole area together"));
        let budget = limits.area_budget(&self.area.grid);
        list.add(
            "limits.mean_per_load_module",
            number(limits.mean_per_load_module),
            format!("{unit} on average, {budget} in the whole area"),
        );
        let (rows, cols, side_m) = (limits.window.rows, limits.window.cols, self.modules.side_m);
        let (high, wide) = (f64::from(rows) * side_m, f64::from(cols) * side_m);
        list.add(
            "limits.per_4km_square",
            limits.window.limit.to_string(),
            format!("{unit} in every window of {rows} x {cols} load modules ({high} m x {wide} m)"),
        );
    }

    fn describe_tin(&self, list: &mut List) {
        let tin = &self.tin;
        let (method, meaning) = match tin.method {
            Method::Paper { .. } => ("paper", "largest residual first, in batches"),
            Method::Greedy => ("greedy", "one worst post at a time"),
            Method::Optimised(_) => ("optimised", "lowest RMS residual under the limits"),
        };
        list.add("tin.method", quoted(method), meaning);
        if let Budget::Points(points) = tin.budget {
            list.add("tin.points", points.to_string(), "selected points in the whole area");
        }
        match tin.key {
            ErrorKey::Max => list.add("tin.key", quoted("max"), "a post is worth its weighted residual"),
            ErrorKey::Sse => list.add("tin.key", quoted("sse"), "a triangle is worth its weighted squared residuals"),
        }
        match tin.allocation {
            Allocation::Equal => list.add("tin.allocation", quoted("equal"), "every tile gets the same share"),
            Allocation::Global => {
                list.add("tin.allocation", quoted("global"), "tiles share by what a survey says they gain")
            }
        }
        if let Method::Optimised(optimising) = tin.method {
            describe_optimising(optimising, list);
        } else {
            let metres = number(metres_of_quanta(tin.residual_quantum as i32));
            let meaning = format!("residuals are compared in steps of {metres} m");
            list.add("tin.residual_quantum_m", metres, meaning);
        }
        self.describe_batches(list);
        if let Some(metres) = tin.max_residual_m {
            list.add("tin.max_residual_m", number(metres), "choosing ends when no residual is larger");
        }
        if let Some(metres) = tin.target_rms_m {
            list.add("tin.target_rms_m", number(metres), "choosing ends at this RMS residual over the area");
        }
        describe_given(tin, list);
    }

    fn describe_batches(&self, list: &mut List) {
        let Method::Paper { proximity, last_batch } = self.tin.method else { return };
        match proximity {
            Some(near) => {
                let (horizontal, vertical) = (near.horizontal_m, near.vertical_m);
                let meaning = format!("a post within {horizontal} m and {vertical} m of height of a vertex waits");
                list.add("tin.proximity_m", pair([horizontal, vertical]), meaning);
            }
            None => list.add("tin.proximity", "false".to_owned(), "no post waits for being near a vertex"),
        }
        match last_batch {
            LastBatch::Truncate => {
                list.add("tin.last_batch", quoted("truncate"), "the last batch is cut to meet the points")
            }
            LastBatch::Finish => list.add("tin.last_batch", quoted("finish"), "the last batch goes in whole"),
        }
    }
}

fn describe_optimising(optimising: Optimising, list: &mut List) {
    let (effort, meaning) = match optimising.effort {
        Effort::Fast => ("fast", "chosen posts are moved, edges flipped: half the paper's RMS residual"),
        Effort::Normal => ("normal", "more posts are chosen, thinned, exchanged: a fifth below fast, 6 times as long"),
        Effort::Best => ("best", "more still, grown and thinned in turns: 4 % below normal, 5 times as long"),
    };
    list.add("tin.effort", quoted(effort), meaning);
    let (heights, meaning) = match optimising.height_fit {
        HeightFit::Squares => ("l2", "vertices stand where squared residuals are least"),
        HeightFit::SquaresKeepCrests => {
            ("l2_keep_crests", "vertices stand where squared residuals are least, crests at DEM height")
        }
        HeightFit::Off => ("off", "vertices stand at DEM height"),
    };
    list.add("tin.height_fit", quoted(heights), meaning);
    let (lattice, meaning) = match optimising.lattice {
        Lattice::Eighth => ("eighth", "vertices stand on eighths of a post, those on lines between tiles on posts"),
        Lattice::Post => ("post", "vertices stand on posts"),
    };
    list.add("tin.lattice", quoted(lattice), meaning);
}

/// The settings so far.
struct List(Vec<Setting>);

impl List {
    fn add(&mut self, key: &'static str, value: String, meaning: impl Into<String>) {
        self.0.push(Setting { key, value, meaning: meaning.into() });
    }
}

/// A number as TOML, the shortest that reads back the same: 500 for 500.0, 31.25, 1e-7.
fn number(value: f64) -> String {
    let value = value + 0.0; // so that -0 is written as 0
    if value.fract() == 0.0 && value.abs() < 1.0e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

fn pair(values: [f64; 2]) -> String {
    format!("[{}, {}]", number(values[0]), number(values[1]))
}

/// A weight in thousandths as TOML.
fn weight(thousandths: u16) -> String {
    number(f64::from(thousandths) / f64::from(THOUSANDTHS))
}

/// A text as a TOML basic string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out += &format!("\\u{:04X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}

/// An entry of `dem.sources` as TOML.
fn source_text(SourceEntry { name, said }: &SourceEntry) -> String {
    let mut keys = Vec::new();
    keys.extend(said.crs.as_ref().map(|crs| format!("crs = {}", quoted(crs))));
    keys.extend(said.corner.map(|corner| format!("corner = {}", pair(corner))));
    keys.extend(said.height_unit_m.map(|unit_m| format!("height_unit_m = {}", number(unit_m))));
    keys.extend(said.nodata.map(|nodata| format!("nodata = {}", number(nodata))));
    keys.extend(said.vertical_datum.as_ref().map(|datum| format!("vertical_datum = {}", quoted(datum))));
    keys.extend(said.attribution.as_ref().map(|text| format!("attribution = {}", quoted(text))));
    match keys.is_empty() {
        true => quoted(name),
        false => format!("{{ file = {}, {} }}", quoted(name), keys.join(", ")),
    }
}

fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// How many of `modules` each of `tiles` gets: one number, or the two that occur.
fn share(modules: u32, tiles: u32) -> String {
    let least = modules / tiles;
    if modules.is_multiple_of(tiles) { least.to_string() } else { format!("{least} or {}", least + 1) }
}

/// Points that the job gives.
fn describe_given(tin: &TinSpec, list: &mut List) {
    match &tin.start {
        Some(Start::File(file)) => list.add("tin.start", quoted(&file.written), "points that tiles start from"),
        Some(Start::Method { method, points }) => {
            let name = quoted(method.name());
            let points = points.map_or(String::new(), |points| format!(", points = {points}"));
            let meaning = "tiles start from what that method chooses";
            list.add("tin.start", format!("{{ method = {name}{points} }}"), meaning);
        }
        None => {}
    }
    if let Some(file) = &tin.pins {
        let meaning = "points to add and to leave out, heights, and ground that matters more or less";
        list.add("tin.pins", quoted(&file.written), meaning);
    }
}

/// Levels beside the finest; a job without any says nothing of them.
fn describe_lod(lod: &LodSpec, list: &mut List) {
    if lod.inner_shares.is_empty() {
        return;
    }
    let levels: Vec<String> =
        lod.inner_shares.iter().map(|&share| format!("{{ inner_share = {} }}", number(share))).collect();
    let meaning =
        format!("{} beside the finest, with this share of its inner vertices", counted(levels.len(), "level"));
    list.add("lod.levels", format!("[{}]", levels.join(", ")), meaning);
    match lod.border {
        LodBorder::Full => {
            list.add("lod.border", quoted("full"), "levels keep all vertices on sides: any two fit together")
        }
        LodBorder::Own => {
            list.add("lod.border", quoted("own"), "levels keep their share on sides, too: equal levels fit together")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_the_same() {
        for value in [500.0, 31.25, 0.0078125, 1.0e-4, 5264750.5, 0.1 + 0.2, -3.0] {
            assert_eq!(number(value).parse::<f64>().unwrap(), value);
        }
        assert_eq!((number(500.0), weight(8000), weight(125)), ("500".into(), "8".into(), "0.125".into()));
    }

    #[test]
    fn text_is_escaped() {
        assert_eq!(quoted("a\"b\\c\n"), "\"a\\\"b\\\\c\\u000A\"");
    }
}
