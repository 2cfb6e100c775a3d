//! What glTF allows and what exporters write though glTF forbids it: it is read, or a notice says
//! that it is not.

mod common;

use common::{File, QUARTER, lit_by, masked, notices, skinned};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use umbrage_scene::{Alpha, Sampling, Scene, load};

/// The notices of a scene that contain `text`.
fn with_text<'a>(scene: &'a Scene, text: &str) -> Vec<&'a str> {
    notices(scene).into_iter().filter(|n| n.contains(text)).collect()
}

#[test]
fn textures_without_an_image_are_left_out() {
    for texture in [
        json!({}),
        json!({"sampler": 0}),
        json!({"extensions": {"KHR_texture_basisu": {"source": 0}}}),
        json!({"extensions": {"EXT_texture_webp": {"source": 0}}, "sampler": 0}),
    ] {
        let scene = masked().set("/textures/0", texture.clone()).load().unwrap();
        assert_eq!(scene.materials[0].base_color_texture, None, "{texture}");
        assert_eq!(scene.materials[0].alpha, Alpha::Mask { cutoff: 0.4 }, "{texture}");
        assert_eq!(scene.meshes[0].uvs, [], "{texture}");
        let [notice] = notices(&scene)[..] else { panic!("{:?}", notices(&scene)) };
        assert!(notice.starts_with("textures[0]: has no PNG or JPEG image"), "{notice}");
    }
    let error = masked().set("/textures/0/source", json!(9)).error();
    assert_eq!(error, "textures[0]: there is no images[9]");
}

#[test]
fn cutoffs_above_one_stay_above_one() {
    for (written, read) in [(1.5, 1.5), (1.0, 1.0), (0.0, 0.0), (-3.0, 0.0)] {
        let scene = masked().set("/materials/0/alphaCutoff", json!(written)).load().unwrap();
        assert_eq!(scene.materials[0].alpha, Alpha::Mask { cutoff: read });
    }
}

#[test]
fn samplers_choose_between_nearest_and_linear() {
    let sampling = |sampler: Value| {
        let scene = masked().set("/samplers/0", sampler).load().unwrap();
        let told = !with_text(&scene, "samplers[0]: minFilter is not used").is_empty();
        assert_eq!(notices(&scene).len(), usize::from(told));
        (scene.textures[0].sampling, told)
    };
    let (linear, nearest) = (Sampling::Linear, Sampling::Nearest);
    assert_eq!(sampling(json!({})), (linear, false));
    assert_eq!(sampling(json!({"magFilter": 9728, "minFilter": 9728})), (nearest, false));
    assert_eq!(sampling(json!({"magFilter": 9728, "minFilter": 9986})), (nearest, false));
    assert_eq!(sampling(json!({"magFilter": 9729, "minFilter": 9987})), (linear, false));
    assert_eq!(sampling(json!({"magFilter": 9728, "minFilter": 9987})), (nearest, true));
    assert_eq!(sampling(json!({"magFilter": 9729, "minFilter": 9728})), (linear, true));
    // Only one of them is given.
    assert_eq!(sampling(json!({"magFilter": 9728})), (nearest, false));
    assert_eq!(sampling(json!({"minFilter": 9984})), (nearest, false));
    assert_eq!(sampling(json!({"minFilter": 9985})), (linear, false));
    // The same image, sampled in two ways, is two textures.
    let mut file = masked();
    file.push("samplers", json!({"magFilter": 9728}));
    file.push("textures", json!({"source": 0, "sampler": 1}));
    let both = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}});
    file.push("materials", both);
    let mut other = file.primitive().clone();
    other["material"] = json!(1);
    file.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
    let scene = file.load().unwrap();
    let samplings: Vec<_> = scene.textures.iter().map(|t| t.sampling).collect();
    assert_eq!(samplings, [linear, nearest]);
}

