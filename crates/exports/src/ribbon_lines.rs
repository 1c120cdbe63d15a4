//! Which ways are seen as bands over the ground.

use terrain::{LineForm, LineKind, ModuleLine, QUANTA_PER_METRE};

/// Whether a way is seen as a band: what is in the ground as a line, and has a width.
pub(crate) fn is_band(line: &ModuleLine) -> bool {
    let traits = &line.traits;
    traits.is_in_ground && traits.form == LineForm::Line && traits.kind != LineKind::Breakline && 0 < traits.width
}

/// The length of all of them.
pub(crate) fn length_m(lines: &[Vec<ModuleLine>]) -> f64 {
    let all = lines.iter().flatten().filter(|line| is_band(line)).flat_map(|line| line.vertices.windows(2));
    let part = |pair: &[terrain::ModuleVertex]| {
        let [east, north] = [[pair[0].x, pair[1].x], [pair[0].y, pair[1].y]].map(|[a, b]| f64::from(b) - f64::from(a));
        east.hypot(north)
    };
    all.map(part).sum::<f64>() / f64::from(QUANTA_PER_METRE)
}
