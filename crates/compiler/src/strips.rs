//! What was found of strips: how long they are, whether one is too steep, whether one falls to a side.

use std::collections::BTreeMap;

use database::StripFigures;
use features::{AreaFeatures, FeatureLattice, Place, Role, Surface};
use terrain::{Post, PostRect};

/// Figures of strips by class in an area that covers `rect`; `classes` are the job's numbers of the features' classes.
/// Of strips across the area's border those are counted that have their first corner inside.
pub(crate) fn strips(
    features: &AreaFeatures,
    surfaces: &[Surface],
    classes: &[u8],
    rect: PostRect,
) -> Vec<StripFigures> {
    let (traits, site) = (features.traits_by_id(), &features.site);
    let steps = site.lattice.steps_per_post();
    let inside = |surface: &&Surface| {
        let Place { row, col } = surface.ring[0].0;
        rect.contains(Post::new(row.div_euclid(steps), col.div_euclid(steps)))
    };
    let mut figures: BTreeMap<u8, StripFigures> = BTreeMap::new();
    for surface in surfaces.iter().filter(|surface| surface.role == Role::Side).filter(inside) {
        let Some(strip) = Strip::of(&surface.ring) else { continue };
        let class = classes[usize::from(surface.class)];
        let of = figures.entry(class).or_insert(StripFigures { class, ..StripFigures::default() });
        let grade_ppm = traits.get(&surface.id).map_or(0, |traits| traits.grade_ppm);
        of.pieces += 1;
        of.length_m += strip.length(site.lattice);
        of.steeper += u64::from(strip.is_steeper(grade_ppm, site.lattice));
        of.fall_max = of.fall_max.max(strip.fall());
    }
    figures.into_values().collect()
}

/// A piece of a strip: two corners at its end, then two at its beginning.
struct Strip([(Place, i32); 4]);

impl Strip {
    /// Of a ring of four corners, or of one to which rounding has added some on its sides. Triangles are junctions.
    fn of(ring: &[(Place, i32)]) -> Option<Self> {
        let mut ring = ring.to_vec();
        while 4 < ring.len() {
            let area = |at: usize| {
                let [before, here, after] = [at + ring.len() - 1, at, at + 1].map(|at| ring[at % ring.len()].0);
                let ([bx, by], [cx, cy]) = (before.to(here), before.to(after));
                (bx * cy - by * cx).abs()
            };
            let flattest = (0..ring.len()).min_by_key(|&at| area(at))?;
            ring.remove(flattest);
        }
        ring.try_into().ok().map(Self)
    }

    /// The largest difference in height across it, at either end, in quanta.
    fn fall(&self) -> u32 {
        let [a, b, c, d] = self.0.map(|(_, height)| height);
        let across =
            |pairs: [[i32; 2]; 2]| pairs.map(|[one, other]| one.abs_diff(other)).into_iter().max().unwrap_or(0);
        // Where the ring begins is known but for rounding; a junction is level, whichever way it is taken.
        across([[a, b], [c, d]]).min(across([[b, c], [d, a]]))
    }

    /// The middles of its ends, doubled, and twice its rise between them.
    fn middles(&self) -> ([Place; 2], i64) {
        let [a, b, c, d] = self.0;
        let doubled = |one: (Place, i32), other: (Place, i32)| {
            (Place::new(one.0.row + other.0.row, one.0.col + other.0.col), i64::from(one.1) + i64::from(other.1))
        };
        let ((from, low), (to, high)) = (doubled(c, d), doubled(a, b));
        ([from, to], high - low)
    }

    /// Metres along its middle.
    fn length(&self, lattice: FeatureLattice) -> f64 {
        let ([from, to], _) = self.middles();
        let [east, north] = from.to(to).map(|steps| steps as f64 / 2.0 * lattice.metres_per_step());
        (east * east + north * north).sqrt()
    }

    /// Whether it rises by more than a grade lets it and a quantum.
    fn is_steeper(&self, grade_ppm: u32, lattice: FeatureLattice) -> bool {
        let (_, rise) = self.middles();
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
    fn ring(from: i32, to: i32) -> Vec<(Place, i32)> {
        let at = |row, col, height| (Place::new(row, col), height);
        vec![at(0, 128, to), at(16, 128, to), at(16, 0, from), at(0, 0, from)]
    }

    #[test]
    fn a_strip_has_its_length_and_no_fall_and_is_steep_beyond_its_grade() {
        let strip = Strip::of(&ring(0, 640)).unwrap();
        assert_eq!((strip.length(lattice()), strip.fall()), (50.0, 0));
        assert!(!strip.is_steeper(100_000, lattice()) && strip.is_steeper(99_000, lattice()));
        assert!(!strip.is_steeper(0, lattice()), "without a greatest grade nothing is too steep");
    }

    #[test]
    fn a_corner_that_is_lower_than_the_other_is_a_fall_and_one_on_a_side_is_none() {
        let mut fallen = ring(0, 640);
        fallen[1].1 -= 7;
        assert_eq!(Strip::of(&fallen).unwrap().fall(), 7);
        let mut longer = ring(0, 640);
        longer.insert(2, (Place::new(17, 60), 300));
        assert_eq!(Strip::of(&longer).unwrap().fall(), 0);
        assert!(Strip::of(&longer[..3]).is_none());
    }
}
