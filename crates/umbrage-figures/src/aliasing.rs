//! Fig. 3 of Zhang, Zhao and Sun 2009 ("Theory"): errors over a side view of the view frustum V,
//! and the shadows of a scene that these maps give.

use crate::figure::{Figure, File};
use crate::planned::{Planned, from_before};
use crate::rendered::embedded;
use crate::table::{Cell, Table};
use crate::{chart, contour, measured};
use anyhow::Result;
use glam::{DAffine3, DQuat, DVec3};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::f64::consts::FRAC_PI_6;
use std::fmt::Write;
use umbrage::theory::{Errors, Rule, Tilted, View, Warped};
use umbrage::{Bounds, Camera, Light, LookAt, Objective, Planner, Size, Technique, Warp};
use umbrage_measure::{Image, Rgb, grey};
use umbrage_scene::Scene;
use umbrage_trace::{Reference, Tracer, shade};

const TECHNIQUES: [(&str, Rule); 4] = [
    ("SSM, no warp", Rule::Uniform),
    ("LiSPSM", Rule::Lispsm),
    ("TSM", Rule::Tsm { focus: None }),
    ("adaptive", Rule::Adaptive(Objective::Storage)),
];
/// Selects one of the two errors, or their product.
type Pick = fn(Errors) -> f64;

const ERRORS: [(&str, Pick); 3] =
    [("E_p, along the map", |e| e.p), ("E_q, across", |e| e.q), ("E_p · E_q", |e| e.product())];

/// Colour of texels in which no surface lies in front of the far end of the map's depth range.
const EMPTY: Rgb = [205, 222, 240];
/// Width and height of the map in texels and of the picture in pixels. They are small, so that
/// errors show as jagged edges.
const SIDE: u32 = 256;
/// Both ends of the colour scale, as exponents of 5.
const POWERS: [f64; 2] = [0.0, 5.0];

/// Pixels of the page per metre in side views.
const PER_METRE: f64 = 1.7;
/// Image pixels of a side view per pixel of the page, along each axis.
const FINENESS: f64 = 2.0;
/// Gap between panels, then the sizes of the left margin, the top margin, the colour bar's column
/// and the bottom margin, pixels.
const GAP: i32 = 14;
const LEFT: i32 = 118;
const TOP: i32 = 26;
const BAR: i32 = 86;
const FOOT: i32 = 34;

/// The closed form and the planned map of one technique under one light.
struct Case {
    warped: Warped,
    planned: Planned,
}

impl Case {
    fn new(view: View, theta_rad: f64, rule: Rule) -> Result<Self> {
        let tilted = Tilted::new(view, theta_rad)?;
        let warped = tilted.warped(tilted.lambda(rule)?)?;
        let planned = Planned::new(view, theta_rad, Warp::Lambda(warped.lambda()))?;
        Ok(Self { warped, planned })
    }
}

/// Makes Fig. 3 of Theory.
pub(crate) fn theory_fig3() -> Result<Figure> {
    let view = View::new(1.0, 100.0, FRAC_PI_6)?;
    let scene = scene()?;
    let tracer = Tracer::new(&scene)?;
    let mut table = Table::new(&[
        "theta_deg",
        "technique",
        "lambda_m",
        "lambda_m_measured",
        "y_m",
        "z_m",
        "e_q",
        "e_q_measured",
        "e_p",
        "e_p_measured",
    ])?;
    let mut files = Vec::new();
    for (degrees, part) in [(90.0_f64, "90"), (60.0, "60"), (30.0, "30")] {
        let theta_rad = degrees.to_radians();
        let mut cases = Vec::new();
        for (name, rule) in TECHNIQUES {
            let case = Case::new(view, theta_rad, rule)?;
            for (y, z) in samples(view) {
                let closed = case.warped.errors(y, z)?;
                let measured = case.planned.errors(y, z);
                table.row(&[
                    Cell::from(degrees),
                    name.into(),
                    case.warped.lambda().into(),
                    case.planned.lambda().into(),
                    y.into(),
                    z.into(),
                    closed.q.into(),
                    measured.q.into(),
                    closed.p.into(),
                    measured.p.into(),
                ])?;
            }
            cases.push(case);
        }
        let about = format!(
            "θ = {part}°: for each technique side views of three errors, the shadow map and the picture"
        );
        files.push(File::svg(part, about, sheet(view, degrees, &cases, &tracer)?));
    }
    files.push(File::csv(
        "",
        "errors at points all over the side view, for each angle and technique",
        table,
    )?);
    Ok(Figure {
        name: "theory-fig3",
        title: "Where in the view the errors are".into(),
        source: "Zhang, Zhao and Sun 2009, Figure 3, with the adaptive warp added",
        text: "Each field is the view frustum from its side, the viewer at its left tip, with parallel light that comes along the \
               arrow. Colours are errors measured from the matrices of planned maps, the lines the closed \
               form's at every power of 5: dark is fine, yellow is coarse. Beside them is the map itself (near is at its bottom, dark is close \
               to the light, pale blue where nothing lies before V's far sides), which is spent on 25 statues and their ground, and a detail of the shadows that it gives at 256 × 256 texels. Without a \
               warp (SSM) both errors are worst at the tip and fall with distance. Warps even them out along the \
               view; TSM is the strongest here, so it draws the foreground best and the distance worst. As the light tilts, \
               the errors come to depend on height: small at V's upper side, large at its lower one, which is where \
               ground is. At θ = 30°, as much as φ, the view's upper side lies along the light; LiSPSM \
               warps less there, TSM more, and pays in V's lower half (as a technique to plan with it stops at λ = n/sin θ, 2 m). All maxima of E_p · E_q are at the lower near or far corner; adaptive makes those of E_p \
               equal there. It guards the worst point, wherever anybody looks, and so may do worse than no warp where the \
               detail is."
            .into(),
        files,
    })
}

