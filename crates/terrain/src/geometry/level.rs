//! Which lane widths this processor has; every one of them gives the same integers.

use fearless_simd::Level;

/// The widest lanes of this processor.
pub fn widest_level() -> Level {
    Level::new()
}

/// Every instruction level this processor has, narrowest first, with its name; for tests and benchmarks.
pub fn levels_available() -> Vec<(&'static str, Level)> {
    let widest = Level::new();
    let mut levels = Vec::new();
    #[cfg(target_arch = "x86_64")]
    {
        levels.extend(widest.as_sse2().map(|level| ("sse2", Level::Sse2(level))));
        levels.extend(widest.as_sse4_2().map(|level| ("sse4.2", Level::Sse4_2(level))));
        levels.extend(widest.as_avx2().map(|level| ("avx2", Level::Avx2(level))));
    }
    levels.push(("widest", widest));
    levels
}
