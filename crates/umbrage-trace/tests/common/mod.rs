//! Small scenes and plans made by hand.
#![allow(dead_code, reason = "each test binary uses its share")]

use glam::{DAffine3, DMat4, DVec2, DVec3, Vec2, Vec3, Vec4};
use umbrage::{
    Bounds, Camera, Light, LookAt, MapError, Part, Plan, Planner, Rows, ShadowMap, Technique,
};
use umbrage_scene::{Alpha, Instance, Material, Mesh, Scene};
use umbrage_trace::{PrimitiveRef, Ray, Surface, Tracer, View};

pub(crate) fn nobody(_rows: u64) {}

/// A scene with one plain material.
pub(crate) fn scene(meshes: Vec<Mesh>, instances: &[(usize, DAffine3)]) -> Scene {
    let place = |&(mesh, world_from_mesh)| Instance { mesh, world_from_mesh };
    Scene {
        meshes,
        instances: instances.iter().map(place).collect(),
        materials: vec![plain()],
        ..Scene::default()
    }
}

pub(crate) fn plain() -> Material {
    Material {
        name: "plain".into(),
        base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
        base_color_texture: None,
        alpha: Alpha::Opaque,
        double_sided: false,
    }
}

/// A mesh of separate triangles.
pub(crate) fn soup(triangles: &[[Vec3; 3]]) -> Mesh {
    let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let count = positions.len() as u32;
    Mesh {
        normals: vec![Vec3::Y; positions.len()],
        positions,
        triangles: (0..count / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    }
}

/// The parallelogram `corner + a u + b v`, a and b in [0, 1], with those as texture coordinates.
pub(crate) fn sheet(corner: Vec3, u: Vec3, v: Vec3) -> Mesh {
    Mesh {
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        normals: vec![u.cross(v).normalize(); 4],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: 0,
    }
}

/// The square of half-width `half` around the origin, in the plane y = 0.
pub(crate) fn ground(half: f32) -> Mesh {
    let corner = Vec3::new(-half, 0.0, -half);
    sheet(corner, Vec3::Z * (2.0 * half), Vec3::X * (2.0 * half))
}

/// A closed sphere with `rings` rings of triangles from pole to pole. Triangles at seams share
/// corners.
pub(crate) fn sphere(center: Vec3, radius: f32, rings: u32) -> Mesh {
    let sectors = 2 * rings;
    let mut positions = vec![center + Vec3::Y * radius];
    for ring in 1..rings {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        for sector in 0..sectors {
            let azimuth = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
            let (sin, cos) = polar.sin_cos();
            let unit = DVec3::new(sin * azimuth.cos(), cos, sin * azimuth.sin());
            positions.push(center + (unit * f64::from(radius)).as_vec3());
        }
    }
    positions.push(center - Vec3::Y * radius);
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, sector: u32| match ring {
        0 => 0,
        r if r == rings => last,
        r => 1 + (r - 1) * sectors + sector % sectors,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector + 1), at(ring + 1, sector)];
            triangles.extend((ring > 0).then_some([a, b, c]));
            triangles.extend((ring + 1 < rings).then_some([a, c, d]));
        }
    }
    let normals = positions.iter().map(|p| (p - center).normalize()).collect();
    Mesh { positions, normals, triangles, ..Mesh::default() }
}

pub(crate) fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

pub(crate) fn camera(eye: DVec3, target: DVec3, image: [u32; 2]) -> Camera {
    let fov_y_rad = 60f64.to_radians();
    Camera::look_at(LookAt { eye, target, up: DVec3::Y, fov_y_rad, near: 1e-5, far: 1e6, image })
        .unwrap()
}