/// The masked triangle with colours of its vertices.
fn colored(kind: &str, component: u32, normalized: bool, bytes: &[u8]) -> File {
    let mut file = masked();
    let n = if kind == "VEC3" { 9 } else { 12 };
    let colors = file.accessor(kind, component, n, bytes);
    file.json["accessors"][colors]["normalized"] = json!(normalized);
    file.primitive()["attributes"]["COLOR_0"] = json!(colors);
    file
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn vertex_alpha_counts_where_materials_are_masked() {
    let white = |alphas: [f32; 3]| bytes(&alphas.map(|a| [1.0, 1.0, 1.0, a]).concat());
    let float = |alphas| colored("VEC4", 5126, false, &white(alphas));
    let scene = float([0.25, 1.0, 0.5]).load().unwrap();
    assert_eq!((&scene.meshes[0].alphas[..], notices(&scene)), (&[0.25, 1.0, 0.5][..], vec![]));
    // As integers, and out of range.
    let scene = colored("VEC4", 5121, true, &[255, 255, 255, 0, 255, 255, 255, 51, 0, 0, 0, 255]);
    let scene = scene.load().unwrap();
    assert_eq!(scene.meshes[0].alphas, [0.0, 0.2, 1.0]);
    assert_eq!(with_text(&scene, "only their alpha is used").len(), 1);
    let scene = float([-1.0, 7.0, f32::NAN]).load().unwrap();
    assert_eq!(scene.meshes[0].alphas, [0.0, 1.0, 1.0]);
    assert_eq!(with_text(&scene, "3 alphas of vertices are not within 0 and 1").len(), 1);
    // Alphas of 1 change nothing, and colours without alpha have 1.
    assert_eq!(float([1.0; 3]).load().unwrap().meshes[0].alphas, [0.0; 0]);
    let scene = colored("VEC3", 5126, false, &bytes(&[0.5; 9])).load().unwrap();
    assert_eq!(scene.meshes[0].alphas, [0.0; 0]);
    assert_eq!(with_text(&scene, "vertex colours are not shown").len(), 1);
    // Opaque materials have no alpha; translucent ones are masked.
    let mode = |mode| float([0.25; 3]).set("/materials/0/alphaMode", json!(mode)).load().unwrap();
    assert_eq!(mode("OPAQUE").meshes[0].alphas, [0.0; 0]);
    assert_eq!(mode("BLEND").meshes[0].alphas, [0.25; 3]);
    // Flat shading gives each triangle vertices of its own, which keep their alpha.
    let mut flat = float([0.25, 1.0, 0.5]);
    let indices = flat.u16s("SCALAR", &[0, 1, 2, 2, 1, 0]);
    flat.primitive()["indices"] = json!(indices);
    flat.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let alphas = &flat.load().unwrap().meshes[0].alphas;
    assert_eq!(alphas, &[0.25, 1.0, 0.5, 0.5, 1.0, 0.25]);
    let mut short = float([0.25; 3]);
    let colors = short.floats("VEC4", &[0.5; 8]);
    short.primitive()["attributes"]["COLOR_0"] = json!(colors);
    assert!(short.error().contains("has 3 positions but 2 colours"));
}

/// The triangle shown, and below a hidden node another triangle with a light and a camera on one
/// node.
fn hidden(visible: &Value) -> File {
    let lights = json!([{"type": "point"}, {"type": "point", "name": "shown"}]);
    let mut file = lit_by(&lights);
    file.json["scenes"][0]["nodes"] = json!([0, 2, 3]);
    file.push("nodes", json!({"children": [4]}));
    file.json["nodes"][3]["extensions"] = json!({"KHR_node_visibility": {"visible": visible}});
    // Being visible does not help a node that is below a hidden one.
    let below = json!({"mesh": 0, "camera": 0, "children": [1], "name": "below",
        "extensions": {"KHR_node_visibility": {"visible": true}}});
    file.push("nodes", below);
    let perspective = json!({"yfov": 1, "znear": 0.1, "zfar": 100});
    file.push("cameras", json!({"type": "perspective", "perspective": perspective}));
    file.json["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual"]);
    file.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
    file
}

