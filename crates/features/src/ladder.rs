//! The ladder that features of a crowded load module go down, the lowest class first at each step: tolerances doubled,
//! then fourfold, a bench becomes a strip, a strip a line; and only then is something left out.

use crate::clean::Notes;
use crate::members::{Crowd, End, FORMS, Member, TOLERANCES};
use crate::{Flaw, Form, Grant, Remark, Remedy, Site};

/// A step of the ladder.
#[derive(Clone, Copy)]
enum Step {
    Tolerance(usize),
    Form(usize),
}

/// The ladder: everything is made coarser before anything is left out.
const LADDER: [Step; 4] = [Step::Tolerance(1), Step::Tolerance(2), Step::Form(1), Step::Form(2)];

/// What a feature is left in a load module: places in [`TOLERANCES`] and [`FORMS`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rung {
    tolerance: usize,
    form: usize,
    out: bool,
}

impl Rung {
    const OUT: Self = Self { tolerance: 0, form: 0, out: true };
    const LAST: Self = Self { tolerance: TOLERANCES.len() - 1, form: FORMS.len() - 1, out: false };

    pub fn grant(self) -> Grant {
        Grant { tolerance: TOLERANCES[self.tolerance], most: FORMS[self.form], out: self.out }
    }

    pub fn is_out(self) -> bool {
        self.out
    }

    fn down(self, step: Step) -> Self {
        match step {
            Step::Tolerance(tolerance) => Self { tolerance, ..self },
            Step::Form(form) => Self { form, ..self },
        }
    }
}

/// What features are left in a load module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fitted {
    /// Of each feature there.
    pub rungs: Vec<Rung>,
    /// Triangles all take together.
    pub triangles: u32,
}

/// Triangles that features of a load module take as asked for.
pub(crate) fn as_asked(crowd: &Crowd) -> Fitted {
    let tally = Tally::of(crowd, vec![Rung::default(); crowd.members.len()]);
    Fitted { rungs: tally.rungs, triangles: tally.triangles }
}

/// Which features stay where not all of them can.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Claim {
    /// Before all others.
    First,
    /// By its class.
    Usual,
    /// Not at all, whatever there is room for.
    Gone,
}

/// Takes features down as far as they have to go to take no more than `room` triangles together.
///
/// Of what cannot stay even at the end of the ladder, the highest class stays first, and of a class what has the most
/// metres a triangle, each as it is claimed.
pub(crate) fn fit(crowd: &Crowd, room: u32, claim: &dyn Fn(&Member) -> Claim) -> Fitted {
    let members = &crowd.members;
    let claims: Vec<Claim> = members.iter().map(claim).collect();
    let start: Vec<Rung> =
        claims.iter().map(|claim| if *claim == Claim::Gone { Rung::OUT } else { Rung::default() }).collect();
    if let Some(fitted) = descend(crowd, room, start.clone()) {
        return fitted;
    }
    let mut alone = Tally::of(crowd, vec![Rung::OUT; members.len()]);
    let mut order: Vec<(usize, i128)> = Vec::new();
    for at in (0..members.len()).filter(|&at| !start[at].out) {
        order.push((at, i128::from(alone.with(at, Rung::LAST))));
        alone.set(at, Rung::OUT);
    }
    let metres = |&(at, _): &(usize, i128), (_, triangles): &(usize, i128)| i128::from(members[at].length) * triangles;
    order.sort_by(|a, b| {
        let class = claims[a.0].cmp(&claims[b.0]).then(members[a.0].class.cmp(&members[b.0].class));
        class.then_with(|| metres(b, a).cmp(&metres(a, b))).then(a.0.cmp(&b.0))
    });
    // A junction that is there already costs nothing more, so that what stays hangs together.
    let mut left = Tally::of(crowd, vec![Rung::OUT; members.len()]);
    for (at, _) in order {
        if room < left.with(at, Rung::LAST) {
            left.set(at, Rung::OUT);
        }
    }
    // What stays goes down no farther than it has to.
    let stays = left.rungs.iter().map(|rung| if rung.out { Rung::OUT } else { Rung::default() }).collect();
    let nothing = Fitted { rungs: vec![Rung::OUT; members.len()], triangles: 0 };
    descend(crowd, room, stays).unwrap_or(nothing)
}

