//! Warps of the unit square, each as sample / density / inverse.
