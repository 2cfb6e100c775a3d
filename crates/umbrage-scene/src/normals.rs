//! Normals that follow from triangles.

use crate::types::Mesh;
use glam::{DVec3, Vec3};

/// The triangle's normal with twice its area as length, in double precision so that it is zero only
/// for triangles without area.
pub(crate) fn area_normal(positions: &[Vec3], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

/// Gives the corners of each triangle, which no other triangle uses, the triangle's normal.
pub(crate) fn flatten(mesh: &mut Mesh) {
    for &t in &mesh.triangles {
        let normal = area_normal(&mesh.positions, t).normalize_or(DVec3::Y).as_vec3();
        for i in t {
            mesh.normals[i as usize] = normal;
        }
    }
}

/// Makes all normals unit vectors. Returns how many of them had no direction and were computed from
/// the triangles.
pub(crate) fn repair(mesh: &mut Mesh) -> usize {
    let mut missing = vec![false; mesh.normals.len()];
    for (normal, missing) in mesh.normals.iter_mut().zip(&mut missing) {
        match normal.as_dvec3().try_normalize() {
            Some(n) => *normal = n.as_vec3(),
            None => *missing = true,
        }
    }
    let count = missing.iter().filter(|&&m| m).count();
    if count > 0 {
        let mut sums = vec![DVec3::ZERO; missing.len()];
        for &t in &mesh.triangles {
            let normal = area_normal(&mesh.positions, t);
            for i in t {
                sums[i as usize] += normal;
            }
        }
        for (i, _) in missing.iter().enumerate().filter(|(_, m)| **m) {
            mesh.normals[i] = sums[i].normalize_or(DVec3::Y).as_vec3();
        }
    }
    count
}