#[test]
fn hidden_nodes_are_not_there_with_all_below_them() {
    let scene = hidden(&json!(false)).load().unwrap();
    assert_eq!((scene.instances.len(), notices(&scene)), (1, vec![]));
    let lights: Vec<&str> = scene.lights.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(lights, ["shown"]);
    // The extension says that it does not affect cameras.
    assert_eq!(scene.cameras.len(), 1);
    for visible in [json!(true), Value::Null] {
        let mut file = hidden(&visible);
        if visible.is_null() {
            file.json["nodes"][3]["extensions"] = json!({"KHR_node_visibility": {}});
        }
        let scene = file.load().unwrap();
        assert_eq!((scene.instances.len(), scene.lights.len()), (2, 2), "{visible}");
    }
    let error = hidden(&json!("no")).error();
    let place = "nodes[3].extensions.KHR_node_visibility.visible: must be true or false";
    assert_eq!(error, place);
    // Joints move a mesh whether they show or not.
    let visibility = json!({"KHR_node_visibility": {"visible": false}});
    let [shown, hidden] = [skinned(), skinned().set("/nodes/1/extensions", visibility)];
    let [shown, hidden] = [shown, hidden].map(|file| file.load().unwrap());
    assert_eq!(shown.meshes[0].positions, hidden.meshes[0].positions);
}

#[test]
fn all_sets_of_joints_move_a_mesh() {
    let mut file = skinned();
    // The first set has the first joint with weight 1/4, the second set the other joint with 3/4.
    let identity = glam::Mat4::IDENTITY.to_cols_array();
    let binds = file.floats("MAT4", &[identity, identity].concat());
    file.json["skins"][0]["inverseBindMatrices"] = json!(binds);
    file.json["nodes"][1] = json!({});
    file.json["nodes"][2] = json!({"translation": [4, 0, 0]});
    let [first, second] = [[0; 12], [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]];
    let [first, second] = [first, second].map(|joints| file.u16s("VEC4", &joints));
    let weights = |w: f32| [w, 0.0, 0.0, 0.0].repeat(3);
    let [quarter, rest] = [0.25, 0.75].map(|w| file.floats("VEC4", &weights(w)));
    for (set, joints, weights) in [(0, first, quarter), (1, second, rest)] {
        file.primitive()["attributes"][format!("JOINTS_{set}")] = json!(joints);
        file.primitive()["attributes"][format!("WEIGHTS_{set}")] = json!(weights);
    }
    let moved = |scene: &Scene| {
        let origin = scene.instances[0].world_from_mesh.translation;
        origin + scene.meshes[0].positions[0].as_dvec3()
    };
    let mut lone = skinned();
    lone.json.clone_from(&file.json);
    lone.buffer.clone_from(&file.buffer);
    let scene = file.load().unwrap();
    assert_eq!((moved(&scene), notices(&scene)), (DVec3::X * 3.0, vec![]));
    lone.primitive()["attributes"].as_object_mut().unwrap().remove("WEIGHTS_1");
    let scene = lone.load().unwrap();
    assert_eq!(moved(&scene), DVec3::ZERO);
    assert_eq!(with_text(&scene, "joints without weights").len(), 1);
}

/// The triangle with two morph targets: 2 along x, in floats, and 1 along y, in bytes. The second
/// also turns the normals.
fn morphed() -> File {
    let mut file = File::triangle();
    let right = file.floats("VEC3", &[2.0, 0.0, 0.0].repeat(3));
    let up = file.accessor("VEC3", 5120, 9, &[0, 127, 0].repeat(3));
    file.json["accessors"][up]["normalized"] = json!(true);
    let turn = file.floats("VEC3", &[0.0, 1.0, -1.0].repeat(3));
    let targets = json!([{"POSITION": right}, {"POSITION": up, "NORMAL": turn}]);
    file.primitive()["targets"] = targets;
    file
}

