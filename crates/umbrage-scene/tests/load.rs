//! How features of glTF are loaded, and how invalid files are refused, with small files made here.

mod common;
mod damage;

use common::{File, QUARTER, instanced, lit_by, masked, notices, skinned};
use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;
use umbrage::{Light, PointLight, SpotLight};
use umbrage_scene::{Alpha, Lens, SceneError, Wrap, load};

#[test]
fn a_triangle_arrives_as_it_was_written_from_gltf_and_glb() {
    let folder = TempDir::new().unwrap();
    let glb = folder.path().join("triangle.glb");
    std::fs::write(&glb, File::triangle().glb()).unwrap();
    for scene in [File::triangle().load().unwrap(), load(&glb).unwrap()] {
        assert_eq!(notices(&scene), [""; 0]);
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.uvs, [Vec2::ZERO; 0], "no texture, no coordinates");
        assert_eq!(scene.materials.len(), 1);
        assert_eq!(scene.materials[0].base_color, glam::Vec4::ONE);
    }
    assert_eq!(load(&glb).unwrap().name, "triangle");
}

#[test]
fn data_uris_hold_buffers() {
    use base64::Engine;
    let file = File::triangle();
    let encoded = base64::engine::general_purpose::STANDARD.encode(&file.buffer);
    let (length, uri) =
        (file.buffer.len(), format!("data:application/gltf-buffer;base64,{encoded}"));
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("scene.gltf");
    let json = file.with_buffer(Some(&uri), length).json;
    std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
    assert_eq!(load(&path).unwrap().drawn_triangles(), 1);
}

#[test]
fn nodes_nest_and_share_meshes() {
    let file = File::triangle().set("/scenes/0/nodes", json!([0, 1])).set(
        "/nodes",
        json!([
            {"translation": [10, 0, 0], "rotation": [0, QUARTER, 0, QUARTER], "scale": [2, 2, 2],
             "children": [2]},
            {"mesh": 0, "matrix": [-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]},
            {"mesh": 0, "translation": [1, 0, 0]},
            {"mesh": 0, "name": "in no scene"},
        ]),
    );
    let scene = file.load().unwrap();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 2));
    let corner = |i: usize| scene.instances[i].world_from_mesh.transform_point3(DVec3::X);
    // The x axis is rotated to −z, then doubled, then moved.
    assert!((corner(0) - DVec3::new(10.0, 0.0, -4.0)).length() < 1e-6, "{}", corner(0));
    assert_eq!(corner(1), DVec3::new(-1.0, 0.0, 5.0), "mirrored");
}

#[test]
fn instancing_extension_draws_copies() {
    let scene = instanced().load().unwrap();
    assert_eq!(scene.instances.len(), 2);
    let far = scene.instances[1].world_from_mesh.transform_point3(DVec3::X);
    assert_eq!(far, DVec3::new(7.0, 0.0, 0.0));
    let with = |attributes| {
        let extension = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
        File::triangle().set("/nodes/0/extensions", extension)
    };
    // Custom attributes move nothing.
    assert_eq!(with(json!({"_ID": 0})).load().unwrap().instances.len(), 1);
    let error = with(json!({"TRANSLATION": "no"})).error();
    assert!(error.contains("TRANSLATION must be an accessor's index"), "{error}");
}

#[test]
fn primitives_take_only_their_own_of_shared_vertices() {
    let mut file = File::triangle();
    let six: Vec<f32> = (0..18).map(|i| (i * i) as f32).collect();
    let (positions, normals) = (file.floats("VEC3", &six), file.floats("VEC3", &[0.6; 18]));
    let [first, last] = [[0, 1, 2], [5, 3, 1]].map(|corners| file.u16s("SCALAR", &corners));
    let of = |indices| {
        json!({
            "attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices
        })
    };
    file.json["meshes"][0]["primitives"] = json!([of(first), of(last)]);
    let scene = file.load().unwrap();
    let expected = [vec![0, 1, 2], vec![1, 3, 5]];
    for (mesh, expected) in scene.meshes.iter().zip(expected) {
        let positions: Vec<Vec3> =
            expected.iter().map(|&i: &usize| Vec3::from_slice(&six[3 * i..])).collect();
        assert_eq!((&mesh.positions, mesh.normals.len()), (&positions, 3));
    }
    assert_eq!(scene.meshes[1].triangles, [[2, 1, 0]]);
}

