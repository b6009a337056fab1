//! Figures of blending.

/// Prints them.
pub(crate) fn print() {
    crate::select::print();
}
