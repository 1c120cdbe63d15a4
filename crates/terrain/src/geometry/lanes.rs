//! What kernels share: which lane widths this processor has, every one of which gives the same integers; the numbers of
//! lanes; and how a residual is rounded.

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

/// Lane numbers.
pub(super) const IOTA: [i32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// `numerator / den`, rounded half up (numerators are absolute values).
#[inline(always)]
pub fn rounded(numerator: u64, den: u64) -> u64 {
    if numerator <= u64::from(u32::MAX) && den <= u64::from(u32::MAX) {
        // One 32-bit division is several times faster than a 64-bit one.
        let (n, d) = (numerator as u32, den as u32);
        let quotient = n / d;
        return u64::from(quotient) + u64::from(d - n % d <= n % d);
    }
    let quotient = numerator / den;
    quotient + u64::from(den - numerator % den <= numerator % den)
}
