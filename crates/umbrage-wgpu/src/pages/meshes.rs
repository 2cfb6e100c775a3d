//! Whole meshes that cast into pages.

use super::data::{self, MeshDraw, Meshing};
use super::pipelines::{buffers_layout, compute, group, module};
use crate::readback::Readback;
use crate::{CasterInstance, Error, Shadows, wgsl};
use glam::{DAffine3, DVec3};
use std::mem::size_of;
use std::num::NonZeroU64;
use std::ops::Range;
use umbrage::{Aabb, Plan};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBinding, BufferBindingType,
    BufferDescriptor, BufferUsages, CommandEncoder, ComputePassDescriptor,
    ComputePassTimestampWrites, ComputePipeline, Device, PollType, Queue, RenderPass, ShaderStages,
};

/// Whole meshes that cast into pages: those that are deformed or move, and all in scenes without
/// clusters. Each mesh is drawn with all of its triangles into each page into which its box may
/// cast, so clusters are faster for all that is larger than a page.
///
/// What is [added](Self::add) stays until it is [cleared](Self::clear).
#[derive(Debug)]
pub struct PageMeshes {
    pipelines: [ComputePipeline; 3],
    list_layout: BindGroupLayout,
    draw_layout: BindGroupLayout,
    /// Bytes between two elements of a buffer that bind groups show one by one.
    stride: u32,
    meshes: Vec<PageMesh>,
    draws: Vec<PageMeshDraw>,
    /// The draw of each mesh.
    draw_of: Vec<u32>,
    room: u32,
    most: u32,
    buffers: Option<Buffers>,
    readbacks: [Readback<Pending>; 3],
    encoded: u64,
    counted: u64,
    counts: PageMeshCounts,
}

/// An instance of a mesh that casts into pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PageMesh {
    /// The matrix from mesh space to world space.
    pub world_from_mesh: DAffine3,
    /// A box around the instance, world space, metres.
    pub bounds: Aabb,
}

/// What is drawn of some instances: a range of an index buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageMeshDraw {
    /// The indices of the triangles.
    pub indices: Range<u32>,
    /// What is added to each index.
    pub base_vertex: i32,
    /// The index in the plan of the one light into whose pages the draw casts; `None` for all
    /// lights.
    pub light: Option<usize>,
}

/// What became of the meshes of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageMeshCounts {
    /// Instances, one for each page that a mesh may cast into.
    pub instances: u32,
    /// Their triangles.
    pub triangles: u64,
    /// Whether all instances had room. If not, the next frame has more of it.
    pub is_complete: bool,
}

/// The pass in which meshes are drawn into pages.
#[derive(Debug)]
pub struct PageMeshPass<'p, 'e> {
    /// The render pass. Set [pipelines](crate::MeshCasters::for_pages), masks in bind group 1,
    /// vertex buffers and the index buffer, and leave the other bind groups as they are.
    pub pass: &'p mut RenderPass<'e>,
    pub(super) meshes: &'p PageMeshes,
    pub(super) drawn: u32,
}

impl PageMeshPass<'_, '_> {
    /// The number of draws.
    pub fn draws(&self) -> u32 {
        self.meshes.draws()
    }

