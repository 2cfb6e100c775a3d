//! The pool of pages: its buffers, and the passes that find out which pages there are.

use super::data::{self, Level, STATE_WORDS};
use super::pipelines::{Pipelines, group};
use super::{PageCounts, PageFrame, PagePool};
use crate::clusters::{PagesOfView, buffer};
use crate::passes::depth_pass;
use crate::readback::Readback;
use crate::shadows::{Casters, DepthTexture, LookupParts, Shadows};
use crate::{ClusterGeometry, ClusterView, Layout, ShadowOptions, Support, wgsl};
use glam::{DVec3, Vec2};
use std::mem::size_of;
use umbrage::paged::{Grid, PAGE_TEXELS, Paging};
use umbrage::visibility::Filter;
use umbrage::{Aabb, Place, Plan};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferDescriptor, BufferUsages, CommandEncoder, ComputePassDescriptor,
    ComputePassTimestampWrites, Device, LoadOp, PollType, Queue, RenderPass,
    RenderPassTimestampWrites, TextureView,
};

/// The most times that pages are listed in a frame, `SHADOW_PAGE_ATTEMPTS` of
/// `wgsl/page_allocate.wesl`.
const ATTEMPTS: u32 = 6;

/// Pixels across what a workgroup of `wgsl/page_request.wesl` looks at.
const REQUEST_SIDE: u32 = 32;

/// Stamps of a frame: one for each attempt, and some to spare.
const STAMPS: u32 = 8;

/// Texels for each pixel that a view is expected to need with an error of one pixel.
const EXPECTED_TEXELS: f64 = 7.0;

/// The fewest places of a pool without a budget.
const LEAST_PLACES: u32 = 256;

/// Pages on a device.
#[derive(Debug)]
pub(crate) struct Pages {
    pipelines: Pipelines,
    uniforms: Uniforms,
    /// What everything below was made for; `None` at first.
    key: Option<Key>,
    held: Option<Held>,
    /// The depths of casters that stand still, if these are kept apart.
    still: Option<DepthTexture>,
    are_apart: bool,
    /// The bind group of the texture of what stands still.
    still_group: Option<BindGroup>,
    levels: Vec<Level>,
    /// The grids of the frame that was prepared last.
    grids: Vec<Grid>,
    /// The places that plans without a budget have, once they have needed more than expected.
    grown: Option<u32>,
    /// The bind groups of `held`; `None` if a buffer was replaced.
    groups: Option<Groups>,
    frame: u32,
    /// The workgroups that look at the viewer's depths.
    workgroups: [u32; 2],
    is_multisampled: bool,
    /// What the viewer's depths were bound with last.
    seen: Option<(TextureView, BindGroup)>,
    readbacks: [Readback<Pending>; 3],
    encoded: u32,
    counted: u32,
    counts: Option<PageCounts>,
}

/// What the sizes of buffers depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    places: u32,
    levels: usize,
    table_words: u32,
}

/// Counts that are on their way.
#[derive(Clone, Copy, Debug)]
struct Pending {
    number: u32,
    room: u32,
    least_bias: f32,
    error: f32,
    has_budget: bool,
}

#[derive(Debug)]
struct Uniforms {
    frame: Buffer,
    view: Buffer,
    pool: Buffer,
}

/// The buffers of a pool.
#[derive(Debug)]
struct Held {
    /// The grids of the frame that was encoded last, whose maps places name.
    entered: Vec<Grid>,
    levels_now: Buffer,
    levels: Buffer,
    table: Buffer,
    stamps: Buffer,
    placed: Buffer,
    wanted: Buffer,
    state: Buffer,
    fresh: Buffer,
    lists: Buffer,
    calls: Buffer,
    boxes: Buffer,
    shown: Buffer,
    room: u32,
    pending: Pending,
}

#[derive(Debug)]
struct Groups {
    allocate: BindGroup,
    draw: BindGroup,
    shown: Option<BindGroup>,
}

