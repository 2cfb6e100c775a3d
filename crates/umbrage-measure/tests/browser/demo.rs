//! A report on a small scene of spheres on a plane, with crude shadow maps computed per pixel. It
//! looks real, and the position of everything is known.

use std::path::Path;
use umbrage_measure::{
    ErrorScale, Image, LightInfo, Measured, Page, Report, Rgb, Seen, SeenTruth, Times, Truth, View,
    measure, measure_error_px, write_pictures, write_report, write_truth_pictures,
};

type V = [f32; 3];

fn add(a: V, b: V, scale: f32) -> V {
    std::array::from_fn(|i| a[i] + b[i] * scale)
}

fn dot(a: V, b: V) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn unit(a: V) -> V {
    add([0.0; 3], a, 1.0 / dot(a, a).sqrt())
}

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

const EYE: V = [0.0, 2.4, 7.0];
const SUN_TRAVELS: V = [-0.62, -0.58, -0.52];

/// Centres and radii of rows of spheres that recede from the eye.
fn spheres() -> impl Iterator<Item = (V, f32)> {
    (0..36).map(|i| {
        let (column, row) = (i % 4, i / 4);
        let radius = 0.45 + 0.3 * ((i * 7) % 5) as f32 / 5.0;
        ([column as f32 * 3.0 - 4.5 + (row % 2) as f32, radius, 2.0 - row as f32 * 4.5], radius)
    })
}

/// Distance to the nearest surface along a unit ray, and its normal.
fn hit(origin: V, direction: V) -> Option<(f32, V)> {
    let sphere = |(center, radius): (V, f32)| {
        let to = add(origin, center, -1.0);
        let b = dot(to, direction);
        let root = (b * b - dot(to, to) + radius * radius).sqrt();
        let t = [-b - root, -b + root].into_iter().find(|&t| t > 1e-3)?;
        Some((t, unit(add(add(origin, direction, t), center, -1.0))))
    };
    let plane = -origin[1] / direction[1];
    let plane = (plane > 1e-3 && plane < 300.0).then_some((plane, [0.0, 1.0, 0.0]));
    spheres().filter_map(sphere).chain(plane).min_by(|a, b| a.0.total_cmp(&b.0))
}

struct Sample {
    point: V,
    normal: V,
    /// Distance along the view direction.
    depth: f32,
}

fn first_hits(size: [u32; 2]) -> Image<Option<Sample>> {
    let [w, h] = size.map(|n| n as f32);
    Image::from_fn(size, |x, y| {
        let slope = 0.55;
        let across = (x as f32 + 0.5 - w / 2.0) / h * 2.0 * slope;
        let up = (h / 2.0 - y as f32 - 0.5) / h * 2.0 * slope - 0.22;
        let direction = unit([across, up, -1.0]);
        let (t, normal) = hit(EYE, direction)?;
        Some(Sample { point: add(EYE, direction, t), normal, depth: -t * direction[2] })
    })
    .unwrap()
}

/// How a crude shadow map distributes its texels: their width at a view depth, metres.
struct Technique {
    name: &'static str,
    texel_m: fn(f32) -> f32,
}

const TECHNIQUES: [Technique; 5] = [
    Technique { name: "uniform@1024", texel_m: |_| 0.16 },
    Technique { name: "psm@1024", texel_m: |z| 0.004 * z * z / 6.0 },
    Technique { name: "lispsm@1024", texel_m: |z| 0.022 * (z / 6.0).powf(0.8) },
    Technique { name: "tsm@1024", texel_m: |z| 0.012 * (z / 6.0).powf(1.7) },
    Technique { name: "adaptive+z2:pcf3@1024", texel_m: |z| 0.014 * (z / 6.0) },
];

