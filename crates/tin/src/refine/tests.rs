//! The fast growth against a slow reading of the paper: everything re-scanned, in every pass.

use std::collections::BTreeMap;

use fastrand::Rng;
use terrain::geometry::{levels_available, rounded, visit_posts, widest_level};
use terrain::limits::{Allowance, Windows};
use terrain::mesh::{Lines, Mesh};
use terrain::{
    Features, LastBatch, ModuleGrid, ModuleId, ModuleRect, Post, PostRect, SeamSides, Side, SideSpan, TileId,
};

use super::*;
use crate::batch::is_near;
use crate::{CostUnit, Frame, Proximity, SurveyTask, survey};

/// Hills with plateaus: coarse steps, so that equal residuals are common.
fn hills(rect: PostRect, seed: u64, step: i32) -> Dem {
    let mut random = Rng::with_seed(seed);
    let bumps: Vec<(i32, i32, i32, i32)> = (0..12)
        .map(|_| {
            let mut next = |end| random.i32(0..end);
            (next(rect.posts_high() as i32), next(rect.posts_wide() as i32), 3 + next(20), next(30_000) - 9000)
        })
        .collect();
    Dem::from_fn(rect, |post| {
        let height = |&(row, col, reach, top): &(i32, i32, i32, i32)| {
            let away = (post.row - row).abs().max((post.col - col).abs());
            top * (reach - away).max(0) / reach
        };
        Some(bumps.iter().map(height).sum::<i32>() / step * step + (post.row * 7 + post.col * 3) % 5)
    })
}