impl Pages {
    /// Makes the pipelines. `lookup_layout` is that of the lookup with pages.
    pub(crate) fn new(
        device: &Device,
        support: &Support,
        options: &ShadowOptions,
        lookup_layout: &BindGroupLayout,
    ) -> Self {
        let uniform = |size: usize| {
            device.create_buffer(&BufferDescriptor {
                label: Some("shadow pages"),
                size: size as u64,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let bytes = 4 * STATE_WORDS as u64;
        Self {
            pipelines: Pipelines::new(device, support, &options.filter, lookup_layout),
            uniforms: Uniforms {
                frame: uniform(size_of::<data::Frame>()),
                view: uniform(size_of::<data::View>()),
                pool: uniform(size_of::<data::Pool>()),
            },
            key: None,
            held: None,
            still: None,
            are_apart: options.pages_apart,
            still_group: None,
            levels: Vec::new(),
            grids: Vec::new(),
            grown: None,
            groups: None,
            frame: 0,
            workgroups: [1; 2],
            is_multisampled: false,
            seen: None,
            readbacks: [(); 3].map(|()| Readback::new(device, "shadow pages", bytes)),
            encoded: 0,
            counted: 0,
            counts: None,
        }
    }

    /// The buffers that lookups read; `None` before the first frame.
    pub(crate) fn lookup_buffers(&self) -> Option<[&Buffer; 2]> {
        self.held.as_ref().map(|held| [&held.levels, &held.table])
    }

    /// The views of a plan's maps, for clusters that may be off by a share of a texel.
    pub(crate) fn views(
        &self,
        plan: &Plan,
        render_origin: DVec3,
        reach_texels: u32,
        share: f32,
        still: u32,
    ) -> Vec<ClusterView> {
        let entries = data::SHOWN * plan.maps.len() as u32;
        let maps = (0..).zip(plan.maps.iter().zip(&self.levels));
        let view = |(map, (planned, level)): (u32, (&umbrage::ShadowMap, &Level))| {
            let own = PagesOfView {
                map,
                side: level.side,
                table: entries + level.table,
                first: level.first,
                reach: reach_texels as f32 + 1.0,
                still,
            };
            ClusterView::of_pages(planned, own, render_origin, share)
        };
        maps.map(view).collect()
    }

    /// What lies in the texture.
    pub(crate) fn pool(&self, filter: &Filter) -> Option<PagePool<'_>> {
        let (held, key) = (self.held.as_ref()?, self.key.as_ref()?);
        let side = place_side(filter);
        Some(PagePool { places: &held.placed, table: &held.table, count: key.places, side })
    }

    /// Memory of what lookups read beside the texture, bytes.
    pub(crate) fn bytes(&self) -> u64 {
        self.held.as_ref().map_or(0, |held| held.levels.size() + held.table.size())
    }

    /// The places that a plan's pages get, and how many of them lie across the texture.
    fn places(&self, paging: &Paging, support: &Support, place_side: u32) -> [u32; 2] {
        let [width, height] = paging.camera.image().map(f64::from);
        let expected = EXPECTED_TEXELS * width * height
            / (f64::from(PAGE_TEXELS).powi(2) * paging.error * paging.error);
        let wanted = paging
            .budget
            .unwrap_or_else(|| self.grown.unwrap_or((expected.ceil() as u32).max(LEAST_PLACES)));
        let most = support.max_side / place_side;
        let places = wanted.min(most.saturating_mul(most));
        let across = f64::from(places).sqrt().ceil() as u32;
        // A texture without a budget has no reason to leave the end of its last row empty.
        let places = if paging.budget.is_some() { places } else { across * across };
        [places, across]
    }

    /// The bind group by which clusters are chosen for fresh pages.
    pub(crate) fn shown_group(
        &mut self,
        device: &Device,
        geometry: &ClusterGeometry,
    ) -> Option<&BindGroup> {
        let shown = &self.held.as_ref()?.shown;
        let layout = &geometry.pipelines.shown_layout;
        let kept = &mut self.groups.as_mut()?.shown;
        Some(kept.get_or_insert_with(|| group(device, layout, &[shown])))
    }

    /// Encodes the passes that find the pages of a frame and give them places.
    pub(crate) fn encode_request(
        &mut self,
        encoder: &mut CommandEncoder,
        lookup_group: &BindGroup,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) {
        let (Some(held), Some(groups), Some((_, seen_group))) =
            (&self.held, &self.groups, &self.seen)
        else {
            return;
        };
        let pipelines = &self.pipelines;
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("shadow pages"),
            timestamp_writes: timestamps,
        });
        pass.set_bind_group(0, &groups.allocate, &[]);
        pass.set_pipeline(&pipelines.begin);
        pass.dispatch_workgroups(1, 1, 1);
        for attempt in 0..ATTEMPTS {
            pass.set_pipeline(&pipelines.requests[usize::from(self.is_multisampled)]);
            pass.set_bind_group(0, seen_group, &[]);
            pass.set_bind_group(wgsl::PAGE_LOOKUP_GROUP, lookup_group, &[]);
            if attempt == 0 {
                pass.dispatch_workgroups(self.workgroups[0], self.workgroups[1], 1);
            } else {
                // No workgroup, if the pages have their places.
                pass.dispatch_workgroups_indirect(&held.calls, 0);
            }
            pass.set_pipeline(&pipelines.allocate);
            pass.set_bind_group(0, &groups.allocate, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        }
        drop(pass);
        self.encoded += 1;
        if let Some(readback) = self.readbacks.iter_mut().find(|r| r.is_free()) {
            let pending = Pending { number: self.encoded, ..held.pending };
            readback.send(encoder, &held.state, pending);
        }
        if let Some(held) = &mut self.held {
            held.entered.clone_from(&self.grids);
        }
    }

    /// Begins the pass that draws pages, which clears those that will be drawn.
    pub(crate) fn begin_draw<'e>(
        &self,
        encoder: &'e mut CommandEncoder,
        texture: &DepthTexture,
        timestamps: Option<RenderPassTimestampWrites<'_>>,
    ) -> RenderPass<'e> {
        let texture = self.still.as_ref().unwrap_or(texture);
        let load = if texture.is_fresh { LoadOp::Clear(1.0) } else { LoadOp::Load };
        let mut pass = depth_pass(encoder, &texture.layers[0], load, timestamps);
        if let (Some(held), Some(groups)) = (&self.held, &self.groups) {
            pass.set_bind_group(0, &groups.draw, &[]);
            if !texture.is_fresh {
                pass.set_pipeline(&self.pipelines.clear);
                pass.draw_indirect(&held.calls, 16);
            }
        }
        pass
    }

    /// Begins the pass that draws what moves into pages, into which what stands still is copied.
    pub(crate) fn begin_apart<'e>(
        &self,
        encoder: &'e mut CommandEncoder,
        texture: &DepthTexture,
        timestamps: Option<RenderPassTimestampWrites<'_>>,
    ) -> RenderPass<'e> {
        let load = if texture.is_fresh { LoadOp::Clear(1.0) } else { LoadOp::Load };
        let mut pass = depth_pass(encoder, &texture.layers[0], load, timestamps);
        if let (Some(held), Some(groups), Some(still)) =
            (&self.held, &self.groups, &self.still_group)
        {
            pass.set_bind_group(0, &groups.draw, &[]);
            pass.set_bind_group(1, still, &[]);
            pass.set_pipeline(&self.pipelines.copy);
            pass.draw_indirect(&held.calls, 16);
        }
        pass
    }

    /// Notes that pages were drawn.
    pub(crate) fn finish_draw(&mut self, texture: &mut DepthTexture) {
        texture.is_fresh = false;
        if let Some(still) = &mut self.still {
            still.is_fresh = false;
        }
    }

    /// Whether casters that stand still have a texture of their own.
    pub(crate) fn are_apart(&self) -> bool {
        self.are_apart
    }

    /// The buffers by which meshes are listed for pages, of which `maps` is one.
    pub(crate) fn mesh_buffers<'a>(&'a self, maps: &'a Buffer) -> Option<[&'a Buffer; 3]> {
        self.held.as_ref().map(|held| [&held.levels, maps, &held.shown])
    }

    /// The layout of the bind group with which casters are drawn into pages.
    pub(crate) fn draw_layout(&self) -> &BindGroupLayout {
        &self.pipelines.draw_layout
    }

    /// The newest counts that have come back.
    pub(crate) fn counts(&mut self, device: &Device) -> Option<PageCounts> {
        // A lost device has no news; what was counted before stays.
        let _ = device.poll(PollType::Poll);
        self.collect();
        self.counts
    }

    pub(crate) fn is_counted(&self) -> bool {
        self.counted == self.encoded
    }

    fn collect(&mut self) {
        let Self { readbacks, counted, counts, grown, .. } = self;
        for readback in readbacks {
            readback.receive(|pending, bytes| {
                if pending.number <= *counted {
                    return;
                }
                let words: &[u32] = bytemuck::cast_slice(bytes);
                *counted = pending.number;
                let bias = f32::from_bits(words[data::BIAS]);
                let now = PageCounts {
                    wanted: words[data::USED],
                    missing: words[data::MISSING],
                    waiting: words[data::WAITING],
                    drawn: words[data::FRESH],
                    apart: words[data::APART],
                    room: pending.room,
                    bias,
                    bound: pending.error * bias.exp2(),
                };
                *counts = Some(now);
                // Without a budget there is room for what is wanted. Pages grow by four a level.
                if !pending.has_budget && (bias > pending.least_bias || now.missing > 0) {
                    let factor = (2.0 * (bias - pending.least_bias)).exp2().clamp(1.0, 4.0);
                    let wanted = 1.25 * factor * now.wanted.max(pending.room) as f32;
                    *grown = Some((wanted.ceil() as u32).max(grown.unwrap_or(0)));
                }
            });
        }
    }
}

