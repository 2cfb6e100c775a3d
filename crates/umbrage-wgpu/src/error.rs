use umbrage::AtlasTooLarge;
use umbrage::visibility::Filter;

/// Why there are no shadows.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The device cannot do what the library cannot do without.
    #[error("the device lacks {what}, {why}")]
    Unsupported {
        /// What is missing.
        what: &'static str,
        /// What it would be for, and what to do.
        why: &'static str,
    },
    /// The plan's maps do not fit into a texture of this device.
    #[error(transparent)]
    NoRoom(#[from] AtlasTooLarge),
    /// The plan has more of something than this device can be told of. Devices with storage buffers can be
    /// told of any number.
    #[error("{given} {what}, but this device, which has no storage buffers, can take {max} only")]
    TooMany {
        /// Of what: lights, maps or planes around what maps serve.
        what: &'static str,
        /// How many there are.
        given: usize,
        /// How many are possible.
        max: usize,
    },
    /// No GPU rasterises a map with logarithmic rows ([`Warp::Log`](umbrage::Warp::Log)).
    #[error(
        "map {map} has logarithmic rows, which no GPU rasterises: take another warp than `log`"
    )]
    LogarithmicRows {
        /// Index of the map in the plan.
        map: usize,
    },
    /// The plan is for another filter than the shadows look maps up with: casters would be missing at
    /// the maps' borders, or soft shadows would not know how far casters lie. Plan with the
    /// [`Technique`](umbrage::Technique) whose filter the
    /// [`ShadowOptions`](crate::ShadowOptions::filter) have.
    #[error(
        "the plan is for the filter `{planned}`, but the maps are looked up with `{looked_up}`: give both the \
         same technique's filter"
    )]
    OtherFilter {
        /// The plan's.
        planned: Filter,
        /// The shadows' own.
        looked_up: Filter,
    },
    /// A field's value makes no sense.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the field, such as `frame.render_origin`.
        field: &'static str,
        /// What is wrong with it and what would be right.
        problem: String,
    },
}