/// Sample points (y, z) spread over V, metres.
fn samples(view: View) -> impl Iterator<Item = (f64, f64)> {
    (0..=8).flat_map(move |i| {
        let z = view.near() * (view.far() / view.near()).powf(f64::from(i) / 8.0);
        (-2..=2).map(move |j| (0.5 * f64::from(j) * z * view.tan_phi(), z))
    })
}

/// A scene of 25 statues, mostly below the line of sight, from the near part of V to its middle.
fn scene() -> Result<Scene> {
    let mut scene = umbrage_scene::builtin("statues", Some(5))?;
    let stand = DAffine3::from_scale_rotation_translation(
        DVec3::splat(2.5),
        DQuat::from_rotation_y(0.25),
        DVec3::new(0.0, -5.0, -23.0),
    );
    for instance in &mut scene.instances {
        instance.world_from_mesh = stand * instance.world_from_mesh;
    }
    Ok(scene)
}

/// Positions of the panels on the page, pixels.
struct Layout {
    /// Width and height of a side view.
    side_view: [i32; 2],
}

impl Layout {
    fn new(view: View) -> Self {
        let length = (view.far() - view.near()) * PER_METRE;
        let height = 2.0 * view.far() * view.tan_phi() * PER_METRE;
        Self { side_view: [length, height].map(|v| v.round() as i32) }
    }

    fn row(&self, i: usize) -> i32 {
        TOP + i as i32 * (self.side_view[1] + GAP)
    }

    /// The left edge of a column: three side views, the map and the picture. All panels have the
    /// same height, and the map and the picture are square.
    fn column(&self, i: usize) -> i32 {
        let [width, height] = self.side_view;
        let i = i as i32;
        let views = i.min(3);
        LEFT + views * (width + GAP) + (i - views) * (height + GAP)
    }

    fn size(&self, rows: usize) -> (u32, u32) {
        ((self.column(5) + BAR) as u32, (self.row(rows) + FOOT) as u32 + chart::TITLE_HEIGHT)
    }
}

