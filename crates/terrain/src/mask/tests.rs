//! The mask against slow, obvious references, and windows against the whole.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::{Post, Smooth, Spacing};
use proptest::prelude::*;

use super::*;

fn frame() -> GridFrame {
    GridFrame { origin_east_m: 1000.0, origin_north_m: -500.0, spacing: Spacing::from_metres(25.0).unwrap() }
}

/// A polygon whose corners are given in posts of the grid.
fn polygon(rings: &[&[[f64; 2]]]) -> Polygon {
    let grid = frame();
    let metres = |[col, row]: &[f64; 2]| [grid.origin_east_m + col * 25.0, grid.origin_north_m + row * 25.0];
    Polygon { rings: rings.iter().map(|ring| ring.iter().map(metres).collect()).collect() }
}

fn area(class: &str, weight: u16, polygons: Vec<Polygon>) -> Area<'static> {
    Area { class: class.into(), weight, shape: Shape::Polygons(polygons) }
}

fn unsmoothed(areas: Vec<Area>, rect: PostRect) -> Importance {
    importance(&Mask { default_weight: 8000, areas, smooth: Smooth::None, over: vec![] }, rect, &frame(), rect)
}

/// The rows of the classes from north to south, one character a post.
fn picture(mask: &Importance) -> Vec<String> {
    let rect = mask.rect();
    let row = |row| (rect.west..=rect.east).map(|col| mask.class(Post::new(row, col)).to_string()).collect();
    (rect.south..=rect.north).rev().map(row).collect()
}

#[track_caller]
fn check_picture(areas: Vec<Area>, expected: &[&str]) {
    let rect = PostRect::of_size(expected.len(), expected[0].len());
    assert_eq!(picture(&unsmoothed(areas, rect)), expected);
}

const SQUARE: [[f64; 2]; 4] = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]];

#[test]
fn posts_on_western_and_southern_edges_are_inside_and_on_the_others_outside() {
    check_picture(vec![area("a", 1, vec![polygon(&[&SQUARE])])], &["00000", "00000", "01100", "01100", "00000"]);
}

