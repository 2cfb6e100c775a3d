//! Ground under scenes that have none.

use crate::types::{Alpha, Instance, Material, Mesh, Scene};
use glam::{DAffine3, Vec2, Vec3, Vec4};

/// How far the ground reaches beyond the scene on each side, in the scene's longest edges. The
/// shadow of a sun 15° high still falls on it.
const MARGIN: f64 = 4.0;

impl Scene {
    /// Adds a grey square under the scene, level with its lowest point. A scene without triangles
    /// gets none.
    pub fn add_ground(&mut self) {
        let bounds = self.bounds();
        if bounds.is_empty() {
            return;
        }
        let size = bounds.size();
        let longest = size.max_element().max(1e-6);
        let half = size.x.max(size.z) / 2.0 + MARGIN * longest;
        self.materials.push(Material {
            name: "ground".into(),
            base_color: Vec4::new(0.5, 0.5, 0.5, 1.0),
            base_color_texture: None,
            alpha: Alpha::Opaque,
            double_sided: false,
        });
        self.meshes.push(Mesh {
            positions: [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)]
                .map(|(x, z)| Vec3::new(x, 0.0, z))
                .to_vec(),
            normals: vec![Vec3::Y; 4],
            uvs: Vec::<Vec2>::new(),
            alphas: Vec::new(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: self.materials.len() - 1,
        });
        let world_from_mesh = DAffine3::from_scale_rotation_translation(
            glam::DVec3::splat(half),
            glam::DQuat::IDENTITY,
            bounds.center().with_y(bounds.min.y),
        );
        self.instances.push(Instance { mesh: self.meshes.len() - 1, world_from_mesh });
    }
}
