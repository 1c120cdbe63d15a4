//! What to change in a job when limits bind: named policies, each with the numbers that it would need.

use store::{Report, ReportBound, ReportEnough, ReportFeatureClass, ReportPlace};
use terrain::POINT_COST;

use crate::table::grouped;

/// One thing that could be changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Advice {
    /// A short name that can be quoted.
    pub policy: &'static str,
    /// What was found.
    pub found: String,
    /// What to write into the job.
    pub change: String,
    /// What that would bring, and what it costs.
    pub effect: String,
}

/// Use of the mean above which the budget of the area is what ends refinement.
const SPENT: f64 = 0.985;
/// RMS residual up to which a class is level rather than true.
const LEVEL_M: f64 = 0.05;

/// Times that the RMS residual of a class is above that of another, from which on one may want to shift weights.
const UNEVEN: f64 = 3.0;

/// What a report gives reason to change, most pressing first. Empty when there is nothing to say.
pub(crate) fn advise(report: &Report) -> Vec<Advice> {
    [
        breached(report),
        network(report),
        module_limit(report),
        pool(report),
        window_limit(report),
        mean(report),
        importance(report),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn breached(report: &Report) -> Option<Advice> {
    let over: Vec<_> = report.breaches.iter().filter(|breach| breach.kind == "per_load_module").collect();
    let worst = over.iter().max_by_key(|breach| breach.count)?;
    let excess: u64 = over.iter().map(|breach| breach.excess).sum();
    Some(Advice {
        policy: "constrain-edges",
        found: format!(
            "{} load modules hold more than {} {}, the largest {} ({}).",
            grouped(over.len() as u64),
            grouped(worst.limit),
            report.count,
            grouped(worst.count),
            place_text(worst.place)
        ),
        change: format!(
            "load_modules.edges = \"constrained\"; or limits.pool = {excess}; or limits.per_load_module = {}",
            worst.count
        ),
        effect: "Clipped pieces are counted only after the cut. With constrained edges module lines are edges of the \
                 TIN from the start, and no limit is ever exceeded."
            .into(),
    })
}

fn network(report: &Report) -> Option<Advice> {
    let ReportEnough { mean, per_load_module, per_4km } = report.enough?;
    let features = report.features.as_ref()?;
    let sum = |of: fn(&ReportFeatureClass) -> f64| features.classes.iter().map(of).sum::<f64>();
    let lakes: u64 = features.classes.iter().map(|class| class.lakes_wanted - class.lakes_kept).sum();
    Some(Advice {
        policy: "keep-network",
        found: format!(
            "Limits leave out {:.1} of {:.1} km of roads and rivers, and {} lakes of a hectare and more.",
            sum(|class| class.wanted_km - class.kept_km),
            sum(|class| class.wanted_km),
            grouped(lakes)
        ),
        change: format!(
            "limits.mean_per_load_module = {mean}; limits.per_load_module = {per_load_module}; \
             limits.per_4km_square = {per_4km}"
        ),
        effect: "The least mean that tiefort plan tries which keeps nearly all: 99.5 % of motorways, primaries, rails \
                 and rivers, 95 % of every other kind and every lake of a hectare."
            .into(),
    })
}

fn of_kind<'a>(report: &'a Report, kind: &'a str) -> Vec<&'a ReportBound> {
    report.bound.iter().filter(|bound| bound.kind == kind).collect()
}

fn module_limit(report: &Report) -> Option<Advice> {
    let bound = of_kind(report, "per_load_module");
    let worst = bound.iter().max_by_key(|bound| bound.refused)?;
    let refused: u64 = bound.iter().map(|bound| u64::from(bound.refused)).sum();
    let enough = worst.count + u64::from(POINT_COST) * u64::from(worst.refused);
    Some(Advice {
        policy: "raise-module-limit",
        found: format!(
            "limits.per_load_module = {} kept {} posts out of {} load modules, most of them, {}, out of {}.",
            grouped(worst.limit),
            grouped(refused),
            grouped(bound.len() as u64),
            grouped(u64::from(worst.refused)),
            place_text(worst.place)
        ),
        change: format!("limits.per_load_module = {enough}"),
        effect: format!(
            "Would let them all in, at {POINT_COST} {} each: {} more. There, the RMS residual is {:.2} m and would be \
             {:.2} m; the largest residual kept out is {:.2} m.",
            report.count,
            grouped(u64::from(POINT_COST) * refused),
            worst.rms_with_m,
            worst.rms_without_m,
            bound.iter().map(|bound| bound.refused_largest_m).fold(0.0, f64::max)
        ),
    })
}

fn pool(report: &Report) -> Option<Advice> {
    let bound = of_kind(report, "per_load_module");
    let share = bound.len() as f64 * 100.0 * report.per_load_module.mean / report.triangles.max(1) as f64;
    // For a few places a pool is cheaper to a simulator than a higher limit everywhere.
    if bound.is_empty() || 2.0 < share {
        return None;
    }
    let refused: u64 = bound.iter().map(|bound| u64::from(bound.refused)).sum();
    Some(Advice {
        policy: "grant-pool",
        found: format!(
            "Only {} load modules are held back, {share:.2} % of the area; the pool of {} {} has {} left.",
            grouped(bound.len() as u64),
            grouped(report.pool.size),
            report.count,
            grouped(report.pool.size - report.pool.used)
        ),
        change: format!("limits.pool = {}", report.pool.size + u64::from(POINT_COST) * refused),
        effect: "Lets the worst load modules exceed their limit by as many together, and no other.".into(),
    })
}

fn window_limit(report: &Report) -> Option<Advice> {
    let bound = of_kind(report, "per_4km_square");
    let worst = bound.iter().max_by_key(|bound| bound.refused)?;
    let refused: u64 = bound.iter().map(|bound| u64::from(bound.refused)).sum();
    Some(Advice {
        policy: "raise-window-limit",
        found: format!(
            "limits.per_4km_square = {} kept {} posts out, most of them, {}, in the {}.",
            grouped(worst.limit),
            grouped(refused),
            grouped(u64::from(worst.refused)),
            place_text(worst.place)
        ),
        // Windows overlap, and a post is booked to one of them; so the worst alone says what is about enough.
        change: format!("limits.per_4km_square = {}", worst.count + u64::from(POINT_COST) * u64::from(worst.refused)),
        effect: format!(
            "About enough for the worst window: there, the RMS residual is {:.2} m and would be {:.2} m. Fewer {} next \
             to it would make room as well: give ground that matters less a lower weight.",
            worst.rms_with_m, worst.rms_without_m, report.count
        ),
    })
}

fn mean(report: &Report) -> Option<Advice> {
    let modules = report.per_load_module;
    if modules.mean_limit <= 0.0 || modules.mean / modules.mean_limit < SPENT {
        return None;
    }
    let (now, more) = (modules.mean_limit, (modules.mean_limit * 1.25).round());
    Some(Advice {
        policy: "raise-mean",
        found: format!(
            "The budget of the area is spent: {:.2} of {now} {} in the mean load module.",
            modules.mean, report.count
        ),
        change: format!("limits.mean_per_load_module = {more}"),
        effect: format!(
            "On most ground the RMS residual falls as the number of triangles grows{}.",
            fallen(report, now / more)
        ),
    })
}

/// By how much the RMS residual falls where it falls to a share, as far as that is known: what lies at a fixed outer
/// border hardly gains, however large its part in the whole.
fn fallen(report: &Report, share: f64) -> String {
    let fall = |rms_m: f64| format!("about {:.2} m instead of {rms_m:.2} m", share * rms_m);
    match &report.border {
        None => String::new(),
        Some(border) if border.fixed => format!(
            ": {} inside. Load modules at the fixed outer border, now {:.2} m off, gain less",
            fall(border.inside.rms_m),
            border.at_border.rms_m
        ),
        Some(_) => format!(": {}", fall(report.residual.rms_m)),
    }
}

fn importance(report: &Report) -> Option<Advice> {
    // Level water, and classes that lie nowhere, say nothing of how ground shares its triangles.
    let classes = report.classes.iter().filter(|class| 0 < class.posts && LEVEL_M < class.residual.rms_m);
    let by_rms = |a: &&store::ReportClass, b: &&store::ReportClass| a.residual.rms_m.total_cmp(&b.residual.rms_m);
    let (best, worst) = (classes.clone().min_by(by_rms)?, classes.max_by(by_rms)?);
    if worst.residual.rms_m < UNEVEN * best.residual.rms_m {
        return None;
    }
    Some(Advice {
        policy: "shift-importance",
        found: format!(
            "Triangles on {:?} lie {:.2} m off (RMS), those on {:?} {:.2} m.",
            worst.name, worst.residual.rms_m, best.name, best.residual.rms_m
        ),
        change: format!("importance: bring the weight of {:?} nearer to that of {:?}", worst.name, best.name),
        effect: format!(
            "Moves {} from {:?} to {:?}. Leave it as it is where no vehicle drives there.",
            report.count, best.name, worst.name
        ),
    })
}

pub(crate) fn place_text(place: ReportPlace) -> String {
    match place {
        ReportPlace::Module([row, col]) => format!("load module {row},{col}"),
        ReportPlace::Window([row, col]) => format!("window from load module {row},{col}"),
        ReportPlace::Area => "whole area".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn policies(report: &Report) -> Vec<&'static str> {
        advise(report).into_iter().map(|advice| advice.policy).collect()
    }

    #[test]
    fn every_limit_that_binds_has_its_policy() {
        let expected = [
            "constrain-edges",
            "raise-module-limit",
            "grant-pool",
            "raise-window-limit",
            "raise-mean",
            "shift-importance",
        ];
        assert_eq!(policies(&samples::report()), expected);
    }

    #[test]
    fn the_advice_names_what_would_be_enough() {
        let advice = advise(&samples::report());
        assert_eq!(advice[1].change, "limits.per_load_module = 105", "99 there, and 3 posts of 2 triangles");
        assert_eq!(advice[2].change, "limits.pool = 506");
        assert_eq!(advice[3].change, "limits.per_4km_square = 4106");
    }

    #[test]
    fn a_higher_mean_promises_nothing_for_a_fixed_border() {
        let effect = |report: &Report| mean(report).unwrap().effect;
        let mut report = samples::report();
        assert!(effect(&report).ends_with("grows: about 2.40 m instead of 3.00 m."), "{}", effect(&report));
        report.border = report.border.map(|border| store::ReportBorder { fixed: true, ..border });
        let told =
            "about 2.56 m instead of 3.20 m inside. Load modules at the fixed outer border, now 3.40 m off, gain";
        assert!(effect(&report).contains(told), "{}", effect(&report));
        report.border = None;
        assert!(effect(&report).ends_with("triangles grows."), "{}", effect(&report));
    }

    #[test]
    fn a_mean_that_keeps_the_network_is_named_where_too_much_is_left_out() {
        let mut report = samples::report();
        report.enough = Some(ReportEnough { mean: 250, per_load_module: 750, per_4km: 32_000 });
        let class = ReportFeatureClass { wanted_km: 10.0, kept_km: 7.5, lakes_wanted: 2, ..Default::default() };
        report.features = Some(store::ReportFeatures { classes: vec![class], ..Default::default() });
        let advice = advise(&report).into_iter().find(|advice| advice.policy == "keep-network").unwrap();
        assert_eq!(
            advice.change,
            "limits.mean_per_load_module = 250; limits.per_load_module = 750; limits.per_4km_square = 32000"
        );
        assert!(advice.found.contains("2.5 of 10.0 km") && advice.found.contains("2 lakes"), "{}", advice.found);
    }

    #[test]
    fn ground_without_trouble_gets_no_advice() {
        let mut report = samples::report();
        report.breaches.clear();
        report.bound.clear();
        report.classes.truncate(1);
        report.per_load_module.mean = 20.0;
        assert_eq!(policies(&report), Vec::<&str>::new());
    }
}
