//! What is told of roads, rivers and lakes: what they cost, how true they are, what became of each.
//!
//! All of it follows from what features of the area came to and from what was measured of its tiles, so the build that
//! writes it and those who check it later compute the same.

use std::collections::{BTreeMap, BTreeSet};

use crate::ground::GamingArea;
use fidelity::FeatureFigures;
use job::Job;
use store::{
    AreaLevel, FeatureLine, FeatureRemark, ReportDeckClearance, ReportFeatureChecks, ReportFeatureClass,
    ReportFeatureCost, ReportFeatureRemarks, ReportFeatures,
};
use terrain::Role;
use terrain::limits::Windows;
use terrain::{LatticePoint, QUANTA_PER_METRE, metres_of_quanta};

use crate::product::{Opened, ProductError, from_features};

/// What is told of the features of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Told {
    /// As the report gives it.
    pub report: ReportFeatures,
    /// All remarks, those on edges that a TIN lacks included.
    pub remarks: Vec<FeatureRemark>,
}

/// What is told of features that came to `level`, with what was found of them in all tiles.
pub fn told(job: &Job, area: &GamingArea, level: &AreaLevel, figures: &FeatureFigures) -> Told {
    let extent_m = extent_m(area);
    let missing = missing(area, level, figures);
    let ends = level.ends.iter().map(|end| FeatureRemark {
        feature: end.feature.clone(),
        at_m: Some(end.at_m),
        found: "it ends here although its source goes on".into(),
        done: "what goes on had no room".into(),
        leaves_out: false,
        degrades: true,
    });
    let remarks: Vec<FeatureRemark> = level.remarks.iter().cloned().chain(missing).chain(ends).collect();
    let names = job.class_names();
    let classes = classes(level).into_iter().map(|class| ReportFeatureClass {
        name: names.get(usize::from(class)).cloned().unwrap_or_default(),
        cost: cost(area, level, |of| of == class),
        ..lengths(level, class, extent_m)
    });
    let report = ReportFeatures {
        classes: classes.collect(),
        all: cost(area, level, |_| true),
        remarks: counts(&remarks),
        checks: checks(level, figures, extent_m),
        deck_clearances: deck_clearances(job, &names, figures),
        earthworks: crate::product::earthworks::earthworks(&names, level),
    };
    Told { report, remarks }
}

/// The same of a database whose files say it; nothing of a job without features.
///
/// # Errors
/// When a file is missing or damaged.
pub fn read_told(opened: &Opened) -> Result<Option<(AreaLevel, Told)>, ProductError> {
    let Opened { folder, job, area, .. } = opened;
    if job.features.is_none() {
        return Ok(None);
    }
    let (.., level) = folder.read_level()?;
    let mut figures = FeatureFigures::default();
    for &tile in &area.tiles {
        let (.., measured) = folder.read_measured(tile)?;
        measured.features.iter().for_each(|found| figures.merge(&from_features(found)));
    }
    let told = told(job, area, &level, &figures);
    Ok(Some((level, told)))
}

/// How low decks pass over ways and water of each class.
fn deck_clearances(job: &Job, names: &[String], figures: &FeatureFigures) -> Vec<ReportDeckClearance> {
    let told = |(&class, &least): (&u8, &i32)| {
        let name = names.get(usize::from(class)).filter(|_| job.is_of_features(class))?;
        Some(ReportDeckClearance { class: name.clone(), least_m: metres_of_quanta(least) })
    };
    figures.decks.clearance.iter().filter_map(told).collect()
}

/// Remarks, each counted once, by the worst that was done.
fn counts(remarks: &[FeatureRemark]) -> ReportFeatureRemarks {
    let mut counts = ReportFeatureRemarks::default();
    for remark in remarks {
        match (remark.leaves_out, remark.degrades) {
            (true, _) => counts.left_out += 1,
            (false, true) => counts.degraded += 1,
            (false, false) => counts.mended += 1,
        }
    }
    counts
}

/// Classes that features of the area have.
fn classes(level: &AreaLevel) -> BTreeSet<u8> {
    let of_lines = level.lines.iter().map(|line| line.class);
    let of_strips = level.strips.iter().map(|strips| strips.class);
    let of_decks = level.decks.iter().map(|deck| deck.class);
    let of_wanted = level.amounts.iter().map(|amounts| amounts.class);
    of_lines
        .chain(of_wanted)
        .chain(of_strips)
        .chain(of_decks)
        .chain(level.cost.iter().map(|(_, class, _)| *class))
        .collect()
}

