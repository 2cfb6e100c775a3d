//! Techniques: which shadow maps a plan has, how they are warped and how they are looked up.

mod code;
mod completion;
mod edits;
mod filters;
pub mod language;
mod layouts;
mod scale;

use crate::error::{Error, check};
use crate::paged::{LEAST_BUDGET, LEAST_ERROR, MOST_ERROR};
use crate::plan::Face;
use crate::visibility::Filter;

/// One way to make shadows: which maps there are, how their texels are spread over what they cover,
/// and how the maps are looked up.
///
/// A technique is also a text, `WARP[+zK][+face][:FILTER][@TEXELS]` or `none`, which can be parsed
/// and printed; [`language`] lists its words:
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
    /// How the view is divided among maps.
    pub partition: Partition,
    /// How the maps are looked up. A plan leaves room around each map for the texels that the
    /// filter reads, and keeps the depths of distant casters if the filter needs them.
    pub filter: Filter,
    /// How many texels the maps have.
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

/// The longest side that a map can have on any device, in texels.
const MAX_SIDE: u32 = 65536;

/// The texture sizes that the device allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The longest side of a texture, in texels, 1 ..= 65536.
    pub max_side: u32,
    /// The sides of all maps are multiples of this number of texels, 1 ..= `max_side`.
    pub align: u32,
}

impl Default for Limits {
    /// Sides of up to 8192 texels, which WebGPU guarantees, without alignment.
    fn default() -> Self {
        Self { max_side: 8192, align: 1 }
    }
}

/// What a map covers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Cover {
    /// The receivers that the camera sees in the map's part of the view.
    #[default]
    Seen,
    /// All of the scene's bounds, whatever the camera sees. Without bounds, the bounding sphere of
    /// the view frustum. Only for [`Warp::Uniform`].
    Scene,
    /// The bounding sphere of the map's part of the view frustum, whatever receivers there are. The
    /// map is stable: it moves by whole texels only, so its texels keep their positions and their
    /// size in the world however the camera moves or turns, and shadows do not shimmer. Under spot
    /// and point lights the map covers all that the light reaches.
    ///
    /// Only for [`Warp::Uniform`], neither with partitions by face nor with [`Splits::Fitted`]. A
    /// stable map has at least 2 × 2 texels.
    Stable,
    /// Even maps whose texels are a power of two wide and keep their places in the world, of which
    /// only those [pages](crate::paged) exist that the camera sees. Each receiver is looked up in
    /// the coarsest map whose texels are no wider than `error` pixels there.
    ///
    /// Only for [`Warp::Uniform`], without a partition, and with filters that are no prefilters.
    /// The size is [`Size::Needed`], or a [`Size::Budget`] that the pages share.
    Paged {
        /// The greatest width of a texel across the light, pixels,
        /// [`LEAST_ERROR`](crate::paged::LEAST_ERROR) ..=
        /// [`MOST_ERROR`](crate::paged::MOST_ERROR).
        error: f64,
    },
}

impl Cover {
    /// Whether a map's matrix is independent of which receivers the camera sees.
    pub(crate) fn is_fixed(self) -> bool {
        self != Self::Seen
    }

    /// The number of texels of a side that are reserved for moving the map by whole texels.
    pub(crate) fn spare_texels(self) -> u32 {
        u32::from(self == Self::Stable)
    }
}

