//! Scene and mesh readers: one file per format.
