//! The plugin in apps without a GPU: the texts of Bevy's shaders, configurations, bad input.

mod common;

use bevy::camera::RenderTarget;
use bevy::ecs::system::RunSystemOnce;
use bevy::light::CascadeShadowConfig;
use bevy::light::cascade::Cascades;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::shader::{ShaderImport, Source};
use bevy::shape::Aabb3d;
use bevy_umbrage::prelude::*;
use common::{loaded, lookup};

fn shader_text(app: &App, path: &str) -> String {
    let (_, shader) = shader(app, path);
    shader.source.as_str().to_owned()
}

fn shader<'a>(app: &'a App, path: &str) -> (AssetId<Shader>, &'a Shader) {
    let wanted = ShaderImport::Custom(path.to_owned());
    let shaders = app.world().resource::<Assets<Shader>>();
    shaders.iter().find(|(_, s)| s.import_path == wanted).expect("Bevy has this shader")
}

const SHADOWS: &str = "bevy_pbr::render::shadows";
const FRAGMENT: &str = "bevy_pbr::render::pbr_fragment";
const DEFERRED: &str = "bevy_pbr::deferred::functions";
const FUNCTIONS: &str = "bevy_pbr::render::pbr_functions";

#[test]
fn all_texts_are_found_in_the_locked_bevy() {
    let app = loaded();
    assert_eq!(*lookup(&app), Lookup::Umbrage);
    let shadows = shader_text(&app, SHADOWS);
    for name in ["sample_directional_cascade", "fetch_spot_shadow", "fetch_point_shadow"] {
        assert!(shadows.contains(&format!("return umbrage_lights::{name}(light_id, ")), "{name}");
    }
    assert!(shader_text(&app, FRAGMENT).contains("umbrage_surface::note_triangle"));
    assert!(shader_text(&app, DEFERRED).contains("umbrage_surface::note_pixels"));
}

#[test]
fn switched_off_bevy_is_as_it_comes() {
    let mut app = loaded();
    app.world_mut().resource_mut::<UmbrageEnabled>().0 = false;
    app.update();
    assert_eq!(*lookup(&app), Lookup::Bevy);
    for path in [SHADOWS, FRAGMENT, DEFERRED] {
        assert!(!shader_text(&app, path).contains("umbrage"), "{path}");
    }
    app.world_mut().resource_mut::<UmbrageEnabled>().0 = true;
    app.update();
    assert_eq!(*lookup(&app), Lookup::Umbrage);
    assert!(shader_text(&app, SHADOWS).contains("umbrage_lights"));
}

#[test]
fn debug_views_are_in_the_shader_while_they_are_on() {
    let mut app = loaded();
    for (debug, call) in [
        (UmbrageDebug::Cascades, Some("umbrage_debug::cascades(")),
        (UmbrageDebug::TexelDensity, Some("umbrage_debug::texel_density(")),
        (UmbrageDebug::TexelGrid, Some("umbrage_debug::texel_grid(")),
        (UmbrageDebug::Off, None),
    ] {
        app.insert_resource(debug);
        app.update();
        let text = shader_text(&app, FUNCTIONS);
        match call {
            Some(call) => assert_eq!(text.matches(call).count(), 1, "{call}"),
            None => assert!(!text.contains("umbrage")),
        }
    }
}

/// Changes a shader as another plugin might.
fn change(app: &mut App, path: &str, old: &str, new: &str) {
    let (id, shader) = shader(app, path);
    let (text, asset_path) = (shader.source.as_str().to_owned(), shader.path.clone());
    assert!(text.contains(old), "{old}");
    let changed = Shader::from_wesl(text.replace(old, new), asset_path);
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    shaders.get_mut(id).expect("it was just found").source = changed.source;
    // An event is told in the frame after the change.
    app.update();
    app.update();
}

