//! Files cut short and with bytes changed, the same way each time, and what must hold of what
//! loads.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use umbrage_scene::{Scene, load};

/// Loads each file damaged in 300 ways.
pub(crate) fn damage(files: &[(&str, Vec<u8>)]) {
    let temporary = tempfile::tempdir().unwrap();
    let (loaded, refused) = (AtomicU32::new(0), AtomicU32::new(0));
    std::thread::scope(|scope| {
        for (k, (file, bytes)) in files.iter().enumerate() {
            let damaged = temporary.path().join(format!("damaged{k}.glb"));
            let (loaded, refused) = (&loaded, &refused);
            scope.spawn(move || {
                let mut damage = Damage(k as u64);
                for round in 0..300 {
                    std::fs::write(&damaged, damage.apply(bytes, round)).unwrap();
                    let what = format!("{file}, round {round}");
                    match load(&damaged) {
                        Ok(scene) => {
                            // Views cost a hundred times as much as loading.
                            if loaded.fetch_add(1, Relaxed) % 32 == 0 {
                                assert_view(&scene, &what);
                            }
                            assert_sound(&scene, &what);
                        }
                        Err(e) => {
                            assert!(e.to_string().len() < 600, "{what}: {e}");
                            refused.fetch_add(1, Relaxed);
                        }
                    }
                }
            });
        }
    });
    // Both outcomes occur: the damage is neither harmless nor always fatal.
    let (loaded, refused) = (loaded.into_inner(), refused.into_inner());
    let least = 300 * files.len() as u32 / 11;
    assert!(loaded > least && refused > least, "{loaded} loaded, {refused} refused");
}

/// Changes files, the same way each time.
struct Damage(u64);

impl Damage {
    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    fn apply(&mut self, bytes: &[u8], round: usize) -> Vec<u8> {
        let json_end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let mut copy = bytes.to_vec();
        match round % 6 {
            0 => copy.truncate(self.below(bytes.len())),
            // Digits of indices, counts and offsets become others: the JSON stays valid.
            1..=3 => {
                for _ in 0..=round % 4 {
                    let start = 20 + self.below(json_end - 20);
                    if let Some(i) = (start..json_end).find(|&i| copy[i].is_ascii_digit()) {
                        copy[i] = b'0' + self.below(10) as u8;
                    }
                }
            }
            4 => {
                let i = self.below(json_end);
                copy[i] ^= 1 << self.below(8);
            }
            _ => {
                for _ in 0..8 {
                    let i = json_end + self.below(bytes.len() - json_end);
                    copy[i] = self.below(256) as u8;
                }
            }
        }
        copy
    }
}

fn assert_sound(scene: &Scene, what: &str) {
    for m in &scene.meshes {
        let n = m.positions.len();
        assert!(m.positions.iter().all(|p| p.is_finite()), "{what}");
        assert!(m.normals.len() == n && (m.uvs.is_empty() || m.uvs.len() == n), "{what}");
        assert!(m.normals.iter().all(|p| (p.length() - 1.0).abs() < 1e-4), "{what}");
        assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < n), "{what}");
        assert!(m.material < scene.materials.len(), "{what}");
    }
    for i in &scene.instances {
        assert!(i.mesh < scene.meshes.len() && i.world_from_mesh.is_finite(), "{what}");
        assert!(i.world_from_mesh.inverse().is_finite(), "{what}");
    }
    for t in &scene.textures {
        assert_eq!(t.rgba.len() as u64, u64::from(t.size[0]) * u64::from(t.size[1]), "{what}");
    }
}

fn assert_view(scene: &Scene, what: &str) {
    let view = scene.default_view();
    assert!(view.eye.is_finite() && view.target.is_finite() && view.eye != view.target, "{what}");
    assert!(0.0 < view.near && view.near < view.far && view.far.is_finite(), "{what}: {view:?}");
    let light = scene.light_for_view(&view).light;
    assert!(light.direction_to_light(view.target).is_finite(), "{what}");
}
