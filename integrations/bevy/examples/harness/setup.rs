//! What a view is drawn with.

use bevy::light::{CascadeShadowConfig, CascadeShadowConfigBuilder, ShadowFilteringMethod};
use bevy::prelude::*;
use bevy_umbrage::prelude::*;
use bevy_umbrage::umbrage::{Size, Technique};

/// The longest side of a picture or shadow map, before the device is asked for its own limit.
pub(crate) const MAX_SIDE: u32 = 8192;

/// How shadows are made.
#[derive(Clone, Debug)]
pub(crate) enum Umbrage {
    /// By Bevy as it comes: the plugin is not added.
    Off,
    /// With Bevy's cascades, and the plugin's lookup.
    Lookup,
    /// With planned cascades, and the plugin's lookup.
    Planned(Box<UmbrageShadows>),
}

/// A perspective view. Lengths are in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewPoint {
    pub(crate) eye: Vec3,
    /// The point in the middle of the picture.
    pub(crate) target: Vec3,
    /// Vertical field of view, radians.
    pub(crate) fov_y_rad: f32,
    pub(crate) near: f32,
    /// Where shadows end.
    pub(crate) far: f32,
}

/// Everything that a [`Harness`] is made for, apart from the scene.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// Width and height of the picture, pixels.
    pub(crate) size: [u32; 2],
    pub(crate) view: ViewPoint,
    /// The direction in which light travels, of any length.
    pub(crate) sun: Vec3,
    /// Bevy's own cascades. Of planned ones it has the distance at which they end.
    pub(crate) cascades: CascadeShadowConfig,
    /// Side of each map, texels: a power of two.
    pub(crate) map_size: u32,
    pub(crate) filter: ShadowFilteringMethod,
    pub(crate) msaa: Msaa,
    /// Whether surfaces are shaded from a G-buffer. It goes with [`Msaa::Off`] alone.
    pub(crate) deferred: bool,
    /// Bevy's bias along the light.
    pub(crate) depth_bias: f32,
    /// Bevy's bias along the surface's normal, texels.
    pub(crate) normal_bias: f32,
    pub(crate) umbrage: Umbrage,
}

impl Setup {
    /// 960 × 540 pixels, four cascades of 2048² texels over the whole view, Bevy's own defaults for
    /// filter and biases, and Bevy as it comes.
    ///
    /// # Errors
    /// If there is no such view, or if no cascades go with it.
    pub(crate) fn new(view: ViewPoint, sun: Vec3) -> Result<Self, String> {
        let ViewPoint { near, far, .. } = view;
        let setup = Self {
            size: [960, 540],
            view,
            sun,
            cascades: cascades(4, [near, far], None, BEVYS_OVERLAP)?,
            map_size: 2048,
            filter: ShadowFilteringMethod::default(),
            msaa: Msaa::Off,
            deferred: false,
            depth_bias: DirectionalLight::DEFAULT_SHADOW_DEPTH_BIAS,
            normal_bias: DirectionalLight::DEFAULT_SHADOW_NORMAL_BIAS,
            umbrage: Umbrage::Off,
        };
        setup.check()?;
        Ok(setup)
    }

    pub(super) fn check(&self) -> Result<(), String> {
        let ViewPoint { eye, target, fov_y_rad, near, far } = self.view;
        if self.size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
            let [width, height] = self.size;
            return Err(format!("the size must be 1 to {MAX_SIDE} pixels, is {width}x{height}"));
        }
        if !(eye.is_finite() && target.is_finite() && (target - eye).try_normalize().is_some()) {
            return Err(format!("the view from {eye} to {target} has no direction"));
        }
        if self.sun.try_normalize().is_none() {
            return Err(format!("the sun {} has no direction", self.sun));
        }
        if !(fov_y_rad > 0.0 && fov_y_rad < std::f32::consts::PI) {
            let degrees = fov_y_rad.to_degrees();
            return Err(format!("the field of view must be between 0 and 180°, is {degrees}°"));
        }
        if !(near > 0.0 && near < far && far.is_finite()) {
            return Err(format!("must be 0 < near < far, but near is {near} and far is {far}"));
        }
        if !(self.map_size.is_power_of_two() && self.map_size <= MAX_SIDE) {
            let size = self.map_size;
            return Err(format!("the map size must be a power of two up to {MAX_SIDE}, is {size}"));
        }
        if self.deferred && self.msaa != Msaa::Off {
            return Err("deferred shading goes without MSAA alone".into());
        }
        Ok(())
    }
}

