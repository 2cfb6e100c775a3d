//! What the camera saw, from the viewer's depth buffer.

use crate::readback::Readback;
use crate::{Error, Support, wgsl};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, Vec2, Vec4};
use std::mem::size_of;
use umbrage::{Camera, SeenTile, SeenTiles};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, CommandEncoder, ComputePassDescriptor, ComputePipeline,
    ComputePipelineDescriptor, Device, PipelineCompilationOptions, PipelineLayoutDescriptor,
    PollType, Queue, ShaderModuleDescriptor, ShaderSource, ShaderStages, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDimension,
};

/// How the depths of a depth buffer follow from distances along the view direction: depth =
/// `base` + `per_nearness` · nearness. Nearness is 1/distance under every perspective projection,
/// and −distance under every orthographic one, as in [`SeenTile`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthProjection {
    /// The depth of nearness 0: infinitely far away, or for an orthographic projection at the eye.
    pub base: f64,
    /// The change of depth per 1/m of nearness, or per metre; positive if depth is reversed.
    pub per_nearness: f64,
    /// Whether the projection is orthographic, as the camera then must be.
    pub is_orthographic: bool,
}

impl DepthProjection {
    /// The depths of a perspective projection matrix with wgpu's clip space, of either handedness,
    /// reversed or not. The far plane may be infinitely far. (The matrix of an orthographic
    /// projection does not tell where the viewer looks: take [`orthographic`](Self::orthographic).)
    ///
    /// # Errors
    /// [`Error::Invalid`] if this is no perspective projection.
    pub fn of_matrix(clip_from_view: DMat4) -> Result<Self, Error> {
        let [z, w] = [2, 3].map(|i| clip_from_view.row(i));
        let is_perspective = clip_from_view.is_finite()
            && [z.x, z.y, w.x, w.y, w.w] == [0.0; 5]
            && w.z != 0.0
            && z.w != 0.0;
        if !is_perspective {
            return Err(Error::Invalid {
                field: "depth.clip_from_view",
                problem: format!(
                    "must be a perspective projection, in which depth is a function of z, is {clip_from_view}"
                ),
            });
        }
        let (base, per_nearness) = (z.z / w.z, z.w / w.z.abs());
        Ok(Self { base, per_nearness, is_orthographic: false })
    }

    /// The depths of a perspective projection between these distances, metres. `far` may be
    /// infinite. Reversed depths are 1 at the near distance.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless 0 < `near` < `far`.
    pub fn of_range(near: f64, far: f64, is_reversed: bool) -> Result<Self, Error> {
        if !(near > 0.0 && near < far && near.is_finite()) {
            return Err(Error::Invalid {
                field: "depth.near",
                problem: format!("must lie between 0 and depth.far ({far}), is {near}"),
            });
        }
        // Depth is (near⁻¹ − z⁻¹)/(near⁻¹ − far⁻¹), which is 0 at the near distance.
        let per_nearness = -(near.recip() - far.recip()).recip();
        let forward = Self { base: -per_nearness / near, per_nearness, is_orthographic: false };
        Ok(if is_reversed { forward.reversed() } else { forward })
    }

    /// The depths of an orthographic projection between these distances, metres, of any sign.
    /// Reversed depths are 1 at the near distance.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless `near` < `far` and both are finite.
    pub fn orthographic(near: f64, far: f64, is_reversed: bool) -> Result<Self, Error> {
        if !(near < far && near.is_finite() && far.is_finite()) {
            return Err(Error::Invalid {
                field: "depth.near",
                problem: format!("must be less than depth.far ({far}), both finite, is {near}"),
            });
        }
        let per_nearness = -(far - near).recip();
        let forward = Self { base: near * per_nearness, per_nearness, is_orthographic: true };
        Ok(if is_reversed { forward.reversed() } else { forward })
    }

    fn reversed(self) -> Self {
        Self { base: 1.0 - self.base, per_nearness: -self.per_nearness, ..self }
    }

    pub(crate) fn check_finite(self) -> Result<(), Error> {
        let Self { base, per_nearness, .. } = self;
        if base.is_finite() && per_nearness.is_finite() && per_nearness != 0.0 {
            return Ok(());
        }
        Err(Error::Invalid {
            field: "depth",
            problem: format!("must be finite and depend on the distance, is {self:?}"),
        })
    }

