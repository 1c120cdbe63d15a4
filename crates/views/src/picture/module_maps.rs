//! Maps with a colour for every load module: how many triangles, how much of a limit; and the tile plan.

use store::TileState;
use terrain::{ModuleId, ModuleRect, TileId};

use super::color::{BOUND, BREACH, COUNTS, Color, GREY, INK, KINDS, PALE, USE, WHITE, ink_on};
use super::image::Image;
use super::map_extent::MapExtent;
use super::scene::Scene;
use super::sheet::{Drawing, Key, Legend, Sheet, draw_crossed, round_marks};
use super::text::{Anchor, Font, write};
use crate::table::grouped;

/// Triangles per load module.
pub(crate) fn density(scene: &Scene, longest: usize) -> Drawing {
    let map_extent = scene.map_extent(longest);
    // Without what limits count, triangles: of the load modules that are there, which are those of the part.
    let limits = scene.limits;
    let is_known = !limits.modules.is_empty();
    let counts: Vec<u32> = match is_known {
        true => scene.part.iter().map(|module| limits.modules[scene.grid.index(module)]).collect(),
        false => scene.modules.iter().map(|module| module.counts().triangles).collect(),
    };
    let low = counts.iter().copied().min().unwrap_or(0);
    let high = counts.iter().copied().max().unwrap_or(0).max(low + 1);
    let color = |count: u32| COUNTS.at(f64::from(count - low) / f64::from(high - low));
    let mut map = Image::new(map_extent.pixels[0], map_extent.pixels[1], WHITE);
    for (module, &count) in scene.part.iter().zip(&counts) {
        fill(&mut map, scene, &map_extent, one(module), color(count));
    }
    let wide = scene.part.east - scene.part.west;
    label_modules(&mut map, scene, &map_extent, |module| {
        let count = counts[((module.row - scene.part.south) * wide + module.col - scene.part.west) as usize];
        (count.to_string(), ink_on(color(count)))
    });
    let marks = round_marks(f64::from(low), f64::from(high)).into_iter();
    // There are no parts of triangles.
    let marks = marks.filter(|(_, count)| count.fract() == 0.0).map(|(share, count)| (share, grouped(count as u64)));
    let mean = counts.iter().map(|&count| f64::from(count)).sum::<f64>() / counts.len().max(1) as f64;
    let what = if is_known { limits.count.as_str() } else { "triangles" };
    let sheet = Sheet {
        title: format!("{}: {what} per load module", scene.name),
        subtitle: format!(
            "{}, {} {what}, mean {mean:.1}, from {low} to {high} in a load module of {} m",
            scene.what(),
            grouped(counts.iter().map(|&count| u64::from(count)).sum()),
            scene.side_m()
        ),
        coordinates: scene.coordinates(),
        legends: vec![Legend::Ramp { title: format!("{what} in a load module"), ramp: COUNTS, marks: marks.collect() }],
        notes: String::new(),
    };
    Drawing { sheet, map, map_extent }
}

/// How much of both limits is used, side by side: of load modules, and of the windows around every place.
pub(crate) fn limits(scene: &Scene, longest: usize) -> [Drawing; 2] {
    [module_limits(scene, longest), window_limits(scene, longest)]
}

/// The legend of a map of use, with what stands on no scale.
fn use_legends(limit: u32, what: &str, is_bound: bool) -> Vec<Legend> {
    let marks = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share: f64| {
        let count = share * f64::from(limit);
        (share, format!("{:.0} %  {}", share * 100.0, grouped(count.round() as u64)))
    });
    let mut keys = vec![(Key::Crossed(BREACH), "above: breach".into())];
    if is_bound {
        keys.push((Key::Framed(BOUND), "posts refused here".into()));
    }
    vec![
        Legend::Ramp { title: format!("Use of the limit: {what}"), ramp: USE, marks: marks.into() },
        Legend::Keys { title: String::new(), keys },
    ]
}

