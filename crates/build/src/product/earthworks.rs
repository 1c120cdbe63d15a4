//! What is told of cut and fill: how much roads, rivers and lakes move, where they lie farthest off the ground, and
//! when that is too much.

use std::collections::BTreeSet;

use store::{AreaLevel, FeatureFarOff, ReportEarthwork, ReportEarthworks, ReportFarOff};
use terrain::Earthwork;

/// Places that are told of those that lie farthest off.
const WORST_MAX: usize = 10;

/// The share of a class's length that may lie beyond the limits of cut and fill without a warning, and beyond twice
/// these. Where a DEM bridges gorges and takes roofs for ground, 1 to 4 % of rivers and main roads lie beyond them.
const OVER_LIMIT_MAX: [f64; 2] = [0.05, 0.01];

/// Metres of a class beyond a limit that are worth no warning.
const OVER_LIMIT_MIN_M: f64 = 100.0;

/// What features move, as the report gives it; `names` are those of the job's classes.
pub(crate) fn earthworks(names: &[String], level: &AreaLevel) -> ReportEarthworks {
    let name = |class: u8| names.get(usize::from(class)).cloned().unwrap_or_default();
    let class = |(class, work): &(u8, Earthwork)| {
        let ([off_3m_km, off_5m_km, off_10m_km, off_20m_km], [cut_m3, fill_m3]) =
            (work.off_m.map(|metres| metres / 1000.0), work.moved_m3);
        let length_km = work.length_m / 1000.0;
        let per_km = |cubic: f64| if 0.0 < length_km { cubic / length_km } else { 0.0 };
        ReportEarthwork {
            name: name(*class),
            length_km,
            off_3m_km,
            off_5m_km,
            off_10m_km,
            off_20m_km,
            over_limit_km: work.over_limit_m[0] / 1000.0,
            over_twice_limit_km: work.over_limit_m[1] / 1000.0,
            cut_m3,
            fill_m3,
            cut_m3_per_km: per_km(cut_m3),
            fill_m3_per_km: per_km(fill_m3),
        }
    };
    let mut told = BTreeSet::new();
    let worst = level.far_off.iter().filter(|far| told.insert(&far.feature)).take(WORST_MAX);
    let far = |far: &FeatureFarOff| ReportFarOff {
        feature: far.feature.clone(),
        class: name(far.class),
        at_m: far.at_m,
        off_m: far.off_m,
        cause: far.cause.name().into(),
    };
    ReportEarthworks { classes: level.earthworks.iter().map(class).collect(), worst: worst.map(far).collect() }
}

/// What a person should know of ways and shores that lie farther off the ground than cut and fill may be.
pub(crate) fn warnings(names: &[String], level: &AreaLevel) -> Vec<String> {
    let over = level.earthworks.iter().filter_map(|(class, work)| {
        let is_too_much = |at: usize| {
            let metres = work.over_limit_m[at];
            OVER_LIMIT_MIN_M < metres && OVER_LIMIT_MAX[at] * work.length_m < metres
        };
        // The worse one first.
        [1, 0].into_iter().find(|at| is_too_much(*at)).map(|at| ((*class, work), work.over_limit_m[at], at))
    });
    let told = over.map(|((class, work), over_m, at)| {
        let name = names.get(usize::from(class)).map_or("a class", String::as_str);
        let limits = ["the limits", "twice the limits"][at];
        let worst = level.far_off.iter().find(|far| far.class == class);
        let worst = worst.map_or_else(String::new, |far| {
            let ([east, north], what) = (far.at_m, if far.off_m < 0.0 { "cut" } else { "fill" });
            let (off, cause) = (far.off_m.abs(), far.cause.name());
            format!(", most at {east:.0} {north:.0}: a {what} of {off:.1} m ({cause})")
        });
        let (percent, [over_km, km]) =
            (100.0 * over_m / work.length_m, [over_m, work.length_m].map(|metres| metres / 1000.0));
        format!("{percent:.1} % of {name} lies beyond {limits} of cut and fill: {over_km:.2} of {km:.1} km{worst}")
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use terrain::OffCause;

    use super::*;

    fn level(length_m: f64, over_limit_m: [f64; 2]) -> AreaLevel {
        let work = Earthwork { length_m, over_limit_m, ..Earthwork::default() };
        let far = FeatureFarOff {
            feature: "way/7".into(),
            class: 1,
            module: 0,
            at_m: [500.0, 4000.4],
            off_m: -31.25,
            cause: OffCause::Falling,
        };
        AreaLevel { earthworks: vec![(1, work)], far_off: vec![far.clone(), far], ..AreaLevel::default() }
    }

    #[test]
    fn too_much_beyond_the_limits_is_told_with_the_worst_of_it() {
        let names = ["plain", "river"].map(str::to_owned);
        let told = |length, over| warnings(&names, &level(length, over));
        assert_eq!(
            told(20_000.0, [1500.0, 250.0]),
            ["1.2 % of river lies beyond twice the limits of cut and fill: 0.25 of 20.0 km, most at 500 4000: a cut \
              of 31.2 m (falling)"]
        );
        assert!(told(20_000.0, [1500.0, 150.0])[0].starts_with("7.5 % of river lies beyond the limits"));
        assert_eq!(told(20_000.0, [900.0, 150.0]), [""; 0]);
        assert_eq!(told(900.0, [90.0, 50.0]), [""; 0], "a single place is listed, and no warning");
    }

    #[test]
    fn a_feature_is_among_the_worst_once() {
        let told = earthworks(&["plain", "river"].map(str::to_owned), &level(2000.0, [0.0; 2]));
        assert_eq!((told.worst.len(), told.worst[0].class.as_str(), told.classes[0].length_km), (1, "river", 2.0));
    }
}
