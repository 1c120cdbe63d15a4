//! What was found of strips: how long they are, whether one is too steep, whether one falls to a side.

use std::collections::{BTreeMap, BTreeSet};

use features::{AreaFeatures, Face, FeatureLattice, Formed, Place, Surface};
use store::StripFigures;
use terrain::PostRect;

/// Figures of strips by class in an area that covers `rect`; `classes` are the job's numbers of the features' classes.
/// Features are cut one load module outside of it; strips are counted whose middle lies inside.
pub(crate) fn strips(features: &AreaFeatures, formed: &Formed, classes: &[u8], rect: PostRect) -> Vec<StripFigures> {
    let (traits, lattice) = (features.traits_by_id(), features.site.lattice);
    let mut figures: BTreeMap<u8, StripFigures> = BTreeMap::new();
    for face in formed.faces.iter().filter(|face| is_inside(face, lattice, rect)) {
        let Some(strip) = Strip::of(face, &formed.points) else { continue };
        let class = classes[usize::from(face.class)];
        let of = figures.entry(class).or_insert(StripFigures { class, ..StripFigures::default() });
        let grade_ppm = traits.get(&face.id).map_or(0, |traits| traits.grade_most_ppm());
        of.pieces += 1;
        of.length_m += strip.length(lattice);
        of.steeper += u64::from(strip.is_steeper(grade_ppm, lattice));
        of.fall_max = of.fall_max.max(strip.fall());
    }
    figures.into_values().collect()
}

/// The corners of pieces of strips that nothing cuts, in ascending order, with their classes.
pub(crate) fn whole_strips(formed: &Formed) -> BTreeSet<(u16, Vec<Place>)> {
    let whole = formed.faces.iter().filter(|face| Strip::of(face, &formed.points).is_some());
    whole.map(|face| (face.class, sorted(face.corners.iter().map(|(place, _)| *place)))).collect()
}

/// Whether a surface is one of such pieces.
pub(crate) fn is_one_of(whole: &BTreeSet<(u16, Vec<Place>)>, surface: &Surface) -> bool {
    let corners = surface.ring.iter().map(|(place, _)| *place);
    surface.ring.len() == 4 && whole.contains(&(surface.class, sorted(corners)))
}

fn sorted(places: impl Iterator<Item = Place>) -> Vec<Place> {
    let mut places: Vec<Place> = places.collect();
    places.sort_unstable();
    places
}

fn is_inside(face: &Face, lattice: FeatureLattice, rect: PostRect) -> bool {
    let within = |of: fn(&Place) -> i32, low: i32, high: i32| {
        let sum: i64 = face.corners.iter().map(|(place, _)| i64::from(of(place))).sum();
        let line = |posts: i32| i64::from(posts) * i64::from(lattice.steps_per_post()) * face.corners.len() as i64;
        line(low) <= sum && sum <= line(high)
    };
    within(|place| place.row, rect.south, rect.north) && within(|place| place.col, rect.west, rect.east)
}

/// A piece of a strip from one station to the next.
struct Strip {
    /// Right and left at its end, then left and right at its beginning, with the heights that the TIN has there.
    corners: [(Place, i32); 4],
    centreline: [Place; 2],
}

impl Strip {
    /// Of a face of four corners that are all in the TIN; all others are junctions, or cut by a higher class.
    fn of(face: &Face, points: &[(Place, i32)]) -> Option<Self> {
        let [right_from, right_to, left_to, left_from] = face.corners[..] else { return None };
        let height = |corner: (Place, i32)| {
            let found = points.binary_search_by_key(&corner.0, |(place, _)| *place).ok()?;
            Some(points[found])
        };
        let corners = [height(right_to)?, height(left_to)?, height(left_from)?, height(right_from)?];
        Some(Self { corners, centreline: face.centreline? })
    }

    /// The largest difference in height across it, at either end, in quanta.
    fn fall(&self) -> u32 {
        let [a, b, c, d] = self.corners.map(|(_, height)| height);
        a.abs_diff(b).max(c.abs_diff(d))
    }

    /// Metres along its centreline.
    fn length(&self, lattice: FeatureLattice) -> f64 {
        let [east, north] =
            self.centreline[0].to(self.centreline[1]).map(|steps| steps as f64 * lattice.metres_per_step());
        (east * east + north * north).sqrt()
    }

    /// Whether it rises by more than a grade lets it and a quantum.
    fn is_steeper(&self, grade_ppm: u32, lattice: FeatureLattice) -> bool {
        let [a, b, c, d] = self.corners.map(|(_, height)| i64::from(height));
        let rise = a + b - c - d;
        let rise_max = self.length(lattice) * f64::from(terrain::QUANTA_PER_METRE) * f64::from(grade_ppm) / 1e6;
        grade_ppm != 0 && rise_max + 1.0 < (rise as f64 / 2.0).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::Spacing;

    /// 25 m posts: 64 steps of 50 quanta each.
    fn lattice() -> FeatureLattice {
        FeatureLattice::of(Spacing::from_metres(25.0).unwrap())
    }

    /// Eastwards, 128 steps long and 16 wide, from one height to another.
    fn strip(from: i32, to: i32) -> Strip {
        let at = |row, col, height| (Place::new(row, col), height);
        let corners = [at(0, 128, to), at(16, 128, to), at(16, 0, from), at(0, 0, from)];
        Strip { corners, centreline: [Place::new(8, 0), Place::new(8, 128)] }
    }

    #[test]
    fn a_strip_has_its_length_and_no_fall_and_is_steep_beyond_its_grade() {
        let strip = strip(0, 640);
        assert_eq!((strip.length(lattice()), strip.fall()), (50.0, 0));
        assert!(!strip.is_steeper(100_000, lattice()) && strip.is_steeper(99_000, lattice()));
        assert!(!strip.is_steeper(0, lattice()), "without a greatest grade nothing is too steep");
    }

    #[test]
    fn a_corner_that_is_lower_than_the_one_across_is_a_fall() {
        let mut fallen = strip(0, 640);
        fallen.corners[1].1 -= 7;
        assert_eq!(fallen.fall(), 7);
    }
}
