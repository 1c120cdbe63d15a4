//! Prints what the reader makes of a raster, for comparison with another (`scripts/compare.py sources`).
//!
//! `read_posts FILE [EPSG:CODE]` writes one line of facts to stderr and every sample to stdout: 64-bit floats,
//! little-endian, northern row first as files have it, NaN where void. A refusal is a line that begins with `refused:`.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use source_files::{Crs, DemFile, Raster, Reading, SourceError};
use terrain::Post;

fn main() -> std::io::Result<()> {
    let path = std::env::args().nth(1).expect("give the path of a raster");
    let crs = std::env::args().nth(2).map(|name| Crs::named(&name).expect("a coordinate system"));
    match read(Path::new(&path), &Reading { crs, ..Reading::AS_IT_SAYS }) {
        Err(error) => eprintln!("refused: {error}\nhint: {}", error.hint().unwrap_or_else(|| "none".into())),
        Ok((file, raster, seconds)) => {
            let (frame, scale) = (file.frame(), file.sample_scale());
            eprintln!(
                "{} {} {} {} {} {} {} {} {} {} {} {} {}",
                frame.cols,
                frame.rows,
                frame.crs.epsg().unwrap_or(0),
                frame.south_west[0],
                frame.south_west[1],
                frame.spacing[0],
                frame.spacing[1],
                raster.void_count(),
                scale.scale,
                scale.offset,
                scale.unit_m,
                seconds,
                raster.notes().len()
            );
            std::io::stdout().write_all(&samples(&raster))?;
        }
    }
    Ok(())
}

fn read(path: &Path, reading: &Reading) -> Result<(DemFile, Raster, f64), SourceError> {
    let started = Instant::now();
    let file = DemFile::open(path, reading)?;
    let raster = file.read(file.rect())?;
    Ok((file, raster, started.elapsed().as_secs_f64()))
}

fn samples(raster: &Raster) -> Vec<u8> {
    let rect = raster.window();
    let rows = (rect.south..=rect.north).rev();
    let posts = rows.flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    posts.flat_map(|post| raster.sample(post).unwrap_or(f64::NAN).to_le_bytes()).collect()
}
