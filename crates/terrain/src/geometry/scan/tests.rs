//! Every kernel at every instruction level against a slow reading of the definition.

use crate::{Dem, PostRect};
use fastrand::Rng;
use fearless_simd::{Level, dispatch};

use super::*;
use crate::geometry::{LocalRect, levels_available};

fn rough(rows: usize, cols: usize, relief: i32, seed: u64) -> Dem {
    let mut random = Rng::with_seed(seed);
    Dem::from_fn(PostRect::of_size(rows, cols), |_| Some(random.i32(0..relief) - relief / 2))
}

fn random_facet(surface: &Surface, random: &mut Rng, reach: i32) -> Option<Facet> {
    let extent = surface.extent();
    let (row, col) = (random.i32(0..=extent.north), random.i32(0..=extent.east));
    let corners = [(); 3].map(|()| {
        let shift = |at: i32, end: i32, by: i32| (at + by - reach / 2).clamp(0, end);
        LocalPost::new(shift(row, extent.north, random.i32(0..=reach)), shift(col, extent.east, random.i32(0..=reach)))
    });
    let area = LocalPost::orient(corners[0], corners[1], corners[2]);
    match area {
        0 => None,
        1.. => Some(surface.facet(corners)),
        _ => Some(surface.facet([corners[0], corners[2], corners[1]])),
    }
}

fn largest_at(level: Level, surface: &Surface, blocks: &Blocks, facet: &Facet) -> u64 {
    dispatch!(level, simd => largest_numerator(simd, surface, blocks, facet))
}

fn locate_at(level: Level, surface: &Surface, facet: &Facet, threshold: u64) -> Option<LocalPost> {
    dispatch!(level, simd => locate(simd, surface, facet, threshold))
}

fn squares_at(level: Level, surface: &Surface, facet: &Facet) -> f64 {
    dispatch!(level, simd => squares_sum(simd, surface, facet))
}

#[track_caller]
fn check(surface: &Surface, blocks: &Blocks, facet: &Facet) {
    let mut slow = (0u64, None);
    visit_posts(surface, facet, |post, numerator| {
        if slow.0 < numerator {
            slow = (numerator, Some(post));
        }
    });
    let mut squares = 0u64;
    visit_owned(surface, facet, |_, numerator| squares += rounded(numerator, facet.den as u64).pow(2));
    let quotient = rounded(slow.0, facet.den as u64);
    let threshold = ((2 * quotient).saturating_sub(1) * facet.den as u64).div_ceil(2);
    let mut first = None;
    visit_posts(surface, facet, |post, numerator| {
        if first.is_none() && quotient == rounded(numerator, facet.den as u64) {
            first = Some(post);
        }
    });
    for (name, level) in levels_available() {
        assert_eq!(largest_at(level, surface, blocks, facet), slow.0, "largest at {name}, {facet:?}");
        assert_eq!(squares_at(level, surface, facet), squares as f64, "squares at {name}, {facet:?}");
        if 0 < quotient {
            assert_eq!(locate_at(level, surface, facet, threshold), first, "locate at {name}, {facet:?}");
        }
    }
}

#[test]
fn every_level_finds_what_the_definition_finds() {
    for (relief, reach) in [(5, 7), (3000, 7), (3000, 15), (200_000, 15), (200_000, 40), (900_000, 80)] {
        let dem = rough(90, 75, relief, relief as u64);
        let (surface, blocks) = (Surface::new(&dem), Blocks::of(&dem));
        let confined = surface.with_candidates(LocalRect { south: 1, west: 1, north: 88, east: 73 });
        let mut random = Rng::with_seed(reach as u64);
        for _ in 0..400 {
            if let Some(facet) = random_facet(&surface, &mut random, reach) {
                check(&surface, &blocks, &facet);
                check(&confined, &blocks, &facet);
            }
        }
    }
}

/// Hills in which most blocks lie nearer to a wide triangle than its worst post.
#[test]
fn every_level_finds_what_the_definition_finds_where_blocks_are_left_out() {
    let hills = |row: i32, col: i32| {
        let (north, east) = (f64::from(row), f64::from(col));
        4e5 * (north / 31.0).sin() * (east / 47.0).cos() + 2e3 * (north * 1.7 + east * 0.9).sin()
    };
    let dem = Dem::from_fn(PostRect::of_size(190, 275), |post| Some(hills(post.row, post.col) as i32));
    let (surface, blocks) = (Surface::new(&dem), Blocks::of(&dem));
    let confined = surface.with_candidates(LocalRect { south: 1, west: 1, north: 188, east: 273 });
    let mut random = Rng::with_seed(4);
    for reach in [40, 130, 260] {
        for _ in 0..60 {
            if let Some(facet) = random_facet(&surface, &mut random, reach) {
                check(&surface, &blocks, &facet);
                check(&confined, &blocks, &facet);
            }
        }
    }
}

#[test]
fn a_triangle_in_the_last_row_and_column_stays_in_bounds() {
    let dem = rough(17, 33, 1000, 3);
    let (surface, blocks) = (Surface::new(&dem), Blocks::of(&dem));
    check(&surface, &blocks, &surface.facet([LocalPost::new(15, 31), LocalPost::new(15, 32), LocalPost::new(16, 32)]));
    check(&surface, &blocks, &surface.facet([LocalPost::new(16, 31), LocalPost::new(15, 32), LocalPost::new(16, 32)]));
    check(&surface, &blocks, &surface.facet([LocalPost::new(0, 0), LocalPost::new(0, 32), LocalPost::new(16, 32)]));
}

#[test]
fn rounding_is_half_up() {
    assert_eq!([0, 1, 2, 3, 4, 5].map(|n| rounded(n, 4)), [0, 0, 1, 1, 1, 1]);
    assert_eq!(rounded(3 << 40, 2 << 40), 2);
    assert_eq!(rounded((3 << 40) - 1, 2 << 40), 1);
}

#[test]
fn triangles_around_a_fan_of_border_posts_own_each_post_once() {
    // A vertex on every side, one inside; fans that meet in corners and on the far borders.
    let dem = rough(9, 11, 100, 9);
    let surface = Surface::new(&dem);
    let p = LocalPost::new;
    let ring = [p(0, 0), p(0, 4), p(0, 10), p(3, 10), p(8, 10), p(8, 6), p(8, 0), p(5, 0)];
    for centre in [p(4, 5), p(1, 9), p(7, 1), p(3, 4)] {
        let mut owners = [0; 99];
        for i in 0..ring.len() {
            let corners = [ring[i], ring[(i + 1) % ring.len()], centre];
            visit_owned(&surface, &surface.facet(corners), |post, _| {
                owners[(post.row() * 11 + post.col()) as usize] += 1
            });
        }
        assert!(owners.iter().all(|&count| count == 1), "centre {centre:?}: {owners:?}");
    }
}
