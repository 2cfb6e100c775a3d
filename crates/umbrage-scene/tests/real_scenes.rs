//! Every third-party scene.

use std::path::Path;
use umbrage_scene::{Alpha, Scene, load};
use umbrage_testing::{needs, third_party_scenes};

/// File, triangles stored and drawn, size in metres.
#[rustfmt::skip]
const SCENES: &[(&str, u64, u64, [f64; 3])] = &[
    ("atrium/sponza_atrium_reduced.glb", 33_663, 33_663, [27.48, 13.18, 12.56]),
    ("characters/CesiumMan.glb", 4_672, 4_672, [1.138, 1.507, 0.312]),
    ("characters/Fox.glb", 576, 576, [25.19, 79.03, 154.7]),
    ("city/delft_city.glb", 36_267, 36_267, [524.4, 17.3, 327.6]),
    ("city/kenney_city_40x40.glb", 3_982, 466_768, [480.9, 21.0, 480.9]),
    ("dragon/dragon_res2.glb", 202_520, 202_520, [0.204, 0.144, 0.091]),
    ("dragon/dragon_res3.glb", 47_794, 47_794, [0.204, 0.144, 0.091]),
    ("dragon/dragon_res4.glb", 11_102, 11_102, [0.203, 0.143, 0.091]),
    ("dragon/dragons25_res2.glb", 202_522, 5_063_002, [16.0, 1.444, 16.0]),
    ("dragon/dragons25_res3.glb", 47_796, 1_194_852, [16.0, 1.439, 16.0]),
    ("house/house.glb", 10_497, 10_497, [0.502, 0.187, 0.504]),
    ("lattice/barn_skylight.glb", 360, 360, [6.32, 6.306, 13.48]),
    ("lattice/fence_rows.glb", 482, 38_402, [322.6, 32.16, 322.6]),
    ("lattice/lattice_ball.glb", 215_581, 215_581, [40.0, 13.69, 40.0]),
    ("stress/museum_1M.glb", 1_095_633, 1_095_633, [24.0, 4.629, 24.0]),
    ("terrain/jacksboro_dem_terrain.glb", 275_772, 275_772, [2.994e4, 840.0, 3.171e4]),
    ("trees/forest_eztree.glb", 76_600, 642_612, [400.0, 83.89, 400.0]),
    ("trees/low_poly_tree.glb", 1_126, 1_126, [4.075, 7.464, 5.048]),
    ("vehicles/airplane_pyvista.glb", 2_452, 2_452, [15.16, 2.998, 12.88]),
    ("vehicles/kenney_racing_level.glb", 10_403, 252_707, [82.43, 5.287, 104.9]),
    ("vehicles/muscle_car.glb", 6_310, 7_870, [2.183, 1.282, 4.716]),
    ("vehicles/retroufo.glb", 16_428, 16_428, [146.3, 89.33, 146.3]),
];

fn scene(file: &str) -> Scene {
    load(&Path::new(third_party_scenes!()).join(file)).unwrap_or_else(|e| panic!("{e}"))
}

#[needs(scenes)]
#[test]
fn all_load_with_their_triangles_and_sizes() {
    for &(file, stored, drawn, size) in SCENES {
        let s = scene(file);
        assert_eq!(s.stored_triangles(), stored, "{file}: stored");
        assert_eq!(s.drawn_triangles(), drawn, "{file}: drawn");
        for m in &s.meshes {
            assert!(m.positions.iter().all(|p| p.is_finite()), "{file}");
            assert_eq!(m.normals.len(), m.positions.len(), "{file}");
            assert!(m.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5), "{file}");
            assert!(m.uvs.is_empty() || m.uvs.len() == m.positions.len(), "{file}");
            let n = m.positions.len() as u32;
            assert!(m.triangles.iter().flatten().all(|&i| i < n), "{file}");
            assert!(m.material < s.materials.len(), "{file}");
        }
        for i in &s.instances {
            assert!(i.world_from_mesh.is_finite() && i.mesh < s.meshes.len(), "{file}");
        }
        let found = s.bounds().size().to_array();
        for (found, size) in found.into_iter().zip(size) {
            assert!((found / size - 1.0).abs() < 6e-3, "{file}: {found} is not {size} m");
        }
    }
}

