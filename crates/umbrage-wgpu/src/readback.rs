//! Ways back from the device that nobody waits for.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Device, MapMode};

/// A buffer that brings bytes back from the device, and what is to be known of them then.
#[derive(Debug)]
pub(crate) struct Readback<T> {
    buffer: Buffer,
    /// One of the states below. The callback of the mapping has the other reference.
    state: Arc<AtomicU8>,
    pending: Option<T>,
}

const WAITING: u8 = 0;
const MAPPED: u8 = 1;
const FAILED: u8 = 2;

impl<T: Copy> Readback<T> {
    /// Room for `size` bytes.
    pub(crate) fn new(device: &Device, label: &str, size: u64) -> Self {
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, state: Arc::default(), pending: None }
    }

    /// Whether nothing is on its way.
    pub(crate) fn is_free(&self) -> bool {
        self.pending.is_none()
    }

    /// Encodes the way back of a buffer's first bytes once the commands are submitted.
    pub(crate) fn send(&mut self, encoder: &mut CommandEncoder, source: &Buffer, known: T) {
        encoder.copy_buffer_to_buffer(source, 0, &self.buffer, 0, self.buffer.size());
        self.state.store(WAITING, Ordering::Release);
        let state = Arc::clone(&self.state);
        // The mapping begins when the commands are submitted, so the bytes never come from other
        // commands than those that are known of here.
        encoder.map_buffer_on_submit(&self.buffer, MapMode::Read, .., move |result| {
            state.store(if result.is_ok() { MAPPED } else { FAILED }, Ordering::Release);
        });
        self.pending = Some(known);
    }

    /// Hands out what has come back, if anything has.
    pub(crate) fn receive(&mut self, take: impl FnOnce(T, &[u8])) {
        let Some(known) = self.pending else { return };
        match self.state.load(Ordering::Acquire) {
            // The commands may still be submitted, or the encoder was dropped, and the callback
            // with it.
            WAITING if Arc::strong_count(&self.state) > 1 => return,
            MAPPED => {
                if let Ok(bytes) = self.buffer.get_mapped_range(..) {
                    take(known, &bytes);
                }
                self.buffer.unmap();
            }
            _ => {}
        }
        self.pending = None;
    }
}
