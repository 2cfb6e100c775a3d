//! Damaged files: every small third-party scene, cut short and with bytes changed at hundreds of
//! places, loads or gets an error, and what loads is sound.

mod damage;

use std::path::Path;
use umbrage_testing::{needs, third_party_scenes};

const SMALL: &[&str] = &[
    "characters/CesiumMan.glb",
    "characters/Fox.glb",
    "dragon/dragon_res4.glb",
    "lattice/fence_rows.glb",
    "trees/low_poly_tree.glb",
    "vehicles/airplane_pyvista.glb",
    "vehicles/muscle_car.glb",
    "house/house.glb",
    "city/kenney_city_40x40.glb",
    "vehicles/retroufo.glb",
    "lattice/barn_skylight.glb",
];

#[needs(scenes)]
#[test]
fn damaged_files_never_panic() {
    let folder = Path::new(third_party_scenes!());
    let read = |file: &&'static str| {
        let path = folder.join(file);
        (*file, std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
    };
    damage::damage(&SMALL.iter().map(read).collect::<Vec<_>>());
}