impl Shadows {
    /// Uploads a plan's pages, for which the pool is made anew if it has another number of places.
    pub(super) fn upload_pages(
        &mut self,
        device: &Device,
        queue: &Queue,
        frame: &PageFrame<'_>,
        paging: &Paging,
    ) {
        let PageFrame { plan, render_origin, casters, moving, depth, projection } = *frame;
        let filter = self.options.filter;
        let place_side = place_side(&filter);
        let Self { pages, lookup, texture, buffers, support, .. } = self;
        let Some(pages) = pages else { return };
        pages.collect();
        let [places, across] = pages.places(paging, support, place_side);
        let size = [across, places.div_ceil(across)].map(|n| n * place_side);
        let whole = |map: &umbrage::ShadowMap| {
            Some(Place { layer: 0, origin: [0; 2], size: map.resolution })
        };
        lookup.fill(
            plan,
            &crate::data::Placed {
                places: &plan.maps.iter().map(whole).collect::<Vec<_>>(),
                texture_size: size,
                render_origin,
                bias: self.bias,
                pages_across: across,
            },
        );
        let mut rebind = buffers.hold(device, self.options.buffers, lookup);
        let (levels, table_words) = data::levels(paging);
        let still_boxes = boxes_of(casters);
        let boxes: Vec<Aabb> = still_boxes.iter().chain(boxes_of(moving)).copied().collect();
        let touched = pages.touched(plan, &levels, &boxes, filter.reach_texels());
        pages.levels = levels;
        pages.grids.clone_from(&paging.grids);
        let key = Key { places, levels: pages.levels.len(), table_words };
        let before = pages.key.replace(key);
        // Pages of another plan's grids are given up when the frame begins.
        let is_same = before.is_some_and(|before| before.places == places);
        if !is_same {
            pages.make(device, queue, places);
        }
        if before != Some(key) {
            pages.make_tables(device, table_words, places);
            rebind = true;
        }
        let entered = pages.held.as_ref().map_or(&[][..], |held| &held.entered);
        let levels_now = data::levels_now(entered, &paging.grids);
        pages.hold(device, touched.len(), levels_now.len());
        if rebind || pages.groups.is_none() {
            pages.bind(device, buffers.maps());
        }
        if texture.size() != size || !is_same {
            if texture.size() != size {
                *texture = DepthTexture::new(device, support, Layout::Atlas, size, 1);
                rebind = true;
            }
            texture.is_fresh = true;
            pages.make_still(device, support, size);
        }
        if rebind {
            let parts = LookupParts { view: &texture.all, pages: pages.lookup_buffers() };
            self.lookup_bind_group =
                buffers.bind(device, &self.lookup_layout, &parts, &self.sampler);
        }
        buffers.upload(queue, lookup);
        std::mem::swap(&mut self.lookup, &mut self.uploaded);

        pages.frame = pages.frame.wrapping_add(1);
        let is_multisampled = depth.texture().sample_count() > 1;
        pages.is_multisampled = is_multisampled;
        pages.workgroups = paging.camera.image().map(|n| n.div_ceil(REQUEST_SIDE));
        let Pages { held: Some(held), uniforms, pipelines, seen, .. } = pages else { return };
        held.pending = Pending {
            number: 0,
            room: places,
            least_bias: paging.bias as f32,
            error: paging.error as f32,
            has_budget: paging.budget.is_some(),
        };
        let (first_coming, frames_left) = match paging.coming {
            Some(coming) => {
                let light = plan.lights.get(coming.first);
                (light.map_or(plan.maps.len(), |light| light.maps.start), coming.frames.max(1))
            }
            None => (plan.maps.len(), 1),
        };
        let all_stale = match (casters, moving) {
            (Casters::Moved, _) => data::STALE,
            (_, Casters::Moved) if !pages.are_apart => data::STALE,
            (_, Casters::Moved) => data::MOVED,
            _ => 0,
        };
        let shared = data::Frame {
            frame: pages.frame,
            places,
            room: held.room,
            boxes: boxes.len() as u32,
            still_boxes: if pages.are_apart { still_boxes.len() } else { boxes.len() } as u32,
            error: paging.error as f32,
            least_bias: paging.bias as f32,
            all_stale,
            maps: plan.maps.len() as u32,
            groups: pages.workgroups,
            stamp: STAMPS.wrapping_mul(pages.frame),
            births: table_words,
            first_coming: first_coming as u32,
            frames_left,
            padding: 0,
        };
        let view = data::View {
            base: projection.base as f32,
            per_nearness: projection.per_nearness as f32,
            background: if projection.per_nearness > 0.0 { 0.0 } else { 1.0 },
            frame: shared.stamp,
            room: held.room,
            ..data::View::new(&paging.camera, render_origin)
        };
        let pool = data::Pool { size: Vec2::from(size.map(|n| n as f32)), across, padding: 0 };
        queue.write_buffer(&uniforms.frame, 0, bytemuck::bytes_of(&shared));
        queue.write_buffer(&uniforms.view, 0, bytemuck::bytes_of(&view));
        queue.write_buffer(&uniforms.pool, 0, bytemuck::bytes_of(&pool));
        queue.write_buffer(&held.levels, 0, bytemuck::cast_slice(&pages.levels));
        queue.write_buffer(&held.boxes, 0, bytemuck::cast_slice(&touched));
        queue.write_buffer(&held.levels_now, 0, bytemuck::cast_slice(&levels_now));
        if seen.as_ref().is_none_or(|(bound, _)| bound != depth) {
            let layout = &pipelines.request_layouts[usize::from(is_multisampled)];
            let buffers = [&uniforms.view, &held.stamps, &held.wanted, &held.state];
            let entry = |binding, resource| BindGroupEntry { binding, resource };
            let others = (1..).zip(buffers).map(|(i, b)| entry(i, b.as_entire_binding()));
            let entries = [entry(0, BindingResource::TextureView(depth))].into_iter().chain(others);
            let bound = device.create_bind_group(&BindGroupDescriptor {
                label: Some("shadow pages"),
                layout,
                entries: &entries.collect::<Vec<_>>(),
            });
            *seen = Some((depth.clone(), bound));
        }
    }
}

