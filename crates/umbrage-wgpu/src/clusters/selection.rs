use super::data::{self, Descent, Drawing, Indexing, Item, Origin, Span};
use super::geometry::{ClusterGeometry, buffer};
use super::occluders::ClusterOccluders;
use super::view::ClusterView;
use crate::readback::Readback;
use crate::{Error, MeshCasters, Support};
use glam::DVec3;
use std::mem::size_of;
use std::ops::Range;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferBinding, BufferDescriptor, BufferUsages, CommandEncoder, ComputePassDescriptor,
    ComputePassTimestampWrites, ComputePipeline, Device, IndexFormat, PollType, Queue, RenderPass,
};

/// The most rounds of a descent: eight to the power of these is more than there can be instances
/// and clusters.
const MAX_ROUNDS: usize = data::CHOSEN - 1;
/// Items of a queue that workgroups can be started for.
const MAX_QUEUE: u64 = 65_535 * 64;
/// Blocks of vertices that 24 bits have indices for.
const MAX_BLOCKS: u64 = 1 << 20;
/// The factor by which more error is allowed where the device has no room for what is chosen.
const RELIEF: f32 = 1.5;
/// The error, texels or pixels, that relief begins at where none is allowed, of which no factor is
/// any more.
const LEAST_RELIEVED: f32 = 1.0 / 64.0;

/// Chooses the clusters to draw for some views, on the device, and holds what to draw.
#[derive(Debug)]
pub struct ClusterSelection {
    room: Room,
    most: Room,
    /// The factor by which more error is allowed than the views ask for.
    relief: f32,
    alignment: u32,
    buffers: Option<Buffers>,
    draws: u32,
    slots: [Readback<Pending>; 3],
    /// How often something was chosen, and how often when the newest counts were made.
    encoded: u64,
    /// The placements of instances for which something was chosen last.
    placements: u64,
    counted: u64,
    counts: ClusterCounts,
}

/// What was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterCounts {
    /// Triangles to draw, for all views together.
    pub triangles: u64,
    /// Clusters to draw.
    pub clusters: u64,
    /// Whether all that should be drawn had room. If not, the next choice has more of it, or takes
    /// less.
    pub is_complete: bool,
    /// Whether something could hide clusters.
    pub has_occluders: bool,
    /// The factor by which more error is allowed than the views ask for: 1, but where the device has
    /// no room for what they ask for.
    pub relief: f32,
}

/// Numbers of elements that buffers have room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Room {
    queue: u32,
    choices: u32,
    triangles: u32,
    /// Of 16 vertices each.
    blocks: u32,
}

#[derive(Debug)]
struct Buffers {
    room: Room,
    sizes: Sizes,
    descent: Buffer,
    views: Buffer,
    planes: Buffer,
    spans: Buffer,
    drawing: Buffer,
    indexing: Buffer,
    queues: [Buffer; 2],
    counts: Buffer,
    /// Workgroups of even and of odd rounds, and those that write indices.
    groups: [Buffer; 2],
    index_groups: Buffer,
    /// What `groups` hold before the first round.
    no_groups: Buffer,
    draws: Buffer,
    indices: Buffer,
    descent_group: BindGroup,
    round_groups: [BindGroup; 2],
    draws_group: BindGroup,
    indices_group: BindGroup,
    /// Of the triangles that pages show.
    triangles_group: BindGroup,
    origin: Buffer,
    vertex_group: BindGroup,
}

/// The numbers of views, planes, draws and spans that buffers have room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sizes {
    views: usize,
    planes: usize,
    draws: usize,
    spans: usize,
}

/// What a choice depends on beside its views.
struct Others<'a> {
    /// The bind group of what hides clusters.
    hides: Option<&'a BindGroup>,
    has_occluders: bool,
    pages: Option<&'a ForPages<'a>>,
}

/// What a choice for pages depends on.
pub(crate) struct ForPages<'a> {
    /// The bind group of the pages that are fresh.
    pub(crate) shown: &'a BindGroup,
    /// The pipeline that finds the triangles which they show.
    pub(crate) triangles: &'a ComputePipeline,
}

