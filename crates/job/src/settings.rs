//! Every setting of a job: as TOML, and with what it means.
//!
//! One list serves both the announcement at the start of a run and the canonical text in `database.json`, so the two
//! cannot disagree. The canonical text is itself a job: reading it gives the same settings again.

use terrain::{MaterialName, THOUSANDTHS, metres_of_quanta};

use crate::setting_list::{List, Setting, counted, number, quoted};
use crate::{
    AreaShape, Budget, Choice, DemSource, Edges, GeoidSpec, ImportanceArea, Job, LodSpec, Method, Optimising,
    Resampling, Sight, SourceEntry, Start, TinSpec, Voids, WaterSpec, settings_features, usual_text,
};

/// The lines of a [canonical text](Job::canonical_text) that decide what is built: all but the title, which only stands
/// above the report's page, and the section of what exports are told.
pub fn deciding_lines(canonical: &str) -> impl Iterator<Item = &str> {
    let mut is_of_exports = false;
    canonical.lines().filter(move |line| {
        if line.starts_with('[') {
            is_of_exports = *line == "[exports]";
        }
        !is_of_exports && !line.starts_with("title = ")
    })
}

impl Job {
    /// Every setting of the job with its value and meaning, defaults included, in the order of the sections.
    pub fn describe(&self) -> Vec<Setting> {
        let mut list = List(Vec::new());
        self.describe_area(&mut list);
        self.describe_dem(&mut list);
        self.describe_importance(&mut list);
        self.features.iter().for_each(|features| settings_features::describe(features, &mut list));
        self.objects.iter().for_each(|objects| settings_features::describe_objects(objects, &mut list));
        self.describe_tiles(&mut list);
        self.describe_modules(&mut list);
        self.describe_limits(&mut list);
        self.describe_tin(&mut list);
        describe_lod(&self.lod, &mut list);
        describe_materials(&self.materials, &mut list);
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
        list.add("area.name", quoted(&area.name));
        if let Some(title) = &area.title {
            list.add("area.title", quoted(title));
        }
        list.add("area.crs", quoted(&format!("EPSG:{}", area.epsg)));
        list.add("area.origin_m", pair(area.origin_m));
        let (rows, cols) = (area.grid.rows, area.grid.cols);
        list.add_with("area.size_m", pair(area.size_m()), format!("{cols} x {rows} load modules"));
        let posts = area.grid.area();
        let size = format!("{} x {} posts", posts.posts_wide(), posts.posts_high());
        list.add_with("area.spacing_m", number(area.spacing.metres()), size);
    }

    fn describe_dem(&self, list: &mut List) {
        match &self.dem.source {
            source @ DemSource::Sample { seed } => {
                list.choice("dem.source", source);
                list.add("dem.seed", seed.to_string());
            }
            DemSource::Files { written, files } => {
                let names: Vec<String> = written.iter().map(source_text).collect();
                list.add_with("dem.sources", format!("[{}]", names.join(", ")), counted(files.len(), "raster"));
            }
        }
        if let Some(datum) = &self.dem.vertical_datum {
            list.add("dem.vertical_datum", quoted(datum));
        }
        self.describe_voids(list);
        if self.dem.resampling == Resampling::Cubic {
            list.choice("dem.resampling", &self.dem.resampling);
        }
        if 0.0 < self.dem.feather_m {
            list.add("dem.feather_m", number(self.dem.feather_m));
        }
        if !self.dem.geoids.is_empty() {
            let grid = |geoid: &GeoidSpec| {
                format!("{{ datum = {}, file = {} }}", quoted(&geoid.datum), quoted(&geoid.file.written))
            };
            let grids: Vec<String> = self.dem.geoids.iter().map(grid).collect();
            list.add("dem.geoids", format!("[{}]", grids.join(", ")));
        }
        if let Some(water) = &self.dem.water {
            list.add_with("dem.water", self.water_text(water), water_level(water));
        }
    }

    fn water_text(&self, water: &WaterSpec) -> String {
        let mut keys = vec![format!("file = {}", quoted(&water.file.written))];
        keys.extend(water.level_m.map(|level_m| format!("level_m = {}", number(level_m))));
        keys.push(format!("class = {}", quoted(&self.importance.classes[usize::from(water.class)])));
        keys.extend(water.weight.map(|thousandths| format!("weight = {}", weight(thousandths))));
        format!("{{ {} }}", keys.join(", "))
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
        list.say("dem.voids", value, meaning);
    }

