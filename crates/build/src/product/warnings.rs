//! What a build tells of itself: for everything that it measures, whether it is a warning, a line of the report, or
//! nothing, and why.
//!
//! This is the one place that decides. A warning is what a customer would want to know before using the database, and
//! what sound data do not have: `--strict` ends with an error for each. Warnings about sources come from the stages
//! that read them; the guide lists all in one table.

use std::collections::BTreeSet;

use job::Job;
use store::{AreaLevel, FeatureAmounts, FeatureRemark, ObjectSums, Report, ReportDeckClearance};

use crate::ground::far_m;
use crate::product::earthworks;

/// What a build made, as far as warnings need it.
#[derive(Clone, Copy)]
pub struct Made<'a> {
    /// The report, whole but for its warnings.
    pub report: &'a Report,
    /// The job, and what its features came to, where it has any.
    pub features: Option<(&'a Job, &'a AreaLevel)>,
}

/// What becomes of something that a build knows.
#[derive(Clone, Copy)]
pub enum Told {
    /// A warning, with a sentence for each thing of which it holds.
    Warning(fn(&Made) -> Vec<String>),
    /// A warning of the stage that finds it, whose sentence is its own.
    OfStage,
    /// A line of the report.
    Line,
    /// Nothing.
    Nothing,
}

/// One thing that a build knows.
#[derive(Clone, Copy)]
pub(crate) struct Matter {
    /// What it is.
    pub what: &'static str,
    /// What becomes of it.
    pub told: Told,
    /// Why.
    pub why: &'static str,
}

/// All that a build knows of what it made, in the order in which warnings are told.
pub(crate) const MATTERS: [Matter; 27] = [
    matter(
        "files, datums, holes and rules of sources, areas of importance, or metres of the area's system, that are not \
         as they should be",
        Told::OfStage,
        "the data, or the job, may be other than meant",
    ),
    matter(
        "more than 1 % of the length of a main class, more than 10 % of that of all ways, or a lake of a hectare, left \
         out for limits",
        Told::Warning(left_out),
        "networks are no longer whole; larger limits keep them, as tiefort plan tells",
    ),
    matter(
        "more than 5 % of the length of a main class, and 100 m, that has no room for its width, at 64 triangles a \
         load module and more",
        Told::Warning(without_width),
        "it is a line and tilts as the hillside does; larger limits lay it flat across, as tiefort plan tells. With \
         fewer triangles no way has its width",
    ),
    matter(
        "more than 5 % of what objects of a kind hide left out for [objects.limits]",
        Told::Warning(objects_left_out),
        "lines of sight go where buildings or woods stand; larger limits keep them, as tiefort plan tells",
    ),
    matter(
        "more than 5 % of a class of ways or of shores, and 100 m, beyond the limits of cut and fill, or 1 % beyond \
         twice these",
        Told::Warning(earthworks),
        "they lie where no person believes them; less than that is listed with its cause",
    ),
    matter(
        "the surface reaches beyond the heights of its sources by 10 m and a fifth of their range",
        Told::Warning(beyond_sources),
        "a wrong level, a deep cut or a wrong pin does that; fitted heights do not",
    ),
    matter(
        "heights of pins or of points to start from that lie as far off the ground there",
        Told::OfStage,
        "a digit too many does that; the farthest is named with its place in the file",
    ),
    matter(
        "features take the surface far from its sources: the RMS against them is a metre and twice that outside \
         features",
        Told::Line,
        "both figures stand in the report, the one against the sources first",
    ),
    matter(
        "decks under the ground",
        Told::Warning(decks_under),
        "corners of decks rise onto it as far as they can; vehicles would run into the ground",
    ),
    matter(
        "bridges through ground that is higher",
        Told::Warning(through_hills),
        "tunnels are assumed there, and features.geojson lists each; the bridge or the DEM is elsewhere",
    ),
    matter(
        "decks below what they cross",
        Told::Warning(decks_below),
        "a bridge passes over what it crosses; which of them is the higher is wrong in the data, or the heights are",
    ),
    matter(
        "a deck steeper than 50 %",
        Told::Warning(decks_steep),
        "its corners rise onto ground that nothing may cut away; vehicles stop there",
    ),
    matter(
        "ends of bridges that hang in the air",
        Told::Line,
        "the way that goes on there is not in the data, or of a kind that is not read; the report counts them",
    ),
    matter(
        "roads that run through buildings",
        Told::Line,
        "their source says of no passage, or lays one of the two beside its place; the report counts the metres",
    ),
    matter(
        "decks too low over what they cross",
        Told::Line,
        "each is listed in features.geojson, and the report has the least height over each class",
    ),
    matter(
        "polygons of rivers without a line in them that fall too far for a lake",
        Told::Warning(rivers_without_line),
        "nothing says which way they fall: they are outlines in the ground, and no water",
    ),
    matter(
        "outlines of water or of what stands there whose ends do not meet",
        Told::Warning(open_outlines),
        "a part of them is left out, and no share of a class knows of it",
    ),
    matter(
        "more than 100 m of ways over holes",
        Told::Warning(over_holes),
        "nothing says how high they lie there, and exports leave that ground out",
    ),
    matter("grades that were relaxed", Told::Line, "the surface is drivable, and each is listed in features.geojson"),
    matter(
        "less than that left out, and features made coarser, for limits",
        Told::Line,
        "what limits are for; kilometres stand beside those wanted",
    ),
    matter(
        "water without an outlet",
        Told::Line,
        "many a lake has none; features.geojson lists rivers that were turned or lie level",
    ),
    matter(
        "limits that could not be met",
        Told::Line,
        "breaches have their own list, and --strict ends with an error for them, too",
    ),
    matter("posts that limits refused", Told::Line, "what limits are for; the report says what it costs"),
    matter("voids that were filled, holes that were left", Told::Line, "the job says what becomes of them"),
    matter("the accuracy that a source states", Told::Line, "it says how much of a residual means anything"),
    matter(
        "a DEM whose noise exceeds what features need",
        Told::Nothing,
        "noise is not measured apart from the ground's own roughness",
    ),
    matter("tiles that were kept, time and memory", Told::Nothing, "they say nothing of the terrain"),
];

