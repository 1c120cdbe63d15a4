//! What reads a finished database back and changes nothing in it: whether it is sound, how true, why it is as it is.

mod status;
pub use status::{Status, TileProgress, status};
mod verify;
pub use verify::{NetworkFound, Verdict, verify};
mod inadequate;
pub use inadequate::{Component, Inadequate, inadequate};
mod explain;
mod measures;
pub use explain::{
    ExplainedFeatures, ExplainedObjects, ExplainedRefusal, ExplainedWindow, Explanation, OneMore, explain,
};
pub use fidelity::{
    Cover, Distances, Drainage, GRADES, Hausdorff, LineOfSight, Measures, MeshForm, Registration, ResidualFigures,
    SeamVisibility, SlopeClasses, SlopeDifference,
};
pub use measures::{
    BuiltResidual, ClassResidual, DatabaseFidelity, Fidelity, PastObjectsFound, Sights, fidelity, measure,
};
mod difference;
pub use difference::{Difference, ModuleDifference, SettingDifference, difference};
mod correlate;
pub use correlate::{
    ClassFigures, Confusion, CorrelateRequest, Correlation, Criterion, Demand, DifferenceMap, HeightFigures, Kappa,
    NEAREST_M, Plan, SAMPLES_MAX, SIGHT_HEIGHTS_M, SLOPE_CLASSES, SLOPE_ENDS_DEGREES, Shift, SightFigures,
    SlopeFigures, SurfaceFacts, correlate,
};

mod recount;

/// Writes a load module as its row and its column.
fn row_col<S: serde::Serializer>(module: &terrain::ModuleId, out: S) -> Result<S::Ok, S::Error> {
    serde::Serialize::serialize(&[module.row, module.col], out)
}