/// A choice whose counts are on their way.
#[derive(Clone, Copy, Debug)]
struct Pending {
    number: u64,
    room: Room,
    relief: f32,
    has_occluders: bool,
    in_pages: bool,
}

/// Words of the counts that come back.
const COUNTED: usize = data::DRAWS;

impl ClusterSelection {
    /// A selection that has not chosen anything.
    pub fn new(device: &Device, support: &Support, geometry: &ClusterGeometry) -> Self {
        let readback = || Readback::new(device, "shadow cluster counts", 4 * COUNTED as u64);
        // Scenes of millions of triangles rarely show more; for others that is all there is.
        let triangles = geometry.most_triangles.clamp(1 << 12, 1 << 21) as u32;
        let limits = device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = |size: u64, most: u64| (bytes / size).min(most) as u32;
        let most = Room {
            queue: most(size_of::<Item>() as u64, MAX_QUEUE),
            choices: most(size_of::<data::Choice>() as u64, u64::from(u32::MAX)),
            triangles: most(12, u64::from(u32::MAX) / 12),
            blocks: most(16, MAX_BLOCKS),
        };
        let blocks = triangles / 16;
        let room = Room { queue: 1 << 16, choices: triangles / 32, triangles, blocks }.within(most);
        Self {
            room,
            most,
            relief: 1.0,
            alignment: support.uniform_alignment,
            buffers: None,
            draws: 0,
            slots: [(); 3].map(|()| readback()),
            encoded: 0,
            placements: 0,
            counted: 0,
            counts: ClusterCounts {
                triangles: 0,
                clusters: 0,
                is_complete: true,
                has_occluders: false,
                relief: 1.0,
            },
        }
    }

    /// Encodes the choice of clusters for some views. Points of render space are relative to
    /// `render_origin` (world space, metres). In each view, draws of `0..batches` follow one
    /// another; one draw of the batches `0..together` of each view comes for free.
    /// Submit what was encoded before you encode again, because all choices share buffers.
    ///
    /// Pictures leave out what `occluders` hide, which must be those of the one picture among the
    /// views.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `render_origin` is not finite.
    #[expect(clippy::too_many_arguments, reason = "device, queue and encoder are one in spirit")]
    pub fn encode(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        geometry: &ClusterGeometry,
        views: &[ClusterView],
        render_origin: DVec3,
        together: u32,
        occluders: Option<&ClusterOccluders>,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) -> Result<(), Error> {
        let hides = occluders.and_then(ClusterOccluders::group);
        let others = Others { hides, has_occluders: occluders.is_some(), pages: None };
        let to = (device, queue, encoder);
        self.encode_with(to, geometry, views, render_origin, together, &others, timestamps)
    }

    /// Encodes the choice of clusters for the fresh pages of maps.
    pub(crate) fn encode_pages(
        &mut self,
        to: (&Device, &Queue, &mut CommandEncoder),
        geometry: &ClusterGeometry,
        views: &[ClusterView],
        render_origin: DVec3,
        pages: &ForPages<'_>,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) -> Result<(), Error> {
        let others = Others { hides: None, has_occluders: false, pages: Some(pages) };
        self.encode_with(to, geometry, views, render_origin, 0, &others, timestamps)
    }

