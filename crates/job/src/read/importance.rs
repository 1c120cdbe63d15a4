//! `[importance]`: where ground matters more.

use std::path::Path;

use terrain::{HOLE_CLASS, THOUSANDTHS};

use crate::bounds::{AREAS_MAX, CLASSES_MAX, SLOPE_PERCENT_MAX, WEIGHT_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{AreaShape, DemSource, HOLE_CLASS_NAME, ImportanceArea, ImportanceSpec, JobError, WaterSpec};

/// What class 0 is called.
const DEFAULT_CLASS: &str = "default";
/// What the class of water is called, unless the job says otherwise.
const WATER_CLASS: &str = "water";

pub(super) fn read(
    importance: &Section,
    dem: &DemSource,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<ImportanceSpec, JobError> {
    let usual = importance.number("default")? * f64::from(THOUSANDTHS);
    let default_weight = importance.optional("default").map_or(Ok(usual as u16), |entry| weight(&entry))?;
    let smooth = importance.word("smooth")?;
    let mut spec = ImportanceSpec { default_weight, areas: vec![], classes: vec![DEFAULT_CLASS.to_owned()], smooth };
    let Some(areas) = importance.optional("areas") else { return Ok(spec) };
    for item in &areas.items_of(0..=AREAS_MAX)? {
        let table = item.table()?;
        let shape = shape(item, &table, dem, job)?;
        if let Some(file) = table.optional("file").or_else(|| table.optional("raster")) {
            let fault = file.fault("a file");
            mentions.push(Mention { place: Place::ImportanceArea(spec.areas.len()), fault });
        }
        let class = class(&table, &mut spec.classes)?;
        spec.areas.push(ImportanceArea { shape, class, weight: weight(&table.required("weight")?)? });
    }
    Ok(spec)
}

/// A weight in thousandths.
fn weight(entry: &Entry) -> Result<u16, JobError> {
    let weight = entry.number()?;
    let thousandths = weight * f64::from(THOUSANDTHS);
    // A decimal such as 0.001 is not exact in binary; what is meant is plain within a millionth.
    const SLACK: f64 = 1.0e-6;
    if !(0.0..=WEIGHT_MAX).contains(&weight) || SLACK < (thousandths - thousandths.round()).abs() {
        return Err(entry.out_of_range(entry.expected()));
    }
    Ok(thousandths.round() as u16)
}

fn shape(item: &Entry, table: &Section, dem: &DemSource, job: &Path) -> Result<AreaShape, JobError> {
    let (file, raster) = (table.optional("file"), table.optional("raster"));
    let (value, sample) = (table.optional("value"), table.optional("sample"));
    if let Some(above) = table.optional("slope_above_percent") {
        return match file.or(raster).or(sample).or(value).or(table.optional("level_m")) {
            None => slope(&above, table),
            Some(other) => Err(other.conflict("slope_above_percent", "one of the two", "remove one of the two")),
        };
    }
    if let Some(level) = table.optional("level_m") {
        return match file.or(raster).or(sample).or(value) {
            None => Ok(AreaShape::Level { height_mm: (level.number()? * 1000.0).round() as i32 }),
            Some(other) => Err(other.conflict("level_m", "one of the two", "remove one of the two")),
        };
    }
    if let Some(smooth) = table.optional("smooth_m") {
        let hint = "smooth_m goes with slope_above_percent";
        return Err(smooth.conflict("no slope", "no radius, since there are no slopes to average", hint));
    }
    match (file, raster, sample) {
        (Some(file), None, None) => match value {
            Some(value) => Err(value.conflict("file", "no value, since polygons have none", "value goes with raster")),
            None => Ok(AreaShape::Polygons { file: file.file(job)? }),
        },
        (None, Some(raster), None) => {
            let value = table.required("value")?.signed()?;
            Ok(AreaShape::RasterValue { file: raster.file(job)?, value })
        }
        (None, None, Some(sample)) => sample_class(&sample, dem),
        _ => Err(JobError::Conflict(item.fault(
            "exactly one of file = \"x.geojson\", raster = \"x.tif\" with value, sample = \"mountains\", \
             slope_above_percent = 20, level_m = 0",
        ))),
    }
}

/// Ground steeper than so much, on the mean of what lies within a radius.
fn slope(above: &Entry, table: &Section) -> Result<AreaShape, JobError> {
    let thousandths = (above.number()? * 1000.0).round();
    if !(1.0 <= thousandths && thousandths <= SLOPE_PERCENT_MAX * 1000.0) {
        return Err(above.out_of_range(above.expected()));
    }
    let millimetres = (table.required("smooth_m")?.number()? * 1000.0).round();
    Ok(AreaShape::Slope { above: thousandths as u32, smooth_mm: millimetres as u32 })
}

/// `dem.water`: what it is to lie at belongs to the heights, its class to the mask.
pub(super) fn water(
    dem: &Section,
    spec: &mut ImportanceSpec,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<Option<WaterSpec>, JobError> {
    let Some(entry) = dem.optional("water") else { return Ok(None) };
    mentions.push(Mention { place: Place::Water, fault: entry.fault("a file of polygons") });
    if !entry.is_table() {
        let (file, class) = (entry.file(job)?, class_index(&entry, WATER_CLASS, &mut spec.classes)?);
        return Ok(Some(WaterSpec { file, level_m: None, class, weight: None }));
    }
    let table = entry.table()?;
    let file = table.required("file")?.file(job)?;
    let level_m = table.maybe("level_m", Entry::number)?;
    let class = match table.optional("class") {
        Some(_) => class(&table, &mut spec.classes)?,
        None => class_index(&entry, WATER_CLASS, &mut spec.classes)?,
    };
    let weight = table.maybe("weight", weight)?;
    Ok(Some(WaterSpec { file, level_m, class, weight }))
}

fn sample_class(entry: &Entry, dem: &DemSource) -> Result<AreaShape, JobError> {
    let class = entry.word()?;
    match dem {
        DemSource::Sample { .. } => Ok(AreaShape::Sample(class)),
        DemSource::Files { .. } => Err(entry.conflict(
            "dem.sources",
            "file or raster, since only the sample terrain knows its mountains",
            "draw them as polygons: { file = \"mountains.geojson\", class = \"mountains\", weight = 1 }",
        )),
    }
}

/// The index of the area's class; a name not met before gets the next one.
fn class(table: &Section, classes: &mut Vec<String>) -> Result<u8, JobError> {
    let entry = table.required("class")?;
    class_index(&entry, &entry.prose(char::is_control)?, classes)
}

fn class_index(entry: &Entry, name: &str, classes: &mut Vec<String>) -> Result<u8, JobError> {
    if name == HOLE_CLASS_NAME {
        let hint = "ground without heights has the class \"hole\", whatever the job says";
        return Err(entry.out_of_range_with("another name for a class of the job", hint));
    }
    let index = classes.iter().position(|class| class == name).unwrap_or_else(|| {
        classes.push(name.to_owned());
        classes.len() - 1
    });
    let most = format!("at most {CLASSES_MAX} classes besides the default one");
    u8::try_from(index).ok().filter(|&index| index < HOLE_CLASS).ok_or_else(|| entry.out_of_range(most))
}
