//! Animations: closed forms, what poses restore, and damage.

mod common;
mod damage;

use common::{File, QUARTER, instanced, lit_by, notices, skinned};
use glam::{DAffine3, DQuat, DVec3, Vec3};
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use umbrage::Light;
use umbrage_scene::{LeftOut, Scene};

impl File {
    /// Adds a channel to the last animation, or to a first one, with keys at these times.
    fn animate(&mut self, node: usize, path: &str, how: &str, times: &[f32], values: &[f32]) {
        if self.json["animations"].is_null() {
            self.push("animations", json!({"channels": [], "samplers": []}));
        }
        let kind = match path {
            "rotation" => "VEC4",
            "weights" => "SCALAR",
            _ => "VEC3",
        };
        let [input, output] = [self.floats("SCALAR", times), self.floats(kind, values)];
        let animation = self.json["animations"].as_array_mut().unwrap().last_mut().unwrap();
        let samplers = animation["samplers"].as_array_mut().unwrap();
        samplers.push(json!({"input": input, "output": output, "interpolation": how}));
        let sampler = samplers.len() - 1;
        let channel = json!({"sampler": sampler, "target": {"node": node, "path": path}});
        animation["channels"].as_array_mut().unwrap().push(channel);
    }
}

const NO_TURN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const HALF: f32 = QUARTER as f32;

/// The triangle, which turns about z by 90° from 1 s to 3 s.
fn turning(how: &str) -> File {
    let mut file = File::triangle();
    let quarter = [0.0, 0.0, HALF, HALF];
    file.animate(0, "rotation", how, &[1.0, 3.0], &[NO_TURN, quarter].concat());
    file
}

/// The triangle, which two morph targets move: one by 1 m in x, and one by 2 m in y.
fn morphed() -> File {
    let mut file = File::triangle();
    let targets = [Vec3::X, 2.0 * Vec3::Y]
        .map(|step| json!({"POSITION": file.floats("VEC3", [step.to_array(); 3].as_flattened())}));
    file.primitive()["targets"] = json!(targets);
    file
}

fn corner(scene: &Scene, instance: usize, vertex: usize) -> DVec3 {
    let instance = &scene.instances[instance];
    let position = scene.meshes[instance.mesh].positions[vertex].as_dvec3();
    instance.world_from_mesh.transform_point3(position)
}

fn assert_near(found: DVec3, expected: DVec3) {
    assert!(found.distance(expected) < 1e-6, "{found}, expected {expected}");
}

#[test]
fn rotations_follow_the_great_circle_and_times_are_clamped() {
    let mut scene = turning("LINEAR").load().unwrap();
    assert_eq!(notices(&scene), [""; 0]);
    let [clip] = scene.animations.clips() else { panic!() };
    assert_eq!((clip.name.as_str(), clip.duration_s), ("animation0", 3.0));
    for (seconds, angle) in [
        (0.0, 0.0),
        (1.0, 0.0),
        (2.0, FRAC_PI_4),
        (2.5, 1.5 * FRAC_PI_4),
        (3.0, FRAC_PI_2),
        (-1.0, 0.0),
        (f64::NAN, 0.0),
        (f64::INFINITY, FRAC_PI_2),
    ] {
        scene.pose(Some(0), seconds);
        assert_near(corner(&scene, 0, 1), DVec3::new(angle.cos(), angle.sin(), 0.0));
    }
    let mut scene = turning("STEP").load().unwrap();
    scene.pose(Some(0), 2.9);
    assert_near(corner(&scene, 0, 1), DVec3::X);
    scene.pose(Some(0), 3.0);
    assert_near(corner(&scene, 0, 1), DVec3::Y);
    // The shorter way, also if the file has the other of both quaternions.
    let mut file = File::triangle();
    let quarter = [0.0, 0.0, -HALF, -HALF];
    file.animate(0, "rotation", "LINEAR", &[0.0, 2.0], &[NO_TURN, quarter].concat());
    let mut scene = file.load().unwrap();
    scene.pose(Some(0), 1.0);
    assert_near(corner(&scene, 0, 1), DVec3::new(QUARTER, QUARTER, 0.0));
}

