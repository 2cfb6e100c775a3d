use super::mesh_builder::MeshBuilder;
use crate::types::{
    self, Alpha, Instance, Material, Mesh, Scene, SceneCamera, SceneLight, Texture, TextureId,
};
use glam::{DAffine3, DVec3, Vec3, Vec4};
use umbrage::{Light, PointLight, SpotLight};

/// A scene under construction.
pub(super) struct Stage {
    scene: Scene,
}

/// Index of a material added to a [`Stage`].
#[derive(Clone, Copy)]
pub(super) struct Paint(usize);

/// Index of a mesh added to a [`Stage`].
#[derive(Clone, Copy)]
pub(super) struct Shape(usize);

impl Stage {
    pub(super) fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.into(), ..Scene::default() } }
    }

    pub(super) fn finish(self) -> Scene {
        self.scene
    }

    /// An opaque material of linear `rgb`.
    pub(super) fn paint(&mut self, name: &str, rgb: [f32; 3]) -> Paint {
        self.material(Material {
            name: name.into(),
            base_color: Vec3::from(rgb).extend(1.0),
            base_color_texture: None,
            alpha: Alpha::Opaque,
            double_sided: false,
        })
    }

    /// A material that is visible from both sides, and that a texture's alpha cuts out at one half.
    pub(super) fn cut_out(&mut self, name: &str, texture: Texture) -> Paint {
        self.scene.textures.push(texture);
        self.material(Material {
            name: name.into(),
            base_color: Vec4::ONE,
            base_color_texture: Some(TextureId(self.scene.textures.len() - 1)),
            alpha: Alpha::Mask { cutoff: 0.5 },
            double_sided: true,
        })
    }

    fn material(&mut self, material: Material) -> Paint {
        self.scene.materials.push(material);
        Paint(self.scene.materials.len() - 1)
    }

    pub(super) fn shape(&mut self, builder: MeshBuilder, paint: Paint) -> Shape {
        self.mesh(|material| builder.finish(material), paint)
    }

    /// Adds a mesh, which is made for the index of its material.
    pub(super) fn mesh(&mut self, make: impl FnOnce(usize) -> Mesh, paint: Paint) -> Shape {
        self.scene.meshes.push(make(paint.0));
        Shape(self.scene.meshes.len() - 1)
    }

    pub(super) fn place(&mut self, shape: Shape, world_from_mesh: DAffine3) {
        self.scene.instances.push(Instance { mesh: shape.0, world_from_mesh });
    }

    /// How many shapes have been placed.
    pub(super) fn placed(&self) -> usize {
        self.scene.instances.len()
    }

    /// Places all but the first `first` shapes again, so that they stand `times` times in a row,
    /// `step` apart.
    pub(super) fn repeat(&mut self, first: usize, times: u32, step: DVec3) {
        let row = self.scene.instances[first..].to_vec();
        for k in 1..times {
            let by = DAffine3::from_translation(step * f64::from(k));
            let moved = |i: &Instance| Instance { world_from_mesh: by * i.world_from_mesh, ..*i };
            self.scene.instances.extend(row.iter().map(moved));
        }
    }

    /// Adds a shape with a single instance, in the space that it was built in.
    pub(super) fn set(&mut self, builder: MeshBuilder, paint: Paint) {
        let shape = self.shape(builder, paint);
        self.place(shape, DAffine3::IDENTITY);
    }

    /// Level ground around `center`, in `cells` × `cells` quads.
    pub(super) fn ground(&mut self, center: Vec3, half: f32, cells: u32, paint: Paint) {
        let mut b = MeshBuilder::new();
        let corner = center - Vec3::new(half, 0.0, half);
        b.sheet(corner, Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half, cells);
        self.set(b, paint);
    }

    pub(super) fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, lens: Lens) {
        self.scene.cameras.push(SceneCamera {
            name: name.into(),
            eye,
            target,
            up: DVec3::Y,
            lens: types::Lens::Perspective { fov_y_rad: lens.fov_y_deg.to_radians() },
            near: lens.near,
            far: lens.far,
        });
    }

    /// Warm sunlight travelling along `direction`.
    pub(super) fn sun(&mut self, direction: DVec3) {
        self.scene.lights.push(SceneLight {
            name: "sun".into(),
            light: Light::Directional { direction: direction.normalize() },
            color: Vec3::new(1.0, 0.93, 0.82),
            intensity: 100_000.0,
        });
    }

    /// The white light of a lamp under a shade.
    pub(super) fn lamp(&mut self, name: &str, light: SpotLight) {
        self.scene.lights.push(SceneLight {
            name: name.into(),
            light: Light::Spot(light),
            color: Vec3::new(1.0, 0.90, 0.74),
            intensity: 400.0,
        });
    }

    /// The warm light of a flame.
    pub(super) fn flame(&mut self, name: &str, light: PointLight) {
        self.scene.lights.push(SceneLight {
            name: name.into(),
            light: Light::Point(light),
            color: Vec3::new(1.0, 0.78, 0.48),
            intensity: 300.0,
        });
    }
}

/// The lens of a camera of a [`Stage`]. Distances are in metres.
#[derive(Clone, Copy)]
pub(super) struct Lens {
    pub(super) fov_y_deg: f64,
    pub(super) near: f64,
    pub(super) far: f64,
}

/// A rotation about the vertical (counter-clockwise as seen from above, radians), after a uniform
/// scale and before a translation to `at`.
pub(super) fn standing(at: DVec3, yaw_rad: f64, scale: f64) -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::splat(scale),
        glam::DQuat::from_rotation_y(yaw_rad),
        at,
    )
}

/// Pseudorandom numbers that are the same on every machine (SplitMix64; Steele et al. 2014).
pub(super) struct Variation(u64);

impl Variation {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number in [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A number in [lo, hi).
    pub(super) fn range(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.unit()
    }

    /// An index in 0 .. `n`.
    pub(super) fn pick(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }
}
