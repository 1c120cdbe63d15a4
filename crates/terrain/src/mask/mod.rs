//! Decides where ground matters more: classes and weights per post, from polygons and class overlays.
//!
//! Its main verb is [`importance`]. Every post is decided from the area alone, never from the window asked for, so the
//! windows of two tiles agree wherever they overlap.

mod area;
pub use area::{Area, Membership, Shape};
mod polygon;
pub use polygon::Polygon;
mod slope;
pub use slope::{steep, steep_halo};
mod sight;
pub use sight::{Sight, Surroundings};
mod smooth;

use crate::{Dem, GridFrame, HOLE_CLASS, Importance, PostRect, Smooth};

/// Index of the class of posts that no area claims.
pub const DEFAULT_CLASS: u8 = 0;

/// How many posts around a window decide its weights.
fn halo(smooth: Smooth) -> i32 {
    match smooth {
        Smooth::None => 0,
        Smooth::Binomial7 => smooth::REACH,
    }
}

/// What makes up an importance mask. Areas named later win where areas overlap.
#[derive(Debug)]
pub struct Mask<'a> {
    /// Weight of posts that no area claims, in thousandths; 0 excludes them.
    pub default_weight: u16,
    /// Areas with a class and a weight of their own.
    pub areas: Vec<Area<'a>>,
    /// How weights are mixed.
    pub smooth: Smooth,
    /// Areas over all others, with weights that end where they end: smoothing leaves them out, so that a shore's
    /// water weighs what water weighs, and its land what land does.
    pub over: Vec<Area<'a>>,
}

impl Mask<'_> {
    /// Names of the classes by index: `default`, then each new class in the order in which areas name it.
    ///
    /// An area may name `default` itself, to give a part of another area back.
    pub fn class_names(&self) -> Vec<&str> {
        let mut names = vec!["default"];
        for area in self.areas.iter().chain(&self.over) {
            if !names.contains(&area.class.as_str()) {
                names.push(&area.class);
            }
        }
        names
    }

    /// Whether every post of any window weighs the same and is of the default class.
    pub fn is_uniform(&self) -> bool {
        self.areas.is_empty() && self.over.is_empty()
    }
}

/// Weights and classes of the posts of `rect`, a window of the gaming area `area` on the grid `frame`.
///
/// Weights are smoothed with one rounding (half up) and posts of weight 0 stay 0; a post whose own weight is not 0
/// never becomes 0 by rounding.
///
/// # Panics
/// When `rect` is not inside `area`, or there are more classes than numbers below [`HOLE_CLASS`].
pub fn importance(mask: &Mask, area: PostRect, frame: &GridFrame, rect: PostRect) -> Importance {
    assert!(area.contains_rect(&rect), "a window of the mask lies inside the gaming area");
    if mask.is_uniform() {
        return Importance::uniform(rect, mask.default_weight);
    }
    let wide = rect.grown(halo(mask.smooth)).intersection(&area).expect("a window lies inside the area");
    let claims = claims(mask, frame, wide);
    let weights = match mask.smooth {
        Smooth::None => claims.weights,
        Smooth::Binomial7 => smooth::binomial7(&claims.weights, wide, rect),
    };
    let classes = if wide == rect { claims.classes } else { cut(&claims.classes, wide, rect) };
    let mut claims = Claims { weights, classes };
    claims.lay(&mask.over, mask, frame, rect);
    Importance::new(rect, claims.weights, claims.classes)
}

/// The same mask with weight 0 and the class of holes at the void posts of `dem`, which therefore are never selected.
///
/// # Panics
/// When `dem` does not hold every post of the mask's window.
pub fn without_voids(importance: Importance, dem: &Dem) -> Importance {
    if dem.void_count() == 0 {
        return importance;
    }
    let rect = importance.rect();
    assert!(dem.rect().contains_rect(&rect), "the window of heights holds the window of the mask");
    let weight = |post| if dem.is_void(post) { 0 } else { importance.weight(post) };
    let weights = rect.posts().map(weight).collect();
    let class = |post| if dem.is_void(post) { HOLE_CLASS } else { importance.class(post) };
    let classes = rect.posts().map(class).collect();
    Importance::new(rect, weights, classes)
}

/// Weight and class of every post of a window, row-major.
struct Claims {
    weights: Vec<u16>,
    classes: Vec<u8>,
}

impl Claims {
    /// Lays areas of a mask over what is there.
    fn lay(&mut self, areas: &[Area], mask: &Mask, frame: &GridFrame, rect: PostRect) {
        let names = mask.class_names();
        for area in areas {
            let index = names.iter().position(|&name| name == area.class).expect("every area's class is listed");
            let class =
                u8::try_from(index).ok().filter(|&class| class < HOLE_CLASS).expect("a mask has at most 255 classes");
            area.shape.visit_spans(frame, rect, |span| {
                self.weights[span.clone()].fill(area.weight);
                self.classes[span].fill(class);
            });
        }
    }
}

fn claims(mask: &Mask, frame: &GridFrame, rect: PostRect) -> Claims {
    let mut claims = Claims {
        weights: vec![mask.default_weight; rect.post_count()],
        classes: vec![DEFAULT_CLASS; rect.post_count()],
    };
    claims.lay(&mask.areas, mask, frame, rect);
    claims
}

fn cut(classes: &[u8], from: PostRect, rect: PostRect) -> Vec<u8> {
    let west = (rect.west - from.west) as usize;
    let south = (rect.south - from.south) as usize;
    let rows = classes.chunks(from.posts_wide()).skip(south).take(rect.posts_high());
    rows.flat_map(|row| row[west..west + rect.posts_wide()].iter().copied()).collect()
}

#[cfg(test)]
mod tests;
