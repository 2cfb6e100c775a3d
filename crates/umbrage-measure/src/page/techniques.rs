//! Techniques in a sentence each, for newcomers.

/// What the warp of a shadow specification is; `None` for one not listed here.
pub(super) fn description(shadows: &str) -> Option<&'static str> {
    let name = shadows.split(['+', ':', '@', '=']).next().unwrap_or_default();
    Some(match name {
        "unfocused" => "One evenly spaced map over everything, whatever the camera sees.",
        "uniform" => "An evenly spaced map, focused on what the camera sees.",
        "psm" => {
            "Perspective shadow map: drawn in the viewer's own perspective (Stamminger & Drettakis 2002)."
        }
        "lispsm" => {
            "Light space perspective shadow map: a perspective warp along the view, its strength from near \
             and far distance (Wimmer et al. 2004)."
        }
        "tsm" => {
            "Trapezoidal shadow map: the view as the light sees it, warped so that its nearer part fills most \
             of the map (Martin & Tan 2004)."
        }
        "adaptive" => {
            "A perspective warp of the strength that needs the fewest texels for this view and light; no warp \
             where none helps."
        }
        "adaptive(area)" => {
            "A perspective warp of the strength that makes the largest texel on screen smallest; no warp where \
             none helps."
        }
        "log" => {
            "Logarithmic rows of texels, the ideal for a view along the map. No GPU draws this; a yardstick \
             (Wimmer et al. 2004)."
        }
        "lambda" => "A perspective warp with the given distance λ to its centre of projection.",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::description;

    #[test]
    fn finds_the_warp_in_a_specification() {
        assert!(description("lispsm+z4:pcf5@2048").unwrap().starts_with("Light space"));
        assert!(description("lambda=0.5@64").unwrap().contains("given distance"));
        assert_ne!(description("adaptive(area)+face@1024"), description("adaptive@1024"));
        assert_eq!(description(""), None);
        assert_eq!(description("lispsmx"), None);
    }
}
