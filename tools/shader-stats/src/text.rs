//! The WGSL of a frame's shader, with a lookup or without.

use anyhow::{Context, Result, ensure};
use std::sync::Arc;
use umbrage::Technique;
use umbrage_wgpu::{ShadowOptions, Shadows, Support};

/// The renderer's shader, which a lookup must precede.
const FORWARD: &str = include_str!("../../../crates/umbrage-render/src/wgsl/forward.wgsl");

/// Which paths through the lookup are compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Paths {
    All,
    /// That of a light with one map whose matrix is affine.
    Straight,
    /// That of a light with slices whose matrices are affine.
    Slices,
}

impl Paths {
    /// What the lookup reads of a light and its map, and the values on the path.
    fn assumed(self) -> &'static [(&'static str, &'static str)] {
        const KIND: (&str, &str) = ("shadow_maps[map].kind", "SHADOW_AFFINE");
        const CHOICE: &str = "shadow_lights[light].choice";
        match self {
            Self::All => &[],
            Self::Straight => &[(CHOICE, "SHADOW_ONE"), KIND],
            Self::Slices => &[(CHOICE, "SHADOW_BY_DISTANCE"), KIND],
        }
    }
}

/// The frame's shader with the lookup of a filter, which is given in the language of techniques.
pub(crate) fn frame(filter: &str, paths: Paths) -> Result<String> {
    let mut text = lookup(filter)?;
    for (read, value) in paths.assumed() {
        ensure!(text.contains(read), "the lookup no longer reads {read}");
        text = text.replace(read, value);
    }
    Ok(text + FORWARD)
}

/// The frame's shader in which everything is lit.
pub(crate) fn without_lookup() -> Result<String> {
    let named = "fn shadow_visibility(";
    let text = lookup("hard")?;
    ensure!(text.contains(named), "the lookup no longer has {named}");
    let text = text.replace(named, "fn shadow_visibility_unused(");
    let text = text
        .replace(" shadow_visibility(light, position", " shadow_visibility_unused(light, position");
    let lit =
        "fn shadow_visibility(light: u32, position: vec3f, normal: vec3f) -> f32 { return 1.0; }\n";
    Ok(text + lit + FORWARD)
}

fn lookup(filter: &str) -> Result<String> {
    let technique: Technique = format!("uniform:{filter}@512").parse()?;
    let mut instance = wgpu::InstanceDescriptor::new_without_display_handle();
    instance.backends = wgpu::Backends::NOOP;
    instance.backend_options.noop.enable = true;
    let instance = wgpu::Instance::new(instance);
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .context("wgpu's backend without a device")?;
    let (device, _queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: adapter.features() & Support::WANTED_FEATURES,
        ..Default::default()
    }))?;
    // This backend can hold no depths, but the text does not depend on textures.
    device.on_uncaptured_error(Arc::new(|_| {}));
    let support = Support {
        storage_buffers: true,
        depth_fetch: true,
        float32: true,
        norm16: true,
        snorm8: true,
        ..Support::new(&adapter, &device)?
    };
    let options = ShadowOptions { filter: technique.filter, ..Default::default() };
    Ok(Shadows::new(&device, support, &options)?.lookup_wgsl(1))
}
