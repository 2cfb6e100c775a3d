use umbrage::Technique;
use umbrage_wgpu::{Error, ShadowOptions, Shadows};

/// Takes another technique from the next frame on. A filter is part of the shader's text and of the
/// bind group's layout, so another filter takes new [`Shadows`], and `make_pipeline` makes those of
/// your pipelines anew that look shadows up. All else of a technique (warp, slices, texels) is the
/// plan's affair: pipelines stay as they are, and this gives `None`.
pub fn change_technique<P>(
    device: &wgpu::Device,
    shadows: &mut Shadows,
    technique: &Technique,
    make_pipeline: impl FnOnce(&Shadows) -> P,
) -> Result<Option<P>, Error> {
    if shadows.options().filter == technique.filter {
        return Ok(None);
    }
    let options = ShadowOptions { filter: technique.filter, ..*shadows.options() };
    // A filter that the device cannot have is an error, and the old shadows stay.
    *shadows = Shadows::new(device, *shadows.support(), &options)?;
    Ok(Some(make_pipeline(shadows)))
}