fn half_masked(rect: PostRect) -> Importance {
    let posts =
        || (rect.south..=rect.north).flat_map(move |row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    let weight = |post: Post| match (post.row + post.col) / 20 % 3 {
        0 => 8000,
        1 => 1000 + 37 * post.col as u16,
        _ => u16::from(post.row < 40) * 1000,
    };
    Importance::new(rect, posts().map(weight).collect(), vec![0; rect.post_count()])
}

fn plain_task(rect: PostRect, rule: Rule, points: usize) -> TileTask {
    TileTask {
        tile: TileId { row: 0, col: 0 },
        rect,
        frame: Frame::Plain,
        border: Vec::new(),
        inherited: Vec::new(),
        kept: Vec::new(),
        start: Vec::new(),
        seams: SeamSides::OPEN,
        barred: Vec::new(),
        rule,
        stop: Stop { points: Some(points), ..Stop::default() },
    }
}

/// Value at every candidate of a mesh, by visiting every triangle.
fn values(dem: &Dem, importance: &Importance, mesh: &Mesh, unit: u64) -> BTreeMap<LocalPost, u64> {
    let surface = terrain::geometry::Surface::new(dem);
    let mut values = BTreeMap::new();
    for record in mesh.triangles() {
        let facet = surface.facet(record.corners);
        visit_posts(&surface, &facet, |post, numerator| {
            if !record.corners.contains(&post) {
                let weight = u64::from(importance.weight(post.post(dem.rect())));
                let value = weight * rounded(numerator, facet.den as u64 * unit);
                assert_eq!(*values.entry(post).or_insert(value), value, "both triangles of an edge agree");
            }
        });
    }
    values
}

/// The paper's pass, word for word.
fn naive_batches(dem: &Dem, importance: &Importance, unit: u64, proximity: Proximity, points: usize) -> Vec<LocalPost> {
    let mut mesh = Mesh::new(dem.rect(), Lines::none());
    let mut vertices = first_four(dem.rect());
    let mut selected = Vec::new();
    let placed = |post: LocalPost| (post, dem.height(post.post(dem.rect())));
    while selected.len() < points {
        let values = values(dem, importance, &mesh, unit);
        let largest = values.values().copied().max().unwrap_or(0);
        if largest == 0 {
            break;
        }
        let candidates: Vec<LocalPost> =
            values.iter().filter(|&(_, &value)| value == largest).map(|(&post, _)| post).collect();
        let mut accepted: Vec<LocalPost> = Vec::new();
        for &post in &candidates {
            let mut near = vertices.iter().chain(&accepted);
            if !near.any(|&vertex| is_near(proximity, placed(post), placed(vertex))) {
                accepted.push(post);
            }
        }
        if accepted.is_empty() {
            for &post in &candidates {
                if !accepted.iter().any(|&vertex| is_near(proximity, placed(post), placed(vertex))) {
                    accepted.push(post);
                }
            }
        }
        accepted.truncate(points - selected.len());
        for &post in &accepted {
            let triangle = mesh.triangle_at(post, 0);
            mesh.insert(post, triangle);
        }
        vertices.extend(&accepted);
        selected.extend(accepted);
    }
    selected
}

fn first_four(rect: PostRect) -> Vec<LocalPost> {
    rect.corners().map(|post| LocalPost::of(post, rect)).to_vec()
}

fn naive_worst_first(dem: &Dem, importance: &Importance, points: usize) -> Vec<LocalPost> {
    let nowhere = Proximity { posts: -1.0, quanta: 0 };
    let mut mesh = Mesh::new(dem.rect(), Lines::none());
    let _ = nowhere;
    let mut selected = Vec::new();
    while selected.len() < points {
        let values = values(dem, importance, &mesh, 1);
        let Some((&post, _)) = values
            .iter()
            .filter(|&(_, &value)| 0 < value)
            .max_by_key(|&(&post, &value)| (value, std::cmp::Reverse(post)))
        else {
            break;
        };
        let triangle = mesh.triangle_at(post, 0);
        mesh.insert(post, triangle);
        selected.push(post);
    }
    selected
}

fn selected_of(tile: &TileTin) -> Vec<LocalPost> {
    let rect = tile.tin.rect;
    let posts = tile.tin.vertices[tile.initial_count as usize..].iter();
    posts.map(|vertex| LocalPost::of(vertex.at.post().expect("whole posts"), rect)).collect()
}

#[test]
fn batches_select_what_a_full_re_scan_selects() {
    let proximity = Proximity { posts: 6.0, quanta: 2560 };
    for seed in 0..20 {
        let rect = PostRect::of_size(64, 64);
        let dem = hills(rect, seed, if seed % 2 == 0 { 640 } else { 37 });
        for importance in [Importance::uniform(rect, 1000), half_masked(rect)] {
            let rule =
                Rule::Batches { residual_quantum: 128, proximity: Some(proximity), last_batch: LastBatch::Truncate };
            let tile = refine(&dem, &importance, &plain_task(rect, rule, 150), widest_level());
            tile.tin.check().expect("a sound TIN");
            let slow = naive_batches(&dem, &importance, 128, proximity, 150);
            assert_eq!(selected_of(&tile), slow, "seed {seed}");
        }
    }
}

#[test]
fn worst_first_selects_what_a_full_re_scan_selects() {
    for seed in 0..10 {
        let rect = PostRect::of_size(64, 64);
        let dem = hills(rect, seed, if seed % 2 == 0 { 640 } else { 37 });
        for importance in [Importance::uniform(rect, 8000), half_masked(rect)] {
            let tile = refine(&dem, &importance, &plain_task(rect, Rule::WorstFirst, 120), widest_level());
            assert_eq!(selected_of(&tile), naive_worst_first(&dem, &importance, 120), "seed {seed}");
        }
    }
}

#[test]
fn every_instruction_level_selects_the_same_posts() {
    let rect = PostRect::of_size(120, 150);
    let dem = hills(rect, 5, 3);
    let importance = half_masked(rect);
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: Some(2_000_000) }, passes()] {
        let task = plain_task(rect, rule, 700);
        let widest = refine(&dem, &importance, &task, widest_level());
        for (name, level) in levels_available() {
            assert_eq!(refine(&dem, &importance, &task, level), widest, "{name}");
        }
    }
}

fn passes() -> Rule {
    Rule::Batches {
        residual_quantum: 128,
        proximity: Some(Proximity { posts: 12.0, quanta: 2560 }),
        last_batch: LastBatch::Finish,
    }
}

#[test]
fn flat_ground_keeps_its_initial_points() {
    let rect = PostRect::of_size(41, 41);
    let dem = Dem::from_fn(rect, |_| Some(7));
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: None }, passes()] {
        let task = TileTask { frame: Frame::Corners { side_cells: 20 }, ..plain_task(rect, rule, 100) };
        let tile = refine(&dem, &Importance::uniform(rect, 1000), &task, widest_level());
        assert_eq!((tile.stop, tile.tin.vertices.len()), (StopReason::Exhausted, 9));
        tile.tin.check().expect("a sound TIN");
    }
}

#[test]
fn a_masked_tile_keeps_its_initial_points() {
    let rect = PostRect::of_size(41, 41);
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: None }, passes()] {
        let task = plain_task(rect, rule, 100);
        let tile = refine(&hills(rect, 1, 1), &Importance::uniform(rect, 0), &task, widest_level());
        assert_eq!((tile.stop, tile.tin.vertices.len()), (StopReason::Exhausted, 4));
    }
}