impl Pages {
    /// For each map and box the pages that the box's shadow may touch.
    fn touched(&self, plan: &Plan, levels: &[Level], boxes: &[Aabb], reach: u32) -> Vec<[i32; 4]> {
        let maps = plan.maps.iter().zip(levels);
        maps.flat_map(|(map, level)| boxes.iter().map(|&b| data::touched(map, level, b, reach)))
            .collect()
    }

    /// Makes a texture for what stands still, if that is kept apart.
    fn make_still(&mut self, device: &Device, support: &Support, size: [u32; 2]) {
        if !self.are_apart {
            return;
        }
        let texture = DepthTexture::new(device, support, Layout::Atlas, size, 1);
        self.still_group = Some(device.create_bind_group(&BindGroupDescriptor {
            label: Some("shadow pages"),
            layout: &self.pipelines.still_layout,
            entries: &[BindGroupEntry {
                binding: 0,
                resource: BindingResource::TextureView(&texture.all),
            }],
        }));
        self.still = Some(texture);
    }

    /// Makes empty tables of so many words for the present levels. Pages that have places are entered
    /// when the frame begins.
    fn make_tables(&mut self, device: &Device, table_words: u32, places: u32) {
        let Some(held) = &mut self.held else { return };
        let none = BufferUsages::empty();
        let words = |n: u32| 4 * n as usize;
        let levels = self.levels.len() as u32;
        held.levels = stored(device, size_of_val(&*self.levels), none);
        // Behind the table come the frames in which pages were drawn.
        held.table = stored(device, words(table_words + places), none);
        held.stamps = stored(device, words(table_words), none);
        held.shown = stored(device, words(data::SHOWN * levels + table_words), none);
        self.groups = None;
        self.seen = None;
    }

