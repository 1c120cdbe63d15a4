//! What `tiefort correlate` found, in the words of a certificate.

use inspect::{Confusion, Correlation, HeightFigures, SLOPE_CLASSES, SLOPE_ENDS_DEGREES, SurfaceFacts};
use views::{Certificate, CertificateMap, Section, Table, grouped};

use crate::places;

/// The certificate.
pub fn certificate(found: &Correlation) -> Certificate {
    let mut sections = vec![compared(found), plan(found), criteria(found), heights(found), shift(found)];
    sections.extend([slopes(found), sights(found)]);
    if !found.classes.is_empty() {
        sections.push(classes(found));
    }
    let name =
        |surface: &SurfaceFacts| if surface.name.is_empty() { surface.path.clone() } else { surface.name.clone() };
    let [a, b] = [0, 1].map(|which| name(&found.surfaces[which]));
    Certificate {
        title: format!("Correlation of {a} and {b}"),
        verdict: (found.is_accepted(), verdict(found)),
        sections,
        map: (0 < found.heights.places).then(|| map(found)),
    }
}

/// The result and its cause in one line.
fn verdict(found: &Correlation) -> String {
    let request = &found.request;
    match (found.is_accepted(), found.causes.first()) {
        (true, None) => format!(
            "Accepted: at least {} of the area, and of lines of sight, agree, at a risk of {}.",
            percent(request.demand.share),
            percent(request.demand.risk)
        ),
        (true, Some(cause)) => format!("Accepted, though {cause}."),
        (false, cause) => format!("Not accepted: {}.", cause.map_or("no place to judge", String::as_str)),
    }
}