#[test]
fn morph_targets_apply_by_the_nodes_weights_or_else_the_meshs() {
    let first = |file: File| {
        let scene = file.load().unwrap();
        assert_eq!(notices(&scene), [""; 0]);
        (scene.meshes[0].positions[0], scene.meshes[0].normals[0])
    };
    assert_eq!(first(morphed()), (Vec3::ZERO, Vec3::Z));
    let by_mesh = || morphed().set("/meshes/0/weights", json!([0.5, 1.0]));
    assert_eq!(first(by_mesh()), (Vec3::new(1.0, 1.0, 0.0), Vec3::Y));
    let by_node = |weights| by_mesh().set("/nodes/0/weights", weights);
    assert_eq!(first(by_node(json!([-1.0, 0.0]))), (Vec3::NEG_X * 2.0, Vec3::Z));
    assert_eq!(first(by_node(json!([0.0, 0.0]))), (Vec3::ZERO, Vec3::Z));
    // Without normals, the morphed triangles are shaded flat.
    let mut flat = by_mesh();
    flat.primitive()["attributes"].as_object_mut().unwrap().remove("NORMAL");
    assert_eq!(flat.load().unwrap().meshes[0].normals, [Vec3::Z; 3]);
    // A target may be sparse, without any data of its own for the other vertices.
    let mut sparse = by_mesh();
    let at = sparse.view(&1u16.to_le_bytes());
    let value = sparse.view(&bytes(&[0.0, 0.0, 3.0]));
    sparse.json["accessors"][4] = json!({
        "componentType": 5126, "type": "VEC3", "count": 3,
        "sparse": {"count": 1, "indices": {"bufferView": at, "componentType": 5123},
                   "values": {"bufferView": value}}
    });
    let positions = sparse.load().unwrap().meshes[0].positions.clone();
    assert_eq!(positions[..2], [Vec3::Y, Vec3::new(1.0, 1.0, 1.5)]);
}

#[test]
fn nodes_share_a_morphed_mesh_if_their_weights_agree() {
    let mut file = morphed().set("/scenes/0/nodes", json!([0, 1, 2, 3]));
    for weights in [json!([1.0, 0.0]), json!([1.0, 0.0]), json!([0.0, 0.0])] {
        file.push("nodes", json!({"mesh": 0, "weights": weights}));
    }
    let scene = file.load().unwrap();
    let meshes: Vec<usize> = scene.instances.iter().map(|i| i.mesh).collect();
    assert_eq!(meshes[1], meshes[2]);
    let x = meshes.iter().map(|&m| scene.meshes[m].positions[0].x).collect::<Vec<_>>();
    assert_eq!(x, [0.0, 2.0, 2.0, 0.0]);
}

#[test]
fn morph_targets_that_do_not_fit_are_told_or_refused() {
    for weights in [json!([1.0]), json!([1.0, 0.0, 5.0])] {
        let scene = morphed().set("/nodes/0/weights", weights).load().unwrap();
        assert_eq!(scene.meshes[0].positions[0], Vec3::X * 2.0);
        assert_eq!(with_text(&scene, "not one weight for each morph target").len(), 1);
    }
    let mut short = morphed().set("/nodes/0/weights", json!([1.0, 1.0]));
    let two = short.floats("VEC3", &[0.0; 6]);
    short.primitive()["targets"][0]["POSITION"] = json!(two);
    let error = short.error();
    assert!(error.contains("targets[0].POSITION: has 2 elements for 3 vertices"), "{error}");
    let error = morphed().set("/nodes/0/weights", json!([1e38, 1e38])).error();
    assert!(error.contains("world ends"), "{error}");
}

#[test]
fn skins_move_what_was_morphed() {
    let mut file = skinned();
    let up = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    file.primitive()["targets"] = json!([{"POSITION": up}]);
    file.json["nodes"][0]["weights"] = json!([2.0]);
    let [plain, morphed] = [skinned().load().unwrap(), file.load().unwrap()];
    for (a, b) in plain.meshes[0].positions.iter().zip(&morphed.meshes[0].positions) {
        assert!((*a + Vec3::Z * 2.0).distance(*b) < 1e-6, "{a} {b}");
    }
}

#[test]
fn byte_order_marks_are_skipped() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = File::triangle().write(folder.path());
    let mark = b"\xef\xbb\xbf";
    let text = std::fs::read(&path).unwrap();
    std::fs::write(&path, [mark, &text[..]].concat()).unwrap();
    let plain = File::triangle().load().unwrap();
    let scene = load(&path).unwrap();
    assert_eq!(scene.meshes[0].positions, plain.meshes[0].positions);
    assert_eq!(notices(&scene), ["JSON: begins with a byte order mark, which is skipped"]);
    // In a binary file it would begin the JSON chunk.
    let glb = File::triangle().glb();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json = [mark, &glb[20..20 + length], b" "].concat();
    let chunk = [&(json.len() as u32).to_le_bytes()[..], b"JSON", &json, &glb[20 + length..]];
    let chunk = chunk.concat();
    let whole = [&b"glTF\x02\0\0\0"[..], &(12 + chunk.len() as u32).to_le_bytes(), &chunk];
    std::fs::write(&path, whole.concat()).unwrap();
    assert_eq!(notices(&load(&path).unwrap()), notices(&scene));
    // The mark alone is no file.
    std::fs::write(&path, mark).unwrap();
    assert!(load(&path).is_err());
}

