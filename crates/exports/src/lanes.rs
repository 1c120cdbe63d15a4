//! Places along and across ways: where each corner of a road, rail or stream lies on its band, for textures of lanes.
//!
//! Lines of one class and width that meet end to end, two and no more, are one way, whatever load modules they lie in;
//! so places go on where a road does.

use std::collections::HashMap;

use terrain::{LineForm, LineKind, ModuleLine, QUANTA_PER_METRE};

use crate::Product;

/// Side of the squares by which stretches are found, in quanta.
const CELL: i32 = 64 * QUANTA_PER_METRE;
/// How far beyond the edge of a way a triangle of it may have its middle, in quanta.
const BESIDE: f64 = 0.5 * QUANTA_PER_METRE as f64;

/// What lines have in common that are parts of one way.
type Same = (LineKind, u8, u16);
/// An end of a line: its number, and whether it is its last place.
type End = (usize, bool);

/// A stretch of a way between two places, in quanta from the south-west corner of what is exported.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    way: u32,
    ends: [[i32; 2]; 2],
    /// How far it begins along its way.
    along: f64,
    width: f64,
}

/// The ways of a product, and where they run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lanes {
    stretches: Vec<Stretch>,
    /// Stretches by class and square, in order.
    near: HashMap<(u8, [i32; 2]), Vec<u32>>,
}

impl Lanes {
    /// Those of a product; `None` where it has no way that is drawn.
    pub(crate) fn of(product: &Product) -> Option<Self> {
        let all = product.lines.iter().zip(&product.modules);
        let lines = all.flat_map(|(lines, module)| lines.iter().map(move |line| (line, product.corner(module.id))));
        let parts: Vec<(Same, Vec<[i32; 2]>)> = lines.filter(|(line, _)| is_drawn(line)).map(part).collect();
        let mut lanes = Self::default();
        for (way, (same, places)) in joined(&parts).into_iter().enumerate() {
            lanes.add(way as u32, same, &places);
        }
        (!lanes.stretches.is_empty()).then_some(lanes)
    }

    fn add(&mut self, way: u32, (_, class, width): Same, places: &[[i32; 2]]) {
        let mut along = 0.0;
        let reach = i32::from(width) / 2 + BESIDE as i32 + 1;
        for ends in places.windows(2).map(|pair| [pair[0], pair[1]]) {
            let number = self.stretches.len() as u32;
            self.stretches.push(Stretch { way, ends, along, width: width.into() });
            along += length(ends);
            let span = |axis: usize| {
                let (a, b) = (ends[0][axis], ends[1][axis]);
                (a.min(b) - reach).div_euclid(CELL)..=(a.max(b) + reach).div_euclid(CELL)
            };
            for cell in span(1).flat_map(|row| span(0).map(move |col| [col, row])) {
                self.near.entry((class, cell)).or_default().push(number);
            }
        }
    }

    /// The way of a triangle of a class, if it is part of one.
    pub(crate) fn way_of(&self, class: u8, corners: [[i32; 3]; 3]) -> Option<u32> {
        let middle = [0, 1].map(|axis| corners.iter().map(|at| f64::from(at[axis])).sum::<f64>() / 3.0);
        let found = self.nearest(class, middle, |_| true)?;
        (found.off <= found.stretch.width / 2.0 + BESIDE).then_some(found.stretch.way)
    }

    /// Where a corner of a triangle of this way lies: 0 on its left edge to 1 on the right one, and metres along it.
    pub(crate) fn place(&self, class: u8, way: u32, [x, y, _]: [i32; 3]) -> [f32; 2] {
        let Some(found) = self.nearest(class, [f64::from(x), f64::from(y)], |of| of.way == way) else {
            return [0.5, 0.0];
        };
        let across = (0.5 + found.right / found.stretch.width).clamp(0.0, 1.0);
        [across as f32, ((found.stretch.along + found.on) / f64::from(QUANTA_PER_METRE)) as f32]
    }