    /// Makes an empty pool of so many places, without tables.
    fn make(&mut self, device: &Device, queue: &Queue, places: u32) {
        let room = 2 * places + 1024;
        let words = |n: u32| 4 * n as usize;
        let none = BufferUsages::empty();
        // New buffers hold zeros: no entry, no stamp, no bias.
        let calls = stored(device, words(8), BufferUsages::INDIRECT);
        queue.write_buffer(&calls, 0, bytemuck::cast_slice(&[0u32, 1, 1, 0, 6, 0, 0, 0]));
        let empty = data::PlacedPage { map: data::EMPTY, ..bytemuck::Zeroable::zeroed() };
        let places_of = |size: usize| places as usize * size;
        self.held = Some(Held {
            entered: Vec::new(),
            levels_now: stored(device, 0, none),
            levels: stored(device, 0, none),
            table: stored(device, 0, none),
            stamps: stored(device, 0, none),
            placed: buffer(device, &vec![empty; places as usize], BufferUsages::STORAGE),
            wanted: stored(device, words(4 * room), none),
            state: stored(device, 4 * STATE_WORDS, BufferUsages::COPY_SRC),
            fresh: stored(device, places_of(size_of::<data::FreshPage>()), none),
            lists: stored(device, words(places + room), none),
            calls,
            boxes: stored(device, 0, none),
            shown: stored(device, 0, none),
            room,
            pending: Pending {
                number: 0,
                room: places,
                least_bias: 0.0,
                error: 0.0,
                has_budget: true,
            },
        });
    }

