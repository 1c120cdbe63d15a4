//! What `build` and `tile` share: the announcement, listening, and the end, with its report.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use compiler::{Built, CompileError, Options, Plan, Stage};
use database::{Database, Folder, Lease, Report, ReportStage, Work, files};
use job::Job;
use product::{Opened, Product, Wanted, WantedGround};
use serde_json::json;
use views::{Align, BreachPlaces, Table, breaches_csv, breaches_geojson};

use crate::arguments::{Log, RunArguments};
use crate::clock::timed;
use crate::end_table::{End, end_table};
use crate::estimate::Estimate;
use crate::events;
use crate::failure::{Failure, Outcome};
use crate::progress::{Listener, Show, Times};
use crate::signals::{self, Signals};
use crate::{lines, terminal};

/// A run of the compiler on a job, as a person follows it.
#[derive(Debug)]
pub struct Run<'a> {
    job: &'a Job,
    arguments: &'a RunArguments,
    folder: PathBuf,
    workers: usize,
    /// Whether other processes do the rest: then there is no board to show, and every tile is told.
    is_part: bool,
    /// What is forecast of it; none where the job cannot be planned, which the run itself says.
    plan: Option<Plan>,
    signals: Signals,
    /// What a process that shares the directory holds, to be given up if it has to end.
    lease: Arc<Mutex<Option<Lease>>>,
}

/// What came of a run, before times are known.
#[derive(Debug)]
pub struct Finished {
    /// Its report, without stages.
    pub report: Report,
    /// The database, still locked.
    pub database: Database,
    /// What the processes of a shared run left for one another.
    pub work: Option<Work>,
    /// Which tiles were built and which kept, in words.
    pub tiles: String,
    /// Whether nothing had to be done, so that the report is the one of the build before.
    pub is_unchanged: bool,
}

impl From<Built> for Finished {
    fn from(built: Built) -> Self {
        let tiles = format!("{} built, {} kept", built.rebuilt, built.kept);
        let Built { report, database, work, is_unchanged, .. } = built;
        Self { report, database, work, tiles, is_unchanged }
    }
}

impl<'a> Run<'a> {
    /// Announces the run in a line; with `-v` every setting with its value and meaning, too.
    ///
    /// # Errors
    /// When signals cannot be watched.
    pub fn announce(job: &'a Job, arguments: &'a RunArguments, what: &str) -> Result<Self, Failure> {
        let (run, remark) = Self::new(job, arguments, false)?;
        if matches!(run.show(), Show::Progress | Show::Verbose) {
            let (version, workers) = (env!("CARGO_PKG_VERSION"), run.workers);
            let (path, folder) = (job.path.display(), run.folder.display());
            terminal::tell(&format!("tiefort {version}: {what} {path} into {folder}, {workers} workers"));
            remark.iter().for_each(|remark| terminal::tell(&format!("note: {remark}")));
        }
        if run.show() == Show::Verbose {
            terminal::tell(&format!("\n{}", settings_text(job)));
        }
        Ok(run)
    }

    /// Announces a part of a build in one line.
    ///
    /// # Errors
    /// When signals cannot be watched.
    pub fn announce_briefly(job: &'a Job, arguments: &'a RunArguments, what: &str) -> Result<Self, Failure> {
        let (run, _) = Self::new(job, arguments, true)?;
        if matches!(run.show(), Show::Progress | Show::Verbose) {
            let (path, folder) = (job.path.display(), run.folder.display());
            terminal::tell(&format!("tiefort {}: {what} of {path} in {folder}", env!("CARGO_PKG_VERSION")));
        }
        Ok(run)
    }

    fn new(job: &'a Job, arguments: &'a RunArguments, is_part: bool) -> Result<(Self, Option<String>), Failure> {
        let (workers, remark) = arguments.workers.for_job(job);
        let (folder, signals) = (arguments.folder(job), Signals::watch()?);
        let plan = compiler::plan(job).ok();
        Ok((Self { job, arguments, folder, workers, is_part, plan, signals, lease: Arc::default() }, remark))
    }