#[test]
fn asking_for_more_points_than_there_are_posts_ends_exhausted() {
    let rect = PostRect::of_size(9, 9);
    let tile = refine(
        &hills(rect, 3, 1),
        &Importance::uniform(rect, 1000),
        &plain_task(rect, Rule::WorstFirst, 500),
        widest_level(),
    );
    assert_eq!(tile.stop, StopReason::Exhausted);
    tile.tin.check().expect("a sound TIN");
}

#[test]
fn closed_sides_hold_only_what_they_were_given() {
    let rect = PostRect::of_size(61, 81);
    let dem = hills(rect, 9, 1);
    let inherited = vec![Post::new(0, 13), Post::new(0, 44), Post::new(31, 0)];
    let seams = SeamSides { north: true, ..SeamSides::CLOSED };
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: None }, passes()] {
        let task = TileTask { seams, inherited: inherited.clone(), ..plain_task(rect, rule, 200) };
        let tile = refine(&dem, &Importance::uniform(rect, 1000), &task, widest_level());
        tile.tin.check().expect("a sound TIN");
        let on = |post: &Post| post.row == 0 || post.col == 0 || post.col == 80;
        let posts = tile.tin.vertices.iter().map(|vertex| vertex.at.post().expect("whole posts"));
        let mut found: Vec<Post> = posts.filter(on).filter(|post| !rect.corners().contains(post)).collect();
        found.sort();
        assert_eq!(found, inherited);
    }
}

#[test]
fn no_border_point_is_selected_where_a_road_crosses_a_side() {
    let rect = PostRect::of_size(61, 81);
    let dem = hills(rect, 9, 1);
    let span = |side, from, to| SideSpan { side, from, to };
    let spans = vec![span(Side::North, 600, 1600), span(Side::East, 64 * 7 + 3, 64 * 31 - 1)];
    let barred = Features { steps_per_post: 64, spans, ..Features::default() }.barred_posts(rect);
    let border = vec![Post::new(60, 5), Post::new(60, 15)];
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: None }, Rule::LargestSquares { guard: Some(9000) }] {
        let free = TileTask { border: border.clone(), ..plain_task(rect, rule, 700) };
        let task = TileTask { barred: barred.clone(), ..free.clone() };
        let importance = half_masked(rect);
        let tile = refine(&dem, &importance, &task, widest_level());
        let on_barred = |tile: &TileTin| {
            let posts = tile.tin.vertices.iter().filter_map(|vertex| vertex.at.post());
            posts.filter(|post| barred.binary_search(post).is_ok()).count()
        };
        assert!(3 < on_barred(&refine(&dem, &importance, &free, widest_level())), "it would select some");
        assert_eq!((tile.tin.check(), on_barred(&tile)), (Ok(()), 0));
        assert!(
            tile.tin.vertices.iter().any(|vertex| vertex.at.post() == Some(border[0])),
            "others of the border stay"
        );
        for (name, level) in levels_available() {
            assert_eq!(refine(&dem, &importance, &task, level), tile, "{name}");
        }
    }
}

#[test]
fn a_survey_sets_aside_what_no_post_lowers_unless_it_is_counted() {
    let rect = PostRect::of_size(41, 41);
    let inside = |post: Post| (10..30).contains(&post.row) && (10..30).contains(&post.col);
    // A block of which nothing may be chosen, and a slope that one plane holds around it.
    let dem = Dem::from_fn(rect, |post| Some(if inside(post) { 9000 } else { 16 * post.row }));
    let posts = (0..=40).flat_map(|row| (0..=40).map(move |col| Post::new(row, col)));
    let weights = posts.map(|post| if inside(post) { 0 } else { 1000 }).collect();
    let importance = Importance::new(rect, weights, vec![0; rect.post_count()]);
    let growth = TileTask {
        stop: Stop { rms_quanta: Some(0.0), ..Stop::default() },
        ..plain_task(rect, Rule::LargestSquares { guard: None }, 0)
    };
    let squares_at_end = |counts_left| {
        let (owned, grid) = (SeamSides::CLOSED, ModuleGrid { rows: 2, cols: 2, side_cells: 20 });
        let task = SurveyTask { growth: growth.clone(), owned, grid, cost: CostUnit::Triangles, counts_left };
        survey(&dem, &importance, &task, widest_level()).squares.last().map(|(_, sum)| *sum)
    };
    let counted = squares_at_end(true).expect("sums of squares");
    assert!(400.0 * 8000.0 * 8000.0 < counted, "{counted}");
    assert_eq!(squares_at_end(false), Some(0.0));
}

