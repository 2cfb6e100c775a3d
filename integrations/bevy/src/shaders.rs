//! Changes in Bevy's shaders. Bevy has no extension point for the lookup of shadows, so the texts
//! of its loaded shaders are changed, function by function. Each piece that is replaced must be
//! there exactly once and be the one that this version was written for. Otherwise Bevy's shaders
//! stay as they are.

use crate::debug::UmbrageDebug;
use bevy::asset::{AssetEventSystems, AssetMut};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::shader::{ShaderImport, Source};
use std::time::Duration;

/// Turns everything that this crate does on or off, at run time. A change compiles Bevy's shaders
/// anew, which takes a moment.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Resource, Clone, Debug, Default, PartialEq)]
pub struct UmbrageEnabled(pub bool);

impl Default for UmbrageEnabled {
    fn default() -> Self {
        Self(true)
    }
}

/// What this crate does at present.
#[derive(Resource, Clone, Debug, Default)]
pub struct UmbrageStatus {
    /// Which lookup Bevy's shaders have.
    pub lookup: Lookup,
    /// The time that all plans of the last frame took.
    pub planning: Duration,
    /// Why a light's cascades were Bevy's own in the last frame, although it has
    /// [`UmbrageShadows`](crate::UmbrageShadows).
    pub problem: Option<String>,
    /// Whether depths are clamped under a warp on devices that cannot clamp depths themselves.
    pub(crate) clamps_warped_depths: bool,
}

/// Which lookup Bevy's shaders have.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// Bevy has not loaded all of its shaders yet.
    #[default]
    Waiting,
    /// Shadows are looked up with a bias that follows from the map.
    Umbrage,
    /// Bevy's own, because [`UmbrageEnabled`] is false.
    Bevy,
    /// Bevy's own, because a shader is not the one that this version was written for.
    Refused {
        /// Which shader, and what is not as expected.
        why: String,
    },
}

/// A change of a shader's text.
enum Change {
    /// The body of a function becomes a call of the function of the same name in `lights.wesl`.
    Body {
        name: &'static str,
        /// The [`fingerprint`] of the function in Bevy.
        fingerprint: u64,
    },
    /// A line is replaced.
    Line { old: &'static str, new: &'static str },
}

/// What a shader is changed for. If one shader of a purpose cannot be changed, none is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// The lookup of shadows, and the triangles' normals that it needs.
    Lookup,
    /// On devices that cannot clamp depths, Bevy's shaders do so, and divide by no w.
    WarpedDepths,
    Debug,
}

struct Changed {
    /// The shader's import path.
    path: &'static str,
    purpose: Purpose,
    import: &'static str,
    changes: &'static [Change],
}

const CHANGED: &[Changed] = &[
    Changed {
        path: "bevy_pbr::render::shadows",
        purpose: Purpose::Lookup,
        import: "import bevy_umbrage::lights as umbrage_lights;\n",
        changes: &[
            Change::Body { name: "sample_directional_cascade", fingerprint: 0xf6f5_3bd4_4533_d6bc },
            Change::Body { name: "fetch_spot_shadow", fingerprint: 0x8f3f_ef30_527b_2c2e },
            Change::Body { name: "fetch_point_shadow", fingerprint: 0x4bc5_b81e_97c6_1233 },
        ],
    },
    Changed {
        path: "bevy_pbr::render::pbr_fragment",
        purpose: Purpose::Lookup,
        import: "import bevy_umbrage::surface as umbrage_surface;\n",
        changes: &[Change::Line {
            old: "    pbr_input.world_position = in.world_position;\n",
            new: "    pbr_input.world_position = in.world_position;\n\
                  @if(!MESHLET_MESH_MATERIAL_PASS && !PREPASS_PIPELINE)\n    \
                  umbrage_surface::note_triangle(in.world_position.xyz);\n",
        }],
    },
    Changed {
        path: "bevy_pbr::deferred::functions",
        purpose: Purpose::Lookup,
        import: "import bevy_umbrage::surface as umbrage_surface;\n",
        changes: &[Change::Line {
            old: "    pbr.world_position = world_position;\n",
            new: "    pbr.world_position = world_position;\n    \
                  umbrage_surface::note_pixels(world_position.xyz, N);\n",
        }],
    },
    Changed {
        path: "bevy_pbr::prepass::prepass",
        purpose: Purpose::WarpedDepths,
        import: "",
        changes: &[
            Change::Line {
                old: "    out.position.z = min(out.position.z, 1.0);",
                new: "    out.position.z = min(out.position.z, out.position.w);",
            },
            UNDIVIDED_DEPTH,
        ],
    },
    Changed {
        path: "bevy_pbr::render::pbr_prepass",
        purpose: Purpose::WarpedDepths,
        import: "",
        changes: &[UNDIVIDED_DEPTH],
    },
    Changed {
        path: "bevy_pbr::render::pbr_functions",
        purpose: Purpose::Debug,
        import: "import bevy_umbrage::debug as umbrage_debug;\n",
        changes: &[Change::Line {
            old: "        light_contrib = \
                  shadows::cascade_debug_visualization(light_contrib, i, view_z);\n",
            new: "        light_contrib = \
                  shadows::cascade_debug_visualization(light_contrib, i, view_z);\n        \
                  light_contrib = \
                  umbrage_debug::SHOWN(light_contrib, i, in.world_position.xyz, view_z);\n",
        }],
    },
];