#[test]
fn strips_and_fans_become_triangles_and_lines_are_left_out() {
    let mut file = File::triangle();
    let positions = file.floats(
        "VEC3",
        &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]].concat(),
    );
    let primitive = |mode: u32| json!({"attributes": {"POSITION": positions}, "mode": mode});
    file.json["meshes"][0]["primitives"] = json!([primitive(5), primitive(6), primitive(1)]);
    let scene = file.load().unwrap();
    assert_eq!(scene.meshes.len(), 2);
    // Flat normals show that all triangles of the strip face the same way.
    assert_eq!(scene.meshes[0].triangles.len(), 2);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 6]);
    assert_eq!(scene.meshes[1].triangles.len(), 2);
    assert_eq!(
        notices(&scene),
        [
            "meshes[0].primitives[0] and 1 more: has no normals, shaded flat",
            "meshes[0].primitives[2]: points and lines are left out",
        ]
    );
}

#[test]
fn normals_without_direction_come_from_the_triangles_around() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 3.0, 4.0, f32::NAN, 0.0, 1.0]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    let scene = file.load().unwrap();
    assert_eq!(scene.meshes[0].normals, [Vec3::Z, Vec3::new(0.0, 0.6, 0.8), Vec3::Z]);
    assert_eq!(
        notices(&scene),
        [
            "meshes[0].primitives[0]: 2 normals without a direction, computed from the triangles around",
        ]
    );
}

#[test]
fn masks_keep_cutoff_texture_and_addressing() {
    let scene = masked().load().unwrap();
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!((material.name.as_str(), material.double_sided), ("leaf", true));
    assert_eq!(material.alpha, Alpha::Mask { cutoff: 0.4 });
    assert_eq!(material.base_color.x, 0.5);
    let texture = &scene.textures[material.base_color_texture.unwrap().0];
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert_eq!(texture.sample_alpha(Vec2::new(0.1, 0.5)), 0.0);
    assert_eq!(texture.sample_alpha(Vec2::new(0.9, 0.5)), 1.0);
    assert_eq!(scene.meshes[0].uvs, [Vec2::ZERO, Vec2::X, Vec2::Y]);
}

#[test]
fn textures_that_differ_in_nothing_are_stored_once() {
    let mut file = masked();
    let [same, repeating] = [json!({"source": 0, "sampler": 0}), json!({"source": 0})];
    for texture in [same, repeating] {
        let index = file.push("textures", texture);
        let material = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}});
        let material = file.push("materials", material);
        let primitives = file.json["meshes"][0]["primitives"].as_array_mut().unwrap();
        let mut another = primitives[0].clone();
        another["material"] = json!(material);
        primitives.push(another);
    }
    let scene = file.load().unwrap();
    let textures: Vec<usize> = scene
        .meshes
        .iter()
        .map(|m| scene.materials[m.material].base_color_texture.unwrap().0)
        .collect();
    assert_eq!((textures, scene.textures.len()), (vec![0, 0, 1], 2));
}

#[test]
fn translucent_materials_are_cut_at_one_half_and_say_so() {
    let scene = masked().set("/materials/0/alphaMode", json!("BLEND")).load().unwrap();
    assert_eq!(scene.materials[0].alpha, Alpha::Mask { cutoff: 0.5 });
    assert!(notices(&scene)[0].contains("translucent"), "{:?}", notices(&scene));
}