fn shade(sample: &Sample, visibility: f32) -> Rgb {
    let to_sun = unit(add([0.0; 3], SUN_TRAVELS, -1.0));
    let sun = dot(sample.normal, to_sun).max(0.0) * visibility;
    let base =
        if sample.normal == [0.0, 1.0, 0.0] { [0.72, 0.68, 0.60] } else { [0.78, 0.42, 0.30] };
    let sky = 0.30 + 0.12 * sample.normal[1];
    let tint = [sky * 0.85 + sun * 0.80, sky * 0.95 + sun * 0.74, sky * 1.2 + sun * 0.62];
    std::array::from_fn(|i| ((base[i] * tint[i]).min(1.0).powf(1.0 / 2.2) * 255.0) as u8)
}

fn picture(samples: &Image<Option<Sample>>, visibility: &Image<f32>) -> Image<Rgb> {
    Image::from_fn(samples.size(), |x, y| match samples.at(x, y) {
        Some(sample) => shade(sample, *visibility.at(x, y)),
        None => [168, 196, 226],
    })
    .unwrap()
}

/// Visibility and pixels per texel with a technique.
fn look_up(samples: &Image<Option<Sample>>, technique: &Technique) -> (Image<f32>, Image<f32>) {
    let to_sun = unit(add([0.0; 3], SUN_TRAVELS, -1.0));
    let s = unit(cross(to_sun, [0.0, 0.0, 1.0]));
    let t = cross(s, to_sun);
    let texel = |sample: &Sample| {
        // Widths are rounded to an eighth of an octave, so that neighbours share a grid.
        ((technique.texel_m)(sample.depth).log2() * 8.0).round().div_euclid(1.0) / 8.0
    };
    let lit = |sample: &Option<Sample>| {
        let Some(sample) = sample else { return 1.0 };
        if dot(sample.normal, to_sun) <= 0.0 {
            return 0.0;
        }
        let width = texel(sample).exp2();
        let to_center = |axis: V| {
            let c = dot(sample.point, axis) / width;
            (c.floor() + 0.5 - c) * width
        };
        let center = add(add(sample.point, s, to_center(s)), t, to_center(t));
        // Where the receiver's plane passes the texel's centre, moved slightly towards the light.
        let off = dot(add(center, sample.point, -1.0), sample.normal) / dot(sample.normal, to_sun);
        let on_plane = add(center, to_sun, width * 0.3 - off);
        f32::from(hit(on_plane, to_sun).is_none())
    };
    let error = |sample: &Option<Sample>| {
        sample.as_ref().map_or(f32::NAN, |sample| {
            let pixel = sample.depth * 2.0 * 0.55 / samples.size()[1] as f32;
            let view = unit(add(EYE, sample.point, -1.0));
            let facing = dot(sample.normal, view).abs() / dot(sample.normal, to_sun).max(0.0);
            texel(sample).exp2() / pixel * facing.max(0.25)
        })
    };
    (samples.map(lit), samples.map(error))
}

/// The scene with `n` results. The first five differ; the others repeat them under other names.
pub(crate) fn spheres_on_a_plane(size: [u32; 2], n: usize) -> Compared {
    let samples = first_hits(size);
    let to_sun = unit(add([0.0; 3], SUN_TRAVELS, -1.0));
    let counted = samples.map(|s| s.as_ref().is_some_and(|s| dot(s.normal, to_sun) > 0.0));
    let visibility = samples.map(|s| match s {
        Some(s) if dot(s.normal, to_sun) <= 0.0 => 0.0,
        Some(s) => f32::from(hit(add(s.point, s.normal, 1e-3), to_sun).is_none()),
        None => 1.0,
    });
    let techniques: Vec<Pictured> = TECHNIQUES
        .iter()
        .map(|technique| {
            let (visibility, error_px) = look_up(&samples, technique);
            let color = picture(&samples, &visibility);
            Pictured { name: technique.name.to_owned(), color, visibility, error_px }
        })
        .collect();
    let named = |i: usize| {
        let technique = techniques[i % techniques.len()].clone();
        let texels = (1024 >> (i / techniques.len())).to_string();
        Pictured { name: technique.name.replace("1024", &texels), ..technique }
    };
    Compared {
        scene: "Spheres on a plane".to_owned(),
        color: picture(&samples, &visibility),
        visibility,
        counted,
        results: (0..n).map(named).collect(),
    }
}