#[needs(scenes)]
#[test]
fn leaves_are_masked_by_their_textures() {
    let forest = scene("trees/forest_eztree.glb");
    assert_eq!(forest.notices, []);
    let masked: Vec<_> =
        forest.materials.iter().filter(|m| matches!(m.alpha, Alpha::Mask { .. })).collect();
    assert_eq!(masked.len(), 6);
    assert!(masked.iter().any(|m| m.alpha == Alpha::Mask { cutoff: 0.3 }), "pine");
    for m in masked {
        assert!(m.double_sided, "{}", m.name);
        let texture = &forest.textures[m.base_color_texture.unwrap().0];
        let share =
            texture.rgba.iter().filter(|p| p[3] < 128).count() as f64 / texture.rgba.len() as f64;
        assert!((0.1..0.95).contains(&share), "{}: {share} of it is clear", m.name);
    }
}

#[needs(scenes)]
#[test]
fn instances_share_their_meshes() {
    let dragons = scene("dragon/dragons25_res3.glb");
    assert_eq!((dragons.meshes.len(), dragons.instances.len()), (2, 26));
}

#[needs(scenes)]
#[test]
fn the_barn_brings_its_own_light() {
    let barn = scene("lattice/barn_skylight.glb");
    assert_eq!(barn.lights.len(), 1);
    let down = barn.lights[0].light.direction_to_light(glam::DVec3::ZERO);
    assert!((down - glam::DVec3::new(0.5444, 0.8377, -0.0441)).length() < 1e-3, "{down}");
}

#[needs(scenes)]
#[test]
fn figures_stand_in_their_bind_pose() {
    // CesiumMan's joints turn him upright: 1.5 m tall and narrow from side to side of his walk.
    let man = scene("characters/CesiumMan.glb").bounds();
    assert!(man.min.y.abs() < 0.02 && (man.max.y - 1.507).abs() < 0.01, "{man:?}");
    let fox = scene("characters/Fox.glb");
    assert!(fox.notices.iter().any(|n| n.0.contains("no normals")), "{:?}", fox.notices);
}

/// Characters walk within a box that is little larger than that of their rest, and come back.
#[needs(scenes)]
#[test]
fn characters_move_and_come_to_rest() {
    for (file, clips) in [
        ("characters/CesiumMan.glb", &[("animation0", 2.0)][..]),
        ("characters/Fox.glb", &[("Survey", 3.416), ("Walk", 0.708), ("Run", 1.158)]),
    ] {
        let mut s = scene(file);
        let rest = s.meshes[0].positions.clone();
        let size = s.bounds().size().length();
        let found: Vec<(String, f64)> =
            s.animations.clips().iter().map(|c| (c.name.clone(), c.duration_s)).collect();
        assert_eq!(found.len(), clips.len(), "{file}: {found:?}");
        for (i, ((found, duration_s), &(name, expected_s))) in found.iter().zip(clips).enumerate() {
            assert_eq!(found, name, "{file}");
            assert!((duration_s - expected_s).abs() < 1e-3, "{file}: {name} takes {duration_s} s");
            for share in [0.0, 0.3, 0.8, 1.0] {
                assert_eq!(s.pose(Some(i), share * duration_s).meshes, [0], "{file}: {name}");
                let posed = s.bounds().size().length();
                assert!((0.8..1.3).contains(&(posed / size)), "{file}: {name}: {posed} of {size}");
                assert!(s.meshes[0].positions != rest, "{file}: {name}");
            }
        }
        s.pose(None, 0.0);
        assert_eq!(s.meshes[0].positions, rest, "{file}");
    }
}