const fn matter(what: &'static str, told: Told, why: &'static str) -> Matter {
    Matter { what, told, why }
}

/// The warnings of what was made, without those of stages.
pub fn warnings(made: &Made) -> Vec<String> {
    let found = MATTERS.iter().flat_map(|matter| match matter.told {
        Told::Warning(of) => of(made),
        Told::OfStage | Told::Line | Told::Nothing => Vec::new(),
    });
    found.collect()
}

/// The table of the guide.
pub fn table() -> String {
    let row = |matter: &Matter| {
        let told = match matter.told {
            Told::Warning(_) | Told::OfStage => "warning",
            Told::Line => "line in the report",
            Told::Nothing => "nothing",
        };
        format!("| {} | {told} | {} |\n", matter.what, matter.why)
    };
    let rows: String = MATTERS.iter().map(row).collect();
    format!("| what a build finds | told as | because |\n| - | - | - |\n{rows}")
}

/// Decks lie under the ground.
fn decks_under(made: &Made) -> Vec<String> {
    let Some(checks) = made.report.features.as_ref().map(|features| &features.checks) else { return Vec::new() };
    let told = || {
        format!(
            "{} of {} square metres of decks lie under the ground, by {:.2} m at most, where no corner \
             of theirs could rise far enough",
            checks.deck_samples_under, checks.deck_samples, checks.deck_under_max_m
        )
    };
    (0 < checks.deck_samples_under).then(told).into_iter().collect()
}

/// Decks are too steep to be driven on.
fn decks_steep(made: &Made) -> Vec<String> {
    const MOST_PERCENT: f64 = 50.0;
    let Some(checks) = made.report.features.as_ref().map(|features| &features.checks) else { return Vec::new() };
    let steepest = checks.deck_slope_max_percent;
    let told = || format!("a deck rises by {steepest:.0} %: its corners stand on ground that nothing may cut away");
    (MOST_PERCENT < steepest).then(told).into_iter().collect()
}