pub(crate) fn module_limits(scene: &Scene, longest: usize) -> Drawing {
    let (map_extent, limits) = (scene.map_extent(longest), scene.limits);
    let limit = limits.per_load_module;
    let mut map = Image::new(map_extent.pixels[0], map_extent.pixels[1], WHITE);
    let mut over = Vec::new();
    for module in scene.part.iter() {
        let count = limits.modules[scene.grid.index(module)];
        if limit < count {
            over.push(map_extent.rect(scene.extent_m(one(module))));
        } else {
            fill(&mut map, scene, &map_extent, one(module), USE.at(f64::from(count) / f64::from(limit)));
        }
    }
    for &module in limits.bound_modules.iter().filter(|module| scene.part.contains(**module)) {
        frame(&mut map, scene, &map_extent, one(module));
    }
    draw_breaches(&mut map, &over);
    label_modules(&mut map, scene, &map_extent, |module| {
        let count = limits.modules[scene.grid.index(module)];
        let share = f64::from(count) / f64::from(limit);
        (count.to_string(), if limit < count { INK } else { ink_on(USE.at(share)) })
    });
    let most = scene.part.iter().map(|module| limits.modules[scene.grid.index(module)]).max().unwrap_or(0);
    let sheet = Sheet {
        title: format!("{}: limit of a load module", scene.name),
        subtitle: format!("{}, at most {most} of {limit} {}, {} above", scene.what(), limits.count, over.len()),
        coordinates: scene.coordinates(),
        legends: use_legends(limit, &format!("{} in a load module", limits.count), !limits.bound_modules.is_empty()),
        notes: String::new(),
    };
    Drawing { sheet, map, map_extent }
}

/// Marks breaches over all else. A few of them are drawn large enough to be found on a map of thousands of squares.
fn draw_breaches(map: &mut Image, rects: &[[i64; 4]]) {
    const FEW: usize = 200;
    let least = if rects.len() <= FEW { 17 } else { 1 };
    for &[left, top, wide, high] in rects {
        let grow = |size: i64| (least - size).max(0).div_euclid(2);
        let (beside, above) = (grow(wide), grow(high));
        draw_crossed(map, [left - beside, top - above, wide + 2 * beside, high + 2 * above], BREACH);
    }
}

/// The windows have their middles a load module apart, so each is drawn as one square there.
fn window_limits(scene: &Scene, longest: usize) -> Drawing {
    let (map_extent, limits) = (scene.map_extent(longest), scene.limits);
    let [rows, cols] = limits.window;
    let origins = ModuleRect { south: 0, west: 0, north: scene.grid.rows - rows + 1, east: scene.grid.cols - cols + 1 };
    let mut map = Image::new(map_extent.pixels[0], map_extent.pixels[1], PALE);
    let (mut most, mut over) = (0, Vec::new());
    for (origin, &count) in origins.iter().zip(&limits.windows) {
        let rect = map_extent.rect(middle_of(scene, origin));
        let seen = rect[0] < map_extent.pixels[0] as i64 && 0 < rect[0] + rect[2];
        if !(seen && rect[1] < map_extent.pixels[1] as i64 && 0 < rect[1] + rect[3]) {
            continue;
        }
        most = most.max(count);
        if limits.per_window < count {
            over.push(rect);
        } else {
            map.fill(rect, USE.at(f64::from(count) / f64::from(limits.per_window)));
        }
    }
    for &origin in &limits.bound_windows {
        map.outline(map_extent.rect(middle_of(scene, origin)), 2, BOUND);
    }
    draw_breaches(&mut map, &over);
    let (high_m, wide_m) = (f64::from(rows) * scene.side_m(), f64::from(cols) * scene.side_m());
    let size = format!("{} x {} km", wide_m / 1000.0, high_m / 1000.0);
    let sheet = Sheet {
        title: format!("{}: limit of {size} windows", scene.name),
        subtitle: format!(
            "{}, at most {} of {} {}, {} above",
            scene.what(),
            grouped(u64::from(most)),
            grouped(u64::from(limits.per_window)),
            limits.count,
            over.len()
        ),
        coordinates: scene.coordinates(),
        legends: use_legends(
            limits.per_window,
            &format!("{} in a window", limits.count),
            !limits.bound_windows.is_empty(),
        ),
        notes: format!(
            "Each square is the middle of a window of {rows} x {cols} load modules; grey: no window's middle."
        ),
    };
    Drawing { sheet, map, map_extent }
}

