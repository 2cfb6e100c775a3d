//! Techniques: what a plan is made by.

mod code;
mod filters;
pub mod language;
mod layouts;

use crate::error::{Error, check};
use crate::plan::Face;
use crate::visibility::Filter;

/// One way to make shadows: which maps there are, how their texels are spread, and how they are
/// looked up.
///
/// A technique is also a text, `WARP[+zK][+face][:FILTER][@TEXELS]`, which parses and prints both
/// ways; [`language`] lists its words:
///
/// ```
/// use umbrage::{Partition, Size, Technique, visibility::Filter};
///
/// let technique: Technique = "adaptive+z4:pcf3@2048".parse()?;
/// assert_eq!(technique, Technique {
///     partition: Partition::slices(4),
///     filter: Filter::Pcf { n: 3 },
///     size: Size::Budget(2048 * 2048),
///     ..Technique::default()
/// });
/// assert_eq!(technique.to_string(), "adaptive+z4:pcf3@2048");
/// # Ok::<(), umbrage::language::ParseError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Technique {
    /// How texels are spread over what each map covers.
    pub warp: Warp,
    /// What each map covers.
    pub cover: Cover,
    /// Which maps there are.
    pub partition: Partition,
    /// How the maps are looked up. The plan leaves room around them for what the filter reads, and
    /// keeps the depths of distant casters where the filter asks for these.
    pub filter: Filter,
    /// How many texels there are.
    pub size: Size,
}

impl Default for Technique {
    /// One `adaptive` map of 1024² texels with `hard` lookups.
    fn default() -> Self {
        Self {
            warp: Warp::Adaptive(Objective::Storage),
            cover: Cover::default(),
            partition: Partition::default(),
            filter: Filter::default(),
            size: Size::Budget(1024 * 1024),
        }
    }
}

/// What the device can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The longest side that the device allows a texture, texels, 1 ..= 65536.
    pub max_side: u32,
    /// Sides of maps are multiples of this, texels, 1 ..= `max_side`.
    pub align: u32,
}

impl Default for Limits {
    /// Sides up to WebGPU's guaranteed 8192, of any number of texels.
    fn default() -> Self {
        Self { max_side: 8192, align: 1 }
    }
}

/// What a map covers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cover {
    /// The receivers that the camera sees in the map's part of the view.
    #[default]
    Seen,
    /// All of the scene's bounds, whatever the camera sees: where everyone starts. Without bounds,
    /// the view frustum's bounding sphere. For [`Warp::Uniform`] alone.
    Scene,
    /// The bounding sphere of the map's part of the view frustum, whatever receivers there are. The
    /// map is stable: its texels keep their places and their size in the world however the camera
    /// moves or turns, since the map moves by whole texels. So shadows do not shimmer. Under spot
    /// and point lights it covers all that the light shines on. For [`Warp::Uniform`] alone, not
    /// with partitions by face, nor with [`Splits::Fitted`]; a map needs at least 2 × 2 texels.
    Stable,
}

impl Cover {
    /// Whether maps stay as they are whatever is seen of what they cover.
    pub(crate) fn is_fixed(self) -> bool {
        self != Self::Seen
    }

    /// Of a side's texels, those that only leave room to move by whole texels.
    pub(crate) fn spare_texels(self) -> u32 {
        u32::from(self == Self::Stable)
    }
}

/// How texels are spread over what a map serves.
///
/// All but `Uniform` and `Psm` are one-point perspectives along light space's z axis and differ in λ
/// alone, the distance from the centre of projection to the near plane. All but `Lambda` become
/// `Uniform` smoothly as the view turns into the light. Along the light itself z has no direction to
/// follow: as the view sweeps past, the map turns half around within the angle by which it misses,
/// `Uniform`'s too.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warp {
    /// No warp: texels are spread evenly over the light plane.
    Uniform,
    /// Perspective shadow maps (Stamminger and Drettakis 2002): the map looks from the light at the
    /// world as it is after the viewer's own perspective. The depth stored is the light's own,
    /// so casters behind the eye need no moving back of the viewer.
    /// Where a spot light stands among what is seen so that no perspective shows all of it, `Uniform`.
    Psm,
    /// Light space perspective shadow maps (Wimmer et al. 2004): λ = (n + √(n f))/sin θ, with f drawn
    /// in to n + μ sin θ where the tilt shrinks the warp's range (§4.4). n and f are the nearest and
    /// farthest view distance of the receivers seen.
    /// Under light within about φ of the view it can need several times the texels of `Uniform` for the same
    /// largest error.
    Lispsm,
    /// Trapezoidal shadow maps (Martin and Tan 2004, as Lloyd et al. 2006 describe them): what is
    /// nearer than the focus distance gets 80% of the rows. Never stronger than λ = n/sin θ.
    Tsm {
        /// Metres along the view, > 0; `None`: √(n f) of the receivers seen.
        focus: Option<f64>,
    },
    /// The λ that makes the objective smallest over the receivers seen, and never larger than
    /// `Uniform` has it (under spot lights, with [`Objective::Area`]: by no more than one per cent). Where
    /// sin θ < sin φ/4 it fades out. For thin strips, such as a slice of a flat floor, two values of λ can
    /// be nearly as good; then a small motion may make it jump from one to the other.
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