/// Features down the ladder, class by class, until they take no more than `room`; nothing when they still do at its
/// end.
fn descend(crowd: &Crowd, room: u32, rungs: Vec<Rung>) -> Option<Fitted> {
    // The lowest class first: numbers fall as classes rise.
    let mut classes: Vec<u16> = crowd.members.iter().map(|member| member.class).collect();
    classes.sort_unstable_by(|a, b| b.cmp(a));
    classes.dedup();
    let mut tally = Tally::of(crowd, rungs);
    for (step, class) in LADDER.iter().flat_map(|step| classes.iter().map(move |class| (*step, *class))) {
        if tally.triangles <= room {
            break;
        }
        for at in 0..crowd.members.len() {
            if crowd.members[at].class == class && !tally.rungs[at].out {
                tally.set(at, tally.rungs[at].down(step));
            }
        }
    }
    let Tally { rungs, triangles, .. } = tally;
    (triangles <= room).then_some(Fitted { rungs, triangles })
}

/// Counts the triangles of features in a load module while what they are left changes.
struct Tally<'a> {
    crowd: &'a Crowd,
    rungs: Vec<Rung>,
    /// Segments that end at each place: all of them, strips, and those with slopes.
    ends: Vec<[u32; 3]>,
    triangles: u32,
}

impl<'a> Tally<'a> {
    fn of(crowd: &'a Crowd, rungs: Vec<Rung>) -> Self {
        let none = vec![Rung::OUT; rungs.len()];
        let mut tally = Self { crowd, rungs: none, ends: vec![[0; 3]; crowd.points.len()], triangles: 0 };
        rungs.into_iter().enumerate().for_each(|(at, rung)| tally.set(at, rung));
        tally
    }

    /// The triangles of all with one feature on another rung.
    fn with(&mut self, at: usize, rung: Rung) -> u32 {
        self.set(at, rung);
        self.triangles
    }

    fn set(&mut self, at: usize, rung: Rung) {
        let before = std::mem::replace(&mut self.rungs[at], rung);
        self.count(at, before, |count| count - 1, |all, decks| all - decks);
        self.count(at, rung, |count| count + 1, |all, decks| all + decks);
    }

    fn count(&mut self, at: usize, rung: Rung, by: fn(u32) -> u32, decks: fn(u32, u32) -> u32) {
        if rung.out {
            return;
        }
        let member = &self.crowd.members[at];
        self.triangles = decks(self.triangles, member.decks[rung.tolerance]);
        for &End { point, wide, bench } in &member.ends[rung.tolerance] {
            let ends = &mut self.ends[point as usize];
            let each = self.crowd.points[point as usize];
            let before = each * corners(*ends);
            let is_wide = wide && FORMS[rung.form] != Form::Line;
            for (count, is) in ends.iter_mut().zip([true, is_wide, is_wide && bench && FORMS[rung.form] == Form::Bench])
            {
                if is {
                    *count = by(*count);
                }
            }
            self.triangles = self.triangles + each * corners(*ends) - before;
        }
    }
}

/// The points that features put where their segments end: one of lines, two of strips, where more of these meet one
/// between any two; and two more where slopes meet the ground.
fn corners([all, strips, benches]: [u32; 3]) -> u32 {
    let own = if 0 < strips { strips.max(2) } else { all.min(1) };
    own + if 0 < benches { 2 } else { 0 }
}