/// Bridges lie lower than the ways and the water that they cross.
fn decks_below(made: &Made) -> Vec<String> {
    let all = made.report.features.iter().flat_map(|features| &features.deck_clearances);
    let below = all.filter(|over| over.least_m < 0.0);
    let told = |over: &ReportDeckClearance| {
        format!("a deck lies {:.2} m below what it crosses of {}, see features.geojson", -over.least_m, over.class)
    };
    below.map(told).collect()
}

/// How many features have a remark.
fn features_with(made: &Made, is_meant: impl Fn(&FeatureRemark) -> bool) -> usize {
    let remarks = made.features.iter().flat_map(|(_, level)| &level.remarks);
    remarks.filter(|remark| is_meant(remark)).map(|remark| &remark.feature).collect::<BTreeSet<_>>().len()
}

/// Polygons of rivers are outlines only.
fn rivers_without_line(made: &Made) -> Vec<String> {
    let outline_only = features::Remedy::OutlineOnly.to_string();
    let rivers = features_with(made, |remark| remark.done == outline_only);
    let told = || {
        format!(
            "polygons of rivers without a line inside that fall too far for a lake: {rivers}; they are breaklines and \
             no water, see features.geojson, and lines of the rivers beside them make them water"
        )
    };
    (0 < rivers).then(told).into_iter().collect()
}

/// Outlines are not closed.
fn open_outlines(made: &Made) -> Vec<String> {
    let unclosed = features::Flaw::UnclosedRing.to_string();
    let outlines = features_with(made, |remark| remark.found == unclosed && remark.leaves_out);
    let told = || {
        format!(
            "outlines whose ends do not meet: {outlines}; they are left out, or a part of them, see features.geojson: \
             a shore of the sea needs a polygon"
        )
    };
    (0 < outlines).then(told).into_iter().collect()
}

/// Ways lie where nothing is known.
fn over_holes(made: &Made) -> Vec<String> {
    const LEAST_M: f64 = 100.0;
    let works = made.features.iter().flat_map(|(_, level)| &level.earthworks);
    let metres: f64 = works.map(|(_, work)| work.over_holes_m).sum();
    let told = || {
        format!(
            "{:.1} km of ways lie over holes of the DEM: nothing says how high they are there, and exports leave that \
             ground out",
            metres / 1000.0
        )
    };
    (LEAST_M < metres).then(told).into_iter().collect()
}

/// Bridges would run through hills.
fn through_hills(made: &Made) -> Vec<String> {
    let metres = made.features.map_or(0.0, |(_, level)| level.through_hills_m);
    let told = || {
        format!("{metres:.0} m of bridges run through ground that is higher: tunnels are assumed, see features.geojson")
    };
    (0.0 < metres).then(told).into_iter().collect()
}

/// The share of the length of a main class in the ground that is to have its width: a line takes the tilt of the
/// hillside that it runs along.
pub(crate) const WIDE_MIN: f64 = 0.95;

/// The share of a main class that may be left out without a warning, and that of all ways.
const LEFT_OUT_MAX: [f64; 2] = [0.01, 0.1];

/// Whether limits leave out so much of the features that it is a warning.
pub(crate) fn leaves_much_out(job: &Job, level: &AreaLevel) -> bool {
    !left_out_of(job, level).is_empty()
}

fn left_out(made: &Made) -> Vec<String> {
    made.features.map_or_else(Vec::new, |(job, level)| left_out_of(job, level))
}

