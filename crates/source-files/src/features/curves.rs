//! Arcs of circles as chords: what comes after knows straight lines only.

use super::clip::Vertex;
use crate::crs::Crs;

/// Metres by which a chord lies off its arc at most: a tenth of what DEMs of the highest resolution have posts apart,
/// and less than roads and shores are drawn to.
const OFF_M_MAX: f64 = 0.05;
/// Metres in a degree of latitude, of which a degree of longitude never has more.
const DEGREE_M: f64 = 111_320.0;
/// Vertices that the arcs of one geometry become: three places may stand for a circle round the Earth.
const VERTICES_MAX: usize = 1 << 20;

/// How arcs of a layer are to be drawn, and how much has been.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chords {
    /// How far they may lie off the arcs, in the unit of the layer.
    off_max: f64,
    left: usize,
}

impl Chords {
    /// For a layer in a system, or in metres where it names none.
    pub fn of(crs: Option<&Crs>) -> Self {
        let unit_m = crs.map_or(1.0, |crs| crs.unit_m().unwrap_or(DEGREE_M));
        Self { off_max: OFF_M_MAX / unit_m, left: VERTICES_MAX }
    }

    /// Adds arcs to a line that ends where the first begins: each through the place between to the place at its end,
    /// from there the next. Both stay vertices, and the others are the same whichever way an arc is digitised.
    ///
    /// # Errors
    /// In words, what is wrong, where the places are no arcs or become too many vertices.
    pub fn draw(&mut self, places: &[Vertex]) -> Result<Vec<Vertex>, String> {
        if !places.is_empty() && (places.len() < 3 || places.len().is_multiple_of(2)) {
            return Err(format!("arcs of {} places, which are an odd number from 3 on", places.len()));
        }
        let mut line: Vec<Vertex> = places.first().copied().into_iter().collect();
        for arc in places.windows(3).step_by(2) {
            let [from, through, to] = [arc[0], arc[1], arc[2]];
            let turned = to[..2] < from[..2];
            let mut drawn = if turned { self.arc([to, through, from])? } else { self.arc([from, through, to])? };
            if turned {
                drawn.reverse();
            }
            line.extend(drawn);
            line.push(to);
        }
        Ok(line)
    }

    /// The vertices between the ends of an arc.
    fn arc(&mut self, [from, through, to]: [Vertex; 3]) -> Result<Vec<Vertex>, String> {
        let Some(center) = center([from, through, to]) else { return Ok(vec![through]) };
        let [east, north] = [from[0] - center[0], from[1] - center[1]];
        let radius = east.hypot(north);
        let angle = |place: Vertex| (place[1] - center[1]).atan2(place[0] - center[0]);
        let cross = (through[0] - from[0]) * (to[1] - from[1]) - (through[1] - from[1]) * (to[0] - from[0]);
        let turn = |from: Vertex, to: Vertex| {
            let ccw = (angle(to) - angle(from)).rem_euclid(std::f64::consts::TAU);
            // A whole circle is drawn counterclockwise.
            if cross < 0.0 { ccw - std::f64::consts::TAU } else { ccw }
        };
        let most = 2.0 * (1.0 - (self.off_max / radius).min(1.0)).acos();
        let mut between = Vec::new();
        for (from, to, is_first) in [(from, through, true), (through, to, false)] {
            let turned = turn(from, to);
            let count = (turned.abs() / most).ceil();
            if count.is_nan() || (self.left as f64) < count {
                return Err(format!("arcs of more than {VERTICES_MAX} chords"));
            }
            let count = (count as usize).max(1);
            self.left -= count;
            for step in 1..count {
                let share = step as f64 / count as f64;
                let (sin, cos) = (angle(from) + share * turned).sin_cos();
                let height = from[2] + share * (to[2] - from[2]);
                between.push([center[0] + radius * cos, center[1] + radius * sin, height]);
            }
            between.extend(is_first.then_some(through));
        }
        Ok(between)
    }
}

/// The centre of the circle through three places; none where they lie on a straight line. Where the last is the first
/// it is a whole circle, with the other opposite.
fn center([from, through, to]: [Vertex; 3]) -> Option<[f64; 2]> {
    let [a, b] = [through, to].map(|place| [place[0] - from[0], place[1] - from[1]]);
    if b == [0.0, 0.0] {
        return (a != b).then(|| [from[0] + a[0] / 2.0, from[1] + a[1] / 2.0]);
    }
    let twice = 2.0 * (a[0] * b[1] - a[1] * b[0]);
    let [of_a, of_b] = [a, b].map(|[east, north]| east * east + north * north);
    let offset = [(b[1] * of_a - a[1] * of_b) / twice, (a[0] * of_b - b[0] * of_a) / twice];
    let is_straight = twice.abs() <= 1.0e-12 * (of_a + of_b) || offset.iter().any(|number| !number.is_finite());
    (!is_straight).then(|| [from[0] + offset[0], from[1] + offset[1]])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(chords: &[Vertex], center: [f64; 2], radius: f64) -> f64 {
        let middle = |pair: &[Vertex]| [0, 1].map(|axis| (pair[0][axis] + pair[1][axis]) / 2.0 - center[axis]);
        chords.windows(2).map(|pair| radius - middle(pair)[0].hypot(middle(pair)[1])).fold(0.0, f64::max)
    }

    #[test]
    fn chords_lie_within_five_centimetres_of_their_arc_and_hold_the_places_given() {
        let arc = [[5.0e5, 4.0e6, 10.0], [500_100.0, 4_000_100.0, 20.0], [500_200.0, 4.0e6, 40.0]];
        let metres = Chords::of(None).draw(&arc).unwrap();
        assert!(metres.first() == Some(&arc[0]) && metres.last() == Some(&arc[2]) && metres.contains(&arc[1]));
        let off = off(&metres, [500_100.0, 4.0e6], 100.0);
        assert!(0.01 < off && off <= 0.05, "{off}");
        assert!(metres.windows(2).all(|pair| pair[0][2] < pair[1][2]), "heights rise along it");
        let back: Vec<Vertex> = arc.into_iter().rev().collect();
        let mut back = Chords::of(None).draw(&back).unwrap();
        back.reverse();
        assert_eq!(back, metres);
    }

    #[test]
    fn a_whole_circle_in_degrees_is_as_fine_on_the_ground() {
        let circle = [[9.0, 47.0, f64::NAN], [9.002, 47.0, f64::NAN], [9.0, 47.0, f64::NAN]];
        let drawn = Chords::of(Some(&Crs::wgs84())).draw(&circle).unwrap();
        let off_m = off(&drawn, [9.001, 47.0], 0.001) * DEGREE_M;
        assert!(
            drawn[0][..2] == drawn[drawn.len() - 1][..2] && 20 < drawn.len() && off_m <= 0.05,
            "{off_m} {}",
            drawn.len()
        );
    }

    #[test]
    fn what_is_straight_stays_so_and_what_is_no_arc_is_told() {
        let line = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]];
        assert_eq!(Chords::of(None).draw(&line).unwrap(), line);
        assert!(Chords::of(None).draw(&line[..2]).is_err());
        assert!(Chords::of(None).draw(&[]).unwrap().is_empty());
        let endless = [[0.0, 0.0, 0.0], [1.0e12, 1.0, 0.0], [0.0, 0.0, 0.0]];
        assert!(Chords::of(None).draw(&endless).unwrap_err().contains("chords"));
    }
}