fn percent(share: f64) -> String {
    // As few decimals as tell it apart from others.
    let text = format!("{:.6}", 100.0 * share);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

fn found_percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn compared(found: &Correlation) -> Section {
    let facts = |of: &dyn Fn(&SurfaceFacts) -> String| found.surfaces.each_ref().map(of);
    let corner = |extent: &[f64; 4]| format!("{},{} to {},{}", extent[0], extent[1], extent[2], extent[3]);
    let unknown = |text: &str| if text.is_empty() { "unknown".into() } else { text.to_owned() };
    let all: [(&str, [String; 2]); 8] = [
        ("file", facts(&|surface| surface.path.clone())),
        ("kind", facts(&|surface| surface.kind.clone())),
        ("area", facts(&|surface| if surface.name.is_empty() { "-".into() } else { surface.name.clone() })),
        ("coordinates", facts(&|surface| surface.crs.clone())),
        ("heights above", facts(&|surface| unknown(&surface.vertical_datum))),
        ("ground", facts(&|surface| corner(&surface.extent_m))),
        (
            "posts apart",
            facts(&|surface| match surface.spacing_m {
                [east, north] if east == north => format!("{east} m"),
                [east, north] => format!("{east} m east, {north} m north"),
            }),
        ),
        ("BLAKE3", facts(&|surface| surface.fingerprint.clone())),
    ];
    // A fingerprint is wider than half a terminal: each surface has lines of its own.
    let mut table = Table::default().words(["", "", ""]);
    for (which, letter) in [(0, "A"), (1, "B")] {
        all.iter().for_each(|(name, both)| table.row([letter, name, &both[which]]));
    }
    let [west, south, east, north] = found.common_m;
    let (wide, high) = ((east - west) / 1000.0, (north - south) / 1000.0);
    let mut sentences = vec![format!("In common: {wide:.3} x {high:.3} km, {}.", corner(&found.common_m))];
    sentences.extend(found.notes.iter().map(|note| format!("Note: {note}.")));
    let explained = "The fingerprint of a database is that of its database.json, which names those of all its files: \
                     databases with the same one are the same to the last bit.";
    Section {
        title: "What was compared".into(),
        sentences,
        table,
        explained: vec![explained.into()],
        ..Section::default()
    }
}

fn plan(found: &Correlation) -> Section {
    let (request, plan) = (&found.request, found.plan);
    let rows = [
        ("share that has to agree", percent(request.demand.share)),
        ("risk of accepting less", percent(request.demand.risk)),
        ("places, and pairs of places, looked at", grouped(plan.samples)),
        ("of these may fail", grouped(plan.failures_max)),
        ("drawn from seed", request.seed.to_string()),
        ("targets of lines of sight", format!("{} to {} m", inspect::NEAREST_M, request.range_m)),
        ("objects in lines of sight", places::standing_word(found.standing).into()),
        ("program", format!("tiefort {}", env!("CARGO_PKG_VERSION"))),
    ];
    let mut table = Table::default().words([""]).figures([""]);
    rows.into_iter().for_each(|(name, value)| table.row([name.to_owned(), value]));
    let explained = "Acceptance sampling, exact for the binomial distribution: if a smaller share than the one asked \
                     for agreed, more places than may fail would fail, but for the risk. Unless a number of places \
                     was asked for, it is the smallest one with which surfaces of which half as much fails are \
                     refused with no larger a risk.";
    Section { title: "The plan".into(), table, explained: vec![explained.into()], ..Section::default() }
}

fn criteria(found: &Correlation) -> Section {
    let mut table = Table::default().words(["criterion"]);
    table = table.figures(["failed", "may fail", "agree", "95 % interval", ""]);
    for criterion in &found.criteria {
        let (agreement, interval) = match criterion.agreement() {
            Some((share, [low, high])) => {
                (found_percent(share), format!("{:.2} to {:.2} %", 100.0 * low, 100.0 * high))
            }
            None => ("-".into(), "-".into()),
        };
        let most = criterion.failures_max.map_or("-".into(), grouped);
        let failed = format!("{} of {}", grouped(criterion.failures), grouped(criterion.samples));
        let accepted = if criterion.is_accepted() { "accepted" } else { "not accepted" };
        table.row([criterion.name.clone(), failed, most, agreement, interval, accepted.into()]);
    }
    let where_agree = found.criteria.iter().map(|criterion| format!("{}: {}.", criterion.name, criterion.agrees_where));
    let mut sentences = Vec::new();
    if 1 < found.causes.len() || (found.is_accepted() && !found.causes.is_empty()) {
        sentences.push("Causes, the likeliest first:".to_owned());
        sentences.extend(found.causes.iter().map(|cause| format!("- {cause}")));
    }
    let (places, pairs) = (found.only_one, found.only_one_pairs);
    if 0 < places[0] + places[1] + pairs[0] + pairs[1] + found.void_places + found.void_pairs {
        sentences.push(format!(
            "Ground in A alone: {} places, {} pairs; in B alone: {} places, {} pairs. Drawn again: {} places without \
             ground, {} pairs.",
            grouped(places[0]),
            grouped(pairs[0]),
            grouped(places[1]),
            grouped(pairs[1]),
            grouped(found.void_places),
            grouped(found.void_pairs)
        ));
    }
    let mut explained = vec!["A place, or a pair of places, agrees where:".to_owned()];
    explained.extend(where_agree);
    explained.push("The interval holds the share of all that agrees with 95 % (Clopper and Pearson).".into());
    Section { title: "What is accepted".into(), sentences, table, explained, ..Section::default() }
}

fn height_cells(figures: &HeightFigures) -> [String; 7] {
    let metres = |metres: f64| format!("{metres:.2}");
    let [p50, p90, p95, p99] = figures.absolute_m.map(metres);
    [metres(figures.mean_m), metres(figures.rms_m), p50, p90, p95, p99, metres(figures.largest_m)]
}

fn heights(found: &Correlation) -> Section {
    let figures = &found.heights;
    if figures.places == 0 {
        let sentences = vec!["No place has a height in both.".into()];
        return Section { title: "Heights".into(), sentences, ..Section::default() };
    }
    let [east, north] = figures.largest_at_m;
    let largest = match figures.largest_m == 0.0 {
        true => String::new(),
        false => format!("; the largest at {east:.1},{north:.1}"),
    };
    let sentence = format!("Height of B less that of A, in metres, at {} places{largest}.", grouped(figures.places));
    let mut table = Table::default().words(["mean"]).figures(["RMS", "50 %", "90 %", "95 %", "99 %", "largest"]);
    table.row(height_cells(figures));
    Section {
        title: "Heights".into(),
        sentences: vec![sentence],
        table,
        explained: vec![
            "A mean far from 0 is a difference of datums or units; an RMS far above the mean is another shape. Of 100 \
             places, 95 differ by no more than the figure below 95 %."
                .into(),
        ],
        ..Section::default()
    }
}

fn shift(found: &Correlation) -> Section {
    let title = "Best shift".into();
    let Some(shift) = &found.shift else {
        let sentences = vec!["Too few places have heights and slopes in both.".into()];
        return Section { title, sentences, ..Section::default() };
    };
    let [east, north, up] = [0, 1, 2].map(|axis| {
        if axis < 2 && !shift.is_level_told {
            return "-".to_owned();
        }
        // No minus before a zero.
        format!("{:.2} ± {:.2}", shift.by_m[axis] + 0.0, 1.96 * shift.error_m[axis])
    });
    let mut sentences = vec!["The move of B that brings it closest to A, in metres.".to_owned()];
    if !shift.is_level_told {
        sentences.push("The ground is too flat, or too even, to tell a move to a side.".into());
    }
    let [before, after] = shift.rms_m.map(|metres| format!("{metres:.2}"));
    let mut table = Table::default().words(["east"]).figures(["north", "up", "RMS before", "RMS after"]);
    table.row([east, north, up, before, after]);
    Section {
        title,
        sentences,
        table,
        explained: vec![
            "Half a post to a side is where one takes posts for areas; some metres up another vertical datum. It is \
             told as a cause from a tenth of a post, and from a tenth of what heights may differ by."
                .into(),
        ],
        ..Section::default()
    }
}

/// Agreement and kappa in a sentence.
fn kappa_text<const N: usize>(table: &Confusion<N>) -> String {
    match table.kappa() {
        _ if table.total() == 0 => "none judged".into(),
        None => "kappa undefined: all of both is of one kind".into(),
        Some(kappa) => {
            let [low, high] = kappa.interval;
            format!("kappa {:.3} ({low:.3} to {high:.3})", kappa.kappa)
        }
    }
}

fn slopes(found: &Correlation) -> Section {
    let figures = &found.slopes;
    let name = |class: usize| match class {
        0 => format!("0-{}", SLOPE_ENDS_DEGREES[0]),
        class if class < SLOPE_ENDS_DEGREES.len() => {
            format!("{}-{}", SLOPE_ENDS_DEGREES[class - 1], SLOPE_ENDS_DEGREES[class])
        }
        class => format!("{}+", SLOPE_ENDS_DEGREES[class - 1]),
    };
    let mut table = Table::default().words(["A, degrees"]);
    table = table.figures((0..SLOPE_CLASSES).map(|class| format!("B {}", name(class))));
    for (class, row) in figures.classes.0.iter().enumerate() {
        table.add([name(class)], row.map(grouped));
    }
    let agree = figures.classes.agreeing() as f64 / figures.classes.total().max(1) as f64;
    Section {
        title: "Slopes".into(),
        sentences: vec![format!(
            "Places with a slope on both by its class, taken over {} m: {} in the same class, {}; RMS difference \
             {:.2} degrees.",
            figures.apart_m,
            found_percent(agree),
            kappa_text(&figures.classes),
            figures.rms_degrees
        )],
        table,
        explained: vec![
            "Rows are classes of A, columns those of B. Places below the diagonal are gentler on B: what stops a \
             vehicle on A does not on B."
                .into(),
        ],
        ..Section::default()
    }
}

fn sights(found: &Correlation) -> Section {
    let mut table = Table::default().words(["height"]);
    table = table.figures(["both see", "neither", "only A", "only B", "agree", "kappa, 95 % interval"]);
    for sight in &found.sights {
        let [[neither, b_only], [a_only, both]] = sight.pairs.0.map(|row| row.map(grouped));
        let agree = sight.pairs.agreeing() as f64 / sight.pairs.total().max(1) as f64;
        let kappa = sight.pairs.kappa().map_or("undefined".into(), |kappa| {
            format!("{:.3} ({:.3} to {:.3})", kappa.kappa, kappa.interval[0], kappa.interval[1])
        });
        table.row([format!("{} m", sight.above_m), both, neither, a_only, b_only, found_percent(agree), kappa]);
    }
    let mut sentences = vec!["Pairs of places that see each other, both as high above the ground.".to_owned()];
    if found.only_one_pairs != [0; 2] {
        sentences.push("Those over a hole of one surface agree in nothing, and are not among these.".into());
    }
    if found.sights.iter().any(|sight| sight.pairs.kappa().is_none()) {
        sentences.push("Kappa is undefined where every pair is seen on both, or hidden on both.".into());
    }
    Section {
        title: "Lines of sight".into(),
        sentences,
        table,
        explained: vec![
            "Kappa is agreement beyond chance: 1 where all pairs agree, 0 where no more do than if they were drawn. \
             Where only one side sees, one can fire at a target that does not see who fires: an unfair fight."
                .into(),
        ],
        ..Section::default()
    }
}

fn classes(found: &Correlation) -> Section {
    let mut table = Table::default().words(["class"]);
    table = table.figures(["places", "agree", "mean", "RMS", "95 %", "largest"]);
    for class in &found.classes {
        let figures = &class.heights;
        let agree = figures.within as f64 / figures.places.max(1) as f64;
        let [mean, rms, _, _, p95, _, largest] = height_cells(figures);
        table.row([class.name.clone(), grouped(figures.places), found_percent(agree), mean, rms, p95, largest]);
    }
    Section {
        title: "By class of ground".into(),
        sentences: vec!["Heights as above, by the class that the ground has in A.".into()],
        table,
        ..Section::default()
    }
}

fn map(found: &Correlation) -> CertificateMap {
    let [west, south, east, north] = found.common_m;
    let largest = found.map.means_m.iter().flatten().fold(0.0_f64, |most, mean| most.max(mean.abs()));
    CertificateMap {
        title: "Where heights differ: B less A, mean of each square, north up".into(),
        rows: found.map.rows,
        cols: found.map.cols,
        size_m: [east - west, north - south],
        values_m: found.map.means_m.clone(),
        scale_m: largest.max(found.request.within_m),
    }
}
