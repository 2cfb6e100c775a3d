use std::borrow::Cow;

/// Why there is no plan for an input.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field has an invalid value.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the field, such as `camera.near`.
        field: &'static str,
        /// What is wrong with the value and which values are right.
        problem: Cow<'static, str>,
    },
    /// A plan's number would not be finite, although each field is in its range.
    #[error(
        "the {what} of map {map} would not be finite: the view, the light or the receivers are too extreme together"
    )]
    NotFinite {
        /// Index of the map.
        map: usize,
        /// What the number belongs to.
        what: &'static str,
    },
}

impl Error {
    pub(crate) fn invalid(field: &'static str, problem: impl Into<Cow<'static, str>>) -> Self {
        Self::Invalid { field, problem: problem.into() }
    }
}

/// An error that names `field`, unless `ok`.
pub(crate) fn check(
    ok: bool,
    field: &'static str,
    problem: impl FnOnce() -> String,
) -> Result<(), Error> {
    if ok { Ok(()) } else { Err(Error::invalid(field, problem())) }
}

/// Checks that every coordinate is finite and at most 10¹² metres, so that squares and products
/// of a few coordinates stay finite.
pub(crate) fn check_position(v: glam::DVec3, field: &'static str) -> Result<(), Error> {
    check(v.is_finite() && v.abs().max_element() <= 1e12, field, || {
        format!("must be finite and within 1e12 metres of the origin, is {v}")
    })
}

/// The unit vector along `v`, or an error that names `field`.
pub(crate) fn unit(v: glam::DVec3, field: &'static str) -> Result<glam::DVec3, Error> {
    // Scaling first keeps squares of lengths like 1e-200 or 1e200 from under- or overflowing.
    let scale = v.abs().max_element();
    check(v.is_finite() && scale > 0.0, field, || {
        format!("must be a finite direction of non-zero length, is {v}")
    })?;
    Ok((v / scale).normalize())
}