/// A truth in a single colour, and techniques in other colours. The truth is lit everywhere, the
/// techniques nowhere.
pub(crate) fn flat(size: [u32; 2], truth: Rgb, results: &[(&str, Rgb)]) -> Compared {
    let all = |color| Image::from_fn(size, |_, _| color).unwrap();
    let result = |&(name, color): &(&str, Rgb)| {
        let color = all(color);
        let (visibility, error_px) = (color.map(|_| 0.0), color.map(|_| 8.0));
        Pictured { name: name.to_owned(), color, visibility, error_px }
    };
    let color = all(truth);
    Compared {
        scene: "Flat".to_owned(),
        visibility: color.map(|_| 1.0),
        counted: color.map(|_| true),
        color,
        results: results.iter().map(result).collect(),
    }
}

/// All that a report is made from.
pub(crate) struct Compared {
    pub(crate) scene: String,
    pub(crate) color: Image<Rgb>,
    pub(crate) visibility: Image<f32>,
    pub(crate) counted: Image<bool>,
    pub(crate) results: Vec<Pictured>,
}

/// The pictures of one technique.
#[derive(Clone)]
pub(crate) struct Pictured {
    pub(crate) name: String,
    pub(crate) color: Image<Rgb>,
    pub(crate) visibility: Image<f32>,
    pub(crate) error_px: Image<f32>,
}

impl Compared {
    /// Writes the report into `folder` and returns its figures.
    pub(crate) fn write(&self, folder: &Path, notices: &[String]) -> Report {
        let Self { color, visibility, counted, .. } = self;
        let truth = SeenTruth { color, visibility, counted };
        let truth_pictures = write_truth_pictures(folder, &truth).unwrap();
        let scale = ErrorScale::default();
        let (mut results, mut pictures) = (Vec::new(), Vec::new());
        for (i, Pictured { name, color, visibility, error_px }) in self.results.iter().enumerate() {
            let (partition, texels) = (Some(color), Some(color));
            let seen = Seen { color, visibility, error_px, partition, texels };
            pictures.push(write_pictures(folder, i + 1, name, &seen, &truth, scale).unwrap());
            results.push(Measured {
                shadows: name.clone(),
                technique: None,
                backend: "reference".to_owned(),
                device: None,
                maps: 1 + u32::from(name.contains("z2")),
                texels: 1 << 20,
                pages: None,
                texels_per_pixel: None,
                bound_px: None,
                bytes: None,
                truth: None,
                metrics: measure(truth.visibility, visibility, counted, &color.map(|_| 1.0))
                    .unwrap(),
                error_px: measure_error_px(error_px, counted).unwrap(),
                perspective_px: measure_error_px(error_px, counted).unwrap(),
                // One figure is unknown and must be distinguished from zero.
                casters_culled: Some(0.1 * (i % 5) as f64),
                flicker: None,
                noise: None,
                storage_factor: [Some(865_159.0), Some(865.2), None, Some(31.8), Some(6.0)][i % 5],
                ms: Times {
                    plan: Some(0.004 + i as f64 / 1000.0),
                    depth: Some(812.5 - i as f64),
                    filter: None,
                    shade: Some(95.3),
                },
            });
        }
        let report = Report {
            scene: self.scene.clone(),
            size: color.size(),
            view: View {
                name: None,
                eye: EYE.map(f64::from),
                target: [0.0, 0.86, 0.0],
                up: [0.0, 1.0, 0.0],
                fov: Some(57.6),
                ortho: None,
                near: 0.1,
                far: 300.0,
            },
            light: LightInfo::Directional {
                name: None,
                direction: unit(SUN_TRAVELS).map(f64::from),
            },
            truth: Truth { rays_per_pixel: 16, seconds: Some(12.34), area: None },
            motion: None,
            results,
        };
        let page = Page {
            report: &report,
            truth: &truth_pictures,
            pictures: &pictures,
            scale,
            notices,
            command: Some("umbrage compare spheres --shadows uniform --shadows lispsm -o report"),
        };
        write_report(folder, &page).unwrap();
        report
    }
}