/// Hermite's cubic of the specification, for which a cubic polynomial is its own spline.
#[test]
fn cubic_splines_reproduce_cubics() {
    let position = |t: f64| DVec3::new(t * t * t - t, 2.0 * t * t, 1.0 - t);
    let velocity = |t: f64| DVec3::new(3.0 * t * t - 1.0, 4.0 * t, -1.0);
    let times = [0.5f32, 1.0, 3.0];
    let values: Vec<f32> = times
        .iter()
        .flat_map(|&t| [velocity(t.into()), position(t.into()), velocity(t.into())])
        .flat_map(|v| v.as_vec3().to_array())
        .collect();
    let mut file = File::triangle();
    file.animate(0, "translation", "CUBICSPLINE", &times, &values);
    let mut scene = file.load().unwrap();
    for seconds in [0.5, 0.6, 1.0, 1.1, 2.0, 2.9, 3.0] {
        scene.pose(Some(0), seconds);
        assert_near(corner(&scene, 0, 0), position(seconds));
    }
    // Rotations are made unit quaternions.
    let zero = [0.0f32; 4];
    let quarter = [0.0, 0.0, HALF, HALF];
    let values = [zero, NO_TURN, zero, zero, quarter, zero].concat();
    let mut file = File::triangle();
    file.animate(0, "rotation", "CUBICSPLINE", &[0.0, 1.0], &values);
    let mut scene = file.load().unwrap();
    scene.pose(Some(0), 0.5);
    assert_near(corner(&scene, 0, 1), DVec3::new(QUARTER, QUARTER, 0.0));
}

#[test]
fn integers_stand_for_numbers_up_to_one() {
    let mut file = turning("LINEAR");
    let bytes = [0u8, 0, 0, 127, 0, 0, 90, 90];
    let output = file.accessor("VEC4", 5120, 8, &bytes);
    file.json["accessors"][output]["normalized"] = json!(true);
    let mut scene = file.set("/animations/0/samplers/0/output", json!(output)).load().unwrap();
    scene.pose(Some(0), 3.0);
    assert_near(corner(&scene, 0, 1), DVec3::Y);
}

/// A node moves what hangs below it, copies of its mesh, its lights and its cameras.
#[test]
fn nodes_move_all_that_hangs_on_them() {
    let mut file = instanced();
    file.push("nodes", json!({"children": [0, 2], "translation": [0, 0, 1]}));
    file.push("nodes", json!({"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    file.json["scenes"][0]["nodes"] = json!([1]);
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}));
    let lights = json!([{"type": "spot", "spot": {}}]);
    let mut file = file.set("/extensions", json!({"KHR_lights_punctual": {"lights": lights}}));
    file.json["extensionsRequired"] = json!([]);
    let turned = [0.0, HALF, 0.0, HALF];
    file.animate(1, "rotation", "LINEAR", &[0.0, 1.0], &[NO_TURN, turned].concat());
    file.animate(1, "translation", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 1.0, 0.0, 4.0, 1.0]);
    let mut scene = file.load().unwrap();
    let rest = (scene.cameras.clone(), scene.lights.clone());
    assert!(scene.pose(Some(0), 0.0).is_empty(), "the clip begins at rest");
    let moved = scene.pose(Some(0), 1.0);
    assert_eq!((moved.instances, moved.cameras, moved.lights), (vec![0, 1], vec![0], vec![0]));
    assert_eq!(moved.meshes, [0; 0]);
    let at = DVec3::new(0.0, 2.0, 1.0);
    // A quarter turn about y takes x to −z, and the second copy is 5 m away and twice as large.
    assert_near(corner(&scene, 0, 1), at - DVec3::Z);
    assert_near(corner(&scene, 1, 1), at - 7.0 * DVec3::Z);
    let Light::Spot(spot) = scene.lights[0].light else { panic!() };
    assert_near(spot.position, at);
    assert_near(spot.direction, DVec3::NEG_X);
    let camera = &scene.cameras[0];
    assert_near(camera.eye, at);
    assert_near((camera.target - at).normalize(), DVec3::NEG_X);
    assert_eq!((camera.name.as_str(), camera.near), ("camera0", rest.0[0].near));
    scene.pose(None, 0.0);
    assert_eq!((scene.cameras, scene.lights), rest);
}

