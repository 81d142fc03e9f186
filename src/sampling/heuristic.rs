//! Multiple importance sampling weights in overflow-safe ratio form.
