//! Culling, sorting and uploading of the instances that are drawn.

use crate::scene::{Drawable, SceneBuffers};
use crate::{Error, Gpu};
use glam::DVec3;
use std::ops::Range;
use umbrage::Aabb;
use umbrage_wgpu::CasterInstance;
use wgpu::{Buffer, BufferDescriptor, BufferUsages};

/// Lists of instances to draw, one after the other.
pub(crate) struct Instances {
    /// All instances of the scene, in the order of those in [`Placed`](crate::scene::Placed). Maps
    /// and picture copy from here those that they draw.
    all: Vec<CasterInstance>,
    /// World position of the origin that `all` is relative to, metres, and the version of the
    /// scene's instances; `None` before the first frame.
    origin: Option<(DVec3, u64)>,
    list: Vec<CasterInstance>,
    draws: Vec<Draw>,
    /// The instances of a picture: how far away each is, and below that its index.
    order: Vec<u64>,
    pub(crate) buffer: Buffer,
}

/// A draw call: several instances of one mesh.
#[derive(Clone, Debug)]
pub(crate) struct Draw {
    pub(crate) mesh: usize,
    pub(crate) instances: Range<u32>,
    /// The mesh's triangles that are drawn.
    pub(crate) triangles: Range<u32>,
}

/// A triangle that is edge-on to a lamp and is left out of the lamp's maps. Seen from the lamp it
/// has no area, but if it touches the lamp, single precision may put it before the lamp, where it
/// would hide everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeOn {
    /// Index of the light in the plan.
    pub light: usize,
    /// Index in [`Scene::instances`](umbrage_scene::Scene::instances).
    pub instance: usize,
    /// Index in [`Mesh::triangles`](umbrage_scene::Mesh::triangles).
    pub triangle: u32,
}

/// A range of draws: those of a map, or those of the picture.
pub(crate) type DrawList = Range<usize>;

/// The number of low bits by which two squared distances may differ and still count as equal.
/// Instances of one mesh whose distances lie within about an eighth of an octave share a draw.
const DISTANCE_BITS: u32 = 23 - 2;

impl Instances {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            all: Vec::new(),
            origin: None,
            list: Vec::new(),
            draws: Vec::new(),
            order: Vec::new(),
            buffer: instance_buffer(gpu, 4096),
        }
    }

    /// Begins new lists, whose instances are relative to `origin` (world space, metres).
    pub(crate) fn begin(&mut self, scene: &SceneBuffers, origin: DVec3) {
        self.list.clear();
        self.draws.clear();
        let placed = scene.placed();
        let now = Some((origin, placed.version));
        if self.origin != now {
            self.all.clear();
            let at = |i: &Drawable| CasterInstance::new(&i.world_from_mesh, origin);
            self.all.extend(placed.instances.iter().map(at));
            self.origin = now;
        }
    }

    /// Adds all instances that cast and whose box `is_drawn`, with one draw for those of one mesh
    /// as long as no triangle of theirs is `left_out`. The triangles that are left out of an
    /// instance ascend.
    pub(crate) fn add_casters(
        &mut self,
        scene: &SceneBuffers,
        is_drawn: impl Fn(Aabb) -> bool,
        left_out: &(impl Iterator<Item = EdgeOn> + Clone),
    ) -> DrawList {
        let first_draw = self.draws.len();
        for (i, instance) in scene.placed().instances.iter().enumerate() {
            if !(instance.role.casts && is_drawn(instance.bounds)) {
                continue;
            }
            let all = scene.meshes[instance.mesh].triangles();
            let mut first = 0;
            for left_out in left_out.clone().filter(|e| e.instance == instance.instance) {
                self.push(first_draw, instance.mesh, i, first..left_out.triangle);
                first = left_out.triangle + 1;
            }
            self.push(first_draw, instance.mesh, i, first..all);
        }
        first_draw..self.draws.len()
    }

    /// Adds all instances that are seen and whose box `is_drawn`, the nearest to `eye` (world
    /// space, metres) first: few fragments are then shaded that others hide. The farthest corner of
    /// a box counts, so that ground and walls follow what stands before them.
    pub(crate) fn add_nearest_first(
        &mut self,
        scene: &SceneBuffers,
        eye: DVec3,
        is_drawn: impl Fn(Aabb) -> bool,
    ) -> DrawList {
        self.order.clear();
        let placed = scene.placed();
        for (i, instance) in placed.instances.iter().enumerate() {
            if instance.role.is_seen && is_drawn(instance.bounds) {
                let Aabb { min, max } = instance.bounds;
                let squared = (min - eye).abs().max((max - eye).abs()).length_squared() as f32;
                // Positive numbers are ordered as their bits are.
                let step = u64::from(squared.to_bits() >> DISTANCE_BITS);
                self.order.push(step << 32 | i as u64);
            }
        }
        self.order.sort_unstable();
        let first_draw = self.draws.len();
        for k in 0..self.order.len() {
            let i = self.order[k] as u32 as usize;
            let mesh = placed.instances[i].mesh;
            self.push(first_draw, mesh, i, 0..scene.meshes[mesh].triangles());
        }
        first_draw..self.draws.len()
    }

    /// Adds triangles of an instance to the last draw, or to a new one if that draws another mesh,
    /// other triangles, or is not of the list that begins with `first_draw`.
    fn push(&mut self, first_draw: usize, mesh: usize, instance: usize, triangles: Range<u32>) {
        if triangles.is_empty() {
            return;
        }
        let index = self.list.len() as u32;
        self.list.push(self.all[instance]);
        match self.draws[first_draw..].last_mut() {
            Some(draw) if draw.mesh == mesh && draw.triangles == triangles => {
                draw.instances.end = index + 1;
            }
            _ => self.draws.push(Draw { mesh, instances: index..index + 1, triangles }),
        }
    }

    /// The draws of a list.
    pub(crate) fn draws(&self, list: DrawList) -> &[Draw] {
        &self.draws[list]
    }

    pub(crate) fn upload(&mut self, gpu: &Gpu) -> Result<(), Error> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.list);
        if self.buffer.size() < bytes.len() as u64 {
            let max = gpu.device().limits().max_buffer_size;
            if bytes.len() as u64 > max {
                return Err(Error::TooLarge {
                    what: format!("the list of {} instances to draw", self.list.len()),
                    problem: format!("a buffer holds at most {max} bytes"),
                });
            }
            self.buffer = instance_buffer(gpu, (bytes.len() as u64).next_power_of_two().min(max));
        }
        gpu.queue().write_buffer(&self.buffer, 0, bytes);
        Ok(())
    }
}

fn instance_buffer(gpu: &Gpu, size: u64) -> Buffer {
    gpu.device().create_buffer(&BufferDescriptor {
        label: Some("instances"),
        size,
        usage: BufferUsages::VERTEX | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
