use crate::desk::{Desk, keys};

#[test]
fn built_in_scenes_are_listed_and_open() {
    let desk = Desk::new();
    let text = desk.succeed(&["scenes"]);
    let json = desk.json(&["scenes", "--json"]);
    let scenes = json.as_array().unwrap();
    assert!(scenes.len() >= 3);
    for scene in scenes {
        assert_eq!(keys(scene), ["about", "default_size", "max_size", "name", "size_means"]);
        let name = scene["name"].as_str().unwrap();
        assert!(text.contains(name), "{text}");
        let plan = desk.json(&["plan", name, "--json"]);
        assert!(plan["texels"].as_u64().unwrap() > 0, "{name}");
    }
}

#[test]
fn a_size_makes_a_scene_of_that_size() {
    let desk = Desk::new();
    desk.succeed(&["plan", "sphere:8", "--json"]);
    let most = desk.run(&["plan", "sphere:4000000000"]);
    assert_ne!(most.code, 0);
    assert!(most.stderr.contains("sizes 1 to"), "{}", most.stderr);
}

#[test]
fn a_file_wins_over_a_built_in_scene() {
    let desk = Desk::new();
    desk.write("sphere", "no scene at all");
    let run = desk.run(&["plan", "sphere"]);
    assert_ne!(run.code, 0);
    assert!(run.stderr.contains("sphere"), "{}", run.stderr);
    // A folder is no scene: the report of `compare pole -o pole` does not hide the pole.
    std::fs::create_dir(desk.path("pole")).unwrap();
    desk.succeed(&["plan", "pole"]);
}
