//! A limit that could not be met: a result, with numbers.

use crate::ModuleId;

/// One limit that could not be met.
#[derive(Clone, Debug, PartialEq)]
pub struct Breach {
    /// Which limit.
    pub kind: BreachKind,
    /// Where.
    pub place: BreachPlace,
    /// What was counted there.
    pub count: u64,
    /// What the limit allows there.
    pub limit: u64,
    /// Posts that were refused there because of the limit.
    pub refused: u32,
    /// RMS residual there as built, in metres.
    pub rms_with_m: f64,
    /// RMS residual there had the limit not been enforced, in metres; absent where it was not computed.
    pub rms_without_m: Option<f64>,
}

impl Breach {
    /// How far the count is above the limit.
    pub fn excess(&self) -> u64 {
        self.count.saturating_sub(self.limit)
    }
}

/// Which limit was not met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BreachKind {
    /// `per_load_module`, after the pool.
    LoadModule,
    /// `mean_per_load_module`.
    Mean,
    /// `per_4km_square`.
    Window,
    /// `max_residual_m` or `target_rms_m`, which a limit kept from being reached.
    Residual,
}

/// Where a limit was not met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BreachPlace {
    /// One load module.
    Module(ModuleId),
    /// The window of load modules whose south-west one is named.
    Window(ModuleId),
    /// The whole area.
    Area,
}
