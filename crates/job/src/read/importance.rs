//! `[importance]`: where ground matters more.

use std::path::Path;

use terrain::THOUSANDTHS;

use crate::bounds::{AREAS_MAX, CLASSES_MAX, NAME_CHARS_MAX, WEIGHT_MAX};
use crate::entry::{Entry, Section};
use crate::files::{Mention, Place};
use crate::{AreaShape, DemSource, ImportanceArea, ImportanceSpec, JobError, SampleClass, Smooth};

/// What class 0 is called.
const DEFAULT_CLASS: &str = "default";

pub(super) fn read(
    importance: &Section,
    dem: &DemSource,
    job: &Path,
    mentions: &mut Vec<Mention>,
) -> Result<ImportanceSpec, JobError> {
    let default_weight = importance.optional("default").map_or(Ok(THOUSANDTHS), |entry| weight(&entry))?;
    let smooth = match importance.optional("smooth") {
        Some(entry) => entry.word(&[("binomial-7", Smooth::Binomial7), ("none", Smooth::None)])?,
        None => Smooth::Binomial7,
    };
    let mut spec = ImportanceSpec { default_weight, areas: vec![], classes: vec![DEFAULT_CLASS.to_owned()], smooth };
    let Some(areas) = importance.optional("areas") else { return Ok(spec) };
    let items = areas.list("a list of areas, each { file = … } or { raster = …, value = … } or { sample = … }")?;
    if AREAS_MAX < items.len() {
        return Err(areas.out_of_range(format!("at most {AREAS_MAX} areas")));
    }
    for item in &items {
        let table = item.table()?;
        let shape = shape(item, &table, dem, job)?;
        if let Some(file) = table.optional("file").or_else(|| table.optional("raster")) {
            let fault = file.fault("a file");
            mentions.push(Mention { place: Place::ImportanceArea(spec.areas.len()), fault });
        }
        let class = class(&table, &mut spec.classes)?;
        let entry = table.required("weight", "a weight from 0 to 65.535")?;
        spec.areas.push(ImportanceArea { shape, class, weight: weight(&entry)? });
    }
    Ok(spec)
}

/// A weight in thousandths.
fn weight(entry: &Entry) -> Result<u16, JobError> {
    let expected = format!("a weight from 0 to {WEIGHT_MAX}, in whole thousandths");
    let thousandths = entry.number_in(0.0..=WEIGHT_MAX, &expected)? * f64::from(THOUSANDTHS);
    // A decimal such as 0.001 is not exact in binary; what is meant is plain within a millionth.
    const SLACK: f64 = 1.0e-6;
    if SLACK < (thousandths - thousandths.round()).abs() {
        return Err(entry.out_of_range(expected));
    }
    Ok(thousandths.round() as u16)
}

const VALUE: &str = "the value of the class in the raster";

fn shape(item: &Entry, table: &Section, dem: &DemSource, job: &Path) -> Result<AreaShape, JobError> {
    let (file, raster) = (table.optional("file"), table.optional("raster"));
    let (value, sample) = (table.optional("value"), table.optional("sample"));
    match (file, raster, sample) {
        (Some(file), None, None) => match value {
            Some(value) => Err(value.conflict("file", "no value, since polygons have none", "value goes with raster")),
            None => polygons(&file, job),
        },
        (None, Some(raster), None) => {
            let value = table.required("value", VALUE)?.signed(VALUE)?;
            Ok(AreaShape::RasterValue { file: super::named_file(&raster, job)?, value })
        }
        (None, None, Some(sample)) => sample_class(&sample, dem),
        _ => Err(JobError::Conflict(
            item.fault("exactly one of file = \"x.geojson\", raster = \"x.tif\" with value, sample = \"mountains\""),
        )),
    }
}

fn polygons(entry: &Entry, job: &Path) -> Result<AreaShape, JobError> {
    Ok(AreaShape::Polygons { file: super::named_file(entry, job)? })
}

fn sample_class(entry: &Entry, dem: &DemSource) -> Result<AreaShape, JobError> {
    let class = entry.word(&[("mountains", SampleClass::Mountains)])?;
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
    let expected = format!("the name of a class, 1 to {NAME_CHARS_MAX} characters");
    let entry = table.required("class", &expected)?;
    let name = entry.text(&expected)?;
    if name.trim().is_empty() || NAME_CHARS_MAX < name.chars().count() || name.chars().any(char::is_control) {
        return Err(entry.out_of_range(expected));
    }
    let index = classes.iter().position(|class| class == name).unwrap_or_else(|| {
        classes.push(name.to_owned());
        classes.len() - 1
    });
    let most = format!("at most {CLASSES_MAX} classes besides the default one");
    u8::try_from(index).map_err(|_| entry.out_of_range(most))
}