    pub(crate) fn check(self, camera: &Camera) -> Result<(), Error> {
        self.check_finite()?;
        let Self { is_orthographic, .. } = self;
        let invalid = |problem| Err(Error::Invalid { field: "depth", problem });
        if is_orthographic != camera.is_orthographic() {
            let kind =
                |is_orthographic| if is_orthographic { "orthographic" } else { "perspective" };
            return invalid(format!(
                "must have the camera's kind of projection, which is {}, is {}",
                kind(camera.is_orthographic()),
                kind(is_orthographic)
            ));
        }
        Ok(())
    }

    fn is_reversed(self) -> bool {
        self.per_nearness > 0.0
    }

    /// The depth at a distance along the view, metres.
    fn depth(self, distance: f64) -> f64 {
        let nearness = if self.is_orthographic { -distance } else { distance.recip() };
        self.base + self.per_nearness * nearness
    }

    fn nearness(self, depth: f64) -> f64 {
        (depth - self.base) / self.per_nearness
    }
}

/// Reduces the viewer's depth buffer to [`SeenTiles`], and reads them back without waiting, a frame
/// or two late. Given to the planner as [`Bounds::seen`](umbrage::Bounds::seen), they fit the maps
/// to what is seen.
///
/// One compute pass reads each depth a few times. It takes any size, multisampled depths too, and
/// any perspective or orthographic projection.
#[derive(Debug)]
pub struct SeenReadback {
    layouts: [BindGroupLayout; 2],
    /// For depths with one sample, and for several.
    pipelines: [ComputePipeline; 2],
    tiles: Buffer,
    slots: [Slot; SLOTS],
    frame: u64,
    /// The frame that `seen` is from.
    seen_frame: u64,
    seen: Option<SeenTiles>,
}

/// Number of frames whose tiles can be on their way.
const SLOTS: usize = 3;

const TILES: u64 = (SeenTiles::ACROSS * SeenTiles::DOWN) as u64;

/// The tiles of a frame, on their way from the device.
#[derive(Debug)]
struct Slot {
    picture: Buffer,
    readback: Readback<Pending>,
    /// The depths that were reduced last, with their bind group.
    bound: Option<(TextureView, BindGroup)>,
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    frame: u64,
    camera: Camera,
    projection: DepthProjection,
    format: TextureFormat,
}

/// The struct `ShadowSeenPicture` of `wgsl/seen.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Picture {
    pub(crate) size: [u32; 2],
    pub(crate) background: f32,
    pub(crate) limit: f32,
    pub(crate) toward: f32,
    pub(crate) padding: f32,
}

/// The struct `ShadowSeenTile` of `wgsl/seen.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Tile {
    pub(crate) pixels: Vec4,
    pub(crate) slope: Vec2,
    pub(crate) depths: Vec2,
    pub(crate) base: f32,
    pub(crate) jump: f32,
    pub(crate) is_seen: f32,
    pub(crate) padding: f32,
}

