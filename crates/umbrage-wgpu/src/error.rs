use umbrage::AtlasTooLarge;
use umbrage::visibility::Filter;

/// Why shadows cannot be created or prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The device lacks a capability that the library or the chosen filter needs.
    #[error("the device lacks {what}, {why}")]
    Unsupported {
        /// The missing capability.
        what: &'static str,
        /// What the capability is needed for, and what to do instead.
        why: &'static str,
    },
    /// The maps of the plan do not fit into a texture of this device.
    #[error(transparent)]
    NoRoom(#[from] AtlasTooLarge),
    /// The plan has more lights, maps or planes than fit into uniform buffers. Storage buffers, on
    /// devices that have them, have no such limit: see
    /// [`LookupBuffers`](crate::LookupBuffers).
    #[error(
        "{given} {what}, but uniform buffers hold {max} only: take storage buffers if the device has them"
    )]
    TooMany {
        /// The elements that are too many: lights, maps, or planes around the parts of the view
        /// that maps serve.
        what: &'static str,
        /// The number of these elements in the plan.
        given: usize,
        /// The greatest possible number.
        max: usize,
    },
    /// A map has logarithmic rows ([`Warp::Log`](umbrage::Warp::Log)), which no GPU can rasterise.
    #[error(
        "map {map} has logarithmic rows, which no GPU rasterises: take another warp than `log`"
    )]
    LogarithmicRows {
        /// Index of the map in the plan.
        map: usize,
    },
    /// The plan is for another filter than the one with which the maps are looked up. Casters would
    /// be missing at the borders of the maps, or soft shadows would lack the depths of their
    /// casters. Use one [`Technique`](umbrage::Technique) for the plan, and its filter in the
    /// [`ShadowOptions`](crate::ShadowOptions::filter).
    #[error(
        "the plan is for the filter `{planned}`, but the maps are looked up with `{looked_up}`: give both the \
         same technique's filter"
    )]
    OtherFilter {
        /// The filter of the plan.
        planned: Filter,
        /// The filter of the [`ShadowOptions`](crate::ShadowOptions::filter).
        looked_up: Filter,
    },
    /// The value of a field is not valid.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the field, such as `frame.render_origin`.
        field: &'static str,
        /// What is wrong with the value, and which values are valid.
        problem: String,
    },
}
