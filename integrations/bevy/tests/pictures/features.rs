//! Shadows of the sun with each of Bevy's features, against rays and against the plain picture.

use crate::boxes::{BLOCKS, FILTERS, SUN, add, draw, errors, planned, setup, truth};
use crate::harness::{Harness, Setup, Umbrage};
use bevy::asset::uuid_handle;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::NoFrustumCulling;
use bevy::core_pipeline::prepass::{DepthPrepass, MotionVectorPrepass, NormalPrepass};
use bevy::light::ShadowFilteringMethod;
use bevy::mesh::VertexAttributeValues;
use bevy::mesh::morph::{MeshMorphWeights, MorphAttributes};
use bevy::mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes};
use bevy::prelude::*;
use bevy::render::render_resource::{AsBindGroup, Face, TextureFormat};
use bevy::shader::{ShaderImport, ShaderRef};
use umbrage_testing::needs;

fn harness(setup: &Setup) -> Harness {
    let mut harness = Harness::new(setup).expect("a device");
    add(&mut harness, &BLOCKS);
    harness
}

/// The share of wrong pixels and the mean error under the sun.
fn sun_errors(harness: &mut Harness, setup: &Setup) -> [f32; 2] {
    let (visible, unshadowed) = draw(harness);
    errors(&visible, &unshadowed, &truth(setup.size, |_| -SUN * 1e3))
}

/// The depth shaders are loaded where there is a device.
#[needs(gpu)]
#[test]
fn depth_shaders_know_warps() {
    let mut harness = harness(&setup(planned("lispsm")));
    harness.settle().expect("pipelines");
    let shaders = harness.app().world().resource::<Assets<Shader>>();
    for name in ["bevy_pbr::prepass::prepass", "bevy_pbr::render::pbr_prepass"] {
        let path = ShaderImport::Custom(name.to_owned());
        let (_, shader) = shaders.iter().find(|(_, s)| s.import_path == path).expect(name);
        assert!(shader.source.as_str().contains("in.unclipped_depth * in.position.w"), "{name}");
    }
}

