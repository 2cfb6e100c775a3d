use crate::error::{Error, check};

/// How to lay out a light's shadow maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How texels are spread over what the camera sees.
    pub warp: Warp,
    /// How many texels there are.
    pub size: Size,
    /// The longest side that the device allows a texture, texels, 1 ..= 65536.
    pub max_side: u32,
}

impl Default for Options {
    /// `adaptive`, 1024² texels, sides up to WebGPU's guaranteed 8192.
    fn default() -> Self {
        Self {
            warp: Warp::Adaptive(Objective::Storage),
            size: Size::Budget(1024 * 1024),
            max_side: 8192,
        }
    }
}

/// How texels are spread over what the camera sees.
///
/// All but `Unfocused`, `Uniform` and `Psm` are one-point perspectives along light space's z axis and
/// differ in λ alone, the distance from the centre of projection to the near plane. All but
/// `Unfocused` and `Lambda` become `Uniform` smoothly as the view turns into the light. Along the light
/// itself z has no direction to follow: as the view sweeps past, the map turns half around within
/// the angle by which it misses, `Uniform`'s too.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warp {
    /// One even map around all of the scene's bounds, whatever the camera sees: where everyone
    /// starts. Without bounds, around the view frustum's bounding sphere.
    Unfocused,
    /// An even map focused on the receivers that the camera sees.
    Uniform,
    /// Perspective shadow maps (Stamminger and Drettakis 2002): the map looks from the light at the
    /// world as it is after the viewer's own perspective. The depth stored is the light's own,
    /// so casters behind the eye need no moving back of the viewer.
    /// Where a spot light stands among what is seen so that no perspective shows all of it, `Uniform`.
    Psm,
    /// Light space perspective shadow maps (Wimmer et al. 2004): λ = (n + √(n f))/sin θ, with f drawn
    /// in to n + μ sin θ where the tilt shrinks the warp's range (§4.4). n and f are the nearest and
    /// farthest view distance of the receivers seen.
    Lispsm,
    /// Trapezoidal shadow maps (Martin and Tan 2004, as Lloyd et al. 2006 describe them): what is
    /// nearer than the focus distance gets 80% of the rows. Never stronger than λ = n/sin θ.
    Tsm {
        /// Metres along the view, > 0; `None`: √(n f) of the receivers seen.
        focus: Option<f64>,
    },
    /// The λ that makes the objective smallest over the receivers seen, and never larger than
    /// `Uniform` has it (under spot lights, with [`Objective::Area`]: by no more than one per cent). Where
    /// sin θ < sin φ/4 it fades out.
    Adaptive(Objective),
    /// Logarithmic rows behind the λ = n/sin θ perspective: the unreachable optimum. Only the CPU
    /// reference can render it.
    Log,
    /// λ as told: light-space metres, > 0, or infinite for no warp. (For spot lights, after
    /// the light's perspective, in units of its image plane at unit distance.)
    Lambda(f64),
}

/// What [`Warp::Adaptive`] makes smallest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objective {
    /// The texels needed for a guaranteed error: largest m_s times largest m_t.
    #[default]
    Storage,
    /// The largest m_s·m_t at any one point: the worst texel's area.
    Area,
}

/// How many texels a plan has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// At most this many texels in all, 1 ..= 2³², divided between s and t so that the largest
    /// errors in both are equal (Lloyd et al. 2006, Eqs. 13, 14).
    Budget(u64),
    /// Every map has exactly this size, texels in s and t.
    Exact([u32; 2]),
}

impl Options {
    pub(crate) fn check(&self) -> Result<(), Error> {
        check((1..=65536).contains(&self.max_side), "options.max_side", || {
            format!("must be 1 to 65536 texels, is {}", self.max_side)
        })?;
        match self.size {
            Size::Budget(texels) => {
                check((1..=1 << 32).contains(&texels), "options.size", || {
                    format!("must be a budget of 1 to 2^32 texels, is {texels}")
                })?;
            }
            Size::Exact(size) => {
                check(
                    size.iter().all(|n| (1..=self.max_side).contains(n)),
                    "options.size",
                    || {
                        format!(
                            "must be 1 to {} texels each way, is {}x{}",
                            self.max_side, size[0], size[1]
                        )
                    },
                )?;
            }
        }
        match self.warp {
            Warp::Lambda(lambda) => check(lambda > 0.0, "options.warp.lambda", || {
                format!("must be a positive distance, is {lambda}")
            }),
            Warp::Tsm { focus: Some(focus) } => {
                check(focus > 0.0 && focus.is_finite(), "options.warp.focus", || {
                    format!("must be a positive, finite distance, is {focus}")
                })
            }
            _ => Ok(()),
        }
    }
}
