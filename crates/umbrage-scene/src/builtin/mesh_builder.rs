use crate::types::Mesh;
use glam::{Affine3A, Mat3A, Vec2, Vec3};
use std::f32::consts::TAU;

/// Collects the triangles of one mesh. All surfaces face outwards and have unit normals.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshBuilder {
    mesh: Mesh,
}

impl MeshBuilder {
    pub(super) fn new() -> Self {
        Self::default()
    }

    pub(super) fn finish(self, material: usize) -> Mesh {
        Mesh { material, ..self.mesh }
    }

    /// Adds a transformed copy of `other`. Under mirroring transforms too, surfaces keep facing
    /// outwards.
    pub(super) fn add(&mut self, other: &Self, self_from_other: Affine3A) -> &mut Self {
        let (from, m) = (&other.mesh, self_from_other.matrix3);
        let base = self.mesh.positions.len() as u32;
        let mirrored = m.determinant() < 0.0;
        // Normals transform by the cofactor matrix, whatever the scale or mirroring.
        let sign = if mirrored { -1.0 } else { 1.0 };
        let cofactor = Mat3A::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        ) * sign;
        let to = &mut self.mesh;
        to.positions.extend(from.positions.iter().map(|&p| self_from_other.transform_point3(p)));
        to.normals.extend(from.normals.iter().map(|&n| (cofactor * n).normalize()));
        to.uvs.extend(&from.uvs);
        to.triangles.extend(from.triangles.iter().map(|&[a, b, c]| {
            if mirrored { [a, c, b].map(|i| i + base) } else { [a, b, c].map(|i| i + base) }
        }));
        self
    }

    /// Adds the parallelogram `corner + i·u + j·v`, facing u × v, in `cells` × `cells` quads.
    pub(super) fn sheet(&mut self, corner: Vec3, u: Vec3, v: Vec3, cells: u32) -> &mut Self {
        let normal = u.cross(v).normalize();
        self.grid([cells, cells], |i, j| (corner + u * i + v * j, normal));
        self
    }

    /// Adds a box with sharp edges, each side in `cells` × `cells` quads.
    pub(super) fn cuboid(&mut self, min: Vec3, max: Vec3, cells: u32) -> &mut Self {
        let d = max - min;
        let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
        self.sheet(min, z, y, cells)
            .sheet(min + x, y, z, cells)
            .sheet(min, x, z, cells)
            .sheet(min + y, z, x, cells)
            .sheet(min, y, x, cells)
            .sheet(min + z, x, y, cells)
    }

    /// Adds a box that stands on y = 0 around the y axis, transformed.
    pub(super) fn block(&mut self, size: Vec3, self_from_block: Affine3A) -> &mut Self {
        let mut b = Self::new();
        let half = Vec3::new(size.x / 2.0, 0.0, size.z / 2.0);
        b.cuboid(-half, half.with_y(size.y), 1);
        self.add(&b, self_from_block)
    }

    /// Adds the surface that a profile of points (radius, height), from bottom to top, sweeps
    /// around the y axis. Its normals are sharp at the points of the profile and smooth around the
    /// axis. Points of radius 0 close the surface.
    pub(super) fn lathe(&mut self, profile: &[Vec2], sides: u32) -> &mut Self {
        for pair in profile.windows(2) {
            let (lo, hi) = (pair[0], pair[1]);
            let along = hi - lo;
            let slope = Vec2::new(along.y, -along.x).normalize_or_zero();
            if slope == Vec2::ZERO {
                continue;
            }
            self.grid([sides, 1], |u, v| {
                // Clockwise as seen from above, so that u × v points outwards.
                let (sin, cos) = turn(-u);
                let p = lo.lerp(hi, v);
                let normal = Vec3::new(slope.x * cos, slope.y, slope.x * sin);
                (Vec3::new(p.x * cos, p.y, p.x * sin), normal)
            });
        }
        self
    }

    /// Adds a smooth parametric surface, closed or open. Its outer side is that of ∂u × ∂v.
    pub(super) fn surface(&mut self, cells: [u32; 2], f: impl Fn(f32, f32) -> Vec3) -> &mut Self {
        // The step is large enough for differences in single precision to keep three good digits.
        const H: f32 = 2e-3;
        self.grid(cells, |u, v| {
            let du = f(u + H, v) - f(u - H, v);
            let dv = f(u, v + H) - f(u, v - H);
            // At a pole one of the two derivatives vanishes, so they are taken a little beside it.
            let normal = du.cross(dv).try_normalize().unwrap_or_else(|| {
                let w = if v < 0.5 { v + 0.01 } else { v - 0.01 };
                let du = f(u + H, w) - f(u - H, w);
                du.cross(f(u, w + H) - f(u, w - H)).normalize_or(Vec3::Y)
            });
            (f(u, v), normal)
        });
        self
    }

    /// Adds a sphere of `rings` rings and twice as many sectors; all its corners lie on the sphere.
    pub(super) fn ball(&mut self, center: Vec3, radius: f32, rings: u32) -> &mut Self {
        let rings = rings.max(2);
        self.grid([2 * rings, rings], |u, v| {
            let (sin_u, cos_u) = turn(-u);
            let (sin_v, cos_v) = turn(v / 2.0);
            let normal = Vec3::new(sin_v * cos_u, -cos_v, sin_v * sin_u);
            (center + normal * radius, normal)
        });
        self
    }

    /// Adds a round tube along `path`, with a radius at each of its points. Both ends are open.
    pub(super) fn tube(&mut self, path: &[Vec3], radii: &[f32], sides: u32) -> &mut Self {
        let last = path.len() - 1;
        let tangent = |i: usize| (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
        // A frame that is carried along the path without twisting around it.
        let mut across = Vec::with_capacity(path.len());
        for i in 0..path.len() {
            let t = tangent(i);
            let previous = across.last().copied().unwrap_or(t.any_orthonormal_vector());
            across.push((previous - t * previous.dot(t)).normalize_or(t.any_orthonormal_vector()));
        }
        self.grid([sides, last as u32], |u, v| {
            let i = (v * last as f32).round() as usize;
            let (sin, cos) = turn(u);
            let normal = across[i] * cos + tangent(i).cross(across[i]) * sin;
            (path[i] + normal * radii[i], normal)
        });
        self
    }

    /// Adds a ring around `center`, in the plane perpendicular to `normal`. `cells` are the numbers
    /// of quads along the ring and around its tube.
    pub(super) fn torus(
        &mut self,
        center: Vec3,
        normal: Vec3,
        radius: f32,
        tube: f32,
        cells: [u32; 2],
    ) -> &mut Self {
        let n = normal.normalize();
        let across = n.any_orthonormal_vector();
        let other = n.cross(across);
        self.grid(cells, |u, v| {
            let ((sin_u, cos_u), (sin_v, cos_v)) = (turn(u), turn(v));
            let out = across * cos_u + other * sin_u;
            let normal = out * cos_v + n * sin_v;
            (center + out * radius + normal * tube, normal)
        });
        self
    }

    /// Adds a wing from the origin along +x, with its leading edge towards −z. It has an airfoil
    /// 12% thick (NACA 0012), tapers from the first `chord` to the second, and rises by `rise` per
    /// metre.
    pub(super) fn wing(&mut self, span: f32, chord: [f32; 2], rise: f32) -> &mut Self {
        self.surface([28, 14], |u, v| {
            let v = v.clamp(0.0, 1.0);
            let a = -u * TAU;
            let c = 0.5 + 0.5 * a.cos();
            let thickness = 0.6
                * (0.2969 * c.sqrt() - 0.126 * c - 0.3516 * c * c + 0.2843 * c.powi(3)
                    - 0.1036 * c.powi(4));
            // The tip is rounded and thin.
            let tip = (1.0 - v.powi(8)).max(0.0).sqrt();
            let length = (chord[0] + (chord[1] - chord[0]) * v) * (0.35 + 0.65 * tip);
            let lead = 0.25 * (chord[0] - length);
            let y = thickness * length * tip * a.sin().signum();
            Vec3::new(span * v, y + rise * span * v, lead + c * length)
        });
        self
    }

    /// Adds a round bar between two points.
    pub(super) fn bar(&mut self, from: Vec3, to: Vec3, radius: f32, sides: u32) -> &mut Self {
        self.tube(&[from, to], &[radius; 2], sides)
    }

    /// Adds a flat convex polygon. Its corners run counter-clockwise as seen from the front.
    pub(super) fn polygon(&mut self, corners: &[Vec3]) -> &mut Self {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let base = self.mesh.positions.len() as u32;
        for (i, &p) in corners.iter().enumerate() {
            self.vertex(p, normal, Vec2::new(i.min(1) as f32, (i / 2).min(1) as f32));
        }
        let fan = (1..corners.len() as u32 - 1).map(|i| [base, base + i, base + i + 1]);
        self.mesh.triangles.extend(fan);
        self
    }

    /// Adds a flat convex polygon of the plane z = 0 (counter-clockwise as seen from +z), thickened
    /// to ±`half` and transformed.
    pub(super) fn plate(&mut self, outline: &[Vec2], half: f32, to: Affine3A) -> &mut Self {
        let mut b = Self::new();
        let at = |z: f32| outline.iter().map(|p| p.extend(z)).collect::<Vec<_>>();
        let (front, mut back) = (at(half), at(-half));
        for i in 0..outline.len() {
            let j = (i + 1) % outline.len();
            b.polygon(&[back[i], back[j], front[j], front[i]]);
        }
        back.reverse();
        b.polygon(&front).polygon(&back);
        self.add(&b, to)
    }

    /// Adds `cells` quads of a surface, for which `f` gives position and normal over [0, 1]².
    fn grid(&mut self, cells: [u32; 2], f: impl Fn(f32, f32) -> (Vec3, Vec3)) {
        let [nu, nv] = cells;
        let base = self.mesh.positions.len() as u32;
        for j in 0..=nv {
            for i in 0..=nu {
                let uv = Vec2::new(i as f32 / nu as f32, j as f32 / nv as f32);
                let (position, normal) = f(uv.x, uv.y);
                self.vertex(position, normal, uv);
            }
        }
        for j in 0..nv {
            for i in 0..nu {
                let a = base + j * (nu + 1) + i;
                let c = a + nu + 1;
                for t in [[a, a + 1, c + 1], [a, c + 1, c]] {
                    let [p, q, r] = t.map(|k| self.mesh.positions[k as usize]);
                    // At the tips of cones and the poles of spheres, one triangle of the quad has
                    // no area.
                    if p != q && q != r && r != p {
                        self.mesh.triangles.push(t);
                    }
                }
            }
        }
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal);
        self.mesh.uvs.push(uv);
    }
}

/// Sine and cosine of a fraction of a full turn. They are exact where they are 0, so that seams
/// close and tips are points.
fn turn(fraction: f32) -> (f32, f32) {
    let exact = |x: f32| if x.abs() < 1e-6 { 0.0 } else { x };
    let (sin, cos) = (fraction.fract() * TAU).sin_cos();
    (exact(sin), exact(cos))
}