#[test]
fn texture_transforms_and_other_coordinate_sets_apply() {
    let mut file = masked();
    let other = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"] = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_3": other});
    let info = &mut file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"] = json!({"KHR_texture_transform": {
        "texCoord": 3, "offset": [0.5, 0.25], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3]
    }});
    let uvs = &file.load().unwrap().meshes[0].uvs;
    // A counter-clockwise quarter turn takes u to −v and v to u, where v increases downwards.
    let expected = [Vec2::new(0.5, 0.25), Vec2::new(0.5, -1.75), Vec2::new(3.5, 0.25)];
    for (uv, expected) in uvs.iter().zip(expected) {
        assert!(uv.distance(expected) < 1e-5, "{uvs:?}");
    }
}

#[test]
fn missing_and_broken_images_leave_materials_plain() {
    for image in [
        json!({"uri": "no%20such.png"}),
        json!({"uri": "a%20buffer.bin"}),
        json!({"bufferView": 99, "mimeType": "image/png"}),
        json!({"uri": "../outside.png"}),
        json!({}),
    ] {
        let scene = masked().set("/images/0", image.clone()).load().unwrap();
        assert_eq!(scene.materials[0].base_color_texture, None, "{image}");
        assert!(notices(&scene)[0].starts_with("images[0]: left out"), "{:?}", notices(&scene));
    }
    // Many of them get one notice, which has the first one's reason.
    let mut file = masked().set("/images/0", json!({"uri": "none.png"}));
    for i in 1..4 {
        file.push("images", json!({"uri": format!("none{i}.png")}));
        file.push("textures", json!({"source": i}));
        let look = json!({"baseColorTexture": {"index": i}});
        file.push("materials", json!({"pbrMetallicRoughness": look}));
        let mut primitive = file.primitive().clone();
        primitive["material"] = json!(i);
        file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    }
    let scene = file.load().unwrap();
    let [notice] = notices(&scene)[..] else { panic!("{:?}", notices(&scene)) };
    assert!(notice.starts_with("images[0] and 3 more: left out") && notice.contains("none.png"));
}