/// Writes down how far a feature went down in a load module, but for its being left out.
pub(crate) fn tell(member: &Member, rung: Rung, site: &Site, remarks: &mut Vec<Remark>) {
    let mut tell = |remedy| {
        let mut notes = Notes { id: member.id, lattice: site.lattice, remarks };
        notes.write_at(member.place, Flaw::OverShare, remedy);
    };
    if member.ends[rung.tolerance].len() < member.ends[0].len() {
        tell(if rung.tolerance == 1 { Remedy::ToleranceDoubled } else { Remedy::ToleranceFourfold });
    }
    let ends = &member.ends[rung.tolerance];
    if FORMS[rung.form] == Form::Line && ends.iter().any(|end| end.wide) {
        tell(Remedy::BecameLine);
    } else if FORMS[rung.form] != Form::Bench && ends.iter().any(|end| end.bench) {
        tell(Remedy::BecameStrip);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FeatureId, Numbering, Place};

    /// Features of points of their own: so many triangles by tolerance, each an even number.
    fn crowd(features: &[(u16, i64, [u32; 3])]) -> Crowd {
        let mut crowd = Crowd::default();
        for (number, &(class, length, triangles)) in features.iter().enumerate() {
            let id = FeatureId { source: 0, numbering: Numbering::Way, number: number as i64 };
            let ends = triangles.map(|triangles| {
                let end = |at| End { point: crowd.points.len() as u32 + at, wide: false, bench: false };
                (0..triangles / 2).map(end).collect()
            });
            crowd.points.extend(vec![2; triangles[0] as usize / 2]);
            let place = Place::new(0, 0);
            crowd.members.push(Member { class, id, place, length, is_whole: false, ends, decks: [0; 3] });
        }
        crowd
    }

    #[track_caller]
    fn check(crowd: &Crowd, room: u32, expected: &[&str]) {
        let fitted = fit(crowd, room, &|_| Claim::Usual);
        let word = |rung: &Rung| if rung.out { "out".to_owned() } else { format!("x{}", rung.grant().tolerance) };
        assert_eq!(fitted.rungs.iter().map(word).collect::<Vec<_>>(), expected);
        assert!(fitted.triangles <= room);
    }

    #[test]
    fn the_lowest_class_goes_down_first_and_all_are_coarse_before_one_is_left_out() {
        let crowd = crowd(&[(0, 10, [20, 16, 10]), (3, 10, [20, 16, 10])]);
        check(&crowd, 40, &["x1", "x1"]);
        check(&crowd, 39, &["x1", "x2"]);
        check(&crowd, 32, &["x2", "x2"]);
        check(&crowd, 26, &["x2", "x4"]);
        check(&crowd, 20, &["x4", "x4"]);
        // What is left goes no farther down than it has to.
        check(&crowd, 19, &["x2", "out"]);
        check(&crowd, 9, &["out", "out"]);
    }

    #[test]
    fn of_one_class_what_has_most_metres_a_triangle_stays_and_what_fits_beside_it() {
        let crowd = crowd(&[(0, 10, [8, 8, 8]), (0, 90, [10, 10, 10]), (0, 2, [4, 4, 4])]);
        check(&crowd, 14, &["out", "x1", "x1"]);
        check(&crowd, 18, &["x1", "x1", "out"]);
    }

    #[test]
    fn what_is_claimed_first_stays_before_a_higher_class() {
        let crowd = crowd(&[(0, 10, [8, 8, 8]), (9, 10, [8, 8, 8])]);
        let fitted = fit(&crowd, 8, &|member| if member.class == 9 { Claim::First } else { Claim::Usual });
        assert_eq!(fitted.rungs.iter().map(|rung| rung.is_out()).collect::<Vec<_>>(), [true, false]);
    }

    #[test]
    fn a_junction_counts_once() {
        let mut crowd = crowd(&[(0, 10, [4, 4, 4]), (0, 10, [4, 4, 4])]);
        for tolerance in 0..3 {
            crowd.members[1].ends[tolerance][0].point = 0;
        }
        assert_eq!(as_asked(&crowd).triangles, 6);
        check(&crowd, 6, &["x1", "x1"]);
        check(&crowd, 5, &["x1", "out"]);
    }
}
