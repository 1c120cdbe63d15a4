//! What budgets would keep of the features and objects of a job, as a table and as JSON.

use std::time::{Duration, Instant};

use build::{BUDGETS, Budgeted, Budgets, OBJECT_BUDGETS, ObjectBudget, ObjectBudgets};
use job::Job;
use serde_json::{Value, json};
use store::ObjectSums;
use views::{Align, Table, grouped};

use crate::{resources, terminal};

/// How long a person waits for a table before a line says what it waits for.
const PATIENCE: Duration = Duration::from_secs(2);

/// A share of a length, in whole per cent where it is not nearly all.
pub fn share([kept, all]: [f64; 2]) -> String {
    let percent = if 0.0 < all { 100.0 * kept / all } else { 100.0 };
    match percent {
        99.95.. => "100 %".to_owned(),
        99.0.. => format!("{:.1} %", (10.0 * percent).floor() / 10.0),
        _ => format!("{percent:.0} %"),
    }
}

/// What budgets would keep of a job: of features up to the one that keeps all, and that of the job; of objects up to
/// the first that keeps nearly all.
pub struct Tried {
    /// Of features; empty where there are none.
    pub features: Vec<Budgeted>,
    /// Of objects; empty where there are none.
    pub objects: Vec<ObjectBudget>,
}

impl Tried {
    /// Those of a job.
    pub fn of_job(job: &Job) -> Self {
        let budgets = open(job);
        let features = budgets.as_ref().map_or_else(Vec::new, of_features);
        Self { features, objects: of_objects(job, budgets.as_ref()) }
    }
}

/// The features of a job, on which budgets are tried; `None` without any, and where they cannot be read, which is told.
pub fn open(job: &Job) -> Option<Budgets> {
    Budgets::open(job, resources::cores()).unwrap_or_else(|error| {
        terminal::tell(&format!("note: what budgets would keep of roads and water is not known: {error}"));
        None
    })
}

fn of_features(budgets: &Budgets) -> Vec<Budgeted> {
    let mut tried: Vec<Budgeted> = Vec::new();
    let mut waited = Instant::now();
    for mean in BUDGETS {
        if PATIENCE < waited.elapsed() {
            terminal::tell(&format!("trying what a mean of {mean} triangles keeps of features"));
            waited = Instant::now();
        }
        tried.extend(budgets.of_mean(mean));
        if tried.last().is_some_and(Budgeted::is_whole) {
            break;
        }
    }
    with_own(tried, budgets.of_job().ok())
}

/// Budgets with that of the job itself in its place, where it is none of them.
fn with_own(mut tried: Vec<Budgeted>, own: Option<Budgeted>) -> Vec<Budgeted> {
    if let Some(own) = own.filter(|_| tried.iter().all(|of| !of.is_own)) {
        tried.insert(tried.partition_point(|of| of.mean <= own.mean), own);
    }
    tried
}

/// The share of main ways in the ground that have their width; nothing where none is to.
pub fn wide(of: &Budgeted) -> Option<String> {
    (0.0 < of.wide_m[1]).then(|| share(of.wide_m))
}

/// The table; empty where there is none.
pub fn table_text(budgets: &[Budgeted]) -> String {
    let Some(first) = budgets.first() else { return String::new() };
    let kinds: Vec<_> = first.kinds.iter().map(|(kind, _)| *kind).collect();
    let mut columns = vec![Align::Right; 5 + kinds.len()];
    columns.push(Align::Left);
    let mut table = Table::new(&columns);
    let names = kinds.iter().map(|kind| kind.name().to_owned());
    let head = ["mean".to_owned(), "most".to_owned()].into_iter().chain(names);
    table.row(head.chain(["wide", "lakes", "triangles", ""].map(str::to_owned)));
    for of in budgets {
        let metres = |kind| of.kinds.iter().find(|(other, _)| *other == kind).map_or([0.0; 2], |(_, metres)| *metres);
        let row = [of.mean, of.per_load_module].map(|count| grouped(count.into()));
        let lakes = if of.lakes[1] == 0 { "-".to_owned() } else { format!("{}/{}", of.lakes[0], of.lakes[1]) };
        let shares = kinds.iter().map(|kind| share(metres(*kind)));
        let own = if of.is_own { "(this job)" } else { "" };
        let last = [wide(of).unwrap_or("-".into()), lakes, grouped(of.triangles), own.into()];
        table.row(row.into_iter().chain(shares).chain(last));
    }
    format!(
        "\nWhat budgets would keep of features: triangles of a load module on average and at most; the kept share of \
         the length of each kind, and of main roads and rails in their width; lakes of 1 ha and more; triangles that \
         features take.\n{}",
        table.text(0)
    )
}

