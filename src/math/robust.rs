//! Floating-point helpers with stated error bounds.