#[test]
fn polygons_that_share_an_edge_share_no_post_and_leave_none_out() {
    let south_west = polygon(&[&[[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]]]);
    let north_east = polygon(&[&[[4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]]);
    let areas = vec![area("a", 1, vec![south_west]), area("b", 2, vec![north_east])];
    check_picture(areas, &["00000", "12220", "11220", "11120", "11110"]);
}

#[test]
fn a_hole_is_outside_and_polygons_of_one_area_do_not_cancel_each_other() {
    let ring = [[0.0, 0.0], [5.0, 0.0], [5.0, 5.0], [0.0, 5.0], [0.0, 0.0]];
    let holed = polygon(&[&ring, &SQUARE]);
    check_picture(vec![area("a", 1, vec![holed])], &["11111", "11111", "10011", "10011", "11111"]);
    let twice = vec![polygon(&[&SQUARE]), polygon(&[&SQUARE])];
    check_picture(vec![area("a", 1, twice)], &["00000", "00000", "01100", "01100", "00000"]);
}

#[test]
fn later_areas_win_and_classes_are_counted_as_they_are_named() {
    let west = [[-9.0, -9.0], [2.0, -9.0], [2.0, 9.0], [-9.0, 9.0]];
    let areas = vec![
        area("b", 1, vec![polygon(&[&west])]),
        area("a", 2, vec![polygon(&[&SQUARE])]),
        area("default", 8000, vec![polygon(&[&[[1.0, 2.0], [2.0, 2.0], [2.0, 3.0], [1.0, 3.0]]])]),
    ];
    let mask = Mask { default_weight: 8000, areas, smooth: Smooth::None, over: vec![] };
    assert_eq!(mask.class_names(), ["default", "b", "a"]);
    check_picture(mask.areas, &["1100", "1020", "1220", "1100"]);
}

#[test]
fn corners_far_beyond_any_grid_do_not_overflow() {
    let huge = [[-1.0e300, -1.0e300], [1.0e300, -1.0e300], [1.0e300, 1.0e300], [-1.0e300, 1.0e300]];
    check_picture(vec![area("a", 1, vec![polygon(&[&huge])])], &["11", "11"]);
    check_picture(vec![area("a", 1, vec![polygon(&[&[], &[[0.0, 0.0]]])])], &["00", "00"]);
}

#[test]
fn excluded_posts_stay_excluded_and_others_never_become_so() {
    let rect = PostRect::of_size(9, 9);
    let areas = vec![area("out", 0, vec![polygon(&[&[[0.0, 0.0], [4.0, 0.0], [4.0, 9.0], [0.0, 9.0]]])])];
    let mask = Mask { default_weight: 1, areas, smooth: Smooth::Binomial7, over: vec![] };
    let smoothed = importance(&mask, rect, &frame(), rect);
    for post in rect.posts() {
        assert_eq!(smoothed.weight(post), u16::from(4 <= post.col), "{post}");
    }
}

#[test]
fn voids_weigh_nothing() {
    let rect = PostRect::of_size(3, 3);
    let hole = Post::new(1, 2);
    let dem = Dem::from_fn(rect, |post| (post != hole).then_some(5));
    let mask = without_voids(Importance::uniform(rect, 8000), &dem);
    assert!(rect.posts().all(|post| mask.weight(post) == if post == hole { 0 } else { 8000 }));
}

/// Crossing number with rational crossings, post by post: the plain definition.
fn inside(ring: &[[i64; 2]], post: Post) -> bool {
    let [x, y] = [i64::from(post.col), i64::from(post.row)];
    let next = ring.iter().cycle().skip(1);
    let crossed = ring.iter().zip(next).filter(|&(&a, &b)| {
        let (low, high) = if a[1] < b[1] { (a, b) } else { (b, a) };
        // On or west of the post: (x - low.x) * rise - (y - low.y) * run is not negative.
        let side = (x - low[0]) * (high[1] - low[1]) - (y - low[1]) * (high[0] - low[0]);
        low[1] <= y && y < high[1] && 0 <= side
    });
    crossed.count() % 2 == 1
}

fn smoothed_naively(weights: impl Fn(Post) -> u16, area: PostRect, at: Post) -> u16 {
    const KERNEL: [u64; 7] = [1, 6, 15, 20, 15, 6, 1];
    let mut sum = 0;
    for (row, down) in (-3..=3).zip(KERNEL) {
        for (col, across) in (-3..=3).zip(KERNEL) {
            let row = (at.row + row).clamp(area.south, area.north);
            let col = (at.col + col).clamp(area.west, area.east);
            sum += down * across * u64::from(weights(Post::new(row, col)));
        }
    }
    if weights(at) == 0 { 0 } else { (((sum * 2 + 4096) / 8192) as u16).max(1) }
}

prop_compose! {
    fn ring()(corners in prop::collection::vec([-3_i64..24, -3_i64..24], 3..8)) -> Vec<[i64; 2]> { corners }
}

prop_compose! {
    fn window(side: i32)(a in [0..side, 0..side], b in [0..side, 0..side]) -> PostRect {
        PostRect::new(Post::new(a[0].min(b[0]), a[1].min(b[1])), Post::new(a[0].max(b[0]), a[1].max(b[1])))
    }
}

fn mask_of(rings: &[Vec<[i64; 2]>], weights: &[u16], smooth: Smooth) -> Mask<'static> {
    let as_polygon = |ring: &Vec<[i64; 2]>| {
        let corners: Vec<[f64; 2]> = ring.iter().map(|corner| corner.map(|c| c as f64)).collect();
        polygon(&[&corners])
    };
    let areas = rings.iter().zip(weights).enumerate();
    let areas = areas.map(|(i, (ring, &weight))| area(&i.to_string(), weight, vec![as_polygon(ring)])).collect();
    Mask { default_weight: 8000, areas, smooth, over: vec![] }
}