/// Too much of a main class, or of all ways, had no room, or lakes of a hectare.
fn left_out_of(job: &Job, level: &AreaLevel) -> Vec<String> {
    let (names, amounts) = (job.class_names(), &level.amounts);
    let out = |wanted: f64, kept: f64, most: f64| most * wanted < wanted - kept;
    let told = |what: &str, wanted: f64, kept: f64| {
        let percent = 100.0 * (wanted - kept) / wanted;
        let [left, wanted] = [wanted - kept, wanted].map(|metres| metres / 1000.0);
        format!("{percent:.1} % of {what} had no room and is left out: {left:.1} of {wanted:.1} km")
    };
    let main = amounts.iter().filter(|of| of.is_main && out(of.wanted_m, of.kept_m, LEFT_OUT_MAX[0]));
    let name = |class: u8| names.get(usize::from(class)).map_or("a class", String::as_str);
    let mut warnings: Vec<String> = main.map(|of| told(name(of.class), of.wanted_m, of.kept_m)).collect();
    let sum = |of: fn(&FeatureAmounts) -> f64| amounts.iter().map(of).sum::<f64>();
    let (wanted, kept) = (sum(|of| of.wanted_m), sum(|of| of.kept_m));
    if out(wanted, kept, LEFT_OUT_MAX[1]) {
        warnings.push(told("all roads, rivers and lines", wanted, kept));
    }
    let lakes = amounts.iter().map(|of| of.lakes_wanted - of.lakes_kept).sum::<u32>();
    if 0 < lakes {
        let all = amounts.iter().map(|of| of.lakes_wanted).sum::<u32>();
        warnings.push(format!("{lakes} of {all} lakes of a hectare and more had no room and are left out"));
    }
    warnings
}

/// Main ways are lines for want of room.
fn without_width(made: &Made) -> Vec<String> {
    const LEAST_M: f64 = 100.0;
    /// Triangles of a load module below which hardly any way has its width, as with the limits of SIMNET.
    const MEAN_MIN: f64 = 64.0;
    let Some((job, level)) = made.features.filter(|(job, _)| MEAN_MIN <= job.limits.mean_per_load_module) else {
        return Vec::new();
    };
    let names = job.class_names();
    let narrow = level.amounts.iter().filter(|of| of.is_main && of.wide_m[1] < WIDE_MIN * of.wide_m[0]);
    let narrow = narrow.filter(|of| LEAST_M < of.wide_m[0] - of.wide_m[1]);
    let told = |of: &FeatureAmounts| {
        let [wanted, laid] = of.wide_m;
        let name = names.get(usize::from(of.class)).map_or("a class", String::as_str);
        format!(
            "{:.1} % of {name} had no room for its width and is a line, which tilts as the ground does: {:.1} of \
             {:.1} km; tiefort plan tells which mean lays it",
            100.0 * (wanted - laid) / wanted,
            (wanted - laid) / 1000.0,
            wanted / 1000.0
        )
    };
    narrow.map(told).collect()
}

/// Too much of what objects hide had no room.
fn objects_left_out(made: &Made) -> Vec<String> {
    const KEPT_MIN: f64 = 0.95;
    let kinds = made.report.objects.iter().flat_map(|objects| &objects.kinds);
    let thin = kinds.filter(|sums| sums.kept_m2 < KEPT_MIN * sums.wanted_m2);
    let told = |sums: &ObjectSums| {
        let percent = 100.0 * (1.0 - sums.kept_m2 / sums.wanted_m2);
        let ObjectSums { kind, wanted, kept, .. } = sums;
        format!(
            "{percent:.1} % of what objects of kind {kind} hide had no room and is left out: {} of {wanted} objects; \
             tiefort plan tells which limits keep them",
            wanted - kept
        )
    };
    thin.map(told).collect()
}

/// Ways lie farther off the ground than cut and fill may be.
fn earthworks(made: &Made) -> Vec<String> {
    made.features.map_or_else(Vec::new, |(job, level)| earthworks::warnings(&job.class_names(), level))
}