    fn describe_importance(&self, list: &mut List) {
        let importance = &self.importance;
        let default = weight(importance.default_weight);
        match importance.default_weight {
            0 => list.add_with("importance.default", default, "no post is chosen there"),
            _ => list.add("importance.default", default),
        }
        let areas: Vec<String> = importance.areas.iter().map(|area| self.area_text(area)).collect();
        let text = format!("[{}]", areas.join(", "));
        match areas.is_empty() {
            true => list.say("importance.areas", text, "all ground matters the same"),
            false => list.add_with("importance.areas", text, counted(areas.len(), "area")),
        }
        list.choice("importance.smooth", &importance.smooth);
    }

    fn area_text(&self, area: &ImportanceArea) -> String {
        let shape = match &area.shape {
            AreaShape::Polygons { file } => format!("file = {}", quoted(&file.written)),
            AreaShape::RasterValue { file, value } => format!("raster = {}, value = {value}", quoted(&file.written)),
            AreaShape::Slope { above, smooth_mm } => {
                let [above, smooth_m] = [above, smooth_mm].map(|thousandths| number(f64::from(*thousandths) / 1000.0));
                format!("slope_above_percent = {above}, smooth_m = {smooth_m}")
            }
            AreaShape::Level { height_mm } => format!("level_m = {}", number(f64::from(*height_mm) / 1000.0)),
            AreaShape::Sample(class) => format!("sample = {}", quoted(class.name())),
        };
        let class = quoted(&self.importance.classes[usize::from(area.class)]);
        format!("{{ {shape}, class = {class}, weight = {} }}", weight(area.weight))
    }

    fn describe_tiles(&self, list: &mut List) {
        let tiles = &self.tiles;
        let tall = share(self.area.grid.rows, tiles.rows);
        let wide = share(self.area.grid.cols, tiles.columns);
        let columns = format!("tiles west to east, each {wide} load modules wide");
        list.say("tiles.columns", tiles.columns.to_string(), columns);
        let rows = format!("tiles south to north, each {tall} load modules high");
        list.say("tiles.rows", tiles.rows.to_string(), rows);
        list.choice("tiles.order", &tiles.order);
        list.choice("tiles.borders", &tiles.borders);
    }

    fn describe_modules(&self, list: &mut List) {
        let modules = &self.modules;
        let cells = |count: i32| counted(count as usize, "cell");
        list.add_with("load_modules.side_m", number(modules.side_m), cells(self.area.grid.side_cells));
        let step = number(modules.border_step_m);
        list.add_with("load_modules.border_step_m", step, cells(modules.border_step_cells));
        list.choice("load_modules.outer_border", &modules.outer_border);
        list.choice("load_modules.edges", &modules.edges);
        if let Edges::Clip(heights) = &modules.edges {
            list.choice("load_modules.clip_heights", heights);
        }
        // Without features there is nothing that it could leave out.
        if self.features.is_some() || modules.format.to_string() != usual_text("load_modules.format") {
            list.add("load_modules.format", modules.format.to_string());
        }
    }

    fn describe_limits(&self, list: &mut List) {
        let limits = &self.limits;
        list.choice("limits.count", &limits.count);
        list.add("limits.per_load_module", limits.per_load_module.to_string());
        list.add("limits.pool", limits.pool.to_string());
        let budget = format!("{} in the whole area", limits.area_budget(&self.area.grid));
        list.add_with("limits.mean_per_load_module", number(limits.mean_per_load_module), budget);
        let (rows, cols, side_m) = (limits.window.rows, limits.window.cols, self.modules.side_m);
        let (high, wide) = (f64::from(rows) * side_m, f64::from(cols) * side_m);
        let window = format!("{rows} x {cols} of them ({high} m x {wide} m)");
        list.add_with("limits.per_4km_square", limits.window.limit.to_string(), window);
    }

    fn describe_tin(&self, list: &mut List) {
        let tin = &self.tin;
        list.choice("tin.method", &tin.method.name());
        if let Budget::Points(points) = tin.budget {
            list.add("tin.points", points.to_string());
        }
        list.choice("tin.key", &tin.key);
        list.choice("tin.allocation", &tin.allocation);
        match tin.method {
            Method::Optimised(Optimising { effort, height_fit, lattice, sight }) => {
                list.choice("tin.effort", &effort);
                list.choice("tin.height_fit", &height_fit);
                list.choice("tin.lattice", &lattice);
                list.add("tin.sight", sight.is_some().to_string());
                if let Some(Sight { eyes_quanta, range_quanta }) = sight {
                    list.add("tin.sight_eyes_m", pair(eyes_quanta.map(metres_of_quanta)));
                    list.add("tin.sight_range_m", number(metres_of_quanta(range_quanta)));
                }
            }
            Method::Greedy | Method::Paper { .. } => {
                let metres = number(metres_of_quanta(tin.residual_quantum as i32));
                let meaning = format!("residuals are compared in steps of {metres} m");
                list.say("tin.residual_quantum_m", metres, meaning);
            }
        }
        self.describe_batches(list);
        for (key, metres) in [("tin.max_residual_m", tin.max_residual_m), ("tin.target_rms_m", tin.target_rms_m)] {
            metres.into_iter().for_each(|metres| list.add(key, number(metres)));
        }
        describe_given(tin, list);
    }

