//! Frames, warps, typed densities, colour and robust floating-point helpers.

pub mod density;
pub mod frame;
pub mod lanes;
pub mod rgb;
pub mod robust;
pub mod special;
pub mod spherical;
pub mod trig;
pub mod warp;

pub use frame::Frame;
pub use glam::{Affine3A, Mat3, Mat4, Vec2, Vec3};
pub use lanes::{LANES, Vec3Lanes};
pub use rgb::{Rgb, srgb_to_linear};