fn cost(area: &GamingArea, level: &AreaLevel, is_meant: impl Fn(u8) -> bool) -> ReportFeatureCost {
    let (grid, budget) = (area.grid, &area.budget);
    let mut counts = vec![0; grid.count()];
    for &(place, _, triangles) in level.cost.iter().filter(|(_, class, _)| is_meant(*class)) {
        if let Some(count) = counts.get_mut(place as usize) {
            *count += triangles;
        }
    }
    let windows = Windows::of_size(grid, budget.windows.rows, budget.windows.cols);
    let most = |counts: &[u32]| u64::from(counts.iter().copied().max().unwrap_or(0));
    let (module_max, window_max) = (most(&counts), most(&windows.sums(grid, &counts)));
    ReportFeatureCost {
        triangles: counts.iter().map(|count| u64::from(*count)).sum(),
        module_max,
        module_share: module_max as f64 / f64::from(budget.per_module.max(1)),
        window_max,
        window_share: window_max as f64 / f64::from(budget.per_window.max(1)),
    }
}

/// How much there is of a class.
fn lengths(level: &AreaLevel, class: u8, extent_m: [f64; 4]) -> ReportFeatureClass {
    let of_class = || level.lines.iter().filter(move |line| line.class == class);
    let km = |roles: &[Role]| {
        let lines = of_class().filter(|line| roles.contains(&line.role));
        sum_km(lines.flat_map(|line| edges(line, extent_m)).map(|[a, b]| length_m(a, b)))
    };
    let strips = level.strips.iter().filter(|strips| strips.class == class);
    let amounts = level.amounts.iter().find(|amounts| amounts.class == class).copied().unwrap_or_default();
    ReportFeatureClass {
        name: String::new(),
        wanted_km: amounts.wanted_m / 1000.0,
        kept_km: amounts.kept_m / 1000.0,
        lakes_wanted: amounts.lakes_wanted.into(),
        lakes_kept: amounts.lakes_kept.into(),
        line_km: km(&[Role::Centre, Role::Breakline]),
        strip_km: sum_km(strips.map(|strips| strips.length_m)),
        channel_km: km(&[Role::Channel]),
        lakes: lakes(of_class(), extent_m),
        deck_polygons: level.decks.iter().filter(|deck| deck.class == class).count() as u64,
        cost: ReportFeatureCost::default(),
    }
}

/// Lakes among lines: shores of one feature are those of one lake and its islands.
fn lakes<'a>(lines: impl Iterator<Item = &'a FeatureLine>, extent_m: [f64; 4]) -> u64 {
    let shores = lines.filter(|line| line.role == Role::Shore && edges(line, extent_m).next().is_some());
    shores.map(|line| &line.feature).collect::<BTreeSet<_>>().len() as u64
}

fn checks(level: &AreaLevel, figures: &FeatureFigures, extent_m: [f64; 4]) -> ReportFeatureChecks {
    let mut checks = ReportFeatureChecks {
        edges: figures.edges,
        edges_missing: figures.missing.len() as u64,
        stations: level.strips.iter().map(|strips| strips.pieces).sum(),
        stations_steeper: level.strips.iter().map(|strips| strips.steeper).sum(),
        strip_stations: level.strips.iter().map(|strips| 2 * strips.pieces).sum(),
        strip_fall_max_m: metres(level.strips.iter().map(|strips| strips.fall_max).max().unwrap_or(0)),
        loose_ends: level.ends.len() as u64,
        lakes: lakes(level.lines.iter(), extent_m),
        lake_spread_max_m: metres(figures.lake_spread),
        lake_banks_m2: figures.lake_banks_m2,
        shore_posts: figures.shore_posts,
        shore_posts_below: figures.shore_below,
        outside_posts: figures.outside.posts,
        outside_rms_m: figures.outside.rms_m(),
        outside_max_m: figures.outside.max_m(),
        deck_samples: figures.decks.samples,
        deck_samples_under: figures.decks.under,
        deck_under_max_m: metres(figures.decks.deepest),
        deck_step_max_m: metres(figures.decks.step),
        deck_slope_max_percent: f64::from(figures.decks.steepest) / 10.0,
        deck_ends_hanging: figures.decks.hanging,
        deck_end_hangs_max_m: metres(figures.decks.hangs),
        roads_in_buildings_m: figures.in_buildings_m,
        ..ReportFeatureChecks::default()
    };
    for line in &level.lines {
        match line.role {
            Role::Centre => {
                checks.stations += edges(line, extent_m).count() as u64;
                checks.stations_steeper += steeper(line, extent_m);
            }
            Role::Channel => {
                checks.river_edges += edges(line, extent_m).count() as u64;
                checks.river_edges_rising += rising(line, extent_m);
            }
            _ => {}
        }
    }
    checks
}

