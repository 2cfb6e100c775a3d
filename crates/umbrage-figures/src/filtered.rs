//! Figures 7 and 8 of the paper on convolution shadow maps (CSM; Annen et al. 2007): rendered
//! shadows of trees for several filters and resolutions.

use crate::figure::{Figure, File};
use crate::rendered::{Shot, sheet};
use anyhow::Result;
use glam::DVec3;
use umbrage::Light;
use umbrage_measure::{Image, Rgb};
use umbrage_scene::Lens;
use umbrage_trace::Tracer;

/// Renders two trees with each technique. Light from the side throws long, thin shadows on the
/// grass.
fn trees(techniques: &[(String, String)]) -> Result<Vec<(String, Image<Rgb>)>> {
    let scene = umbrage_scene::builtin("grove", Some(2))?;
    let tracer = Tracer::new(&scene)?;
    let light = Light::Directional { direction: DVec3::new(0.8, -0.55, 0.5) };
    let shot = Shot::new(&scene, &tracer, light, |view| {
        view.eye = DVec3::new(9.0, 5.0, 13.0);
        view.target = DVec3::new(4.9, 0.5, 0.6);
        view.lens = Lens::Perspective { fov_y_rad: 0.22 };
    })?;
    let picture = |(label, spec): &(String, String)| Ok((label.clone(), shot.picture(spec)?));
    techniques.iter().map(picture).collect()
}

/// Makes Fig. 7 of CSM.
pub(crate) fn fig7() -> Result<Figure> {
    let filters = [
        ("(a) bilinear comparisons", "pcf2"),
        ("(b) CSM, no blur", "csm16"),
        ("(c) CSM as wide as a pixel", "csm16(blur=1px)"),
        ("(d) CSM, 3 × 3", "csm16(blur=3)"),
        ("(e) CSM, 7 × 7", "csm16(blur=7)"),
        ("(f) CSM, 0.15 m wide", "csm16(blur=0.15m)"),
    ];
    let techniques = filters.map(|(label, f)| (label.to_owned(), format!("uniform:{f}@512")));
    let pictures = trees(&techniques)?;
    let svg = sheet("Thin shadows under different filters", 3, &pictures)?;
    Ok(Figure {
        name: "csm-fig7",
        title: "Thin shadows".into(),
        source: "Annen, Mertens, Bekaert, Seidel and Kautz 2007, Figure 7",
        text: "Two trees of the built-in scene `grove`, lit from the side, with one even map of 512² texels; convolution shadow maps with sixteen terms. (a) Bilinear \
               comparisons show the texels as stairs. (b) Without a blur the sums are interpolated between texels, not the comparisons. (c) As wide as a pixel of the \
               picture, from smaller copies and along the footprint where there are many texels to a pixel. (d), (e) A blur of three and seven texels rounds the stairs \
               off and widens thin shadows until they fade. (f) The same in metres, whatever the texels are."
            .into(),
        files: vec![File::svg("", "Shadows of two trees under six filters", svg)],
    })
}

/// Makes Fig. 8 of CSM.
pub(crate) fn fig8() -> Result<Figure> {
    let mut techniques = Vec::new();
    for blur in [1, 3, 7] {
        for side in [256, 512, 1024] {
            let spec = format!("uniform:csm16(blur={blur})@{side}");
            techniques.push((format!("{side}², blur of {blur}"), spec));
        }
    }
    let pictures = trees(&techniques)?;
    let svg = sheet("Resolutions and blurs", 3, &pictures)?;
    Ok(Figure {
        name: "csm-fig8",
        title: "Resolution against blur".into(),
        source: "Annen, Mertens, Bekaert, Seidel and Kautz 2007, Figure 8",
        text: "The same trees with maps of 256², 512² and 1024² texels, from left to right, and Gaussians of one texel (none), three and seven, from top to bottom. Even a \
               small map gives shadows without visible texels once the blur is wide enough, at the price of their detail: a crude kind of soft shadow, whose width \
               depends on the texels. Widths in metres do not (Figure 7, f)."
            .into(),
        files: vec![File::svg("", "Shadows of two trees for three resolutions and three blurs", svg)],
    })
}