/// Draws the panels of all techniques under one light as SVG.
fn sheet(view: View, degrees: f64, cases: &[Case], tracer: &Tracer<'_>) -> Result<String> {
    let layout = Layout::new(view);
    let [width, height] = layout.side_view;
    let title = format!("Errors and shadows at θ = {degrees}°, n = 1 m, f = 100 m, φ = 30°");
    let mut svg = chart::draw(layout.size(cases.len()), &title, |area| {
        let say = |words: &str, at: (i32, i32), size, horizontal, vertical| {
            let style = chart::text(size).pos(Pos::new(horizontal, vertical));
            area.draw(&Text::new(words.to_owned(), at, style))
        };
        let headings = ERRORS.iter().map(|e| e.0).chain(["shadow map", "shadows, detail"]);
        for (i, heading) in headings.enumerate() {
            let middle = layout.column(i) + if i < 3 { width } else { height } / 2;
            say(heading, (middle, TOP - 6), 14, HPos::Center, VPos::Bottom)?;
        }
        for (i, ((name, _), case)) in TECHNIQUES.iter().zip(cases).enumerate() {
            let middle = layout.row(i) + height / 2;
            say(name, (12, middle - 9), 14, HPos::Left, VPos::Center)?;
            let lambda = case.warped.lambda();
            let lambda =
                if lambda.is_finite() { format!("λ = {lambda:.2} m") } else { "λ = ∞".into() };
            say(&lambda, (12, middle + 9), 13, HPos::Left, VPos::Center)?;
        }
        let foot = layout.row(cases.len()) - 4;
        for column in 0..3 {
            let left = layout.column(column);
            say("z = 1 m", (left, foot), 12, HPos::Left, VPos::Top)?;
            say("100 m", (left + width, foot), 12, HPos::Right, VPos::Top)?;
        }
        let legend = "colours: measured; white lines: closed form at powers of 5";
        say(legend, (layout.column(3), foot), 12, HPos::Left, VPos::Top)?;
        bar(area, layout.column(5) + 10, layout.row(0), layout.row(cases.len()) - GAP)
    })?;
    let mut over = String::new();
    for (i, case) in cases.iter().enumerate() {
        let top = layout.row(i) + chart::TITLE_HEIGHT as i32;
        for (column, (_, error)) in ERRORS.iter().enumerate() {
            let at = [layout.column(column), top];
            write!(over, "{}", embedded(at, layout.side_view, &side_view(view, case, *error)?)?)?;
            write!(over, "{}", lines(view, case, *error, at)?)?;
            write!(over, "{}", arrow(degrees.to_radians(), at)?)?;
        }
        for (column, picture) in (3..).zip(executed(view, degrees.to_radians(), case, tracer)?) {
            write!(over, "{}", embedded([layout.column(column), top], [height; 2], &picture)?)?;
        }
    }
    svg.insert_str(svg.rfind("</svg>").unwrap_or(svg.len()), &over);
    Ok(svg)
}

/// Draws the colour bar from `top` to `bottom`.
fn bar(area: &chart::Area<'_>, left: i32, top: i32, bottom: i32) -> Result<()> {
    let height = bottom - top;
    for y in 0..height {
        let share = 1.0 - f64::from(y) / f64::from(height);
        // Each rectangle reaches to the bottom. Rectangles that only touch would show seams.
        let corners = [(left, top + y), (left + 16, bottom)];
        area.draw(&Rectangle::new(corners, chart::viridis(share).filled()))?;
    }
    for power in POWERS[0] as i32..=POWERS[1] as i32 {
        let y = bottom - (f64::from(height) * place(5_f64.powi(power))).round() as i32;
        area.draw(&PathElement::new([(left + 16, y), (left + 20, y)], BLACK))?;
        let style = chart::text(12).pos(Pos::new(HPos::Left, VPos::Center));
        let beyond = match f64::from(power) {
            p if p == POWERS[0] => "≤ ",
            p if p == POWERS[1] => "≥ ",
            _ => "",
        };
        let mark = format!("{beyond}{}", 5_f64.powi(power));
        area.draw(&Text::new(mark, (left + 24, y), style))?;
    }
    Ok(())
}

/// The position of an error on the colour scale, as a fraction of its length.
fn place(error: f64) -> f64 {
    (error.ln() / 5_f64.ln() - POWERS[0]) / (POWERS[1] - POWERS[0])
}

/// A picture of the measured error over a side view of V.
fn side_view(view: View, case: &Case, error: Pick) -> Result<Image<Rgb>> {
    let per_metre = PER_METRE * FINENESS;
    let [width, height] = Layout::new(view).side_view.map(|n| (f64::from(n) * FINENESS) as u32);
    Ok(Image::from_fn([width, height], |column, row| {
        let z = view.near() + (f64::from(column) + 0.5) / per_metre;
        let y = (f64::from(height) / 2.0 - f64::from(row) - 0.5) / per_metre;
        if y.abs() > z * view.tan_phi() || z > view.far() {
            return [255; 3];
        }
        let RGBColor(r, g, b) = chart::viridis(place(error(case.planned.errors(y, z))));
        [r, g, b]
    })?)
}

