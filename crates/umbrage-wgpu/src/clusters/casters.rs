use super::{ClusterCounts, ClusterGeometry, ClusterSelection, ClusterView};
use crate::{Bias, Error, MapPass, Mask, MeshCasters, MeshKind, Prepared, Shadows, wgsl};
use umbrage::Place;
use wgpu::{BindGroup, CommandEncoder, ComputePassTimestampWrites, Device, Queue};

/// Draws clusters into shadow maps: in each map, for each of its places, as many triangles as its
/// texels can tell from the whole mesh. The time that this takes follows the texels, not the
/// triangles.
///
/// # What is right
/// A caster in a map is off by at most [`share`](Self::share) of the map's own texel at its place,
/// whatever the map's warp. With [`ClusterCasters::bias`], which [`Shadows::set_bias`] must have
/// been given, no coarser caster shadows the finer surface that it stands for.
#[derive(Debug)]
pub struct ClusterCasters {
    opaque: MeshCasters,
    masked: MeshCasters,
    selection: ClusterSelection,
    share: f32,
    /// What was chosen for each map or part of a map.
    chosen: Vec<(usize, Place)>,
    caster_batches: u32,
}

impl ClusterCasters {
    /// The share of a texel by which casters may be off by default.
    pub const SHARE: f32 = 0.5;

    /// Makes the pipelines that draw a geometry's clusters into maps. `share` is the part of a
    /// texel by which casters may be off, at least 0; with 0 all casters have all of their detail.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `share` is negative or not finite, or if the shadows have less
    /// [bias](Self::bias) than it takes.
    pub fn new(
        device: &Device,
        shadows: &Shadows,
        geometry: &ClusterGeometry,
        share: f32,
    ) -> Result<Self, Error> {
        check_share(shadows, share)?;
        let casters = |kind| {
            let is_masked = kind == MeshKind::Masked;
            let text = wgsl::cluster_caster(shadows.support(), geometry.layout, is_masked);
            let own = Some(geometry.vertex_layout());
            MeshCasters::of_text(device, shadows, kind, text, &[], own)
        };
        Ok(Self {
            opaque: casters(MeshKind::Opaque),
            masked: casters(MeshKind::Masked),
            selection: ClusterSelection::new(device, shadows.support(), geometry),
            share,
            chosen: Vec::new(),
            caster_batches: geometry.caster_batches,
        })
    }

    /// The margin on depths that casters need which may be off by this share of a texel: a texel's
    /// shortest diameter, of which the share is taken, is never more than its longest, in which the
    /// margin counts.
    pub fn bias(share: f32) -> Bias {
        Bias { texels: share, metres: 0.0 }
    }

    /// The part of a texel by which casters may be off.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// Encodes the choice of clusters for all that [`Prepared::encode`] will draw. Encode it ahead
    /// of that, and submit both together.
    ///
    /// # Errors
    /// As for [`ClusterSelection::encode`].
    pub fn choose(
        &mut self,
        device: &Device,
        queue: &Queue,
        encoder: &mut CommandEncoder,
        geometry: &ClusterGeometry,
        prepared: &Prepared<'_>,
        timestamps: Option<ComputePassTimestampWrites<'_>>,
    ) -> Result<(), Error> {
        self.chosen.clear();
        let mut views = Vec::new();
        for redraw in prepared.stale() {
            self.chosen.push((redraw.index, redraw.rectangle));
            views.push(ClusterView::map(&redraw, prepared.render_origin, self.share));
        }
        if views.is_empty() {
            return Ok(());
        }
        let origin = prepared.render_origin;
        let Self { selection, .. } = self;
        selection.encode(device, queue, encoder, geometry, &views, origin, 0, None, timestamps)
    }

    /// Draws what was chosen for a map. `mask_of` gives the [mask](Self::mask) of each batch of
    /// casters, `None` for those without holes. Returns the number of draws.
    pub fn draw<'a>(
        &self,
        map: &mut MapPass<'_, '_>,
        mask_of: impl Fn(u32) -> Option<&'a BindGroup>,
    ) -> u32 {
        let key = (map.redraw.index, map.redraw.rectangle);
        let Some(view) = self.chosen.iter().position(|&c| c == key) else { return 0 };
        let first = view as u32 * self.caster_batches;
        let batches = first..first + self.caster_batches;
        let mask_of = |draw: u32| mask_of(draw - first);
        self.selection.draw_batches(map.pass, [&self.opaque, &self.masked], batches, mask_of)
    }

    /// The bind group of a mask.
    pub fn mask(&self, device: &Device, queue: &Queue, mask: &Mask<'_>) -> Option<BindGroup> {
        self.masked.mask(device, queue, mask)
    }

    /// What was chosen last, as far as the device has told; `None` while the last choice is under
    /// way. Where it was [not complete](ClusterCounts::is_complete), casters are missing from the
    /// maps: draw them again, with room for all.
    pub fn counts(&mut self, device: &Device) -> Option<ClusterCounts> {
        let counts = self.selection.counts(device);
        self.selection.is_counted().then_some(counts)
    }
}

/// Checks that casters may be off by this share of a texel.
pub(crate) fn check_share(shadows: &Shadows, share: f32) -> Result<(), Error> {
    if !(share >= 0.0 && share.is_finite()) {
        return Err(Error::Invalid {
            field: "share",
            problem: format!("must be finite and at least 0, is {share}"),
        });
    }
    if shadows.bias().texels < share {
        return Err(Error::Invalid {
            field: "bias",
            problem: format!(
                "must have at least {share} texels, which `ClusterCasters::bias` gives, has {}",
                shadows.bias().texels
            ),
        });
    }
    Ok(())
}