#[test]
fn cameras_look_along_minus_z() {
    let mut file = File::triangle().set("/nodes/0", json!({"mesh": 0, "children": [1, 2]}));
    file.push(
        "nodes",
        json!({
            "camera": 0, "name": "eye", "translation": [0, 3, 0],
            "rotation": [0, QUARTER, 0, QUARTER], "scale": [2, 2, 2]
        }),
    );
    file.push("nodes", json!({"camera": 1}));
    file.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}),
    );
    file.push(
        "cameras",
        json!({"type": "orthographic",
        "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}),
    );
    let scene = file.load().unwrap();
    let [camera, _] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!(camera.name, "eye");
    assert!((camera.eye - DVec3::Y * 3.0).length() < 1e-9);
    let forward = (camera.target - camera.eye).normalize();
    assert!((forward - DVec3::NEG_X).length() < 1e-6, "{forward}");
    assert!((camera.up - DVec3::Y).length() < 1e-6);
    let Lens::Perspective { fov_y_rad } = camera.lens else { panic!("{:?}", camera.lens) };
    assert!((fov_y_rad - 0.8).abs() < 1e-6);
    // The file states no far distance, so it follows from the scene.
    assert!(camera.near < camera.far && camera.far.is_finite());
    assert_eq!(scene.default_view(), *camera);
    assert!(notices(&scene).is_empty(), "{:?}", notices(&scene));
}

/// Orthographic cameras show twice `ymag` from bottom to top, whatever the node's scale.
#[test]
fn orthographic_cameras() {
    let camera = |orthographic: serde_json::Value| {
        let mut file = File::triangle().set("/nodes/0", json!({"mesh": 0, "children": [1]}));
        file.push(
            "nodes",
            json!({"camera": 0, "name": "plan", "translation": [0, 3, 0], "scale": [2, 2, 2]}),
        );
        file.push("cameras", json!({"type": "orthographic", "orthographic": orthographic}));
        file.load().unwrap()
    };
    let scene = camera(json!({"xmag": 4.0, "ymag": 1.5, "znear": 0.0, "zfar": 9.0}));
    let [found] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!(found.lens, Lens::Orthographic { height: 3.0 });
    assert_eq!((found.eye, found.near, found.far), (DVec3::Y * 3.0, 0.0, 9.0));
    assert!(found.camera([640, 480]).unwrap().is_orthographic());
    assert!(notices(&scene).is_empty(), "{:?}", notices(&scene));
    for [ymag, znear, zfar] in
        [[0.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [1.0, 2.0, 1.0], [1.0, -1.0, 1.0]]
    {
        let scene = camera(json!({"xmag": 1.0, "ymag": ymag, "znear": znear, "zfar": zfar}));
        assert!(scene.cameras.is_empty(), "{:?}", scene.cameras);
        assert!(notices(&scene)[0].contains("needs 0 < ymag"), "{:?}", notices(&scene));
    }
}

#[test]
fn lights_have_their_poses_and_sensible_ranges() {
    let mut file = File::triangle().set("/scenes/0/nodes", json!([0, 1, 2, 3]));
    for light in 0..3 {
        // The node is rotated so that the light points down.
        file.push(
            "nodes",
            json!({
                "extensions": {"KHR_lights_punctual": {"light": light}},
                "translation": [0, 10, 0], "rotation": [-QUARTER, 0, 0, QUARTER]
            }),
        );
    }
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 5},
        {"type": "spot", "name": "lamp", "color": [1, 0.5, 0], "intensity": 7,
         "spot": {"outerConeAngle": 1.65}},
        {"type": "directional", "color": [0.5, 0.25, 0.25], "intensity": 2},
    ]}});
    let scene = file.load().unwrap();
    let [point, spot, sun] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    let Light::Point(PointLight { position, near, range }) = point.light else {
        panic!("{point:?}")
    };
    assert_eq!((point.name.as_str(), position), ("light0", DVec3::Y * 10.0));
    assert!(range > 10.0 && range < 11.0, "to the farthest of the scene: {range}");
    assert!(near > 0.0 && near < 0.1);
    let Light::Spot(SpotLight { position, direction, half_angle_rad, near, range }) = spot.light
    else {
        panic!("{spot:?}")
    };
    assert_eq!((spot.name.as_str(), spot.color), ("lamp", Vec3::new(1.0, 0.5, 0.0)));
    assert_eq!(position, DVec3::Y * 10.0);
    assert!((direction - DVec3::NEG_Y).length() < 1e-6, "{direction}");
    assert!((half_angle_rad - 90f64.to_radians()).abs() < 1e-9, "as wide as may be");
    assert!(range > 10.0 && range < 11.0, "to the farthest of the scene: {range}");
    assert!(near > 0.0 && near < 0.1);
    let Light::Directional { direction } = sun.light else { panic!("{sun:?}") };
    assert!((direction - DVec3::NEG_Y).length() < 1e-6);
    assert_eq!((sun.color, sun.intensity), (Vec3::new(1.0, 0.5, 0.5), 1.0));
    assert_eq!(scene.default_light(), *point);
    let [notice] = notices(&scene)[..] else { panic!("{:?}", notices(&scene)) };
    assert!(notice.contains("outerConeAngle"), "{notice}");
}

#[test]
fn lamps_end_where_the_file_says_and_shadows_begin_nearby() {
    let ranges = [8.0, 1e30, 1e-30, 0.0, -5.0];
    let lights: Vec<Value> =
        ranges.iter().map(|range| json!({"type": "point", "range": range})).collect();
    let scene = lit_by(&json!(lights)).load().unwrap();
    let found = scene.lights.iter().map(|l| match l.light {
        Light::Point(point) => [point.near, point.range],
        other => panic!("{other:?}"),
    });
    let found: Vec<[f64; 2]> = found.collect();
    assert_eq!(found[0], [8e-3, 8.0]);
    let endless = found[4][1];
    assert!((10.0..11.0).contains(&endless), "{endless}");
    // The range may be large, but the scene ends earlier.
    assert_eq!(found[1], [1e-3 * endless, 1e12]);
    assert_eq!(found[3], found[4]);
    let camera = umbrage::Camera::look_at(umbrage::LookAt {
        eye: DVec3::Z * 9.0,
        target: DVec3::ZERO,
        up: DVec3::Y,
        fov_y_rad: 1.0,
        near: 0.1,
        far: 20.0,
        image: [64, 64],
    })
    .unwrap();
    for light in &scene.lights {
        let technique = umbrage::Technique::default();
        let mut planner = umbrage::Planner::new();
        let bounds = umbrage::Bounds::of_scene(scene.bounds());
        let plan = planner.plan(&camera, &[light.light], &bounds, &technique);
        assert!(plan.is_ok(), "{:?}: {plan:?}", light.light);
    }
}

