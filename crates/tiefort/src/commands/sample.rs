//! `tiefort sample`: the built-in terrain as a raster.

use std::path::PathBuf;

use build::workbench::Sample;
use clap::Args;
use terrain::Spacing;

use crate::failure::{Failure, Outcome};
use crate::{arguments, files};

const AFTER_HELP: &str = "\
Examples:
  tiefort sample --out sample.tif
  tiefort sample --posts 1001 --spacing 30 --seed 7 --out other.tif \\
      --classes classes.tif

The same seed gives the same terrain on any machine.";

/// Arguments of `sample`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Posts a side
    #[arg(long, value_name = "N", default_value_t = 2001, value_parser = clap::value_parser!(u32).range(2..=65_536))]
    posts: u32,
    /// Posts from south to north, where the raster is not to be square
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=65_536))]
    rows: Option<u32>,
    /// Metres between posts: a multiple of 1/16 m
    #[arg(long, value_name = "M", default_value = "25", value_parser = spacing)]
    spacing: Spacing,
    /// Which terrain
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Also write the raster of mountains (1) and plains (0)
    #[arg(long, value_name = "FILE")]
    classes: Option<PathBuf>,
    /// The GeoTIFF to write
    #[arg(long, value_name = "DEM.tif")]
    out: PathBuf,
}

fn spacing(text: &str) -> Result<Spacing, String> {
    let metres = arguments::positive(text)?;
    Spacing::from_metres(metres).ok_or("expected a multiple of 1/16 m, at most 1,000 km, such as 25 or 31.25".into())
}

/// Writes the rasters.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let Arguments { posts, rows, spacing, seed, classes, out } = arguments;
    if classes.as_ref() == Some(out) {
        let message = format!("{}: found the same file for --classes and --out, expected two", out.display());
        return Err(Failure::new(message, "give them different names"));
    }
    for path in [Some(out), classes.as_ref()].into_iter().flatten() {
        files::check_writable(path)?;
    }
    let size = (rows.unwrap_or(*posts) as usize, *posts as usize);
    let sample = Sample { seed: *seed, size, spacing: *spacing };
    files::write_whole(out, |out| sample.write_heights(out))?;
    if let Some(path) = classes {
        files::write_whole(path, |out| sample.write_classes(out))?;
    }
    Ok(Outcome::Sound)
}
