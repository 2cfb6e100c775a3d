//! Files cut short and with bytes or JSON changed, the same way each time, and what must hold of
//! what loads.
#![allow(dead_code, reason = "each test binary uses its share")]

use glam::DVec3;
use serde_json::{Value, json};
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
pub(crate) struct Damage(pub(crate) u64);

impl Damage {
    fn below(&mut self, n: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n
    }

    /// Changes a binary glTF file. The round says in which way.
    pub(crate) fn apply(&mut self, bytes: &[u8], round: usize) -> Vec<u8> {
        let json_end = 20 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let mut copy = bytes.to_vec();
        match round % 9 {
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
            5..=7 => return self.edit(bytes, json_end),
            _ => {
                for _ in 0..8 {
                    // Behind the header of the binary chunk.
                    let i = json_end + 8 + self.below(bytes.len() - json_end - 8);
                    copy[i] = self.below(256) as u8;
                }
            }
        }
        copy
    }

    /// Changes one or two values of the JSON: to another number or another type, to what another
    /// place has, to many of the same, or to nothing at all.
    fn edit(&mut self, bytes: &[u8], json_end: usize) -> Vec<u8> {
        let mut json: Value = serde_json::from_slice(&bytes[20..json_end]).unwrap();
        for _ in 0..=self.below(2) {
            let mut all = Vec::new();
            pointers(&json, "", &mut all);
            // The root itself stays.
            let numbers = [
                json!(0),
                json!(1),
                json!(2),
                json!(-1),
                json!(0.5),
                json!(7),
                json!(5125),
                json!(65_535),
                json!(1_000_000),
                json!(1u64 << 26),
                json!(u32::MAX),
                json!(1u64 << 40),
                json!(u64::MAX),
                json!(1e38),
                json!(-1e-30),
            ];
            let counts: Vec<&String> = all.iter().filter(|p| p.ends_with("/count")).collect();
            if !counts.is_empty() && self.below(3) == 0 {
                // Numbers of elements ask for memory.
                let place = json.pointer_mut(counts[self.below(counts.len())]).unwrap();
                *place = numbers[self.below(numbers.len())].clone();
                continue;
            }
            let [at, from] = [0; 2].map(|_| all[1 + self.below(all.len() - 1)].clone());
            let others = [json!(null), json!("text"), json!([]), json!({}), json!(true)];
            let found = json.pointer(&from).cloned().unwrap();
            let place = json.pointer_mut(&at).unwrap();
            match self.below(8) {
                0..=3 if place.is_number() => *place = numbers[self.below(numbers.len())].clone(),
                0..=4 => *place = found,
                5 => *place = others[self.below(others.len())].clone(),
                6 => {
                    let (parent, key) = at.rsplit_once('/').unwrap();
                    match json.pointer_mut(parent).unwrap() {
                        Value::Object(map) => drop(map.remove(key)),
                        Value::Array(list) => drop(list.remove(key.parse().unwrap())),
                        _ => unreachable!("only lists and objects hold values"),
                    }
                }
                _ => {
                    if let Value::Array(list) = place
                        && let Some(last) = list.last().cloned()
                    {
                        list.extend(vec![last; self.below(100)]);
                    }
                }
            }
        }
        let json = serde_json::to_vec(&json).unwrap();
        let rest = &bytes[json_end..];
        let length = 20 + json.len() + rest.len();
        [
            b"glTF\x02\0\0\0",
            &(length as u32).to_le_bytes()[..],
            &(json.len() as u32).to_le_bytes(),
            b"JSON",
            &json,
            rest,
        ]
        .concat()
    }
}

/// Appends the JSON pointers of a value and of all that is in it.
fn pointers(value: &Value, at: &str, all: &mut Vec<String>) {
    all.push(at.into());
    match value {
        Value::Array(list) => {
            for (i, item) in list.iter().enumerate() {
                pointers(item, &format!("{at}/{i}"), all);
            }
        }
        Value::Object(map) => {
            for (key, item) in map {
                pointers(item, &format!("{at}/{key}"), all);
            }
        }
        _ => {}
    }
}

pub(crate) fn assert_sound(scene: &Scene, what: &str) {
    for m in &scene.meshes {
        let n = m.positions.len();
        assert!(m.positions.iter().all(|p| p.is_finite()), "{what}");
        assert!(m.normals.len() == n && (m.uvs.is_empty() || m.uvs.len() == n), "{what}");
        assert!(m.normals.iter().all(|p| (p.length() - 1.0).abs() < 1e-4), "{what}");
        assert!(m.alphas.is_empty() || m.alphas.len() == n, "{what}");
        assert!(m.alphas.iter().all(|a| (0.0..=1.0).contains(a)), "{what}");
        assert!(m.uvs.iter().all(|uv| uv.is_finite()), "{what}");
        assert!(m.triangles.iter().flatten().all(|&i| (i as usize) < n), "{what}");
        assert!(m.material < scene.materials.len(), "{what}");
    }
    for i in &scene.instances {
        assert!(i.mesh < scene.meshes.len() && i.world_from_mesh.is_finite(), "{what}");
        assert!(i.world_from_mesh.inverse().is_finite(), "{what}");
    }
    for c in &scene.cameras {
        assert!(c.eye.is_finite() && c.target.is_finite() && c.up.is_finite(), "{what}");
        assert!(0.0 < c.near && c.near < c.far && c.far.is_finite(), "{what}");
    }
    for l in &scene.lights {
        assert!(l.light.direction_to_light(DVec3::ONE).is_finite(), "{what}");
        assert!(l.color.is_finite() && l.intensity.is_finite(), "{what}");
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