    /// Where the database lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What the compiler is told.
    pub fn options(&self, fresh: bool) -> Options<'_> {
        Options { workers: self.workers, fresh, stop: self.signals.stop() }
    }

    /// Keeps in mind which lease this process holds.
    pub fn hold(&self, lease: Option<Lease>) {
        *self.lease.lock().unwrap_or_else(PoisonError::into_inner) = lease;
    }

    /// Runs `work` while someone listens; what it gives, and where the time went.
    ///
    /// # Errors
    /// Why the compiler ended early.
    pub fn listen<T>(
        &self,
        work: impl FnOnce(&mut Listener) -> Result<T, CompileError>,
    ) -> Result<(T, Times), Failure> {
        let tiles = (self.job.tiles.rows, self.job.tiles.columns);
        let estimate = match &self.plan {
            Some(plan) => Estimate::of_build(plan, self.workers),
            None => Estimate::of_one_stage(Stage::Refine),
        };
        let mut listener = Listener::start(self.show(), tiles, self.workers, estimate);
        let (place, lease) = (listener.place(), Arc::clone(&self.lease));
        self.signals.end_in_time(move || {
            // Others may have what is given up at once; if that fails, the lease expires.
            let held = lease.lock().unwrap_or_else(PoisonError::into_inner).take();
            let _ = held.map(Lease::give_up);
            signals::stopped(&place.lock().unwrap_or_else(PoisonError::into_inner).words())
        });
        let worked = work(&mut listener);
        let times = listener.finish();
        // From here on this thread says how the process ends.
        self.signals.tell_once(|| {});
        let worked = worked.map_err(|error| Failure::of_compiler(&error, self.signals.exit_code()))?;
        Ok((worked, times))
    }

    /// Runs `work` while someone listens, then writes the report and tells the end.
    ///
    /// # Errors
    /// Why the compiler ended early, or the report could not be written.
    pub fn finish(
        &self,
        work: impl FnOnce(&mut Listener) -> Result<Finished, CompileError>,
    ) -> Result<Outcome, Failure> {
        let (finished, times) = self.listen(work)?;
        self.conclude(finished, times)
    }

    /// Writes the report of a run, unless nothing was done, and tells the end.
    ///
    /// # Errors
    /// When the report cannot be written.
    pub fn conclude(&self, finished: Finished, times: Times) -> Result<Outcome, Failure> {
        let Finished { mut report, database, work, tiles, is_unchanged } = finished;
        let mut drawn: Option<ReportStage> = None;
        if !is_unchanged {
            report.stages = times.stages;
            report.tiles = times.tiles;
            let places = places(self.job);
            let breaches = [
                (files::BREACHES, breaches_geojson(&report, &places)),
                (files::BREACHES_CSV, breaches_csv(&report, &places)),
            ];
            for (name, text) in breaches {
                let stamp = database.write_bytes(name, text.as_bytes())?;
                report.files.insert(name.to_owned(), stamp);
            }
            database.write_json(files::REPORT, &report)?;
            // With the report other processes take the build for done; so nothing that takes long comes before this.
            // Of a build of another job that has begun already nothing is removed.
            if let Some(work) = &work {
                work.sweep();
            }
            let (written, page) = timed("page", || self.write_page(&database, &report));
            written?;
            drawn = (!self.arguments.no_html).then_some(page);
        }
        let outcome = self.judge(&report);
        match self.show() {
            Show::Nothing => {}
            Show::Json => events::print_line(&json!({
                "event": "summary",
                "database": self.folder.display().to_string(),
                "exit_code": outcome.code(),
                "unchanged": is_unchanged,
                "report": report,
            })),
            Show::JsonLog => {
                terminal::tell_json(&json!({ "event": "end", "exit_code": outcome.code(), "unchanged": is_unchanged,
                         "database": self.folder.display().to_string(), "at_s": times.seconds }))
            }
            Show::Progress | Show::Verbose if is_unchanged => terminal::tell(&format!(
                "nothing changed: all {} tiles in {} are fresh, so nothing was done ({:.2} s)",
                self.job.tiles.rows * self.job.tiles.columns,
                self.folder.display(),
                times.seconds
            )),
            Show::Progress | Show::Verbose => {
                let seconds = times.seconds + drawn.as_ref().map_or(0.0, |page| page.wall_s);
                drawn.iter().for_each(|page| terminal::tell(&lines::end_line(page, "", self.workers)));
                // The report was on the disk before its page was drawn, so only this table has the page's time.
                report.stages.extend(drawn);
                let end = End { report: &report, tiles: &tiles, folder: &self.folder, seconds };
                terminal::tell(&end_table(&end));
            }
        }
        Ok(outcome)
    }

    /// The report for people to look at, beside `report.json`.
    fn write_page(&self, database: &Database, report: &Report) -> Result<(), Failure> {
        if self.arguments.no_html {
            // That of an earlier build would tell of another one.
            database.remove(files::REPORT_HTML)?;
            return Ok(());
        }
        let page = self.page(database.folder(), report)?;
        database.write_bytes(files::REPORT_HTML, page.as_bytes())?;
        Ok(())
    }

    /// With the ground and with maps as far as the area is not too large for them.
    fn page(&self, folder: &Folder, report: &Report) -> Result<String, Failure> {
        let opened = Opened::open(folder.dir())?;
        let grid = opened.area.grid;
        if compiler::PAGE_MODULES_MAX < grid.count() {
            return Ok(product::page_without_maps(&opened, report));
        }
        let workers = self.arguments.workers.count();
        let read = |ground| Product::of(&opened, &Wanted { part: None, ground, workers });
        let is_small = grid.area().post_count() <= compiler::PAGE_POSTS_MAX;
        let ground = if is_small { WantedGround::Job(self.job) } else { WantedGround::None };
        // A source may have gone since the build ended, which is finished all the same.
        let product = read(ground).or_else(|_| read(WantedGround::None))?;
        Ok(product::page(&product, report))
    }

    fn show(&self) -> Show {
        let RunArguments { json, quiet, verbose, log, .. } = self.arguments;
        match (json, quiet, log) {
            (true, ..) => Show::Json,
            (_, true, _) => Show::Nothing,
            (.., Some(Log::Json)) => Show::JsonLog,
            _ if *verbose || self.is_part => Show::Verbose,
            _ => Show::Progress,
        }
    }

    fn judge(&self, report: &Report) -> Outcome {
        let (breached, warned) = (!report.breaches.is_empty(), !report.warnings.is_empty());
        match self.arguments.strict {
            true if breached || warned => Outcome::Damaged,
            _ if breached => Outcome::Breaches,
            _ => Outcome::Sound,
        }
    }
}

