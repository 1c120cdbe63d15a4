//! Between tallies and figures and the files that keep them.

use fidelity::{Curvature, DeckFigures, FeatureFigures, Tally};
use store::{MeasuredCurvature, MeasuredFeatures, MeasuredTally};
use terrain::LatticePoint;

/// What is kept of a tally.
pub(crate) fn to_tally(tally: &Tally) -> MeasuredTally {
    MeasuredTally {
        posts: tally.posts,
        sum: tally.sum,
        sum_abs: tally.sum_abs,
        sum_squared: [(tally.sum_squared >> 64) as u64, tally.sum_squared as u64],
        largest: tally.largest,
        bins: tally.filled_bins().collect(),
    }
}

/// The tally that was kept.
pub(crate) fn from_tally(tally: &MeasuredTally) -> Tally {
    let [high, low] = tally.sum_squared.map(u128::from);
    let mut sums = Tally::default().with_bins(tally.bins.iter().copied());
    (sums.posts, sums.sum, sums.sum_abs) = (tally.posts, tally.sum, tally.sum_abs);
    (sums.sum_squared, sums.largest) = (high << 64 | low, tally.largest);
    sums
}

/// What is kept of how much the ground curves.
pub(crate) fn to_curvature(Curvature { cells, integral, rough_cells }: Curvature) -> MeasuredCurvature {
    MeasuredCurvature { cells, integral, rough_cells }
}

/// How much the ground curves, as it was kept.
pub(crate) fn from_curvature(MeasuredCurvature { cells, integral, rough_cells }: MeasuredCurvature) -> Curvature {
    Curvature { cells, integral, rough_cells }
}

/// What is kept of the figures of features.
pub(crate) fn to_features(figures: &FeatureFigures) -> MeasuredFeatures {
    let FeatureFigures { steps_per_post, edges, missing, lake_spread, shore_posts, shore_below, .. } = figures;
    let FeatureFigures { lake_banks_m2, outside, decks, in_buildings_m, .. } = figures;
    MeasuredFeatures {
        steps_per_post: *steps_per_post,
        edges: *edges,
        missing: missing.iter().map(|[a, b]| [a.row, a.col, b.row, b.col]).collect(),
        lake_spread: *lake_spread,
        lake_banks_m2: *lake_banks_m2,
        shore_posts: *shore_posts,
        shore_below: *shore_below,
        outside: to_tally(outside),
        decks: (decks.samples, decks.under, decks.deepest, decks.step),
        deck_ends: (decks.steepest, decks.hanging, decks.hangs),
        in_buildings_m: *in_buildings_m,
        deck_clearance: decks.clearance.iter().map(|(&class, &least)| (class, least)).collect(),
    }
}

/// The figures of features that were kept.
pub fn from_features(measured: &MeasuredFeatures) -> FeatureFigures {
    let MeasuredFeatures { steps_per_post, edges, missing, lake_spread, shore_posts, shore_below, .. } = measured;
    let &MeasuredFeatures { decks: (samples, under, deepest, step), ref deck_clearance, ref outside, .. } = measured;
    let &MeasuredFeatures { lake_banks_m2, deck_ends: (steepest, hanging, hangs), in_buildings_m, .. } = measured;
    let clearance = deck_clearance.iter().copied().collect();
    let ends =
        |&[row, col, to_row, to_col]: &[i32; 4]| [LatticePoint::new(row, col), LatticePoint::new(to_row, to_col)];
    FeatureFigures {
        steps_per_post: *steps_per_post,
        edges: *edges,
        missing: missing.iter().map(ends).collect(),
        lake_spread: *lake_spread,
        lake_banks_m2,
        shore_posts: *shore_posts,
        shore_below: *shore_below,
        outside: from_tally(outside),
        decks: DeckFigures { samples, under, deepest, clearance, step, steepest, hanging, hangs },
        in_buildings_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_of_features_survives_being_kept() {
        let mut figures = FeatureFigures { steps_per_post: 64, edges: 9, lake_spread: 1, ..FeatureFigures::default() };
        figures.missing = vec![[LatticePoint::new(1, -2), LatticePoint::new(3, 4)]];
        (figures.shore_posts, figures.shore_below, figures.lake_banks_m2) = (7, 2, 5);
        figures.outside.add(-17);
        figures.decks = DeckFigures {
            samples: 9,
            under: 1,
            deepest: 5,
            clearance: [(2, -5)].into(),
            step: 3,
            steepest: 70,
            hanging: 2,
            hangs: 40,
        };
        figures.in_buildings_m = 7;
        assert_eq!(from_features(&to_features(&figures)), figures);
    }

    #[test]
    fn a_tally_survives_being_kept() {
        let mut tally = Tally::default();
        [3, -4, 5000, 0, -128, i32::MAX].into_iter().for_each(|residual| tally.add(residual));
        tally.sum_squared += 1 << 70;
        assert_eq!(from_tally(&to_tally(&tally)), tally);
        assert_eq!(from_tally(&to_tally(&Tally::default())), Tally::default());
    }
}