proptest! {
    #[test]
    fn smoothed_polygons_equal_the_naive_mask(
        rings in prop::collection::vec(ring(), 1..4),
        weights in prop::collection::vec(prop_oneof![Just(0_u16), Just(65535), 0..9000_u16], 3),
    ) {
        let rect = PostRect::of_size(20, 22);
        let mask = mask_of(&rings, &weights, Smooth::Binomial7);
        let found = importance(&mask, rect, &frame(), rect);
        let last_ring = |post| (0..rings.len()).rev().find(|&i| inside(&rings[i], post));
        let own = |post| last_ring(post).map_or(8000, |i| weights[i]);
        for post in rect.posts() {
            prop_assert_eq!(usize::from(found.class(post)), last_ring(post).map_or(0, |i| i + 1));
            prop_assert_eq!(found.weight(post), smoothed_naively(own, rect, post), "at {}", post);
        }
    }

    #[test]
    fn a_window_equals_the_same_posts_of_the_whole(
        rings in prop::collection::vec(ring(), 1..4),
        weights in prop::collection::vec(0..9000_u16, 3),
        rect in window(22),
    ) {
        let area = PostRect::of_size(22, 22);
        let mut mask = mask_of(&rings, &weights, Smooth::Binomial7);
        let overlay = |rect: PostRect| rect.posts().map(|post| (post.row * 7 + post.col * 3) % 5 == 0).collect();
        mask.areas.push(Area { class: "overlay".into(), weight: 500, shape: Shape::Members(Box::new(overlay)) });
        let whole = importance(&mask, area, &frame(), area);
        prop_assert_eq!(importance(&mask, area, &frame(), rect), whole.window(rect));
    }
}

#[test]
fn areas_over_all_others_end_sharply_and_soften_nothing() {
    let rect = PostRect::of_size(9, 9);
    let half = || polygon(&[&[[0.0, -1.0], [4.0, -1.0], [4.0, 9.0], [0.0, 9.0]]]);
    let below = vec![area("a", 1000, vec![half()])];
    let mask = |over| Mask {
        default_weight: 8000,
        areas: vec![area("a", 1000, vec![half()])],
        smooth: Smooth::Binomial7,
        over,
    };
    let softened = importance(&Mask { areas: below, ..mask(vec![]) }, rect, &frame(), rect);
    let square = polygon(&[&[[2.0, 2.0], [6.0, 2.0], [6.0, 6.0], [2.0, 6.0]]]);
    let laid = importance(&mask(vec![area("b", 60_000, vec![square])]), rect, &frame(), rect);
    for post in rect.posts() {
        let is_over = (2..6).contains(&post.row) && (2..6).contains(&post.col);
        let expected = if is_over { (60_000, 2) } else { (softened.weight(post), softened.class(post)) };
        assert_eq!((laid.weight(post), laid.class(post)), expected, "{post:?}");
    }
}

#[test]
fn level_ground_is_made_of_squares_and_every_window_finds_the_same() {
    let rect = PostRect::of_size(40, 30);
    let sea = |post: Post| (3..20).contains(&post.row) && (2..=8).contains(&post.col);
    // A strip of 4 posts beside it, a hole, and a place that is lower.
    let strip = |post: Post| (20..24).contains(&post.row) && 12 < post.col;
    let other = |post: Post| post == Post::new(5, 3) || post == Post::new(12, 8);
    let height = |post: Post| match (sea(post) || strip(post), post == Post::new(5, 3)) {
        (true, true) => None,
        (true, false) => Some(if other(post) { -1 } else { 0 }),
        (false, _) => Some(1),
    };
    let dem = Dem::from_fn(rect, height);
    let square = |south: i32, west: i32| PostRect { south, west, north: south + 4, east: west + 4 };
    let squares = rect.posts().map(|post| square(post.row, post.col)).filter(|of| rect.contains_rect(of));
    let whole: Vec<PostRect> =
        squares.filter(|of| of.posts().all(|post| !dem.is_void(post) && dem.height(post) == 0)).collect();
    assert!(!whole.is_empty());
    for window in [rect, PostRect { south: 2, west: 4, north: 13, east: 9 }, PostRect { south: 20, ..rect }] {
        let expected: Vec<bool> = window.posts().map(|post| whole.iter().any(|of| of.contains(post))).collect();
        assert_eq!(level(&dem, window, 0), expected, "{window:?}");
    }
}
