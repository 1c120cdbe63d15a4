//! The commands, one file each: its arguments, its help, and what it calls.

pub mod budgets;
mod build;
pub mod compare;
mod completions;
pub mod correlate;
mod diff;
pub mod explain;
pub mod export;
mod export_formats;
mod export_together;
mod fetch;
mod fidelity;
mod inadequate;
mod init;
mod init_around;
mod init_features;
mod init_files;
mod init_limits;
mod job_words;
mod man;
pub mod plan;
mod profile;
mod render;
mod report;
mod sample;
mod serve;
mod sight;
mod sources;
mod status;
mod task;
pub mod tile;
pub mod tin;
mod verify;
mod view;
mod worker;

use std::path::Path;

use clap::Subcommand;

use crate::failure::{Failure, Outcome};

/// Declares the commands, each with the line that help has for it.
macro_rules! commands {
    ($($name:ident($module:ident), $help:literal;)*) => {
        /// What to do.
        #[derive(Subcommand)]
        pub enum Command {
            $(#[doc = $help] $name($module::Arguments)),*
        }

        impl Command {
            fn done(self) -> Result<Outcome, Failure> {
                match self {
                    $(Command::$name(arguments) => $module::run(&arguments)),*
                }
            }
        }
    };
}

commands! {
    Init(init), "Write a job for the rasters you have";
    Sources(sources), "List the heights of the Earth that are known by name";
    Fetch(fetch), "Bring what a job names on other machines: only the tiles that it needs";
    Build(build), "Compile a whole gaming area; what is published and fresh is kept";
    Tile(tile), "Re-run one tile";
    Plan(plan), "Show tiles, ranks, memory, time and disk before any work";
    Task(task), "Do one unit of work of a build, for engines";
    Worker(worker), "Take work from a shared folder until the build is done";
    Status(status), "Show how far a database is, tile by tile";
    Report(report), "Show what a build found: limits, residuals, breaches, times";
    Render(render), "Draw it: relief, perspective, wireframe, residuals, density, limits, tiles";
    Serve(serve), "Answer programs over HTTP: heights, lines of sight, load modules, terrain for globes";
    View(view), "Drive through it, in a browser on this machine";
    Sight(sight), "Tell what is seen from a place: another place, or all around";
    Profile(profile), "Measure the ground along a line";
    Explain(explain), "Explain one load module: what it holds, what was refused, what one more point would buy";
    Diff(diff), "List the load modules in which two databases differ, and by how much";
    Correlate(correlate), "Certify how well two databases, or a database and a raster, agree: heights, slopes, \
        lines of sight";
    Verify(verify), "Check every file and every load module of a database";
    Fidelity(fidelity), "Measure how true a database is: residuals, line of sight, slope";
    Export(export), "Write a database in another program's format: meshes, single load modules";
    Inadequate(inadequate), "Show where a database is not good enough, and what could be done";
    Sample(sample), "Write the built-in basin-and-range terrain as a GeoTIFF";
    Tin(tin), "Make just a mesh from a raster";
    Compare(compare), "Compare methods on a raster: points, residuals, equivalent points, times";
    Completions(completions), "Print what makes a shell complete the words of this program";
    Man(man), "Print the manual page of a command, or write all of them";
}

impl Command {
    /// Does it.
    ///
    /// # Errors
    /// Why it could not be done, for a person to read.
    pub fn run(self) -> Result<Outcome, Failure> {
        let job = self.job().map(Path::to_owned);
        self.done().map_err(|failure| job.iter().fold(failure, |failure, job| failure.in_job(job)))
    }

    /// The job that it works by, if it does.
    fn job(&self) -> Option<&Path> {
        match self {
            Command::Build(arguments) => Some(&arguments.job),
            Command::Tile(arguments) => Some(&arguments.job),
            Command::Plan(arguments) => Some(&arguments.job),
            Command::Task(arguments) => Some(&arguments.job),
            Command::Worker(arguments) => Some(&arguments.job),
            _ => None,
        }
    }
}