/// In a fragment shader the fourth coordinate of the position is 1/w.
const UNDIVIDED_DEPTH: Change = Change::Line {
    old: "    out.frag_depth = in.unclipped_depth;",
    new: "    out.frag_depth = in.unclipped_depth * in.position.w;",
};

impl Changed {
    /// The changed text, or what is not as expected.
    fn apply(&self, text: &str, debug: &str) -> Result<String, String> {
        let mut text = text.to_owned();
        for change in self.changes {
            match *change {
                Change::Body { name, fingerprint: expected } => {
                    let function = function(&text, name)?;
                    if fingerprint(&text[function.whole.clone()]) != expected {
                        return Err(format!("the function {name} is another one"));
                    }
                    let parameters = parameters(&text[function.whole.start..function.body.start]);
                    let call = format!(
                        "{{\n    return umbrage_lights::{name}({});\n}}",
                        parameters.join(", ")
                    );
                    text.replace_range(function.body, &call);
                }
                Change::Line { old, new } => {
                    if text.matches(old).count() != 1 {
                        return Err(format!("the line `{}` is not there once", old.trim()));
                    }
                    text = text.replace(old, &new.replace("SHOWN", debug));
                }
            }
        }
        Ok(format!("{}{text}", self.import))
    }
}

struct Function {
    whole: std::ops::Range<usize>,
    body: std::ops::Range<usize>,
}

/// The only function with this name.
fn function(text: &str, name: &str) -> Result<Function, String> {
    let head = format!("fn {name}(");
    let mut found = text.match_indices(&head);
    let (Some((start, _)), None) = (found.next(), found.next()) else {
        return Err(format!("the function {name} is not there once"));
    };
    let mut depth = 0;
    let mut body = None;
    for (at, c) in text[start..].char_indices() {
        match c {
            '{' => {
                body.get_or_insert(start + at);
                depth += 1;
            }
            '}' => depth -= 1,
            _ => {}
        }
        if let (Some(begin), 0) = (body, depth) {
            let end = start + at + 1;
            return Ok(Function { whole: start..end, body: begin..end });
        }
    }
    Err(format!("the function {name} does not end"))
}

/// The names of the parameters in a function's head.
fn parameters(head: &str) -> Vec<&str> {
    let list = head.split_once('(').and_then(|(_, rest)| rest.rsplit_once(')'));
    let list = list.map_or("", |(list, _)| list);
    list.split(',').filter_map(|p| p.split_once(':')).map(|(name, _)| name.trim()).collect()
}