/// West, south, east and north of the square in the middle of a window.
fn middle_of(scene: &Scene, origin: ModuleId) -> [f64; 4] {
    let [rows, cols] = scene.limits.window;
    let side_m = scene.side_m();
    let west = (f64::from(origin.col) + f64::from(cols - 1) / 2.0) * side_m;
    let south = (f64::from(origin.row) + f64::from(rows - 1) / 2.0) * side_m;
    [west, south, west + side_m, south + side_m]
}

pub(crate) fn one(module: ModuleId) -> ModuleRect {
    ModuleRect { south: module.row, west: module.col, north: module.row + 1, east: module.col + 1 }
}

pub(crate) fn fill(map: &mut Image, scene: &Scene, map_extent: &MapExtent, modules: ModuleRect, color: Color) {
    map.fill(map_extent.rect(scene.extent_m(modules)), color);
}

fn frame(map: &mut Image, scene: &Scene, map_extent: &MapExtent, modules: ModuleRect) {
    map.outline(map_extent.rect(scene.extent_m(modules)), 2, BOUND);
}

/// Writes into every load module, where there is room for it.
fn label_modules(map: &mut Image, scene: &Scene, map_extent: &MapExtent, label: impl Fn(ModuleId) -> (String, Color)) {
    let side = scene.side_m() / map_extent.metres_per_pixel();
    if side < 44.0 {
        return;
    }
    for module in scene.part.iter() {
        let [left, top, wide, high] = map_extent.rect(scene.extent_m(one(module)));
        let (text, ink) = label(module);
        let place = [left + wide / 2, top + high / 2 - Font::Plain.line() / 2];
        write(map, place, &text, Font::Plain, Anchor::Middle, ink);
    }
}

/// Which tile lies where, in which order, and how it stands.
pub(crate) fn tiles(scene: &Scene, longest: usize) -> Drawing {
    let map_extent = scene.map_extent(longest);
    let mut map = Image::new(map_extent.pixels[0], map_extent.pixels[1], WHITE);
    for tile in scene.tiles {
        fill(&mut map, scene, &map_extent, tile.modules, KINDS[tile.color as usize % KINDS.len()]);
    }
    draw_module_lines(&mut map, scene, &map_extent);
    for tile in scene.tiles {
        let rect = map_extent.rect(scene.extent_m(tile.modules));
        map.outline([rect[0], rect[1], rect[2] + 1, rect[3] + 1], 2, INK);
        label_tile(&mut map, scene, rect, tile);
    }
    let count = |state| scene.tiles.iter().filter(|tile| tile.state == state).count();
    let states = STATES.iter().filter(|(state, _)| 0 < count(*state));
    let lines = states.map(|(state, name)| format!("{name}: {}", count(*state))).collect();
    let colors = scene.tiles.iter().map(|tile| tile.color).max().map_or(0, |most| most as usize + 1);
    let keys = (0..colors.min(KINDS.len())).map(|color| (Key::Filled(KINDS[color]), format!("turn {}", color + 1)));
    let sheet = Sheet {
        title: format!("{}: tiles", scene.name),
        subtitle: format!(
            "{}, {} tiles, {} load modules",
            scene.what(),
            scene.tiles.len(),
            grouped(scene.grid.count() as u64)
        ),
        coordinates: scene.coordinates(),
        legends: vec![
            Legend::Keys { title: "May be refined at once".into(), keys: keys.collect() },
            Legend::Lines { title: "State".into(), lines },
        ],
        notes: "In each tile: row,column; its place in the order of ranks (a tile inherits its sides from neighbours \
                before it); its triangles. Fine lines: load modules."
            .into(),
    };
    Drawing { sheet, map, map_extent }
}

