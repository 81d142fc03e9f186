//! EXR images with statistics layers.
