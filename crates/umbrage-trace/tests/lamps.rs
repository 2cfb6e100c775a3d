//! Every kind of filter under a spot light and a point light, against the truth.

mod common;

use common::{ground, nobody, plan, scene, sheet};
use glam::{DAffine3, DVec3, Vec3};
use umbrage::visibility::statistic::{Csm, Esm, Evsm, Msm, Statistic, Vsm};
use umbrage::visibility::{Blur, Filter, LightSize, Prefilter, Width};
use umbrage::{Camera, Light, LookAt, PointLight, SpotLight, Technique, Warp};
use umbrage_trace::{Reference, Tracer, View};

#[test]
fn lamps_are_filtered_as_well_as_compared() {
    // A floor, seen and lit obliquely, under several sheets.
    let sheets = [(-3.0, 1.0, -4.0), (1.0, 0.5, 1.0), (3.0, 1.5, -2.0)];
    let mut meshes = vec![ground(12.0)];
    meshes.extend(sheets.map(|(x, y, z)| sheet(Vec3::new(x, y, z), Vec3::Z * 1.5, Vec3::X * 1.5)));
    let instances: Vec<_> = (0..meshes.len()).map(|i| (i, DAffine3::IDENTITY)).collect();
    let scene = scene(meshes, &instances);
    let tracer = Tracer::new(&scene).unwrap();
    let camera = Camera::look_at(LookAt {
        eye: DVec3::new(2.0, 5.0, 11.0),
        target: DVec3::new(0.0, 0.0, 0.0),
        up: DVec3::Y,
        fov_y_rad: 0.9,
        near: 0.5,
        far: 40.0,
        image: [320, 180],
    })
    .unwrap();
    let spot = SpotLight {
        position: DVec3::new(-8.0, 4.0, 0.0),
        direction: DVec3::new(1.0, -0.5, 0.0),
        half_angle_rad: 0.6,
        near: 0.1,
        range: 40.0,
    };
    let point = PointLight { position: DVec3::new(0.0, 3.0, -1.0), near: 0.1, range: 40.0 };
    let statistics = [
        Statistic::Vsm(Vsm::default()),
        Statistic::Esm(Esm::default()),
        Statistic::Evsm(Evsm::default()),
        Statistic::Msm(Msm::default()),
        Statistic::Csm(Csm::new(16, 0.0, false, true).unwrap().with_leak(0.1)),
    ];
    let filters = statistics.into_iter().flat_map(|statistic| {
        [Blur::Texels(3), Blur::Width(Width::Pixels(2.0))]
            .map(|blur| Filter::Prefiltered(Prefilter { statistic, blur, half: false }))
    });
    let filters: Vec<Filter> =
        filters.chain([Filter::Pcss { n: 4, light: LightSize::Metres(0.05) }]).collect();
    // A cone that is a half-space has six maps.
    let wide = SpotLight { half_angle_rad: std::f64::consts::FRAC_PI_2, ..spot };
    for light in [Light::Spot(spot), Light::Spot(wide), Light::Point(point)] {
        for warp in [Warp::Uniform, Warp::Lispsm] {
            let view = View::new(&tracer, camera, light, 1).unwrap();
            let band = view.band(0..camera.image()[1], &nobody);
            let truth = band.map(|s| s.is_facing.then(|| view.truth(s)), &nobody);
            let dark = truth.iter().flatten().filter(|&&t| t == 0.0).count();
            assert!(dark > 300, "{dark} pixels in shadow");
            let wrong = |filter: Filter| {
                let technique = Technique { warp, filter, ..Technique::default() };
                let plan = plan(&scene, &camera, light, &technique);
                let reference = Reference::render(&tracer, &plan, &nobody).unwrap();
                let visibility = band.map(|s| reference.visibility(0, s), &nobody);
                let pairs = truth.iter().zip(visibility);
                let off = pairs.filter(|(t, v)| t.is_some_and(|t| (t - v).abs() > 0.5)).count();
                // The share is of the pixels that are in shadow.
                off as f64 / dark as f64
            };
            let compared = wrong(Filter::Pcf { n: 3 });
            for filter in &filters {
                let wrong = wrong(*filter);
                assert!(wrong < compared + 0.08, "{warp:?}, {filter}: {wrong}, not {compared}");
            }
        }
    }
}