impl SeenReadback {
    /// Makes the pipelines and buffers.
    ///
    /// # Errors
    /// [`Error::Unsupported`] on devices without compute shaders, or that cannot fetch depths.
    pub fn new(device: &Device, support: &Support) -> Result<Self, Error> {
        if !(support.compute && support.depth_fetch) {
            return Err(Error::Unsupported {
                what: "compute shaders that fetch depths",
                why: "with which the viewer's depths are reduced: give boxes of receivers",
            });
        }
        let layouts = [false, true].map(|is_multisampled| layout(device, is_multisampled));
        let pipelines = [false, true].map(|is_multisampled| {
            let module = device.create_shader_module(ShaderModuleDescriptor {
                label: Some("seen tiles"),
                source: ShaderSource::Wgsl(wgsl::seen(is_multisampled).into()),
            });
            let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
                label: Some("seen tiles"),
                bind_group_layouts: &[Some(&layouts[usize::from(is_multisampled)])],
                immediate_size: 0,
            });
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some("seen tiles"),
                layout: Some(&layout),
                module: &module,
                entry_point: Some("shadow_seen_tile"),
                compilation_options: PipelineCompilationOptions::default(),
                cache: None,
            })
        });
        let buffer = |size, usage| {
            device.create_buffer(&BufferDescriptor {
                label: Some("seen tiles"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let bytes = TILES * size_of::<Tile>() as u64;
        let slots = std::array::from_fn(|_| Slot {
            picture: buffer(
                size_of::<Picture>() as u64,
                BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            ),
            readback: Readback::new(device, "seen tiles", bytes),
            bound: None,
        });
        let tiles = buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        Ok(Self { layouts, pipelines, tiles, slots, frame: 0, seen_frame: 0, seen: None })
    }

    /// Encodes the reduction of a depth buffer that holds a finished picture of `camera`, and the
    /// way back of its tiles once the commands are submitted. While the tiles of three frames are
    /// on their way, nothing is encoded.
    ///
    /// `depth` is a view of the depth aspect alone, whose texture has the usage `TEXTURE_BINDING`.
    /// The picture lies at the upper left of the texture, with the size of [`Camera::image`].
    /// Pixels without a surface have the depth of the far plane: 0 if depth is reversed, otherwise
    /// 1.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the texture cannot be read, is smaller than the picture, or if the
    /// projection is not finite or not of the camera's kind.
    pub fn encode(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        depth: &TextureView,
        projection: DepthProjection,
        camera: &Camera,
    ) -> Result<(), Error> {
        projection.check(camera)?;
        check_depths(depth, camera.image())?;
        self.collect();
        let Some(slot) = self.slots.iter_mut().find(|s| s.readback.is_free()) else {
            return Ok(());
        };
        let is_multisampled = usize::from(depth.texture().sample_count() > 1);
        let picture = Picture {
            size: camera.image(),
            background: if projection.is_reversed() { 0.0 } else { 1.0 },
            limit: projection.depth(SeenTiles::farthest(camera)) as f32,
            toward: projection.per_nearness.signum() as f32,
            padding: 0.0,
        };
        queue.write_buffer(&slot.picture, 0, bytemuck::bytes_of(&picture));
        if slot.bound.as_ref().is_none_or(|(bound, _)| bound != depth) {
            let group = device.create_bind_group(&BindGroupDescriptor {
                label: Some("seen tiles"),
                layout: &self.layouts[is_multisampled],
                entries: &[
                    BindGroupEntry { binding: 0, resource: BindingResource::TextureView(depth) },
                    BindGroupEntry { binding: 1, resource: slot.picture.as_entire_binding() },
                    BindGroupEntry { binding: 2, resource: self.tiles.as_entire_binding() },
                ],
            });
            slot.bound = Some((depth.clone(), group));
        }
        {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                label: Some("seen tiles"),
                timestamp_writes: None,
            });
            pass.set_pipeline(&self.pipelines[is_multisampled]);
            pass.set_bind_group(0, slot.bound.as_ref().map(|(_, group)| group), &[]);
            pass.dispatch_workgroups(SeenTiles::ACROSS, SeenTiles::DOWN, 1);
        }
        self.frame += 1;
        let format = depth.texture().format();
        let known = Pending { frame: self.frame, camera: *camera, projection, format };
        slot.readback.send(encoder, &self.tiles, known);
        Ok(())
    }

    /// The newest tiles that have come back; `None` before the first. This does not wait for the
    /// device.
    pub fn latest(&mut self, device: &Device) -> Option<&SeenTiles> {
        // A lost device has no news; what was seen before stays.
        let _ = device.poll(PollType::Poll);
        self.collect();
        self.seen.as_ref()
    }

    /// Takes in the tiles that have come back.
    fn collect(&mut self) {
        let Self { slots, seen, seen_frame, .. } = self;
        for slot in slots {
            slot.readback.receive(|pending, bytes| {
                if pending.frame <= *seen_frame {
                    return;
                }
                let tiles: &[Tile] = bytemuck::cast_slice(bytes);
                let seen = seen.get_or_insert_with(|| SeenTiles::new(&pending.camera));
                let tile = |index: usize| pending.tile(&tiles[index]);
                if seen.set(&pending.camera, tile).is_ok() {
                    *seen_frame = pending.frame;
                }
            });
        }
    }
}

impl Pending {
    /// The tile in nearness.
    fn tile(&self, tile: &Tile) -> Option<SeenTile> {
        if tile.is_seen == 0.0 {
            return None;
        }
        let projection = self.projection;
        let base = f64::from(tile.base);
        // What rounding in the buffer and in the shader may have taken off.
        let step = depth_step(self.format);
        let [lo, hi] = tile.depths.to_array().map(f64::from);
        let slack = step + 2f64.powi(-22) * base.abs().max(lo.abs()).max(hi.abs());
        let mut nearness = [base + lo - slack, base + hi + slack].map(|d| projection.nearness(d));
        if !projection.is_reversed() {
            nearness.reverse();
        }
        let per_depth = projection.per_nearness.recip();
        let slope = DVec2::from(tile.slope.to_array().map(f64::from)) * per_depth;
        let jump = f64::from(tile.jump) * per_depth.abs();
        Some(SeenTile { pixels: tile.pixels.to_array().map(f64::from), slope, nearness, jump })
    }
}