    fn describe_batches(&self, list: &mut List) {
        let Method::Paper { proximity, last_batch } = self.tin.method else { return };
        match proximity {
            Some(near) => {
                let (horizontal, vertical) = (near.horizontal_m, near.vertical_m);
                let meaning = format!("a post within {horizontal} m and {vertical} m of height of a vertex waits");
                list.say("tin.proximity_m", pair([horizontal, vertical]), meaning);
            }
            None => list.say("tin.proximity", "false".to_owned(), "no post waits for being near a vertex"),
        }
        list.choice("tin.last_batch", &last_batch);
    }
}

fn water_level(water: &WaterSpec) -> &'static str {
    match water.level_m {
        Some(_) => "all at one level",
        None => "each at the median of its heights",
    }
}

fn pair(values: [f64; 2]) -> String {
    format!("[{}, {}]", number(values[0]), number(values[1]))
}

/// A weight in thousandths as TOML.
fn weight(thousandths: u16) -> String {
    number(f64::from(thousandths) / f64::from(THOUSANDTHS))
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

/// How many of `modules` each of `tiles` gets: one number, or the two that occur.
fn share(modules: u32, tiles: u32) -> String {
    let least = modules / tiles;
    if modules.is_multiple_of(tiles) { least.to_string() } else { format!("{least} or {}", least + 1) }
}

/// Points that the job gives.
fn describe_given(tin: &TinSpec, list: &mut List) {
    match &tin.start {
        Some(Start::File(file)) => list.add("tin.start", quoted(&file.written)),
        Some(Start::Method { method, points }) => {
            let points = points.map_or(String::new(), |points| format!(", points = {points}"));
            let text = format!("{{ method = {}{points} }}", quoted(method.name()));
            list.add_with("tin.start", text, method.word().meaning);
        }
        None => {}
    }
    if let Some(file) = &tin.pins {
        list.add("tin.pins", quoted(&file.written));
    }
}

/// Levels beside the finest; a job without any says nothing of them.
fn describe_lod(lod: &LodSpec, list: &mut List) {
    if lod.inner_shares.is_empty() {
        return;
    }
    let level = |(&share, classes): (&f64, &Vec<String>)| {
        let classes: Vec<String> = classes.iter().map(|class| quoted(class)).collect();
        let leave_out =
            if classes.is_empty() { String::new() } else { format!(", leave_out = [{}]", classes.join(", ")) };
        format!("{{ inner_share = {}{leave_out} }}", number(share))
    };
    let levels: Vec<String> = lod.inner_shares.iter().zip(&lod.leave_out).map(level).collect();
    let text = format!("[{}]", levels.join(", "));
    list.add_with(
        "lod.levels",
        text,
        format!("{}, with this share of its inner vertices", counted(levels.len(), "level")),
    );
    list.choice("lod.border", &lod.border);
}

/// Materials that are called otherwise.
fn describe_materials(materials: &[MaterialName], list: &mut List) {
    if materials.is_empty() {
        return;
    }
    let material = |MaterialName { of, name, surface_code, feature_id }: &MaterialName| {
        let codes = [("surface_code", surface_code), ("feature_id", feature_id)];
        let codes: String = codes.iter().filter_map(|(key, code)| Some(format!(", {key} = {}", (**code)?))).collect();
        let (of, name) = (quoted(of), quoted(name));
        if codes.is_empty() { format!("{of} = {name}") } else { format!("{of} = {{ name = {name}{codes} }}") }
    };
    let text = materials.iter().map(material).collect::<Vec<_>>().join(", ");
    list.say(
        "exports.materials",
        format!("{{ {text} }}"),
        format!("{} so called", counted(materials.len(), "material")),
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_written_in_whole_and_in_parts() {
        assert_eq!((weight(8000), weight(125)), ("8".into(), "0.125".into()));
    }
}
