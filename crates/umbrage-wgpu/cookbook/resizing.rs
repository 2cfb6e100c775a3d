use umbrage::{Camera, ClipDepth, Error};

/// The camera of a picture that has changed its size. Nothing else has to be told: the plan's
/// errors, and with `Size::MaxError` its texels, follow from the picture's size, and so do filters
/// whose widths are told in pixels. `Shadows` finds new places for maps that change their sizes.
///
/// A window that is minimised has no pixels. Draw nothing then, or keep the last camera.
pub fn resized(
    world_from_view: glam::DMat4,
    clip_from_view: impl Fn(f32) -> glam::Mat4,
    size: [u32; 2],
) -> Option<Result<Camera, Error>> {
    if size.contains(&0) {
        return None;
    }
    let aspect_ratio = size[0] as f32 / size[1] as f32;
    let projection = clip_from_view(aspect_ratio).as_dmat4();
    Some(Camera::from_matrices(world_from_view, projection, ClipDepth::ZeroToOne, None, size))
}