/// Bevy's text of a shader, before any change.
fn original(app: &mut App, path: &str) -> String {
    app.world_mut().resource_mut::<UmbrageEnabled>().0 = false;
    app.update();
    let text = shader_text(app, path);
    app.world_mut().resource_mut::<UmbrageEnabled>().0 = true;
    text
}

#[test]
fn an_unknown_shader_leaves_bevy_as_it_comes() {
    // In each of the shaders that the lookup needs, something else stands in the place of what
    // this crate replaces.
    for (path, old, new) in [
        (SHADOWS, "fn fetch_point_shadow(", "fn fetch_pointed_shadow("),
        (SHADOWS, "let depth = near_z / -projected_position.z;", "let depth = 0.5;"),
        (FRAGMENT, "pbr_input.world_position = in.world_position;", "note(in);"),
    ] {
        let mut app = loaded();
        original(&mut app, path);
        app.world_mut().resource_mut::<UmbrageEnabled>().0 = false;
        app.update();
        change(&mut app, path, old, new);
        app.world_mut().resource_mut::<UmbrageEnabled>().0 = true;
        app.update();
        let Lookup::Refused { why } = lookup(&app).clone() else {
            panic!("{path} is changed: {:?}", lookup(&app));
        };
        assert!(why.starts_with(path), "{why}");
        for path in [SHADOWS, FRAGMENT, DEFERRED] {
            assert!(!shader_text(&app, path).contains("umbrage"), "{path}");
        }
        // Cascades are Bevy's own too.
        let light = spawn_sun(&mut app, "adaptive+z2".parse().unwrap());
        spawn_camera(&mut app, Transform::default());
        app.update();
        assert_eq!(config(&app, light).bounds.len(), 4);
    }
}

#[test]
fn a_shader_that_is_loaded_again_is_changed_again() {
    let mut app = loaded();
    let text = original(&mut app, SHADOWS);
    app.update();
    let (id, _) = shader(&app, SHADOWS);
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    shaders.get_mut(id).unwrap().source = Source::Wesl(text.into());
    app.update();
    app.update();
    assert!(shader_text(&app, SHADOWS).contains("umbrage_lights"));
    assert_eq!(*lookup(&app), Lookup::Umbrage);
}

fn spawn_camera(app: &mut App, transform: Transform) -> Entity {
    let image = Image::new_target_texture(64, 32, TextureFormat::Rgba8UnormSrgb, None);
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let target = RenderTarget::Image(image.into());
    app.world_mut().spawn((Camera3d::default(), target, transform)).id()
}

fn spawn_sun(app: &mut App, shadows: UmbrageShadows) -> Entity {
    let light = DirectionalLight { shadow_maps_enabled: true, ..default() };
    let transform = Transform::default().looking_to(Vec3::new(0.3, -1.0, 0.2), Vec3::Z);
    app.world_mut().spawn((light, transform, shadows)).id()
}

fn config(app: &App, light: Entity) -> &CascadeShadowConfig {
    app.world().get(light).unwrap()
}

fn cascades(app: &App, light: Entity, view: Entity) -> &[bevy::light::cascade::Cascade] {
    &app.world().get::<Cascades>(light).unwrap().cascades[&view]
}

