use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use umbrage::{Aabb, Light, LookAt};

/// Triangles, what they look like, where they stand, and who looks on.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for titles: the file's stem or the built-in scene's name.
    pub name: String,
    /// Each stored once.
    pub meshes: Vec<Mesh>,
    /// Each draws one mesh.
    pub instances: Vec<Instance>,
    /// Mesh fields refer here; never empty if there are meshes.
    pub materials: Vec<Material>,
    /// Material fields refer here.
    pub textures: Vec<Texture>,
    /// The file's cameras, in the order of the nodes that hold them (parents before children).
    pub cameras: Vec<SceneCamera>,
    /// The file's lights, in the order of the nodes that hold them (parents before children).
    pub lights: Vec<SceneLight>,
    /// What was repaired or left out on loading.
    pub notices: Vec<Notice>,
}

/// Triangles of one material, in their own space.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Metres in mesh space; all finite.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a position.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a position; empty if the mesh has none.
    pub uvs: Vec<Vec2>,
    /// Corners of each triangle, counter-clockwise seen from the front; all in range.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A mesh standing somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Finite and invertible.
    pub world_from_mesh: DAffine3,
}

/// What a surface looks like.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages.
    pub name: String,
    /// Linear red, green, blue and alpha, multiplied with the texture.
    pub base_color: Vec4,
    /// Colour (sRGB, decoded on sampling) and alpha over the mesh's `uvs`.
    pub base_color_texture: Option<TextureId>,
    /// How alpha is meant.
    pub alpha: Alpha,
    /// glTF's flag, for renderers that cull back faces. Shadows are cast by both sides.
    pub double_sided: bool,
}

/// How a material's alpha is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Ignored.
    Opaque,
    /// Where alpha is below the cutoff there is no surface: it neither shows nor casts.
    Mask {
        /// In [0, 1].
        cutoff: f32,
    },
}

/// Index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureId(pub usize);

/// An 8-bit sRGB image with straight alpha, with its addressing.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// Pixels, both at least 1.
    pub size: [u32; 2],
    /// Row by row from v = 0, red, green, blue, alpha.
    pub rgba: Vec<[u8; 4]>,
    /// What lies outside [0, 1], for u and for v.
    pub wrap: [Wrap; 2],
}

/// How a texture goes on outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Again and again, glTF's default.
    #[default]
    Repeat,
    /// Again and again, every second time mirrored.
    Mirror,
    /// With its edge pixels.
    Clamp,
}

/// A camera of the scene. Its picture's size, and with it the aspect, come from the user.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCamera {
    /// The file's name for it, or `camera0`, `camera1`, …
    pub name: String,
    /// Metres.
    pub eye: DVec3,
    /// A point along the view direction, metres.
    pub target: DVec3,
    /// Up in the picture.
    pub up: DVec3,
    /// Vertical field of view, radians.
    pub fov_y_rad: f64,
    /// Metres.
    pub near: f64,
    /// Metres; always finite.
    pub far: f64,
}

impl SceneCamera {
    /// The view of a picture of so many pixels.
    pub fn look_at(&self, image: [u32; 2]) -> LookAt {
        let Self { eye, target, up, fov_y_rad, near, far, .. } = *self;
        LookAt { eye, target, up, fov_y_rad, near, far, image }
    }
}

/// A light of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// The file's name for it, or `light0`, `light1`, …
    pub name: String,
    /// Where it shines.
    pub light: Light,
    /// Linear red, green, blue, largest 1.
    pub color: Vec3,
    /// As in the file: lux for directional lights, candela for the others.
    pub intensity: f32,
}

/// Something that was repaired or left out on loading, in one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice(pub String);

impl Scene {
    /// Triangles as drawn: each instance counts its mesh's.
    pub fn drawn_triangles(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh].triangles.len() as u64).sum()
    }

    /// Triangles as stored.
    pub fn stored_triangles(&self) -> u64 {
        self.meshes.iter().map(|m| m.triangles.len() as u64).sum()
    }

    /// A box around each instance, in their order, metres, world space: the mesh's own box, moved.
    /// Roomy where an instance is turned; [`Aabb::EMPTY`] where its mesh has no triangles.
    pub fn instance_boxes(&self) -> Vec<Aabb> {
        let boxes: Vec<Aabb> = self.meshes.iter().map(Mesh::bounds).collect();
        let moved = |i: &Instance| {
            let corners = boxes[i.mesh].corners().map(|p| i.world_from_mesh.transform_point3(p));
            if boxes[i.mesh].is_empty() { Aabb::EMPTY } else { Aabb::around(corners) }
        };
        self.instances.iter().map(moved).collect()
    }

    /// The box around everything drawn, metres, world space, exact to rounding; [`Aabb::EMPTY`]
    /// without triangles. Costs a pass over the vertices of every instance that is turned and may
    /// reach beyond those before it.
    pub fn bounds(&self) -> Aabb {
        let mut all = Aabb::EMPTY;
        for (i, roomy) in self.instances.iter().zip(self.instance_boxes()) {
            if all.union(roomy) == all {
                continue;
            }
            let m = i.world_from_mesh.matrix3;
            // Boxes stay boxes under scaling, mirroring and swapping of axes.
            let keeps_axes = [m.x_axis, m.y_axis, m.z_axis]
                .iter()
                .all(|a| a.to_array().iter().filter(|&&c| c != 0.0).count() == 1);
            let to_world = |p| i.world_from_mesh.transform_point3(p);
            all =
                all.union(if keeps_axes { roomy } else { self.meshes[i.mesh].bounds_in(to_world) });
        }
        all
    }
}

impl Mesh {
    /// The box around the triangles' corners, metres, mesh space.
    pub fn bounds(&self) -> Aabb {
        self.bounds_in(|p| p)
    }

    fn bounds_in(&self, dst_from_mesh: impl Fn(DVec3) -> DVec3) -> Aabb {
        let mut used = vec![false; self.positions.len()];
        for &i in self.triangles.iter().flatten() {
            used[i as usize] = true;
        }
        let corners = self.positions.iter().zip(used).filter(|(_, used)| *used);
        Aabb::around(corners.map(|(p, _)| dst_from_mesh(p.as_dvec3())))
    }
}
