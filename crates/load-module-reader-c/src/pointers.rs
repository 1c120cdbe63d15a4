//! Pointers of callers: what is null or not aligned is never followed.

use std::ffi::c_int;

/// What a pointer points to, unless it is null or not aligned.
///
/// # Safety
/// If it is neither, it points to a `T` that lives as long as what is returned is used, and nothing writes to it then.
pub(crate) unsafe fn given<'a, T>(pointer: *const T) -> Option<&'a T> {
    // SAFETY: the caller's word, and what is checked first.
    (!pointer.is_null() && pointer.is_aligned()).then(|| unsafe { &*pointer })
}

/// The same, for something that the caller has this function write: it may hold anything before.
///
/// # Safety
/// If the pointer is neither null nor unaligned, a `T` may be written there.
pub(crate) unsafe fn give<T>(pointer: *mut T, value: T) -> c_int {
    if pointer.is_null() || !pointer.is_aligned() {
        return 0;
    }
    // SAFETY: the caller's word.
    unsafe { pointer.write(value) };
    1
}