#[test]
fn plans_write_cascades_and_give_them_back() {
    let mut app = loaded();
    let view = spawn_camera(&mut app, Transform::from_xyz(0.0, 2.0, 0.0));
    let light = spawn_sun(&mut app, "uniform+z2".parse().unwrap());
    app.update();
    assert_eq!(config(&app, light).bounds.len(), 2);
    assert!((config(&app, light).bounds[1] - 150.0).abs() < 1e-3);
    assert_eq!(cascades(&app, light, view).len(), 2);
    // The three matrices agree.
    for cascade in cascades(&app, light, view) {
        let product = cascade.clip_from_cascade * cascade.world_from_cascade.inverse();
        assert!(product.abs_diff_eq(cascade.clip_from_world, 1e-4));
        assert!(cascade.texel_size > 0.0);
    }

    // The user's own changes count, also while plans write the configuration.
    let user = CascadeShadowConfig {
        bounds: vec![5.0, 20.0, 60.0],
        overlap_proportion: 0.3,
        minimum_distance: 0.5,
    };
    app.world_mut().entity_mut(light).insert(user.clone());
    app.update();
    assert_eq!(config(&app, light).bounds.len(), 2);
    assert_eq!(config(&app, light).bounds[1], 60.0);
    app.world_mut().entity_mut(light).remove::<UmbrageShadows>();
    app.update();
    assert_eq!(config(&app, light).bounds, user.bounds);
    assert_eq!(config(&app, light).overlap_proportion, 0.3);
    app.update();
    assert_eq!(cascades(&app, light, view).len(), 3);
}

#[test]
fn slices_meet_where_bevy_blends_them() {
    let mut app = loaded();
    spawn_camera(&mut app, Transform::from_xyz(0.0, 2.0, 0.0));
    let shadows = UmbrageShadows::default().with_distance(100.0).with_overlap(0.25).unwrap();
    let light = spawn_sun(&mut app, shadows);
    app.update();
    let config = config(&app, light);
    assert_eq!(config.bounds.len(), 4);
    assert_eq!(config.bounds[3], 100.0);
    assert!(config.bounds.is_sorted());
    assert!(config.overlap_proportion > 0.0 && config.overlap_proportion < 0.25);
}

#[test]
fn several_cameras_share_the_ends_of_cascades() {
    let mut app = loaded();
    let near = spawn_camera(&mut app, Transform::from_xyz(0.0, 2.0, 0.0));
    let far = spawn_camera(&mut app, Transform::from_xyz(0.0, 50.0, 90.0));
    let light = spawn_sun(&mut app, "adaptive+z4".parse().unwrap());
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::new(9.0, 0.1, 9.0));
    app.world_mut().spawn((Mesh3d(mesh), Transform::from_xyz(0.0, 0.0, -8.0)));
    for _ in 0..3 {
        app.update();
        let bounds = &config(&app, light).bounds;
        let expected = [10.0, 24.662, 60.822, 150.0];
        for (i, (bound, end)) in bounds.iter().zip(expected).enumerate() {
            // Each slice reaches a little into the next one.
            let most = if i == 3 { end } else { 1.1 * end };
            assert!(*bound >= end - 0.01 && *bound <= most + 0.01, "{bounds:?}");
        }
        assert_eq!(cascades(&app, light, near).len(), 4);
        assert_eq!(cascades(&app, light, far).len(), 4);
    }
}

#[test]
fn bad_input_leaves_bevys_cascades() {
    let shadows = || "adaptive+z4".parse::<UmbrageShadows>().unwrap();
    let ok = Transform::from_xyz(0.0, 2.0, 0.0);
    let perspective =
        |near, far| Projection::Perspective(PerspectiveProjection { near, far, ..default() });
    let cases: [(&str, UmbrageShadows, Transform, Option<Projection>); 7] = [
        ("NaN distance", shadows().with_distance(f32::NAN), ok, None),
        ("negative distance", shadows().with_distance(-3.0), ok, None),
        ("distance before the near plane", shadows().with_distance(0.05), ok, None),
        ("scaled camera", shadows(), ok.with_scale(Vec3::new(1.0, 2.0, 1.0)), None),
        ("camera at NaN", shadows(), Transform::from_xyz(f32::NAN, 0.0, 0.0), None),
        ("NaN near plane", shadows(), ok, Some(perspective(f32::NAN, 1.0))),
        (
            "NaN box",
            shadows().with_receivers(Receivers::Box(Aabb3d {
                min: Vec3::NAN.into(),
                max: Vec3::ONE.into(),
            })),
            ok,
            None,
        ),
    ];
    for (what, shadows, transform, projection) in cases {
        let mut app = loaded();
        let view = spawn_camera(&mut app, transform);
        if let Some(projection) = projection {
            app.world_mut().entity_mut(view).insert(projection);
        }
        let light = spawn_sun(&mut app, shadows);
        for _ in 0..3 {
            app.update();
        }
        assert_eq!(config(&app, light).bounds.len(), 4, "{what}");
        assert_eq!(cascades(&app, light, view).len(), 4, "{what}");
        let problem = app.world().resource::<UmbrageStatus>().problem.as_ref();
        assert!(problem.is_some_and(|p| p.contains("stay Bevy's own: ")), "{what}: {problem:?}");
    }
}