/// How what the camera sees is divided among maps. The number of maps depends on nothing else, but for
/// the lights' number and kind; those that have nothing to serve are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partition {
    /// Slices along the view, 1 ..= [`MAX_SLICES`](Self::MAX_SLICES).
    pub slices: u32,
    /// Where slices meet.
    pub splits: Splits,
    /// How far each slice reaches into the next one, as a share of its own length, 0 ..= 1. There
    /// [`Plan::lookup`](crate::Plan::lookup) fades from one map to the next.
    pub overlap: f64,
    /// Whether the view frustum's faces get maps of their own.
    pub faces: Faces,
}

impl Partition {
    /// The largest number of slices.
    pub const MAX_SLICES: usize = 16;

    /// This many self-similar slices.
    pub fn slices(slices: u32) -> Self {
        Self { slices, ..Self::default() }
    }
}

/// One map for all.
impl Default for Partition {
    fn default() -> Self {
        Self { slices: 1, splits: Splits::SelfSimilar, overlap: 0.0, faces: Faces::Whole }
    }
}

/// Where slices along the view meet. n and f are the nearest and farthest view distance of the
/// receivers seen; for [`Cover::Stable`] the camera's own.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Splits {
    /// At n (f/n)^(i/K): slices are alike but for their size (Lloyd et al. 2006, Eqs. 15, 16).
    SelfSimilar,
    /// A blend of even slices (0) and self-similar ones (1): the `practical` scheme of parallel-split
    /// shadow maps (Zhang et al. 2006).
    Practical(f64),
    /// At these distances, metres, ascending; as many as there are slices less one, the rest is ignored.
    At([f64; Partition::MAX_SLICES - 1]),
    /// Where every slice's map needs as many texels as the next for the same error, by the errors over
    /// the receivers really there.
    Fitted,
}

/// Whether the view frustum's faces, as seen from the light, get maps of their own (Lloyd et al. 2006,
/// §5.1): its front faces where the light comes from behind the viewer, else its back faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Faces {
    /// No: maps serve the frustum as a whole.
    #[default]
    Whole,
    /// The four side faces, each cut into slices, and the near face: 4 K + 1 maps.
    SidesAndNear,
    /// The four side faces alone, reaching to the eye to cover the near face: 4 K maps.
    Sides,
}

/// How many texels a plan has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// At most this many texels in all, 1 ..= 2³² and at least one for each map, divided among maps, and
    /// in each between s and t, so that the largest errors of all are equal (Lloyd et al. 2006, Eqs. 13, 14).
    Budget(u64),
    /// Every map has exactly this size, texels in s and t.
    Exact([u32; 2]),
    /// The fewest texels with which no map's largest error, in the worst direction, exceeds this many
    /// pixels per texel, > 0: the critical resolution if it is 1.
    MaxError(f64),
}