fn limited(rect: PostRect, module_room: u32, window_room: u32, triangles: u32, rule: Rule) -> TileTask {
    let grid = ModuleGrid { rows: 4, cols: 4, side_cells: 20 };
    let modules = ModuleRect { south: 0, west: 0, north: 4, east: 4 };
    let windows = Windows::new(grid, 2);
    let allowance = Allowance {
        modules,
        module_room: vec![module_room; 16],
        windows: windows.origins,
        window_size: (2, 2),
        window_room: vec![window_room; windows.origins.count()],
        triangles,
    };
    let south_west = ModuleId { row: 1, col: 1 };
    let frame = Frame::Sides { side_cells: 20, south_west, allowance };
    TileTask { frame, stop: Stop::default(), ..plain_task(rect, rule, 0) }
}

fn counts(tile: &TileTin) -> BTreeMap<(i32, i32), u32> {
    let mut counts = BTreeMap::new();
    for triangle in &tile.tin.triangles {
        let at = triangle.map(|v| tile.tin.vertices[v as usize].at);
        let module = |low: i32, high: i32| {
            assert!(high - low / 160 * 160 <= 160, "a triangle stays inside its load module");
            low / 160
        };
        let (rows, cols) = (at.map(|p| p.row), at.map(|p| p.col));
        let ends = |v: [i32; 3]| (v.into_iter().min().unwrap_or(0), v.into_iter().max().unwrap_or(0));
        let ((south, north), (west, east)) = (ends(rows), ends(cols));
        *counts.entry((module(south, north), module(west, east))).or_insert(0) += 1;
    }
    counts
}

#[test]
fn limits_are_never_exceeded_and_the_budget_is_met() {
    let rect = PostRect::new(Post::new(20, 20), Post::new(60, 60));
    let dem = hills(PostRect::of_size(81, 81), 11, 1).window(rect);
    let importance = Importance::uniform(rect, 1000);
    for rule in [Rule::WorstFirst, Rule::LargestSquares { guard: None }, passes()] {
        for (module_room, window_room, triangles) in
            [(30, 1000, 1000), (1000, 50, 1000), (1000, 1000, 90), (7, 13, 1000)]
        {
            let task = limited(rect, module_room, window_room, triangles, rule.clone());
            let tile = refine(&dem, &importance, &task, widest_level());
            tile.tin.check().expect("a sound TIN");
            let counts = counts(&tile);
            assert!(counts.values().all(|&count| count <= 2 + module_room), "{counts:?}");
            assert!(tile.triangles_charged <= triangles);
            assert!(counts.values().sum::<u32>() <= 8 + window_room.min(triangles), "{counts:?}");
            if triangles == 90 {
                assert_eq!((tile.triangles_charged, tile.stop), (90, StopReason::BudgetSpent));
            } else {
                assert!(!tile.refused.is_empty(), "something was refused");
            }
        }
    }
}

#[test]
fn selection_stops_at_the_residual_and_at_the_rms_asked_for() {
    let rect = PostRect::of_size(61, 61);
    let dem = hills(rect, 4, 1);
    let importance = Importance::uniform(rect, 1000);
    let residual_of = |stop| {
        let task = TileTask { stop, ..plain_task(rect, Rule::WorstFirst, 0) };
        let tile = refine(&dem, &importance, &task, widest_level());
        let mut mesh = Mesh::new(rect, Lines::none());
        for post in selected_of(&tile) {
            let triangle = mesh.triangle_at(post, 0);
            mesh.insert(post, triangle);
        }
        let values = values(&dem, &importance, &mesh, 1);
        let squares: f64 = values.values().map(|&value| (value as f64 / 1000.0).powi(2)).sum();
        (values.values().copied().max().unwrap_or(0), (squares / rect.post_count() as f64).sqrt(), tile.stop)
    };
    let (largest, _, stop) = residual_of(Stop { value: Some(900_000), ..Stop::default() });
    assert!(largest <= 900_000 && stop == StopReason::ResidualReached, "{largest}");
    let (_, rms, stop) = residual_of(Stop { rms_quanta: Some(128.0), ..Stop::default() });
    assert!(rms <= 128.0 && 120.0 < rms && stop == StopReason::RmsReached, "{rms}");
}