/// How texels are spread over the light plane.
///
/// All warps but `Uniform` and `Psm` are one-point perspectives along light space's z axis. They
/// differ only in λ, the distance from the centre of projection to the warp's near plane. All but
/// `Lambda` turn smoothly into `Uniform` as the view direction approaches the light direction.
///
/// In orthographic views a pixel has the same width at every depth. `Psm`, `Lispsm`, `Tsm` and
/// `Log`, which undo the viewer's perspective, are then `Uniform`; the λ of their rules tends to
/// infinity as a perspective view recedes. So is `Adaptive` under parallel light, where texels of
/// every even map are as good as each other. Under a lamp texels grow with the distance from the
/// lamp, and it may still warp. `Lambda` does what it says.
///
/// Where the view runs exactly along the light, the view direction does not define a z axis. While
/// the view sweeps past the light direction, every map therefore makes half a turn, `Uniform`
/// included, within about the angle by which the view misses the light direction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warp {
    /// No warp: texels are spread evenly over the light plane.
    Uniform,
    /// Perspective shadow maps (Stamminger and Drettakis 2002): the light's view of the world after
    /// the viewer's perspective. The depth stored is the light's own, not the one after the
    /// viewer's perspective, so casters behind the eye do not require a virtual move of the viewer.
    /// If a spot light stands amid the receivers seen so that no perspective shows them all, the
    /// map is `Uniform`.
    Psm,
    /// Light space perspective shadow maps (Wimmer et al. 2004): λ = (n + √(n f))/sin θ, where
    /// n and f are the view distances of the nearest and the farthest receiver seen. f is limited
    /// to n + μ sin θ, which is less than f where the tilt of the view shortens the warp's depth
    /// range μ (§4.4). Where the angle θ between view and light is not much larger than φ, this
    /// warp can need several times the texels of `Uniform` for the same largest error.
    Lispsm,
    /// Trapezoidal shadow maps (Martin and Tan 2004, as Lloyd et al. 2006 describe them): receivers
    /// nearer than the focus distance get 80% of the rows. λ is at least n/sin θ.
    Tsm {
        /// Focus distance along the view, metres, > 0; `None` stands for √(n f) of the receivers
        /// seen.
        focus: Option<f64>,
    },
    /// The λ that minimises the objective over the receivers seen. The objective is never larger
    /// than for `Uniform` (under spot and point lights, with [`Objective::Area`]: larger by one per
    /// cent at most). Where sin θ < sin φ/4 the warp fades out.
    ///
    /// For thin strips, such as a slice of a flat floor, two distant values of λ can be nearly
    /// equally good; then λ may jump from one to the other after a small motion.
    Adaptive(Objective),
    /// Logarithmic rows after the perspective with λ = n/sin θ: the optimum, which no GPU can
    /// rasterise. Only the CPU reference renders it.
    Log,
    /// A perspective with this λ > 0 in light-space metres; infinite λ is no warp. (Under spot
    /// lights λ counts in units of the light's image plane at distance 1.)
    Lambda(f64),
}

impl Warp {
    /// The warp for views without a perspective, in which all pixels have the same width. Under
    /// parallel light all texels of even maps have the same width, too.
    pub(crate) fn without_perspective(self, is_light_parallel: bool) -> Self {
        match self {
            Self::Psm | Self::Lispsm | Self::Tsm { .. } | Self::Log => Self::Uniform,
            Self::Adaptive(_) if is_light_parallel => Self::Uniform,
            Self::Uniform | Self::Adaptive(_) | Self::Lambda(_) => self,
        }
    }
}

/// The quantity that [`Warp::Adaptive`] minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Objective {
    /// The number of texels needed for a guaranteed error: the largest m_s times the largest m_t.
    #[default]
    Storage,
    /// The largest area of a texel on screen: the largest product m_s·m_t at any one point.
    Area,
}

/// How the view is divided among maps. The number of maps depends on the partition and on the
/// number and kinds of the lights alone. Maps without receivers are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Partition {
    /// Number of slices (cascades) along the view, 1 ..= [`MAX_SLICES`](Self::MAX_SLICES).
    pub slices: u32,
    /// Where neighbouring slices meet.
    pub splits: Splits,
    /// How far each slice reaches into the next one, as a share of its own length, 0 ..= 1. In this
    /// overlap [`Plan::lookup`](crate::Plan::lookup) fades from one map to the next.
    pub overlap: f64,
    /// Whether the faces of the view frustum have maps of their own.
    pub faces: Faces,
}

impl Partition {
    /// The largest number of slices.
    pub const MAX_SLICES: usize = 16;

    /// A partition into self-similar slices.
    pub fn slices(slices: u32) -> Self {
        Self { slices, ..Self::default() }
    }
}

/// One map for the whole view.
impl Default for Partition {
    fn default() -> Self {
        Self { slices: 1, splits: Splits::SelfSimilar, overlap: 0.0, faces: Faces::Whole }
    }
}

