use crate::animation::Animations;
use crate::nodes::{Role, Roles, SceneNode};
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use umbrage::{Aabb, Camera, Light, LookAt, Orthographic};

/// A scene: triangles, their materials and transforms, cameras and lights.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for titles: the stem of the file's name, or the name of the built-in scene.
    pub name: String,
    /// The meshes, each stored once.
    pub meshes: Vec<Mesh>,
    /// The instances, each of which draws one mesh.
    pub instances: Vec<Instance>,
    /// Materials, which [`Mesh::material`] indexes. Never empty if there are meshes.
    pub materials: Vec<Material>,
    /// Textures, which [`Material::base_color_texture`] indexes.
    pub textures: Vec<Texture>,
    /// The file's cameras, in the order of the nodes that hold them (parents before children).
    pub cameras: Vec<SceneCamera>,
    /// The file's lights, in the order of the nodes that hold them (parents before children).
    pub lights: Vec<SceneLight>,
    /// Notices of what was repaired or left out on loading.
    pub notices: Vec<Notice>,
    /// The nodes of the file's shown scene, parents before their children; none in built-in scenes.
    pub nodes: Vec<SceneNode>,
    /// Which instances are seen, and which cast shadows.
    pub roles: Roles,
    /// Index into [`Scene::nodes`] of the node that surrounds all else as a sky does, if there is
    /// one and it is seen or casts.
    pub sky: Option<usize>,
    /// The clips of the file, by which [`Scene::pose`] moves the scene.
    pub animations: Animations,
}

/// Triangles of one material, in their own space.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions in mesh space, metres; all finite.
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one per position.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per position; empty if the mesh has none.
    pub uvs: Vec<Vec2>,
    /// Alpha of the vertices, which multiplies the material's alpha, one per position, in [0, 1];
    /// empty if it is 1 everywhere. Only alpha masks use it.
    pub alphas: Vec<f32>,
    /// Indices of the corners of each triangle, counter-clockwise as seen from the front; all in
    /// range.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// A mesh, drawn with a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Transform from mesh space to world space; finite and invertible. Of no other meaning if the
    /// instance is absent in the present pose (see [`Roles`]).
    pub world_from_mesh: DAffine3,
}

/// The look of a surface.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name for messages.
    pub name: String,
    /// Linear red, green, blue and alpha. They are multiplied with the texture.
    pub base_color: Vec4,
    /// Texture with colour (sRGB, decoded on sampling) and alpha, addressed by the mesh's `uvs`.
    pub base_color_texture: Option<TextureId>,
    /// How alpha is interpreted.
    pub alpha: Alpha,
    /// glTF's flag, for renderers that cull back faces. Both sides cast shadows whatever it says.
    pub double_sided: bool,
}

/// How a material's alpha is interpreted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Alpha is ignored.
    Opaque,
    /// Where alpha is below the cutoff there is no surface: it is neither visible nor casts a
    /// shadow.
    Mask {
        /// The cutoff, at least 0. Above 1 there is no surface anywhere.
        cutoff: f32,
    },
}

/// Index into [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureId(pub usize);

/// An 8-bit sRGB image with straight alpha, and its addressing modes.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// Width and height, pixels, both at least 1.
    pub size: [u32; 2],
    /// Pixels row by row from v = 0, each as red, green, blue, alpha.
    pub rgba: Vec<[u8; 4]>,
    /// Addressing outside [0, 1], for u and for v.
    pub wrap: [Wrap; 2],
    /// How the texture continues between the centres of its pixels.
    pub sampling: Sampling,
}

/// How a texture continues between the centres of its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sampling {
    /// It is interpolated bilinearly.
    #[default]
    Linear,
    /// Each pixel is a rectangle of one colour and alpha.
    Nearest,
}

/// How a texture continues outside [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// It repeats; this is glTF's default.
    #[default]
    Repeat,
    /// It repeats, and every second copy is mirrored.
    Mirror,
    /// It continues with the pixels of its edge.
    Clamp,
}

/// A camera of the scene. The user chooses the size of the picture, and with it the aspect ratio.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCamera {
    /// The file's name of the camera, or `camera0`, `camera1`, …
    pub name: String,
    /// Position of the eye in world space, metres.
    pub eye: DVec3,
    /// A point along the view direction, world space, metres.
    pub target: DVec3,
    /// The direction that is up in the picture.
    pub up: DVec3,
    /// How much of the scene the picture shows.
    pub lens: Lens,
    /// Near distance, metres.
    pub near: f64,
    /// Far distance, metres; always finite.
    pub far: f64,
}

/// How much of a scene a camera's picture shows from bottom to top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// A perspective view.
    Perspective {
        /// Vertical field of view, radians.
        fov_y_rad: f64,
    },
    /// An orthographic view.
    Orthographic {
        /// Height of what the picture shows, metres.
        height: f64,
    },
}

