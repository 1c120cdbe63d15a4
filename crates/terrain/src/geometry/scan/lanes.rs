//! What the kernels share: the numbers of lanes, and how a residual is rounded.

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
