use std::borrow::Cow;

/// What can be wrong with the input to a plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field's value makes no sense.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the field, such as `camera.near`.
        field: &'static str,
        /// What is wrong with it and what would be right.
        problem: Cow<'static, str>,
    },
}

impl Error {
    pub(crate) fn invalid(field: &'static str, problem: impl Into<Cow<'static, str>>) -> Self {
        Self::Invalid { field, problem: problem.into() }
    }
}

/// `Err` naming `field` unless `ok`.
pub(crate) fn check(
    ok: bool,
    field: &'static str,
    problem: impl FnOnce() -> String,
) -> Result<(), Error> {
    if ok { Ok(()) } else { Err(Error::invalid(field, problem())) }
}

/// Checks that every coordinate is finite and so small that squares and products of a few of them
/// stay finite: the world's coordinates end at 10¹² metres.
pub(crate) fn check_position(v: glam::DVec3, field: &'static str) -> Result<(), Error> {
    check(v.is_finite() && v.abs().max_element() <= 1e12, field, || {
        format!("must be finite and within 1e12 metres of the origin, is {v}")
    })
}

/// The unit vector along `v`, or an error naming `field`.
pub(crate) fn unit(v: glam::DVec3, field: &'static str) -> Result<glam::DVec3, Error> {
    // Scaling first keeps lengths like 1e-200 or 1e200 from under- or overflowing when squared.
    let scale = v.abs().max_element();
    check(v.is_finite() && scale > 0.0, field, || {
        format!("must be a finite direction of non-zero length, is {v}")
    })?;
    Ok((v / scale).normalize())
}