/// The plugin with Bevy's own cascades, with stable ones, with fitted ones, and with a map whose
/// perspective is far from even.
fn variants() -> [(&'static str, Umbrage); 4] {
    [
        ("lookup", Umbrage::Lookup),
        ("stable", Umbrage::Planned(Box::default())),
        ("adaptive+z4", planned("adaptive+z4")),
        ("lispsm", planned("lispsm")),
    ]
}

#[needs(gpu)]
#[test]
fn every_filter_is_better_than_bevys() {
    for filter in FILTERS {
        let with = |umbrage: Umbrage| {
            let setup = Setup { filter, ..setup(umbrage) };
            sun_errors(&mut harness(&setup), &setup)
        };
        let bevy = with(Umbrage::Off);
        for (name, umbrage) in variants() {
            let [wrong, mean] = with(umbrage);
            println!("{filter:?} {name}: {wrong:.4} {mean:.4}, Bevy {bevy:.4?}");
            assert!(wrong < 0.5 * bevy[0], "{filter:?} {name}: {wrong} of {}", bevy[0]);
            assert!(mean < bevy[1], "{filter:?} {name}: {mean} of {}", bevy[1]);
        }
    }
}

#[needs(gpu)]
#[test]
fn soft_shadows_have_no_acne() {
    for filter in FILTERS {
        let with = |umbrage: Umbrage| {
            let setup = Setup { filter, ..setup(umbrage) };
            let mut harness = harness(&setup);
            let light = harness.light();
            let mut light = harness.app().world_mut().get_mut::<DirectionalLight>(light).unwrap();
            light.soft_shadow_size = Some(1.0);
            sun_errors(&mut harness, &setup)
        };
        let bevy = with(Umbrage::Off);
        for (name, umbrage) in variants() {
            let [wrong, mean] = with(umbrage);
            println!("soft {filter:?} {name}: {wrong:.4} {mean:.4}, Bevy {bevy:.4?}");
            assert!(wrong < bevy[0], "{filter:?} {name}: {wrong} of {}", bevy[0]);
            assert!(mean < bevy[1], "{filter:?} {name}: {mean} of {}", bevy[1]);
        }
    }
}

/// The plugin's errors when `change` has changed the scene, against those of the plain scene.
fn as_the_plain_scene(name: &str, setup: &Setup, change: impl Fn(&mut Harness)) {
    let plain = sun_errors(&mut harness(setup), setup);
    let mut changed = harness(setup);
    change(&mut changed);
    let [wrong, mean] = sun_errors(&mut changed, setup);
    println!("{name}: {wrong:.4} {mean:.4}, plain {plain:.4?}");
    assert!(wrong < 1.3 * plain[0] + 0.002, "{name}: {wrong} and {}", plain[0]);
    assert!(mean < 1.3 * plain[1] + 0.004, "{name}: {mean} and {}", plain[1]);
}

/// Replaces the material of all meshes.
fn with_material(
    harness: &mut Harness,
    material: impl FnOnce(StandardMaterial) -> StandardMaterial,
) {
    let white = harness.white();
    let mut materials = harness.app().world_mut().resource_mut::<Assets<StandardMaterial>>();
    let changed = material(materials.get(&white).expect("white").clone());
    materials.insert(&white, changed).expect("the handle is in use");
}

#[needs(gpu)]
#[test]
fn deferred_shading() {
    let setup = setup(planned("adaptive+z4"));
    let deferred = Setup { deferred: true, ..setup.clone() };
    let plain = sun_errors(&mut harness(&setup), &setup);
    let [wrong, mean] = sun_errors(&mut harness(&deferred), &deferred);
    println!("deferred: {wrong:.4} {mean:.4}, plain {plain:.4?}");
    // The triangle is not known, so at outlines the shading normal stands for its plane.
    assert!(wrong < 1.5 * plain[0] + 0.002 && mean < 1.5 * plain[1] + 0.004);
}

#[needs(gpu)]
#[test]
fn multisampling() {
    let setup = setup(planned("adaptive+z4"));
    let sampled = Setup { msaa: Msaa::Sample4, ..setup.clone() };
    let plain = sun_errors(&mut harness(&setup), &setup);
    let [wrong, mean] = sun_errors(&mut harness(&sampled), &sampled);
    println!("multisampled: {wrong:.4} {mean:.4}, plain {plain:.4?}");
    // Pixels at outlines show two surfaces, and the truth one of them.
    assert!(wrong < plain[0] + 0.006 && mean < plain[1] + 0.012);
}

#[needs(gpu)]
#[test]
fn prepasses() {
    as_the_plain_scene("prepass", &setup(planned("adaptive+z4")), |harness| {
        let camera = harness.camera();
        let mut camera = harness.app().world_mut().entity_mut(camera);
        camera.insert((DepthPrepass, NormalPrepass, MotionVectorPrepass));
    });
}

#[needs(gpu)]
#[test]
fn alpha_masks() {
    // A mask that leaves everything, on the path of masked materials.
    as_the_plain_scene("masked", &setup(planned("adaptive+z4")), |harness| {
        with_material(harness, |white| StandardMaterial {
            alpha_mode: AlphaMode::Mask(0.5),
            ..white
        });
    });
}

#[needs(gpu)]
#[test]
fn single_sided_materials() {
    // Bevy's default material: back faces are neither seen nor drawn into maps.
    for text in ["uniform(stable)+z4", "adaptive+z4", "lispsm", "psm"] {
        as_the_plain_scene(text, &setup(planned(text)), |harness| {
            with_material(harness, |white| StandardMaterial {
                double_sided: false,
                cull_mode: Some(Face::Back),
                ..white
            });
        });
    }
}

#[needs(gpu)]
#[test]
fn transparent_receivers() {
    let setup = setup(planned("adaptive+z4"));
    as_the_plain_scene("transparent", &setup, |harness| {
        let white = harness.white();
        let world = harness.app().world_mut();
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        let glass = StandardMaterial {
            alpha_mode: AlphaMode::Blend,
            // Or else the lower side would be drawn over the upper one.
            cull_mode: Some(Face::Back),
            ..materials.get(&white).expect("white").clone()
        };
        let glass = materials.add(glass);
        let mut meshes = world.query::<(&Transform, &mut MeshMaterial3d<StandardMaterial>)>();
        for (transform, mut material) in meshes.iter_mut(world) {
            if transform.translation.y < 0.0 {
                material.0 = glass.clone();
            }
        }
    });
}

#[needs(gpu)]
#[test]
fn skinned_casters() {
    // The post becomes one mesh with a joint that brings it to its place.
    as_the_plain_scene("skinned", &setup(planned("adaptive+z4")), |harness| {
        let white = harness.white();
        let world = harness.app().world_mut();
        let (entity, place, mesh) = post(world);
        let joint = world.spawn(place).id();
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let mut skinned = meshes.get(&mesh).expect("a mesh").clone();
        let count = skinned.count_vertices();
        skinned.insert_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            VertexAttributeValues::Uint16x4(vec![[0; 4]; count]),
        );
        skinned.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0, 0.0, 0.0, 0.0]; count]);
        let skinned = meshes.add(skinned);
        let mut poses = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>();
        let inverse_bindposes = poses.add(vec![Mat4::IDENTITY]);
        world.despawn(entity);
        world.spawn((
            Mesh3d(skinned),
            MeshMaterial3d(white),
            SkinnedMesh { inverse_bindposes, joints: vec![joint] },
            // Bevy's box is that of the mesh at rest.
            NoFrustumCulling,
        ));
    });
}

