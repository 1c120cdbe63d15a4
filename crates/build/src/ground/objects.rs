//! Buildings, walls and woods of a job's sources, with what they are by their tags.

use std::collections::HashSet;

use features::objects::{FoundObject, FoundShape, OBJECT_KEYS, traits};
use job::{Job, ObjectsSpec};
use source_files::{Crs, FeatureFile, VectorFeature, VectorShape, Vertices, Wanted, is_feature_file};
use store::FeatureRemark;
use terrain::{Each, ObjectKind};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::canopy;
use crate::ground::vectors::{bad_crs, bounds, remark_of};

/// What the sources of objects hold that lies in the area or near it.
#[derive(Debug, Default)]
pub struct FoundObjects {
    /// The objects, source by source; what is none by rules and table is not among them.
    pub objects: Vec<FoundObject>,
    /// What could not be read of single ones.
    pub remarks: Vec<FeatureRemark>,
    /// What a person should know about the files, each behind the name of its file.
    pub notes: Vec<String>,
}

impl FoundObjects {
    /// Reads the objects of a job that has some; `each` runs what falls into pieces.
    ///
    /// # Errors
    /// When a file cannot be read at all. What is wrong with single objects is a remark.
    pub fn read(job: &Job, spec: &ObjectsSpec, area: &GamingArea, each: Each) -> Result<Self, GroundError> {
        let mut found = Self::default();
        for source in &spec.sources {
            let name = source.file.written.as_str();
            let crs = source
                .crs
                .as_deref()
                .map(|text| Crs::named(text).map_err(|found| bad_crs("objects.sources", name, &found)));
            let crs = crs.transpose()?;
            if !is_feature_file(&source.file.path) {
                let woods = canopy::woods(job, (spec, source), crs, area, each)?;
                if woods.is_empty() {
                    found.notes.push(format!("{name}: no leaves {} m high in the area", source.least_m));
                }
                found.objects.extend(woods);
                continue;
            }
            let mut keys: Vec<&str> = OBJECT_KEYS.into_iter().chain(spec.keys()).collect();
            keys.sort_unstable();
            keys.dedup();
            let wanted = Wanted {
                epsg: job.area.epsg,
                bounds: bounds(area, [area.frame.origin_east_m, area.frame.origin_north_m]),
                layer: source.layer.as_deref(),
                crs: crs.as_ref(),
                keys: &keys,
                buildings: false,
                points: true,
            };
            let FeatureFile { features, remarks, notes, .. } =
                source_files::read_features(&source.file.path, &wanted, each)?;
            found.notes.extend(notes.iter().map(|note| format!("{name}: {note}")));
            let before = found.objects.len();
            for feature in features {
                let said = (source.kind, source.height.as_deref());
                if let Some((traits, bad_tags)) = traits(|key| feature.tag(key), said, &spec.rules) {
                    let shape = shape_of(&feature, traits.kind, area);
                    found.objects.push(FoundObject { name: feature.id, traits, bad_tags, shape });
                }
            }
            if found.objects.len() == before {
                found.notes.push(format!("{name}: no building, wall or wood in the area"));
            }
            // Of what is no object nothing is told: ways without places in a file of roads are no concern of these.
            let names: HashSet<&str> = found.objects[before..].iter().map(|object| object.name.as_str()).collect();
            let own = remarks.into_iter().filter(|remark| names.contains(remark.id.as_str()));
            found.remarks.extend(own.map(remark_of));
        }
        Ok(found)
    }
}

/// In metres from the south-west post. A closed line is a polygon where only polygons are such objects: formats that
/// have lines only close them.
fn shape_of(feature: &VectorFeature, kind: ObjectKind, area: &GamingArea) -> FoundShape {
    let origin = [area.frame.origin_east_m, area.frame.origin_north_m];
    let ring = |line: &Vertices| -> Vec<[f64; 2]> {
        line.places.iter().map(|place| [0, 1].map(|axis| place[axis] - origin[axis])).collect()
    };
    match &feature.shape {
        VectorShape::Point(place) => FoundShape::Point([0, 1].map(|axis| place[axis] - origin[axis])),
        VectorShape::Polygon(rings) => FoundShape::Polygon(rings.iter().map(ring).collect()),
        VectorShape::Line(line) => {
            let is_closed = 3 < line.places.len() && line.places.first() == line.places.last();
            match is_closed && !matches!(kind, ObjectKind::Wall | ObjectKind::Row) {
                true => FoundShape::Polygon(vec![ring(line)]),
                false => FoundShape::Line(ring(line)),
            }
        }
    }
}