    #[expect(clippy::too_many_arguments, reason = "device, queue and encoder are one in spirit")]
    fn encode_with(
        &mut self,
        (device, queue, encoder): (&Device, &Queue, &mut CommandEncoder),
        geometry: &ClusterGeometry,
        views: &[ClusterView],
        render_origin: DVec3,
        together: u32,
        others: &Others<'_>,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) -> Result<(), Error> {
        if !render_origin.is_finite() {
            return Err(Error::Invalid {
                field: "render_origin",
                problem: format!("must be finite, is {render_origin}"),
            });
        }
        self.collect();
        let mut data = Vec::with_capacity(views.len());
        let mut planes = Vec::new();
        let mut spans = Vec::new();
        let mut draws = 0;
        for view in views {
            // All pages are drawn together.
            let first_draw = if view.pages.is_some() { 0 } else { draws };
            let mut own = view.data(planes.len() as u32, first_draw);
            if self.relief > 1.0 {
                own.share = own.share.max(LEAST_RELIEVED) * self.relief;
            }
            data.push(own);
            planes.extend_from_slice(&view.planes);
            let batches =
                if view.is_picture { geometry.seen_batches } else { geometry.caster_batches };
            if view.pages.is_none() {
                spans.push(Span { first: first_draw, count: together.min(batches) });
            }
            draws = first_draw + batches;
        }
        self.draws = draws;
        let wanted = Sizes {
            views: data.len(),
            planes: planes.len(),
            // In pages, one draw of each batch for triangles inside, and one for others.
            draws: draws as usize
                + if others.pages.is_some() { draws as usize } else { spans.len() },
            spans: spans.len(),
        };
        self.room.queue = self.room.queue.max(views.len() as u32);
        let room = self.room;
        let holds = |b: &Buffers| b.room == room && b.sizes.hold(wanted);
        if !self.buffers.as_ref().is_some_and(holds) {
            let sizes = self.buffers.as_ref().map_or(Sizes::default(), |b| b.sizes);
            let sizes = sizes.with_room_for(wanted);
            self.buffers = Some(Buffers::new(device, geometry, room, sizes, self.alignment));
        }
        let relief = self.relief;
        let Some(buffers) = &self.buffers else { return Ok(()) };
        let origin = Origin::new(render_origin - geometry.origin);
        let write = |buffer: &Buffer, bytes: &[u8]| queue.write_buffer(buffer, 0, bytes);
        write(
            &buffers.descent,
            bytemuck::bytes_of(&Descent {
                origin,
                queue: room.queue,
                choices: room.choices,
                padding: [0; 2],
            }),
        );
        write(&buffers.origin, bytemuck::bytes_of(&origin));
        write(&buffers.views, bytemuck::cast_slice(&data));
        write(&buffers.planes, bytemuck::cast_slice(&planes));
        write(&buffers.spans, bytemuck::cast_slice(&spans));
        let drawing = Drawing {
            draws,
            spans: spans.len() as u32,
            choices: room.choices,
            triangles: room.triangles,
            in_pages: others.pages.is_some().into(),
        };
        write(&buffers.drawing, bytemuck::bytes_of(&drawing));
        let Room { choices, triangles, blocks, .. } = room;
        write(
            &buffers.indexing,
            bytemuck::bytes_of(&Indexing { choices, triangles, blocks, draws }),
        );
        let items =
            (0..views.len() as u32).map(|view| Item { view, instance: 0, node: geometry.root });
        write(&buffers.queues[0], bytemuck::cast_slice(&items.collect::<Vec<_>>()));
        encoder.clear_buffer(&buffers.counts, 0, None);
        write(&buffers.no_groups, bytemuck::cast_slice(&first_groups(views.len() as u32)));
        for groups in &buffers.groups {
            encoder.copy_buffer_to_buffer(&buffers.no_groups, 0, groups, 0, groups.size());
        }
        // The number of views is the only count that is not 0 at first.
        let at_counts = (GROUP_WORDS * 4) as u64;
        encoder.copy_buffer_to_buffer(&buffers.no_groups, at_counts, &buffers.counts, 0, 4);
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                label: Some("shadow clusters"),
                timestamp_writes: timestamps,
            });
            let pipelines = &geometry.pipelines;
            match (others.pages, &pipelines.descend_pages) {
                (Some(pages), Some(descend)) => {
                    pass.set_pipeline(descend);
                    pass.set_bind_group(3, pages.shown, &[]);
                }
                _ => pass.set_pipeline(&pipelines.descend),
            }
            pass.set_bind_group(0, &buffers.descent_group, &[]);
            pass.set_bind_group(2, others.hides.unwrap_or(&geometry.nothing_hides), &[]);
            for round in 0..geometry.rounds.min(MAX_ROUNDS as u32) {
                let is_odd = round as usize & 1;
                pass.set_bind_group(1, &buffers.round_groups[is_odd], &[round * self.alignment]);
                let offset = u64::from(round / 2) * 12;
                pass.dispatch_workgroups_indirect(&buffers.groups[is_odd], offset);
            }
            pass.set_pipeline(&pipelines.draws);
            pass.set_bind_group(0, &buffers.draws_group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
            match others.pages {
                Some(pages) => {
                    pass.set_pipeline(pages.triangles);
                    pass.set_bind_group(0, &buffers.triangles_group, &[]);
                }
                None => {
                    pass.set_pipeline(&pipelines.indices);
                    pass.set_bind_group(0, &buffers.indices_group, &[]);
                }
            }
            pass.dispatch_workgroups_indirect(&buffers.index_groups, 0);
        }
        self.encoded += 1;
        self.placements = geometry.placements;
        if let Some(slot) = self.slots.iter_mut().find(|slot| slot.is_free()) {
            let (number, has_occluders) = (self.encoded, others.has_occluders);
            let in_pages = others.pages.is_some();
            let pending = Pending { number, room, relief, has_occluders, in_pages };
            slot.send(encoder, &buffers.counts, pending);
        }
        Ok(())
    }

    /// The bind group with which vertex stages read what was chosen last; `None` before that.
    pub fn vertex_group(&self) -> Option<&BindGroup> {
        self.buffers.as_ref().map(|b| &b.vertex_group)
    }

    /// Prepares what was chosen last to be drawn once more, before it is chosen anew, as seen from
    /// another origin of render space. Returns the bind group for vertex stages; `None` if nothing
    /// was chosen, or if instances have moved since.
    pub fn draw_again(
        &self,
        queue: &Queue,
        geometry: &ClusterGeometry,
        render_origin: DVec3,
    ) -> Option<&BindGroup> {
        let buffers = self.buffers.as_ref()?;
        (self.placements == geometry.placements).then(|| {
            let origin = Origin::new(render_origin - geometry.origin);
            queue.write_buffer(&buffers.origin, 0, bytemuck::bytes_of(&origin));
            &buffers.vertex_group
        })
    }

    /// Draws one batch of a view, whose batches begin at draw `first`, after you set a pipeline and
    /// the [bind group](Self::vertex_group). The draw is indirect, so an empty one costs little.
    pub fn draw(&self, pass: &mut RenderPass<'_>, draw: u32) {
        let Some(buffers) = &self.buffers else { return };
        pass.set_index_buffer(buffers.indices.slice(..), IndexFormat::Uint32);
        pass.draw_indexed_indirect(&buffers.draws, u64::from(draw) * 20);
    }

    /// Draws these draws, each of which casts with the pipeline without or with a mask, in bind
    /// group 1. Returns their number.
    pub(crate) fn draw_batches<'a>(
        &self,
        pass: &mut RenderPass<'_>,
        [opaque, masked]: [&MeshCasters; 2],
        draws: Range<u32>,
        mask_of: impl Fn(u32) -> Option<&'a BindGroup>,
    ) -> u32 {
        let Some(group) = self.vertex_group() else { return 0 };
        pass.set_bind_group(2, group, &[]);
        let mut was_masked = None;
        for draw in draws.clone() {
            let mask = mask_of(draw);
            if was_masked != Some(mask.is_some()) {
                let casters = if mask.is_some() { masked } else { opaque };
                pass.set_pipeline(casters.pipeline());
                was_masked = Some(mask.is_some());
            }
            if let Some(mask) = mask {
                pass.set_bind_group(1, mask, &[]);
            }
            self.draw(pass, draw);
        }
        draws.len() as u32
    }

    /// Draws the batches of a view that are drawn [together](Self::encode).
    pub fn draw_together(&self, pass: &mut RenderPass<'_>, view: u32) {
        self.draw(pass, self.draws + view);
    }

    /// The counts of the newest choice that have come back. This does not wait for the device.
    pub fn counts(&mut self, device: &Device) -> ClusterCounts {
        // A lost device has no news; what was counted before stays.
        let _ = device.poll(PollType::Poll);
        self.collect();
        self.counts
    }

    /// Whether [`counts`](Self::counts) are those of the last choice.
    pub fn is_counted(&self) -> bool {
        self.counted == self.encoded
    }

    /// Takes in the counts that have come back.
    fn collect(&mut self) {
        for i in 0..self.slots.len() {
            let mut received = None;
            self.slots[i].receive(|pending, bytes| {
                let mut words = [0; COUNTED];
                words.copy_from_slice(bytemuck::cast_slice(bytes));
                received = Some((pending, words));
            });
            if let Some((pending, words)) = received {
                self.learn(pending, &words);
            }
        }
    }

    /// Takes in the counts of a choice, and makes room where there was too little.
    fn learn(&mut self, pending: Pending, words: &[u32; COUNTED]) {
        let Pending { number, room, relief, has_occluders, in_pages } = pending;
        if number <= self.counted {
            return;
        }
        let queue = words[..data::CHOSEN].iter().copied().max().unwrap_or(0);
        let chosen = words[data::CHOSEN];
        let triangles = words[data::TRIANGLES];
        let blocks = words[data::BLOCKS];
        let is_complete = queue <= room.queue
            && chosen <= room.choices
            && triangles <= room.triangles
            && blocks <= room.blocks;
        self.counted = number;
        self.counts = ClusterCounts {
            triangles: u64::from(if in_pages { words[data::SHOWN] } else { triangles }),
            clusters: u64::from(chosen),
            is_complete,
            has_occluders,
            relief,
        };
        // What was cut off would have needed more yet, so room grows by steps.
        let grown = |has: u32, needs: u32| {
            let half_more = needs.saturating_add(needs / 2);
            if needs > has { half_more.max(has) } else { has }
        };
        let grown = Room {
            queue: grown(self.room.queue, queue),
            choices: grown(self.room.choices, chosen),
            triangles: grown(self.room.triangles, triangles),
            blocks: grown(self.room.blocks, blocks),
        }
        .within(self.most);
        if !is_complete && grown == self.room && relief == self.relief {
            self.relief *= RELIEF;
        }
        self.room = grown;
    }
}