/// The second joint of [`skinned`] bends from 0° to 90°, a million metres from the origin.
#[test]
fn skins_bend() {
    let mut file = skinned();
    file.animate(2, "rotation", "LINEAR", &[0.0, 1.0], &[NO_TURN, [0.0, 0.0, HALF, HALF]].concat());
    let mut scene = file.load().unwrap();
    let rest = scene.clone();
    let moved = scene.pose(Some(0), 1.0);
    assert!(moved.is_empty(), "the file's pose is that of the end: {moved:?}");
    let moved = scene.pose(Some(0), 0.0);
    assert_eq!((moved.instances, moved.meshes), (vec![0], vec![0]));
    // Without a bend both joints leave the triangle where it is bound.
    let foot = DVec3::new(1e6, 0.0, 0.0);
    for (vertex, bound) in [DVec3::ZERO, DVec3::X, DVec3::Y].into_iter().enumerate() {
        assert_near(corner(&scene, 0, vertex), foot + bound);
    }
    let angle = 0.3 * FRAC_PI_2;
    scene.pose(Some(0), 0.3);
    // Half of the second vertex follows the joint, which bends about (0, 1).
    let bent = DVec3::Y + DQuat::from_rotation_z(angle) * (DVec3::X - DVec3::Y);
    assert_near(corner(&scene, 0, 1), foot + (bent + DVec3::X) / 2.0);
    assert_near(corner(&scene, 0, 2), foot + DVec3::Y);
    scene.pose(None, 0.0);
    assert_same(&scene, &rest);
}