#[needs(gpu)]
#[test]
fn morphed_casters() {
    // The post is drawn elsewhere, and a morph target brings it to its place.
    as_the_plain_scene("morphed", &setup(planned("adaptive+z4")), |harness| {
        let white = harness.white();
        let world = harness.app().world_mut();
        let (entity, place, mesh) = post(world);
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let mut morphed = meshes.get(&mesh).expect("a mesh").clone();
        let moved = MorphAttributes::new(place.translation, Vec3::ZERO, Vec3::ZERO);
        morphed.set_morph_targets(vec![moved; morphed.count_vertices()]);
        let morphed = meshes.add(morphed);
        world.despawn(entity);
        let weights = MeshMorphWeights::Value { weights: vec![1.0] };
        world.spawn((Mesh3d(morphed), MeshMaterial3d(white), weights, NoFrustumCulling));
    });
}

/// The post, its place and its mesh.
fn post(world: &mut World) -> (Entity, Transform, Handle<Mesh>) {
    let mut meshes = world.query::<(Entity, &Transform, &Mesh3d)>();
    let is_post = |(_, t, _): &(Entity, &Transform, &Mesh3d)| t.translation == BLOCKS[2].center;
    let (entity, transform, mesh) = meshes.iter(world).find(is_post).expect("the post");
    (entity, *transform, mesh.0.clone())
}

#[needs(gpu)]
#[test]
fn several_cameras() {
    // A second camera sees the scene from elsewhere, so the cascades have shared ends.
    as_the_plain_scene("two cameras", &setup(planned("adaptive+z4")), |harness| {
        let camera = harness.camera();
        let world = harness.app().world_mut();
        let projection = world.get::<Projection>(camera).expect("a camera").clone();
        let image = Image::new_target_texture(64, 64, TextureFormat::Rgba16Float, None);
        let image = world.resource_mut::<Assets<Image>>().add(image);
        world.spawn((
            Camera3d::default(),
            RenderTarget::from(image),
            projection,
            Msaa::Off,
            ShadowFilteringMethod::Hardware2x2,
            Transform::from_xyz(-20.0, 9.0, -20.0).looking_at(Vec3::ZERO, Vec3::Y),
        ));
    });
}

/// A material with a shader that goes round Bevy's `pbr_input_from_vertex_output`, so that nobody
/// notes its triangles.
#[derive(Asset, TypePath, AsBindGroup, Clone)]
struct OwnMaterial {}

const OWN_SHADER: Handle<Shader> = uuid_handle!("5b0d6d2e-8a53-4d6b-9c6f-0c1f5b7d7a11");

impl Material for OwnMaterial {
    fn fragment_shader() -> ShaderRef {
        OWN_SHADER.into()
    }
}

const OWN_TEXT: &str = "
import bevy_pbr::render::{
    forward_io::VertexOutput,
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    pbr_functions::{apply_pbr_lighting, calculate_view},
    pbr_types::pbr_input_new,
};

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4f {
    var input = pbr_input_new();
    input.frag_coord = in.position;
    input.world_position = in.world_position;
    input.world_normal = normalize(in.world_normal);
    input.N = input.world_normal;
    input.V = calculate_view(in.world_position, false);
    input.flags = MESH_FLAGS_SHADOW_RECEIVER_BIT;
    input.material.perceptual_roughness = 1.0;
    input.material.reflectance = vec3f(0.0);
    return apply_pbr_lighting(input);
}
";

#[needs(gpu)]
#[test]
fn materials_of_ones_own() {
    let setup = setup(planned("adaptive+z4"));
    let plain = sun_errors(&mut harness(&setup), &setup);
    let add_plugin = |app: &mut App| {
        app.add_plugins(MaterialPlugin::<OwnMaterial>::default());
    };
    let mut own = Harness::with_plugins(&setup, add_plugin).expect("a device");
    add(&mut own, &BLOCKS);
    let world = own.app().world_mut();
    let shader = Shader::from_wesl(OWN_TEXT, "own.wesl");
    world.resource_mut::<Assets<Shader>>().insert(&OWN_SHADER, shader).expect("a handle");
    let material = world.resource_mut::<Assets<OwnMaterial>>().add(OwnMaterial {});
    let mut meshes = world.query_filtered::<Entity, With<Mesh3d>>();
    for mesh in meshes.iter(world).collect::<Vec<_>>() {
        let mut mesh = world.entity_mut(mesh);
        mesh.remove::<MeshMaterial3d<StandardMaterial>>();
        mesh.insert(MeshMaterial3d(material.clone()));
    }
    let [wrong, mean] = sun_errors(&mut own, &setup);
    println!("own material: {wrong:.4} {mean:.4}, plain {plain:.4?}");
    // The shading normal is that of the triangle here.
    assert!(wrong < 1.3 * plain[0] + 0.002 && mean < 1.3 * plain[1] + 0.004);
}