/// Words of the workgroups of half of all rounds.
const GROUP_WORDS: usize = 3 * MAX_ROUNDS.div_ceil(2);

/// The workgroups of rounds before the first: none, but for the first round, which has an item for
/// each view; and then the number of views.
fn first_groups(views: u32) -> [u32; GROUP_WORDS + 1] {
    let mut words = [0; GROUP_WORDS + 1];
    for group in words[..GROUP_WORDS].chunks_mut(3) {
        group.copy_from_slice(&[0, 1, 1]);
    }
    words[0] = views.div_ceil(64);
    words[GROUP_WORDS] = views;
    words
}

impl Room {
    fn within(self, most: Self) -> Self {
        Self {
            queue: self.queue.min(most.queue),
            choices: self.choices.min(most.choices),
            triangles: self.triangles.min(most.triangles),
            blocks: self.blocks.min(most.blocks),
        }
    }
}

impl Sizes {
    fn hold(self, other: Self) -> bool {
        other.views <= self.views
            && other.planes <= self.planes
            && other.draws <= self.draws
            && other.spans <= self.spans
    }

    fn with_room_for(self, other: Self) -> Self {
        Self {
            views: self.views.max(other.views.next_power_of_two()),
            planes: self.planes.max(other.planes.next_power_of_two()),
            draws: self.draws.max(other.draws.next_power_of_two()),
            spans: self.spans.max(other.spans.next_power_of_two()),
        }
    }
}

