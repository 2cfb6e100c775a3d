//! Light leaks: light that reaches points in whose surroundings everything is in shadow.

mod common;

use common::nobody;
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, Prefilter};
use umbrage::{Bounds, Camera, LookAt, Options, Planner, Size, Warp};
use umbrage_trace::{Reference, Tracer, View};

#[test]
fn measure() {
    for name in ["fence", "lattice/fence_rows.glb", "lattice/lattice_ball.glb"] {
        let scene = if name == "fence" { umbrage_scene::builtin("fence", None).unwrap() } else {
            umbrage_scene::load(std::path::Path::new("../../../shared/scenes").join(name).as_ref()).unwrap() };
        let tracer = Tracer::new(&scene).unwrap();
        let v = scene.default_view();
        let camera = Camera::look_at(LookAt { eye: v.eye, target: v.target, up: v.up, fov_y_rad: v.fov_y_rad, near: v.near, far: v.far, image: [480, 270] }).unwrap();
        let light = scene.default_light().light;
        let boxes = tracer.boxes(256);
        let bounds = Bounds { receiver_parts: &boxes, ..Bounds::of_scene(scene.bounds()) };
        let options = Options { warp: Warp::Uniform, size: Size::Budget(1024 * 1024), ..Options::default() };
        let plan = Planner::new().plan(&camera, &[light], &bounds, &options).unwrap().clone();
        let mut plan = plan;
        let view = View::new(&tracer, camera, light, 1).unwrap();
        let band = view.band(0..270, &nobody);
        {
            let pts: Vec<glam::DVec3> = band.samples().iter().flatten().filter(|s| s.depth < v.far).filter_map(|s| plan.maps[0].project(s.surface.position)).collect();
            let range = |a: f64, b: f64| { let it = pts.iter().map(|p| p.z - a * p.x - b * p.y); let lo = it.clone().fold(1e9, f64::min); let hi = it.fold(-1e9, f64::max); (lo, hi) };
            let (mut ba, mut bb) = (0.0, 0.0); let mut step = 1.0;
            let cost = |a, b| { let (l, h) = range(a, b); h - l };
            let mut best = cost(0.0, 0.0); let first = best;
            while step > 1e-3 { let mut moved = false; for (da, db) in [(1., 0.), (-1., 0.), (0., 1.), (0., -1.), (1., 1.), (1., -1.), (-1., 1.), (-1., -1.)] { let c = cost(ba + da * step, bb + db * step); if c < best { best = c; ba += da * step; bb += db * step; moved = true; } } if !moved { step *= 0.5; } }
            println!("{name} slab {:?}: range {first} -> {best} by {ba} {bb}", plan.maps[0].slab);
            let (lo, hi) = range(ba, bb); let (lo, hi) = (lo - 0.01 * (hi - lo), hi + 0.01 * (hi - lo));
            if false {
            let map = &mut plan.maps[0];
            let m = map.shadow_from_local.transpose();
            let z = (m.z_axis - m.x_axis * ba - m.y_axis * bb - m.w_axis * lo) / (hi - lo);
            map.shadow_from_local = glam::DMat4::from_cols(m.x_axis, m.y_axis, z, m.w_axis).transpose();
            map.local_from_shadow = map.shadow_from_local.inverse();
            }
        }
        let wide = Reference::render(&tracer, &plan, Filter::Pcf { n: 15 }, &nobody).unwrap();
        let deep: Vec<bool> = band.map(|s| s.is_facing && view.truth(s) == 0.0 && wide.visibility(0, s) == 0.0, &nobody);
        let hard = Reference::render(&tracer, &plan, Filter::Pcf { n: 15 }, &nobody).unwrap();
        let map = &plan.maps[0];
        let depths = &hard.depth_maps()[0];
        let kernel = Prefilter { statistic: Statistic::Vsm(Vsm::default()), blur: Blur::Texels(7) };
        let w: Vec<f64> = kernel.weights().map(f64::from).collect();
        let exact_with = |dev: f64| -> Vec<f32> { band.map(|s| {
            let Some(r) = map.receiver(s.surface.position, s.surface.geometric_normal) else { return 1.0 };
            let texel = umbrage::visibility::texel_coordinates(map, r.st);
            let c = texel - 0.5; let f0 = c.floor(); let f = c - f0;
            let [wd, ht] = map.resolution.map(f64::from);
            let sl = r.slope / glam::DVec2::new(wd, ht); let sl = sl.clamp(glam::DVec2::splat(-8.0), glam::DVec2::splat(8.0));
            let d = r.depth.min(1.0) - r.half_texel - dev * (kernel.variance_texels() * sl.length_squared()).sqrt();
            let mut sum = 0.0;
            for y in -3..=4i32 { for x in -3..=4i32 {
                let a = |k: i32, f: f64| { let g = |k: i32| w.get(k.unsigned_abs() as usize).copied().unwrap_or(0.0); (1.0 - f) * g(k) + f * g(k - 1) };
                let (i, j) = (f0.x as i32 + x, f0.y as i32 + y);
                let center = glam::DVec2::new((f64::from(i) + 0.5) / wd, (f64::from(j) + 0.5) / ht);
                let rise = r.slope.dot(center - r.st);
                let limit = r.depth.min(r.depth + rise).min(1.0) - r.half_texel; let _ = d;
                if f64::from(depths.texel(i, j)) >= limit.max(1e-7) { sum += a(x, f.x) * a(y, f.y); }
            } }
            sum as f32
        }, &nobody) };
        let exacts = [exact_with(0.0), exact_with(1.0), exact_with(2.0)];
        let truth: Vec<bool> = band.map(|s| s.is_facing && view.truth(s) == 0.0, &nobody);
        let csm = |m, a, o| Statistic::Csm(Csm::new(m, a, o, !o).unwrap());
        for (label, statistic) in [
            ("vsm", Statistic::Vsm(Vsm::default())),
            ("esm", Statistic::Esm(Esm::default())),
            ("evsm", Statistic::Evsm(Evsm::default())),
            ("msm", Statistic::Msm(Msm::default())),
            ("csm4", csm(4, 0.0, false)),
            ("csm8", csm(8, 0.0, false)),
            ("csm16", csm(16, 0.0, false)),
            ("csm8 a1", csm(8, 1.0, false)),
            ("csm16 a1", csm(16, 1.0, false)),
            ("csm8 o", csm(8, 0.0, true)),
            ("csm16 o", csm(16, 0.0, true)),
            ("csm8 o a1", csm(8, 1.0, true)),
            ("csm16 o a1", csm(16, 1.0, true)),
        ] {
            let filter = Filter::Prefiltered(Prefilter { statistic, blur: Blur::Texels(7) });
            let r = Reference::render(&tracer, &plan, filter, &nobody).unwrap();
            let vis = band.map(|s| r.visibility(0, s), &nobody);
            let stat = |m: &[bool]| {
                let v: Vec<f32> = vis.iter().zip(m).filter(|(_, d)| **d).map(|(v, _)| *v).collect();
                let n = v.len() as f32;
                (v.len(), v.iter().sum::<f32>() / n, v.iter().filter(|&&v| v > 0.1).count() as f32 / n, v.iter().filter(|&&v| v > 0.25).count() as f32 / n, v.iter().copied().fold(0.0, f32::max))
            };
            let dev = statistic.plane_deviations();
            let exact = &exacts[dev.round() as usize];
            let excess = |l: f32, t: f32| {
                let v: Vec<f32> = vis.iter().zip(exact).zip(&truth).filter(|(_, d)| **d).map(|((v, e), _)| (((v - l) / (1.0 - l)).max(0.0) - e).max(0.0)).collect();
                let n = v.len() as f32;
                (v.iter().sum::<f32>() / n, v.iter().filter(|&&v| v > t).count() as f32 / n)
            };
            let dark = |l: f32| {
                let v: Vec<f32> = vis.iter().zip(exact).zip(&truth).filter(|((_, e), d)| **d && **e <= 0.0).map(|((v, _), _)| ((v - l) / (1.0 - l)).max(0.0)).collect();
                let n = v.len() as f32;
                (v.len(), v.iter().sum::<f32>() / n, v.iter().filter(|&&v| v > 0.1).count() as f32 / n)
            };
            println!("{name} {label} dev {dev}: excess l0 {:.4?} l.05 {:.4?} l.1 {:.4?} dark {:.4?} {:.4?} {:.4?}", excess(0.0, 0.1), excess(0.05, 0.1), excess(0.1, 0.1), dark(0.0), dark(0.05), dark(0.1));
            if false { println!("{name} {label}: deep {:.4?}  all {:.4?}", stat(&deep), stat(&truth)); }
        }
    }
}
