//! What features take of one load module, and what became of them there.

use build::product::Product;
use store::{FeatureFarOff, FeatureLeftOut, FeatureRemark};
use terrain::ModuleId;

/// Roads and water in a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainedFeatures {
    /// Triangles reserved for features, by class.
    pub cost: Vec<(String, u32)>,
    /// All of them as a share of the limit of a load module.
    pub share: f64,
    /// The most that features may take of it.
    pub share_max: f64,
    /// Cubic metres cut and filled in it, by class.
    pub moved_m3: Vec<(String, [f64; 2])>,
    /// Features that lie more than 3 m off the ground in it, each at its worst place, the farthest first.
    pub far_off: Vec<FeatureFarOff>,
    /// What was mended, degraded or left out in it.
    pub remarks: Vec<FeatureRemark>,
    /// Stretches from junction to junction, and bodies of water, that touch it and are not in the ground.
    pub left_out: Vec<FeatureLeftOut>,
}

/// Those of a load module; nothing of a job without features.
pub(crate) fn explained_features(product: &Product, id: ModuleId, extent_m: [f64; 4]) -> Option<ExplainedFeatures> {
    let ((level, remarks), spec) = (product.features.as_ref()?, product.job.features.as_ref()?);
    let (names, place) = (product.job.class_names(), product.grid.index(id) as u32);
    let name = |class: u8| names.get(usize::from(class)).cloned().unwrap_or_default();
    let here = level.cost.iter().filter(|(module, ..)| *module == place);
    let cost: Vec<(String, u32)> = here.map(|&(_, class, triangles)| (name(class), triangles)).collect();
    let total: u32 = cost.iter().map(|(_, triangles)| triangles).sum();
    let [west, south, east, north] = extent_m;
    let lies_here =
        |remark: &&FeatureRemark| remark.at_m.is_some_and(|[x, y]| west <= x && x <= east && south <= y && y <= north);
    let touches = |left: &&FeatureLeftOut| {
        left.lines.iter().flatten().any(|[x, y, _]| west <= *x && *x <= east && south <= *y && *y <= north)
    };
    Some(ExplainedFeatures {
        cost,
        share: f64::from(total) / f64::from(product.job.limits.per_load_module.max(1)),
        share_max: spec.share_main.max(spec.share_max),
        moved_m3: level
            .moved
            .iter()
            .filter(|of| of.0 == place)
            .map(|&(_, class, moved)| (name(class), moved))
            .collect(),
        far_off: level.far_off.iter().filter(|far| far.module == place).cloned().collect(),
        remarks: remarks.iter().filter(lies_here).cloned().collect(),
        left_out: level.left_out.iter().filter(touches).cloned().collect(),
    })
}