/// How far rounding to a format of fixed point may move depths.
pub(crate) fn depth_step(format: TextureFormat) -> f64 {
    match format {
        TextureFormat::Depth16Unorm => 2f64.powi(-17),
        TextureFormat::Depth24Plus | TextureFormat::Depth24PlusStencil8 => 2f64.powi(-25),
        _ => 0.0,
    }
}

/// Checks that shaders can read depths for a picture of this size in pixels.
pub(crate) fn check_depths(depth: &TextureView, image: [u32; 2]) -> Result<(), Error> {
    let texture = depth.texture();
    let invalid = |problem| Err(Error::Invalid { field: "depth", problem });
    if !texture.format().has_depth_aspect() {
        return invalid(format!("must have depths, but its format is {:?}", texture.format()));
    }
    if !texture.usage().contains(TextureUsages::TEXTURE_BINDING) {
        return invalid("must have the usage TEXTURE_BINDING".into());
    }
    let ([width, height], size) = (image, texture.size());
    if width > size.width || height > size.height {
        return invalid(format!(
            "must hold a picture of {width}x{height} pixels, is {}x{}",
            size.width, size.height
        ));
    }
    Ok(())
}

fn layout(device: &Device, multisampled: bool) -> BindGroupLayout {
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let depths = BindingType::Texture {
        sample_type: TextureSampleType::Depth,
        view_dimension: TextureViewDimension::D2,
        multisampled,
    };
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some("seen tiles"),
        entries: &[
            entry(0, depths),
            entry(1, buffer(BufferBindingType::Uniform)),
            entry(2, buffer(BufferBindingType::Storage { read_only: false })),
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec4;

    #[test]
    fn depths_follow_from_matrix_and_range_alike() {
        for (near, far) in [(0.1, 50.0), (2.0, f64::INFINITY)] {
            for is_reversed in [false, true] {
                let of_range = DepthProjection::of_range(near, far, is_reversed).unwrap();
                let ends = if is_reversed { [1.0, 0.0] } else { [0.0, 1.0] };
                assert!((of_range.depth(near) - ends[0]).abs() < 1e-12, "{of_range:?}");
                assert!((of_range.depth(far) - ends[1]).abs() < 1e-12, "{of_range:?}");
                for sign in [1.0, -1.0] {
                    // z looks along ±z: clip z = a z + b, clip w = ±z.
                    let z = DVec4::new(0.0, 0.0, of_range.base * sign, of_range.per_nearness);
                    let rows = [DVec4::X, DVec4::Y, z * 3.0, DVec4::Z * sign * 3.0];
                    let matrix = DMat4::from_cols_array_2d(&rows.map(|r| r.to_array())).transpose();
                    let of_matrix = DepthProjection::of_matrix(matrix).unwrap();
                    let error = (of_matrix.base - of_range.base).abs()
                        + (of_matrix.per_nearness - of_range.per_nearness).abs();
                    assert!(error < 1e-12, "{of_matrix:?} {of_range:?}");
                }
            }
        }
    }

    #[test]
    fn orthographic_depths_run_from_end_to_end() {
        for (near, far) in [(0.1, 50.0), (0.0, 2.0), (-7.0, -3.0), (-7.0, 3.0)] {
            for is_reversed in [false, true] {
                let depths = DepthProjection::orthographic(near, far, is_reversed).unwrap();
                let ends = if is_reversed { [1.0, 0.0] } else { [0.0, 1.0] };
                for (distance, end) in [near, far].into_iter().zip(ends) {
                    assert!((depths.depth(distance) - end).abs() < 1e-12, "{depths:?}");
                    assert!((depths.nearness(end) + distance).abs() < 1e-12, "{depths:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_projection_is_refused() {
        let field = |error: Error| match error {
            Error::Invalid { field, .. } => field,
            other => panic!("{other}"),
        };
        let orthographic = DepthProjection::of_matrix(DMat4::IDENTITY).unwrap_err();
        assert_eq!(field(orthographic), "depth.clip_from_view");
        let nan = DepthProjection::of_matrix(DMat4::from_cols_array(&[f64::NAN; 16])).unwrap_err();
        assert_eq!(field(nan), "depth.clip_from_view");
        for (near, far) in [(0.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::NAN)] {
            let error = DepthProjection::of_range(near, far, true).unwrap_err();
            assert_eq!(field(error), "depth.near");
        }
        for (near, far) in [(2.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY)] {
            let error = DepthProjection::orthographic(near, far, true).unwrap_err();
            assert_eq!(field(error), "depth.near");
        }
    }
}