impl Technique {
    /// That every value makes sense, and that they go together. A [`Planner`](crate::Planner) checks
    /// this itself.
    ///
    /// # Errors
    /// Names the first field that is out of its range.
    pub fn check(&self) -> Result<(), Error> {
        match self.size {
            Size::Budget(texels) => {
                check((1..=1 << 32).contains(&texels), "technique.size", || {
                    format!("must be a budget of 1 to 2^32 texels, is {texels}")
                })?;
            }
            Size::Exact(size) => check(!size.contains(&0), "technique.size", || {
                format!("must have texels each way, is {}x{}", size[0], size[1])
            })?,
            Size::MaxError(pixels) => {
                check(pixels > 0.0 && pixels.is_finite(), "technique.size", || {
                    format!("must be an error of more than 0 pixels per texel, is {pixels}")
                })?;
            }
        }
        match self.warp {
            Warp::Lambda(lambda) => check(lambda > 0.0, "technique.warp.lambda", || {
                format!("must be a positive distance, is {lambda}")
            })?,
            Warp::Tsm { focus: Some(focus) } => {
                check(focus > 0.0 && focus.is_finite(), "technique.warp.focus", || {
                    format!("must be a positive, finite distance, is {focus}")
                })?;
            }
            _ => {}
        }
        check(!self.cover.is_fixed() || self.warp == Warp::Uniform, "technique.cover", || {
            "only maps that are not warped can cover more than the receivers seen: take Warp::Uniform"
                .into()
        })?;
        if self.cover == Cover::Stable {
            check(self.partition.faces == Faces::Whole, "technique.partition.faces", || {
                "stable maps do not turn with the view: they cannot serve its faces".into()
            })?;
            check(self.partition.splits != Splits::Fitted, "technique.partition.splits", || {
                "stable maps cannot be fitted to what is seen: take other splits".into()
            })?;
            let is_line = matches!(self.size, Size::Exact(size) if size.contains(&1));
            check(!is_line, "technique.size", || {
                "a stable map needs at least 2 texels each way".into()
            })?;
        }
        self.partition.check()?;
        self.filter.check()
    }
}

impl Limits {
    /// That the limits make sense, and that maps of a technique keep within them.
    pub(crate) fn check(&self, technique: &Technique) -> Result<(), Error> {
        let Self { max_side, align } = *self;
        check((1..=65536).contains(&max_side), "limits.max_side", || {
            format!("must be 1 to 65536 texels, is {max_side}")
        })?;
        check((1..=max_side).contains(&align), "limits.align", || {
            format!("must be 1 to max_side ({max_side}) texels, is {align}")
        })?;
        if let Size::Exact(size) = technique.size {
            let fits = |n: &u32| (1..=max_side).contains(n) && n % align == 0;
            check(size.iter().all(fits), "technique.size", || {
                format!(
                    "must be multiples of {align} from {align} to {max_side} texels each way, is {}x{}",
                    size[0], size[1]
                )
            })?;
        }
        let most = max_side / align * align;
        check(most > technique.cover.spare_texels(), "technique.size", || {
            "a stable map needs at least 2 texels each way".into()
        })
    }
}

impl Partition {
    fn check(&self) -> Result<(), Error> {
        check(
            (1..=Self::MAX_SLICES as u32).contains(&self.slices),
            "technique.partition.slices",
            || format!("must be 1 to {}, is {}", Self::MAX_SLICES, self.slices),
        )?;
        check((0.0..=1.0).contains(&self.overlap), "technique.partition.overlap", || {
            format!("must be a share of 0 to 1, is {}", self.overlap)
        })?;
        match self.splits {
            Splits::Practical(blend) => {
                check((0.0..=1.0).contains(&blend), "technique.partition.splits", || {
                    format!("must be a blend of 0 (even) to 1 (self-similar), is {blend}")
                })
            }
            Splits::At(distances) => {
                let used = &distances[..self.slices as usize - 1];
                check(
                    used.iter().all(|d| (1e-12..=1e12).contains(d))
                        && used.windows(2).all(|w| w[0] < w[1]),
                    "technique.partition.splits",
                    || {
                        format!(
                            "must be {} ascending distances of 1e-12 to 1e12 metres, are {used:?}",
                            used.len()
                        )
                    },
                )
            }
            Splits::SelfSimilar | Splits::Fitted => Ok(()),
        }
    }

    /// The faces that maps are for, in the order of the maps; `None` is the whole frustum. The near
    /// face has one map, every other one for each slice.
    pub(crate) fn face_list(&self) -> &'static [Option<Face>] {
        use Face::{Bottom, Left, Near, Right, Top};
        match self.faces {
            Faces::Whole => &[None],
            Faces::Sides => &[Some(Bottom), Some(Right), Some(Top), Some(Left)],
            Faces::SidesAndNear => &[Some(Bottom), Some(Right), Some(Top), Some(Left), Some(Near)],
        }
    }
}