/// Roads, water or points take the surface beyond the heights of the sources, further than fitted heights do.
fn beyond_sources(made: &Made) -> Vec<String> {
    // A guard of its own: it knows the sources' heights and no other.
    let found = made.report.heights.and_then(|heights| {
        let [low, high] = heights.sources_m?;
        far_m([low, high]).lt(&heights.outside_m).then(|| {
            format!(
                "the surface reaches {:.2} m beyond the heights of the sources, {low:.2} m to {high:.2} m: a wrong \
                 level, a deep cut or a wrong pin may do that, and tiefort render --view residual shows where",
                heights.outside_m
            )
        })
    });
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use store::{ReportFeatureChecks, ReportFeatures, ReportHeights};
    use terrain::Earthwork;

    use super::*;

    fn report(features: Option<ReportFeatureChecks>) -> Report {
        let features = features.map(|checks| ReportFeatures { checks, ..ReportFeatures::default() });
        Report { features, ..Report::default() }
    }

    #[test]
    fn the_guide_has_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guides/features.md");
        let page = std::fs::read_to_string(path).unwrap();
        let (before, rest) = page.split_once(" cargo test -p build -->\n\n").unwrap();
        let (found, after) = rest.split_once("\n<!-- end of warnings -->").unwrap();
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            let whole = format!("{before} cargo test -p build -->\n\n{}\n<!-- end of warnings -->{after}", table());
            std::fs::write(path, whole).unwrap();
        }
        assert_eq!(found, table(), "UPDATE_GOLDEN=1 rewrites {path}");
    }

    #[test]
    fn open_outlines_and_ways_over_holes_are_told() {
        let text = "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [3000, 3000]\n\
                    spacing_m = 12.5\n[dem]\nsource = \"sample\"\n";
        let job = Job::from_text(text, Path::new("a.toml")).unwrap();
        let told = |level: &AreaLevel| {
            let report = report(Some(ReportFeatureChecks::default()));
            warnings(&Made { report: &report, features: Some((&job, level)) })
        };
        let remark = |leaves_out: bool| FeatureRemark {
            feature: "way/1".into(),
            at_m: None,
            found: features::Flaw::UnclosedRing.to_string(),
            done: String::new(),
            leaves_out,
            degrades: false,
        };
        let over = |over_holes_m: f64| vec![(3, Earthwork { over_holes_m, ..Earthwork::default() })];
        let quiet = AreaLevel { remarks: vec![remark(false)], earthworks: over(99.0), ..AreaLevel::default() };
        assert_eq!(told(&quiet), Vec::<String>::new());
        let bad = AreaLevel { remarks: vec![remark(true); 2], earthworks: over(478.0), ..AreaLevel::default() };
        let [open, holes] = &told(&bad)[..] else { panic!("both are told") };
        assert!(open.contains("do not meet: 1;") && holes.starts_with("0.5 km of ways"), "{open} {holes}");
    }

    #[test]
    fn main_roads_without_their_width_are_told_where_limits_could_hold_it() {
        let told = |mean: u32, class: f64| {
            let text = format!(
                "[area]\nname = \"a\"\ncrs = \"EPSG:32611\"\norigin_m = [0, 0]\nsize_m = [3000, 3000]\nspacing_m = \
                 12.5\n[dem]\nsource = \"sample\"\n[limits]\nmean_per_load_module = {mean}\nper_load_module = 750\n"
            );
            let job = Job::from_text(&text, Path::new("a.toml")).unwrap();
            let amounts = FeatureAmounts {
                is_main: true,
                kept_m: 9e3,
                wanted_m: 9e3,
                wide_m: [9e3, class],
                ..FeatureAmounts::default()
            };
            let level = AreaLevel { amounts: vec![amounts], ..AreaLevel::default() };
            let report = report(Some(ReportFeatureChecks::default()));
            warnings(&Made { report: &report, features: Some((&job, &level)) }).len()
        };
        assert_eq!([told(250, 0.0), told(250, 8.9e3), told(32, 0.0)], [1, 0, 0]);
    }

    #[test]
    fn a_surface_far_beyond_its_sources_is_told() {
        let told = |outside_m, sources_m| {
            let heights = Some(ReportHeights { surface_m: [0.0, 0.0], sources_m, outside_m });
            let report = Report { heights, ..report(Some(ReportFeatureChecks::default())) };
            !warnings(&Made { report: &report, features: None }).is_empty()
        };
        assert_eq!([9.0, 10.0, 11.0].map(|metres| told(metres, Some([500.0, 540.0]))), [false, false, true]);
        assert_eq!([399.0, 401.0].map(|metres| told(metres, Some([0.0, 2000.0]))), [false, true]);
        assert!(!told(500.0, None), "nothing is known of sources");
    }
}
