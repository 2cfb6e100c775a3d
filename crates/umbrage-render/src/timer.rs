//! Measures the time of the stages on the GPU, by timestamp queries.

use crate::{Error, Gpu};
use std::time::Duration;
use wgpu::{CommandEncoder, Features, PollType};
use wgpu_profiler::{GpuProfiler, GpuProfilerQuery, GpuProfilerSettings};

/// Measures the time that the stages of frames take on the GPU. A frame is all that is timed
/// between two calls of [`read`](Self::read) or [`try_read`](Self::try_read).
pub struct Timer {
    profiler: GpuProfiler,
    /// Whether anything was timed in this frame.
    is_timed: bool,
}

/// A stage of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The passes that draw the viewer's depths, which plans with pages need ahead of these.
    Prepass,
    /// The passes that find the pages which the viewer's depths want, and what casts into those to
    /// draw.
    Pages,
    /// The passes that draw casters into maps.
    Depth,
    /// The passes of the prefilter.
    Filter,
    /// The pass that draws the picture.
    Picture,
}

impl Stage {
    fn label(self) -> &'static str {
        match self {
            Self::Prepass => "prepass",
            Self::Pages => "pages",
            Self::Depth => "depth",
            Self::Filter => "filter",
            Self::Picture => "picture",
        }
    }
}

/// The times that the stages of a frame took on the GPU, milliseconds; 0 for stages without passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    /// Time to draw the viewer's depths ahead of pages.
    pub prepass_ms: f64,
    /// Time to find the pages that are wanted, and what casts into those to draw.
    pub pages_ms: f64,
    /// Time to draw casters into maps.
    pub depth_ms: f64,
    /// Time to prefilter the maps.
    pub filter_ms: f64,
    /// Time to draw the picture.
    pub picture_ms: f64,
}

/// The most frames that may wait for their times. Later ones are dropped until then.
const MOST_IN_FLIGHT: usize = 4;

impl Timer {
    /// Makes a timer; `None` if the device has no timestamps.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.device().features().contains(Features::TIMESTAMP_QUERY) {
            return None;
        }
        let settings = GpuProfilerSettings {
            max_num_pending_frames: MOST_IN_FLIGHT,
            ..GpuProfilerSettings::default()
        };
        let profiler = GpuProfiler::new(gpu.device(), settings).ok()?;
        Some(Self { profiler, is_timed: false })
    }

    /// Begins to time passes of a stage. The query has the timestamps for the passes: the first
    /// must write the beginning and the last the end. Give the query back to [`end`](Self::end).
    pub fn begin(&self, stage: Stage, encoder: &mut CommandEncoder) -> GpuProfilerQuery {
        self.profiler.begin_pass_query(stage.label(), encoder)
    }

    /// Ends queries whose passes are encoded. The encoder must be submitted before the frame is
    /// read.
    pub fn end(
        &mut self,
        encoder: &mut CommandEncoder,
        queries: impl IntoIterator<Item = GpuProfilerQuery>,
    ) {
        for query in queries {
            self.profiler.end_query(encoder, query);
            self.is_timed = true;
        }
        self.profiler.resolve_queries(encoder);
    }

    /// Waits for the frame and returns its times, which are 0 if nothing was timed.
    ///
    /// # Errors
    /// The device was lost, or refused something.
    pub fn read(&mut self, gpu: &Gpu) -> Result<StageTimes, Error> {
        /// How long the times of a frame that is done may take to be there: another thread may be
        /// handing them over.
        const MOST_POLLS: u32 = 1000;
        const PAUSE: Duration = Duration::from_millis(1);
        let is_timed = self.end_frame()?;
        gpu.wait()?;
        for _ in 0..if is_timed { MOST_POLLS } else { 0 } {
            if let Some(times) = self.newest(gpu) {
                return Ok(times);
            }
            std::thread::sleep(PAUSE);
            gpu.wait()?;
        }
        Ok(StageTimes::default())
    }

    /// Ends the frame without waiting for it, and returns the times of the newest frame that is
    /// done; `None` if none has been done since the last call.
    ///
    /// # Errors
    /// The device was lost, or refused something.
    pub fn try_read(&mut self, gpu: &Gpu) -> Result<Option<StageTimes>, Error> {
        self.end_frame()?;
        let polled = gpu.device().poll(PollType::Poll);
        gpu.check()?;
        polled.map_err(|e| Error::Lost(e.to_string()))?;
        Ok(self.newest(gpu))
    }

    /// Ends the frame if anything was timed in it, and returns whether it was.
    fn end_frame(&mut self) -> Result<bool, Error> {
        let is_timed = std::mem::take(&mut self.is_timed);
        if is_timed {
            self.profiler.end_frame().map_err(|e| Error::Refused(e.to_string()))?;
        }
        Ok(is_timed)
    }

    /// The times of the newest frame that is done; older ones are dropped.
    fn newest(&mut self, gpu: &Gpu) -> Option<StageTimes> {
        let period = gpu.queue().get_timestamp_period();
        let done = std::iter::from_fn(|| self.profiler.process_finished_frame(period));
        let newest = done.last()?;
        let ms = |stage: Stage| {
            let passes = newest.iter().filter(|r| r.label == stage.label());
            let spans = passes.filter_map(|r| r.time.as_ref());
            spans.fold(0.0, |ms, t| ms + 1e3 * (t.end - t.start).max(0.0))
        };
        Some(StageTimes {
            prepass_ms: ms(Stage::Prepass),
            pages_ms: ms(Stage::Pages),
            depth_ms: ms(Stage::Depth),
            filter_ms: ms(Stage::Filter),
            picture_ms: ms(Stage::Picture),
        })
    }
}