#[test]
fn suns_and_cameras_in_every_direction_have_finite_cascades() {
    let mut app = loaded();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::new(9.0, 3.0, 9.0));
    app.world_mut().spawn((Mesh3d(mesh), Transform::from_xyz(0.0, 0.0, -8.0)));
    let view = spawn_camera(&mut app, Transform::default());
    let light = spawn_sun(&mut app, "adaptive+z4".parse().unwrap());
    let directions = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for sun in directions {
        for look in directions {
            let pose = |d: Vec3| Transform::default().looking_to(d, d.any_orthonormal_vector());
            *app.world_mut().get_mut::<Transform>(light).unwrap() = pose(sun);
            *app.world_mut().get_mut::<Transform>(view).unwrap() = pose(look);
            app.update();
            for cascade in cascades(&app, light, view) {
                assert!(cascade.clip_from_world.is_finite(), "{sun} {look}");
                assert!(cascade.clip_from_cascade.is_finite(), "{sun} {look}");
                assert!(cascade.texel_size.is_finite(), "{sun} {look}");
            }
        }
    }
}

#[test]
fn a_light_that_goes_takes_its_plans_along() {
    let mut app = loaded();
    spawn_camera(&mut app, Transform::default());
    for _ in 0..3 {
        let light = spawn_sun(&mut app, UmbrageShadows::default());
        app.update();
        app.world_mut().despawn(light);
        app.update();
    }
    let spot = app.world_mut().spawn((SpotLight::default(), UmbrageShadows::default())).id();
    app.update();
    assert!(app.world().get::<UmbrageShadows>(spot).is_some());
    let cameras = |cameras: Query<&Camera>| cameras.iter().count();
    assert_eq!(app.world_mut().run_system_once(cameras).unwrap(), 1);
}

#[test]
fn an_app_without_a_renderer_is_left_alone() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, UmbragePlugin));
    app.finish();
    app.update();
    assert_eq!(*lookup(&app), Lookup::Waiting);
}

#[test]
fn planned_cascades_see_the_same_side_of_triangles_as_bevys() {
    let mut app = loaded();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::new(9.0, 3.0, 9.0));
    app.world_mut().spawn((Mesh3d(mesh), Transform::from_xyz(0.0, 0.0, -8.0)));
    let view = spawn_camera(&mut app, Transform::from_xyz(0.0, 2.0, 0.0));
    let light = spawn_sun(&mut app, UmbrageShadows::default());
    let mut sides = |shadows: Option<&str>| {
        let mut light_mut = app.world_mut().entity_mut(light);
        match shadows {
            Some(text) => light_mut.insert(text.parse::<UmbrageShadows>().unwrap()),
            None => light_mut.remove::<UmbrageShadows>(),
        };
        app.update();
        app.update();
        let signs = cascades(&app, light, view).iter().map(|c| c.clip_from_world.determinant());
        signs.map(f32::signum).collect::<Vec<_>>()
    };
    let bevys = sides(None);
    for text in ["uniform+z4", "uniform(stable)+z4", "adaptive+z4", "lispsm", "psm", "tsm"] {
        assert!(sides(Some(text)).iter().all(|sign| *sign == bevys[0]), "{text}");
    }
}