const STATES: [(TileState, &str); 5] = [
    (TileState::Done, "done"),
    (TileState::OverLimit, "over a limit"),
    (TileState::Frozen, "frozen"),
    (TileState::Failed, "failed"),
    (TileState::Missing, "missing"),
];

fn draw_module_lines(map: &mut Image, scene: &Scene, map_extent: &MapExtent) {
    if scene.side_m() / map_extent.metres_per_pixel() < 4.0 {
        return;
    }
    for module in scene.part.iter() {
        let [left, top, wide, high] = map_extent.rect(scene.extent_m(one(module)));
        for x in left..left + wide {
            map.blend(x, top, GREY, 0.35);
        }
        for y in top..top + high {
            map.blend(left, y, GREY, 0.35);
        }
    }
}

fn label_tile(map: &mut Image, scene: &Scene, [left, top, wide, high]: [i64; 4], tile: &super::scene::SceneTile) {
    let TileId { row, col } = tile.tile;
    let triangles: u64 = scene
        .modules
        .iter()
        .filter(|module| tile.modules.contains(module.id))
        .map(|module| u64::from(module.counts().triangles))
        .sum();
    let state = STATES.iter().find(|(state, _)| *state == tile.state).map_or("", |(_, name)| name);
    let mut lines = vec![
        (format!("{row},{col}"), Font::Title),
        (format!("rank {}", tile.rank + 1), Font::Plain),
        (grouped(triangles), Font::Plain),
    ];
    if tile.state != TileState::Done {
        lines.push((state.to_owned(), Font::Bold));
    }
    lines.retain(|(text, font)| font.width(text) + 4 < wide);
    while high < lines.iter().map(|(_, font)| font.line()).sum::<i64>() + 4 {
        lines.pop();
    }
    let mut y = top + (high - lines.iter().map(|(_, font)| font.line()).sum::<i64>()) / 2;
    for (text, font) in lines {
        write(map, [left + wide / 2, y], &text, font, Anchor::Middle, INK);
        y += font.line();
    }
}

#[cfg(test)]
mod tests {
    use terrain::GridFrame;

    use super::super::scene::SceneLimits;
    use super::*;
    use crate::samples;

    /// Whether a colour is anywhere on the map of limits, under this limit of a load module.
    fn shows(color: Color, per_load_module: u32) -> bool {
        let modules = samples::modules();
        let limits = SceneLimits {
            count: "triangles".into(),
            modules: vec![4, 4, 4, 4, 4, 101],
            per_load_module,
            window: [2, 2],
            windows: vec![16, 113],
            per_window: 4096,
            bound_modules: vec![ModuleId { row: 0, col: 1 }],
            bound_windows: Vec::new(),
        };
        let scene = Scene {
            name: "x",
            crs: "EPSG:32611",
            grid: samples::GRID,
            frame: GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing: samples::spacing() },
            part: samples::GRID.all(),
            modules: &modules,
            ground: None,
            limits: &limits,
            water: None,
            features: None,
            tiles: &[],
        };
        let map_extent = scene.map_extent(300);
        let image = module_limits(&scene, 300).map;
        let mut places = (0..map_extent.pixels[0]).flat_map(|x| (0..map_extent.pixels[1]).map(move |y| (x, y)));
        places.any(|(x, y)| image.pixel(x, y) == color)
    }

    #[test]
    fn a_load_module_above_its_limit_is_marked_and_one_below_is_not() {
        assert!(shows(BREACH, 100) && !shows(BREACH, 101));
    }

    #[test]
    fn a_load_module_that_refused_posts_is_framed() {
        assert!(shows(BOUND, 100));
    }
}