impl Buffers {
    fn new(
        device: &Device,
        geometry: &ClusterGeometry,
        room: Room,
        sizes: Sizes,
        alignment: u32,
    ) -> Self {
        let of_size = |size: u64, usage: BufferUsages| {
            device.create_buffer(&BufferDescriptor {
                label: Some("shadow clusters"),
                size: size.max(16),
                usage: usage | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let room_for = |n: usize, size: usize| (n * size) as u64;
        const STORED: BufferUsages = BufferUsages::STORAGE;
        let uniform = |size: usize| of_size(size as u64, BufferUsages::UNIFORM);
        let rounds: Vec<u8> = (0..MAX_ROUNDS as u32)
            .flat_map(|round| {
                let mut bytes = vec![0; alignment as usize];
                bytes[..4].copy_from_slice(&round.to_ne_bytes());
                bytes
            })
            .collect();
        let rounds = buffer(device, &rounds, BufferUsages::UNIFORM);
        let descent = uniform(size_of::<Descent>());
        let views = of_size(room_for(sizes.views, size_of::<data::View>()), STORED);
        let planes = of_size(room_for(sizes.planes, 16), STORED);
        let spans = of_size(room_for(sizes.spans, size_of::<Span>()), STORED);
        let drawing = uniform(size_of::<Drawing>());
        let indexing = uniform(size_of::<Indexing>());
        let queues =
            [(); 2].map(|()| of_size(u64::from(room.queue) * size_of::<Item>() as u64, STORED));
        let counts =
            of_size(room_for(data::DRAWS + sizes.draws, 4), STORED | BufferUsages::COPY_SRC);
        let indirect = STORED | BufferUsages::INDIRECT;
        let groups = [(); 2].map(|()| of_size((GROUP_WORDS * 4) as u64, indirect));
        let index_groups = of_size(12, indirect);
        let no_groups = of_size(((GROUP_WORDS + 1) * 4) as u64, BufferUsages::COPY_SRC);
        let choices = of_size(u64::from(room.choices) * size_of::<data::Choice>() as u64, STORED);
        let drawn = of_size(u64::from(room.blocks) * 16, STORED);
        let draws = of_size(room_for(sizes.draws, 20), indirect);
        let firsts = of_size(room_for(sizes.draws + 1, 4), STORED);
        let indices = of_size(u64::from(room.triangles) * 12, STORED | BufferUsages::INDEX);
        let origin = uniform(size_of::<Origin>());
        let group = |layout: &BindGroupLayout, buffers: &[&Buffer]| {
            let entries = (0..).zip(buffers).map(|(binding, buffer)| BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            });
            device.create_bind_group(&BindGroupDescriptor {
                label: Some("shadow clusters"),
                layout,
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let pipelines = &geometry.pipelines;
        let round_group = |is_odd: usize| {
            let round = BindingResource::Buffer(BufferBinding {
                buffer: &rounds,
                offset: 0,
                size: std::num::NonZeroU64::new(16),
            });
            let others = [&queues[is_odd], &queues[1 - is_odd], &groups[1 - is_odd]];
            let entries = others.map(Buffer::as_entire_binding);
            let entries = (0..).zip([round].into_iter().chain(entries));
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            device.create_bind_group(&BindGroupDescriptor {
                label: Some("shadow clusters"),
                layout: &pipelines.round_layout,
                entries: &entries.collect::<Vec<_>>(),
            })
        };
        let ClusterGeometry { nodes, clusters, vertices, triangles, instances, .. } = geometry;
        Self {
            descent_group: group(
                &pipelines.descent_layout,
                &[&descent, &views, &planes, nodes, clusters, instances, &counts, &choices],
            ),
            round_groups: [round_group(0), round_group(1)],
            draws_group: group(
                &pipelines.draws_layout,
                &[&drawing, &counts, &draws, &firsts, &spans, &index_groups],
            ),
            indices_group: group(
                &pipelines.indices_layout,
                &[&indexing, &counts, &choices, triangles, clusters, &firsts, &drawn, &indices],
            ),
            triangles_group: group(
                &pipelines.triangles_layout,
                &[
                    &indexing,
                    &counts,
                    &choices,
                    triangles,
                    clusters,
                    &firsts,
                    &drawn,
                    &indices,
                    &draws,
                    vertices,
                    &geometry.positions,
                ],
            ),
            vertex_group: group(
                &pipelines.vertex_layout,
                &[&origin, &drawn, vertices, &geometry.positions, instances, &geometry.attributes],
            ),
            room,
            sizes,
            descent,
            views,
            planes,
            spans,
            drawing,
            indexing,
            queues,
            counts,
            groups,
            index_groups,
            no_groups,
            draws,
            indices,
            origin,
        }
    }
}
