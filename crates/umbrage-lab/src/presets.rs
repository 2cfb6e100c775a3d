//! Techniques to begin with.

/// A technique for a purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// One word for it.
    pub name: &'static str,
    /// The technique.
    pub shadows: &'static str,
    /// What it is for, in one sentence.
    pub meaning: &'static str,
}

/// Techniques to begin with, each for another purpose.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "sharp",
        shadows: "adaptive+z4@2048",
        meaning: "The finest edges that four million texels give: four slices, each warped to what is \
                  seen.",
    },
    Preset {
        name: "soft",
        shadows: "adaptive+z4:pcss@2048",
        meaning: "Penumbrae of the sun, which widen with the distance of what casts them.",
    },
    Preset {
        name: "stable",
        shadows: "uniform(stable)+z4(practical=0.65,overlap=0.1):pcf3@2048",
        meaning: "Shadows that do not shimmer when the camera moves, at the price of coarser texels.",
    },
    Preset {
        name: "cheap",
        shadows: "adaptive@1024",
        meaning: "One map of a million texels and one comparison a pixel, where every millisecond counts.",
    },
    Preset {
        name: "bevy",
        shadows: "uniform(stable)+z4(at=10/24.7/60.8,overlap=0.2):pcf4@1024x1024",
        meaning: "Cascades as Bevy divides the view by default, to see what the others change.",
    },
    Preset {
        name: "papers",
        shadows: "lispsm@1024",
        meaning: "One perspective map by the rule of Wimmer et al. (2004), the papers' usual opponent.",
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::technique::NamedTechnique;

    #[test]
    fn presets_are_techniques_of_different_names() {
        for (i, preset) in PRESETS.iter().enumerate() {
            let technique: NamedTechnique = preset.shadows.parse().unwrap();
            technique.technique().check().unwrap();
            let others = &PRESETS[..i];
            assert!(others.iter().all(|p| p.name != preset.name && p.shadows != preset.shadows));
            assert!(preset.meaning.ends_with('.'), "{}", preset.name);
        }
    }
}