impl SceneCamera {
    /// The camera with a picture of `image` pixels (width, height).
    ///
    /// # Errors
    /// Names the value that no camera can have.
    pub fn camera(&self, image: [u32; 2]) -> Result<Camera, umbrage::Error> {
        let Self { eye, target, up, lens, near, far, .. } = *self;
        match lens {
            Lens::Perspective { fov_y_rad } => {
                Camera::look_at(LookAt { eye, target, up, fov_y_rad, near, far, image })
            }
            Lens::Orthographic { height } => {
                Camera::orthographic(Orthographic { eye, target, up, height, near, far, image })
            }
        }
    }

    /// A far distance that reaches just behind a scene within these bounds, metres; 100 m if
    /// nothing of them lies ahead. The camera's own depth range does not matter.
    pub fn end_of(&self, bounds: Aabb) -> f64 {
        let forward = (self.target - self.eye).normalize_or(DVec3::NEG_Z);
        let depths = bounds.corners().map(|corner| forward.dot(corner - self.eye));
        let farthest = depths.into_iter().fold(0.0, f64::max);
        if farthest > 0.0 { farthest * 1.01 } else { 100.0 }
    }
}

/// A light of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// The file's name of the light, or `light0`, `light1`, …
    pub name: String,
    /// Position, direction and extent of the light.
    pub light: Light,
    /// Linear red, green and blue, of which the largest is 1.
    pub color: Vec3,
    /// Intensity as in the file: in lux for directional lights, in candela for the others.
    pub intensity: f32,
}

/// One sentence about something that was repaired or left out on loading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice(pub String);

impl Scene {
    /// Number of triangles as drawn: each instance that is seen or casts counts the triangles of
    /// its mesh.
    pub fn drawn_triangles(&self) -> u64 {
        let drawn = self.instances_that(|role| role.is_seen || role.casts);
        drawn.map(|i| self.meshes[i.mesh].triangles.len() as u64).sum()
    }

    /// The instances whose role is as it should be.
    pub(crate) fn instances_that(
        &self,
        is_wanted: impl Fn(Role) -> bool,
    ) -> impl Iterator<Item = &Instance> {
        let roles = (0..).map(|i| self.roles.of(i));
        let wanted = self.instances.iter().zip(roles).filter(move |&(_, role)| is_wanted(role));
        wanted.map(|(instance, _)| instance)
    }

    /// Number of triangles as stored.
    pub fn stored_triangles(&self) -> u64 {
        self.meshes.iter().map(|m| m.triangles.len() as u64).sum()
    }

    /// A box around each instance, in the order of the instances, world space, metres: the box of
    /// the mesh, transformed. It is loose where an instance is rotated, and [`Aabb::EMPTY`] where
    /// the mesh has no triangles.
    pub fn instance_boxes(&self) -> Vec<Aabb> {
        let boxes: Vec<Aabb> = self.meshes.iter().map(Mesh::bounds).collect();
        let moved = |i: &Instance| {
            let corners = boxes[i.mesh].corners().map(|p| i.world_from_mesh.transform_point3(p));
            if boxes[i.mesh].is_empty() { Aabb::EMPTY } else { Aabb::around(corners) }
        };
        self.instances.iter().map(moved).collect()
    }

    /// The box around everything that is seen, apart from a [sky](Self::sky), world space, metres,
    /// exact to rounding; [`Aabb::EMPTY`] without triangles. Takes a pass over the vertices of
    /// every instance that is rotated and may extend beyond the instances before it.
    pub fn bounds(&self) -> Aabb {
        self.bounds_of(Role::is_receiver)
    }

    /// The box around everything that casts shadows, as [`bounds`](Self::bounds) is around what
    /// receives them.
    pub fn caster_bounds(&self) -> Aabb {
        self.bounds_of(|role| role.casts)
    }

    fn bounds_of(&self, is_wanted: fn(Role) -> bool) -> Aabb {
        let mut all = Aabb::EMPTY;
        for ((k, i), roomy) in self.instances.iter().enumerate().zip(self.instance_boxes()) {
            if !is_wanted(self.roles.of(k)) || all.union(roomy) == all {
                continue;
            }
            let m = i.world_from_mesh.matrix3;
            // A transform that scales, mirrors and swaps axes takes boxes to boxes.
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
    /// The memory of the mesh's lists, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.positions)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.alphas)
            + size_of_val(&*self.triangles)
    }

    /// The largest magnitude of a coordinate, metres.
    pub(crate) fn reach(&self) -> f64 {
        let farthest = self.positions.iter().fold(Vec3::ZERO, |all, p| all.max(p.abs()));
        f64::from(farthest.max_element())
    }

    /// The box around the corners of the triangles, mesh space, metres.
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
