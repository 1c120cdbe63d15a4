//! What features and objects take of one load module, and what became of them there.

use build::CompileError;
use build::product::Product;
use std::collections::BTreeMap;
use store::{FeatureFarOff, FeatureLeftOut, FeatureRemark, Folder, ObjectLeftOut};
use terrain::{LoadModule, ModuleId, ObjectKind};

/// Roads and water in a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainedFeatures {
    /// Triangles reserved for features, by class.
    pub cost: Vec<(String, u32)>,
    /// All of them as a share of the limit of a load module.
    pub share: f64,
    /// The most that features may take of it.
    pub share_max: f64,
    /// The most that they may take of it where one goes in that is no motorway, primary road, rail, river or large
    /// lake.
    pub share_others: f64,
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
        share_others: spec.share_max,
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

/// What stands on a load module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplainedObjects {
    /// By kind: pieces, and the polygons that they count.
    pub kinds: Vec<(&'static str, [u64; 2])>,
    /// The limit of a load module.
    pub limit: u32,
    /// What begins in it and had no room, what hides most first.
    pub left_out: Vec<ObjectLeftOut>,
    /// What was mended or left out in it.
    pub remarks: Vec<FeatureRemark>,
}

/// That of a load module; nothing of a job without objects.
pub(crate) fn explained_objects(
    folder: &Folder,
    product: &Product,
    module: &LoadModule,
    [west, south, east, north]: [f64; 4],
) -> Result<Option<ExplainedObjects>, CompileError> {
    let Some(spec) = &product.job.objects else { return Ok(None) };
    let (_, _, outlines) = folder.read_outlines()?;
    let mut kinds: BTreeMap<ObjectKind, [u64; 2]> = BTreeMap::new();
    let of_prisms = module.objects.prisms.iter().map(|prism| (prism.kind, prism.polygons()));
    let of_canopies = module.objects.canopies.iter().map(|canopy| (canopy.kind, canopy.triangles.len()));
    for (kind, polygons) in of_prisms.chain(of_canopies) {
        let [count, all] = kinds.entry(kind).or_default();
        (*count, *all) = (*count + 1, *all + polygons as u64);
    }
    let is_here = |[x, y]: [f64; 2]| west <= x && x <= east && south <= y && y <= north;
    Ok(Some(ExplainedObjects {
        kinds: kinds.into_iter().map(|(kind, counts)| (kind.name(), counts)).collect(),
        limit: spec.per_load_module,
        left_out: outlines.left_out.into_iter().filter(|left| is_here(left.at_m)).collect(),
        remarks: outlines.remarks.into_iter().filter(|remark| remark.at_m.is_some_and(is_here)).collect(),
    }))
}
