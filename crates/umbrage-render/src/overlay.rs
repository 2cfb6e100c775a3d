//! Frames that show what the maps do or what was drawn, over the picture or in its place.

use crate::renderer::Renderer;
use crate::timer::Stage;
use crate::{Drawn, Error, FrameTarget, Shading, Timer};
use bytemuck::{Pod, Zeroable};

/// Number of colours on a scale of errors, from 1/max to max.
pub const SCALE_COLORS: usize = 65;

/// What a frame shows of the maps, or of the clusters. All colours are sRGB.
///
/// Surfaces that no map serves or holds are hatched by [`Error`](Self::Error), and dimmed by
/// [`Grid`](Self::Grid) and [`Partition`](Self::Partition). The sky is always dimmed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Overlay<'a> {
    /// Pixels per texel on the surface, in the worst direction, in place of the picture. Surfaces
    /// that face away from the light or lie beyond the camera's far distance are dimmed.
    Error {
        /// The colours of errors from 1/`max` to `max`, at equal ratios.
        colors: &'a [[u8; 3]; SCALE_COLORS],
        /// Upper end of the scale, pixels per texel, in (1, 10⁶].
        max: f32,
    },
    /// Lines at every fifth texel over the darkened picture. Where they would be too dense to see,
    /// they fade into a uniform tint.
    Grid {
        /// The colour of the lines.
        color: [u8; 3],
    },
    /// The map that serves each surface: the picture's lightness, tinted by the map's index in the
    /// plan.
    Partition {
        /// The colours of the maps, which repeat.
        colors: &'a [[u8; 3]; PARTITION_COLORS],
    },
    /// The [pages](umbrage::paged) that serve each surface: the picture's lightness, tinted by the
    /// page's level, with dark borders. Pages are lighter in the half second after they are drawn,
    /// 30 frames. Surfaces without pages are dimmed.
    Pages {
        /// The colours of levels. That of level l has the number l modulo their number.
        colors: &'a [[u8; 3]; PARTITION_COLORS],
    },
    /// The clusters of triangles that are drawn: the picture's lightness, tinted by the cluster's
    /// level of detail, and a little darker by its number. Where no clusters are drawn, all
    /// surfaces have level 0.
    Clusters {
        /// The colours of the levels; coarser ones have the last.
        colors: &'a [[u8; 3]; LEVEL_COLORS],
    },
}

/// Number of colours for maps and for levels of pages, after which they repeat, as in
/// `wgsl/overlay.wgsl`.
pub const PARTITION_COLORS: usize = 7;

/// Number of colours for levels of detail, as in `wgsl/overlay.wgsl`.
pub const LEVEL_COLORS: usize = 16;

/// The struct `Overlay` of `wgsl/overlay.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct OverlayUniform {
    kind: u32,
    log_max: f32,
    far: f32,
    padding: u32,
    colors: [[f32; 4]; SCALE_COLORS],
}

impl OverlayUniform {
    fn new(overlay: &Overlay<'_>, far: f64) -> Result<Self, Error> {
        let (kind, given, max) = match overlay {
            Overlay::Error { colors, max } => (0, colors.as_slice(), *max),
            Overlay::Grid { color } => (1, std::slice::from_ref(color), f32::MAX),
            Overlay::Partition { colors } => (2, colors.as_slice(), f32::MAX),
            Overlay::Clusters { colors } => (3, colors.as_slice(), f32::MAX),
            Overlay::Pages { colors } => (4, colors.as_slice(), f32::MAX),
        };
        if matches!(overlay, Overlay::Error { .. }) && !(max > 1.0 && max <= 1e6) {
            return Err(Error::Invalid {
                field: "overlay.max",
                problem: format!("must be greater than 1 and at most 1e6, is {max}"),
            });
        }
        let mut colors = [[0.0; 4]; SCALE_COLORS];
        for (color, &[r, g, b]) in colors.iter_mut().zip(given) {
            *color = [r, g, b, 255].map(|v| f32::from(v) / 255.0);
        }
        Ok(Self { kind, log_max: max.ln(), far: far as f32, padding: 0, colors })
    }
}

impl Renderer<'_> {
    /// Draws a frame as [`frame`](Self::frame) does, with an overlay.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the scale of errors ends outside its range. The device refused
    /// something.
    pub fn frame_with(
        &mut self,
        overlay: &Overlay<'_>,
        shading: &Shading<'_>,
        target: &FrameTarget,
        timer: Option<&mut Timer>,
    ) -> Result<Drawn, Error> {
        let uniform = OverlayUniform::new(overlay, shading.camera.far())?;
        self.gpu.queue().write_buffer(&self.overlay_buffer, 0, bytemuck::bytes_of(&uniform));
        self.draw_frame("overlay", Stage::Picture, shading, target, timer)
    }
}
