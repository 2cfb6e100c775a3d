//! Renders one view of a glTF scene with and without shadows, by Bevy as it comes or with Umbrage,
//! and writes what a scorer needs: both pictures, the visibility that follows from them, the pixels
//! where it can be told, and how long frames took.

#[path = "../harness/mod.rs"]
mod harness;

use bevy::math::Vec3;
use harness::glb::add_glb;
use harness::options::{Options, Problem, end, wrong};
use harness::{BEVYS_OVERLAP, Harness, MAX_SIDE, Measured, Setup, ViewPoint};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
peer --scene FILE.glb --eye x,y,z --target x,y,z --fov DEG --near N --far F --sun x,y,z --out DIR
  --umbrage WHAT           off (Bevy as it comes) | lookup (its cascades, Umbrage's lookup) | a
                           technique such as adaptive+z4@2048, whose maps have 2048² texels in all;
                           without @ each has --map-size. Default: off
  --size WxH               960x540
  --cascades K             4 (1 to 4); a technique has its own
  --map-size N             2048: each cascade's map is N x N; a power of two
  --max-distance D         far
  --first-cascade-far D    where cascade 0 ends. Default: Bevy's 10, or max-distance / 15 (the same
                           share as Bevy's 10 of 150) where max-distance is below 20; a technique
                           has its own
  --overlap P              0.2 (Bevy's default); a technique has its own
  --filter NAME            hardware2x2 | gaussian (Bevy's default) | temporal
  --depth-bias B           0.02 (Bevy's default); Umbrage uses none
  --normal-bias B          1.8 (Bevy's default); Umbrage uses none
  --world-scale S          1: multiplies scene, camera and distances (Bevy's biases and its
                           whole-metre cascade sizes are absolute)
  --frames N               20: frames timed with shadows on, and as many with shadows off
  --warmup N               4 (at least 2): frames drawn before each timed block
--fov is vertical; --sun is the direction in which light travels; +y is up. planning_ms is the time
of a plan that finds all as in the frame before, because the camera stands still.";

const KNOWN: &[&str] = &[
    "scene",
    "out",
    "eye",
    "target",
    "sun",
    "fov",
    "near",
    "far",
    "umbrage",
    "size",
    "cascades",
    "map-size",
    "max-distance",
    "first-cascade-far",
    "overlap",
    "filter",
    "depth-bias",
    "normal-bias",
    "world-scale",
    "frames",
    "warmup",
];

/// Everything that the command line says.
struct Args {
    scene: PathBuf,
    out: PathBuf,
    setup: Setup,
    umbrage: String,
    filter: String,
    world_scale: f32,
    frames: usize,
    warmup: usize,
}

fn main() -> ExitCode {
    end(run())
}

fn run() -> Result<(), Problem> {
    let args = args(&Options::of_command_line(KNOWN, USAGE)?)?;
    let failed = |e: String| Problem::Failure(e);
    std::fs::create_dir_all(&args.out)
        .map_err(|e| failed(format!("{}: {e}", args.out.display())))?;
    let mut harness = Harness::new(&args.setup).map_err(failed)?;
    let added = add_glb(&mut harness, &args.scene, args.world_scale).map_err(failed)?;
    let measured = harness.measure(args.frames, args.warmup).map_err(failed)?;
    harness.check().map_err(failed)?;

    let Measured { on_ms, off_ms, planning_ms, shadowed, unshadowed } = &measured;
    let is_counted: Vec<bool> = unshadowed.iter().map(|&u| harness::counts(u)).collect();
    let visibility = harness::visibility(shadowed, unshadowed);
    let save = |name: &str, pixels: Vec<u8>| save(&args.out, name, args.setup.size, pixels);
    save("visibility.png", visibility.iter().map(|v| (v * 255.0).round() as u8).collect())?;
    save("mask.png", is_counted.iter().map(|&c| u8::from(c) * 255).collect())?;
    save("shadowed.png", shadowed.iter().map(|&b| srgb(b)).collect())?;
    save("unshadowed.png", unshadowed.iter().map(|&b| srgb(b)).collect())?;

    let thousandths = |ms: Option<f64>| ms.map(|ms| (ms * 1000.0).round() / 1000.0);
    let [on, off] = [on_ms, off_ms].map(|ms| harness::median(ms));
    let ends = harness.cascade_ends();
    let report = serde_json::json!({
        "bevy": "0.20.1",
        "umbrage": args.umbrage,
        "adapter": harness.adapter(),
        "how": "wall clock of one whole frame (scene update, recording, submission), then a \
                blocking wait until the device is idle; no pipelined rendering; blocks with \
                shadows on and off alternate; off means the light casts none and the filter is \
                hardware2x2",
        "instances": added.instances,
        "triangles": added.triangles,
        "cascades": ends.len(),
        "map_size": args.setup.map_size,
        "cascade_far_bounds": ends,
        "filter": args.filter,
        "depth_bias": args.setup.depth_bias,
        "normal_bias": args.setup.normal_bias,
        "world_scale": args.world_scale,
        "shadows_on": statistics(on_ms),
        "shadows_off": statistics(off_ms),
        "shadows_ms": thousandths(on.zip(off).map(|(on, off)| on - off)),
        "planning_ms": harness::median(planning_ms),
        "mask_pixels": is_counted.iter().filter(|&&c| c).count(),
    });
    let path = args.out.join("timing.json");
    std::fs::write(&path, format!("{report:#}\n"))
        .map_err(|e| failed(format!("{}: {e}", path.display())))
}

fn args(options: &Options) -> Result<Args, Problem> {
    if let Some(word) = options.words.first() {
        return Err(Problem::Usage(format!("unexpected argument {word:?}")));
    }
    let scale = options.number("world-scale")?.unwrap_or(1.0);
    if scale <= 0.0 {
        return Err(wrong("world-scale", "must be above 0"));
    }
    let scaled = |name| -> Result<Option<f32>, Problem> {
        Ok(options.number(name)?.map(|distance| distance * scale))
    };
    let point = |name| -> Result<Vec3, Problem> { Ok(options.needed_vector(name)? * scale) };
    let view = ViewPoint {
        eye: point("eye")?,
        target: point("target")?,
        fov_y_rad: options.needed_number("fov")?.to_radians(),
        near: options.needed_number("near")? * scale,
        far: options.needed_number("far")? * scale,
    };
    let mut setup = Setup::new(view, options.needed_vector("sun")?).map_err(Problem::Usage)?;
    if let Some(text) = options.text("size") {
        setup.size = size(text)?;
    }
    let distance = scaled("max-distance")?.unwrap_or(view.far);
    setup.cascades = harness::cascades(
        options.whole("cascades", 1, 4)?.unwrap_or(4),
        [view.near, distance],
        scaled("first-cascade-far")?,
        options.number("overlap")?.unwrap_or(BEVYS_OVERLAP),
    )
    .map_err(Problem::Usage)?;
    let map_size = options.whole("map-size", 1, MAX_SIDE as usize)?.map(|side| side as u32);
    setup.map_size = map_size.unwrap_or(setup.map_size);
    if !setup.map_size.is_power_of_two() {
        return Err(wrong("map-size", &format!("must be a power of two, is {}", setup.map_size)));
    }

    let umbrage = options.text("umbrage").unwrap_or("off");
    let (kind, side) = harness::umbrage(umbrage).map_err(|e| wrong("umbrage", &e))?;
    setup.umbrage = kind;
    if let Some(side) = side {
        if map_size.is_some_and(|given| given != side) {
            eprintln!(
                "--umbrage {umbrage} asks for maps of {side}² texels each, so --map-size {} is \
                 not used",
                setup.map_size
            );
        }
        setup.map_size = side;
    }
    let filter = options.text("filter").unwrap_or("gaussian");
    setup.filter = harness::filter(filter).map_err(|e| wrong("filter", &e))?;
    setup.depth_bias = options.number("depth-bias")?.unwrap_or(setup.depth_bias);
    setup.normal_bias = options.number("normal-bias")?.unwrap_or(setup.normal_bias);
    Ok(Args {
        scene: options.needed("scene")?.into(),
        out: options.needed("out")?.into(),
        setup,
        umbrage: umbrage.to_owned(),
        filter: filter.to_owned(),
        world_scale: scale,
        frames: options.whole("frames", 1, 100_000)?.unwrap_or(20),
        warmup: options.whole("warmup", 2, 100_000)?.unwrap_or(4),
    })
}

fn size(text: &str) -> Result<[u32; 2], Problem> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.filter(|sides: &[u32; 2]| sides.iter().all(|s| (1..=MAX_SIDE).contains(s))).ok_or_else(
        || wrong("size", &format!("must be WxH of 1 to {MAX_SIDE} pixels each, is {text:?}")),
    )
}

fn save(folder: &Path, name: &str, [w, h]: [u32; 2], pixels: Vec<u8>) -> Result<(), Problem> {
    let path = folder.join(name);
    let failed = |why: String| Problem::Failure(format!("{}: {why}", path.display()));
    let picture = image::GrayImage::from_raw(w, h, pixels);
    let picture = picture.ok_or_else(|| failed("too few pixels were read back".into()))?;
    picture.save(&path).map_err(|e| failed(e.to_string()))
}

fn srgb(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = match linear {
        ..=0.003_130_8 => 12.92 * linear,
        _ => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
    };
    (encoded * 255.0).round() as u8
}

fn statistics(ms: &[f64]) -> serde_json::Value {
    let thousandths = |ms: f64| (ms * 1000.0).round() / 1000.0;
    serde_json::json!({
        "frames": ms.len(),
        "median_ms": harness::median(ms).map(thousandths),
        "min_ms": ms.iter().copied().reduce(f64::min).map(thousandths),
        "max_ms": ms.iter().copied().reduce(f64::max).map(thousandths),
    })
}