/// Contour lines of the closed form at powers of 5, as an SVG path.
fn lines(view: View, case: &Case, error: Pick, [left, top]: [i32; 2]) -> Result<String> {
    const COLUMNS: usize = 100;
    const ROWS: usize = 60;
    let middle = f64::from(Layout::new(view).side_view[1]) / 2.0;
    // The rows of the grid spread apart with z, as V does.
    let at = |[column, row]: [f64; 2]| {
        let z = view.near() + (view.far() - view.near()) * column / (COLUMNS - 1) as f64;
        (z * view.tan_phi() * (2.0 * row / (ROWS - 1) as f64 - 1.0), z)
    };
    let values = (0..ROWS * COLUMNS).map(|i| {
        let (y, z) = at([(i % COLUMNS) as f64, (i / COLUMNS) as f64]);
        Ok(error(case.warped.errors(y, z)?).ln() / 5_f64.ln())
    });
    let values = values.collect::<Result<Vec<f64>>>()?;
    let mut path = String::new();
    for power in POWERS[0] as i32..=POWERS[1] as i32 {
        for segment in contour::segments(&values, COLUMNS, f64::from(power)) {
            let [(ax, ay), (bx, by)] = segment.map(|place| {
                let (y, z) = at(place);
                let x = f64::from(left) + (z - view.near()) * PER_METRE;
                (x, f64::from(top) + middle - y * PER_METRE)
            });
            write!(path, "M{ax:.1} {ay:.1}L{bx:.1} {by:.1}")?;
        }
    }
    Ok(format!("<path d=\"{path}\" stroke=\"white\" stroke-width=\"0.8\" fill=\"none\"/>\n"))
}

/// An arrow along the light direction, in the upper left corner of a side view.
fn arrow(theta_rad: f64, [left, top]: [i32; 2]) -> Result<String> {
    let (sin, cos) = theta_rad.sin_cos();
    let [from_x, from_y] = [f64::from(left) + 34.0, f64::from(top) + 8.0];
    // In a side view z runs to the right and y upwards.
    let along = |length: f64, aside: f64| {
        (from_x - cos * length + sin * aside, from_y + sin * length + cos * aside)
    };
    let mut path = String::new();
    for (command, length, aside) in
        [("M", 0.0, 0.0), ("L", 32.0, 0.0), ("M", 25.0, -4.0), ("L", 32.0, 0.0), ("L", 25.0, 4.0)]
    {
        let (x, y) = along(length, aside);
        write!(path, "{command}{x:.1} {y:.1}")?;
    }
    Ok(format!("<path d=\"{path}\" stroke=\"black\" stroke-width=\"1.4\" fill=\"none\"/>\n"))
}

/// A camera with a narrower field of view that shows a detail of the shadows.
fn detail() -> Result<Camera> {
    Ok(Camera::look_at(LookAt {
        eye: DVec3::ZERO,
        target: DVec3::new(0.4, -3.4, -16.0),
        up: DVec3::Y,
        fov_y_rad: 0.5,
        near: 1.0,
        far: 100.0,
        image: [SIDE; 2],
    })?)
}

/// Renders the scene's shadow map, and a picture of its shadows.
fn executed(
    view: View,
    theta_rad: f64,
    case: &Case,
    tracer: &Tracer<'_>,
) -> Result<[Image<Rgb>; 2]> {
    let camera = measured::camera_of(view, SIDE)?;
    let light = Light::Directional { direction: from_before(theta_rad) };
    let technique = Technique {
        warp: Warp::Lambda(case.planned.lambda()),
        size: Size::Exact([SIDE; 2]),
        ..Technique::default()
    };
    let mut planner = Planner::new();
    let plan = planner.plan(&camera, &[light], &Bounds::default(), &technique)?;
    let reference = Reference::render(tracer, plan, &|_| {})?;

    let map = &reference.depth_maps()[0];
    // Surfaces nearer to the light than V have depth 0, and empty texels have depth 1.
    let texel = |column: u32, row: u32| map.texel(column as i32, (SIDE - 1 - row) as i32);
    let image = Image::from_fn([SIDE; 2], texel)?;
    let depths = || image.pixels().iter().copied().filter(|&d| d < 1.0);
    let (least, most) = (depths().fold(1.0, f32::min), depths().fold(0.0, f32::max));
    let range = (most - least).max(f32::MIN_POSITIVE);
    let map = image.map(|&d| if d < 1.0 { [grey((d - least) / range); 3] } else { EMPTY });

    let seen = umbrage_trace::View::new(tracer, detail()?, light, 1)?;
    let mut pixels = Vec::new();
    for rows in seen.bands() {
        let band = seen.band(rows, &|_| {});
        let visibility = band.map(|s| reference.visibility(0, s), &|_| {});
        pixels.extend(shade::picture(&seen, &band, &visibility));
    }
    Ok([map, Image::new([SIDE; 2], pixels)?])
}