#[test]
fn the_first_light_that_shines_is_the_scenes_own() {
    let point =
        |name: &str, intensity: f32| json!({"type": "point", "name": name, "intensity": intensity});
    let own = |lights: Value| lit_by(&lights).load().unwrap().default_light();
    let lights = json!([point("burnt out", 0.0), point("bulb", 3.0), {"type": "directional"}]);
    assert_eq!(own(lights).name, "bulb");
    // No light of the file has an intensity above 0, so the sun is used.
    let sun = own(json!([point("burnt out", 0.0)]));
    assert!(matches!(sun.light, Light::Directional { .. }), "{sun:?}");
}

#[test]
fn skins_stand_in_the_pose_of_their_joints() {
    let scene = skinned().load().unwrap();
    let (mesh, instance) = (&scene.meshes[0], scene.instances[0]);
    let world = |i: usize| instance.world_from_mesh.transform_point3(mesh.positions[i].as_dvec3());
    let far = DVec3::X * 1e6;
    assert!((world(0) - far).length() < 1e-6, "{}", world(0));
    // Joint 1 rotates x to y about (0, 1, 0), which takes (1,0,0) to (1,2,0). Vertex 1 goes half
    // that way.
    assert!((world(1) - far - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-6, "{}", world(1) - far);
    // The joint's own point (0, 1, 0) stays exact, although it is a million metres from the origin.
    assert!((world(2) - far - DVec3::Y).length() < 1e-6, "{}", world(2) - far);
    assert!(mesh.normals.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
}

#[test]
fn flat_nodes_are_left_out_and_empty_scenes_refused() {
    let file = || File::triangle().set("/scenes/0/nodes", json!([0, 1]));
    let flat = json!({"mesh": 0, "scale": [1, 0, 1]});
    let mut one = file();
    one.push("nodes", flat.clone());
    let scene = one.load().unwrap();
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(notices(&scene), ["nodes[1]: its transform flattens its mesh, left out"]);
    let mut both = file().set("/nodes/0", flat.clone());
    both.push("nodes", flat);
    assert_eq!(both.error(), "scene: there are no triangles to draw");
}

#[test]
fn broken_files_say_what_is_wrong_and_where() {
    let with_nan = |bad: f32| {
        let mut file = File::triangle();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, bad, 0.0, 0.0, 0.0, 1.0, 0.0]);
        file.primitive()["attributes"]["POSITION"] = json!(positions);
        file
    };
    let mut index = File::triangle();
    let indices = index.u16s("SCALAR", &[0, 1, 3]);
    index.primitive()["indices"] = json!(indices);
    let t = File::triangle;
    let cases: Vec<(File, &str)> = vec![
        (with_nan(f32::NAN), "position 1 is [NaN, 0, 0], must be finite"),
        (with_nan(f32::INFINITY), "must be finite"),
        (index, "index 2 is 3, there are 3 positions"),
        (t().set("/nodes/0/mesh", json!(7)), "nodes[0]: there is no meshes[7]"),
        (t().set("/scene", json!(3)), "scene: there is no scenes[3]"),
        (t().set("/scenes/0/nodes", json!([9])), "scenes: there is no nodes[9]"),
        (
            t().set("/meshes/0/primitives/0/attributes/POSITION", json!(99)),
            "POSITION: there is no accessors[99]",
        ),
        (
            t().set("/meshes/0/primitives/0/attributes/POSITION", json!(2)),
            "is Vec2, should be Vec3",
        ),
        (t().set("/meshes/0/primitives/0/indices", json!(0)), "must be unsigned integers"),
        (t().set("/meshes/0/primitives/0/material", json!(5)), "there is no materials[5]"),
        (t().set("/meshes/0/primitives/0/mode", json!(77)), "mode is unknown"),
        (t().set("/accessors/3/count", json!(4)), "4 elements from byte 0 on do not fit"),
        (t().set("/accessors/3/count", json!(u64::MAX)), "do not fit"),
        (t().set("/accessors/0/byteOffset", json!(u64::MAX)), "do not fit"),
        (t().set("/accessors/0/componentType", json!(1)), "componentType is unknown"),
        (t().set("/accessors/1/count", json!(2)), "has 3 positions but 2 normals"),
        (
            t().set("/accessors/0", json!({"count": 3, "componentType": 5126, "type": "VEC3"})),
            "has no bufferView",
        ),
        (
            t().set("/bufferViews/0/byteLength", json!(1u64 << 40)),
            "bufferViews[0]: 1099511627776 bytes",
        ),
        (t().set("/bufferViews/0/byteOffset", json!(u64::MAX)), "do not fit into the buffer's"),
        (t().set("/bufferViews/0/buffer", json!(8)), "there is no buffers[8]"),
        (t().set("/bufferViews/0/byteStride", json!(4)), "byteStride 4 is less than"),
        (t().set("/nodes/0/children", json!([0])), "among their own ancestors"),
        (
            t().set("/nodes", json!([{"children": [1]}, {"children": [0]}])),
            "among their own ancestors",
        ),
        (t().set("/nodes", json!([{"children": [1, 1]}, {}])), "already is a child of"),
        (t().set("/nodes/0/children", json!([4])), "there is no nodes[4]"),
        (t().set("/nodes/0/rotation", json!([0, 0, 0, 0])), "nodes[0].rotation: is no rotation"),
        (t().set("/nodes/0/matrix", json!(vec![0; 16])), "is not affine"),
        (t().set("/nodes/0/scale", json!([1e13, 1, 1])), "the world ends at 1e12 m"),
        (t().set("/asset/version", json!("1.0")), "asset.version: is \"1.0\""),
        (
            t().set("/extensionsRequired", json!(["KHR_draco_mesh_compression"])),
            "KHR_draco_mesh_compression is not supported",
        ),
        (t().set("/meshes", json!("none")), "JSON: is not glTF 2.0"),
    ];
    for (file, expected) in cases {
        let json = file.json.to_string();
        let error = file.error();
        assert!(error.contains(expected), "{error:?} should contain {expected:?}; {json}");
    }
    // Numbers beyond single precision are read as infinite or refused, depending on serde_json's
    // features.
    let error = t().set("/nodes/0/scale", json!([1e39, 1, 1])).error();
    let expected = ["nodes[0].scale: is not finite", "number out of range"];
    assert!(expected.iter().any(|e| error.contains(e)), "{error:?}");
}

