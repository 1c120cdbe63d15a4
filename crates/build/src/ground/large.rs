//! Rasters that are too large to hold: each is looked at once, chunk by chunk, and read by window from then on.

use std::sync::atomic::AtomicBool;

use job::{Job, Resampling, SourceFile, Voids};
use schedule::Workers;
use source_files::{DemFile, Look, Reach, SourceError, WideMosaic, Windows, edge_steps_by_window, window_under};
use terrain::PostRect;

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::datums::{datum_of, judge_datums};
use crate::ground::source::{
    Decoded, Source, area_crs, mosaic_rules, nothing_reaches, raised, reading, told, warnings_of,
};

/// Bytes that rasters may take under an area and still be decoded whole.
pub const WHOLE_BYTES_MAX: u64 = 96 << 20;
/// Bytes of decoded strips and tiles that are kept otherwise: two rows of tiles of an area 40,001 posts wide.
pub const CACHE_BYTES_MAX: u64 = 128 << 20;

/// What a job names, opened, with the part that lies under the area.
struct Reaching<'a> {
    named: &'a SourceFile,
    file: DemFile,
    window: PostRect,
}

/// The sources of a job whose rasters take more than `whole_bytes_max` under the area; `None` where they do not.
///
/// # Errors
/// When one cannot be used for this area.
pub fn open(
    job: &Job,
    area: &GamingArea,
    files: &[SourceFile],
    (workers, stop): (&Workers, &AtomicBool),
    whole_bytes_max: u64,
) -> Result<Option<Decoded<Source>>, GroundError> {
    // A system that cannot be computed is enough for a raster in that very system, held whole.
    let Ok(crs) = area_crs(job) else { return Ok(None) };
    let (mut reaching, mut warnings) = (Vec::new(), Vec::new());
    for named in files {
        let file = DemFile::open(&named.path, &reading(named, job.dem.strict)?)?;
        match file.window_reaching(&crs, &area.frame, area.rect) {
            Some(window) => reaching.push(Reaching { named, file, window }),
            None => warnings.push(format!("{}: it lies outside the area and is not used", named.path.display())),
        }
    }
    if reaching.iter().map(|one| one.file.bytes_of(one.window)).sum::<u64>() <= whole_bytes_max {
        return Ok(None);
    }
    let (mut used, mut datums, mut accuracy_m, mut all) = (Vec::new(), Vec::new(), None, Look::default());
    let (mut ranges_m, mut reached_m) = (Vec::new(), Vec::new());
    for (index, one) in reaching.iter().enumerate() {
        let look = look(one, &one.file.reach(&crs, &area.frame, area.rect), workers, stop)?;
        if look.voids == look.posts {
            let path = one.named.path.display();
            warnings.push(format!("{path}: all its posts in the area are void, so it is not used"));
            all.posts += look.posts;
            continue;
        }
        warnings.append(&mut warnings_of(one.file.frame(), look.range_m, &look.notes));
        accuracy_m = [accuracy_m, one.file.accuracy_m()].into_iter().flatten().reduce(f64::max);
        datums.push((one.named, datum_of(one.named, &one.file)));
        // What is not all void has a range.
        let range_m = look.range_m.unwrap_or((0.0, 0.0));
        ranges_m.push(Some(range_m));
        reached_m.push(look.reached_m);
        all.add(Look { notes: Vec::new(), ..look });
        used.push((index, range_m.0));
    }
    match reaching.as_slice() {
        _ if !used.is_empty() => {}
        [one] => return Err(SourceError::AllVoid { path: one.named.path.clone(), found: all.posts }.into()),
        _ => return Err(nothing_reaches()),
    }
    let judged = judge_datums(job, area, &datums)?;
    drop(datums);
    warnings.extend(judged.warnings);
    let is_alone = judged.shifts.iter().all(Option::is_none) && is_alone(job, area, &reaching, &all)?;
    let [range_m, under_m] = [ranges_m, reached_m].map(|ranges_m| raised(ranges_m, &judged.shifts, (area, &crs)));
    for (&(index, _), shift) in used.iter().zip(judged.shifts) {
        reaching[index].file.set_shift(shift);
    }
    let windows = Windows::new(reaching.into_iter().map(|one| one.file).collect(), CACHE_BYTES_MAX);
    let source = match is_alone {
        true => Source::Window(Box::new(windows)),
        false => {
            let place = (&crs, &area.frame, area.rect);
            let steps =
                edge_steps_by_window(&windows, used.iter().map(|&(file, _)| file), place, 0.0 < job.dem.feather_m);
            let frame = |place: usize| windows.files()[used[place].0].frame();
            warnings.extend(steps.iter().filter_map(|step| told(step, frame)));
            Source::Wide(Box::new(WideMosaic::new(windows, &used, mosaic_rules(job), place)?))
        }
    };
    Ok(Some(Decoded { source, warnings, accuracy_m, range_m, under_m }))
}

/// Whether there is one raster, on the area's own system, whose posts need no projecting and none of which is void.
fn is_alone(job: &Job, area: &GamingArea, reaching: &[Reaching], look: &Look) -> Result<bool, GroundError> {
    let [one] = reaching else { return Ok(false) };
    if job.dem.resampling == Resampling::Cubic || one.file.frame().require_epsg(job.area.epsg).is_err() {
        return Ok(false);
    }
    if job.dem.voids == Voids::Fail
        && let Some(first) = &look.first_void
    {
        let (path, found, first) = (one.named.path.clone(), look.voids, first.clone());
        return Err(SourceError::Voids { path, found, first }.into());
    }
    match window_under(one.file.frame(), &area.frame, area.rect) {
        Err(SourceError::NotCovered { .. }) if matches!(job.dem.voids, Voids::Hole | Voids::FillThenHole(_)) => {
            Ok(false)
        }
        Err(error) => Err(error.into()),
        Ok(_) => Ok(look.voids == 0),
    }
}

/// Looks at every post of a raster under the area, on all workers.
fn look(one: &Reaching, reach: &Reach, workers: &Workers, stop: &AtomicBool) -> Result<Look, GroundError> {
    const PARTS_A_WORKER: usize = 16;
    let chunks = one.file.chunks_of(one.window);
    let parts: Vec<&[u32]> = chunks.chunks(chunks.len().div_ceil(PARTS_A_WORKER * workers.count()).max(1)).collect();
    let looks = schedule::for_each_independent(&parts, workers, stop, |_, part| {
        one.file.look(one.window, Some(reach), part).map_err(GroundError::from)
    });
    let looks = looks.map_err(|error| GroundError::from_schedule(&[], error))?;
    let mut all = Look::default();
    looks.into_iter().for_each(|look| all.add(look));
    Ok(all)
}
