//! Measures the time of the stages on the GPU, by timestamp queries.

use crate::{Error, Gpu};
use umbrage_wgpu::Timestamps;
use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Features, QuerySet, QuerySetDescriptor,
    QueryType, RenderPassTimestampWrites,
};

/// Measures one frame at a time.
pub struct Timer {
    queries: QuerySet,
    resolved: Buffer,
    readback: Buffer,
}

const COUNT: u32 = 6;
const BYTES: u64 = 8 * COUNT as u64;

impl Timer {
    /// Makes a timer; `None` if the device has no timestamps.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device().features().contains(Features::TIMESTAMP_QUERY) {
            return None;
        }
        let buffer = |usage| {
            gpu.device().create_buffer(&BufferDescriptor {
                label: Some("timestamps"),
                size: BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: gpu.device().create_query_set(&QuerySetDescriptor {
                label: Some("timestamps"),
                ty: QueryType::Timestamp,
                count: COUNT,
            }),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            readback: buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ),
        })
    }

    fn writes(&self, first: u32) -> RenderPassTimestampWrites<'_> {
        RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        }
    }

    pub(crate) fn map_passes(&self) -> Timestamps<'_> {
        Timestamps { depth: Some(self.writes(0)), filter: Some(self.writes(4)) }
    }

    /// The timestamps of the pass that draws a picture.
    pub fn shade_pass(&self) -> RenderPassTimestampWrites<'_> {
        self.writes(2)
    }

    /// Makes the timestamps readable, after the passes that they are about.
    pub fn resolve(&self, encoder: &mut CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..COUNT, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readback, 0, BYTES);
    }

    /// Waits for the last frame and returns the times that its depth passes, filter passes and
    /// picture took on the GPU, milliseconds. If a frame has no passes of a kind, their time is
    /// that of the last frame that had some.
    ///
    /// # Errors
    /// The device was lost.
    pub fn read(&self, gpu: &Gpu) -> Result<[f64; 3], Error> {
        let ticks: Vec<u64> = gpu.read(&self.readback)?;
        let ms = f64::from(gpu.queue().get_timestamp_period()) * 1e-6;
        let span = |i: usize| ticks[i + 1].saturating_sub(ticks[i]) as f64 * ms;
        Ok([span(0), span(4), span(2)])
    }
}
