use umbrage::{Bounds, Camera, Error, Light, LookAt, Plan, Planner, Technique};

/// A plan whose shadows end at a distance of `reach` metres, although the picture goes on. They
/// fade out over the last tenth of that distance, so that nobody sees where they end. The lookup's
/// [`ShadowOptions`](umbrage_wgpu::ShadowOptions) must have `fades: true`.
pub fn shadows_up_to<'a>(
    planner: &'a mut Planner,
    (view, reach): (LookAt, f64),
    (lights, bounds): (&[Light], &Bounds<'_>),
    technique: &Technique,
) -> Result<&'a Plan, Error> {
    planner.set_fade(Planner::FADE)?;
    let camera = Camera::look_at(LookAt { far: view.far.min(reach), ..view })?;
    planner.plan(&camera, lights, bounds, technique)
}