/// Bevy's default share of a cascade in which it fades into the next one.
pub(crate) const BEVYS_OVERLAP: f32 = 0.2;

/// Bevy's cascades between two distances. The first ends at `first_far`, or by default where
/// Bevy's does: at 10 m, or at the same share of the distance where that is less than 20 m. If
/// nothing is seen so near, it ends halfway in proportion.
///
/// # Errors
/// If they do not follow each other, or if there are more or less than Bevy has.
pub(crate) fn cascades(
    count: usize,
    [near, far]: [f32; 2],
    first_far: Option<f32>,
    overlap: f32,
) -> Result<CascadeShadowConfig, String> {
    if !(1..=4).contains(&count) {
        return Err(format!("there must be 1 to 4 cascades, are {count}"));
    }
    if !(near > 0.0 && near < far && far.is_finite()) {
        return Err(format!("shadows must end beyond the near plane at {near}, but end at {far}"));
    }
    let by_default = if far >= 20.0 { 10.0 } else { far / 15.0 };
    let by_default = if by_default > near { by_default } else { (near * far).sqrt() };
    let first_far = first_far.unwrap_or(by_default);
    if count > 1 && !(first_far > near && first_far < far) {
        return Err(format!(
            "the first cascade must end between {near} and {far}, ends at {first_far}"
        ));
    }
    if !(0.0..1.0).contains(&overlap) {
        return Err(format!("the overlap must be at least 0 and less than 1, is {overlap}"));
    }
    let config = CascadeShadowConfigBuilder {
        num_cascades: count,
        // Nothing is seen nearer than the near plane.
        minimum_distance: near,
        maximum_distance: far,
        first_cascade_far_bound: first_far,
        overlap_proportion: overlap,
    };
    Ok(config.build())
}

/// How shadows are made, in words: `off`, `lookup`, or a technique such as `adaptive+z4@2048`. The
/// part behind `@` is the side of one map that has as many texels as all maps together; the side of
/// each map that follows is returned beside.
///
/// # Errors
/// If the text is none of these, or if the side of each map is not a power of two.
pub(crate) fn umbrage(text: &str) -> Result<(Umbrage, Option<u32>), String> {
    match text {
        "off" => return Ok((Umbrage::Off, None)),
        "lookup" => return Ok((Umbrage::Lookup, None)),
        _ => {}
    }
    let technique: Technique = text.parse().map_err(|e| format!("{e}"))?;
    let shadows = UmbrageShadows::new(technique).map_err(|e| format!("`{text}`: {e}"))?;
    let planned = Umbrage::Planned(Box::new(shadows.with_receivers(Receivers::Meshes)));
    if !text.contains('@') {
        return Ok((planned, None));
    }
    let Size::Budget(texels) = technique.size else {
        return Err(format!("`{text}`: Bevy's maps need a number of texels, as in @2048"));
    };
    let slices = technique.partition.slices;
    let side = (texels as f64 / f64::from(slices)).sqrt();
    if side.fract() != 0.0 || side > f64::from(MAX_SIDE) || !(side as u32).is_power_of_two() {
        return Err(format!(
            "`{text}`: {slices} maps of equal size would have sides of {side:.2} texels, but must \
             be a power of two up to {MAX_SIDE}: give @N with N²/{slices} its square"
        ));
    }
    Ok((planned, Some(side as u32)))
}

/// The filter of this name.
///
/// # Errors
/// If there is none.
pub(crate) fn filter(name: &str) -> Result<ShadowFilteringMethod, String> {
    match name {
        "hardware2x2" => Ok(ShadowFilteringMethod::Hardware2x2),
        "gaussian" => Ok(ShadowFilteringMethod::Gaussian),
        "temporal" => Ok(ShadowFilteringMethod::Temporal),
        _ => Err(format!("unknown filter {name:?}, must be hardware2x2, gaussian or temporal")),
    }
}
