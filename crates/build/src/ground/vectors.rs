//! Roads, rivers and lakes of a job's sources, in posts of its working grid.

use std::sync::Arc;

use features::{FeatureId, Numbering, Position, Shape, Site, Source};
use job::{DemSource, FeatureSource, FeaturesSpec, Job};
use sample_terrain::SampleShape;
use source_files::{
    BUILT_IN_KEYS, Crs, Done, Extent, FeatureFile, Remark, VectorFeature, VectorShape, Vertices, Wanted,
};
use store::Building;
use store::FeatureRemark;
use terrain::{Each, GridFrame};

use crate::ground::GroundError;
use crate::ground::area::GamingArea;
use crate::ground::buildings;

/// What the sources of features hold that lies in the area or near it.
pub struct Vectors {
    /// The features, none of them looked at yet, source by source.
    pub sources: Vec<Source>,
    /// Buildings, which are drawn only, where the job wants them; sorted, each once.
    pub buildings: Vec<Building>,
    /// What each source holds, in the order of the job.
    pub files: Vec<FeaturesRead>,
    /// What could not be read of single features.
    pub remarks: Vec<FeatureRemark>,
    /// What a person should know about the files, each behind the name of its file.
    pub notes: Vec<String>,
    names: Vec<Vec<String>>,
}

/// What one source of features holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeaturesRead {
    /// The source, as the job writes it, with its layer.
    pub name: String,
    /// Its lines and polygons; of OpenStreetMap data those with a key that the table of kinds looks at.
    pub found: u64,
    /// Of these, those that lie outside the area and one load module around it.
    pub outside: u64,
    /// Remarks on single features.
    pub remarks: usize,
}

impl Vectors {
    /// Reads the features of a job; there are none where it has no section for them. `each` runs what falls
    /// into pieces.
    ///
    /// # Errors
    /// When a file cannot be read at all. What is wrong with single features is a remark.
    pub fn read(job: &Job, area: &GamingArea, each: Each) -> Result<Self, GroundError> {
        let mut vectors = Self {
            sources: Vec::new(),
            buildings: Vec::new(),
            files: Vec::new(),
            remarks: Vec::new(),
            notes: Vec::new(),
            names: Vec::new(),
        };
        let Some(spec) = &job.features else { return Ok(vectors) };
        for source in &spec.sources {
            match source {
                FeatureSource::Sample => vectors.add_sample(job, area),
                FeatureSource::File { .. } => vectors.add_file(job, area, spec, source, each)?,
            }
        }
        buildings::settle(&mut vectors.buildings);
        Ok(vectors)
    }

    /// How a feature is named in its file.
    pub fn name(&self, id: FeatureId) -> &str {
        let of_source = self.names.get(id.source as usize);
        of_source.and_then(|names| names.get(usize::try_from(id.number).ok()?)).map_or("?", String::as_str)
    }

    fn add_sample(&mut self, job: &Job, area: &GamingArea) {
        let DemSource::Sample { seed } = job.dem.source else { return };
        let reach = bounds(area, [0.0; 2]);
        let found = sample_terrain::features(seed, reach.east[0], reach.north[0], reach.east[1], reach.north[1]);
        let at_post = GridFrame { origin_east_m: 0.0, origin_north_m: 0.0, spacing: area.frame.spacing };
        self.files.push(FeaturesRead { name: "sample".into(), found: found.len() as u64, outside: 0, remarks: 0 });
        let (source, mut names) = (self.names.len() as u32, Vec::new());
        for feature in found {
            let line = |places: &[[f64; 2]]| places.iter().map(|place| position(*place, None, &at_post)).collect();
            let shape = match &feature.shape {
                SampleShape::Line(places) => Shape::Line(line(places)),
                SampleShape::Polygon(rings) => Shape::Polygon(rings.iter().map(|ring| line(ring)).collect()),
            };
            let tags = feature.tags.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
            let id = FeatureId { source, numbering: Numbering::Row, number: names.len() as i64 };
            names.push(format!("sample/{}", feature.id));
            self.sources.push(Source { id, tags, kind: None, shape });
        }
        self.names.push(names);
    }

