//! Bevy's vectors and matrices in double precision, and back. Bevy and Umbrage have different
//! versions of glam.

use bevy::math::Mat4;
use umbrage::glam::{DMat4, DVec3};

pub(crate) fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

pub(crate) fn double(m: Mat4) -> DMat4 {
    DMat4::from_cols_array(&m.to_cols_array().map(f64::from))
}

pub(crate) fn single(m: DMat4) -> Mat4 {
    Mat4::from_cols_array(&m.to_cols_array().map(|x| x as f32))
}
