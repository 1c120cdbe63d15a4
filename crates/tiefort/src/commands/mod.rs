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

/// What to do.
#[derive(Subcommand)]
pub enum Command {
    /// Write a job for the rasters you have
    Init(init::Arguments),
    /// List the heights of the Earth that are known by name
    Sources(sources::Arguments),
    /// Bring what a job names on other machines: only the tiles that it needs
    Fetch(fetch::Arguments),
    /// Compile a whole gaming area; what is published and fresh is kept
    Build(build::Arguments),
    /// Re-run one tile
    Tile(tile::Arguments),
    /// Show tiles, ranks, memory, time and disk before any work
    Plan(plan::Arguments),
    /// Do one unit of work of a build, for engines
    Task(task::Arguments),
    /// Take work from a shared folder until the build is done
    Worker(worker::Arguments),
    /// Show how far a database is, tile by tile
    Status(status::Arguments),
    /// Show what a build found: limits, residuals, breaches, times
    Report(report::Arguments),
    /// Draw it: relief, perspective, wireframe, residuals, density, limits, tiles
    Render(render::Arguments),
    /// Answer programs over HTTP: heights, lines of sight, load modules, terrain for globes
    Serve(serve::Arguments),
    /// Drive through it, in a browser on this machine
    View(view::Arguments),
    /// Tell what is seen from a place: another place, or all around
    Sight(sight::Arguments),
    /// Measure the ground along a line
    Profile(profile::Arguments),
    /// Explain one load module: what it holds, what was refused, what one more point would buy
    Explain(explain::Arguments),
    /// List the load modules in which two databases differ, and by how much
    Diff(diff::Arguments),
    /// Certify how well two databases, or a database and a raster, agree: heights, slopes, lines of sight
    Correlate(correlate::Arguments),
    /// Check every file and every load module of a database
    Verify(verify::Arguments),
    /// Measure how true a database is: residuals, line of sight, slope
    Fidelity(fidelity::Arguments),
    /// Write a database in another program's format: meshes, single load modules
    Export(export::Arguments),
    /// Show where a database is not good enough, and what could be done
    Inadequate(inadequate::Arguments),
    /// Write the built-in basin-and-range terrain as a GeoTIFF
    Sample(sample::Arguments),
    /// Make just a mesh from a raster
    Tin(tin::Arguments),
    /// Compare methods on a raster: points, residuals, equivalent points, times
    Compare(compare::Arguments),
    /// Print what makes a shell complete the words of this program
    Completions(completions::Arguments),
    /// Print the manual page of a command, or write all of them
    Man(man::Arguments),
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

    fn done(self) -> Result<Outcome, Failure> {
        match self {
            Command::Init(arguments) => init::run(&arguments),
            Command::Sources(arguments) => sources::run(&arguments),
            Command::Fetch(arguments) => fetch::run(&arguments),
            Command::Build(arguments) => build::run(&arguments),
            Command::Tile(arguments) => tile::run(&arguments),
            Command::Plan(arguments) => plan::run(&arguments),
            Command::Task(arguments) => task::run(&arguments),
            Command::Worker(arguments) => worker::run(&arguments),
            Command::Status(arguments) => status::run(&arguments),
            Command::Report(arguments) => report::run(&arguments),
            Command::Render(arguments) => render::run(&arguments),
            Command::Serve(arguments) => serve::run(&arguments),
            Command::View(arguments) => view::run(&arguments),
            Command::Sight(arguments) => sight::run(&arguments),
            Command::Profile(arguments) => profile::run(&arguments),
            Command::Explain(arguments) => explain::run(&arguments),
            Command::Diff(arguments) => diff::run(&arguments),
            Command::Correlate(arguments) => correlate::run(&arguments),
            Command::Verify(arguments) => verify::run(&arguments),
            Command::Fidelity(arguments) => fidelity::run(&arguments),
            Command::Export(arguments) => export::run(&arguments),
            Command::Inadequate(arguments) => inadequate::run(&arguments),
            Command::Sample(arguments) => sample::run(&arguments),
            Command::Tin(arguments) => tin::run(&arguments),
            Command::Compare(arguments) => compare::run(&arguments),
            Command::Completions(arguments) => completions::run(&arguments),
            Command::Man(arguments) => man::run(&arguments),
        }
    }
}