/// A uniform map of a square across the light, with half-width `half` around `center` and a depth
/// range of `center` ± `reach`, metres.
pub(crate) fn even_map(
    center: DVec3,
    travel: DVec3,
    half: f64,
    reach: f64,
    resolution: [u32; 2],
) -> ShadowMap {
    let forward = travel.normalize();
    let (right, up) = forward.any_orthonormal_pair();
    let scale = DVec3::new(1.0 / (2.0 * half), 1.0 / (2.0 * half), 1.0 / (2.0 * reach));
    let rows = [right * scale.x, up * scale.y, forward * scale.z];
    let shadow_from_local = DMat4::from_cols(
        rows[0].extend(0.5),
        rows[1].extend(0.5),
        rows[2].extend(0.5),
        glam::DVec4::W,
    )
    .transpose();
    ShadowMap {
        origin: center,
        shadow_from_local,
        local_from_shadow: shadow_from_local.inverse(),
        rows: Rows::Even,
        resolution,
        part: Part::default(),
        cell: Vec::new(),
        fade_from: None,
        split: [0.0, 1e9],
        lambda: None,
        error: MapError::default(),
        storage_factor: 1.0,
        caster_planes: Vec::new(),
        apex: None,
        slab: umbrage::Slab::default(),
    }
}

/// In a picture of surfaces that are all lit, the number of samples that are in shadow, and the
/// number of all samples.
pub(crate) fn false_shadows(
    scene: &Scene,
    eye: DVec3,
    target: DVec3,
    light: Light,
) -> (usize, usize) {
    let tracer = Tracer::new(scene).unwrap();
    let view = View::new(&tracer, camera(eye, target, [160, 120]), light, 1).unwrap();
    let band = view.band(0..120, &nobody);
    let truth = band.map(|s| view.truth(s), &nobody);
    let facing = band.samples().iter().zip(truth).filter(|(s, _)| s.is_some_and(|s| s.is_facing));
    facing.fold((0, 0), |(wrong, all), (_, lit)| (wrong + usize::from(lit == 0.0), all + 1))
}

/// The surface straight below `point`.
pub(crate) fn below(tracer: &Tracer<'_>, point: DVec3) -> Surface {
    towards(tracer, point, -DVec3::Y)
}

/// The first surface in `direction` of `point`.
pub(crate) fn towards(tracer: &Tracer<'_>, origin: DVec3, direction: DVec3) -> Surface {
    let ray = Ray { origin, direction };
    let hit = tracer.closest(ray, [0.0, f64::INFINITY]).expect("a surface there");
    tracer.surface(&hit, direction)
}

/// All hits of a ray, by the test of Möller and Trumbore over every triangle in world space. With
/// each comes how far inside its triangle the hit lies (the smallest barycentric coordinate); near
/// zero, rounding may put the hit inside or outside.
pub(crate) fn all_hits(scene: &Scene, ray: Ray) -> Vec<(f64, PrimitiveRef, f64)> {
    let mut hits = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh];
        for (j, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|k| {
                let corner = mesh.positions[k as usize].as_dvec3();
                instance.world_from_mesh.transform_point3(corner)
            });
            let (e1, e2) = (b - a, c - a);
            if e1.cross(e2) == DVec3::ZERO {
                continue;
            }
            let p = ray.direction.cross(e2);
            let determinant = e1.dot(p);
            let s = ray.origin - a;
            let q = s.cross(e1);
            let (u, v) = (s.dot(p) / determinant, ray.direction.dot(q) / determinant);
            let t = e2.dot(q) / determinant;
            let area = e1.cross(e2).length();
            // A ray that sees a triangle edge-on may hit or miss it.
            let is_clear = determinant.abs() > 1e-9 * area * ray.direction.length();
            let margin = if is_clear { u.min(v).min(1.0 - u - v) } else { 0.0 };
            if t.is_finite() && margin > -1e-6 && t > 0.0 {
                let primitive = PrimitiveRef { instance: i as u32, triangle: j as u32 };
                hits.push((t, primitive, margin));
            }
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    hits
}

/// Reproducible numbers in [0, 1), by SplitMix64.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn vector(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.between(-half, half), self.between(-half, half), self.between(-half, half))
    }

    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.vector(1.0);
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub(crate) fn in_square(&mut self, half: f64) -> DVec2 {
        DVec2::new(self.between(-half, half), self.between(-half, half))
    }
}

/// Plans the maps of one light for the whole scene.
pub(crate) fn plan(scene: &Scene, camera: &Camera, light: Light, technique: &Technique) -> Plan {
    let bounds = Bounds::of_scene(scene.bounds());
    Planner::new().plan(camera, &[light], &bounds, technique).unwrap().clone()
}