/// A number that tells whether two texts are the same but for white space (FNV-1a, 64 bits).
fn fingerprint(text: &str) -> u64 {
    text.split_whitespace()
        .flat_map(|word| word.bytes().chain([b' ']))
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

/// The crate's own shader modules.
const MODULES: &[(&str, &str)] = &[
    ("surface", include_str!("wesl/surface.wesl")),
    ("receiver", include_str!("wesl/receiver.wesl")),
    ("flat_map", include_str!("wesl/flat_map.wesl")),
    ("cube_map", include_str!("wesl/cube_map.wesl")),
    ("lights", include_str!("wesl/lights.wesl")),
    ("debug", include_str!("wesl/debug.wesl")),
];

/// A shader of Bevy's, with its text as Bevy loaded it.
struct Original {
    changed: &'static Changed,
    text: String,
    /// The text that the shader has now.
    written: String,
}

#[derive(Resource, Default)]
struct Shaders {
    /// Keeps the crate's own modules loaded.
    _modules: Vec<Handle<Shader>>,
    originals: HashMap<AssetId<Shader>, Original>,
    refused: Vec<Purpose>,
}

pub(crate) fn add(app: &mut App) {
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    let modules = MODULES.iter().map(|(name, text)| {
        shaders.add(Shader::from_wesl(*text, format!("embedded://bevy_umbrage/{name}.wesl")))
    });
    let state = Shaders { _modules: modules.collect(), ..Shaders::default() };
    app.insert_resource(state).add_systems(
        Last,
        // Before Bevy's renderer reads the shaders of this frame.
        (
            change_shaders.after(AssetEventSystems).run_if(
                on_message::<AssetEvent<Shader>>
                    .or_else(resource_changed::<UmbrageDebug>)
                    .or_else(resource_changed::<UmbrageEnabled>),
            ),
            tell_missing,
        ),
    );
}

/// Bevy loads its shaders in its first frames. After this time one that is missing will not come.
const PATIENCE: Duration = Duration::from_secs(20);

fn tell_missing(
    time: Res<Time<Real>>,
    state: Res<Shaders>,
    status: Res<UmbrageStatus>,
    mut is_told: Local<bool>,
) {
    if *is_told || status.lookup != Lookup::Waiting || time.elapsed() < PATIENCE {
        return;
    }
    *is_told = true;
    let is_loaded = |path: &str| state.originals.values().any(|o| o.changed.path == path);
    let missing = CHANGED.iter().filter(|changed| changed.purpose == Purpose::Lookup);
    let missing: Vec<_> = missing.map(|c| c.path).filter(|path| !is_loaded(path)).collect();
    warn!("bevy_umbrage: shadows stay Bevy's own until it loads {}", missing.join(", "));
}

fn change_shaders(
    mut events: MessageReader<AssetEvent<Shader>>,
    mut shaders: ResMut<Assets<Shader>>,
    mut state: ResMut<Shaders>,
    mut status: ResMut<UmbrageStatus>,
    enabled: Res<UmbrageEnabled>,
    debug: Res<UmbrageDebug>,
) {
    let state = &mut *state;
    let mut loaded = Vec::new();
    for event in events.read() {
        let (AssetEvent::Added { id } | AssetEvent::Modified { id }) = *event else { continue };
        let Some(Shader { import_path: ShaderImport::Custom(path), source, .. }) = shaders.get(id)
        else {
            continue;
        };
        let (Source::Wesl(text), Some(changed)) =
            (source, CHANGED.iter().find(|changed| changed.path == path))
        else {
            continue;
        };
        if state.originals.get(&id).is_some_and(|original| original.written == *text) {
            continue;
        }
        let text = text.clone().into_owned();
        state.originals.insert(id, Original { changed, written: text.clone(), text });
        loaded.push(id);
    }

    // Bevy loads many shaders that are not changed.
    if loaded.is_empty() && !enabled.is_changed() && !debug.is_changed() {
        return;
    }

    // What must change for a purpose is tried before anything is written.
    let mut why = None;
    for original in state.originals.values() {
        let purpose = original.changed.purpose;
        if state.refused.contains(&purpose) {
            continue;
        }
        let shown = debug.function().unwrap_or("cascades");
        if let Err(problem) = original.changed.apply(&original.text, shown) {
            state.refused.push(purpose);
            let problem = format!("{}: {problem}", original.changed.path);
            let consequence = match purpose {
                Purpose::Lookup => "shadows stay Bevy's own",
                Purpose::WarpedDepths => {
                    "on devices that cannot clamp depths, planned maps have no warp"
                }
                Purpose::Debug => "UmbrageDebug shows nothing",
            };
            warn!(
                "bevy_umbrage {} does not know this version of a shader of Bevy's, so \
                 {consequence} ({problem})",
                env!("CARGO_PKG_VERSION")
            );
            if purpose == Purpose::Lookup {
                why = Some(problem);
            }
        }
    }
    let is_wanted = |purpose: Purpose| {
        enabled.0
            && !state.refused.contains(&purpose)
            && !state.refused.contains(&Purpose::Lookup)
            && (purpose != Purpose::Debug || *debug != UmbrageDebug::Off)
    };
    for (id, original) in &mut state.originals {
        let Original { changed, text, written } = original;
        let shown = debug.function().unwrap_or_default();
        let wanted = match is_wanted(changed.purpose) {
            true => changed.apply(text, shown).unwrap_or_else(|_| text.clone()),
            false => text.clone(),
        };
        if wanted == *written {
            continue;
        }
        written.clone_from(&wanted);
        // Bevy's renderer has not read a shader yet that was loaded in this frame.
        let shader = match loaded.contains(id) {
            true => shaders.get_mut_untracked(*id),
            false => shaders.get_mut(*id).map(AssetMut::into_inner),
        };
        if let Some(shader) = shader {
            let changed = Shader::from_wesl(wanted, shader.path.clone());
            shader.source = changed.source;
            shader.imports = changed.imports;
        }
    }

    let has_all = |purpose: Purpose| {
        let needed = CHANGED.iter().filter(|changed| changed.purpose == purpose);
        let found = state.originals.values().filter(|o| o.changed.purpose == purpose);
        needed.count() == found.count()
    };
    status.clamps_warped_depths =
        has_all(Purpose::WarpedDepths) && is_wanted(Purpose::WarpedDepths);
    if let Some(why) = why {
        status.lookup = Lookup::Refused { why };
    } else if !matches!(status.lookup, Lookup::Refused { .. }) {
        status.lookup = match (enabled.0, has_all(Purpose::Lookup)) {
            (false, _) => Lookup::Bevy,
            (true, true) => Lookup::Umbrage,
            (true, false) => Lookup::Waiting,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "fn other(a: f32) -> f32 { return a; }\n\
                        fn sum(first: vec2<f32>, second: array<f32, 2>) -> f32 {\n    \
                        if (first.x > 0.0) { return 1.0; }\n    return second[0];\n}\n\
                        const END: u32 = 1u;\n";

    #[test]
    fn functions_are_found_with_their_bodies() {
        let found = function(TEXT, "sum").unwrap();
        let head = &TEXT[found.whole.start..found.body.start];
        assert!(TEXT[found.whole.clone()].starts_with("fn sum("));
        assert!(TEXT[found.whole].ends_with("return second[0];\n}"));
        assert!(TEXT[found.body].starts_with("{\n"));
        assert_eq!(parameters(head), ["first", "second"]);
    }

    #[test]
    fn functions_that_are_not_there_once() {
        assert!(function(TEXT, "su").is_err_and(|e| e.contains("su is not there once")));
        assert!(function(&TEXT.repeat(2), "sum").is_err());
        assert!(function("fn sum(a: f32) { {", "sum").is_err_and(|e| e.contains("does not end")));
        assert!(function("", "sum").is_err());
    }

    #[test]
    fn fingerprints_ignore_white_space_alone() {
        assert_eq!(fingerprint("let a = 1;\n    let b = 2;"), fingerprint("let a = 1; let b = 2;"));
        assert_ne!(fingerprint("let a = 1;"), fingerprint("let a = 2;"));
        assert_ne!(fingerprint("let ab;"), fingerprint("let a b;"));
    }

    #[test]
    fn every_shader_is_changed_for_one_purpose() {
        for (i, changed) in CHANGED.iter().enumerate() {
            assert!(CHANGED[..i].iter().all(|other| other.path != changed.path));
        }
    }
}