    /// Draws with the number that [`PageMeshes::add`] gave: indirectly, so that a draw without
    /// instances costs little.
    pub fn draw(&mut self, draw: u32) {
        let Some(buffers) = &self.meshes.buffers else { return };
        if draw < self.meshes.draws.len() as u32 {
            let offset = draw * self.meshes.stride;
            self.pass.set_bind_group(wgsl::PAGE_MESH_GROUP, &buffers.draw_group, &[offset]);
            self.pass.draw_indexed_indirect(&buffers.calls, u64::from(draw) * 20);
            self.drawn += 1;
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    number: u64,
    room: u32,
}

#[derive(Debug)]
struct Buffers {
    sizes: Sizes,
    meshing: Buffer,
    draws: Buffer,
    meshes: Buffer,
    calls: Buffer,
    counts: Buffer,
    list: ListBuffers,
    draw_group: BindGroup,
}

/// Those that only the lists of a frame need.
#[derive(Debug)]
struct ListBuffers {
    found: Buffer,
    pairs: Buffer,
    firsts: Buffer,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sizes {
    meshes: usize,
    draws: usize,
    room: u32,
}

/// What meshes are listed for.
pub(super) struct MeshesIn<'a> {
    pub(super) plan: &'a Plan,
    pub(super) render_origin: DVec3,
    pub(super) reach_texels: u32,
    /// Whether the pages count alone in which what stands still is drawn.
    pub(super) is_still: bool,
    /// Levels, maps, and what is drawn.
    pub(super) pages: [&'a Buffer; 3],
}

/// Words of the counts that come back, and the words ahead of the draws' own.
const COUNTED: usize = 3;
const HEAD: usize = 4;

/// Instances that there is room for at first.
const FIRST_ROOM: u32 = 1 << 12;

/// Workgroups in a row of a dispatch, `SHADOW_PAGE_MESH_ROW` of `wgsl/page_meshes.wesl`.
const ROW: u32 = 1 << 15;

/// Workgroups that put instances in their places.
const PLACING: u32 = 64;

/// The entry points of the passes that list meshes.
const PASSES: [&str; 3] =
    ["shadow_page_find_meshes", "shadow_page_allot_meshes", "shadow_page_place_meshes"];

impl PageMeshes {
    /// An empty list, for shadows with pages.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the shadows have no pages.
    pub fn new(device: &Device, shadows: &Shadows) -> Result<Self, Error> {
        super::check_pages(shadows)?;
        const UNIFORM: BufferBindingType = BufferBindingType::Uniform;
        const READ: BufferBindingType = BufferBindingType::Storage { read_only: true };
        const WRITTEN: BufferBindingType = BufferBindingType::Storage { read_only: false };
        let of_list =
            [UNIFORM, READ, READ, READ, READ, READ, WRITTEN, WRITTEN, WRITTEN, WRITTEN, WRITTEN];
        let list_layout = buffers_layout(device, ShaderStages::COMPUTE, &of_list);
        let draw_layout = draw_layout(device);
        let text = module(device, wgsl::page_meshes());
        let limits = device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        Ok(Self {
            pipelines: PASSES.map(|pass| compute(device, &text, &[Some(&list_layout)], pass)),
            list_layout,
            draw_layout,
            stride: limits.min_storage_buffer_offset_alignment.max(16),
            meshes: Vec::new(),
            draws: Vec::new(),
            draw_of: Vec::new(),
            room: FIRST_ROOM,
            most: (bytes / size_of::<[u32; 4]>() as u64).min(u64::from(u32::MAX)) as u32,
            buffers: None,
            readbacks: [(); 3]
                .map(|()| Readback::new(device, "shadow page meshes", 4 * COUNTED as u64)),
            encoded: 0,
            counted: 0,
            counts: PageMeshCounts { instances: 0, triangles: 0, is_complete: true },
        })
    }

    /// Removes all meshes.
    pub fn clear(&mut self) {
        self.meshes.clear();
        self.draws.clear();
        self.draw_of.clear();
    }

    /// Adds instances of a mesh that one call draws. Returns the number of the draw, for
    /// [`PageMeshPass::draw`]. Instances whose boxes are empty cast nowhere.
    pub fn add(
        &mut self,
        draw: PageMeshDraw,
        instances: impl IntoIterator<Item = PageMesh>,
    ) -> u32 {
        let number = self.draws.len() as u32;
        let has_box = |mesh: &PageMesh| !mesh.bounds.is_empty();
        self.meshes.extend(instances.into_iter().filter(has_box));
        self.draw_of.resize(self.meshes.len(), number);
        self.draws.push(draw);
        number
    }

    /// The number of draws.
    pub fn draws(&self) -> u32 {
        self.draws.len() as u32
    }

    /// Checks that all meshes are somewhere.
    pub(super) fn check(&self) -> Result<(), Error> {
        let is_sound = |mesh: &PageMesh| {
            let Aabb { min, max } = mesh.bounds;
            mesh.world_from_mesh.is_finite() && min.is_finite() && max.is_finite()
        };
        match self.meshes.iter().find(|mesh| !is_sound(mesh)) {
            Some(bad) => Err(Error::Invalid {
                field: "parts.meshes",
                problem: format!("must have finite transforms and boxes, but one has {bad:?}"),
            }),
            None => Ok(()),
        }
    }

    /// What became of the meshes of the newest frame that the device has told of. Where it was not
    /// complete, casters are missing from pages: draw them again with
    /// [`Casters::Moved`](crate::Casters::Moved). This does not wait for the device.
    pub fn counts(&mut self, device: &Device) -> PageMeshCounts {
        // A lost device has no news; what was counted before stays.
        let _ = device.poll(PollType::Poll);
        self.collect();
        self.counts
    }

    /// Whether [`counts`](Self::counts) are those of the last frame that was encoded.
    pub fn is_counted(&self) -> bool {
        self.counted == self.encoded
    }

    fn collect(&mut self) {
        let Self { readbacks, counted, counts, room, most, .. } = self;
        for readback in readbacks {
            readback.receive(|pending, bytes| {
                if pending.number <= *counted {
                    return;
                }
                let words: &[u32] = bytemuck::cast_slice(bytes);
                *counted = pending.number;
                *counts = PageMeshCounts {
                    instances: words[0],
                    triangles: u64::from(words[2]),
                    is_complete: words[0] <= pending.room,
                };
                if words[0] > *room {
                    *room = words[0].saturating_add(words[0] / 2).min(*most);
                }
            });
        }
    }

    /// Encodes the passes that list the meshes of pages that are drawn.
    pub(super) fn encode(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        pages: &MeshesIn<'_>,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) {
        self.collect();
        let wanted = Sizes { meshes: self.meshes.len(), draws: self.draws.len(), room: self.room };
        if !self.buffers.as_ref().is_some_and(|buffers| buffers.sizes.hold(wanted)) {
            let before = self.buffers.as_ref().map_or(Sizes::default(), |buffers| buffers.sizes);
            self.buffers = Some(self.make(device, before.with_room_for(wanted)));
        }
        let Some(buffers) = &self.buffers else { return };
        let MeshesIn { plan, render_origin, reach_texels, is_still, pages } = *pages;
        let meshing = Meshing {
            meshes: self.meshes.len() as u32,
            draws: self.draws.len() as u32,
            maps: plan.maps.len() as u32,
            room: buffers.sizes.room,
            reach: reach_texels as f32 + 1.0,
            is_still: if is_still { data::STILL } else { 0 },
            stride: self.stride / 4,
        };
        let mesh = |(mesh, &draw): (&PageMesh, &u32)| {
            let instance = CasterInstance::new(&mesh.world_from_mesh, render_origin);
            let [low, high] = [mesh.bounds.min, mesh.bounds.max].map(|p| p - render_origin);
            // Rounding must not make the box smaller.
            let slack = low.abs().max(high.abs()) * f64::from(f32::EPSILON);
            data::PageMesh {
                render_from_mesh: instance.render_from_mesh,
                low: (low - slack).as_vec3(),
                draw,
                high: (high + slack).as_vec3(),
                padding: 0,
            }
        };
        let meshes: Vec<_> = self.meshes.iter().zip(&self.draw_of).map(mesh).collect();
        let draw = |draw: &PageMeshDraw| {
            let PageMeshDraw { indices, base_vertex, light } = draw;
            let maps = match light {
                Some(light) => plan.lights.get(*light).map_or(0..0, |light| light.maps.clone()),
                None => 0..plan.maps.len(),
            };
            MeshDraw {
                first_index: indices.start,
                index_count: indices.len() as u32,
                base_vertex: *base_vertex,
                first_map: maps.start as u32,
                end_map: maps.end as u32,
            }
        };
        let draws: Vec<_> = self.draws.iter().map(draw).collect();
        queue.write_buffer(&buffers.meshing, 0, bytemuck::bytes_of(&meshing));
        queue.write_buffer(&buffers.meshes, 0, bytemuck::cast_slice(&meshes));
        queue.write_buffer(&buffers.draws, 0, bytemuck::cast_slice(&draws));
        encoder.clear_buffer(&buffers.counts, 0, None);
        let [levels, maps, shown] = pages;
        let ListBuffers { found, pairs, firsts } = &buffers.list;
        let of_list = [
            &buffers.meshing,
            &buffers.draws,
            &buffers.meshes,
            levels,
            maps,
            shown,
            found,
            pairs,
            firsts,
            &buffers.calls,
            &buffers.counts,
        ];
        let of_list = group(device, &self.list_layout, &of_list);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("shadow page meshes"),
            timestamp_writes: timestamps,
        });
        pass.set_bind_group(0, &of_list, &[]);
        let rows = meshing.meshes.div_ceil(ROW);
        let dispatches =
            [[meshing.meshes.min(ROW), rows], [meshing.draws.div_ceil(64), 1], [PLACING, 1]];
        for (pipeline, [across, rows]) in self.pipelines.iter().zip(dispatches) {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(across, rows, 1);
        }
        drop(pass);
        self.encoded += 1;
        if let Some(readback) = self.readbacks.iter_mut().find(|r| r.is_free()) {
            let pending = Pending { number: self.encoded, room: meshing.room };
            readback.send(encoder, &buffers.counts, pending);
        }
    }

    fn make(&self, device: &Device, sizes: Sizes) -> Buffers {
        let buffer = |bytes: usize, usage: BufferUsages| {
            device.create_buffer(&BufferDescriptor {
                label: Some("shadow page meshes"),
                size: bytes.max(16) as u64,
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let stored = |n: usize, size: usize| buffer(n * size, BufferUsages::STORAGE);
        let indirect = BufferUsages::STORAGE | BufferUsages::INDIRECT;
        let counted = BufferUsages::STORAGE | BufferUsages::COPY_SRC;
        let room = sizes.room as usize;
        let list = ListBuffers {
            found: stored(room, size_of::<[u32; 4]>()),
            pairs: stored(room, size_of::<[u32; 2]>()),
            firsts: stored(sizes.draws, self.stride as usize),
        };
        let meshes = stored(sizes.meshes, size_of::<data::PageMesh>());
        let first = BindingResource::Buffer(BufferBinding {
            buffer: &list.firsts,
            offset: 0,
            size: NonZeroU64::new(4),
        });
        let resources = [first, list.pairs.as_entire_binding(), meshes.as_entire_binding()];
        let entries = (0..).zip(resources);
        let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
        let draw_group = device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow page meshes"),
            layout: &self.draw_layout,
            entries: &entries.collect::<Vec<_>>(),
        });
        Buffers {
            sizes,
            meshing: buffer(size_of::<Meshing>(), BufferUsages::UNIFORM),
            draws: stored(sizes.draws, size_of::<MeshDraw>()),
            meshes,
            calls: buffer(20 * sizes.draws, indirect),
            counts: buffer(4 * (HEAD + sizes.draws), counted),
            list,
            draw_group,
        }
    }
}

impl Sizes {
    fn hold(self, other: Self) -> bool {
        other.meshes <= self.meshes && other.draws <= self.draws && other.room <= self.room
    }

    fn with_room_for(self, other: Self) -> Self {
        Self {
            meshes: self.meshes.max(other.meshes.next_power_of_two()),
            draws: self.draws.max(other.draws.next_power_of_two()),
            room: self.room.max(other.room),
        }
    }
}

/// The layout of the bind group by which vertex stages find the instances of a draw.
pub(crate) fn draw_layout(device: &Device) -> BindGroupLayout {
    let entry = |binding| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX,
        ty: BindingType::Buffer {
            ty: BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: binding == 0,
            min_binding_size: None,
        },
        count: None,
    };
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("shadow page meshes"),
        entries: &[entry(0), entry(1), entry(2)],
    })
}
