//! Limits that are exceeded, and what the report and `breaches.*` say of them: the two have to be the same.

use job::{Edges, Job};
use serde_json::Value;
use store::{Folder, Manifest, Report, ReportBreach, ReportPlace, TileState, files};
use terrain::ModuleId;

use super::entries::state_word;
use super::total::Total;
use crate::recount;
use build::ground::GamingArea;

/// A limit that is exceeded.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exceeded {
    pub kind: String,
    pub place: ReportPlace,
    pub count: u64,
    pub limit: u64,
}

impl std::fmt::Display for Exceeded {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { kind, place, count, limit } = self;
        let place = match place {
            ReportPlace::Module([row, col]) => format!("load module {row},{col}"),
            ReportPlace::Window([row, col]) => format!("the window from load module {row},{col}"),
            ReportPlace::Area => "the area".into(),
        };
        write!(f, "{place}: {count} against limits.{kind} = {limit}")
    }
}

/// Every limit of a count that is exceeded: of load modules when the pool is used up, smallest excess first, of
/// windows, of the area.
pub(crate) fn of_counts(area: &GamingArea, counts: &[u32]) -> Vec<Exceeded> {
    let budget = &area.budget;
    let limit = u64::from(budget.per_module);
    let mut over: Vec<(u32, ModuleId)> =
        counts.iter().copied().zip(area.grid.all().iter()).filter(|&(count, _)| limit < u64::from(count)).collect();
    over.sort_unstable();
    let mut pool = budget.pool;
    let mut all = Vec::new();
    for (count, ModuleId { row, col }) in over {
        let count = u64::from(count);
        match pool.checked_sub(count - limit) {
            Some(left) => pool = left,
            None => {
                let place = ReportPlace::Module([row, col]);
                all.push(Exceeded { kind: "per_load_module".into(), place, count, limit });
            }
        }
    }
    let limit = u64::from(budget.per_window);
    let windows = recount::windows(area.grid, counts, budget.windows.rows, budget.windows.cols);
    for (ModuleId { row, col }, count) in windows.filter(|&(_, count)| limit < count) {
        let place = ReportPlace::Window([row, col]);
        all.push(Exceeded { kind: "per_4km_square".into(), place, count, limit });
    }
    let count: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    if budget.area < count {
        let (kind, place) = ("mean_per_load_module".into(), ReportPlace::Area);
        all.push(Exceeded { kind, place, count, limit: budget.area });
    }
    all
}

/// Residuals that the job asks for and that are larger, in millimetres.
pub(crate) fn of_residuals(job: &Job, total: &Total) -> Vec<Exceeded> {
    let asked = [(job.tin.max_residual_m, total.max_m()), (job.tin.target_rms_m, total.rms_m())];
    let missed = asked.into_iter().filter_map(|(limit, found)| Some((limit?, found)));
    missed
        .filter(|(limit, found)| limit < found)
        .map(|(limit, found)| Exceeded {
            kind: "residual".into(),
            place: ReportPlace::Area,
            count: (found * 1000.0).ceil() as u64,
            limit: (limit * 1000.0).floor() as u64,
        })
        .collect()
}

