//! Plans with pages: the GPU against the reference, and pages that are kept against new ones.

use crate::parity::agrees_with;
use crate::{Set, scene};
use umbrage::Technique;
use umbrage_testing::needs;

const IMAGE: [u32; 2] = [240, 135];

fn agrees(name: &str, techniques: &[&str]) {
    let scene = scene(name);
    let set = Set::new(&scene, IMAGE);
    for text in techniques {
        let technique: Technique = text.parse().unwrap();
        agrees_with(name, &set, &technique);
    }
}

#[needs(gpu)]
#[test]
fn built_in_scenes_have_the_pages_of_the_reference() {
    agrees("town", &["paged", "paged(error=0.5):pcf3"]);
    agrees("fence", &["paged(error=2)"]);
}
