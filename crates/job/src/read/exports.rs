//! `[exports]`: what exports call materials.

use terrain::{MaterialName, OBJECT_MATERIALS};

use crate::entry::{Entry, Section};
use crate::keys::nearest;
use crate::{Fault, JobError};

/// Names of materials; `classes` are the job's.
pub(super) fn read(exports: &Section, classes: &[String]) -> Result<Vec<MaterialName>, JobError> {
    let Some(entry) = exports.optional("materials") else { return Ok(Vec::new()) };
    let known: Vec<&str> = classes.iter().map(String::as_str).chain(OBJECT_MATERIALS).collect();
    let material = |(of, entry): (String, Entry)| {
        if !known.contains(&of.as_str()) {
            let hint = match nearest(&of, &known) {
                Some(name) => format!("did you mean \"{name}\"?"),
                None => format!("they are {}", known.join(", ")),
            };
            let found = "a material that nothing is of".to_owned();
            let fault = entry.fault("the name of a class, or of a material of objects");
            return Err(JobError::UnknownKey(Box::new(Fault { found, hint, ..*fault })));
        }
        let table = if entry.is_table() { Some(entry.table()?) } else { None };
        let name = match &table {
            Some(table) => table.required("name")?,
            None => entry,
        };
        let code = |key: &str| -> Result<Option<u16>, JobError> {
            let entry = table.as_ref().and_then(|table| table.optional(key));
            entry.map(|entry| entry.whole().map(|code| code as u16)).transpose()
        };
        let (surface_code, feature_id) = (code("surface_code")?, code("feature_id")?);
        Ok(MaterialName { of, name: name.name("formats have room for no other names")?, surface_code, feature_id })
    };
    entry.items()?.into_iter().map(material).collect()
}