/// Where limits and breaches are not the same, and, second, what was not checked.
pub(crate) fn check(
    folder: &Folder,
    job: &Job,
    report: Option<&Report>,
    exceeded: &[Exceeded],
) -> (Vec<String>, Vec<String>) {
    let Some(report) = report else {
        let problems = match job.modules.edges {
            Edges::Constrained => {
                exceeded.iter().filter(|one| one.kind != "residual").map(Exceeded::to_string).collect()
            }
            Edges::Clip(_) => Vec::new(),
        };
        let one = |one: &Exceeded| format!("{one}: no report.json, which would have to say so");
        return (problems, exceeded.iter().map(one).collect());
    };
    let mut problems = Vec::new();
    let mut listed: Vec<Exceeded> = report.breaches.iter().map(exceeded_of).collect();
    for one in exceeded {
        match listed.iter().position(|listed| listed == one) {
            Some(place) => drop(listed.swap_remove(place)),
            None => problems.push(format!("{one}, and report.json lists no such breach")),
        }
    }
    problems.extend(listed.iter().map(|one| format!("report.json: lists a breach that is not there, of {one}")));
    let wrong = report.breaches.iter().filter(|breach| breach.excess != breach.count.saturating_sub(breach.limit));
    problems.extend(wrong.map(|breach| {
        format!(
            "report.json: the excess of {} is {}, which is not their difference",
            exceeded_of(breach),
            breach.excess
        )
    }));
    for (name, read) in [(files::BREACHES, geojson as Reading), (files::BREACHES_CSV, csv)] {
        // Those that a report lists are there: their bytes were looked at.
        let Ok(text) = folder.read_text(name) else { continue };
        if report.files.contains_key(name)
            && !read(&text).into_iter().eq(report.breaches.iter().map(exceeded_of).map(Some))
        {
            problems.push(format!("{name}: its breaches are not those of report.json"));
        }
    }
    (problems, Vec::new())
}

fn exceeded_of(breach: &ReportBreach) -> Exceeded {
    Exceeded { kind: breach.kind.clone(), place: breach.place, count: breach.count, limit: breach.limit }
}

/// The breaches in the text of a file; `None` for one that cannot be read.
type Reading = fn(&str) -> Vec<Option<Exceeded>>;

fn geojson(text: &str) -> Vec<Option<Exceeded>> {
    let value: Value = serde_json::from_str(text).unwrap_or_default();
    let features = value["features"].as_array().cloned().unwrap_or_default();
    let one = |feature: Value| {
        let said = &feature["properties"];
        let index = |key: &str| said[key].as_u64().and_then(|index| u32::try_from(index).ok());
        let place = place(said["where"].as_str()?, index("row"), index("col"))?;
        let (kind, count, limit) =
            (said["kind"].as_str()?.to_owned(), said["count"].as_u64()?, said["limit"].as_u64()?);
        Some(Exceeded { kind, place, count, limit })
    };
    features.into_iter().map(one).collect()
}

fn csv(text: &str) -> Vec<Option<Exceeded>> {
    let one = |line: &str| {
        let fields: Vec<&str> = line.split(',').collect();
        let [kind, word, row, col, count, limit, ..] = fields[..] else { return None };
        let place = place(word, row.parse().ok(), col.parse().ok())?;
        Some(Exceeded { kind: kind.to_owned(), place, count: count.parse().ok()?, limit: limit.parse().ok()? })
    };
    text.lines().skip(1).map(one).collect()
}

fn place(word: &str, row: Option<u32>, col: Option<u32>) -> Option<ReportPlace> {
    match word {
        "module" => Some(ReportPlace::Module([row?, col?])),
        "window" => Some(ReportPlace::Window([row?, col?])),
        "area" => Some(ReportPlace::Area),
        _ => None,
    }
}

/// Tiles whose state is not what their load modules say.
pub(crate) fn wrong_states(manifest: &Manifest, area: &GamingArea, exceeded: &[Exceeded]) -> Vec<String> {
    let mut problems = Vec::new();
    for record in manifest.tiles.iter().filter(|record| record.state != TileState::Frozen) {
        let rect = area.tiling.modules(record.tile(), area.grid);
        let is_over = exceeded.iter().any(|one| match one.place {
            ReportPlace::Module([row, col]) => rect.contains(ModuleId { row, col }),
            ReportPlace::Window(_) | ReportPlace::Area => false,
        });
        let expected = if is_over { TileState::OverLimit } else { TileState::Done };
        if record.state != expected {
            let (found, expected) = (state_word(record.state), state_word(expected));
            let tile = record.tile();
            problems.push(format!("database.json: tile {tile} is listed as {found}, its load modules say {expected}"));
        }
    }
    problems
}
