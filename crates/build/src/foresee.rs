//! What a build would refuse, told before any height is decoded.

use std::path::Path;

use crate::ground::GamingArea;
use job::Job;
use store::Database;

use crate::CompileError;
use crate::publish::database_area;

/// Opens what a job names and judges what headers tell, in the order of a build, and last the place of the database.
/// What a person should know, in words.
///
/// # Errors
/// What a build would say, where no height has to be decoded to know it.
pub fn foresee(job: &Job, folder: &Path) -> Result<Vec<String>, CompileError> {
    let told = crate::ground::foresee(job, &GamingArea::new(job)?)?;
    Database::foresee(folder, &database_area(job))?;
    Ok(told)
}