/// Edges of a line that are steeper than they may be at most by more than a quantum of height.
fn steeper(line: &FeatureLine, extent_m: [f64; 4]) -> u64 {
    let rise_max = |a, b| length_m(a, b) * f64::from(line.grade_most_ppm) / 1e6 + metres(1);
    let is_steeper = |[a, b]: &[[f64; 3]; 2]| rise_max(*a, *b) < (b[2] - a[2]).abs();
    if line.grade_most_ppm == 0 { 0 } else { edges(line, extent_m).filter(is_steeper).count() as u64 }
}

/// Edges of a channel, which runs downstream, that rise.
fn rising(line: &FeatureLine, extent_m: [f64; 4]) -> u64 {
    edges(line, extent_m).filter(|[a, b]| a[2] < b[2]).count() as u64
}

/// Edges that the TINs lack, as remarks on their features.
fn missing(area: &GamingArea, level: &AreaLevel, figures: &FeatureFigures) -> Vec<FeatureRemark> {
    if figures.missing.is_empty() {
        return Vec::new();
    }
    let frame = area.frame;
    let step_m = frame.spacing.metres() / f64::from(figures.steps_per_post.max(1));
    let place = |at: LatticePoint| {
        [frame.origin_east_m + f64::from(at.col) * step_m, frame.origin_north_m + f64::from(at.row) * step_m]
    };
    let key = |[east, north]: [f64; 2]| [east, north].map(f64::to_bits);
    let mut of_edge = BTreeMap::new();
    for &[a, b] in &figures.missing {
        of_edge.insert([key(place(a)), key(place(b))], None);
    }
    for line in &level.lines {
        for pair in line.vertices.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|[east, north, _]| key([east, north]));
            for ends in [[a, b], [b, a]] {
                of_edge.entry(ends).and_modify(|of| *of = Some(&line.feature));
            }
        }
    }
    let remark = |&[a, b]: &[LatticePoint; 2]| {
        let [a, b] = [a, b].map(place);
        let feature = of_edge.get(&[key(a), key(b)]).copied().flatten();
        FeatureRemark {
            feature: feature.map_or("?", String::as_str).to_owned(),
            at_m: Some([(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]),
            found: "an edge of it is missing from the TIN".into(),
            done: "the ground there does not follow it".into(),
            leaves_out: false,
            degrades: true,
        }
    };
    figures.missing.iter().map(remark).collect()
}

/// West, south, east and north of the area.
fn extent_m(area: &GamingArea) -> [f64; 4] {
    let (rect, spacing) = (area.rect, area.frame.spacing.metres());
    let [east, north] = [area.frame.origin_east_m, area.frame.origin_north_m];
    let metres = |origin: f64, posts: i32| origin + f64::from(posts) * spacing;
    [metres(east, rect.west), metres(north, rect.south), metres(east, rect.east), metres(north, rect.north)]
}

/// Edges of a line whose middle lies in the area: features are cut one load module outside.
fn edges(line: &FeatureLine, [west, south, east, north]: [f64; 4]) -> impl Iterator<Item = [[f64; 3]; 2]> + '_ {
    let inside = move |[a, b]: &[[f64; 3]; 2]| {
        let [x, y] = [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
        west <= x && x <= east && south <= y && y <= north
    };
    line.vertices.windows(2).map(|pair| [pair[0], pair[1]]).filter(inside)
}

/// Kilometres of lengths in metres. The sum of none is 0, without a sign.
fn sum_km(metres: impl Iterator<Item = f64>) -> f64 {
    metres.fold(0.0, |sum, metres| sum + metres) / 1000.0
}

/// How far two places lie apart, seen from above, in metres.
pub(crate) fn length_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [east, north] = [b[0] - a[0], b[1] - a[1]];
    (east * east + north * north).sqrt()
}

fn metres(quanta: u32) -> f64 {
    f64::from(quanta) / f64::from(QUANTA_PER_METRE)
}