/// The same for a program.
pub fn table_json(budgets: &[Budgeted]) -> Value {
    let of = |budget: &Budgeted| {
        let kinds: serde_json::Map<String, Value> = budget
            .kinds
            .iter()
            .map(|(kind, [kept, all])| (kind.name().to_owned(), json!({ "kept_m": kept, "all_m": all })))
            .collect();
        json!({
            "mean_per_load_module": budget.mean,
            "per_load_module": budget.per_load_module,
            "per_4km_square": budget.per_window,
            "kinds": kinds,
            "main_in_width": { "kept_m": budget.wide_m[0], "all_m": budget.wide_m[1] },
            "lakes_of_1_ha": { "kept": budget.lakes[0], "all": budget.lakes[1] },
            "triangles": budget.triangles,
            "holds": budget.holds(),
            "is_own": budget.is_own,
        })
    };
    budgets.iter().map(of).collect()
}

/// What limits would keep of the objects of a job, up to the first that keeps nearly all, or more than which the limits
/// of the ground do not let in.
pub fn of_objects(job: &Job, features: Option<&Budgets>) -> Vec<ObjectBudget> {
    let budgets = match ObjectBudgets::open(job, features, resources::cores()) {
        Ok(Some(budgets)) => budgets,
        Ok(None) => return Vec::new(),
        Err(error) => {
            terminal::tell(&format!("note: what limits would keep of buildings and woods is not known: {error}"));
            return Vec::new();
        }
    };
    let mut tried: Vec<ObjectBudget> = Vec::new();
    for most in OBJECT_BUDGETS {
        let of = budgets.of(most);
        if job.counts_objects() && tried.last().is_some_and(|last| last.kinds == of.kinds) {
            break;
        }
        tried.push(of);
        if tried.last().is_some_and(ObjectBudget::holds) {
            break;
        }
    }
    tried
}

/// What limits would keep of objects, those of the job marked; empty where there are none.
pub fn objects_text(job: &Job, tried: &[ObjectBudget]) -> String {
    let Some(first) = tried.first() else { return String::new() };
    let mut table = Table::new(&vec![Align::Right; 2 + first.kinds.len()]);
    let names = first.kinds.iter().map(|sums| format!("{} ({})", sums.kind, grouped(sums.wanted)));
    table.row(["polygons".to_owned(), "in 4 km".to_owned()].into_iter().chain(names));
    for of in tried {
        let limits = [of.per_load_module, of.per_window].map(|count| grouped(count.into()));
        table.row(limits.into_iter().chain(of.kinds.iter().map(|sums| share([sums.kept_m2, sums.wanted_m2]))));
    }
    let own = job.objects.as_ref().map_or(0, |spec| spec.per_load_module);
    let joint = match job.counts_objects() && tried.last().is_some_and(|last| !last.holds()) {
        true => " They count in the limits of the ground, which hold back more: larger ones there keep it.",
        false => "",
    };
    format!(
        "\nWhat limits would keep of what objects hide: roofs, walls and triangles of woods in a load module and in a \
         square of 4 km; the kept share of the silhouette of each kind. This job has {} in a load module.{joint}\n{}",
        grouped(own.into()),
        table.text(0)
    )
}

/// The same for a program.
pub fn objects_json(tried: &[ObjectBudget]) -> Value {
    let kind = |sums: &ObjectSums| {
        json!({ "kind": sums.kind, "wanted": sums.wanted, "kept": sums.kept, "wanted_m2": sums.wanted_m2,
                "kept_m2": sums.kept_m2 })
    };
    let of = |budget: &ObjectBudget| {
        json!({ "per_load_module": budget.per_load_module, "per_4km_square": budget.per_window,
                "kinds": budget.kinds.iter().map(kind).collect::<Vec<_>>(), "holds": budget.holds() })
    };
    tried.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budgeted(mean: u32, is_own: bool) -> Budgeted {
        Budgeted {
            mean,
            per_load_module: 3 * mean,
            per_window: 128 * mean,
            kinds: Vec::new(),
            wide_m: [0.0; 2],
            lakes: [0; 2],
            triangles: u64::from(mean),
            is_own,
        }
    }

    #[test]
    fn the_budget_of_the_job_stands_in_its_place_and_is_marked() {
        let tried = |own: u32| {
            let all = [32, 64].map(|mean| budgeted(mean, mean == own)).to_vec();
            let all = with_own(all, Some(budgeted(own, true)));
            let text = table_text(&all);
            let marked: Vec<&str> = text.lines().filter(|line| line.ends_with("(this job)")).collect();
            assert!(marked.len() == 1 && marked[0].trim_start().starts_with(&own.to_string()), "{text}");
            all.iter().map(|of| of.mean).collect::<Vec<_>>()
        };
        assert_eq!([10, 50, 64, 100].map(tried), [vec![10, 32, 64], vec![32, 50, 64], vec![32, 64], vec![32, 64, 100]]);
    }
}