#[test]
fn sparse_accessors_are_filled_in_or_refused() {
    let sparse = |at: u16, count: u64| {
        let mut file = File::triangle();
        file.primitive()["attributes"] = json!({"POSITION": 0});
        let indices = file.view(&at.to_le_bytes());
        let values = file.view(&[0u8, 0, 0x40, 0x40].repeat(3));
        file.json["accessors"][0] = json!({
            "componentType": 5126, "type": "VEC3", "count": count,
            "sparse": {"count": 1,
                "indices": {"bufferView": indices, "componentType": 5123},
                "values": {"bufferView": values}}
        });
        file
    };
    assert_eq!(
        sparse(1, 3).load().unwrap().meshes[0].positions,
        [Vec3::ZERO, Vec3::splat(3.0), Vec3::ZERO]
    );
    assert!(sparse(3, 3).error().contains("sparse index 3 is out of range"));
    let error = sparse(1, 1 << 40).error();
    assert!(error.contains("with 1099511627776 elements the scene would take"), "{error}");
}

#[test]
fn buffers_are_read_from_below_the_scenes_folder_only() {
    let folder = TempDir::new().unwrap();
    let below = folder.path().join("below");
    std::fs::create_dir(&below).unwrap();
    let file = File::triangle();
    let length = file.buffer.len();
    std::fs::write(folder.path().join("outside.bin"), &file.buffer).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder.path().join("outside.bin"), below.join("link.bin")).unwrap();
    let outside = folder.path().join("outside.bin");
    let absolute = outside.to_str().unwrap();
    #[cfg(unix)]
    pipe(&below.join("pipe.bin"));
    for uri in
        ["../outside.bin", "%2E%2E/outside.bin", "link.bin", absolute, "gone.bin", ".", "pipe.bin"]
    {
        let path = below.join("scene.gltf");
        let json = File::triangle().with_buffer(Some(uri), length).json;
        std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
        let error = load(&path).expect_err(uri).to_string();
        assert!(error.contains(&below.display().to_string()), "{error}");
    }
}

