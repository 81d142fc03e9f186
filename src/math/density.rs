//! Probability densities that know their measure.