/// Where slices along the view meet. n and f are the view distances of the nearest and the farthest
/// receiver seen; for [`Cover::Stable`] they are the camera's near and far distance. In
/// orthographic views slices of equal length have equal errors, so `SelfSimilar` and `Practical`
/// make these.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Splits {
    /// At n (f/n)^(i/K) for i = 1 ..= K − 1, so that all slices have the same shape (Lloyd et al.
    /// 2006, Eqs. 15, 16).
    SelfSimilar,
    /// A blend between slices of equal length (0) and self-similar ones (1): the practical split
    /// scheme of parallel-split shadow maps (Zhang et al. 2006).
    Practical(f64),
    /// At these distances along the view, metres, ascending. Only the first K − 1 are used.
    At([f64; Partition::MAX_SLICES - 1]),
    /// Where all slices' maps need equally many texels for the same error over the receivers seen.
    Fitted,
}

/// Whether the faces of the view frustum have maps of their own (Lloyd et al. 2006, §5.1). The
/// faces used are the frustum's front faces, as seen from the light, if the light comes from behind
/// the viewer, and its back faces otherwise.
///
/// In orthographic views all faces would need the same map. The first face serves the whole view
/// there, and the maps of the others are empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Faces {
    /// No: each map serves the frustum as a whole.
    #[default]
    Whole,
    /// The four side faces, each cut into K slices, and the near face: 4 K + 1 maps.
    SidesAndNear,
    /// The four side faces alone, whose maps reach to the eye and serve the near face too: 4 K
    /// maps.
    Sides,
}

/// How many texels a plan's maps have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// At most this many texels in all, 1 ..= 2³² and at least one for each map. They are divided
    /// among the maps, and in each map between s and t, so that all largest errors are equal (Lloyd
    /// et al. 2006, Eqs. 13, 14).
    Budget(u64),
    /// Every map has exactly this many texels in s and t.
    Exact([u32; 2]),
    /// The fewest texels with which no map's largest error in the worst direction exceeds this many
    /// pixels per texel, > 0. An error of 1 gives the critical resolution.
    MaxError(f64),
    /// As many pages as the view needs. Only for [`Cover::Paged`], which has an error of its own.
    Needed,
}

impl Technique {
    /// Checks that all values are in their ranges and can be combined. A
    /// [`Planner`](crate::Planner) does this check itself.
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
            Size::Needed => {
                check(matches!(self.cover, Cover::Paged { .. }), "technique.size", || {
                    "must be given but for paged maps, which have what the view needs".into()
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
        if let Cover::Paged { error } = self.cover {
            self.check_paged(error)?;
        }
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

    fn check_paged(&self, error: f64) -> Result<(), Error> {
        check((LEAST_ERROR..=MOST_ERROR).contains(&error), "technique.cover", || {
            format!("must have an error of {LEAST_ERROR} to {MOST_ERROR} pixels, is {error}")
        })?;
        check(self.partition == Partition::default(), "technique.partition", || {
            "paged maps choose a level at each receiver: they have no slices and no faces".into()
        })?;
        check(self.filter.prefilter().is_none(), "technique.filter", || {
            "pages have no prefilters: take hard, pcfN or pcss".into()
        })?;
        let is_size = match self.size {
            Size::Budget(texels) => texels >= LEAST_BUDGET,
            Size::Needed => true,
            Size::Exact(_) | Size::MaxError(_) => false,
        };
        check(is_size, "technique.size", || {
            format!(
                "pages share a budget of at least {LEAST_BUDGET} texels, as @512, or have what the \
                 view needs; paged(error=1) limits the width of texels"
            )
        })
    }
}

impl Limits {
    /// Checks that the limits are in their ranges and that they allow the technique's size.
    pub(crate) fn check(&self, technique: &Technique) -> Result<(), Error> {
        let Self { max_side, align } = *self;
        check((1..=MAX_SIDE).contains(&max_side), "limits.max_side", || {
            format!("must be 1 to {MAX_SIDE} texels, is {max_side}")
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

    /// The faces that have maps, in the order of the maps; `None` is the whole frustum. The near
    /// face has one map, every other face one for each slice.
    pub(crate) fn face_list(&self) -> &'static [Option<Face>] {
        use Face::{Bottom, Left, Near, Right, Top};
        match self.faces {
            Faces::Whole => &[None],
            Faces::Sides => &[Some(Bottom), Some(Right), Some(Top), Some(Left)],
            Faces::SidesAndNear => &[Some(Bottom), Some(Right), Some(Top), Some(Left), Some(Near)],
        }
    }
}