    fn nearest(&self, class: u8, at: [f64; 2], is_meant: impl Fn(&Stretch) -> bool) -> Option<Found<'_>> {
        let cell = at.map(|part| (part.floor() as i32).div_euclid(CELL));
        let all = self.near.get(&(class, cell))?.iter().map(|&number| &self.stretches[number as usize]);
        all.filter(|stretch| is_meant(stretch)).map(|stretch| Found::of(stretch, at)).min_by(|a, b| {
            let share = |found: &Found| found.off / found.stretch.width;
            share(a).total_cmp(&share(b))
        })
    }
}

/// A place beside a stretch.
struct Found<'a> {
    stretch: &'a Stretch,
    /// How far away it is.
    off: f64,
    /// How far along the stretch.
    on: f64,
    /// How far to its right.
    right: f64,
}

impl<'a> Found<'a> {
    fn of(stretch: &'a Stretch, at: [f64; 2]) -> Self {
        let [from, to] = stretch.ends.map(|end| end.map(f64::from));
        let long = length(stretch.ends).max(1.0);
        let way = [(to[0] - from[0]) / long, (to[1] - from[1]) / long];
        let off = [at[0] - from[0], at[1] - from[1]];
        let on = (off[0] * way[0] + off[1] * way[1]).clamp(0.0, long);
        let right = off[0] * way[1] - off[1] * way[0];
        let off = (off[0] - on * way[0]).hypot(off[1] - on * way[1]);
        Self { stretch, off, on, right }
    }
}

/// Whether a line is the middle of a band of triangles: of the ground, of a deck or of a ribbon.
fn is_drawn(line: &ModuleLine) -> bool {
    line.form != LineForm::Nothing && line.kind != LineKind::Breakline && 0 < line.width
}

fn part((line, corner): (&ModuleLine, [i32; 2])) -> (Same, Vec<[i32; 2]>) {
    let place = |vertex: &terrain::ModuleVertex| [corner[0] + i32::from(vertex.x), corner[1] + i32::from(vertex.y)];
    let same = (line.kind, line.class, line.width);
    (same, line.vertices.iter().map(place).collect())
}

fn length([a, b]: [[i32; 2]; 2]) -> f64 {
    (f64::from(b[0]) - f64::from(a[0])).hypot(f64::from(b[1]) - f64::from(a[1]))
}

/// Ways of all their parts, each in the direction of that part of it which comes first.
fn joined(parts: &[(Same, Vec<[i32; 2]>)]) -> Vec<(Same, Vec<[i32; 2]>)> {
    let mut ends: HashMap<(Same, [i32; 2]), Vec<End>> = HashMap::new();
    for (number, (same, places)) in parts.iter().enumerate() {
        ends.entry((*same, places[0])).or_default().push((number, false));
        ends.entry((*same, places[places.len() - 1])).or_default().push((number, true));
    }
    // The end that an end meets, if it meets one alone.
    let beyond = |(number, is_last): End| -> Option<End> {
        let (same, places) = &parts[number];
        let at = if is_last { places[places.len() - 1] } else { places[0] };
        match ends[&(*same, at)].as_slice() {
            [a, b] => Some(if *a == (number, is_last) { *b } else { *a }),
            _ => None,
        }
    };
    let mut is_used = vec![false; parts.len()];
    let mut ways = Vec::new();
    for first in 0..parts.len() {
        if is_used[first] {
            continue;
        }
        // Back to where the way begins, or around a loop.
        let mut start = (first, false);
        while let Some((number, is_last)) = beyond(start).filter(|(number, _)| *number != first) {
            start = (number, !is_last);
        }
        let mut way: Vec<[i32; 2]> = Vec::new();
        let mut next = Some(start);
        while let Some((number, is_last)) = next.filter(|(number, _)| !is_used[*number]) {
            is_used[number] = true;
            let mut places = parts[number].1.clone();
            if is_last {
                places.reverse();
            }
            way.extend(&places[usize::from(!way.is_empty())..]);
            next = beyond((number, !is_last));
        }
        ways.push((parts[first].0, way));
    }
    ways
}