/// Every setting of `job` by the section of the job file it stands in: key, value, meaning.
pub fn settings_text(job: &Job) -> String {
    /// Columns of a value that its meaning still lines up behind.
    const VALUE_COLUMNS: usize = 18;
    let mut sections: Vec<(&str, Table)> = Vec::new();
    for setting in job.describe() {
        let (section, key) = setting.key.split_once('.').unwrap_or(("", setting.key));
        if sections.last().is_none_or(|(last, _)| *last != section) {
            sections.push((section, Table::new(&[Align::Left, Align::Left, Align::Left])));
        }
        let (_, table) = sections.last_mut().expect("one was just added if there was none");
        if setting.value.chars().count() <= VALUE_COLUMNS {
            table.row([key, &setting.value, &setting.meaning]);
        } else {
            // A long value would push all meanings to the right.
            table.row([key, "", &setting.meaning]);
            table.row(["", "", &format!("= {}", setting.value)]);
        }
    }
    sections.iter().map(|(section, table)| format!("  [{section}]\n{}", table.text(2))).collect()
}

/// Where the load modules and windows of `job` lie.
fn places(job: &Job) -> BreachPlaces {
    let (area, window) = (&job.area, &job.limits.window);
    BreachPlaces {
        origin_m: area.origin_m,
        module_side_m: job.modules.side_m,
        modules: [area.grid.rows, area.grid.cols],
        window: [window.rows, window.cols],
        epsg: area.epsg,
    }
}
