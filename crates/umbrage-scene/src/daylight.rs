//! Radiance of the sun, the sky and the ground, for every renderer of pictures. Linear, in units of
//! display white.

use glam::Vec3;

/// Light of the sun, or of a spot or point light, reflected by a white surface that faces it. The
/// value is chosen so that white paper in the sun is just below display white, and its shadow
/// clearly darker and bluish.
pub const SUN: Vec3 = Vec3::new(1.42, 1.33, 1.18);
/// Light of the sky on a surface that faces up.
pub const SKY_LIGHT: Vec3 = Vec3::new(0.25, 0.31, 0.41);
/// Light of the ground on a surface that faces down.
pub const GROUND_LIGHT: Vec3 = Vec3::new(0.15, 0.135, 0.12);
/// Colour of the sky overhead.
pub const ZENITH: Vec3 = Vec3::new(0.16, 0.33, 0.68);
/// Colour of the sky at the horizon.
pub const HORIZON: Vec3 = Vec3::new(0.72, 0.80, 0.88);
/// Colour of the sky below the horizon, seen where no ground is in the way.
pub const NADIR: Vec3 = Vec3::new(0.34, 0.34, 0.34);
/// Colour that is added to the sky around the sun.
pub const GLOW: Vec3 = Vec3::new(0.30, 0.24, 0.14);