    fn add_file(
        &mut self,
        job: &Job,
        area: &GamingArea,
        spec: &FeaturesSpec,
        of: &FeatureSource,
        each: Each,
    ) -> Result<(), GroundError> {
        let FeatureSource::File { file, layer, kind, crs } = of else { return Ok(()) };
        let crs = crs
            .as_deref()
            .map(|text| Crs::named(text).map_err(|found| bad_crs("features.sources", &file.written, &found)));
        let crs = crs.transpose()?;
        let mut keys: Vec<&str> = BUILT_IN_KEYS.into_iter().chain(spec.keys()).collect();
        keys.sort_unstable();
        keys.dedup();
        let bounds = bounds(area, [area.frame.origin_east_m, area.frame.origin_north_m]);
        let wanted = Wanted {
            epsg: job.area.epsg,
            bounds,
            layer: layer.as_deref(),
            crs: crs.as_ref(),
            keys: &keys,
            buildings: spec.buildings,
            points: false,
        };
        let FeatureFile { features, buildings, remarks, notes, found, outside, .. } =
            source_files::read_features(&file.path, &wanted, each)?;
        buildings::add(&buildings, area, &mut self.buildings);
        drop(buildings);
        let name = match layer {
            Some(layer) => format!("{}, layer {layer}", file.written),
            None => file.written.clone(),
        };
        self.notes.extend(notes.iter().map(|note| format!("{name}: {note}")));
        self.files.push(FeaturesRead { name, found, outside, remarks: remarks.len() });
        self.remarks.extend(remarks.into_iter().map(remark_of));
        let (source, mut names) = (self.names.len() as u32, Vec::with_capacity(features.len()));
        for VectorFeature { id, tags, shape } in features {
            let line = |vertices: &Vertices| -> Vec<Position> {
                let height = |at: usize| vertices.heights_m.get(at).copied().flatten();
                let places = vertices.places.iter().enumerate();
                places.map(|(at, place)| position(*place, height(at), &area.frame)).collect()
            };
            let shape = match &shape {
                // No feature is one.
                VectorShape::Point(_) => continue,
                VectorShape::Line(vertices) => Shape::Line(line(vertices)),
                VectorShape::Polygon(rings) => Shape::Polygon(rings.iter().map(line).collect()),
            };
            let text = |(key, value): &(Arc<str>, Arc<str>)| (key.to_string(), value.to_string());
            let (numbering, number) = (numbering_of(&id), names.len() as i64);
            names.push(id);
            let id = FeatureId { source, numbering, number };
            self.sources.push(Source { id, tags: tags.iter().map(text).collect(), kind: *kind, shape });
        }
        self.names.push(names);
        Ok(())
    }
}

/// What a feature is in OpenStreetMap, whose rivers are drawn downstream, as its name tells in whatever file it stands.
fn numbering_of(name: &str) -> Numbering {
    match name.split_once('/') {
        Some(("way", _)) => Numbering::Way,
        Some(("relation", _)) => Numbering::Relation,
        _ => Numbering::Row,
    }
}

/// Where features of an area lie and are cut.
pub fn site(area: &GamingArea) -> Site {
    // Every tile line is a load-module line.
    let side = area.grid.side_cells;
    Site::new(area.frame.spacing, area.rect, side, side)
}

pub(super) fn remark_of(Remark { id, at, found, done }: Remark) -> FeatureRemark {
    FeatureRemark {
        feature: id,
        at_m: at,
        found,
        leaves_out: matches!(done, Done::LeftOut(_)),
        done: done.text().to_owned(),
        degrades: false,
    }
}

/// A source, listed under a key, whose system of coordinates cannot be computed.
pub(super) fn bad_crs(key: &str, written: &str, found: &str) -> GroundError {
    GroundError::Impossible {
        key: key.into(),
        found: format!("crs of {written}: {found}"),
        expected: "a system that can be computed".into(),
        hint: "give a code, as crs = \"EPSG:4326\"".into(),
    }
}

/// The area and one load module around it, in metres; its south-west corner lies at `origin_m`.
pub(super) fn bounds(area: &GamingArea, origin_m: [f64; 2]) -> Extent {
    let spacing = area.frame.spacing.metres();
    let reach = area.rect.grown(area.grid.side_cells);
    let metres = |posts: [i32; 2], origin_m: f64| posts.map(|post| origin_m + f64::from(post) * spacing);
    Extent {
        east: metres([reach.west, reach.east], origin_m[0]),
        north: metres([reach.south, reach.north], origin_m[1]),
    }
}

fn position([east_m, north_m]: [f64; 2], height_m: Option<f64>, frame: &GridFrame) -> Position {
    let spacing = frame.spacing.metres();
    let posts = [(east_m - frame.origin_east_m) / spacing, (north_m - frame.origin_north_m) / spacing];
    Position { east: posts[0], north: posts[1], height_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_openstreetmap_names_is_known_by_its_name() {
        let numberings = ["way/12", "relation/12.1", "roads/12", "12"].map(numbering_of);
        assert_eq!(numberings, [Numbering::Way, Numbering::Relation, Numbering::Row, Numbering::Row]);
    }
}
