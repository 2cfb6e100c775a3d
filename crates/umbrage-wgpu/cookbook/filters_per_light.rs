use umbrage_wgpu::{Error, Shadows};

/// The text of a shader in which the sun and the lamps have filters of their own: each has its own
/// planner, technique and [`Shadows`], and its lookup's names have a prefix. A light's index is
/// that in its own plan. Bind `sun.lookup_bind_group()` as group 1 and `lamps.lookup_bind_group()`
/// as group 2.
pub fn two_filters(sun: &Shadows, lamps: &Shadows) -> Result<String, Error> {
    let lookups = sun.lookup_wgsl_named(1, "sun")? + &lamps.lookup_wgsl_named(2, "lamp")?;
    Ok(lookups + include_str!("filters_per_light.wgsl"))
}