/// Makes a pipe. Whoever opens it waits for a writer.
#[cfg(unix)]
fn pipe(path: &Path) {
    let made = std::process::Command::new("mkfifo").arg(path).status().unwrap();
    assert!(made.success(), "{}: {made}", path.display());
}

/// Nothing waits for a pipe's writer or reads a device without end: neither the scene itself, nor
/// an image, nor the list of a scene's files.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_at_once() {
    let folder = TempDir::new().unwrap();
    let pipe_path = folder.path().join("pipe");
    pipe(&pipe_path);
    for path in [&pipe_path, Path::new("/dev/zero")] {
        let error = load(path).unwrap_err();
        assert!(matches!(error, SceneError::Read { .. }), "{error}");
        assert!(error.to_string().ends_with("is not a regular file"), "{error}");
        // Whoever prints the chain of causes does not repeat it.
        assert!(std::error::Error::source(&error).is_none());
    }
    let path = masked().set("/images/0", json!({"uri": "pipe"})).write(folder.path());
    let scene = load(&path).unwrap();
    assert!(notices(&scene)[0].contains("is not a regular file"), "{:?}", notices(&scene));
    let files = umbrage_scene::files(&path).unwrap();
    assert_eq!(files.len(), 2, "the scene and its buffer: {files:?}");
}

#[test]
fn files_that_are_none_get_an_error() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("x.glb");
    let good = File::triangle().glb();
    let long = {
        let mut long = good.clone();
        long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
        long
    };
    let short_buffer = {
        let file = File::triangle();
        let json = file.with_buffer(None, 1 << 20).json;
        serde_json::to_vec(&json).unwrap()
    };
    for bytes in [
        &b""[..],
        b"glTF",
        b"glTF\x02\0\0\0\0\0\0\0",
        b"{}",
        b"[1, 2",
        &good[..50],
        &long,
        &short_buffer,
    ] {
        std::fs::write(&path, bytes).unwrap();
        assert!(matches!(load(&path), Err(SceneError::Invalid { .. })), "{bytes:?}");
    }
    for path in [folder.path(), &folder.path().join("none.glb"), Path::new("")] {
        assert!(matches!(load(path), Err(SceneError::Read { .. })), "{}", path.display());
    }
    std::fs::write(&path, &good).unwrap();
    assert!(load(&path).is_ok());
}

/// As third-party scenes are in `fuzz.rs`.
#[test]
fn damaged_files_get_an_error_or_load_whole() {
    let lights =
        json!([{"type": "spot", "range": 9, "spot": {}}, {"type": "point", "color": [1, 0.5, 0]}]);
    let files = [
        ("triangle", File::triangle()),
        ("masked", masked()),
        ("lit", lit_by(&lights)),
        ("instanced", instanced()),
        ("skinned", skinned()),
    ];
    damage::damage(&files.map(|(name, file)| (name, file.glb())));
}