    /// Makes room for so many rectangles of pages, and maps of the last frame.
    fn hold(&mut self, device: &Device, boxes: usize, maps: usize) {
        let Some(held) = &mut self.held else { return };
        let sizes = [boxes * size_of::<[i32; 4]>(), maps * size_of::<u32>()];
        for (buffer, bytes) in [&mut held.boxes, &mut held.levels_now].into_iter().zip(sizes) {
            if buffer.size() < bytes as u64 {
                *buffer = stored(device, bytes.next_power_of_two(), BufferUsages::empty());
                self.groups = None;
            }
        }
    }

    /// Binds all buffers, and that of the maps.
    fn bind(&mut self, device: &Device, maps: &Buffer) {
        let Some(held) = &self.held else { return };
        let of_allocation = [
            &self.uniforms.frame,
            &held.table,
            &held.levels,
            &held.placed,
            &held.wanted,
            &held.state,
            &held.fresh,
            &held.lists,
            &held.calls,
            &held.boxes,
            &held.shown,
            &held.stamps,
            &held.levels_now,
        ];
        let of_draw = [&self.uniforms.pool, &held.fresh, maps];
        self.groups = Some(Groups {
            allocate: group(device, &self.pipelines.allocate_layout, &of_allocation),
            draw: group(device, &self.pipelines.draw_layout, &of_draw),
            shown: None,
        });
    }
}

/// The texels across a place, with its gutters.
fn place_side(filter: &Filter) -> u32 {
    PAGE_TEXELS + 2 * filter.reach_texels()
}

/// A buffer of so many bytes for shaders.
fn stored(device: &Device, bytes: usize, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("shadow pages"),
        size: bytes.max(16) as u64,
        usage: usage | BufferUsages::STORAGE | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The boxes around casters that moved.
fn boxes_of(casters: Casters<'_>) -> &[Aabb] {
    match casters {
        Casters::MovedIn(boxes) => boxes,
        Casters::Moved | Casters::Unmoved => &[],
    }
}
