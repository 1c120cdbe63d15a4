//! What is accepted, and the likeliest cause where something is not.

use super::feet::Feet;
use super::found::{Correlation, Criterion, SightFigures};
use super::shift::Shift;

/// All that has to agree.
pub(super) fn criteria(found: &Correlation) -> Vec<Criterion> {
    let request = &found.request;
    let heights = found.heights.places + found.only_one[0] + found.only_one[1];
    let (slopes, only_one_pairs) = (found.slopes.judged(), found.only_one_pairs.iter().sum::<u64>());
    let criterion =
        |name: &str, agrees_where: String, judged| Criterion::new(name.into(), agrees_where, judged, &request.demand);
    let mut criteria = vec![
        criterion(
            "heights",
            format!(
                "heights differ by {} m at most; a place where only one has ground does not agree",
                request.within_m
            ),
            (heights, heights - found.heights.within),
        ),
        criterion(
            "slopes",
            format!(
                "slopes over {} m differ by {} degrees at most; a place where only one has a slope does not agree",
                found.slopes.apart_m, request.slope_within_degrees
            ),
            (slopes, slopes - found.slopes.within),
        ),
    ];
    criteria.extend(found.sights.iter().map(|sight| {
        let judged = sight.pairs.total() + only_one_pairs;
        let agrees_where = format!(
            "both show, or both hide, the far end, {} m above the ground as the eye; a pair over a hole of one does \
             not agree",
            sight.above_m
        );
        criterion(&format!("sight {} m", sight.above_m), agrees_where, (judged, judged - sight.pairs.agreeing()))
    }));
    criteria
}

/// What is wrong, the likeliest cause first: ground that is missing, a shift, then what does not agree by itself.
pub(super) fn causes(found: &Correlation) -> Vec<String> {
    let mut causes = Vec::new();
    let judged = found.criteria[0].samples;
    for (which, name) in [(0, "B"), (1, "A")] {
        if 0 < found.only_one[which] {
            let share = percent(found.only_one[which], judged);
            causes.push(format!("{name} has no ground at {share} of the places"));
        }
    }
    let shift = || found.shift.as_ref().and_then(|shift| shift_in_words(found, shift));
    // A shift that stands alone explains what follows; beside holes it comes after them. Other units look like one.
    causes.extend(found.feet.as_ref().map(Feet::in_words).or_else(shift));
    for criterion in found.criteria.iter().filter(|criterion| !criterion.is_accepted()) {
        causes.push(match criterion.failures_max {
            None => format!("{}: {} judged, too few to tell", criterion.name, criterion.samples),
            Some(_) => disagreement(found, criterion),
        });
    }
    causes
}

fn percent(count: u64, of: u64) -> String {
    format!("{:.1} %", 100.0 * count as f64 / of.max(1) as f64)
}

fn disagreement(found: &Correlation, criterion: &Criterion) -> String {
    let share = percent(criterion.failures, criterion.samples);
    let sight = found.sights.iter().find(|sight| criterion.name == format!("sight {} m", sight.above_m));
    match (criterion.name.as_str(), sight) {
        ("heights", _) => {
            let within_m = found.request.within_m;
            format!("heights differ by more than {within_m} m, or one is missing, at {share} of the places")
        }
        (_, Some(sight)) => {
            let or_over_holes = if found.only_one_pairs == [0; 2] { "" } else { ", or go over a hole of one surface," };
            format!(
                "lines of sight at {} m differ{or_over_holes} for {share} of the pairs{}",
                sight.above_m,
                who_sees_more(sight)
            )
        }
        _ => {
            let gentler = gentler_on_b(found);
            let or_missing = if found.slopes.only_one == [0; 2] { "" } else { ", or one is missing," };
            format!(
                "slopes differ by more than {} degrees{or_missing} at {share} of the places{gentler}",
                found.request.slope_within_degrees
            )
        }
    }
}