#[test]
fn weights_of_morph_targets_change() {
    let mut file = morphed();
    file.json["meshes"][0]["weights"] = json!([0.25, 0.0]);
    // Of two nodes that draw the mesh, one keeps its weights.
    file.push("nodes", json!({"mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.animate(0, "weights", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 1.0, 0.5]);
    let mut scene = file.load().unwrap();
    let rest = scene.clone();
    assert_eq!(scene.meshes.len(), 2);
    assert_near(corner(&scene, 0, 0), 0.25 * DVec3::X);
    let moved = scene.pose(Some(0), 1.0);
    assert_eq!((moved.instances, moved.meshes), (vec![0], vec![0]));
    assert_near(corner(&scene, 0, 0), DVec3::new(0.5, 0.5, 0.0));
    assert_near(corner(&scene, 1, 0), 0.25 * DVec3::X);
    scene.pose(None, 0.0);
    assert_same(&scene, &rest);
}

/// Normals follow the triangles that targets bend.
#[test]
fn flat_normals_are_those_of_the_pose() {
    let mut file = File::triangle();
    file.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let lifted = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    file.primitive()["targets"] = json!([{"POSITION": lifted}]);
    file.animate(0, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    let mut scene = file.load().unwrap();
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
    scene.pose(Some(0), 1.0);
    let expected = Vec3::new(-1.0, 0.0, 1.0).normalize();
    assert!(scene.meshes[0].normals.iter().all(|n| n.distance(expected) < 1e-6));
}

/// What a clip flattens is not there, whatever the scene leaves out, and comes back.
#[test]
fn flattened_instances_are_absent() {
    let mut file = File::triangle();
    file.push("nodes", json!({"mesh": 0, "name": "popping", "scale": [0, 0, 0]}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scales = [[0.0f32; 3], [1.0; 3], [1.0, 1.0, 0.0]].concat();
    file.animate(1, "scale", "STEP", &[0.0, 1.0, 2.0], &scales);
    let mut scene = file.load().unwrap();
    let is_there = |scene: &Scene| (scene.roles.of(1).is_seen, scene.roles.of(1).casts);
    assert_eq!(scene.instances.len(), 2);
    assert_eq!((is_there(&scene), scene.drawn_triangles()), ((false, false), 1));
    damage::assert_sound(&scene, "at rest");
    scene.pose(Some(0), 1.0);
    assert_eq!((is_there(&scene), scene.drawn_triangles()), ((true, true), 2));
    assert!(scene.roles.are_default());
    scene.leave_out(&[1], LeftOut::Casting);
    assert_eq!(is_there(&scene), (true, false));
    scene.pose(Some(0), 2.0);
    assert_eq!(is_there(&scene), (false, false));
    damage::assert_sound(&scene, "flat");
    scene.pose(Some(0), 1.0);
    assert_eq!(is_there(&scene), (true, false));
    // So are those beyond the world's end.
    let mut file = File::triangle();
    file.push("nodes", json!({"mesh": 0}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.animate(1, "translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 3e38, 0.0, 0.0]);
    let mut scene = file.load().unwrap();
    scene.pose(Some(0), 1.0);
    assert_eq!(is_there(&scene), (false, false));
    damage::assert_sound(&scene, "beyond the end");
}

#[test]
fn hidden_nodes_move_but_stay_hidden() {
    let mut file = File::triangle();
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    file.push("nodes", json!({"mesh": 0, "extensions": hidden}));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    file.animate(1, "translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let mut scene = file.load().unwrap();
    assert!(scene.pose(Some(0), 0.5).is_empty());
    assert_eq!(scene.instances.len(), 1);
}

#[test]
fn clips_are_chosen_by_name_or_number() {
    let mut file = turning("LINEAR");
    file.json["animations"][0]["name"] = json!("Turn");
    file.push("animations", json!({"channels": [], "samplers": []}));
    file.push("animations", json!({"name": "Go", "channels": [], "samplers": []}));
    file.animate(0, "translation", "LINEAR", &[0.0, 0.5], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let mut scene = file.load().unwrap();
    assert_eq!(notices(&scene), ["animations[1]: nothing of it can be played, left out"]);
    let choices = scene.animation_choices();
    assert_eq!(
        [choices.find("Turn"), choices.find("#2"), choices.find("Go")],
        [Some(0), Some(1), Some(1)]
    );
    assert_eq!(choices.find("#3"), None);
    // Nothing of the one clip is left in the other, and a clip that is not there is none.
    scene.pose(Some(0), 3.0);
    scene.pose(Some(1), 0.5);
    assert_near(corner(&scene, 0, 1), 2.0 * DVec3::X);
    scene.pose(Some(7), 0.5);
    assert_near(corner(&scene, 0, 1), DVec3::X);
}

/// Whether two scenes are the same to the bit, apart from animations.
fn assert_same(a: &Scene, b: &Scene) {
    let bits =
        |v: &[Vec3]| v.iter().flat_map(|v| v.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        assert_eq!(bits(&a.positions), bits(&b.positions));
        assert_eq!(bits(&a.normals), bits(&b.normals));
    }
    let bits = |t: &DAffine3| t.to_cols_array().map(f64::to_bits);
    for (a, b) in a.instances.iter().zip(&b.instances) {
        assert_eq!((a.mesh, bits(&a.world_from_mesh)), (b.mesh, bits(&b.world_from_mesh)));
    }
    assert_eq!((&a.roles, &a.cameras, &a.lights), (&b.roles, &b.cameras, &b.lights));
}

/// All that a clip can do at once: skins, targets, copies, flat scales, lights.
fn busy() -> File {
    let mut file = skinned();
    let steps = file.floats("VEC3", &[0.1, -0.0, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]);
    file.primitive()["targets"] = json!([{"POSITION": steps, "NORMAL": steps}]);
    let at = file.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": at}}});
    let parent = file.push("nodes", json!({"children": [4, 5], "rotation": [0.1, 0.2, 0.3, 0.9]}));
    file.push("nodes", json!({"mesh": 0, "weights": [0.7], "extensions": copies}));
    file.push("nodes", json!({"mesh": 0, "scale": [0.3, 0.7, 0.9]}));
    file.json["scenes"][0]["nodes"] = json!([0, 1, parent]);
    let turn = [NO_TURN, [0.5, -0.5, 0.5, 0.5]].concat();
    file.animate(2, "rotation", "LINEAR", &[0.0, 1.0], &turn);
    file.animate(parent, "translation", "LINEAR", &[0.0, 2.0], &[0.1, 0.2, 0.3, 4.0, -5.0, 6.0]);
    file.animate(4, "weights", "LINEAR", &[0.0, 2.0], &[0.0, 3.0]);
    file.animate(0, "weights", "STEP", &[0.5, 1.0], &[0.3, 0.0]);
    file.animate(5, "scale", "LINEAR", &[0.0, 1.0], &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    file
}

#[test]
fn the_pose_of_the_file_comes_back_to_the_bit() {
    let mut scene = busy().load().unwrap();
    let rest = scene.clone();
    for seconds in [0.0, 0.3, 0.5, 1.0, 1.7, 2.0] {
        assert!(!scene.pose(Some(0), seconds).is_empty());
        let posed = scene.clone();
        damage::assert_sound(&scene, "posed");
        assert!(scene.pose(Some(0), seconds).is_empty(), "the same pose again");
        assert!(!scene.pose(None, 1.0).is_empty());
        assert_same(&scene, &rest);
        // A pose depends on its time alone.
        let mut other = rest.clone();
        other.pose(Some(0), 0.9);
        other.pose(Some(0), seconds);
        assert_same(&other, &posed);
    }
    // A file without its animations loads the same.
    let mut still = busy();
    still.json.as_object_mut().unwrap().remove("animations");
    let still = still.load().unwrap();
    assert_eq!(still.instances.len(), rest.instances.len());
    for (a, b) in still.instances.iter().zip(&rest.instances) {
        assert_eq!(a.world_from_mesh, b.world_from_mesh);
        assert_eq!(still.meshes[a.mesh].positions, rest.meshes[b.mesh].positions);
        assert_eq!(still.meshes[a.mesh].normals, rest.meshes[b.mesh].normals);
    }
}

#[test]
fn damage_is_told_or_left_out() {
    let wrong = |pointer: &str, value: Value| turning("LINEAR").set(pointer, value).error();
    let told = wrong("/animations/0/channels/0/target/node", json!(7));
    assert_eq!(told, "animations[0].channels[0]: there is no nodes[7]");
    let told = wrong("/animations/0/channels/0/sampler", json!(7));
    assert_eq!(told, "animations[0].channels[0]: there is no sampler 7");
    let told = wrong("/animations/0/samplers/0/input", json!(70));
    assert_eq!(told, "animations[0].channels[0]: there is no accessors[70]");
    let told = wrong("/animations/0/samplers/0/output", json!(0));
    assert_eq!(told, "animations[0].channels[0] (accessors[0]): is Vec3, should be Vec4");

    let left_out = |mut file: File, why: &str| {
        // Another channel of the clip still plays.
        file.animate(0, "scale", "STEP", &[0.0], &[2.0, 2.0, 2.0]);
        let mut scene = file.load().unwrap();
        let expected = format!("animations[0].channels[0]: cannot be played, left out: {why}");
        assert_eq!(notices(&scene), [expected]);
        scene.pose(Some(0), 2.0);
        assert_near(corner(&scene, 0, 1), 2.0 * DVec3::X);
    };
    let keys = |path: &str, how: &str, times: &[f32], values: &[f32]| {
        let mut file = File::triangle();
        file.animate(0, path, how, times, values);
        file
    };
    let moves = |times: &[f32], values: &[f32]| keys("translation", "LINEAR", times, values);
    left_out(moves(&[1.0, 0.5], &[0.0; 6]), "has keys whose times do not ascend");
    left_out(moves(&[0.0, 1.0], &[0.0; 9]), "has another number of values than its keys need");
    left_out(
        keys("scale", "CUBICSPLINE", &[0.0], &[0.0; 3]),
        "has another number of values than its keys need",
    );
    left_out(moves(&[], &[]), "has no keys");
    let not_finite = "has times or values that are not finite";
    left_out(moves(&[0.0, f32::NAN], &[0.0; 6]), not_finite);
    left_out(moves(&[0.0, f32::INFINITY], &[0.0; 6]), not_finite);
    left_out(moves(&[0.0], &[0.0, f32::NAN, 0.0]), not_finite);
    left_out(keys("rotation", "STEP", &[0.0], &[0.0; 4]), "has rotations that are none");
    left_out(keys("weights", "STEP", &[0.0], &[1.0]), "its node has no morph targets");
    let unknown = "its path or interpolation is unknown";
    left_out(keys("scale", "SMOOTH", &[0.0], &[1.0; 3]), unknown);
    let path = "/animations/0/channels/0/target/path";
    left_out(turning("STEP").set(path, json!("pointer")), unknown);

    let mut file = turning("LINEAR");
    file.json["nodes"][0]["matrix"] = json!(glam::Mat4::IDENTITY.to_cols_array());
    let scene = file.load().unwrap();
    assert_eq!(scene.animations.clips(), []);
    assert!(notices(&scene)[0].ends_with("its node has a matrix"));
}

/// What else animations may change is told of as an extension that is not read.
#[test]
fn channels_without_a_node_are_left_out() {
    let mut file = turning("LINEAR");
    let pointer = json!({"pointer": "/materials/0/alphaCutoff"});
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": pointer}});
    let channels = file.json["animations"][0]["channels"].as_array_mut().unwrap();
    channels.insert(0, json!({"sampler": 0, "target": target}));
    let mut scene = file.set("/extensionsUsed", json!(["KHR_animation_pointer"])).load().unwrap();
    let told =
        "extensionsUsed: KHR_animation_pointer: not supported: what they describe is left out";
    assert_eq!(notices(&scene), [told]);
    scene.pose(Some(0), 3.0);
    assert_near(corner(&scene, 0, 1), DVec3::Y);
}

/// Files damaged in any way load and can be posed at any time, or give an error.
#[test]
fn damaged_files_can_be_posed() {
    let lamps = json!([{"type": "spot", "spot": {}}]);
    let mut lit = lit_by(&lamps);
    lit.animate(1, "translation", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.glb");
    let mut damage = damage::Damage(5);
    let (mut posed, mut refused) = (0, 0);
    for file in [busy(), lit, turning("CUBICSPLINE"), turning("LINEAR")].map(File::glb) {
        for round in 0..400 {
            std::fs::write(&path, damage.apply(&file, round)).unwrap();
            let Ok(mut scene) = umbrage_scene::load(&path) else {
                refused += 1;
                continue;
            };
            let rest = scene.clone();
            for clip in 0..scene.animations.clips().len() {
                let end = scene.animations.clips()[clip].duration_s;
                assert!(end.is_finite() && end >= 0.0);
                for share in [0.0, 0.4, 1.0] {
                    scene.pose(Some(clip), share * end);
                    damage::assert_sound(&scene, &format!("round {round} at {share}"));
                    posed += 1;
                }
            }
            scene.pose(None, 0.0);
            assert_same(&scene, &rest);
        }
    }
    assert!(posed > 500 && refused > 200, "{posed} posed, {refused} refused");
}
