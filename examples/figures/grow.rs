//! Figures of growth by guiding vectors.

/// Prints them.
pub(crate) fn print() {
    crate::plausibility::print();
}