/// Which of the two shows more, where that is more than chance.
fn who_sees_more(sight: &SightFigures) -> String {
    let [[_, b_only], [a_only, _]] = sight.pairs.0;
    let (more, fewer) = (b_only.max(a_only), b_only.min(a_only));
    let apart = (more - fewer) as f64;
    if more == 0 {
        return String::new();
    }
    if apart * apart <= 9.0 * (more + fewer) as f64 {
        return ": each shows what the other hides".into();
    }
    let (seeing, hiding) = if a_only < b_only { ("B", "A") } else { ("A", "B") };
    format!(": {seeing} shows more, as smoother ground does; {hiding} hides more")
}

fn gentler_on_b(found: &Correlation) -> &'static str {
    let classes = &found.slopes.classes.0;
    let count = |is: fn(usize, usize) -> bool| -> u64 {
        let all = classes.iter().enumerate().flat_map(|(a, row)| row.iter().enumerate().map(move |(b, &n)| (a, b, n)));
        all.filter(|&(a, b, _)| is(a, b)).map(|(_, _, n)| n).sum()
    };
    let (gentler, steeper) = (count(|a, b| b < a), count(|a, b| a < b));
    if 2 * steeper < gentler {
        ": B is gentler"
    } else if 2 * gentler < steeper {
        ": B is steeper"
    } else {
        ""
    }
}

/// A shift as where B lies, and what mistakes look like that; `None` where there is none to speak of.
fn shift_in_words(found: &Correlation, shift: &Shift) -> Option<String> {
    let spacing_m = found.spacing_m();
    let (is_aside, is_up) = (shift.is_aside(spacing_m), shift.is_up(found.request.within_m));
    // Moving B to the east brings it closest where it lies too far to the west.
    let [east, north, up] = shift.by_m.map(|metres| -metres);
    let mut lies = Vec::new();
    if is_aside {
        let told = |metres: f64| spacing_m < 20.0 * metres.abs();
        let sides = [(east, "east", "west"), (north, "north", "south")];
        let sides = sides.into_iter().filter(|side| told(side.0));
        lies.extend(
            sides.map(|(metres, to, fro)| format!("{:.1} m {} of", metres.abs(), if 0.0 < metres { to } else { fro })),
        );
    }
    if is_up {
        lies.push(format!("{:.2} m {}", up.abs(), if 0.0 < up { "above" } else { "below" }));
    }
    if lies.is_empty() {
        return None;
    }
    let [before, after] = shift.rms_m;
    let looks = looks_like(found, shift, is_aside, is_up);
    Some(format!("B lies {} A{looks}: moved back, RMS falls from {before:.2} to {after:.2} m", lies.join(" and ")))
}

/// A known mistake that has this shift.
fn looks_like(found: &Correlation, shift: &Shift, is_aside: bool, is_up: bool) -> &'static str {
    const LIKE_HALF: std::ops::Range<f64> = 0.4..0.6;
    /// Metres by which datums differ: geoids lie up to 107 m from the ellipsoid.
    const DATUM_M: std::ops::Range<f64> = 3.0..120.0;
    let is_half_of = |spacing: [f64; 2]| {
        let posts = [0, 1].map(|axis| shift.by_m[axis].abs() / spacing[axis]);
        let is_half = posts.map(|posts| LIKE_HALF.contains(&posts));
        (is_half[0] || posts[0] < 0.1) && (is_half[1] || posts[1] < 0.1) && (is_half[0] || is_half[1])
    };
    if is_aside && found.surfaces.iter().any(|surface| is_half_of(surface.spacing_m)) {
        ", half a post, as where posts are taken for areas"
    } else if !is_aside && is_up && DATUM_M.contains(&shift.by_m[2].abs()) && 3.0 * shift.rms_m[1] < shift.by_m[2].abs()
    {
        ", as above another vertical datum"
    } else {
        ""
    }
}
