//! Built-in scenes against the ray-traced truth of `umbrage-trace`. Where the environment variable
//! `UMBRAGE_PICTURES` names a folder, the pictures are written there, to be looked at: the one that
//! Bevy draws, and below it the wrong pixels, orange for false light and blue for false shadow.

use crate::harness::{Harness, Measured, Setup, Umbrage, ViewPoint, counts, visibility};
use bevy::light::ShadowFilteringMethod;
use bevy::prelude::*;
use bevy_umbrage::UmbrageShadows;
use bevy_umbrage::umbrage::glam::DVec3;
use bevy_umbrage::umbrage::{Camera, Light, LookAt};
use image::{Rgb, RgbImage};
use std::path::Path;
use umbrage_testing::needs;
use umbrage_trace::{Sample, Tracer, View};

struct Case {
    scene: &'static str,
    eye: [f32; 3],
    target: [f32; 3],
    sun: [f32; 3],
    far: f32,
}

const CASES: [Case; 2] = [
    Case {
        scene: "town",
        eye: [-3.1, 2.3, 9.0],
        target: [0.9, 2.7, -14.0],
        sun: [-0.42, -0.66, 0.5],
        far: 150.0,
    },
    Case {
        scene: "fence",
        eye: [-3.0, 1.75, 4.6],
        target: [0.7, 0.75, -1.5],
        sun: [-0.42, -0.62, 0.75],
        far: 60.0,
    },
];

const SIZE: [u32; 2] = [480, 270];
const FOV_Y_RAD: f32 = 0.9;
const NEAR: f32 = 0.1;

impl Case {
    /// Whether the sun reaches each pixel; `None` where the surface seen does not face it.
    fn truth(&self, scene: &umbrage_scene::Scene) -> Vec<Option<f32>> {
        let point = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        let camera = Camera::look_at(LookAt {
            eye: point(self.eye),
            target: point(self.target),
            up: DVec3::Y,
            fov_y_rad: f64::from(FOV_Y_RAD),
            near: f64::from(NEAR),
            far: f64::from(self.far),
            image: SIZE,
        });
        let light = Light::Directional { direction: point(self.sun) };
        let tracer = Tracer::new(scene).expect("a scene").opaque(true);
        let view = View::new(&tracer, camera.expect("a camera"), light, 1).expect("a view");
        let truth = |sample: &Sample| {
            view.counts(sample.is_facing, sample.depth).then(|| view.truth(sample))
        };
        let mut pixels = Vec::new();
        for rows in view.bands() {
            pixels.extend(view.band(rows, &|_| {}).map(truth, &|_| {}));
        }
        pixels
    }

    /// The share of wrong pixels and the mean error.
    fn errors(
        &self,
        scene: &umbrage_scene::Scene,
        truth: &[Option<f32>],
        (name, umbrage): (&str, Umbrage),
        filter: ShadowFilteringMethod,
    ) -> [f32; 2] {
        let view = ViewPoint {
            eye: Vec3::from_array(self.eye),
            target: Vec3::from_array(self.target),
            fov_y_rad: FOV_Y_RAD,
            near: NEAR,
            far: self.far,
        };
        let mut setup = Setup::new(view, Vec3::from_array(self.sun)).expect("a view");
        setup.size = SIZE;
        setup.map_size = 1024;
        setup.filter = filter;
        setup.umbrage = umbrage;
        let mut harness = Harness::new(&setup).expect("a device");
        harness.add_scene(scene).expect("a scene");
        let measured = harness.measure(1, 1).expect("a picture");
        let visible = visibility(&measured.shadowed, &measured.unshadowed);
        if let Some(folder) = std::env::var_os("UMBRAGE_PICTURES") {
            let file = format!("{}-{name}-{filter:?}.png", self.scene);
            let picture = picture(&measured, &visible, truth);
            picture.save(Path::new(&folder).join(file)).expect("a folder for pictures");
        }
        let pixels = visible.iter().zip(truth).zip(&measured.unshadowed);
        let errors: Vec<f32> = pixels
            .filter(|(_, unshadowed)| counts(**unshadowed))
            .filter_map(|((visible, truth), _)| Some((visible - (*truth)?).abs()))
            .collect();
        assert!(errors.len() > 20_000, "{}: {} pixels count", self.scene, errors.len());
        let count = errors.len() as f32;
        let wrong = errors.iter().filter(|e| **e > 0.5).count() as f32 / count;
        let mean = errors.iter().sum::<f32>() / count;
        println!("{} {filter:?} {name}: wrong {wrong:.4}, mean {mean:.4}", self.scene);
        [wrong, mean]
    }
}

/// What Bevy draws, and the wrong pixels below.
fn picture(measured: &Measured, visible: &[f32], truth: &[Option<f32>]) -> RgbImage {
    let srgb = |v: f32| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8;
    RgbImage::from_fn(SIZE[0], 2 * SIZE[1], |x, y| {
        let i = ((y % SIZE[1]) * SIZE[0] + x) as usize;
        let unshadowed = measured.unshadowed[i];
        if y < SIZE[1] {
            // Some light from everywhere, so that shadows are not black.
            let grey = srgb(1.2 * (measured.shadowed[i] + 0.2 * unshadowed) + 0.02);
            return Rgb([grey; 3]);
        }
        match truth[i].filter(|_| counts(unshadowed)).map(|truth| visible[i] - truth) {
            Some(error) if error > 0.5 => Rgb([230, 120, 0]),
            Some(error) if error < -0.5 => Rgb([0, 90, 220]),
            _ => Rgb([240; 3]),
        }
    })
}

#[needs(gpu)]
#[test]
fn built_in_scenes() {
    for case in CASES {
        let scene = umbrage_scene::builtin(case.scene, None).expect("a scene");
        let truth = case.truth(&scene);
        for (filter, most) in [
            (ShadowFilteringMethod::Hardware2x2, [0.4, 0.6]),
            // The filter blurs wherever shadows end, which is most of its mean error, and hides
            // bars that are thinner than it is wide.
            (ShadowFilteringMethod::Gaussian, [0.6, 1.0]),
        ] {
            let bevy = case.errors(&scene, &truth, ("off", Umbrage::Off), filter);
            let adaptive: UmbrageShadows = "adaptive+z4".parse().expect("a technique");
            for (name, umbrage, share) in [
                ("lookup", Umbrage::Lookup, most),
                ("stable", Umbrage::Planned(Box::default()), most),
                ("adaptive", Umbrage::Planned(Box::new(adaptive.clone())), most.map(|m| 0.7 * m)),
            ] {
                let ours = case.errors(&scene, &truth, (name, umbrage), filter);
                for i in 0..2 {
                    let scene = case.scene;
                    let most = share[i] * bevy[i];
                    assert!(ours[i] < most, "{scene} {filter:?} {name}: {ours:?} of {bevy:?}");
                }
            }
        }
    }
}
