//! Renders pictures of shadows and places them side by side in one drawing.

use crate::chart;
use anyhow::Result;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;
use umbrage::{Bounds, Camera, Light};
use umbrage_lab::{NamedTechnique, Rows, Shadowed};
use umbrage_measure::{Image, PngPixel, Rgb, png};
use umbrage_scene::{Scene, SceneCamera};
use umbrage_trace::{Reference, Tracer, View};

/// Width and height of one picture, pixels.
const TILE: [u32; 2] = [270, 180];
const GAP: u32 = 8;
const LABEL: u32 = 22;

/// A scene's bounds and tracer, with a camera and a light.
pub(crate) struct Shot<'a> {
    tracer: &'a Tracer<'a>,
    bounds: Bounds<'a>,
    camera: Camera,
    light: Light,
}

impl<'a> Shot<'a> {
    /// Takes the scene's default view and lets `change` modify it.
    pub(crate) fn new(
        scene: &Scene,
        tracer: &'a Tracer<'a>,
        light: Light,
        change: impl FnOnce(&mut SceneCamera),
    ) -> Result<Self> {
        let mut view = scene.default_view();
        change(&mut view);
        let camera = view.camera(TILE)?;
        Ok(Self { tracer, bounds: Bounds::of_scene(scene.bounds()), camera, light })
    }

    /// Renders the picture with a technique that is written as on the command line.
    pub(crate) fn picture(&self, technique: &str) -> Result<Image<Rgb>> {
        let technique: NamedTechnique = technique.parse()?;
        let plan = umbrage_lab::plan(&technique, &self.camera, &self.light, &self.bounds)?;
        let reference = Reference::render(self.tracer, &plan, &|_| {})?;
        // One sample at the centre of each pixel, as renderers shade.
        let view = View::new(self.tracer, self.camera, self.light, 1)?;
        let mut picture = Shadowed::default();
        for rows in view.bands() {
            picture.push(&Rows::new(&view, rows, &|_| {}).by_reference(&plan, &reference));
        }
        Ok(Image::new(TILE, picture.color)?)
    }
}

/// Arranges pictures in rows of `columns`, each with its label below, in one SVG drawing.
pub(crate) fn sheet(
    title: &str,
    columns: usize,
    pictures: &[(String, Image<Rgb>)],
) -> Result<String> {
    let rows = pictures.len().div_ceil(columns) as u32;
    let [width, height] = [
        columns as u32 * (TILE[0] + GAP) + GAP,
        chart::TITLE_HEIGHT + rows * (TILE[1] + LABEL + GAP),
    ];
    let mut svg = format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" font-family=\"sans-serif\" \
         font-size=\"14\" text-anchor=\"middle\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n<text x=\"{}\" y=\"22\" \
         font-size=\"16\">{title}</text>\n",
        width / 2
    );
    for (i, (label, picture)) in pictures.iter().enumerate() {
        let x = GAP + (i % columns) as u32 * (TILE[0] + GAP);
        let y = chart::TITLE_HEIGHT + (i / columns) as u32 * (TILE[1] + LABEL + GAP);
        let [x, y, w, h] = [x, y, TILE[0], TILE[1]].map(|n| n as i32);
        svg += &embedded([x, y], [w, h], picture)?;
        writeln!(svg, "<text x=\"{}\" y=\"{}\">{label}</text>", x + w / 2, y + h + 16)?;
    }
    svg += "</svg>\n";
    Ok(svg)
}

/// An SVG element that holds a picture as PNG, with its upper left corner at (x, y) and size w × h.
pub(crate) fn embedded<P: PngPixel>(
    [x, y]: [i32; 2],
    [w, h]: [i32; 2],
    image: &Image<P>,
) -> Result<String> {
    let data = STANDARD.encode(png(image)?);
    Ok(format!(
        "<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" href=\"data:image/png;base64,{data}\"/>\n"
    ))
}