#[test]
fn matrices_off_by_rounding_are_put_right() {
    let with_row = |row: [f64; 4]| {
        let mut matrix =
            [2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 5.0, 0.0, 0.0, 1.0];
        for (k, value) in row.into_iter().enumerate() {
            matrix[4 * k + 3] = value;
        }
        File::triangle().set("/nodes/0/matrix", json!(matrix))
    };
    let exact = with_row([0.0, 0.0, 0.0, 1.0]).load().unwrap();
    assert_eq!(notices(&exact), [""; 0]);
    for row in [[0.0, 0.0, 0.0, 1.000_002_1], [0.0, 0.0, 0.0, 0.999_99], [1e-7, -3e-6, 2e-5, 1.0]] {
        let scene = with_row(row).load().unwrap();
        assert_eq!(scene.instances, exact.instances);
        assert_eq!(with_text(&scene, "nodes[0].matrix: its last row is off by rounding").len(), 1);
    }
    for row in [[0.0, 0.0, 0.0, 2.0], [0.0, 0.01, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]] {
        assert!(with_row(row).error().contains("nodes[0].matrix: is not affine"));
    }
    // The matrices of skins are treated alike.
    let with_bind = |w: f32| {
        let mut file = skinned();
        let mut bind = glam::Mat4::IDENTITY.to_cols_array();
        bind[15] = w;
        let binds = file.floats("MAT4", &[bind, bind].concat());
        file.set("/skins/0/inverseBindMatrices", json!(binds))
    };
    let [exact, dusty] = [1.0, 0.999_999].map(|w| with_bind(w).load().unwrap());
    assert_eq!(exact.meshes[0].positions, dusty.meshes[0].positions);
    assert_eq!(with_text(&dusty, "off by rounding").len(), 1);
    assert!(with_bind(2.0).error().contains("skins[0].inverseBindMatrices: is not affine"));
}

/// The triangle with a fourth vertex that has nothing finite about it, and these indices.
fn with_broken_vertex(indices: &[u16]) -> File {
    let mut file = File::triangle();
    let nan = f32::NAN;
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, nan, f32::INFINITY, 0.0];
    let positions = file.floats("VEC3", &corners);
    let normals =
        file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, nan, nan, nan]);
    let indices = file.u16s("SCALAR", indices);
    *file.primitive() =
        json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": indices});
    file
}

#[test]
fn vertices_that_no_triangle_uses_may_be_broken() {
    // A triangle that uses a vertex twice draws nothing.
    for indices in [&[0, 1, 2][..], &[0, 1, 2, 3, 3, 0], &[0, 1, 2, 1, 3, 1]] {
        let scene = with_broken_vertex(indices).load().unwrap();
        let mesh = &scene.meshes[0];
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3, 1), "{indices:?}");
        let told = "1 positions that no triangle uses are not finite, left out";
        assert_eq!(notices(&scene), [format!("meshes[0].primitives[0]: {told}")], "{indices:?}");
    }
    let error = with_broken_vertex(&[0, 1, 2, 0, 1, 3]).error();
    assert!(error.contains("position 3 is [NaN, inf, 0], must be finite"), "{error}");
    // Only the mesh's unused vertex lacks joints and weights that make sense.
    let mut file = skinned();
    let positions =
        file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, f32::NAN, 0.0, 0.0]);
    let normals = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let joints = file.u16s("VEC4", &[[0; 12].as_slice(), &[99; 4]].concat());
    let weights =
        file.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0].repeat(3), vec![f32::NAN; 4]].concat());
    file.primitive()["attributes"] = json!({
        "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights
    });
    assert_eq!(file.load().unwrap().meshes[0].positions.len(), 3);
}

#[test]
fn strips_linked_by_triangles_without_area_stay_whole() {
    // Two strips of one triangle each, linked as exporters do.
    let mut file = with_broken_vertex(&[0, 1, 2, 2, 0, 0, 1, 2]);
    file.primitive()["mode"] = json!(5);
    let scene = file.load().unwrap();
    let mesh = &scene.meshes[0];
    let has_area = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    assert_eq!(mesh.triangles.iter().filter(has_area).count(), 2);
}

