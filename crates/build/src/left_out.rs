//! Which features coarser levels of detail do without, told by the classes of their vertices and edges.

use std::collections::{BTreeMap, BTreeSet};

use crate::ground::GamingArea;
use job::Job;
use store::AreaLevel;
use store::engine::FingerprintBuilder;
use terrain::{Features, QUANTA_PER_METRE, Spacing};

/// A place in quanta from the area's south-west post: north, then east.
pub(crate) type At = [i64; 2];
/// Classes of what has several.
type Classes = BTreeSet<u8>;

/// What levels leave out of the features of an area.
pub struct LeftOut {
    /// For each level beside the finest, the classes that it leaves out.
    levels: Vec<Classes>,
    vertices: BTreeMap<At, Classes>,
    edges: BTreeMap<[At; 2], Classes>,
}

impl LeftOut {
    /// What levels of a job leave out of what its features came to; nothing where they keep all.
    pub fn of(job: &Job, area: &GamingArea, level: &AreaLevel) -> Option<Self> {
        if !job.lod.leaves_out() {
            return None;
        }
        let names = job.class_names();
        let mut all = Classes::new();
        let levels = job.lod.leave_out.iter().map(|classes| {
            all.extend((0..).zip(&names).filter(|(_, name)| classes.contains(name)).map(|(class, _)| class));
            all.clone()
        });
        let levels = levels.collect();
        let (mut vertices, mut edges) = (BTreeMap::<At, Classes>::new(), BTreeMap::<[At; 2], Classes>::new());
        let quanta = |metres: f64| (metres * f64::from(QUANTA_PER_METRE)).round() as i64;
        let [east, north] = [area.frame.origin_east_m, area.frame.origin_north_m];
        for line in &level.lines {
            let places: Vec<At> = line.vertices.iter().map(|[x, y, _]| [quanta(y - north), quanta(x - east)]).collect();
            for &place in &places {
                vertices.entry(place).or_default().insert(line.class);
            }
            for pair in places.windows(2) {
                edges.entry(ordered([pair[0], pair[1]])).or_default().insert(line.class);
            }
        }
        Some(Self { levels, vertices, edges })
    }

    /// Classes that a level beside the finest leaves out.
    pub(crate) fn classes(&self, level: usize) -> &BTreeSet<u8> {
        &self.levels[level]
    }

    /// Whether a level keeps a vertex of features.
    pub(crate) fn keeps_vertex(&self, level: usize, at: At) -> bool {
        self.keeps(level, self.vertices.get(&at))
    }

    /// Whether a level keeps an edge of features.
    pub(crate) fn keeps_edge(&self, level: usize, ends: [At; 2]) -> bool {
        self.keeps(level, self.edges.get(&ordered(ends)))
    }

    /// What several features share stays as long as one of them does.
    fn keeps(&self, level: usize, classes: Option<&Classes>) -> bool {
        classes.is_none_or(|classes| !classes.is_subset(&self.levels[level]))
    }

    /// Feeds all that it says of the features of a tile.
    pub(crate) fn feed(
        &self,
        builder: FingerprintBuilder,
        features: &Features,
        spacing: Spacing,
    ) -> FingerprintBuilder {
        let feed = |builder: FingerprintBuilder, classes: Option<&Classes>| {
            let classes: Vec<u8> = classes.into_iter().flatten().copied().collect();
            builder.list(classes.into_iter(), FingerprintBuilder::case)
        };
        let place = place_of(features, spacing);
        builder
            .list(self.levels.iter(), |builder, classes| feed(builder, Some(classes)))
            .list(0..features.vertices.len() as u32, |builder, v| feed(builder, self.vertices.get(&place(v))))
            .list(features.edges.iter(), |builder, ends| feed(builder, self.edges.get(&ordered(ends.map(&place)))))
    }
}

/// Where vertices of features lie.
pub(crate) fn place_of(features: &Features, spacing: Spacing) -> impl Fn(u32) -> At + '_ {
    let step = i64::from(spacing.quanta_per_post() / features.steps_per_post);
    move |v| {
        let at = features.vertices[v as usize].at;
        [i64::from(at.row) * step, i64::from(at.col) * step]
    }
}

fn ordered([a, b]: [At; 2]) -> [At; 2] {
    [a.min(b), a.max(b)]
}
