//! Command lines that readers can copy into a shell.

use crate::{LightInfo, Report};

/// A word as a shell takes it, quoted if it has to be.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=+,./:@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// An option with its value as a shell takes it: `--camera='the gate'`.
pub fn quoted_option(name: &str, value: &str) -> String {
    format!("--{name}={}", quoted(value))
}

/// A vector as options take it: `0,1.5,-4`.
pub fn comma_separated(v: [f64; 3]) -> String {
    v.map(|n| n.to_string()).join(",")
}

/// The command that renders a technique in the scene's own view and light.
pub(super) fn render(scene: &str, technique: &str) -> String {
    let [scene, technique] = [scene, technique].map(quoted);
    format!("umbrage render {scene} --shadows {technique} -o shadows.png")
}

/// The command that renders a technique in the view and light of a report.
pub(super) fn render_as(report: &Report, technique: &str) -> String {
    let view = &report.view;
    let [width, height] = report.size;
    let mut command = render(&report.scene, technique);
    let mut add =
        |option: &str, value: &str| command += &format!(" {}", quoted_option(option, value));
    match &view.name {
        Some(name) => add("camera", name),
        None => {
            add("eye", &comma_separated(view.eye));
            add("target", &comma_separated(view.target));
            if view.up != [0.0, 1.0, 0.0] {
                add("up", &comma_separated(view.up));
            }
            let lens = [("fov", view.fov), ("ortho", view.ortho)];
            let range = [("near", Some(view.near)), ("far", Some(view.far))];
            for (option, value) in lens.into_iter().chain(range) {
                value.iter().for_each(|value| add(option, &value.to_string()));
            }
        }
    }
    match &report.light {
        LightInfo::Directional { name: None, direction } => {
            add("sun", &comma_separated(*direction));
        }
        LightInfo::Directional { name: Some(name), .. }
        | LightInfo::Spot { name: Some(name), .. }
        | LightInfo::Point { name: Some(name), .. } => add("light", name),
        // Without a name, the light is the scene's first, which is the default.
        LightInfo::Spot { name: None, .. } | LightInfo::Point { name: None, .. } => {}
    }
    add("size", &format!("{width}x{height}"));
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::report;

    #[test]
    fn commands_repeat_view_and_light() {
        let mut report = report(&[Some(0.5)]);
        assert_eq!(
            render_as(&report, "csm8(blur=7)"),
            "umbrage render pole --shadows 'csm8(blur=7)' -o shadows.png --eye=0,2,0 \
             --target=0,2,-1 --fov=60 --near=0.1 --far=500 --sun=0,-1,0 --size=64x48"
        );
        report.view.name = Some("the gate's".to_owned());
        report.light =
            LightInfo::Point { name: Some("lamp".to_owned()), position: [0.0; 3], range: 1.0 };
        assert_eq!(
            render_as(&report, "uniform"),
            r"umbrage render pole --shadows uniform -o shadows.png --camera='the gate'\''s' --light=lamp --size=64x48"
        );
    }
}