/// Everything that is ignored is told once for each kind, however often it occurs.
#[test]
fn what_is_not_read_is_told_once_a_kind() {
    let mut file =
        masked().set("/scenes", json!([{"nodes": [0, 1]}, {"nodes": []}, {"nodes": []}]));
    file.push("nodes", json!({"mesh": 1, "rotation": [0, QUARTER, 0, QUARTER]}));
    let primitives = file.json["meshes"][0]["primitives"].clone();
    file.push("meshes", json!({"primitives": primitives}));
    let colors = file.floats("VEC3", &[1.0; 9]);
    let joints = file.u16s("VEC4", &[0; 12]);
    for mesh in 0..2 {
        let attributes = &mut file.json["meshes"][mesh]["primitives"][0]["attributes"];
        attributes["COLOR_0"] = json!(colors);
        attributes["COLOR_1"] = json!(colors);
        attributes["JOINTS_0"] = json!(joints);
        attributes["_TEMPERATURE"] = json!(colors);
    }
    file.json["materials"][0]["normalTexture"] = json!({"index": 0});
    file.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
    file.json["materials"][0]["emissiveFactor"] = json!([0, 0, 1]);
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([3, 1, 1, 1]);
    file.json["samplers"][0]["wrapS"] = json!(7);
    let perspective = json!({"yfov": 1, "znear": 0.1, "zfar": 100, "aspectRatio": 2});
    file.push("cameras", json!({"type": "perspective", "perspective": perspective}));
    file.json["nodes"][1]["camera"] = json!(0);
    file.json["nodes"][1]["rotation"] = json!([0, 2, 0, 2]);
    file.push("nodes", json!({"matrix": glam::Mat4::IDENTITY.to_cols_array(), "scale": [1, 2, 1]}));
    let animation = json!({"channels": [], "samplers": []});
    file.json["animations"] = json!([animation, animation, animation]);
    file.json["extensionsUsed"] = json!([
        "KHR_materials_clearcoat",
        "KHR_materials_unlit",
        "KHR_materials_transmission",
        "KHR_materials_volume",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_texture_transform",
        "MSFT_lod",
        "EXT_made_up"
    ]);
    let scene = file.load().unwrap();
    assert_eq!(
        notices(&scene),
        [
            "extensionsUsed: KHR_materials_transmission, KHR_materials_volume: let light through, \
             which is not supported: all is solid",
            "extensionsUsed: KHR_materials_pbrSpecularGlossiness: not supported: the base colour \
             and its alpha are used",
            "extensionsUsed: KHR_materials_clearcoat, KHR_materials_unlit: not supported: surfaces \
             are drawn without what they describe",
            "extensionsUsed: MSFT_lod, EXT_made_up: not supported: what they describe is left out",
            "cameras[0]: aspectRatio is not used, the picture's size decides",
            "scenes[1] and 1 more: left out, only the default scene is shown",
            "nodes[2]: has a matrix beside translation, rotation or scale, the matrix counts",
            "nodes[1].rotation: is no unit quaternion, its direction counts",
            "animations[0] and 2 more: nothing of it can be played, left out",
            "materials[0]: baseColorFactor is not within 0 and 1, the nearest colour instead",
            "materials[0]: textures other than that of the base colour are not drawn",
            "materials[0]: the light that it emits is not drawn",
            "samplers[0]: has an unknown filter or wrapping mode, linear and repeated instead",
            "meshes[0].primitives[0] and 1 more: has several sets of vertex colours, only the first \
             counts",
            "meshes[0].primitives[0] and 1 more: has attributes of its application's own, which \
             are not used",
            "meshes[0].primitives[0] and 1 more: has joints, but its node has no skin, shown as it \
             is",
            "meshes[0].primitives[0] and 1 more: vertex colours are not shown",
        ]
    );
    // Instances of a skinned mesh would all stand in one place, because its node does not move it.
    let mut file = skinned();
    let at = file.floats("VEC3", &[0.0; 6]);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": at}}});
    let scene = file.load().unwrap();
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(with_text(&scene, "instances of a skinned mesh").len(), 1);
}
